"""Aircraft to test with, and the compiled model wrapped so that a test reads like its statement."""

import copy
import functools
import math

import numba
import numpy as np

from sbs_sim.aircraft import Aircraft
from sbs_sim.config_file import config_folder
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.rotor_matrices import arranged, rotor_matrices
from sbs_sim.lanes import as_lanes, as_records
from sbs_sim.model import state as S
from sbs_sim.model import wind as W
from sbs_sim.model.average import azimuths
from sbs_sim.model.frames import ONE
from sbs_sim.model.integrate import ETD, FLYING, RK4, TSIT5, advance

CALM = np.zeros(3)
VACUUM = {"air_density": 0.0}
WEIGHTLESS_VACUUM = {"air_density": 0.0, "gravity": 0.0}
POLAR = np.array([1.0, -1.0, 1.0])  # image of a polar vector in the plane y = 0
AXIAL = -POLAR  # and of an axial one

# So heavy that no rotor moves it: an acceleration of 1e-4 m/s^2 at the loads of this one. Neither gravity nor drag.
TEST_STAND = {
    "mass": 1e6,
    "inertia": [[1e6, 0.0, 0.0], [0.0, 1e6, 0.0], [0.0, 0.0, 1e6]],
    "flat_plate_areas": [0.0, 0.0, 0.0],
}

# A rotor's blades, swept at the tip and with their mass beside the pitch axis.
OFFSET_BLADE = {
    "quarter_chord": {"stations": [0.2, 0.7, 1.0], "values": [0.004, 0.008, -0.04]},
    "chordwise_cg": {"stations": [0.1, 0.7, 1.0], "values": [0.012, 0.006, -0.03]},
    "twist_deg": {"root": 6.0, "tip": -4.0},
    "flap_hinge_offset": 0.03,
    "lag_spring": 20.0,
    "lag_damping": 0.3,
    "pitch_flap_coupling": 0.4,
    "pitch_lag_coupling": -0.2,
}


@functools.cache
def _aircraft_file(name):
    from ruamel.yaml import YAML

    return YAML(typ="safe", pure=True).load((config_folder() / "aircraft" / f"{name}.yaml").read_text())


def aircraft_data(name="sbs", *, environment=None, body=None, options=None, every_rotor=None, rotors=None):
    """Return the mapping of an aircraft file with changes.

    Parameters
    ----------
    name : str
        A file of config/aircraft.
    environment, body, options : dict, optional
        Values to change.
    every_rotor : dict, optional
        Values to change in all rotors.
    rotors : list of dict, optional
        Changes rotor by rotor; as many rotors as the list has entries, those beyond the file's two like the second.
    """
    data = copy.deepcopy(_aircraft_file(name))
    for part, changes in (("environment", environment), ("body", body), ("options", options)):
        data[part].update(changes or {})
    entries = data["rotors"] if rotors is None else [data["rotors"][min(i, 1)] for i in range(len(rotors))]
    data["rotors"] = [
        {**copy.deepcopy(entry), "name": f"R{i + 1}", **(every_rotor or {}), **(changes or {})}
        for i, (entry, changes) in enumerate(zip(entries, rotors or [{}] * len(entries), strict=True))
    ]
    return data


def build(name="sbs", folder=None, **changes):
    """Return the `Aircraft` of `aircraft_data(name, **changes)`; airfoils are looked for in `folder` too."""
    return Aircraft.from_dict(aircraft_data(name, **changes), folder)


def unit(*components):
    """Return a list of components with a norm of one."""
    return (np.array(components) / np.linalg.norm(components)).tolist()


def write_airfoil(path, cl, cd, step_deg=1.0, reynolds=(1e4, 1e6)):
    """Write an airfoil table without influence of the Reynolds number; cl and cd are functions of alpha [rad]."""
    degrees = np.linspace(-180.0, 180.0, round(360 / step_deg) + 1)
    rows = ["reynolds,alpha_deg,cl,cd"]
    for re in reynolds:
        for angle in degrees:
            # the same values at both ends, as the format demands
            alpha = np.radians(-180.0 if angle == 180.0 else angle)
            rows.append(f"{re},{angle:.10g},{float(cl(alpha))!r},{float(cd(alpha))!r}")
    path.write_text("\n".join(rows) + "\n")
    return str(path)


def linear_airfoil(path, slope=5.73, drag=0.01, linear_deg=60.0):
    """Write a table whose lift is exactly linear up to 60 deg and whose drag is constant: no kinks in use."""
    end = np.radians(linear_deg)

    def cl(alpha):
        size = abs(alpha)
        value = slope * (size if size <= end else end * (np.pi - size) / (np.pi - end))
        return np.sign(alpha) * value if size < np.pi else 0.0

    return write_airfoil(path, cl, lambda alpha: drag, step_deg=2.0)


class Model:
    """The compiled model of an aircraft: its derivative, averages and flights as plain calls."""

    def __init__(self, aircraft, lead_lag=True, cyclic_inflow=True, lanes="blades"):
        self.aircraft, self.layout = aircraft, aircraft.layout
        self.lead_lag, self.cyclic_inflow = lead_lag, cyclic_inflow
        self.engine = Engine(aircraft.arranged(lead_lag, cyclic_inflow, lanes), TSIT5)
        self.points = Engine(aircraft.arranged(lead_lag, cyclic_inflow, "points"))
        self.speeds = np.array([rotor.speed for rotor in aircraft.rotors])

    @property
    def no_swash(self):
        """Swashplates at zero, shape (n_rotors, 3)."""
        return np.zeros((len(self.speeds), 3))

    @property
    def loads(self):
        """Loads of the last derivative, shape (n_rotors, LOAD_SIZE)."""
        return self.engine.work.load_rows[:, 0].reshape(len(self.speeds), -1)

    def lanes(self, values):
        """Numbers of one flight as the engine takes them."""
        return self.engine.lanes([np.array(values, dtype=float).ravel()])

    def state(self, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0), lambda0=0.0):
        """Return a level state with undeflected blades."""
        x = np.zeros(self.layout.size)
        x[S.ATTITUDE] = 1.0
        x[S.VELOCITY : S.RATES], x[S.RATES : S.BODY_SIZE] = velocity, rates
        for j in range(len(self.speeds)):
            x[self.layout.inflow(j).start] = lambda0
        return x

    def derivative(self, x, swash=None, psi=None, wind=CALM):
        """Return the derivative of a state, shape (size,); the loads are `loads` then."""
        dx, engine = self.lanes(x), self.engine
        swash = self.no_swash if swash is None else swash
        psi = np.zeros(len(self.speeds)) if psi is None else psi
        engine.derivative(
            *(engine.model, self.lanes(x), self.lanes(swash), self.lanes(psi), self.lanes(wind), engine.work, dx, True)
        )
        return dx[:, 0].copy()

    def averaged(self, x, swash=None, azimuth_count=12):
        """Return the averaged derivative, shape (size,), and the averaged loads, shape (n_rotors, LOAD_SIZE)."""
        swash = self.no_swash if swash is None else np.array(swash, dtype=float)
        psi = azimuths(self.aircraft.passages, azimuth_count)
        rates, loads = self.points.average(np.array(x, dtype=float), swash, psi)
        return rates[: self.layout.size], loads

    def fly(self, x, steps, h, swash=None, psi0=None, first_step=0, method=RK4, wind=CALM):
        """Return the state after steps of length h [s], whatever becomes of it."""
        air = np.zeros(W.WIND_SIZE)
        air[W.STEADY : W.STEADY + 3] = wind
        swash = self.no_swash if swash is None else swash
        psi0 = np.zeros(len(self.speeds)) if psi0 is None else psi0
        bounds = np.full(self.layout.size + 1, np.inf)
        done, _, x = self.tick(x, swash, psi0, first_step, steps, h, air, method, bounds)
        assert done == steps
        return x

    def tick(self, x, swash, psi0, first_step, steps, h, air, method, bounds):
        """Steps made, the failed state, and the state after a tick of `advance`."""
        engine, failed_state, x = self.engine, np.full(self.engine.n, FLYING), self.lanes(x)
        if method == ETD:
            matrices = rotor_matrices(self.aircraft, self.lead_lag, self.cyclic_inflow, h)
            engine = Engine(engine.model, method, arranged([matrices]))
        advance(
            *(engine.code.derivative, engine.model, x, self.lanes(swash), self.lanes(psi0), first_step, steps, h),
            *(self.lanes(air), method, self.lanes(bounds), engine.work, engine.tick, engine.tick.done, failed_state),
        )
        return int(engine.tick.done[0]), int(failed_state[0]), x[:, 0].copy()

    def azimuth(self, steps, h, psi0=0.0):
        """Return the azimuths of all rotors after steps of length h [s], shape (n_rotors,)."""
        return psi0 + self.speeds * h * steps

    def jacobian(self, x, swash=None, azimuth_count=12, rows=slice(None), columns=None, step=1e-6):
        """Return rows and columns of the averaged derivative's derivative by the simulation state.

        `step` is one number or one for each column.
        """
        columns = range(self.layout.size) if columns is None else columns
        result = []
        for i, delta in zip(columns, np.broadcast_to(step, len(columns)), strict=True):
            difference = 0.0
            for sign in (1, -1):
                moved = np.array(x, dtype=float)
                moved[i] += sign * delta
                difference = difference + sign * self.averaged(moved, swash, azimuth_count)[0]
            result.append(difference[rows] / (2 * delta))
        return np.stack(result, axis=1)

    def rotor_places(self):
        """Return the places of the rotor states that are in use, and of the equations that settle them."""
        index, places, equations = np.arange(self.layout.size), [], []
        for j in range(len(self.speeds)):
            places += list(index[self.layout.flap(j)])
            equations += list(index[self.layout.flap_rate(j)])
            if self.lead_lag:
                places += list(index[self.layout.lag(j)])
                equations += list(index[self.layout.lag_rate(j)])
            inflow = list(index[self.layout.inflow(j)])[: 3 if self.cyclic_inflow else 1]
            places += inflow
            equations += inflow
        return places, equations

    def settle(self, x, swash=None, azimuth_count=12):
        """Return the state with the rotors in equilibrium while the body keeps its motion (Newton)."""
        x = np.array(x, dtype=float)
        places, equations = self.rotor_places()
        for _ in range(30):
            slope = self.averaged(x, swash, azimuth_count)[0][equations]
            matrix = self.jacobian(x, swash, azimuth_count, equations, places)
            step = np.linalg.solve(matrix, slope)
            x[places] -= step
            if np.abs(step).max() < 1e-12:
                return x
        raise AssertionError(f"the rotors did not settle: last step {np.abs(step).max():.3g}")


def model_numbers(aircraft):
    """Arrays of numbers of the compiled model by the names of their fields."""
    found = {}
    for name, part in aircraft.model()._asdict().items():
        if name == "indices":
            found |= {f"indices.{field}": values for field, values in part._asdict().items()}
        elif part.dtype.names:
            found |= {f"{name}.{field}": part[field] for field in part.dtype.names}
        else:
            found[name] = part
    return found


def is_finite_model(aircraft):
    """Whether all numbers of the compiled model are; ends of airfoil tables may be infinite.

    They are where a table has fewer Reynolds numbers than another one, or is for all of them.
    """
    numbers = model_numbers(aircraft)
    ends = [numbers.pop(name) for name in ("knots", "blades.max_number", "stall")]
    return not any(np.isnan(part).any() for part in ends) and all(np.isfinite(part).all() for part in numbers.values())


def mirrored_data(data):
    """Return the mapping of the aircraft's image in the plane y = 0."""
    image = copy.deepcopy(data)
    image["body"]["inertia"] = (np.outer(POLAR, POLAR) * np.array(data["body"]["inertia"])).tolist()
    for rotor in image["rotors"]:
        rotor["hub"] = (POLAR * rotor["hub"]).tolist()
        rotor["shaft_direction"] = (POLAR * rotor["shaft_direction"]).tolist()
        rotor["rotation"] = -rotor["rotation"]
        if "lateral_cyclic" in rotor.get("swashplate_offset_deg", {}):
            rotor["swashplate_offset_deg"]["lateral_cyclic"] *= -1.0
        for entry in rotor.get("schedule", []):  # of a control that is itself the image
            sign = -1.0 if entry["angle"] == "lateral_cyclic" else 1.0
            for key in {"factor", "offset_deg"} & entry.keys():
                entry[key] = [sign * value for value in entry[key]]
    for drive in image.get("drives", []):
        drive["inertia_axis"] = (AXIAL * drive.get("inertia_axis", [0.0, 0.0, 0.0])).tolist()
    for surface in image["body"].get("surfaces", []):
        surface["position"] = (POLAR * surface["position"]).tolist()
        surface["dihedral_deg"] = -surface["dihedral_deg"]
    if "fuselage" in image["body"]:
        _mirror_fuselage(image["body"]["fuselage"])
    for point in image.get("contact_points", []):
        for key in {"position", "rolling"} & point.keys():
            point[key] = (POLAR * point[key]).tolist()
    if "slope_heading_deg" in image.get("ground", {}):
        image["ground"]["slope_heading_deg"] *= -1.0
    return image


def _mirror_fuselage(fuselage):
    """Wind from the other side: side force, rolling and yawing moment change their sign."""
    fuselage["reference"] = (POLAR * fuselage["reference"]).tolist()
    fuselage["beta_deg"] = [-beta for beta in reversed(fuselage["beta_deg"])]
    for name, sign in (("drag", 1), ("side", -1), ("lift", 1), ("roll", -1), ("pitch", 1), ("yaw", -1)):
        table = fuselage.get(name, {})
        if "alpha" in table:
            table["alpha"] = [sign * value for value in table["alpha"]]
        if "beta" in table:
            table["beta"] = [sign * value for value in reversed(table["beta"])]
        if "grid" in table:
            table["grid"] = [[sign * value for value in reversed(row)] for row in table["grid"]]


def mirrored_state(x, layout=None):
    """Return the image of a state; a rotor's own coordinates follow its advancing side and stay as they are.

    The deflections of contact points to the right change sides, if a layout says where they are.
    """
    image = np.array(x, dtype=float)
    image[S.POSITION : S.ATTITUDE] *= POLAR
    image[S.ATTITUDE + 1 : S.VELOCITY] *= AXIAL
    image[S.VELOCITY : S.RATES] *= POLAR
    image[S.RATES : S.BODY_SIZE] *= AXIAL
    for i in range(layout.contacts if layout else 0):
        image[layout.contact(i)] *= [1.0, -1.0]
    return image


def mirrored_swash(swash):
    """Return the image of swashplate angles: left and right cyclic change sides."""
    return np.array(swash) * [1.0, -1.0, 1.0]


def turned_state(x, heading):
    """Return the state turned about the vertical by a heading [rad], about the origin."""
    c, s = np.cos(heading / 2), np.sin(heading / 2)
    w, i, j, k = x[S.ATTITUDE : S.VELOCITY]
    turned = np.array(x, dtype=float)
    turned[S.ATTITUDE : S.VELOCITY] = [c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w]
    turned[S.POSITION : S.ATTITUDE] = heading_matrix(heading) @ x[S.POSITION : S.ATTITUDE]
    return turned


def heading_matrix(heading):
    """Return the rotation by a heading [rad] about down, shape (3, 3)."""
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def wind_velocity(air, time, fraction=0.0):
    """Velocity of the air, NED [m/s], shape (3,), of the array of a tick at a time [s] that far through it."""
    out = np.empty((3, 1))
    _blow(np.asarray(air).reshape(-1, 1), time, fraction, ONE, out)
    return out[:, 0]


@numba.njit(error_model="numpy")
def _blow(air, time, fraction, like, out):
    records = as_records(like)
    W.wind_at(as_lanes(air, records), time, fraction, as_lanes(out, records))


RENAMED_CONTROLS = {
    "lever": ("collective", "heave"),
    "stick_right": ("lateral_cyclic", "roll"),
    "stick_forward": ("longitudinal_cyclic", "pitch"),
    "pedal": ("differential_longitudinal_cyclic", "yaw"),
}
PITCH_PER_INCH = math.radians(2.0)


def renamed_data():
    """The side-by-side helicopter with names of its own in another order, a lever in inches, and a fifth control."""
    data = aircraft_data()
    names = {old: new for new, (old, _) in RENAMED_CONTROLS.items()}
    order = ("pedal", "stick_forward", "stick_right", "lever")
    data["controls"] = {
        name: data["controls"][RENAMED_CONTROLS[name][0]] | {"axis": RENAMED_CONTROLS[name][1]} for name in order
    } | {"trimmer": {"range_deg": [-3.0, 3.0], "held_deg": 0.5}}
    data["controls"]["lever"] = {"range": [0.0, 10.0], "unit": "in", "axis": "heave"}
    for rotor, sense in zip(data["rotors"], (1.0, -1.0), strict=True):
        rotor["mixing"] = {
            angle: {names[control]: factor for control, factor in rotor["mixing"][angle].items()}
            for angle in S.SWASHPLATE_NAMES
        }
        rotor["mixing"]["collective"] = {"lever": PITCH_PER_INCH}
        rotor["mixing"]["lateral_cyclic"]["trimmer"] = sense
        rotor["swashplate_offset_deg"] = {"collective": 1.0, "lateral_cyclic": -0.5 * sense}
    return data
