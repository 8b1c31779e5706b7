"""The paper's construction of A and B, term by term (eqs. [20] to [34]; theory.md section 9).

Forces, moments and forcing terms become Taylor series by central differences, eq. [21]; what turning axes and gravity
give is written down. The same physics as the averaged method on another way: both must agree to rounding of the
differences.

Of the rotor equations [13] and [14], K0 and K1 are constant, C0 and C1 hold the Coriolis coupling of flap and lag,
and E is what the model has beyond them. Of the inflow equations C^lambda is the gain at the present flow through the
disc. Rates of the coordinates vanish at trim, so derivatives of C1 do not appear.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.aircraft.model_records import second_moment
from sbs_sim.analysis.differences import used_states
from sbs_sim.analysis.kinematics import kinematics
from sbs_sim.analysis.linear_model import settle
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.frames import hub_axes, rotation_matrix
from sbs_sim.model.inflow import inflow_matrix
from sbs_sim.model.multiblade import blade_matrix

Array = NDArray[np.float64]

AXES = ([S.LINEAR_U, S.LINEAR_V, S.LINEAR_W], [S.LINEAR_P, S.LINEAR_Q, S.LINEAR_R])  # velocity, rates


def blocks(aircraft: Aircraft, point: TrimPoint, steps: Array) -> dict[str, Array]:
    """Matrices of the paper's construction.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    steps : ndarray, shape (linear_size + 4,)
        Half the distance of the differences.

    Returns
    -------
    dict of str to ndarray
        "A" (n, n), "B" (n, m); the nine blocks of eq. [22], "A_B-B" to "A_lambda-lambda" (rows are B the body, R flap,
        flap rates, lag, lag rates, lambda the inflow); "K0_beta", "K1_beta", "C0_beta", "C1_beta" and the same for xi
        at trim, block diagonal over the rotors; "A_R_first" (the first matrix of eq. [32], over the rotor states, with
        its last row in the order of eq. [14]), "A_R_second" (the second, over all states); "C_lambda" (C^lambda at
        trim), "A_lambda_second"; "A_quasi_static" (8, 8), rotor and inflow settled.
    """
    taylor = _TaylorTerms(aircraft, point)
    size = len(point.state)
    used = used_states(point)
    inputs = [*used, *range(size, size + len(point.controls))]
    slopes = taylor.slopes(steps, inputs)
    first = taylor.first_matrix()
    gain = taylor.inflow_gain(point.state)
    full = slopes.copy()
    full[: S.LINEAR_BODY_SIZE, : S.LINEAR_BODY_SIZE] += kinematics(
        point.state, aircraft.body.inertia, aircraft.environment.gravity
    )
    rotor, inflow = slice(S.LINEAR_BODY_SIZE, taylor.inflow_start), slice(taylor.inflow_start, size)
    full[rotor, rotor] += first
    full[inflow, inflow] += gain
    found = {"A": full[np.ix_(used, used)], "B": full[used, size:]}
    indices = {"B": used[used < rotor.start], "lambda": used[used >= inflow.start]}
    indices["R"] = np.setdiff1d(used, [*indices["B"], *indices["lambda"]])
    for row in ("B", "R", "lambda"):
        for column in ("B", "R", "lambda"):
            found[f"A_{row}-{column}"] = full[np.ix_(indices[row], indices[column])]
    found |= taylor.coupling_blocks()
    inside = indices["R"] - rotor.start
    found["A_R_first"] = first[np.ix_(inside, inside)]
    found["A_R_second"] = slopes[np.ix_(indices["R"], used)]
    within = indices["lambda"] - inflow.start
    found["C_lambda"] = gain[np.ix_(within, within)]
    found["A_lambda_second"] = slopes[np.ix_(indices["lambda"], used)]
    found["A_quasi_static"] = settle(found["A"], found["B"], range(S.LINEAR_BODY_SIZE))[0]
    return found


class _TaylorTerms:
    """What eqs. [13], [14], [16] and the inflow equations expand: all by the linear state and the controls."""

    def __init__(self, aircraft: Aircraft, point: TrimPoint) -> None:
        self.aircraft, self.point, self.layout = aircraft, point, aircraft.layout
        self.trim = np.concatenate([point.state, point.controls])
        self.inflow_start = S.LINEAR_BODY_SIZE + 4 * self.layout.blade_count
        self._engine = Engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "points"))
        self._psi = azimuths(aircraft.passages, point.azimuth_count)
        self._constant = [self._turning(rotor) for rotor in aircraft.rotors]
        self._at_trim = [self._coupling(j, point.state[self._rotor_slices(j)[0]]) for j in range(len(aircraft.rotors))]

    def _rotor_slices(self, rotor: int) -> list[slice]:
        """Indices of one rotor's flap, flap rates, lag, lag rates in the linear state."""
        shift = S.LINEAR_BODY_SIZE - S.BODY_SIZE
        found = (self.layout.flap, self.layout.flap_rate, self.layout.lag, self.layout.lag_rate)
        return [slice(where(rotor).start + shift, where(rotor).stop + shift) for where in found]

    def _inflow_slice(self, rotor: int) -> slice:
        return slice(self.inflow_start + 3 * rotor, self.inflow_start + 3 * rotor + 3)

    def slopes(self, steps: Array, inputs: Sequence[int]) -> Array:
        """Central differences, eq. [21], of `expanded`; shape (linear_size, linear_size + 4)."""
        result = np.zeros((self.layout.linear_size, len(self.trim)))
        for i in inputs:
            forward, backward = self.trim.copy(), self.trim.copy()
            forward[i] += steps[i]
            backward[i] -= steps[i]
            result[:, i] = (self.expanded(forward) - self.expanded(backward)) / (2 * steps[i])
        return result

    def expanded(self, inputs: Array) -> Array:
        """F/m, I^-1 M, C0 xi0 + E of flap, C0 beta0 + E of lag, C^lambda lambda0 + E, in the linear state's order."""
        state, rates = inputs[: self.layout.linear_size], self._rates(inputs)
        result = np.zeros(self.layout.linear_size)
        self._expand_body(state, rates, result)
        for j, (k0, k1) in enumerate(self._constant):
            flap, flap_rate, lag, lag_rate = self._rotor_slices(j)
            flapped = not np.array_equal(state[flap], self.trim[flap])
            c0b, c1b, c0x, c1x = self._coupling(j, state[flap]) if flapped else self._at_trim[j]
            beta, dbeta, xi, dxi = state[flap], state[flap_rate], state[lag], state[lag_rate]
            forcing = rates[flap_rate] + k1 @ dbeta + k0 @ beta - c1b @ dxi - c0b @ xi
            result[flap_rate] = c0b @ self.trim[lag] + forcing
            if self.point.lead_lag:
                forcing = rates[lag_rate] + k1 @ dxi + k0 @ xi - c1x @ dbeta - c0x @ beta
                result[lag_rate] = c0x @ self.trim[flap] + forcing
        inflow = slice(self.inflow_start, None)
        gain = self.inflow_gain(state)
        forcing = rates[inflow] - gain @ state[inflow]
        result[inflow] = gain @ self.trim[: len(state)][inflow] + forcing
        return result

    def _rates(self, inputs: Array) -> Array:
        """Mean rates of the linear state; those of the attitude are left out, as they hold no load."""
        x = self.layout.from_linear(inputs[: self.layout.linear_size])
        swash = self.aircraft.mix(inputs[self.layout.linear_size :])
        rates, _ = self._engine.average(x, swash, self._psi)
        u, v, w, p, q, r = rates[S.VELOCITY : S.BODY_SIZE]
        return np.concatenate([[u, w, q, 0.0, v, p, 0.0, r], rates[S.BODY_SIZE : len(x)]])

    def _expand_body(self, state: Array, rates: Array, result: Array) -> None:
        """Newton-Euler, eq. [16]: F/m = U' + om x U - g, I^-1 M = om' + I^-1 (om x I om)."""
        inertia, gravity = self.aircraft.body.inertia, self.aircraft.environment.gravity
        velocity, om = state[AXES[0]], state[AXES[1]]
        attitude = self.layout.from_linear(state)[S.ATTITUDE : S.VELOCITY]
        weight = gravity * rotation_matrix(attitude)[2]
        result[AXES[0]] = rates[AXES[0]] + np.cross(om, velocity) - weight
        result[AXES[1]] = rates[AXES[1]] + np.linalg.solve(inertia, np.cross(om, inertia @ om))

    def _turning(self, rotor: Rotor) -> tuple[Array, Array]:
        """K0 and K1 of one rotor, eqs. [26] and [27]; they do not depend on the azimuth."""
        to_blades = blade_matrix(rotor.blades, 0.0)
        back = np.asarray(np.linalg.inv(to_blades), dtype=np.float64)
        first, second = (back @ blade_matrix(rotor.blades, 0.0, order) for order in (1, 2))
        return rotor.speed**2 * second, 2 * rotor.speed * first

    def _coupling(self, j: int, flap: Array) -> tuple[Array, Array, Array, Array]:
        """C0, C1 of flap and C0, C1 of lag of one rotor, eqs. [28] to [31], averaged over the azimuth.

        D^beta = -2 Omega (A1 cos beta + e_F S1) sin beta = -D^xi (theory.md section 3). The paper's reading has A1
        alone in it, which is what its Table 5 shows.
        """
        rotor = self.aircraft.rotors[j]
        a1, offset, first = second_moment(self.aircraft, rotor), rotor.flap_hinge_offset, rotor.first_moment
        if not self.point.lead_lag:
            none = np.zeros((rotor.blades, rotor.blades))
            return none, none, none, none
        beyond = 0.0 if self.aircraft.options.hub_moment == "paper" else offset * first
        to_blades = blade_matrix(rotor.blades, self._psi[:, j])
        turned = rotor.speed * blade_matrix(rotor.blades, self._psi[:, j], 1)
        beta = to_blades @ flap
        d = -2 * rotor.speed * (a1 * np.cos(beta) + beyond) * np.sin(beta)
        a2 = rotor.blade_mass * offset**2 + 2 * offset * first * np.cos(beta) + a1 * np.cos(beta) ** 2
        back = np.linalg.inv(to_blades)
        of_flap, of_lag = back * (-d / a1)[:, None, :], back * (d / a2)[:, None, :]
        parts = (of_flap @ turned, of_flap @ to_blades, of_lag @ turned, of_lag @ to_blades)
        c0b, c1b, c0x, c1x = (part.mean(axis=0) for part in parts)
        return c0b, c1b, c0x, c1x

    def coupling_blocks(self) -> dict[str, Array]:
        """K0, K1, C0, C1 of flap and lag at trim, block diagonal over the rotors as eq. [24] writes them."""
        found: dict[str, Array] = {}
        n = self.layout.blade_count
        names = ["K0_beta", "K1_beta"]
        if self.point.lead_lag:
            names += ["C0_beta", "C1_beta", "K0_xi", "K1_xi", "C0_xi", "C1_xi"]
        for name in names:
            found[name] = np.zeros((n, n))
        for j, (k0, k1) in enumerate(self._constant):
            flap = self._rotor_slices(j)[0]
            c0b, c1b, c0x, c1x = self._at_trim[j]
            part = slice(flap.start - S.LINEAR_BODY_SIZE, flap.stop - S.LINEAR_BODY_SIZE)
            values = {"K0_beta": k0, "K1_beta": k1, "K0_xi": k0, "K1_xi": k1}
            values |= {"C0_beta": c0b, "C1_beta": c1b, "C0_xi": c0x, "C1_xi": c1x}
            for name in names:
                found[name][part, part] = values[name]
        return found

    def first_matrix(self) -> Array:
        """First matrix of eq. [32] over flap, flap rates, lag, lag rates of all rotors.

        Its last row is printed with -K0, -K1 under flap and C0, C1 under lag; eq. [14] has them the other way round,
        and only that has the spectrum of Table 5.
        """
        n = self.layout.blade_count
        parts = self.coupling_blocks()
        none, one = np.zeros((n, n)), np.eye(n)
        rows = [[none, one, none, none], [-parts["K0_beta"], -parts["K1_beta"], none, none]]
        rows += [[none, none, none, none]] * 2
        if self.point.lead_lag:
            rows[1][2:] = parts["C0_beta"], parts["C1_beta"]
            rows[2] = [none, none, none, one]
            rows[3] = [parts["C0_xi"], parts["C1_xi"], -parts["K0_xi"], -parts["K1_xi"]]
        return np.block(rows)

    def inflow_gain(self, state: Array) -> Array:
        """C^lambda of all rotors in still air, block diagonal as eq. [33] writes it; shape (3 n_rotors, 3 n_rotors)."""
        result = np.zeros((3 * len(self.aircraft.rotors),) * 2)
        velocity, om = state[AXES[0]], state[AXES[1]]
        rotors, cyclic = self.aircraft.model().rotors, int(self.point.cyclic_inflow)
        for j, rotor in enumerate(self.aircraft.rotors):
            at_hub = hub_axes(rotor.shaft_direction).T @ (velocity + np.cross(om, rotor.hub))
            flow, part = at_hub / (rotor.speed * rotor.radius), self._inflow_slice(j)
            own = np.zeros((3, 3, 1))
            inflow_matrix(rotors, j, state[[part.start], np.newaxis], flow[:, np.newaxis], cyclic, own)
            within = slice(3 * j, 3 * j + 3)
            result[within, within] = own[..., 0]
        return result
