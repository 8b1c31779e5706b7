"""Momentum and energy of an aircraft with drives, and the power that enters and leaves it, from the plain model.

The plain model takes the speeds of rotors as given; here those of a state are put in. All of it takes complex numbers,
so that rates follow from a complex step.
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from plain_commands import plain_commands
from plain_model import (
    cross,
    damper_moments,
    duct_load,
    energy,
    first_moment,
    has_offsets,
    lag_stop_moment,
    make_instant,
    met_velocity,
    momentum,
    rotation_matrix,
    span_of,
)

from sbs_sim.model import records as R
from sbs_sim.model import state as S

TINY = 1e-30  # of complex steps


def ratios(aircraft):
    """Number of the drive of each rotor and its gear ratio, worked out from the file; -1 and 0 without a drive."""
    speeds = {rotor.name: rotor.speed for rotor in aircraft.rotors}
    found = {
        name: (i, speeds[name] / speeds[drive.rotors[0]])
        for i, drive in enumerate(aircraft.drives)
        for name in drive.rotors
    }
    return [found.get(rotor.name, (-1, 0.0)) for rotor in aircraft.rotors]


def speeds_of(aircraft, x):
    """Return the speed of every rotor [rad/s] at a state."""
    return [
        rotor.speed if i < 0 else gear * x[aircraft.layout.drive(i)["Omega"]]
        for rotor, (i, gear) in zip(aircraft.rotors, ratios(aircraft), strict=True)
    ]


def at_speeds(aircraft, x, rates=None):
    """Return the aircraft for the plain model with the speeds of a state and given accelerations of the drives."""
    rotors = []
    for rotor, speed, (i, gear) in zip(aircraft.rotors, speeds_of(aircraft, x), ratios(aircraft), strict=True):
        values = {name: getattr(rotor, name) for name in dir(rotor) if not name.startswith("_")}
        values["inflow_speed"], values["speed"] = rotor.speed, speed
        values["shaft_direction"] = rotor.shaft_direction / np.linalg.norm(rotor.shaft_direction)
        values["speed_rate"] = 0.0 if rates is None or i < 0 else gear * rates[i]
        rotors.append(SimpleNamespace(**values))
    names = ("environment", "body", "options", "sections", "ground", "has_contact", "contact_points")
    return SimpleNamespace(**{name: getattr(aircraft, name) for name in names}, rotors=tuple(rotors))


def plain_state(aircraft, x):
    """Return the state as the plain model has it, without those of drives."""
    return np.concatenate([x[: aircraft.layout.drives_start], x[aircraft.layout.contacts_start :]])


def azimuths(aircraft, x, psi0):
    """Return the azimuth of every rotor [rad]; those with a drive have turned by its azimuth since `psi0`."""
    return np.array([
        start if i < 0 else start + gear * x[aircraft.layout.drive(i)["azimuth"]]
        for start, (i, gear) in zip(psi0, ratios(aircraft), strict=True)
    ])  # fmt: skip


def totals(aircraft, x, psi0, swash=None):
    """Return linear and angular momentum, NED, and energy of body, blades and transmissions."""
    plain, own, psi = at_speeds(aircraft, x), plain_state(aircraft, x), azimuths(aircraft, x, psi0)
    p, h = momentum(plain, own, psi, swash)
    total = energy(plain, own, psi, swash)
    for i, drive in enumerate(aircraft.drives):
        speed = x[aircraft.layout.drive(i)["Omega"]]
        h = h + rotation_matrix(x[S.ATTITUDE : S.VELOCITY]) @ (drive.inertia * speed * drive.inertia_axis)
        total = total + drive.inertia * speed * (speed / 2 + drive.inertia_axis @ x[S.RATES : S.BODY_SIZE])
    return p, h, total


def rates_of_totals(aircraft, x, dx, psi0, swash=None):
    """Return the rates of `totals` while a state changes at a rate and rotors without a drive turn."""
    turning = [0.0 if i >= 0 else rotor.speed for rotor, (i, _) in zip(aircraft.rotors, ratios(aircraft), strict=True)]
    found = totals(aircraft, x + 1j * TINY * dx, psi0 + 1j * TINY * np.array(turning), swash)
    return [np.imag(part) / TINY for part in found]


class Balance(NamedTuple):
    """Loads and powers at one instant.

    Attributes
    ----------
    force, moment : array, shape (3,)
        Of air and weight on the whole aircraft, NED; the moment about the inertial origin [N, N m].
    body, drag, flow : float
        Power that the air gives to fuselage, surfaces and ducts, and the ground to contact points; that the drag of the
        blades takes; that the blades give to the induced flow and to the wind [W].
    dampers, engines : float
        Power that lag dampers and those of a stand give, which is negative; of engines, motors and of what keeps the
        speed of rotors without a drive [W].
    """

    force: np.ndarray
    moment: np.ndarray
    body: float
    drag: float
    flow: float
    dampers: float
    engines: float

    @property
    def power(self):
        """Of everything but weight and springs, whose energy is in `energy` [W]."""
        return self.body - self.drag - self.flow + self.dampers + self.engines


def commanded(aircraft, x, rows, wind=(0.0, 0.0, 0.0)):
    """Return the swashplate angles, shape (n_rotors, 3) [rad], and the body with the surfaces that rows command."""
    air = rotation_matrix(x[S.ATTITUDE : S.VELOCITY]).T @ np.asarray(wind, dtype=float)
    swash, surfaces = plain_commands(aircraft, rows, np.linalg.norm(x[S.VELOCITY : S.RATES] - air))
    return swash, replace(aircraft.body, surfaces=surfaces)


def balance(model, x, rows, psi0, wind=(0.0, 0.0, 0.0)):
    """Return the `Balance` of a state of a `helpers.Model`, whose last derivative was that of this state."""
    aircraft, own = model.aircraft, plain_state(model.aircraft, x)
    plain, psi = at_speeds(aircraft, x), azimuths(aircraft, x, psi0)
    swash, plain.body = commanded(aircraft, x, rows, wind)
    instant = make_instant(plain, own, swash, psi, wind, model.lead_lag, model.cyclic_inflow)
    state, attitude = instant.state, rotation_matrix(x[S.ATTITUDE : S.VELOCITY])
    air = attitude.T @ np.asarray(wind, dtype=float)
    force, moment = instant.fuselage_force, instant.fuselage_moment
    body, drag, flow, dampers = force @ state.velocity + moment @ state.rate, 0.0, 0.0, 0.0
    for j, rotor in enumerate(plain.rotors):
        hub_velocity = state.velocity + cross(state.rate, rotor.hub)
        # the air behind the lip of a duct goes with it
        carried = air + instant.hub_velocities[j] - met_velocity(rotor, instant.hub_velocities[j])
        duct, duct_moment = duct_load(instant, j)
        body += duct @ state.velocity + duct_moment @ state.rate
        force, moment = force + duct, moment + duct_moment
        for k, blade in enumerate(instant.blades[j]):
            for s, load in instant.air_loads[j][k]:
                inflow, wake = state.inflow[j] + instant.washes[j].blades, instant.wake_washes[j][k]
                gained = carried - induced_velocity(rotor, blade, s, inflow, wake)
                # lift is normal to the section's velocity relative to the air
                drag -= load @ (blade.velocity(s, hub_velocity) - gained)
                flow -= load @ gained
                force, moment = force + load, moment + cross(rotor.hub + blade.position(s), load)
            dampers += damping_power(instant, j, k)
    if plain.body.is_stand:
        motion = x[S.VELOCITY : S.BODY_SIZE]
        dampers -= motion @ (plain.body.stand_damping * motion)
    weight = np.array([0.0, 0.0, plain.environment.gravity])
    p = attitude @ force
    h = cross(state.position, p) + attitude @ moment + cross(first_moment(plain, own, psi, swash), weight)
    engines = engine_power(aircraft, x, model.loads[:, R.TORQUE])
    return Balance(p + plain.body.mass * weight, h, body, drag, flow, dampers, engines)


def induced_velocity(rotor, blade, s, inflow, wake):
    """Return the induced velocity at the station s of a blade as its sections see it, with that of its wake [m/s]."""
    lambda0, lambdas, lambdac = inflow
    cyclic = lambdac * np.cos(blade.azimuth) + lambdas * np.sin(blade.azimuth)
    share = (rotor.hinge_offset + span_of(s)) / rotor.radius
    speed = rotor.induced_power_factor * rotor.inflow_speed
    sees_span = has_offsets(rotor) or rotor.profile_drag == "oblique"  # the flow along the span
    along = blade.u if sees_span else np.cos(blade.flap) * blade.n
    return (speed * rotor.radius * (lambda0 + share * cyclic) + wake * share) * along


def damping_power(instant, j, k):
    """Return the power that the dampers of a blade, and its lag stops, give to its flap and lag [W]."""
    rotor, blade = instant.ac.rotors[j], instant.blades[j][k]
    flap, lag = damper_moments(rotor, blade, instant.pitches[j][k])
    factor = 1.0 if rotor.blade_lag_damping is None else rotor.blade_lag_damping[k]
    lag_power = (lag - rotor.lag_damping * blade.lag_rate) * blade.lag_rate if instant.lead_lag else 0.0
    stop_power = lag_stop_moment(rotor, blade) * blade.lag_rate if instant.lead_lag else 0.0
    return factor * (flap * blade.flap_rate + lag_power) + stop_power


def engine_power(aircraft, x, torques):
    """Return the power of engines at their shafts, and of what keeps the speed of rotors without a drive [W]."""
    pairs = zip(aircraft.rotors, ratios(aircraft), torques, strict=True)
    power = sum(torque * rotor.speed for rotor, (i, _), torque in pairs if i < 0)
    for i, drive in enumerate(aircraft.drives):
        places = aircraft.layout.drive(i)
        if drive.engine != "none":
            torque = x[places["engine_torque"]] - drive.drag * x[places["Omega"]] / aircraft.drive_speed(i)
            power += (max(torque, 0.0) if drive.free_wheel else torque) * x[places["Omega"]]
    return power
