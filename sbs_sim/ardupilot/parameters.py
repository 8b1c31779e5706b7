"""ArduPilot's parameters for an aircraft, from its linear model in hover.

Each rate loop has one proportional gain: the largest one at which the loop, with the integral part and the delays that
ArduPilot has, keeps the margins below. The rate of the angle loop and the integral gain follow from its crossover.
The loop of horizontal velocity, around those of tilt, is made in the same way, and that of position follows from it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.analysis.linearize import linearize
from sbs_sim.ardupilot.servos import CYCLIC_TRAVEL, FIRST_PULSE, LAST_PULSE, Head, Servos
from sbs_sim.errors import ArduPilotError
from sbs_sim.sensors.batteries import Batteries

Array = NDArray[np.float64]

TRANSVERSE = "transverse"
TYPES = dict(zip(("h1", "h3_140", "h3_120", "h4_90", "h4_45"), range(1, 6), strict=True))  # H_SW_TYPE
HELI_DUAL, TRANSVERSE_MODE = 11, 1
MOTORS = (33, 34, 35, 36, 37, 38)  # functions of the servos of both swashplates
ANALOG_BATTERY = 4  # voltage and current; what SITL simulates
ROTOR_SPEED, ROTOR_SPEED_CHANNEL = 31, 8  # function and servo of the throttle

# Hz; ArduPilot arms if its gyros have at least 1.8 times the rate of its loops.
LOOP_RATE, FRAME_RATE = 200.0, 400.0
# Hz, of the error of a rate: the differential tilt of the discs shakes the blades in lag at the rotor's speed.
FILTERS = {"RLL": 20.0, "PIT": 20.0, "YAW": 2.0}
GYRO_FILTER = 20.0  # Hz, of second order, ArduPilot's own
DELAY = 1.5 / LOOP_RATE  # s: a loop from sensor to servo, and half of one that the servo holds
GAIN_MARGIN, PHASE_MARGIN = 10 ** (8.0 / 20.0), math.radians(50.0)
MAX_CROSSOVER = 12.0  # rad/s of a rate loop
INTEGRAL, ANGLE = 0.15, 0.35  # of the crossover: integral gain over the proportional one, and rate of the angle loop
# Of the loop of horizontal velocity: the ratios of ArduPilot's own gains (PSC_VELXY_ 2, 1 and copter-heli.parm's 0.5).
VELOCITY_INTEGRAL, VELOCITY_DERIVATIVE = 0.5, 0.25  # 1/s, s: over the proportional gain
VELOCITY_FILTER = 5.0  # Hz, of its error and of the derivative of that, ArduPilot's own
VELOCITY_DELAY = 1.0 / LOOP_RATE  # s, of the loop; its estimate is taken as immediate. The tilt's is in its own loop
SHAPING = 0.2  # s, time constant with which ArduPilot follows a commanded tilt; copter-heli.parm has it
FREQUENCIES = np.geomspace(0.3, 400.0, 1500)  # rad/s
GAINS = np.geomspace(1e-3, 20.0, 400)
MAX_ANGLE_GAIN = 6.0
WAY = 6.0  # rad/s, where a control is to turn the aircraft its way
POWER = 0.5  # of an output, that ArduPilot may count on when it plans how quickly a rate is to change
MAX_ACCELERATION = 600.0  # deg/s^2 that it plans with at most; copter-heli.parm has it
LIFT_GAIN = 0.5  # of the loop of vertical acceleration, at frequencies at which the inflow follows
BLADE_PITCH_RANGE = (0.0, 16.0)  # deg, that the collective stick of ArduPilot has
FULL = 4500  # H_CYC_MAX: all of the travel
AXES = {"RLL": (1, "p"), "PIT": (2, "q"), "YAW": (3, "r")}  # column of the axis' control, and its rate
# Names of newer firmware (ArduPilot's pull requests 31513 and 32192, both in 4.7.0), and its values over the old ones.
# Each firmware leaves out names that it does not know.
NEWER = (
    ("PSC_ACCZ_", "PSC_D_ACC_", 0.1),
    ("PSC_VELXY_", "PSC_NE_VEL_", 1.0),
    ("PSC_POSXY_", "PSC_NE_POS_", 1.0),
    ("ATC_ACCEL_", "ATC_ACC_", 0.01),
)
TILTS = {"RLL": ("phi", "v", 1.0), "PIT": ("theta", "u", -1.0)}  # angle, and the velocity that it makes, with its sign


class RateLoop(NamedTuple):
    """Gains of a rate loop of ArduPilot [of full output over rad/s], and what they give.

    `acceleration` is that of a full output [rad/s^2], from the response at `WAY`.
    """

    proportional: float
    integral: float
    angle: float
    crossover: float
    gain_margin: float
    phase_margin: float
    acceleration: float


class VelocityLoop(NamedTuple):
    """Gains of the loops of horizontal velocity [1/s, 1/s^2, 1] and position [1/s], and what they give."""

    proportional: float
    integral: float
    derivative: float
    position: float
    crossover: float
    gain_margin: float
    phase_margin: float


def parameter_lines(aircraft: Aircraft, servos: Servos) -> list[str]:
    """A parameter file for an aircraft, one line each, for ArduPilot's helicopter firmware.

    Raises
    ------
    ArduPilotError
        The servo file is of another frame, or its heads stand otherwise than that frame has them.
    TrimError, LinearizationError
        See `sbs_sim.linearize`.
    """
    left, right = _transverse_heads(aircraft, servos)
    model = linearize(_with_axes(aircraft, left, right))
    names = [model.control_names[i] for i in aircraft.axis_controls]
    unit = CYCLIC_TRAVEL * left.gain  # blade pitch of a full output of each axis
    values = _frame(left, right) | _collective(model, left, names[0]) | _battery(aircraft)
    margins = f"{20 * math.log10(GAIN_MARGIN):.0f} dB and {math.degrees(PHASE_MARGIN):.0f} deg"
    lines = [
        f"# {aircraft.name}: ArduPilot's helicopter firmware, dual frame, transverse. Proportional gains of rates",
        f"# and velocity for {margins} at least, in hover.",
    ]
    controls = {axis: names[column] for axis, (column, _) in AXES.items()}
    responses = {axis: _rate_response(model, controls[axis], rate, unit) for axis, (_, rate) in AXES.items()}
    rates = {axis: rate_loop(responses[axis], controls[axis], rate, FILTERS[axis]) for axis, (_, rate) in AXES.items()}
    tilts = [_tilted(model, controls[axis], axis, responses[axis], rates[axis]) for axis in TILTS]
    velocity = velocity_loop(tilts, aircraft.environment.gravity)
    for axis, loop in rates.items():
        lines.append(_margin_line(AXES[axis][1], loop))
        values |= _axis(axis, loop)
    lines.append(_margin_line("velocity", velocity))
    values |= _horizontal(velocity)
    values |= _by_newer_names(values)
    return [*lines, *(f"{name:<16} {value:.6g}" for name, value in values.items())]


def rate_loop(bare: NDArray[np.complex128], control: str, rate: str, filter_frequency: float) -> RateLoop:
    """Gains of a rate loop.

    Parameters
    ----------
    bare : ndarray
        Rate [rad/s] over output with ArduPilot's delay, at `FREQUENCIES`.
    control, rate : str
        Names of the control of the axis and of the rate that is fed back.
    filter_frequency : float
        Of a low pass of first order on the error [Hz].

    Raises
    ------
    ArduPilotError
        The control turns the aircraft the other way, or no gain keeps the margins.
    """
    if np.interp(WAY, FREQUENCIES, bare.imag) > 0.0:  # an integration has a phase of -90 deg
        raise ArduPilotError(f"{control}: turns {rate} the wrong way, see the signs in the servo file")
    acceleration = WAY * float(np.interp(WAY, FREQUENCIES, np.abs(bare)))
    response = _filtered(bare, filter_frequency)
    best = None
    for gain in GAINS:
        crossover = _crossover(gain * response)
        if crossover is None:
            continue
        if crossover > MAX_CROSSOVER:
            break
        integral = INTEGRAL * crossover
        loop = gain * (1.0 + integral / (1j * FREQUENCIES)) * response
        margins = _margins(loop)
        if margins[0] >= GAIN_MARGIN and margins[1] >= PHASE_MARGIN:
            angle = min(ANGLE * crossover, MAX_ANGLE_GAIN)
            best = RateLoop(float(gain), float(gain * integral), angle, crossover, *margins, acceleration)
    if best is None:
        raise ArduPilotError(f"{control}: no gain on {rate} keeps the margins")
    return best


def velocity_loop(tilted: Sequence[NDArray[np.complex128]], gravity: float) -> VelocityLoop:
    """Gains of the loops of horizontal velocity and position, for the weaker of the axes.

    Parameters
    ----------
    tilted : sequence of ndarray
        Of each axis the velocity [m/s] of a commanded tilt [rad], at `FREQUENCIES`; ArduPilot asks for a tilt of the
        acceleration that it wants over gravity.
    gravity : float
        [m/s^2]

    Raises
    ------
    ArduPilotError
        No gain keeps the margins.
    """
    s = 1j * FREQUENCIES
    low_pass = 1.0 / (1.0 + s / (math.tau * VELOCITY_FILTER))
    shape = (1.0 + VELOCITY_INTEGRAL / s + VELOCITY_DERIVATIVE * s * low_pass) * low_pass * np.exp(-s * VELOCITY_DELAY)
    best = None
    for gain in GAINS:
        loops = [gain * shape * one / gravity for one in tilted]
        crossovers = [_crossover(loop) for loop in loops]
        if None in crossovers or not all(map(_is_ahead, loops)):
            continue
        gain_margin, phase_margin = (min(values) for values in zip(*map(_margins, loops), strict=True))
        if gain_margin >= GAIN_MARGIN and phase_margin >= PHASE_MARGIN:
            crossover = min(one for one in crossovers if one is not None)
            own = float(gain)
            gains = own, own * VELOCITY_INTEGRAL, own * VELOCITY_DERIVATIVE, ANGLE * crossover
            best = VelocityLoop(*gains, crossover, gain_margin, phase_margin)
    if best is None:
        raise ArduPilotError("no gain on the velocity keeps the margins")
    return best


def _rate_response(model: LinearModel, control: str, rate: str, unit: float) -> NDArray[np.complex128]:
    """Rate over output, with ArduPilot's delay."""
    return np.asarray(model.frequency_response(control, rate, FREQUENCIES, DELAY).response * unit)


def _filtered(response: NDArray[np.complex128], filter_frequency: float) -> NDArray[np.complex128]:
    """By the filters of the gyros and of the error, the latter of first order [Hz]."""
    gyro = 1j * FREQUENCIES / (math.tau * GYRO_FILTER)
    error = 1.0 + 1j * FREQUENCIES / (math.tau * filter_frequency)
    return np.asarray(response / (1.0 + math.sqrt(2.0) * gyro + gyro**2) / error)


def _by_newer_names(values: Mapping[str, float]) -> dict[str, float]:
    """Values again, for firmware that calls them otherwise."""
    return {
        name.replace(old, new): value * factor
        for name, value in values.items()
        for old, new, factor in NEWER
        if name.startswith(old)
    }


def _tilted(
    model: LinearModel, control: str, axis: str, response: NDArray[np.complex128], loop: RateLoop
) -> NDArray[np.complex128]:
    """Velocity [m/s] of a tilt that ArduPilot is asked for [rad].

    It shapes what it is asked for, feeds its rate forward, and closes the loop of the angle around that of the rate.
    """
    s = 1j * FREQUENCIES
    open_rate = (loop.proportional + loop.integral / s) * _filtered(response, FILTERS[axis])
    open_angle = open_rate * (s + loop.angle)
    angle, velocity, sign = TILTS[axis]
    moved = [model.frequency_response(control, name, FREQUENCIES).response for name in (angle, velocity)]
    return np.asarray(open_angle / (s + open_angle) / (1.0 + SHAPING * s) * sign * moved[1] / moved[0])


def _margin_line(name: str, loop: RateLoop | VelocityLoop) -> str:
    return (
        f"# {name}: crossover {loop.crossover:.2f} rad/s, gain margin {20 * math.log10(loop.gain_margin):.1f} dB,"
        f" phase margin {math.degrees(loop.phase_margin):.0f} deg"
    )


def _crossover(loop: NDArray[np.complex128]) -> float | None:
    """Highest frequency of unit gain [rad/s]; None where there is none."""
    above = np.flatnonzero(np.abs(loop) >= 1.0)
    return None if not len(above) or above[-1] == len(loop) - 1 else float(FREQUENCIES[above[-1]])


def _is_ahead(loop: NDArray[np.complex128]) -> bool:
    """True if the phase, followed from the lowest frequency, is above -180 deg at the last crossover.

    From -270 deg on a loop looks as if it had margins, and is unstable.
    """
    last = int(np.flatnonzero(np.abs(loop) >= 1.0)[-1])
    return bool(np.unwrap(np.angle(loop))[last] > -math.pi)


def _margins(loop: NDArray[np.complex128]) -> tuple[float, float]:
    """Least gain margin at the crossings of the negative real axis beyond the crossover, and least phase margin."""
    gain, angle = np.abs(loop), np.angle(-loop)  # angle from the critical direction
    last = int(np.flatnonzero(gain >= 1.0)[-1])
    crossings = np.flatnonzero((angle[:-1] * angle[1:] <= 0.0) & (np.abs(angle[:-1] - angle[1:]) < math.pi))
    beyond = crossings[crossings >= last]
    gain_margin = float(1.0 / gain[beyond].max()) if len(beyond) else math.inf
    unit = np.flatnonzero((gain[:-1] - 1.0) * (gain[1:] - 1.0) <= 0.0)
    return gain_margin, float(np.abs(angle[unit]).min())


def _transverse_heads(aircraft: Aircraft, servos: Servos) -> tuple[Head, Head]:
    """Heads on the left and right.

    Raises
    ------
    ArduPilotError
        See `parameter_lines`.
    """
    if servos.frame != TRANSVERSE or len(servos.heads) != len(aircraft.rotors) or len(servos.heads) != 2:
        raise ArduPilotError(f"frame: {servos.frame}: parameters are written for {TRANSVERSE} with two heads")
    hubs = {rotor.name: rotor.hub for rotor in aircraft.rotors}
    left, right = servos.heads
    if not hubs[left.rotor][1] < 0.0 < hubs[right.rotor][1]:
        raise ArduPilotError("heads: allowed for transverse is the left one first, then the right one")
    if left.blade_pitch != right.blade_pitch:
        raise ArduPilotError("heads: allowed for transverse is the same blade_pitch_deg on both")
    if not aircraft.has_axes:
        raise ArduPilotError("controls: allowed for parameters are those with all four axes")
    return left, right


def _with_axes(aircraft: Aircraft, left: Head, right: Head) -> Aircraft:
    """Aircraft whose controls move the heads as ArduPilot does.

    Roll is differential collective, yaw is differential longitudinal cyclic.
    """
    heave, roll, pitch, yaw = (aircraft.control_names[i] for i in aircraft.axis_controls)
    changes = {}
    for head, side in ((left, 1.0), (right, -1.0)):
        sign = float(head.longitudinal_sign)
        changes[f"rotors.{head.rotor}.mixing"] = {
            "collective": {heave: 1.0, roll: side},
            "lateral_cyclic": {},
            "longitudinal_cyclic": {pitch: sign, yaw: -side * sign},
        }
    return aircraft.with_values(changes)


def _pulse(head: Head, blade_pitch: float) -> float:
    """Pulse of all servos of a head [us] at a collective [rad]."""
    travel = (blade_pitch - head.blade_pitch[0]) / head.gain
    return FIRST_PULSE + travel * (LAST_PULSE - FIRST_PULSE)


def _frame(left: Head, right: Head) -> dict[str, float]:
    """Parameters of the frame and its servos."""
    values: dict[str, float] = {
        "FRAME_CLASS": HELI_DUAL,
        "H_DUAL_MODE": TRANSVERSE_MODE,
        "H_SW_TYPE": TYPES[left.swashplate],
        "H_SW2_TYPE": TYPES[right.swashplate],
        "H_CYC_MAX": FULL,
        "H_DCP_SCALER": 1.0,
        "H_DCP_YAW": 0.0,
        "H_YAW_SCALER": 1.0,
        "H_OPTIONS": 0,  # integrals that do not leak: rotors side by side have to hold a trim
        "ATC_HOVR_ROL_TRM": 0,
        "SCHED_LOOP_RATE": LOOP_RATE,
        "SIM_RATE_HZ": FRAME_RATE,
        "INS_GYRO_FILTER": GYRO_FILTER,
        "H_RSC_MODE": 2,
        "H_RSC_SETPOINT": 100,
        "H_RSC_RAMP_TIME": 2,
        "H_RSC_RUNUP_TIME": 3,
        f"SERVO{ROTOR_SPEED_CHANNEL}_FUNCTION": ROTOR_SPEED,
    }
    channels = [*left.channels[:3], *right.channels[:3]]
    for function, channel in zip(MOTORS, channels, strict=True):
        values |= {f"SERVO{channel}_FUNCTION": function, f"SERVO{channel}_MIN": FIRST_PULSE}
        values |= {f"SERVO{channel}_MAX": LAST_PULSE, f"SERVO{channel}_TRIM": 0.5 * (FIRST_PULSE + LAST_PULSE)}
    return values


def _battery(aircraft: Aircraft) -> dict[str, float]:
    """Parameters of the battery that ArduPilot is shown, where there is one."""
    batteries = Batteries(aircraft)
    if not batteries:
        return {}
    return {"BATT_MONITOR": ANALOG_BATTERY, "BATT_CAPACITY": 1000.0 * float(batteries.capacity.sum())}  # mA h


def _collective(model: LinearModel, head: Head, control: str) -> dict[str, float]:
    """Parameters of collective and vertical motion."""
    low, high = (math.radians(value) for value in BLADE_PITCH_RANGE)
    hover = float(model.trim.controls[model.control_names.index(control)])
    gain = LIFT_GAIN / (_lift(model, control) * (high - low)) * 10.0  # output in thousandths over cm/s^2
    pulses = [round(_pulse(head, value)) for value in (low, high)]
    values: dict[str, float] = {"H_COL_MIN": pulses[0], "H_COL_MAX": pulses[1]}
    values |= {"H_COL2_MIN": pulses[0], "H_COL2_MAX": pulses[1]}
    values |= {"H_COL_ANG_MIN": BLADE_PITCH_RANGE[0], "H_COL_ANG_MAX": BLADE_PITCH_RANGE[1]}
    values |= {"H_COL_ZERO_THRST": 0.0, "H_COL_LAND_MIN": 0.0}
    values |= {"H_COL_HOVER": (hover - low) / (high - low), "H_HOVER_LEARN": 0}
    return values | {"PSC_ACCZ_P": gain, "PSC_ACCZ_I": 2.0 * gain, "PSC_ACCZ_D": 0.0}


def _lift(model: LinearModel, control: str) -> float:
    """Vertical acceleration over collective [m/s^2/rad], upwards, once the inflow has settled."""
    response = model.frequency_response(control, "w", FREQUENCIES)
    index = int(np.argmin(np.abs(FREQUENCIES - 5.0)))
    return float(np.abs(1j * FREQUENCIES[index] * response.response[index]))


def _axis(axis: str, loop: RateLoop) -> dict[str, float]:
    """Parameters of an axis."""
    rate, angle = f"ATC_RAT_{axis}_", f"ATC_ANG_{axis}_P"
    values = {f"{rate}P": loop.proportional, f"{rate}I": loop.integral, f"{rate}D": 0.0, f"{rate}FF": 0.0}
    values |= {f"{rate}ILMI": 1.0, f"{rate}IMAX": 1.0}
    values |= {f"{rate}FLTT": FILTERS["RLL"], f"{rate}FLTE": FILTERS[axis], f"{rate}FLTD": 0.0}
    planned = min(POWER * math.degrees(loop.acceleration), MAX_ACCELERATION)
    return values | {angle: loop.angle, f"ATC_ACCEL_{axis[0]}_MAX": 100.0 * planned}  # centidegrees


def _horizontal(loop: VelocityLoop) -> dict[str, float]:
    """Parameters of horizontal motion."""
    values = {"PSC_VELXY_P": loop.proportional, "PSC_VELXY_I": loop.integral, "PSC_VELXY_D": loop.derivative}
    values |= {"PSC_VELXY_FLTE": VELOCITY_FILTER, "PSC_VELXY_FLTD": VELOCITY_FILTER}
    return values | {"PSC_POSXY_P": loop.position, "ATC_INPUT_TC": SHAPING}
