"""What must hold for every aircraft, whatever its file has: symmetry, conservation, names of modes."""

import collections
import copy

import numpy as np
from balances import at_speeds, azimuths, balance, commanded, plain_state, rates_of_totals
from helpers import POLAR, Model, mirrored_data, mirrored_state, mirrored_swash, unit
from plain_model import inflow_rate, make_instant, random_sections, rotation_matrix
from scipy.linalg import eig

from sbs_sim import Aircraft
from sbs_sim.model import state as S
from sbs_sim.model.state import part_of

MIRROR, CONSERVED = 1e-10, 1e-9  # largest errors, relative to the largest of their kind
ELEMENTS = 5  # of a blade; the balances do not depend on their number
NEARLY = 0.9  # of the largest share: what comes as near may have the mode as well
DRIVE_STATES = {"rotor speed": "Omega", "engine": "engine_torque", "governor": "governor"}


def violent_state(model, rng):
    """Return a state with every part of the motion, about a tenth of what the rotors have."""
    aircraft, layout, first = model.aircraft, model.layout, model.aircraft.rotors[0]
    velocity = 0.05 * first.speed * first.radius * rng.normal(size=3)
    x = model.state(velocity, 0.05 * first.speed * rng.normal(size=3))
    x[S.POSITION : S.ATTITUDE], x[S.ATTITUDE : S.VELOCITY] = rng.normal(size=3), unit(*rng.normal(size=4))
    for j, rotor in enumerate(aircraft.rotors):
        parts = (layout.flap(j), 0.03), (layout.lag(j), 0.03)
        rates = (layout.flap_rate(j), 0.03 * rotor.speed), (layout.lag_rate(j), 0.03 * rotor.speed)
        for part, scale in (*parts, *rates):
            x[part] = scale * rng.normal(size=rotor.blades)
        x[layout.inflow(j)] = [0.05, 0.0, 0.0] + 0.01 * rng.normal(size=3)
        if rotor.has_wake_states:
            x[layout.wake(j)] = 0.05 * rng.normal(size=2 * rotor.blades)
        if rotor.is_teetering:  # its coning does not change
            x[layout.flap(j).start], x[layout.flap_rate(j).start] = rotor.flap_rest, 0.0
    for i, drive in enumerate(aircraft.drives):
        values = {
            "Omega": aircraft.drive_speed(i) * rng.uniform(0.8, 1.1),
            "azimuth": rng.uniform(0.0, 6.0),
            "engine_torque": drive.max_torque * rng.uniform(),
            "governor": rng.uniform(-0.2, 0.2),
        }
        for name, place in layout.drive(i).items():
            x[place] = values.get(name, 0.0)
    if aircraft.body.is_stand:
        x[S.POSITION : S.ATTITUDE] *= 0.01
        x[S.VELOCITY : S.BODY_SIZE] *= aircraft.body.stand_free
    if aircraft.has_contact:
        _touch(aircraft, x, rng)
    if layout.sections:
        x[layout.sections_start :] = random_sections(aircraft, rng)
    return x


def _touch(aircraft, x, rng):
    """Put an aircraft where its lowest contact point is in the ground, with deflections along it."""
    ground, points, attitude = aircraft.ground, aircraft.contact_points, rotation_matrix(x[S.ATTITUDE : S.VELOCITY])
    tilt = np.tan(ground.slope) * np.array([np.cos(ground.slope_heading), np.sin(ground.slope_heading)])
    below = [point + [0.0, 0.0, point[:2] @ tilt] for point in (x[:3] + attitude @ p.position for p in points)]
    depth = points[0].onset * rng.uniform(0.5, 3.0)
    x[2] += -ground.altitude + depth - max(point[2] for point in below)
    for i in range(len(points)):
        x[aircraft.layout.contact(i)] = depth * rng.normal(size=2)


def instant(aircraft, number):
    """Model of an aircraft with few elements, a violent state, swashplate angles, azimuths and a wind."""
    data = copy.deepcopy(dict(aircraft.data))
    data["options"]["elements"] = ELEMENTS
    model, rng, count = Model(Aircraft.from_dict(data)), np.random.default_rng([5, number]), len(aircraft.rotors)
    x, psi = violent_state(model, rng), rng.uniform(0.0, 6.0, count)
    swash = 0.05 * rng.normal(size=(count, 3)) + [0.1, 0.0, 0.0]
    commands = [0.6, 1.0, 0.0], [0.1, 0.0, 0.0]  # throttle and set point of drives; of surfaces and controls
    is_drive = [row.owner.startswith("drive ") for row in aircraft.rows[count:]]
    swash = np.concatenate([swash, np.reshape([commands[0] if own else commands[1] for own in is_drive], (-1, 3))])
    return data, model, x, swash, psi, 5.0 * rng.normal(size=3)


def mirror_error(aircraft, number):
    """Return how far the derivative of the image of a state is from the image of the derivative, relative."""
    data, model, x, swash, psi, wind = instant(aircraft, number)
    rates, image = model.derivative(x, swash, psi, wind), Model(Aircraft.from_dict(mirrored_data(data)))
    count = len(aircraft.rotors)
    mirrored = np.concatenate([mirrored_swash(swash[:count]), swash[count:]])
    found = image.derivative(mirrored_state(x, aircraft.layout), mirrored, psi, wind * POLAR)
    return float(np.abs(found - mirrored_state(rates, aircraft.layout)).max() / np.abs(rates).max())


def inflow_error(aircraft, number):
    """Return how far the rates of the inflow are from those of the plain model, relative to the largest."""
    _, model, x, rows, psi, wind = instant(aircraft, number)
    aircraft, rates = model.aircraft, model.derivative(x, rows, psi, wind)
    plain, (swash, body) = at_speeds(aircraft, x), commanded(aircraft, x, rows, wind)
    plain.body = body
    found = make_instant(plain, plain_state(aircraft, x), swash, azimuths(aircraft, x, psi), wind)
    expected = [
        inflow_rate(plain, rotor, *(part[j] for part in parts), True, found.washes[j].through)
        for j, rotor in enumerate(plain.rotors)
        for parts in [(found.blades, found.air_loads, found.state.inflow, found.hub_velocities)]
    ]
    own = [rates[aircraft.layout.inflow(j)] for j in range(len(expected))]
    return float(np.abs(np.subtract(own, expected)).max() / np.abs(expected).max())


def balance_errors(aircraft, number):
    """Return relative errors of momentum, angular momentum and energy, in air with wind and in vacuum.

    On a stand, which takes loads, the energy alone.
    """
    data, model, x, swash, psi, wind = instant(aircraft, number)
    empty = copy.deepcopy(data)
    empty["environment"] = {"air_density": 0.0, "kinematic_viscosity": 1.5e-5, "gravity": aircraft.environment.gravity}
    errors = {}
    for where, one, blown in (("air", model, wind), ("vacuum", Model(Aircraft.from_dict(empty)), 0.0 * wind)):
        rates = one.derivative(x, swash, psi, blown)
        angles, _ = commanded(one.aircraft, x, swash, blown)
        p, h, energy = rates_of_totals(one.aircraft, x, rates, psi, angles)
        found = balance(one, x, swash, psi, blown)
        weight = aircraft.body.mass * aircraft.environment.gravity
        powers = [found.body, found.drag, found.flow, found.dampers, found.engines]
        # in vacuum without drives there may be no power at all: then the work of the weight is the scale
        most = max(*map(abs, powers), weight * float(np.linalg.norm(x[S.VELOCITY : S.RATES])))
        errors[f"energy, {where}"] = abs(energy - found.power) / most if most else abs(energy - found.power)
        if not aircraft.body.is_stand:
            arm = aircraft.rotors[0].radius
            errors[f"momentum, {where}"] = _relative(p, found.force, weight)
            errors[f"angular momentum, {where}"] = _relative(h, found.moment, weight * arm)
    return errors


def _relative(found, expected, scale):
    return float(np.abs(found - expected).max() / max(float(np.linalg.norm(expected)), scale))


def mode_faults(model):
    """Return what is wrong with the names of a linear model's modes, a line each.

    The participation is worked out here by the left eigenvectors of another solver.
    """
    faults, names = [], [mode.name for mode in model.modes]
    faults += [f"{name!r} names {count} modes" for name, count in collections.Counter(names).items() if count > 1]
    count = sum(2 if mode.is_oscillatory else 1 for mode in model.modes)
    if count != len(model.state_names):
        faults.append(f"{count} poles of {len(model.state_names)} states")
    poles, shares = _participation(model.a)
    apart = np.abs(poles[:, None] - poles) + np.diag(np.full(len(poles), np.inf))
    parts = [part_of(name) for name in model.state_names]
    for mode in model.modes:
        i = int(np.argmin(np.abs(poles - mode.pole)))
        if apart[i].min() < 1e-5 * abs(poles[i]):  # any mixture of the two has their states
            continue
        faults += _name_faults(mode, shares[:, i], parts, model.state_names)
    return faults


def _participation(a):
    """Eigenvalues of a matrix and the share of each state (row) in each mode (column); of balanced states."""
    scale = np.sqrt(np.maximum(np.abs(a).sum(axis=1), 1e-12) / np.maximum(np.abs(a).sum(axis=0), 1e-12))
    poles, left, right = eig(a * (1.0 / scale)[:, None] * scale, left=True)
    shares = np.abs(left.conj() * right)
    return poles, shares / shares.sum(axis=0)


def _name_faults(mode, shares, parts, state_names):
    """Return whether family, rotors, drive and half of the body are those with the largest shares."""
    families = _sums(shares, [part.family for part in parts])
    if families[mode.family] < NEARLY * max(families.values()):
        return [f"{mode.name!r} is of {mode.family}, the largest share {max(families, key=families.get)} has"]
    own = np.array([part.family == mode.family for part in parts]) * shares
    if mode.rotors:
        rotors = _sums(own, [part.rotor + 1 for part in parts])
        largest = max(rotors, key=rotors.get)
        if sum(rotors[rotor] for rotor in mode.rotors) < NEARLY * rotors[largest]:
            return [f"{mode.name!r} is of rotors {mode.rotors}, the largest share {largest} has"]
    if mode.family == "drive":
        state = DRIVE_STATES[mode.name.partition(",")[0].rstrip(" 0123456789(+-)")]
        kinds = _sums(own, [name.partition("(")[0] for name in state_names])
        if kinds[state] < 0.5 * max(kinds.values()):
            return [f"{mode.name!r} is named after {state}, the largest share {max(kinds, key=kinds.get)} has"]
    return []


def _sums(shares, keys):
    found = collections.defaultdict(float)
    for share, key in zip(shares, keys, strict=True):
        found[key] += float(share)
    return found
