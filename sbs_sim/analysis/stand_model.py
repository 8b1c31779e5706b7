"""Linear model of an aircraft on a stand (theory.md section 8.5)."""

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.differences import ATTITUDE_STEP, difference_steps, used_states
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.analysis.linear_outputs import load_outputs, relative_spread
from sbs_sim.flight.engine import points_engine
from sbs_sim.flight.trim_point import StandPoint
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler
from sbs_sim.model.linear import SPECIFIC_FORCE_SIZE

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

DEFLECTED = tuple(S.DEFLECTIONS)[:3]
DEFLECTION_UNITS = ("m", "m", "m", "rad", "rad", "rad")


class StandModel:
    """Derivatives of rates and outputs by deflections, linear states and controls of a stand.

    Inputs are the six deflections, the linear states, and the controls; columns and rows of what is locked or left out
    by the fidelity are not taken.
    """

    def __init__(self, aircraft: Aircraft, point: StandPoint, step_scale: float) -> None:
        self._aircraft, self._point, self._layout = aircraft, point, aircraft.layout
        self._x = point.simulation_state(aircraft.layout)
        size = np.array([aircraft.rotors[0].radius] * 3 + [1.0] * 3)
        self._steps = np.concatenate([step_scale * ATTITUDE_STEP * size, difference_steps(aircraft, step_scale)])
        self._names = (*S.DEFLECTIONS, *self._layout.linear_names, *aircraft.control_names)
        self._used = self._used_inputs()

    def _used_inputs(self) -> IntArray:
        """Indices of the inputs that are states of the model: free axes, their velocities, rotors, drives."""
        free = [axis for axis, flag in zip(S.DEFLECTIONS, self._aircraft.body.stand_free, strict=True) if flag]
        body = [self._names.index(name) for name in (*free, *(S.DEFLECTIONS[axis] for axis in free))]
        rest = [i for i in used_states(self._point).tolist() if i >= S.LINEAR_BODY_SIZE]
        return np.array([*body, *(len(S.DEFLECTIONS) + np.array(rest, dtype=np.int64))])

    def build(self) -> LinearModel:
        """The model."""
        aircraft, point = self._aircraft, self._point
        psi = azimuths(aircraft.passages, point.azimuth_count)
        controls = np.arange(len(self._names) - len(aircraft.controls), len(self._names))
        inputs = np.concatenate([self._used, controls])
        each = np.stack([self._column(i, psi) for i in inputs.tolist()], axis=-1)
        states = len(self._used)
        rates, rest = each[:, self._used], each[:, len(S.DEFLECTIONS) + self._layout.linear_size :]
        mean, steps = rates.mean(axis=0), self._steps[self._used]
        rows, names, units = load_outputs(aircraft, point, rest.mean(axis=0), [self._names[i] for i in inputs])
        identity = np.eye(states, len(inputs))
        own = tuple(self._names[i] for i in self._used)
        own_units = tuple(((*DEFLECTION_UNITS, *self._layout.linear_units))[i] for i in self._used)
        outputs = np.vstack([identity, rows])
        return LinearModel(
            a=mean[:, :states],
            b=mean[:, states:],
            c=outputs[:, :states],
            d=outputs[:, states:],
            state_names=own,
            state_units=own_units,
            control_names=aircraft.control_names,
            control_units=aircraft.control_units,
            control_axes=tuple(control.axis for control in aircraft.controls),
            output_names=(*own, *names),
            output_units=(*own_units, *units),
            steps=self._steps[inputs],
            trim=point,
            method="averaged",
            azimuth_spread=relative_spread(
                rates[:, :, :states] - mean[:, :states], mean[:, :states], steps / steps[:, None]
            ),
            spread=0.5 * np.ptp(rates, axis=0),
            parameter_hash=aircraft.parameter_hash,
            kinematics=np.zeros((S.LINEAR_BODY_SIZE, S.LINEAR_BODY_SIZE)),
        )

    def _column(self, number: int, psi: Array) -> Array:
        """Derivatives of all rates and outputs by one input at every azimuth, shape (n_azimuths, n)."""
        step = float(self._steps[number])
        after, before = (self._evaluate(*self._moved(number, change), psi) for change in (step, -step))
        return (after - before) / (2.0 * step)

    def _moved(self, number: int, change: float) -> tuple[Array, Array]:
        """State and swashplate angles with one input changed."""
        x, name, controls = self._x.copy(), self._names[number], self._point.controls
        if number >= len(self._names) - len(controls):
            controls = controls.copy()
            controls[self._aircraft.control_names.index(name)] += change
        elif name in DEFLECTED:
            x[S.POSITION + DEFLECTED.index(name)] += change
        elif name in S.DEFLECTIONS:
            angles = dict(zip(("yaw", "pitch", "roll"), quaternion_to_euler(x[S.ATTITUDE : S.VELOCITY]), strict=True))
            angles[name] += change
            x[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(angles["yaw"], angles["pitch"], angles["roll"])
        else:
            x[self._layout.names.index(name)] += change
        return x, self._aircraft.mix(controls)

    def _evaluate(self, x: Array, swash: Array, psi: Array) -> Array:
        """Rates of all inputs that are states, specific force and loads at every azimuth, shape (n_azimuths, n)."""
        engine = points_engine(self._aircraft.arranged(self._point.lead_lag, self._point.cyclic_inflow, "points"))
        found, slopes = [], engine.tick.slopes[0]
        state, angles, still_air = engine.lanes([x]), engine.lanes([swash.ravel()]), engine.memory(3)
        for first in range(0, len(psi), engine.n):
            part = psi[first : first + engine.n]
            places = engine.lanes(list(part))
            engine.derivative(engine.model, state, angles, places, still_air, engine.work, slopes, True)
            rows = np.vstack([self._rates(x, slopes), engine.work.acceleration_rows[:SPECIFIC_FORCE_SIZE],
                              engine.work.load_rows])  # fmt: skip
            found.append(rows[:, : len(part)].T)
        return np.concatenate(found)

    def _rates(self, x: Array, slopes: Array) -> Array:
        """Rates of deflections and of the linear state, shape (n, lanes)."""
        place = {name: i for i, name in enumerate(self._layout.names)}
        _, pitch, roll = quaternion_to_euler(x[S.ATTITUDE : S.VELOCITY])
        p, q, r = x[S.RATES : S.BODY_SIZE].tolist()
        across = q * np.sin(roll) + r * np.cos(roll)
        turning = {
            "roll": p + np.tan(pitch) * across,
            "pitch": q * np.cos(roll) - r * np.sin(roll),
            "yaw": across / np.cos(pitch),
        }
        turning |= {"phi": turning["roll"], "theta": turning["pitch"]}
        moving = dict(zip(DEFLECTED, slopes[S.POSITION : S.ATTITUDE], strict=True))
        moving |= {name: np.full(slopes.shape[1], rate) for name, rate in turning.items()}
        names = (*S.DEFLECTIONS, *self._layout.linear_names)
        return np.stack([moving[name] if name in moving else slopes[place[name]] for name in names])
