"""First guess of a trim by momentum and blade-element theory (theory.md section 8.2).

Every rotor is a disc with uniform inflow by Glauert's formula and blades with a straight lift curve whose flap follows
at once. Of the thrusts, their tilt, the torques and the moments at the hubs the four controls are found, through each
rotor's mixing, that carry the weight and leave no moment about the centre of gravity.
"""

import copy
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import TRIMMED_CONTROLS, Rotor
from sbs_sim.aircraft.model_records import MIN_DENSITY, number_scale, second_moment
from sbs_sim.analysis.drive_guess import set_drives, stand_in
from sbs_sim.analysis.trim_problem import TrimProblem
from sbs_sim.content import ByContent
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model import records as R
from sbs_sim.model.airfoil import AirfoilTable
from sbs_sim.model.descent import measured_axial
from sbs_sim.model.solve import smallest

Array = NDArray[np.float64]

LIFT_ANGLE = math.radians(6.0)  # the lift curve is straight through its points at zero and at this angle of attack
MIN_SLOPE = 1.0  # 1/rad, of a lift curve; that of thin airfoils is 2 pi
MIN_LOADING = 0.01  # of the mean disc loading: a rotor with less has the flow of this, for without any Newton is lost
MAX_STEPS, MAX_MOMENTUM_STEPS = 12, 20
MAX_HALVINGS = 30
TOLERANCE = 1e-3  # of the weight, and rad: what follows is Newton's
DIGITS = 9  # decimal places of a guess
MAX_STEP = 0.15  # rad, of a control, but for the first step, which goes all the way to the wanted thrust
THRUST_STEP = 4.0  # a rotor that carries gets no more than this times its thrust in a step, and no less than its part
WEAKEST = 1e-3  # of the strongest effect of the controls: directions with less are left to Newton
CARRIES = 0.2  # of the mean thrust: a rotor with more is one that carries
MAX_LEAN, MAX_FLAP, MAX_LAG = 0.9, 0.2, 0.3  # sine of pitch and of roll beside the bank; rad
MAX_INFLOW = 30.0  # m/s
MIN_GRAVITY, MIN_UPWARD = 1e-3, 0.03  # m/s^2; cosine of the shafts: what is divided by is never zero


@dataclass(frozen=True, eq=False)
class Balance(ByContent):
    """An aircraft in balance by momentum theory.

    Attributes
    ----------
    pitch, roll : float
        [rad]
    controls : ndarray, shape (4,)
        [rad]
    authority : ndarray, shape (4, 4)
        Slopes of lift over weight and of rolling, pitching and yawing moment over weight and radius, by the controls.
    rotors : tuple of Response
    """

    pitch: float
    roll: float
    controls: Array
    authority: Array
    rotors: "tuple[Response, ...]"


class Response(NamedTuple):
    """A rotor at a thrust [N].

    `collective` [rad] is what the thrust needs, `by_collective` its slope [N/rad]; `flap` are a0, a1 and b1 of eq.
    (1.6), `lag` is xi0 [rad], `inflow` the ratio lambda0. `factors`, shape (6,), and their
    slopes by the three swashplate angles, shape (6, 3), are what `MomentumRotor.wrench` multiplies.
    """

    thrust: float
    collective: float
    by_collective: float
    flap: tuple[float, float, float]
    lag: float
    inflow: float
    factors: Array
    slopes: Array


class MomentumRotor:
    """One rotor as momentum and blade-element theory see it.

    Attributes
    ----------
    wrench : ndarray, shape (6, 6)
        Makes force [N] and moment about the c.g. [N m], body axes, of thrust, torque, thrust times the two tilts of the
        disc, and these tilts.
    """

    def __init__(self, aircraft: Aircraft, model: R.Model, j: int) -> None:
        rotor = aircraft.rotors[j]
        self.speed, self.sense = rotor.speed, rotor.rotation
        self.rigging = aircraft.trim_rigging[3 * j : 3 * j + 3]
        self._power_factor, self._is_measured = rotor.induced_power_factor, rotor.descent == "measured"
        self.tip_speed, self.area = rotor.speed * rotor.radius, math.pi * rotor.radius**2
        self._axes = model.rotors["axes"][j, :, :, 0]
        self.upward = max(0.0, float(self._axes[2, 2]))
        self._density = max(aircraft.environment.air_density, MIN_DENSITY)
        # thrust is this times the induced velocity times the flow through the disc, eq. (6.1)
        self._mass_flow = self._density * self.area / (2 * rotor.wake_expansion**2)
        number = 0.75 * self.tip_speed * float(number_scale(aircraft, j, rotor.mean_chord))
        curve = _lift_curve(aircraft.table_at(j, 0.75), number)
        self._sum_sections(rotor, rotor.elements(aircraft.options.elements), *curve)
        self._hold_blades(rotor, second_moment(aircraft, rotor), aircraft.environment.gravity)
        self.wrench = self._make_wrench(rotor.hub)

    def swashplate(self, controls: Array) -> Array:
        """Collective, lateral and longitudinal cyclic of the controls that a trim finds [rad]."""
        return np.asarray(self.rigging[:, :-1] @ controls + self.rigging[:, -1])

    def _sum_sections(self, rotor: Rotor, elements: Array, slope: float, at_zero: float, drag: float) -> None:
        """Sums over the sections of all blades of the slope of lift with powers of the radius, twist and lever."""
        span, _, half_area, lifting, twist = elements
        radius, weight = rotor.hinge_offset + span, (self._density * rotor.blades) * half_area
        powers, of_twist = np.empty((3, span.size)), np.ones((span.size, 2))
        np.multiply(weight, slope * lifting, out=powers[0])
        np.multiply(powers[0], radius, out=powers[1])
        np.multiply(powers[1], radius, out=powers[2])
        of_twist[:, 1] = twist + at_zero / slope
        self._thrust = (powers @ of_twist).tolist()
        self._flap = (powers * span @ of_twist).tolist()
        self._damping = self.speed**2 * float(powers[1] @ span**2)
        self._profile = self.speed**2 * float(weight @ radius**3) * drag
        self._slope = slope

    def _hold_blades(self, rotor: Rotor, second_moment: float, gravity: float) -> None:
        """Stiffness of all blades together against coning, tilt and lag [N m/rad], eq. (3.5), and their weight."""
        omega2 = rotor.speed**2
        spring = rotor.hinge_offset * rotor.first_moment * omega2 + rotor.flap_spring
        self._coning_stiffness = rotor.blades * (second_moment * omega2 + spring)
        self._tilt_stiffness = rotor.blades * spring
        weight = rotor.first_moment * gravity * float(self._axes[2, 2])
        self._droop = rotor.blades * (weight - rotor.flap_spring * rotor.flap_rest)
        pull = rotor.blade_mass * rotor.flap_hinge_offset + rotor.first_moment
        lag_offset = rotor.hinge_offset - rotor.flap_hinge_offset
        self._lag_rest = rotor.blades * rotor.lag_spring * rotor.lag_rest
        self._lag_stiffness = rotor.blades * (rotor.lag_spring + lag_offset * pull * omega2)
        self._pitch_flap = rotor.pitch_flap_coupling
        self._phase = math.cos(rotor.swashplate_phase), math.sin(rotor.swashplate_phase)

    def _make_wrench(self, hub: Array) -> Array:
        """Thrust pulls up and along the tilted disc, torque turns back, the stiffness of the hinges tilts the hub."""
        ahead, right, down = self._axes.T
        forces, moments = np.zeros((3, 6)), np.zeros((3, 6))
        forces[:, 0], forces[:, 2], forces[:, 3] = -down, ahead, -self.sense * right
        moments[:, 1] = self.sense * down
        moments[:, 4] = -0.5 * self._tilt_stiffness * right
        moments[:, 5] = -0.5 * self._tilt_stiffness * self.sense * ahead
        x, y, z = hub.tolist()
        arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.concatenate([forces, moments + arm @ forces])

    def meet(self, velocity: Array) -> None:
        """Take the hub's velocity relative to the air, body axes [m/s]."""
        ahead, right, down = (velocity @ self._axes).tolist()
        self._ahead, self._right, self._axial = ahead, self.sense * right, -down
        self._edgewise = math.hypot(ahead, right)

    def induced(self, thrust: float) -> tuple[float, float]:
        """Induced velocity of a thrust that is not zero [m/s] and its slope, where the air goes with the thrust.

        Glauert's formula, v |V| = v_hover^2, by Newton's method from above its only root there.
        """
        sign, hover2 = math.copysign(1.0, thrust), abs(thrust) / self._mass_flow
        climb = sign * self._axial
        if self._is_measured and climb < 0.0:
            v, slope = self._measured(hover2, -climb)
            return sign * v, 1.0 / (self._mass_flow * slope)
        v = math.sqrt(hover2) + max(0.0, -climb)
        for _ in range(MAX_MOMENTUM_STEPS):
            flow = math.hypot(self._edgewise, v + climb)
            slope = flow + v * (v + climb) / flow
            change = (hover2 - v * flow) / slope
            v += change
            if abs(change) <= 1e-6 * v:
                break
        return sign * v, 1.0 / (self._mass_flow * slope)

    def _measured(self, hover2: float, descent: float) -> tuple[float, float]:
        """Induced velocity in descent as measured, by halving, and the slope of v |V|, which grows with it."""
        low, high = 0.0, 4.0 * math.sqrt(hover2)
        for _ in range(MAX_HALVINGS):
            v = 0.5 * (low + high)
            axial, growth = measured_axial(v, descent)
            flow = math.hypot(self._edgewise, axial)
            low, high = (v, high) if v * flow < hover2 else (low, v)
        return v, flow + axial * (growth - axial) / flow

    def respond(self, thrust: float, swash: list[float], least: float) -> Response:
        """What goes with a thrust and cyclic angles; below `least` the inflow is linear in the thrust."""
        size = math.copysign(max(abs(thrust), least), thrust)
        v, v_slope = self.induced(size)
        inflow = v / self.tip_speed
        v, v_slope = self._power_factor * v, self._power_factor * v_slope  # what the blades meet
        through, omega = v * thrust / size + self._axial, self.speed
        pitch, pitch_slope = self._pitch(thrust, through, v_slope)
        coning, coning_slope = self._coning(pitch, pitch_slope, through, v_slope)
        by_collective = 1.0 / (pitch_slope + self._pitch_flap * coning_slope)
        torque = thrust * through / omega + self._profile
        by_thrust = (through + thrust * v_slope) / omega
        aft, side, (aft_a, side_a), (aft_b, side_b) = self._tilt(pitch, through, swash)
        factors = np.array([thrust, torque, thrust * aft, thrust * side, aft, side])
        slopes = np.array(
            [
                [by_collective, 0.0, 0.0],
                [by_thrust * by_collective, 0.0, 0.0],
                [aft * by_collective, thrust * aft_a, thrust * aft_b],
                [side * by_collective, thrust * side_a, thrust * side_b],
                [0.0, aft_a, aft_b],
                [0.0, side_a, side_b],
            ]
        )
        collective = pitch + self._pitch_flap * coning
        lag = (torque + self._lag_rest) / self._lag_stiffness if self._lag_stiffness > 0.0 else 0.0
        return Response(thrust, collective, by_collective, (coning, -aft, -side), lag, inflow, factors, slopes)

    def _pitch(self, thrust: float, through: float, v_slope: float) -> tuple[float, float]:
        """Pitch at the blade's root for a thrust, and its slope: the sections' lift with the mean of u_T squared."""
        omega, along = self.speed, 0.5 * self._edgewise**2
        (t0, t0_twist), (t1, _), (t2, t2_twist) = self._thrust
        slope = omega * omega * t2 + along * t0
        of_twist = omega * omega * t2_twist + along * t0_twist
        return (thrust - of_twist + omega * t1 * through) / slope, (1.0 + omega * t1 * v_slope) / slope

    def attached(self, thrust: float, inflow: float) -> float:
        """Pitch at the blade's root [rad] that the thrust needs with an inflow ratio, were no section stalled."""
        induced = self._power_factor * (inflow * self.tip_speed)
        return self._pitch(thrust, induced + self._axial, 0.0)[0]

    def mean_lift(self, thrust: float) -> float:
        """Mean lift coefficient of the sections, by the square of their velocity along the disc."""
        pressure = self.speed**2 * self._thrust[2][0] + 0.5 * self._edgewise**2 * self._thrust[0][0]
        return float(thrust * self._slope / pressure)

    def _coning(self, pitch: float, pitch_slope: float, through: float, v_slope: float) -> tuple[float, float]:
        """Coning and its slope by the thrust."""
        omega = self.speed
        _, (f1, _), (f2, f2_twist) = self._flap
        moment = omega * (omega * (f2 * pitch + f2_twist) - f1 * through) - self._droop
        by_thrust = omega * (omega * f2 * pitch_slope - f1 * v_slope)
        return moment / self._coning_stiffness, by_thrust / self._coning_stiffness

    def _tilt(
        self, pitch: float, through: float, swash: list[float]
    ) -> tuple[float, float, tuple[float, float], tuple[float, float]]:
        """Flap to cos psi and to sin psi, and the slopes of both by lateral and by longitudinal cyclic.

        Once per revolution the stiffness of the hinges and the damping of the air hold what pitch, eq. (4.8), and the
        advancing and retreating sides force.
        """
        omega, (c, s) = self.speed, self._phase
        (f0, _), (f1, f1_twist), (f2, _) = self._flap
        force = omega * omega * f2
        stiffness, damping = self._tilt_stiffness + force * self._pitch_flap, self._damping
        scale = force / (stiffness**2 + damping**2)
        k, d = stiffness * scale, damping * scale
        advance = (2.0 * omega * (f1 * pitch + f1_twist) - f0 * through) / force
        lateral, longitudinal = self.sense * swash[1], swash[2]
        cosine = advance * self._right - lateral * c - longitudinal * s
        sine = advance * self._ahead + lateral * s - longitudinal * c
        by_lateral = (self.sense * (-k * c - d * s), self.sense * (k * s - d * c))
        by_longitudinal = (d * c - k * s, -k * c - d * s)
        return k * cosine - d * sine, d * cosine + k * sine, by_lateral, by_longitudinal


class MomentumTheory:
    """An aircraft as momentum and blade-element theory see it.

    Parameters
    ----------
    problem : TrimProblem
        Whose unknowns are guessed.
    """

    def __init__(self, problem: TrimProblem) -> None:
        self._problem, self.aircraft = problem, problem.aircraft
        kept, model = self.aircraft.kept, problem.engine.model
        if MomentumRotor not in kept:
            kept[MomentumRotor] = [MomentumRotor(self.aircraft, model, j) for j in range(len(self.aircraft.rotors))]
            kept[stand_in] = stand_in(self.aircraft, kept[MomentumRotor]) if self.aircraft.commanded_drives else ()
        self.rotors: list[MomentumRotor] = [copy.copy(rotor) for rotor in kept[MomentumRotor]]  # they meet other air

    def guess(self, condition: TrimCondition, share: float = 1.0, controls: Array | None = None) -> Array:
        """Unknowns of a trim, shape (n,); the parameters are those of `balance`."""
        layout = self._problem.layout
        x = np.zeros(layout.size)
        if self.aircraft.environment.air_density <= MIN_DENSITY:
            return self._problem.unknowns(0.0, 0.0, np.zeros(TRIMMED_CONTROLS), x)
        found = self.balance(condition, share, controls)
        for j, rotor in enumerate(found.rotors):
            x[layout.flap(j)][:3] = [_clipped(angle, MAX_FLAP) for angle in rotor.flap]
            x[layout.lag(j).start] = _clipped(rotor.lag, MAX_LAG)
            x[layout.inflow(j).start] = rotor.inflow
        set_drives(self.aircraft, self.aircraft.kept[stand_in], found.rotors, x)
        # rounded, so that no last bit of the libraries' sines and sums is in where a trim begins
        return np.round(self._problem.unknowns(found.pitch, found.roll, found.controls, x), DIGITS)

    def balance(self, condition: TrimCondition, share: float = 1.0, controls: Array | None = None) -> Balance:
        """Balance the aircraft.

        Parameters
        ----------
        condition : TrimCondition
        share : float
            Of weight and drag that is to be carried.
        controls : ndarray, shape (4,), optional
            Controls [rad] that are held: the result is what the rotors do with them, balanced or not.
        """
        search = _Search(self, condition, share, controls)
        for _ in range(MAX_STEPS):
            if search.step() < TOLERANCE:
                break
        return search.found()

    @property
    def hover_inflow(self) -> float:
        """Induced velocity that carries the weight in hover [m/s], no more than MAX_INFLOW."""
        air = self.aircraft.environment
        area = sum(rotor.area * rotor.upward for rotor in self.rotors)
        momentum = 2.0 * max(air.air_density, MIN_DENSITY) * max(area, MIN_DENSITY)
        return min(MAX_INFLOW, math.sqrt(self.aircraft.body.mass * air.gravity / momentum))

    def lift(self, condition: TrimCondition) -> Array:
        """Change of the controls, shape (4,), that gives lift and no moments: 1 rad on the collective it moves most."""
        authority = self.balance(condition).authority
        change = np.asarray(np.linalg.lstsq(authority, np.eye(4)[0], rcond=WEAKEST)[0], dtype=np.float64)
        most = max(abs(float(rotor.rigging[0, :-1] @ change)) for rotor in self.rotors)
        return change / most if most > 0.0 else change

    def stall(self, condition: TrimCondition, unknowns: Array) -> Array:
        """Pitch of each rotor's blades beyond what its thrust would need by a straight lift curve [rad], (n_rotors,).

        The thrusts are those of the problem's last residual.
        """
        layout, thrusts = self._problem.layout, self._problem.loads[:, R.THRUST].tolist()
        x, swash = self._problem.state(condition, unknowns)
        velocity, _ = condition.motion(unknowns[0], unknowns[1])
        found, speeds = np.empty(len(self.rotors)), self.aircraft.rotor_speeds(x).tolist()
        for j, (kept, rotor) in enumerate(zip(self.rotors, self.aircraft.rotors, strict=True)):
            theory = copy.copy(kept)
            theory.speed = speeds[j]
            coning, lag = x[layout.flap(j).start], x[layout.lag(j).start]
            pitch = swash[j, 0] - rotor.pitch_flap_coupling * coning - rotor.pitch_lag_coupling * lag
            theory.meet(velocity)
            found[j] = pitch - theory.attached(thrusts[j], float(x[layout.inflow(j).start]))
        return found


class _Search:
    """Newton's method for the thrusts of the rotors and the four controls."""

    def __init__(self, theory: MomentumTheory, condition: TrimCondition, share: float, controls: Array | None) -> None:
        air, body = theory.aircraft.environment, theory.aircraft.body
        self._rotors, self._condition, self._fixed = theory.rotors, condition, controls is not None
        self._plates = 0.5 * air.air_density * share * body.flat_plate_areas
        centripetal = condition.airspeed * condition.turn_rate
        self._bank = math.atan2(centripetal, max(share * air.gravity, MIN_GRAVITY))
        self._weight = body.mass * max(math.hypot(share * air.gravity, centripetal), MIN_GRAVITY)
        radius = max(rotor.radius for rotor in theory.aircraft.rotors)
        self._scale = 1.0 / (self._weight * np.array([1.0, radius, radius, radius]))
        self._pitch, self._roll = 0.0, self._bank
        self._controls = np.zeros(TRIMMED_CONTROLS) if controls is None else controls
        self._authority = np.zeros((4, len(self._controls)))
        lifting = sum(rotor.upward**2 * rotor.area for rotor in self._rotors)
        loading = self._weight / max(lifting, MIN_UPWARD**2 * sum(rotor.area for rotor in self._rotors))
        self._least = [MIN_LOADING * loading * rotor.area for rotor in self._rotors]
        self._thrusts = [max(rotor.upward, MIN_LOADING) * loading * rotor.area for rotor in self._rotors]
        self._first = True
        self._responses: list[Response] = []
        self._moves, self._velocity = condition.is_motion, np.zeros(3)

    def step(self) -> float:
        """Go one step; the largest change of a thrust, over the weight, or of a control [rad]."""
        self._responses = responses = self._respond()
        wrench = np.zeros(6)
        for rotor, response in zip(self._rotors, responses, strict=True):
            wrench += rotor.wrench @ response.factors
        if self._moves:
            wrench[:3] -= self._plates * np.abs(self._velocity) * self._velocity
        change = np.zeros(len(self._controls)) if self._fixed else self._change(wrench, responses)
        self._controls = self._controls + change
        self._tilt(wrench[:3])
        thrusts = [self._next_thrust(rotor, response) for rotor, response in zip(self._rotors, responses, strict=True)]
        moved = max(abs(new - old) for new, old in zip(thrusts, self._thrusts, strict=True))
        self._thrusts, self._first = thrusts, False
        return max(moved / self._weight, float(np.abs(change).max()))

    def _respond(self) -> list[Response]:
        """Of every rotor to its thrust and to the present controls, as the body moves in its present attitude."""
        if self._moves:
            self._velocity = self._condition.motion(self._pitch, self._roll)[0]
        found = []
        for rotor, thrust, least in zip(self._rotors, self._thrusts, self._least, strict=True):
            rotor.meet(self._velocity)
            found.append(rotor.respond(thrust, rotor.swashplate(self._controls).tolist(), least))
        return found

    def _change(self, wrench: Array, responses: list[Response]) -> Array:
        """Change of the controls after which lift is weight and no moment is left, by the slopes of all."""
        slopes, gap = np.zeros((6, len(self._controls))), np.zeros(6)
        for rotor, response in zip(self._rotors, responses, strict=True):
            by_swash = rotor.wrench @ response.slopes
            # the thrusts are not yet those of the controls
            gap += by_swash[:, 0] * (float(rotor.swashplate(self._controls)[0]) - response.collective)
            slopes += by_swash @ rotor.rigging[:, :-1]
        up = wrench[:3] / math.sqrt(wrench[:3] @ wrench[:3]) if wrench[2] < 0.0 else np.array([0.0, 0.0, -1.0])
        # lift and the three moments
        slopes[2], left = up @ slopes[:3], wrench + gap
        self._authority = slopes[2:] * self._scale[:, None]
        left[2] = up @ left[:3] - self._weight
        wanted = -left[2:] * self._scale
        change = smallest(self._authority, wanted, WEAKEST)
        most = float(np.abs(change).max())
        return change if self._first or most <= MAX_STEP else change * (MAX_STEP / most)

    def _tilt(self, force: Array) -> None:
        """Attitude in which the force of rotors and drag opposes weight and centripetal acceleration."""
        ahead, right = (_clipped(part, MAX_LEAN) for part in (force[:2] / self._weight).tolist())
        self._pitch, self._roll = math.asin(ahead), self._bank - math.asin(right)

    def _next_thrust(self, rotor: MomentumRotor, response: Response) -> float:
        """Thrust at the controls by its slope."""
        thrust = response.thrust
        goal = thrust + response.by_collective * (float(rotor.swashplate(self._controls)[0]) - response.collective)
        if thrust > CARRIES * self._weight / len(self._rotors):
            return min(THRUST_STEP * thrust, max(thrust / THRUST_STEP, goal))
        return goal or thrust / THRUST_STEP  # an induced velocity of zero has no slope

    def found(self) -> Balance:
        """Where the last step started, with the controls to which it has led."""
        return Balance(self._pitch, self._roll, self._controls, self._authority, tuple(self._responses))


def _clipped(value: float, most: float) -> float:
    return min(most, max(-most, value))


def _lift_curve(table: AirfoilTable, number: float) -> tuple[float, float, float]:
    """Slope of lift [1/rad] and lift at zero angle of attack, and drag where the slope ends."""
    row = min(int(np.searchsorted(table.numbers, number)), len(table.numbers) - 1)
    zero = int(np.argmin(np.abs(table.alpha)))
    end = max(zero + 1, int(np.argmin(np.abs(table.alpha - LIFT_ANGLE))))
    low, high, start = float(table.cl[row, zero]), float(table.cl[row, end]), float(table.alpha[zero])
    slope = max((high - low) / (float(table.alpha[end]) - start), MIN_SLOPE)
    return slope, low - slope * start, float(table.cd[row, end])
