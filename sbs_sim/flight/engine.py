"""Compiled code at work: one flight with its blades in the lanes, or as many flights as there are lanes."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model import records as R
from sbs_sim.model.air import joined_spaces
from sbs_sim.model.air_rows import air_rows
from sbs_sim.model.average import averaged_derivative
from sbs_sim.model.drive import driven_derivative
from sbs_sim.model.dynamics import derivative
from sbs_sim.model.integrate import RK4, STAGES, advance
from sbs_sim.model.kernel import address
from sbs_sim.model.linear import SPECIFIC_FORCE_SIZE, jacobian
from sbs_sim.model.state import BODY_SIZE, INFLOW_NAMES, LINEAR_BODY_SIZE
from sbs_sim.model.wind_columns import WIND_SIZE
from sbs_sim.model.working_state import WORKING_SIZE, working_state

Array = NDArray[np.float64]


class Code:
    """Machine code of the entries that other entries call, for one arrangement of lanes, with drives or without.

    Each is compiled, or taken from its cache, when it is first asked for: a trim makes no steps in time.

    Parameters
    ----------
    pattern : Engine
        Any of the arrangement.
    """

    def __init__(self, pattern: Engine) -> None:
        self._pattern = pattern

    @cached_property
    def derivative(self) -> Any:
        """`Engine.derivative`."""
        engine, tick = self._pattern, self._pattern.tick
        return address(
            engine.derivative,
            *(engine.model, tick.stage, engine.memory(3 * engine.rotors), tick.psi, tick.wind, engine.work),
            *(tick.slopes[0], True),
        )

    @cached_property
    def advance(self) -> Any:
        """`sbs_sim.model.integrate.advance`."""
        engine, tick = self._pattern, self._pattern.tick
        return address(
            advance,
            *(self.derivative, engine.model, tick.stage, engine.memory(3 * engine.rotors), tick.psi, 0, 1, 1.0),
            *(engine.memory(WIND_SIZE), RK4, engine.memory(engine.size + 1), engine.work, tick, tick.done),
            np.zeros(engine.n, dtype=np.int64),
        )

    @cached_property
    def working_state(self) -> Any:
        """`sbs_sim.model.working_state.working_state`."""
        engine = self._pattern
        return address(working_state, engine.model, engine.work, engine.memory(engine.rotors, WORKING_SIZE))


class Engine:
    """A model that is arranged for the processor, with the memory that it takes; for one thread.

    Parameters
    ----------
    model : Model
        As `Aircraft.arranged` gives it, or `side_by_side`.
    method : int, optional
        Of integration, see `sbs_sim.model.integrate`.
    exponential : Exponential, optional
        Matrices of the exponential method, with as many lanes.

    Attributes
    ----------
    work : Work
    tick : Tick
    n : int
        Flights, or states of one aircraft, side by side.
    size, rotors : int
        Of the state, and of the aircraft.
    """

    def __init__(self, model: R.Model, method: int = RK4, exponential: R.Exponential | None = None) -> None:
        self.model, self.work = model, R.make_work(model)
        if exponential is None:
            n, width = self._arrangement
            exponential = R.make_exponential([], [[]] * n, width)
        self.tick = R.make_tick(self.work, int(STAGES[method]), exponential)
        self.size, self.n = self.tick.stage.shape
        self._plain_wind, self._plain_space, self._no_gusts = self.tick.wind, self.tick.space, self.work.gusts
        self.rotors = len(self.tick.psi)

    def set_space(self, spaces: Sequence[R.Space | None]) -> None:
        """Fly through air that is not the same everywhere: of each flight, all or none; the last is for the others."""
        if spaces[0] is None:
            self.tick = self.tick._replace(wind=self._plain_wind, space=self._plain_space)
            self.work = self.work._replace(gusts=self._no_gusts)
            return
        space = joined_spaces(self.model, [one for one in spaces if one is not None], self.n)
        self.tick = self.tick._replace(wind=self.memory(air_rows(self.model)), space=space)
        self.work = self.work._replace(gusts=space.elements)

    @property
    def is_local(self) -> bool:
        """True for air that is not the same everywhere."""
        return len(self.tick.space.parameters) > 0

    @property
    def air_rows(self) -> int:
        """Rows of the air, see `sbs_sim.model.dynamics.derivative`."""
        return len(self.tick.wind)

    @cached_property
    def code(self) -> Code:
        """Machine code of this arrangement."""
        key = (*self._arrangement, len(self.model.drives) > 0)
        if key not in _codes:
            _codes[key] = Code(self)
        return _codes[key]

    @property
    def derivative(self) -> Any:
        """Entry with the equations: `sbs_sim.model.dynamics.derivative`, or `sbs_sim.model.drive.driven_derivative`."""
        return driven_derivative if len(self.model.drives) else derivative

    @property
    def _arrangement(self) -> tuple[int, int]:
        """Lanes of what belongs to a flight, and of what belongs to blades."""
        return self.model.air["density"].shape[-1], self.model.blades["rotor_speed"].shape[-1]

    def average(self, x: Array, swashplate: Array, psi: Array) -> tuple[Array, Array]:
        """Mean over azimuths, shape (count, n_rotors) [rad], in still air.

        Returns
        -------
        rates : ndarray, shape (size + 3,)
            Of the simulation state x, and the specific force of the c.g. [m/s^2].
        loads : ndarray, shape (n_rotors, LOAD_SIZE)
        """
        rates, loads = np.empty(len(x) + 3), np.empty(R.LOAD_SIZE * self.rotors)
        averaged_derivative(
            *(self.code.derivative, self.model, x, np.ravel(swashplate), psi, np.zeros(3), self.work, self.tick),
            *(rates, loads),
        )
        return rates, loads.reshape(self.rotors, -1)

    def jacobian(self, point: Array, rigging: Array, steps: Array, owners: NDArray[np.int64], psi: Array) -> Array:
        """Central differences of the outputs of `sbs_sim.model.linear`, of a model that is arranged by "points".

        Parameters
        ----------
        point, steps : ndarray, shape (m,)
            Linear state and controls, and half the distance of each pair of evaluations; 0 leaves a column alone.
        rigging : ndarray, shape (3 n_rows, n_controls + 1)
            Swashplate angles = rigging @ (controls, 1).
        owners : ndarray of int64, shape (linear_size,)
            See `Layout.linear_owners`.
        psi : ndarray, shape (n_azimuths, n_rotors)
            [rad]

        Returns
        -------
        ndarray, shape (n_azimuths, m, linear_size + 3 + 8 n_rotors)
            Transposed; columns that were left alone are zero.
        """
        outputs = len(owners) + SPECIFIC_FORCE_SIZE + R.LOAD_SIZE * self.rotors
        all_owners = np.append(owners, np.full(rigging.shape[1] - 1, self.rotors))
        for j, first in enumerate(self.model.rotors["inflow"] - BODY_SIZE + LINEAR_BODY_SIZE):
            all_owners[first : first + len(INFLOW_NAMES)] = inflow_owner(self.model, j)
        found = np.zeros((len(psi), len(point), outputs))
        jacobian(
            *(self.code.derivative, self.model, point, rigging, steps, all_owners, psi, self.work, self.tick),
            *(self.memory(len(point)), np.zeros((2, outputs)), np.zeros(self.n, dtype=np.int64), found),
        )
        return found

    def memory(self, *shape: int) -> Array:
        """Zeros with a last axis for the lanes."""
        return np.asarray(R.aligned((*shape, self.n), float))

    def lanes(self, arrays: Sequence[Array]) -> Array:
        """Arrays side by side, shape (..., n); what is missing are copies of the last."""
        made = self.memory(*arrays[0].shape)
        for lane in range(self.n):
            made[..., lane] = arrays[min(lane, len(arrays) - 1)]
        return made


def inflow_owner(model: R.Model, rotor: int) -> int:
    """Rotor whose blades alone the inflow of a rotor changes: its own, or with interference all, see `jacobian`."""
    return len(model.rotors) if model.switches["interference"][0] else rotor


def points_engine(model: R.Model) -> Engine:
    """The calling thread's engine of a model that is arranged by "points"; what is in it lasts until the next call."""
    kept: Engine | None = getattr(_own, "engine", None)
    if kept is None or kept.model is not model:
        kept = _own.engine = Engine(model)
    return kept


_own = threading.local()
_codes: dict[tuple[int, int, bool], Code] = {}
