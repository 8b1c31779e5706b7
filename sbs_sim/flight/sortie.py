"""A whole flight under commands, alone or side by side with others."""

from __future__ import annotations  # `help` then shows types by their names

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.concurrency import interruption
from sbs_sim.errors import SimulationError
from sbs_sim.flight.actuation import Direct, Mixed, commanded_angles
from sbs_sim.flight.closed_loop import ClosedLoop, OwnLoop
from sbs_sim.flight.controller import Controller
from sbs_sim.flight.controls import Commands, check_rows, command
from sbs_sim.flight.engine_failure import EngineFailure, failures_by_tick
from sbs_sim.flight.formation import Flown, Formation
from sbs_sim.flight.history import History, named_histories
from sbs_sim.flight.power_balance import check_balance, named_balance, power_balance
from sbs_sim.flight.records import Rows
from sbs_sim.flight.simulation import Simulation, ground_level, ground_of
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight.validity import flight_warnings
from sbs_sim.model import state as S
from sbs_sim.model.air import ELEMENTS
from sbs_sim.model.records import CONTACT, FUSELAGE, INTEGER, SCHEDULE, SURFACE, Model
from sbs_sim.model.wind import Wind

Array = NDArray[np.float64]

# Ticks that whole flights take in one call, and elements of blades in all steps of these: a tenth of a second, in which
# no interruption is heard.
BLOCK, BLOCK_ELEMENTS = 1000, 3_500_000


class Sortie:
    """A flight under commands: what it is to be, and what became of it.

    Parameters
    ----------
    aircraft, start, controls, duration, wind, actuators, events
        See `simulate`.
    every : int
        Ticks from one row of the histories to the next.
    loaded : bool
        False leaves "acceleration", "thrust", "torque", "power" and "V" out.
    balanced : bool
        True adds the balance of power, of a flight that is loaded.
    **options :
        The others of `Simulation`.

    Raises
    ------
    SimulationError
        The flight cannot begin.

    Attributes
    ----------
    simulation : Simulation
    ticks : int
        Of the whole flight.
    fault : SimulationError or None
        Why it has ended early.
    """

    def __init__(
        self,
        aircraft: Aircraft,
        start: TrimPoint | ArrayLike,
        controls: Commands | Controller,
        duration: float,
        *,
        every: int = 1,
        loaded: bool = True,
        balanced: bool = False,
        wind: Wind | None = None,
        actuators: bool = False,
        events: Sequence[EngineFailure] = (),
        **options: Any,
    ) -> None:
        checks.instance("aircraft", aircraft, Aircraft, SimulationError)
        if balanced:
            check_balance(aircraft)
        duration = checks.number("duration", duration, 0.0, 1e6, "s", SimulationError)
        actuators = checks.flag("actuators", actuators, SimulationError)
        air = Wind() if wind is None else wind
        checks.instance("wind", air, Wind, SimulationError)
        state: ArrayLike
        if isinstance(start, TrimPoint):
            ground = ground_of(aircraft, options.get("ground_altitude"))
            state = trimmed_state(aircraft, start, wind=air.velocity_at(-ground_level(ground)))
        else:
            state = start
        self.loop: OwnLoop | None = None
        initial = start.swashplate if isinstance(start, TrimPoint) else None
        if isinstance(controls, Controller):
            trimmed = (start.controls, start.swashplate) if isinstance(start, TrimPoint) else None
            self.loop = OwnLoop(aircraft, controls, trimmed)
            self.simulation = Simulation(aircraft, state, self.loop.position, wind=air, **options)
            self.loop.structure(self.simulation.tick)  # checks times
        else:
            pilot_command = command(aircraft, controls)
            self._pilot = (Mixed if actuators else Direct)(aircraft, pilot_command, initial)
            angles = self._pilot.angles(pilot_command(0, 0.0), 0.0)
            self.simulation = Simulation(aircraft, state, angles, wind=air, **options)
        self.ticks = round(duration / self.simulation.tick)
        if not isinstance(controls, Controller):
            check_rows(controls, self.ticks, self.simulation.tick)
        self.failures = failures_by_tick(self.simulation, events)
        self.every, self.loaded, self.balanced = every, loaded, balanced
        self.fault: SimulationError | None = None
        self._blocks: list[tuple[Rows, Array]] = []
        self._air: list[Array] = []
        self._looks: list[Array] = []
        self._given, self._begin = np.empty(0), 0
        self._wrong: SimulationError | None = None

    def commanded(self, begin: int, end: int) -> Array:
        """Swashplate angles [rad] of ticks, as many as there are right commands for."""
        self._given, angles, self._wrong = commanded_angles(self.simulation, self._pilot, begin, end)
        self._begin = begin
        return angles

    def accept(self, given: Array, wrong: SimulationError | None, begin: int) -> None:
        """Take over the controls of a law in ticks from `begin` on, (n, n_controls), and what was wrong after them."""
        self._given, self._wrong, self._begin = given, wrong, begin

    @property
    def has_controls(self) -> bool:
        """True if the first of the ticks that are flown has right controls."""
        return len(self._given) > 0

    @property
    def structure(self) -> Any:
        """What flights that are flown side by side have in common."""
        own = None if self.loop is None else self.loop.structure(self.simulation.tick)
        return structure(self.simulation), own

    def take(self, flown: Flown) -> None:
        """Take over what the ticks that were commanded have given."""
        ticks = flown.rows.step // self.simulation.steps_per_tick - self._begin
        count = int(np.count_nonzero(ticks < len(self._given)))
        self._blocks.append((flown.rows.first(count), self._given[ticks[:count]]))
        self._air.append(flown.air[:count])
        self._looks.append(flown.working[flown.watched < len(self._given)])
        self.fault = flown.fault if flown.ticks < len(self._given) else None
        self.fault = self.fault or self._wrong

    def end(self) -> None:
        """End where not even the first tick has a right command."""
        self.fault = self._wrong

    def result(self) -> tuple[History, SimulationError | None]:
        """Histories up to the last good tick, see `simulate`, and why the flight ended early, or None.

        Raises
        ------
        SimulationError
            Not even the first tick was flown.
        """
        if not self._blocks and self.fault is not None:
            raise self.fault
        aircraft = self.simulation.aircraft
        working = np.concatenate(self._looks)
        told = self._pilot.warnings(self.simulation.tick) if self.loop is None else self.loop.warnings()
        lines = (*flight_warnings(aircraft, working), *told)
        named = named_histories(aircraft, self._blocks, self.loaded)
        if self.balanced:
            named |= self._balance(named["state"], named["swashplate"])
        return History(named, lines), self.fault

    def _balance(self, states: Array, swashplates: Array) -> dict[str, Array]:
        """Histories of the balance of power by name."""
        steps, times = (np.concatenate([getattr(rows, name) for rows, _ in self._blocks]) for name in ("step", "time"))
        instants = states, swashplates, self.simulation.azimuths(steps), np.concatenate(self._air)
        noise = self.simulation.ring_noise(steps)
        return named_balance(power_balance(self.simulation.engine, *instants, noise, times))


def fly_together(sorties: Sequence[Sortie]) -> None:
    """Fly one flight, or several side by side, to their ends: each as it would on its own to the last bit.

    Parameters
    ----------
    sorties : sequence of Sortie
        One, or up to `sbs_sim.model.packing.lane_count()` with `structure` and ticks in common.
    """
    formation, first = Formation([sortie.simulation for sortie in sorties]), sorties[0]
    loops = [sortie.loop for sortie in sorties if sortie.loop is not None]
    loop = ClosedLoop(loops, formation.engine, first.simulation.tick) if loops else None
    size, last = _block(first.simulation, len(sorties)), first.ticks + 1
    cuts = {*range(0, last, size), *(tick for sortie in sorties for tick in sortie.failures if tick < last)}
    for begin, end in itertools.pairwise([*sorted(cuts), last]):
        interruption.look()
        for sortie in sorties:
            for failure in sortie.failures.get(begin, ()):
                sortie.simulation.fail_engine(failure.drive, failure.share)
        flying = [sortie.fault is None for sortie in sorties]
        if loop is None:
            flown = _commanded(sorties, formation, begin, end)
        else:
            flown = _controlled(sorties, formation, loop, begin, end)
        for lane, (sortie, own) in enumerate(zip(sorties, flown, strict=True)):
            if flying[lane] and own is not None:
                sortie.take(own)
            elif flying[lane]:
                sortie.end()
            if sortie.fault is not None:
                formation.retire(lane)
        if all(sortie.fault is not None for sortie in sorties):
            return


def _commanded(sorties: Sequence[Sortie], formation: Formation, begin: int, end: int) -> list[Flown | None]:
    """What ticks under commands give; None of a flight without a right command."""
    angles = [sortie.commanded(begin, end) if sortie.fault is None else np.empty(0) for sortie in sorties]
    most, first = max(map(len, angles)), sorties[0]
    if not most:
        return [None] * len(sorties)
    padded = [_padded(own, most, sortie.simulation) for own, sortie in zip(angles, sorties, strict=True)]
    flown = formation.fly(padded, min(most, first.ticks - begin), first.every, first.loaded)
    return [part if len(own) else None for part, own in zip(flown, angles, strict=True)]


def _controlled(
    sorties: Sequence[Sortie], formation: Formation, loop: ClosedLoop, begin: int, end: int
) -> list[Flown | None]:
    """What ticks under control laws give; None of a flight whose first controls are wrong."""
    first = sorties[0]
    memory = formation.engine.memory(end - begin, S.ROW * len(first.simulation.aircraft.rows))
    flown = formation.fly_by(loop.way, memory, min(end, first.ticks) - begin, first.every, first.loaded)
    found: list[Flown | None] = []
    for lane, (sortie, own) in enumerate(zip(sorties, flown, strict=True)):
        if sortie.fault is None:
            sortie.accept(*loop.given(lane, begin), begin)
        found.append(own if sortie.has_controls else None)
    return found


def _padded(angles: Array, count: int, simulation: Simulation) -> Array:
    """Angles of as many ticks; what is missing is of no meaning."""
    last = angles[-1] if len(angles) else simulation.swashplate
    return np.concatenate([angles.reshape(-1, *last.shape), np.tile(last, (count - len(angles), 1, 1))])


def structure(simulation: Simulation) -> Any:
    """What flights that are flown side by side have in common."""
    aircraft, model = simulation.aircraft, simulation.model
    blades = tuple(rotor.blades for rotor in aircraft.rotors)
    sections = tuple(tuple(map(id, tables)) for tables in aircraft.sections)
    of_rotors = (model.rotors[name] for name in ("drive", "duct", "teetering", "measured_descent"))
    drives = *of_rotors, *(model.drives[name] for name in ("engine", "free_wheel", "command_index"))
    return (
        *(blades, aircraft.options, sections, simulation.steps_per_tick, simulation.method),
        *(simulation.tick, simulation.step, _air_kind(simulation), model.switches.tobytes()),
        *(aircraft.layout.drives, *(part.tobytes() for part in drives), *_integers(model)),
    )


def _air_kind(simulation: Simulation) -> int:
    """0 for air that is the same everywhere, 1 where it is not, 2 where blade elements meet it."""
    return 0 if simulation.space is None else 1 + int(simulation.space.parameters[ELEMENTS, 0])


def _integers(model: Model) -> Iterator[bytes]:
    """What lanes have in common of surfaces, fuselages and schedules, and how many of them there are."""
    parts: tuple[Any, ...] = (SURFACE, model.surfaces), (FUSELAGE, model.fuselages)
    parts += (SCHEDULE, model.schedules), (CONTACT, model.contacts)
    for kind, records in parts:
        yield from (records[name].tobytes() for name, shape in kind.items() if shape is INTEGER)


def _block(simulation: Simulation, flights: int) -> int:
    """Ticks of a call that takes no longer than an interruption may wait."""
    elements = flights * simulation.aircraft.layout.blade_count * simulation.aircraft.options.elements
    return max(1, min(BLOCK, BLOCK_ELEMENTS // (simulation.steps_per_tick * elements)))
