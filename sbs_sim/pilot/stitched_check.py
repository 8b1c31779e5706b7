"""Manoeuvres of a stitched model beside those of the full one, under the same pilot."""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are

from sbs_sim.analysis.linear_model import settle
from sbs_sim.analysis.stitched import local_model
from sbs_sim.analysis.trim import solve_trim
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.history import History
from sbs_sim.flight.stitched import StitchedModel
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.model import state as S
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

Array = NDArray[np.float64]
OverTime = Callable[[float], float]

TICK = 0.02  # s
TOP, TURNING = 0.75, 0.5  # airspeeds of the manoeuvres over the last one of the model
SPEED_UP, SLOW_DOWN = 2.0, 3.0  # m/s^2
BANK, ROLL_TIME, TURN_TIME = math.radians(30.0), 1.0, 4.0  # rad, s, s
SETTLING = 1.0  # s, after a change of the airspeed
WEIGHTS, CONTROL_WEIGHT = (
    (0.3, 1.0, 1.0, 20.0, 0.3, 1.0, 20.0, 20.0),
    100.0,
)  # of u, w, q, theta, v, p, phi, r; controls
SLOWEST = 3.0  # m/s, below which a bank asks for no faster turn


class Manoeuvre(NamedTuple):
    """A flight from an airspeed [m/s] for a time [s] with an airspeed and a bank [rad] to follow."""

    name: str
    begin: float
    duration: float
    speed: OverTime
    bank: OverTime


class Difference(NamedTuple):
    """Largest differences of a stitched model from the full one in a manoeuvre.

    Attributes
    ----------
    name : str
    duration : float
        [s]
    pitch, roll : float
        Largest change in the manoeuvre of the full model [rad].
    velocity, attitude, controls : float
        Of u, v, w [m/s]; of pitch and roll [rad]; of the pilot controls [rad, or their units].
    power : float
        Of the power of all rotors, relative to its largest.
    """

    name: str
    duration: float
    pitch: float
    roll: float
    velocity: float
    attitude: float
    controls: float
    power: float


class SpeedPilot:
    """Follows an airspeed and a bank, by LQR with the linear models of a stitched model, the body alone.

    Parameters
    ----------
    model : StitchedModel

    Raises
    ------
    LinearizationError
        No gains at one of its airspeeds: the controls do not move the aircraft there.
    """

    def __init__(self, model: StitchedModel) -> None:
        self._layout = model.aircraft.layout
        self._airspeeds = model.airspeeds
        parts = [self._anchor(model, float(airspeed)) for airspeed in model.airspeeds]
        self._gains, self._states, self._controls = (np.array(column) for column in zip(*parts, strict=True))

    def _anchor(self, model: StitchedModel, airspeed: float) -> tuple[Array, Array, Array]:
        """Gains, state of the body and controls at an anchor."""
        state, swashplate = model.trim(airspeed)
        local, size = local_model(model, state, swashplate), S.LINEAR_BODY_SIZE
        a, b = local.a, local.b
        if len(a) > size:
            a, b, _, _ = settle(a, b, range(size))
        try:
            riccati = solve_continuous_are(a, b, np.diag(WEIGHTS), CONTROL_WEIGHT * np.eye(b.shape[1]))
        except np.linalg.LinAlgError:
            raise LinearizationError(f"at {airspeed:g} m/s: no gains of a pilot, see --no-check") from None
        controls = model.aircraft.unmix(swashplate)
        return b.T @ riccati / CONTROL_WEIGHT, self._layout.to_linear(state)[:size], controls

    def flying(
        self, speed: Callable[[float], float], bank: Callable[[float], float]
    ) -> Callable[[float, Array], Array]:
        """Pilot of time [s] and simulation state, who follows an airspeed [m/s] and a bank [rad] over time."""

        def asked(time: float, state: Array) -> Array:
            airspeed, roll = speed(time), bank(time)
            k = int(np.clip(np.searchsorted(self._airspeeds, airspeed) - 1, 0, len(self._airspeeds) - 2))
            share = (airspeed - self._airspeeds[k]) / (self._airspeeds[k + 1] - self._airspeeds[k])
            gains, states, controls = (
                (1.0 - share) * table[k] + share * table[k + 1] for table in (self._gains, self._states, self._controls)
            )
            turn = 9.81 * math.tan(roll) / max(airspeed, SLOWEST)  # the same for both models, whatever the gravity
            wanted = states.copy()
            wanted[[S.LINEAR_PHI, S.LINEAR_R, S.LINEAR_Q]] += roll, turn * math.cos(roll), turn * math.sin(roll)
            departure = self._layout.to_linear(state)[: S.LINEAR_BODY_SIZE] - wanted
            return np.asarray(controls - gains @ departure)

        return asked


def manoeuvres(model: StitchedModel) -> tuple[Manoeuvre, ...]:
    """Acceleration from the slowest flight, quick stop, and turn, for the airspeeds of a model."""
    slow = max(0.0, float(model.airspeeds[0]))
    top = max(TOP * float(model.airspeeds[-1]), slow)
    turning = max(TURNING * float(model.airspeeds[-1]), slow)
    up, down = (top - slow) / SPEED_UP + SETTLING, (top - slow) / SLOW_DOWN + SETTLING
    return (
        Manoeuvre("acceleration", slow, up, lambda t: min(slow + SPEED_UP * t, top), lambda t: 0.0),
        Manoeuvre("quick stop", top, down, lambda t: max(top - SLOW_DOWN * t, slow), lambda t: 0.0),
        Manoeuvre("turn", turning, TURN_TIME, lambda t: turning, lambda t: BANK * min(t / ROLL_TIME, 1.0)),
    )


def manoeuvre_differences(
    model: StitchedModel, flown: Sequence[Manoeuvre] | None = None, pilot: SpeedPilot | None = None
) -> list[Difference]:
    """Fly manoeuvres with a stitched model and with the full one.

    Parameters
    ----------
    model : StitchedModel
    flown : sequence of Manoeuvre, optional
        Those of `manoeuvres` if not given.
    pilot : SpeedPilot, optional
        The same for both; one with gains of the model if not given.

    Raises
    ------
    SbsError
        No gains, no trim, or a flight that cannot go on.
    """
    pilot, fidelity = pilot or SpeedPilot(model), Fidelity(model.lead_lag, model.cyclic_inflow, model.azimuth_count)
    options: dict[str, Any] = {"lead_lag": model.lead_lag, "cyclic_inflow": model.cyclic_inflow}
    found = []
    for one in manoeuvres(model) if flown is None else flown:
        start = solve_trim(model.aircraft, TrimCondition(one.begin), fidelity)
        asked = pilot.flying(one.speed, one.bank)
        full = simulate_with_pilot(model.aircraft, start, asked, one.duration, tick=TICK, **options)
        stitched = simulate_with_pilot(model.aircraft, start, asked, one.duration, tick=TICK, model=model)
        found.append(_difference(one, full, stitched))
    return found


def _difference(one: Manoeuvre, full: History, stitched: History) -> Difference:
    def most(names: Sequence[str]) -> float:
        return float(max(abs(full[name] - stitched[name]).max() for name in names))

    power = full["power"].sum(axis=1)
    return Difference(
        one.name,
        one.duration,
        float(np.ptp(full["theta"])),
        float(np.ptp(full["phi"])),
        most("uvw"),
        most(("theta", "phi")),
        most(("controls",)),
        float(abs(power - stitched["power"].sum(axis=1)).max() / power.max()),
    )
