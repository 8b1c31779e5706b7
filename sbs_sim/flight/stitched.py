"""Stitched models: trims and linear models of many steady flights as one nonlinear model (theory.md section 10).

`sbs_sim.analysis.stitched.stitch` makes them. Source of the idea: E. L. Tobias, M. B. Tischler: A model stitching
architecture for continuous full flight-envelope simulation of fixed-wing aircraft and rotorcraft from discrete-point
linear models, US Army AMRDEC Special Report RDMR-AF-16-01, 2016.
"""

from __future__ import annotations  # `help` then shows types by their names

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.content import ByContent
from sbs_sim.errors import SimulationError
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, to_body
from sbs_sim.model.solve import solve
from sbs_sim.model.stitched import (
    DOWN_SIZE,
    MOTION_SIZE,
    POWERS,
    QUAD,
    QUADS,
    STAGES,
    StitchedMemory,
    Stitches,
    U,
    W,
    fly_stitched,
)

Array = NDArray[np.float64]

ROUNDING = 0.05  # m/s that a speed may be beyond the anchors without a warning
MOTION_NAMES = ("u", "v", "w", "p", "q", "r")
LOADS = {  # of a rotor, and their units, in the order of `sbs_sim.model.records`
    "thrust": "N",
    "torque": "N m",
    **{f"hub_force_{axis}": "N" for axis in "xyz"},
    **{f"hub_moment_{axis}": "N m" for axis in "xyz"},
}


@dataclass(frozen=True, eq=False)
class StitchedModel(ByContent):
    """Linear models of steady flights, stitched to a nonlinear one.

    Everything is over anchors: steady flights at some airspeeds, in rows of one climb rate. z are the six motions u, v,
    w, p, q, r relative to the air, then the kept states, then the inputs: those swashplate angles that are used.

    Attributes
    ----------
    aircraft : Aircraft
        It does not count where models are compared.
    parameter_hash : str
        Of the aircraft, see `Aircraft.parameter_hash`.
    lead_lag, cyclic_inflow : bool
    azimuth_count : int
        Of the trims and linear models.
    kept : tuple of str
        States beside those of the body; all others have settled.
    inputs : ndarray of int64, shape (n_inputs,)
        Indices of the inputs in the raveled swashplate angles.
    airspeeds : ndarray, shape (n_anchors,)
        [m/s]
    climb_rates : ndarray, shape (n_rows,)
        Rising [m/s].
    trims, trim_slopes : ndarray, shape (n_rows, n_anchors, 3 + n_z)
        Direction down in body axes, and z; and their derivatives by u along the trims of a row.
    matrices : ndarray, shape (n_rows, n_anchors, 6 + n_kept, n_z)
        Derivatives of specific force, moments over inertia and rates of the kept states by z.
    output_trims, output_slopes : ndarray, shape (n_rows, n_anchors, n_outputs)
        Loads of all rotors, see `sbs_sim.model.records`, then the states that have settled.
    output_matrices : ndarray, shape (n_rows, n_anchors, n_outputs, n_z)
    residuals : ndarray, shape (n_rows, n_anchors)
        Of the trims, see `TrimPoint.residual`.
    fastest : float
        Largest magnitude of a pole at the anchors [rad/s].
    warnings : tuple of str
        Where the trims are beyond the validity of the model, a line each.
    """

    aircraft: Aircraft = field(compare=False)
    parameter_hash: str
    lead_lag: bool
    cyclic_inflow: bool
    azimuth_count: int
    kept: tuple[str, ...]
    inputs: NDArray[np.int64]
    airspeeds: Array
    climb_rates: Array
    trims: Array
    trim_slopes: Array
    matrices: Array
    output_trims: Array
    output_slopes: Array
    output_matrices: Array
    residuals: Array
    fastest: float
    warnings: tuple[str, ...]

    @property
    def speeds(self) -> Array:
        """x-velocity at the anchors relative to the air, shape (n_rows, n_anchors) [m/s]."""
        return self.trims[..., DOWN_SIZE + U]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Of linear models: the body's, then those that are kept."""
        return S.LINEAR_BODY_NAMES + self.kept

    @cached_property
    def settled(self) -> tuple[str, ...]:
        """States that have settled, in the order of the outputs behind the loads."""
        used = [name for name in self.aircraft.layout.linear_names[S.LINEAR_BODY_SIZE :] if self._is_used(name)]
        return tuple(name for name in used if name not in self.kept)

    def _is_used(self, name: str) -> bool:
        part = S.part_of(name)
        if part.family == "lag":
            return self.lead_lag
        return part.family != "inflow" or part.harmonic == 0 or self.cyclic_inflow

    @cached_property
    def z_names(self) -> tuple[str, ...]:
        """Names of z: motions, kept states, and inputs by rotor, surface or control."""
        rows = self.aircraft.rows
        inputs = [(rows[i // S.ROW], rows[i // S.ROW].names[i % S.ROW]) for i in self.inputs]
        return (*MOTION_NAMES, *self.kept, *(f"{row.owner} {name}" for row, name in inputs))

    @cached_property
    def z_units(self) -> tuple[str, ...]:
        """Units of z."""
        layout = self.aircraft.layout
        units = dict(zip(layout.linear_names, layout.linear_units, strict=True))
        inputs = (self.aircraft.rows[i // S.ROW].unit for i in self.inputs)
        return (*(units[name] for name in (*MOTION_NAMES, *self.kept)), *inputs)

    @cached_property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs: loads of each rotor, and states that have settled."""
        rotors = range(1, len(self.aircraft.rotors) + 1)
        return (*(f"{name}({j})" for j in rotors for name in LOADS), *self.settled)

    @cached_property
    def output_units(self) -> tuple[str, ...]:
        """Units of the outputs."""
        layout = self.aircraft.layout
        units = dict(zip(layout.linear_names, layout.linear_units, strict=True))
        return (*tuple(LOADS.values()) * len(self.aircraft.rotors), *(units[name] for name in self.settled))

    @cached_property
    def places(self) -> NDArray[np.int64]:
        """Indices in the simulation state of the body and the kept states, shape (13 + n_kept,)."""
        names = self.aircraft.layout.names
        return np.array([*range(S.BODY_SIZE), *map(names.index, self.kept)])

    @cached_property
    def settled_places(self) -> NDArray[np.int64]:
        """Indices in the simulation state of what has settled."""
        names = self.aircraft.layout.names
        return np.array([names.index(name) for name in self.settled], dtype=np.int64)

    @cached_property
    def stitches(self) -> Stitches:
        """What compiled code takes."""
        speeds = np.ascontiguousarray(self.speeds)
        inertia = np.array(self.aircraft.body.inertia, dtype=float)
        slopes = (_parabolas(speeds, values) for values in (self.matrices, self.output_matrices))
        matrices, outputs = (
            _blocks(_cubics(speeds, values, own))
            for values, own in zip((self.matrices, self.output_matrices), slopes, strict=True)
        )
        return Stitches(
            speeds=speeds,
            trims=_cubics(speeds, self.trims, self.trim_slopes),
            matrices=matrices,
            output_trims=_cubics(speeds, self.output_trims, self.output_slopes),
            output_matrices=outputs,
            inertia=inertia,
            inverse_inertia=solve(inertia, np.eye(3)),
            gravity=np.array([self.aircraft.environment.gravity]),
            quads=QUADS,
        )

    def warnings_at(self, state: Array, wind: Array) -> tuple[str, ...]:
        """Where the model does not hold in a flight, a line each: what its trims warn of, and speeds beyond these."""
        air = to_body(state[np.newaxis, S.ATTITUDE : S.VELOCITY], wind[np.newaxis])[0, 0]
        speed, low, high = float(state[S.VELOCITY] - air), float(self.speeds.min()), float(self.speeds.max())
        if low - ROUNDING <= speed <= high + ROUNDING:
            return self.warnings
        return (*self.warnings, f"x-velocity {speed:.1f} m/s beyond {low:.1f} to {high:.1f} m/s of the stitched model")

    def memory(self) -> StitchedMemory:
        """Memory of a flight."""
        z, size = self.matrices.shape[-1], S.BODY_SIZE + len(self.kept)
        blocks, outputs = self.stitches.matrices.shape[2], self.stitches.output_matrices.shape[2]
        return StitchedMemory(
            z=np.zeros(z),
            y=R.aligned((blocks, QUAD), float),
            outputs=R.aligned((outputs, QUAD), float),
            levels=np.zeros(len(self.climb_rates)),
            stage=np.zeros(size),
            last=np.zeros(size),
            slopes=np.zeros((STAGES, size)),
        )

    # ------------------------------------------------------------------------------------------- what it says

    def rates(self, state: ArrayLike, swashplate: ArrayLike, wind: ArrayLike = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
        """Rates of the state, and outputs.

        Parameters
        ----------
        state : array_like, shape (size,)
            Simulation state of the aircraft; states that have settled do not count.
        swashplate : array_like, shape (n_rows, 3)
            See `Aircraft.mix`.
        wind : array_like, shape (3,)
            NED [m/s].

        Returns
        -------
        rates : ndarray, shape (13 + n_kept,)
            Of the body, as in a simulation state, and of the kept states.
        outputs : ndarray, shape (n_outputs,)
            Loads of the rotors, then the states that have settled.
        """
        x = np.ascontiguousarray(np.asarray(state, dtype=float)[self.places])
        angles = np.ravel(np.asarray(swashplate, dtype=float))[self.inputs]
        memory, air = self.memory(), np.array([wind], dtype=float)
        states, forces, outputs = np.zeros((1, len(x))), np.zeros((1, 3)), np.zeros((1, self.output_trims.shape[-1]))
        bounds, done = np.full(len(x), np.inf), np.zeros(3, dtype=np.int64)
        fly_stitched(
            *(self.stitches, x, angles[np.newaxis], air, 0, 0, 1, 1.0, 1, bounds, memory),
            *(states, forces, outputs, done),
        )
        return memory.slopes[0].copy(), outputs[0]

    def trim(self, airspeed: float = 0.0, climb_rate: float = 0.0) -> tuple[Array, Array]:
        """State and swashplate angles of the steady flight at an airspeed, in a row of climb.

        Parameters
        ----------
        airspeed : float
            Within those of the anchors [m/s].
        climb_rate : float
            One of `climb_rates` [m/s].

        Returns
        -------
        state : ndarray, shape (size,)
            At the origin, heading north.
        swashplate : ndarray, shape (n_rows, 3)

        Raises
        ------
        SimulationError
            A value out of range.
        """
        low, high = float(self.airspeeds[0]), float(self.airspeeds[-1])
        airspeed = checks.number("airspeed", airspeed, low, high, "m/s", SimulationError)
        rows = np.flatnonzero(self.climb_rates == climb_rate)
        if len(rows) != 1:
            allowed = ", ".join(f"{rate:g}" for rate in self.climb_rates)
            raise SimulationError(f"climb_rate = {checks.shown(climb_rate)}: allowed are {allowed} m/s")
        row = int(rows[0])
        speed = self._speed_at(row, airspeed)
        k, t, _ = self._interval(row, speed)
        values = _powers(t) @ self.stitches.trims[row, k]
        down, z = values[:DOWN_SIZE], values[DOWN_SIZE:]
        swash = np.zeros(len(self.aircraft.rows) * S.ROW)
        swash[self.inputs] = z[MOTION_SIZE + len(self.kept) :]
        state = np.zeros(self.aircraft.layout.size)
        state[S.ATTITUDE : S.VELOCITY] = _level_quaternion(down)
        state[S.VELOCITY : S.BODY_SIZE] = z[:MOTION_SIZE]
        state[self.places[S.BODY_SIZE :]] = z[MOTION_SIZE : MOTION_SIZE + len(self.kept)]
        outputs = _powers(t) @ self.stitches.output_trims[row, k]
        state[self.settled_places] = outputs[len(outputs) - len(self.settled) :]
        return state, swash.reshape(-1, S.ROW)

    def by_z(self, motion: Array, kept: Array, angles: Array) -> Array:
        """Derivatives of specific force, moments and rates of the kept states by z, shape (6 + n_kept, n_z)."""
        z = np.concatenate([motion, kept, angles])
        parts = [self._row_by_z(row, z) for row in range(len(self.climb_rates))]
        if len(parts) == 1:
            return parts[0][1]
        levels = np.array([level for _, _, level, _ in parts])
        row = 0
        while row < len(parts) - 2 and motion[W] < levels[row + 1]:
            row += 1
        gap = levels[row] - levels[row + 1]
        share = min(max((levels[row] - motion[W]) / gap, 0.0), 1.0)
        weight, slope = share * share * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share) / gap
        (force, matrix, _, level_slope), (other_force, other, _, other_slope) = parts[row : row + 2]
        found = (1.0 - weight) * matrix + weight * other
        found[:, W] -= slope * (other_force - force)
        found[:, U] += slope * (level_slope - share * (level_slope - other_slope)) * (other_force - force)
        return found

    def _row_by_z(self, row: int, z: Array) -> tuple[Array, Array, float, float]:
        """What one row says: values, their derivatives by z, the z-velocity of its trim and its derivative by u."""
        k, t, beyond = self._interval(row, z[U])
        width = self.speeds[row, k + 1] - self.speeds[row, k]
        c, m = self.stitches.trims[row, k], _unblocked(self.stitches.matrices[row, k], self.matrices.shape[2])
        inside = beyond == 0.0
        trim, trim_slope = _powers(t) @ c, (_slopes(t) @ c / width if inside else np.zeros(c.shape[1]))
        matrix = np.tensordot(_powers(t), m, 1)
        departure = z - trim[DOWN_SIZE:]
        departure[U] = beyond
        value = matrix @ departure
        value[:DOWN_SIZE] -= self.aircraft.environment.gravity * trim[:DOWN_SIZE]
        found = matrix.copy()
        if inside:
            departure_slope = -trim_slope[DOWN_SIZE:]
            departure_slope[U] = 0.0
            found[:, U] = matrix @ departure_slope + np.tensordot(_slopes(t), m, 1) @ departure / width
            found[:DOWN_SIZE, U] -= self.aircraft.environment.gravity * trim_slope[:DOWN_SIZE]
        return value, found, float(trim[DOWN_SIZE + W]), float(trim_slope[DOWN_SIZE + W])

    def _interval(self, row: int, speed: float) -> tuple[int, float, float]:
        """See `sbs_sim.model.stitched.interval`."""
        own = self.speeds[row]
        k = int(np.clip(np.searchsorted(own, speed, side="right") - 1, 0, len(own) - 2))
        held = min(max(speed, own[0]), own[-1])
        return k, float((held - own[k]) / (own[k + 1] - own[k])), float(speed - held)

    def _speed_at(self, row: int, airspeed: float) -> float:
        """x-velocity of the trim whose horizontal velocity is an airspeed."""
        low, high = self.speeds[row, 0], self.speeds[row, -1]
        for i, own in enumerate(self.airspeeds):
            if own == airspeed:
                return float(self.speeds[row, i])
        for _ in range(60):
            middle = 0.5 * (low + high)
            k, t, _ = self._interval(row, middle)
            values = _powers(t) @ self.stitches.trims[row, k]
            down, velocity = values[:DOWN_SIZE] / np.linalg.norm(values[:DOWN_SIZE]), values[DOWN_SIZE : DOWN_SIZE + 3]
            along = velocity - down * (down @ velocity)
            ahead = np.array([1.0, 0.0, 0.0]) - down * down[0]
            low, high = (middle, high) if along @ ahead / np.linalg.norm(ahead) < airspeed else (low, middle)
        return 0.5 * (low + high)


def _level_quaternion(down: Array) -> Array:
    """Attitude that heads north, of a direction down in body axes."""
    x, y, z = (down / np.linalg.norm(down)).tolist()
    return euler_to_quaternion(0.0, float(-np.arcsin(x)), float(np.arctan2(y, z)))


def _powers(t: float) -> Array:
    return np.array([1.0, t, t * t, t * t * t])


def _slopes(t: float) -> Array:
    return np.array([0.0, 1.0, 2.0 * t, 3.0 * t * t])


def _cubics(speeds: Array, values: Array, slopes: Array) -> Array:
    """Coefficients of Hermite's cubics, shape (n_rows, n_anchors - 1, 4, ...), over the share of an interval."""
    width = np.diff(speeds).reshape(*speeds.shape[:1], -1, *[1] * (values.ndim - 2))
    rise, first, last = values[:, 1:] - values[:, :-1], width * slopes[:, :-1], width * slopes[:, 1:]
    return np.stack([values[:, :-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise], axis=2)


def _parabolas(speeds: Array, values: Array) -> Array:
    """Slopes at the anchors of parabolas through three of them, in the shape of the values."""
    width = np.diff(speeds).reshape(*speeds.shape[:1], -1, *[1] * (values.ndim - 2))
    secants = np.diff(values, axis=1) / width
    if secants.shape[1] == 1:
        return np.concatenate([secants, secants], axis=1)
    left, right = width[:, :-1], width[:, 1:]
    inner = (right * secants[:, :-1] + left * secants[:, 1:]) / (left + right)
    first, last = 2.0 * secants[:, :1] - inner[:, :1], 2.0 * secants[:, -1:] - inner[:, -1:]
    return np.concatenate([first, inner, last], axis=1)


def _blocks(cubics: Array) -> Array:
    """Coefficients of matrices, (n_rows, n_intervals, 4, h, n_z), in blocks: (..., h / 4, n_z, 4 powers, 4 rows)."""
    rows, intervals, powers, height, width = cubics.shape
    count = -(-height // QUAD)
    made = R.aligned((rows, intervals, count, width, powers, QUAD), float)
    for n in range(height):
        made[:, :, n // QUAD, :, :, n % QUAD] = np.moveaxis(cubics[:, :, :, n], 2, 3)
    return made


def _unblocked(blocks: Array, height: int) -> Array:
    """Coefficients by powers, shape (4, h, n_z), of those in blocks, (n_blocks, n_z, 4, 4)."""
    return np.array([[blocks[n // QUAD, :, power, n % QUAD] for n in range(height)] for power in range(POWERS)])
