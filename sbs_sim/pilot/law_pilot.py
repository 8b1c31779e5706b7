"""A control law outside of compiled flights: state by state, as nodes and `simulate_with_pilot` ask for controls."""

from __future__ import annotations  # `help` then shows types by their names

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.errors import PilotError
from sbs_sim.flight import measured as M
from sbs_sim.flight.controller import ON_GRID, Controller
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler, to_body
from sbs_sim.pilot.hover_hold import checked_body

Array = NDArray[np.float64]


class LawPilot:
    """The law of a controller in flight: give it every state, it gives the controls.

    Errors of sensors, delay and lag are those of the flight itself here, not those of the controller.

    Parameters
    ----------
    controller : Controller
    initial : array_like, shape (n_controls,)
        Controls before the first call.
    wind : array_like, shape (3,)
        Velocity of the air, NED [m/s], as far as it is known: measurements against the air are made of it.

    Attributes
    ----------
    memory, parameters, latest : ndarray
        What the law keeps, its numbers, which may be changed between calls, and its latest controls.
    """

    def __init__(self, controller: Controller, initial: ArrayLike, wind: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        checks.instance("controller", controller, Controller, PilotError)
        self._controller, self._initial = controller, checks.array("initial", initial, PilotError)
        self._wind = checks.array("wind", wind, PilotError)
        self.parameters = np.array(controller.parameters, dtype=float)
        self.restart()

    def restart(self) -> None:
        """Forget what the law keeps."""
        self.memory = np.array(self._controller.memory, dtype=float)
        self.latest = self._initial.copy()
        self._time = -np.inf

    def controls(self, time: float, body: ArrayLike) -> Array:
        """Pilot controls, shape (n_controls,), of a state.

        Parameters
        ----------
        time : float
            Of the state [s]; where it goes back, everything begins anew. Between two calls of the law, which are a
            period apart, the controls stay.
        body : array_like
            Simulation state, or its first 13 values.

        Raises
        ------
        PilotError
            A value that is not finite, in the state or in the controls of the law.
        """
        values = checked_body(time, body)
        if time < self._time:
            self.restart()
        period = self._controller.period
        if time - self._time >= period * (1.0 - ON_GRID):
            self._time, given = time, self.latest.copy()
            self._controller.law(float(time), measured_of(values, self._wind), self.memory, self.parameters, given)
            if not np.all(np.isfinite(given)):
                raise PilotError(f"controls = {checks.shown(given.tolist())}: allowed are finite numbers")
            self.latest = given
        return self.latest.copy()

    __call__ = controls


def measured_of(body: Array, wind: Array) -> Array:
    """What a law measures of the first 13 values of a state, shape (COUNT,), in a wind, NED [m/s]."""
    attitude = body[S.ATTITUDE : S.VELOCITY]
    heading, pitch, roll = quaternion_to_euler(attitude)
    found = np.empty(M.COUNT)
    found[M.NORTH : M.DOWN + 1] = body[: S.ATTITUDE]
    found[[M.ROLL, M.PITCH, M.HEADING]] = roll, pitch, heading
    found[M.U : M.R + 1] = body[S.VELOCITY : S.BODY_SIZE]
    found[M.U_AIR :] = found[M.U : M.W + 1] - to_body(attitude[np.newaxis], np.asarray(wind)[np.newaxis])[0]
    return found
