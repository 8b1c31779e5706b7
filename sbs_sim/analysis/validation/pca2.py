"""Rotor of the Pitcairn PCA-2 autogiro, turned by the air in flight and in the wind tunnel (Wheatley, Hood)."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.content import ByContent
from sbs_sim.errors import SimulationError
from sbs_sim.flight.simulate import simulate
from sbs_sim.flight.trim_point import Fidelity
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion

Array = NDArray[np.float64]

RMS_AIMS = {
    "a0": Aim(absolute=0.5, why="0.5 deg of coning and of a1, rms over the points"),
    "a1": Aim(absolute=0.5, why="0.5 deg of coning and of a1, rms over the points"),
    "b1": Aim(absolute=0.4, why="0.4 deg of b1, rms over the points"),
}
SPEED_AIM = Aim(share=0.03, why="3 % of rotor speed in flight")
ANGLE_AIM = Aim(absolute=0.5, why="0.5 deg of shaft angle in the tunnel up to an advance ratio of 0.3")
JUDGED_UP_TO = 0.3  # advance ratio
FIRST = (0.2, 14.5, math.radians(9.0), 0.0)  # advance ratio, speed [rad/s], shaft angle, pitch [rad]
TICKS, SETTLING, AVERAGED = 28, 8, 3  # of a revolution; revolutions of a flight before those that are averaged
UNITS = {"angle": math.radians(0.2), "speed": 0.3, "pitch": math.radians(0.1)}  # of the unknowns of the search
MOST = 15.0  # units of an unknown in a step of the search
FLYWHEEL = (
    1e6  # kg m^2: while the search lasts a wheel keeps the speed, and its acceleration is the torque that is left
)
CLOSE, MAX_ITERATIONS, LEAST_SHARE = 1e-6, 10, 1.0 / 16.0

REMARKS = (
    "Coning: the report computes 7.75 and 7.3 deg at advance ratios of 0.1 and 0.2, as far above its flights as these"
    " rows; with its uniform inflow this model gives the same within 0.15 deg up to 0.4. It depends on the tip loss"
    " (1.2 deg more for B = 1) and on the weight moment of the blades, which is not given: 14 % more lowers it by 0.07"
    " deg.",
    "Rotor speed: a rotor without torque turns at the C_T at which the drag of its sections is balanced. A drag of"
    " 0.018 in place of 0.012 lowers the speed by 6 %. At 0.11 and 0.13 the flow comes at some 20 deg and the inner"
    " blade works near stall; at 0.52 the flow is reversed over half of the retreating blade. There the drag of a real"
    " section is more than the mean of the report. The measured polar of the section would move these rows.",
    "Shaft angle: 0.001 of drag moves it by 0.4 deg. The drag of a real section grows with the lift of the retreating"
    " blade, and with it the angle from 0.25 on; ours is constant. The pitch that gives the measured C_T is 0.5 deg"
    " less than that of the flights at 99 rpm and 0.8 deg more at 147 rpm: that is the elastic twist of the blades,"
    " which are rigid here. It grows to 2.7 deg at 0.62, and with it the distance to the measured angle.",
)


@dataclass(frozen=True, eq=False)
class Autorotation(ByContent):
    """A rotor that the wind turns: means over some revolutions.

    Attributes
    ----------
    ratio : float
        Advance ratio across the shaft.
    speed : float
        Of the rotor [rad/s].
    angle, pitch : float
        Shaft aft; pitch of the blades off that in the file [rad].
    thrust : float
        Along the shaft [N].
    torque : float
        That is left to accelerate the rotor [N m]: 0 where it turns steadily.
    flapping : ndarray, shape (3,)
        a0, a1, b1 [rad].
    state : ndarray, shape (size,)
        Simulation state at the end.
    """

    ratio: float
    speed: float
    angle: float
    pitch: float
    thrust: float
    torque: float
    flapping: Array
    state: Array

    @property
    def thrust_coefficient(self) -> float:
        """C_T."""
        return self.thrust / pressure(self.speed)


NAN = math.nan
NOWHERE = Autorotation(NAN, NAN, NAN, NAN, NAN, NAN, np.full(3, NAN), np.zeros(0))


def case() -> Case:
    """Flapping, thrust and speed over the advance ratio in flight, and the shaft angle in the tunnel."""
    published = data("pca2")
    return Case(
        name="pca2",
        title="Autorotation of the Pitcairn PCA-2",
        source=published["source"],
        statement="Aircraft pca2: the rotor alone, held at a shaft angle in a steady wind, its speed a state of a drive"
        " without engine. It is flown until its blades move steadily, and the flight is sought in which no torque"
        " is left to change the speed; values are means over three revolutions. In flight shaft angle and speed are"
        " sought for a thrust of the weight less the share of the wing; in the tunnel shaft angle and pitch for the"
        " thrust of the point. The trim of an aircraft does not fit what was measured: shaft angles in flight,"
        " propeller and tail are not given. Tip loss 0.959, as the report has it. Rows computed in the report are"
        " flown with uniform inflow, as there.",
        substitutes=(
            "Section: lift slope 5.85 and mean drag 0.012 of the report, at all angles up to a stall that is chosen.",
            "Blades: uniform, of the flap inertia of the report; their weight is what lowers the coning.",
            "Lag: held. Its hinges, cables and dampers are not given.",
            "Pitch: as measured in flight, 2.4 deg of elastic twist included; in the tunnel that plus what is sought.",
        ),
        rows=(*_flapping_rows(), *_speed_rows(), *_report_rows(), *_tunnel_rows()),
        remarks=REMARKS,
    )


def _flapping_rows() -> list[Row]:
    rows = []
    for place, (name, points) in enumerate(data("pca2")["flapping_deg"].items()):
        theirs = np.array([angle for _, angle in points])
        ours = np.degrees([flights()[ratio].flapping[place] for ratio, _ in points])
        for (ratio, angle), own in zip(points, ours, strict=True):
            rows.append(compared(name, f"flight, mu = {ratio:g}", angle, own, "deg"))
        rms = np.sqrt(np.mean((ours - theirs) ** 2))
        rows.append(compared(f"{name}, rms of the differences", "flight", 0.0, rms, "deg", RMS_AIMS[name]))
    return rows


def _speed_rows() -> list[Row]:
    rows = []
    for ratio, thrust, rpm in data("pca2")["flight"]:
        found, where = flights()[ratio], f"flight, mu = {ratio:g}"
        rows.append(compared("C_T", where, thrust, found.thrust_coefficient, "1"))
        rows.append(compared("rotor speed", where, rpm, found.speed * 30.0 / math.pi, "rpm", SPEED_AIM))
    return rows


def _report_rows() -> list[Row]:
    """Coning and b1 as the report computes them, with its uniform inflow."""
    search, rows = Search("speed", cyclic_inflow=False), list[Row]()
    for ratio, coning, tilt in data("pca2")["computed_deg"]:
        found, where = search.to(ratio, _rotor_load(ratio)), f"computed in the report, mu = {ratio:g}"
        rows.append(compared("a0", where, coning, math.degrees(found.flapping[0]), "deg"))
        if tilt is not None:
            rows.append(compared("b1", where, tilt, math.degrees(found.flapping[2]), "deg"))
    return rows


def _tunnel_rows() -> list[Row]:
    search, rows = Search("pitch"), list[Row]()
    for ratio, angle, lift, drag, rpm in sorted(data("pca2")["tunnel"]):
        thrust = thrust_coefficient(ratio, math.radians(angle), lift, drag)
        speed = rpm * math.pi / 30.0
        found = search.to(ratio, thrust * pressure(speed), speed)
        where = f"tunnel, mu = {ratio:g}, C_T = {thrust:.5f}, {rpm:g} rpm"
        aim = ANGLE_AIM if ratio <= JUDGED_UP_TO else None
        rows.append(compared("shaft angle", where, angle, math.degrees(found.angle), "deg", aim))
    return rows


@cache
def flights() -> dict[float, Autorotation]:
    """Flights by the advance ratios of all points."""
    published = data("pca2")
    groups = (*published["flapping_deg"].values(), published["flight"])
    ratios = sorted({point[0] for points in groups for point in points})
    search = Search("speed")
    return {ratio: search.to(ratio, _rotor_load(ratio)) for ratio in ratios}


def _rotor_load(ratio: float) -> float:
    """Weight less the share of the wing [N]."""
    published = data("pca2")
    return float(published["weight_n"] * (1.0 - np.interp(ratio, *np.transpose(published["wing_share_of_weight"]))))


def thrust_coefficient(ratio: float, angle: float, lift: float, drag: float) -> float:
    """C_T of coefficients of lift and drag on the dynamic pressure and the disc; thrust is along the shaft."""
    along = lift * math.cos(angle) + drag * math.sin(angle)
    return 0.5 * along * (ratio / math.cos(angle)) ** 2


def pressure(speed: float) -> float:
    """Thrust over its coefficient [N] at a rotor speed [rad/s]."""
    aircraft = craft("pca2")
    radius = aircraft.rotors[0].radius
    return aircraft.environment.air_density * math.pi * radius**2 * (speed * radius) ** 2


@cache
def _with_flywheel() -> Aircraft:
    return craft("pca2").with_value("drives[0].inertia", FLYWHEEL)


def flown(
    ratio: float, speed: float, angle: float, pitch: float, start: Array | None = None, *, cyclic_inflow: bool = True
) -> Autorotation:
    """Flight of some revolutions at a speed, from a simulation state if one is given."""
    rotor = IsolatedRotor(_with_flywheel(), Fidelity(lead_lag=False, cyclic_inflow=cyclic_inflow))
    layout, airspeed = rotor.layout, ratio * speed * rotor.rotor.radius / math.cos(angle)
    azimuth, spinning = layout.drive(0)["azimuth"], layout.drive(0)[S.SPEED]
    state = rotor.steady((pitch, 0.0, 0.0), airspeed, pitch=angle).state if start is None else start.copy()
    state[S.ATTITUDE : S.ATTITUDE + 4] = euler_to_quaternion(0.0, angle, 0.0)
    state[S.VELOCITY : S.RATES] = airspeed * np.array([math.cos(angle), 0.0, math.sin(angle)])
    state[azimuth], state[spinning] = 0.0, speed
    revolution = 2.0 * math.pi / speed
    flight = simulate(
        rotor.aircraft,
        state,
        np.array([pitch, 0.0, 0.0, 0.0]),
        (SETTLING + AVERAGED) * revolution,
        tick=revolution / TICKS,
        method="rk4",
        lead_lag=False,
        cyclic_inflow=cyclic_inflow,
    )
    states, last = flight["state"], slice(-AVERAGED * TICKS, None)
    gained = float(states[-1, spinning] - states[-1 - AVERAGED * TICKS, spinning])
    return Autorotation(
        ratio=ratio,
        speed=speed,
        angle=angle,
        pitch=pitch,
        thrust=float(flight["thrust"][last].mean()),
        torque=FLYWHEEL * gained / (AVERAGED * revolution),
        flapping=states[last, layout.flap(0)].mean(axis=0)[:3],
        state=states[-1],
    )


class Search:
    """Steady autorotations with a given advance ratio and thrust, each found from the one before.

    Newton's method, whose Jacobian is kept and corrected by Broyden's formula; on the way to a far point it takes
    points between.

    Parameters
    ----------
    unknown : str
        What is sought besides the shaft angle: "speed", or "pitch" at a given speed.
    cyclic_inflow : bool
        False holds the inflow uniform.
    """

    def __init__(self, unknown: str, *, cyclic_inflow: bool = True) -> None:
        self.unknowns, self.cyclic_inflow = ("angle", unknown), cyclic_inflow
        self.found = flown(*FIRST, cyclic_inflow=cyclic_inflow)
        self._slope: Array | None = None

    def to(self, ratio: float, thrust: float, speed: float | None = None) -> Autorotation:
        """Autorotation at an advance ratio, with a thrust [N]; one of NaN if there is no way to it."""
        start = self.found
        begin = np.array([start.ratio, start.thrust, start.speed])
        wanted, done, share = np.array([ratio, thrust, speed or NAN]), 0.0, 1.0
        while done < 1.0:
            share = min(share, 1.0 - done)
            found = self._newton(begin + (done + share) * (wanted - begin))
            if found is not None:
                self.found, done = found, done + share
            elif share > LEAST_SHARE:
                share = 0.5 * share
            else:
                return NOWHERE
        return self.found

    def _newton(self, wanted: Array) -> Autorotation | None:
        """Autorotation with advance ratio, thrust and, unless it is sought, speed; None if it is not found."""
        ratio, thrust, speed = wanted.tolist()
        found, slope = self.found, self._slope
        found = replace(found, ratio=ratio, speed=found.speed if math.isnan(speed) else speed)
        self._slope = None  # of a search that fails
        try:
            found, change = self._moved(found, np.zeros(2)), np.zeros(2)
            missing = _missing(found, thrust)
            for _ in range(MAX_ITERATIONS):
                if np.abs(missing).max() < CLOSE:
                    self._slope = slope
                    return found
                if slope is None:
                    sides = [self._moved(found, change) for change in np.eye(2)]
                    slope = np.stack([_missing(side, thrust) - missing for side in sides], axis=1)
                change = np.clip(np.linalg.solve(slope, -missing), -MOST, MOST)
                found, before = self._moved(found, change), missing
                missing = _missing(found, thrust)
                slope = slope + np.outer(missing - before - slope @ change, change) / (change @ change)
        except (SimulationError, np.linalg.LinAlgError):
            pass
        return None

    def _moved(self, start: Autorotation, change: Array) -> Autorotation:
        """Autorotation with unknowns that are changed by so many units."""
        given = {name: getattr(start, name) for name in ("ratio", "speed", "angle", "pitch")}
        for name, units in zip(self.unknowns, change.tolist(), strict=True):
            given[name] += UNITS[name] * units
        return flown(**given, start=start.state, cyclic_inflow=self.cyclic_inflow)


def _missing(found: Autorotation, thrust: float) -> Array:
    """Thrust that is too much over that wanted [N], and torque that is left over thrust times radius."""
    lever = craft("pca2").rotors[0].radius
    return np.array([found.thrust / thrust - 1.0, found.torque / (thrust * lever)])
