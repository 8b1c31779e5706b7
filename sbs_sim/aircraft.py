"""Aircraft files: YAML to checked, frozen dataclasses to the flat arrays of the model.

The keys of a file, their types and plain ranges are in config/aircraft.schema.json (which editors can use); what
concerns several values at once is checked here.
"""

from __future__ import annotations  # `help` then shows types by their names

import hashlib
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks, config_file
from sbs_sim.aircraft_model import model_of, with_fidelity
from sbs_sim.aircraft_values import Place, check_path, mirrored, places, replaced, separate, value_at
from sbs_sim.content import ByContent
from sbs_sim.errors import AircraftError, AirfoilError
from sbs_sim.model.airfoil import AirfoilTable, read_table, stall_angles
from sbs_sim.model.frames import ONE, hub_axes
from sbs_sim.model.mixing import mixed
from sbs_sim.model.packing import by_blades, lane_count, side_by_side
from sbs_sim.model.records import Model
from sbs_sim.model.state import CONTROL_NAMES, SWASHPLATE_NAMES, StateLayout

Array = NDArray[np.float64]
Range = tuple[float, float]
EARLIER = ("interpolation", "linear")  # what there was before there was a choice, and the same hash
# Of a rotor and of the air, for the model.
NOT_PHYSICS = ("name", "airfoil", "collective_range", "cyclic_range", "swashplate_rate", "speed_of_sound")
MOST_TOLD = 5  # changes that a refusal names


@dataclass(frozen=True)
class Environment:
    """Air and gravity: density [kg/m^3], kinematic viscosity [m^2/s], gravity [m/s^2], speed of sound [m/s].

    The speed of sound is for Mach numbers that are told; the model has none.
    """

    air_density: float
    kinematic_viscosity: float
    gravity: float
    speed_of_sound: float = 340.3  # ISO 2533, standard atmosphere, at sea level


@dataclass(frozen=True, eq=False)
class Body(ByContent):
    """The whole aircraft, blades included.

    Attributes
    ----------
    mass : float
        [kg]
    inertia : ndarray, shape (3, 3)
        About the c.g., body axes, the matrix itself [kg m^2].
    flat_plate_areas : ndarray, shape (3,)
        Equivalent drag areas along x, y, z [m^2].
    """

    mass: float
    inertia: Array
    flat_plate_areas: Array


@dataclass(frozen=True)
class Options:
    """How the model reads the equations: see theory.md sections 4, 5 and 9."""

    coupling: str
    hub_moment: str
    flap_inertia: str
    elements: int
    interpolation: str = "linear"  # of files from before there was a choice


@dataclass(frozen=True, eq=False)
class Rotor(ByContent):
    """One rotor, SI units and radians; the keys of the aircraft file without `_deg` and `_rpm`.

    Attributes
    ----------
    hub, shaft_direction : ndarray, shape (3,)
        Hub centre from the c.g. [m], direction of thrust; body axes.
    rotation : int
        +1 counter-clockwise seen from above (against the thrust), -1 clockwise.
    mixing : ndarray, shape (3, 4)
        Swashplate angles (collective, lateral, longitudinal cyclic) = mixing @ pilot controls.
    """

    name: str
    hub: Array
    shaft_direction: Array
    rotation: int
    speed: float
    radius: float
    blades: int
    blade_mass: float
    blade_cg: float
    hinge_offset: float
    flap_hinge_offset: float
    flap_spring: float
    lag_spring: float
    lag_damping: float
    pitch_flap_coupling: float
    pitch_lag_coupling: float
    chord_root: float
    chord_tip: float
    twist_root: float
    twist_tip: float
    root_cutout: float
    tip_loss: float
    swashplate_phase: float
    airfoil: str
    duct_expansion: float
    collective_range: Range
    cyclic_range: Range
    swashplate_rate: float
    mixing: Array

    @property
    def blade_length(self) -> float:
        """L, from the flap hinge to the tip [m]."""
        return self.radius - self.hinge_offset

    @property
    def first_moment(self) -> float:
        """S1 of a blade about its flap hinge [kg m]."""
        return self.blade_mass * self.blade_cg

    @property
    def second_moment(self) -> float:
        """A1 of a blade about its flap hinge, m_b L^2 / 3 [kg m^2]."""
        return self.blade_mass * (self.blade_length * self.blade_length) / 3

    def elements(self, count: int) -> Array:
        """Blade elements at their mid-points (theory.md section 4).

        Parameters
        ----------
        count : int

        Returns
        -------
        ndarray, shape (params.ELEMENT_ROWS, count)
            Distance from the flap hinge [m], chord [m], c ds / 2 [m^2], share that carries lift, twist [rad].
        """
        length = self.blade_length
        width = (length - self.root_cutout) / count
        span = self.root_cutout + width * (np.arange(count) + 0.5)
        along = span / length
        chord = self.chord_root + along * (self.chord_tip - self.chord_root)
        lift_end = self.tip_loss * self.radius - self.hinge_offset
        lift = np.clip((lift_end - (span - width / 2)) / width, 0.0, 1.0)
        twist = self.twist_root + along * (self.twist_tip - self.twist_root)
        return np.stack([span, chord, chord * width / 2, lift, twist])


@dataclass(frozen=True, eq=False)
class Aircraft(ByContent):
    """An aircraft as its file describes it, checked.

    Attributes
    ----------
    name, description : str
    environment : Environment
    body : Body
    options : Options
    control_ranges : dict of str to (float, float)
        Range of each pilot control [rad].
    rotors : tuple of Rotor
    tables : tuple of AirfoilTable
        Section data of each rotor's blades; one object for rotors that have the same.
    data : dict
        The mapping that this is made of, with the keys of the file; not to be changed.
    folder : Path
        Where relative paths of airfoils start.
    """

    name: str
    description: str
    environment: Environment
    body: Body
    options: Options
    control_ranges: dict[str, Range]
    rotors: tuple[Rotor, ...]
    tables: tuple[AirfoilTable, ...] = field(repr=False)
    data: dict[str, Any] = field(repr=False, compare=False)
    folder: Path = field(repr=False, compare=False)

    @classmethod
    def load(cls, path_or_name: str | Path) -> Aircraft:
        """Read an aircraft file.

        Parameters
        ----------
        path_or_name : str or Path
            A path, or the name of a file in config/aircraft ("sbs").

        Raises
        ------
        AircraftError
            One line that names the file and every wrong key with its value and what is allowed.
        """
        checks.path("aircraft", path_or_name, AircraftError)
        path = _find(path_or_name, "aircraft", ".yaml", Path())
        try:
            return cls.from_dict(config_file.read_yaml(path), path.parent)
        except (AircraftError, config_file.UnreadableError) as error:
            raise AircraftError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: Any, folder: Path | None = None) -> Aircraft:
        """Aircraft of a mapping with the keys of an aircraft file.

        Parameters
        ----------
        data : dict
            As read from YAML.
        folder : Path, optional
            Where relative paths of airfoils start; the current folder if not given.

        Raises
        ------
        AircraftError
            See `load`.
        """
        return cls._made_of(data, Path.cwd() if folder is None else checks.path("folder", folder, AircraftError))

    @classmethod
    def _made_of(cls, data: Any, folder: Path, similar: Aircraft | None = None) -> Aircraft:
        """Checked aircraft of a mapping, with the airfoil tables of a similar one where they are the same."""
        _check_schema(data)
        data = separate(data)
        rotors = tuple(_rotor(entry) for entry in data["rotors"])
        body = data["body"]
        aircraft = cls(
            name=data["name"],
            description=data.get("description", ""),
            environment=Environment(**{key: float(value) for key, value in data["environment"].items()}),
            body=Body(float(body["mass"]), _frozen(body["inertia"]), _frozen(body["flat_plate_areas"])),
            options=Options(**{**data["options"], "elements": int(data["options"]["elements"])}),
            control_ranges={name: _radians(data["controls"][name]["range_deg"]) for name in CONTROL_NAMES},
            rotors=rotors,
            tables=_load_tables(rotors, folder, similar),
            data=data,
            folder=folder.absolute(),
        )
        problems = _physical_problems(aircraft)
        if problems:
            raise AircraftError("; ".join(problems))
        return aircraft

    def value(self, path: str) -> Any:
        """Value of the file at a path, see `with_value`; a list where the path means one of every rotor.

        Raises
        ------
        AircraftError
            A path that does not exist.
        """
        found = [value_at(self.data, place) for place in places(self.data, _schema(), path)]
        return found[0] if len(found) == 1 else found

    def with_value(self, path: str, value: Any) -> Aircraft:
        """Aircraft with one value of its file changed.

        Parameters
        ----------
        path : str
            Keys of the file with dots between them, indices of lists in brackets: "body.mass", "body.inertia[0][0]".
            "rotors.blade_mass" is that of every rotor, "rotors[0].blade_mass" or "rotors.MR1.blade_mass" that of one.
        value : number, str or list
            What the file would hold there, in its units.

        Raises
        ------
        AircraftError
            A path that does not exist, or a value with which the aircraft is not possible: one line that names path,
            value and what is allowed.
        """
        check_path(path)
        return self.with_values({path: value})

    def with_values(self, values: Mapping[str, Any]) -> Aircraft:
        """Aircraft with several values of its file changed, which are checked together and not one after the other.

        Parameters
        ----------
        values : mapping of str to value
            Paths and values as for `with_value`. Where two paths mean one place the later one counts:
            {"rotors.radius": 0.4, "rotors.MR1.radius": 0.5}. An element of the inertia beside the diagonal is that on
            the other side of it, too: "body.inertia[0][1]" is "body.inertia[1][0]".

        Raises
        ------
        AircraftError
            See `with_value`; or two values for the two sides of the inertia.
        """
        checks.instance("values", values, Mapping, AircraftError)
        plain = {path: _python(value) for path, value in values.items()}
        data, pairs = self.data, dict[Place, tuple[str, Any]]()
        for path, value in plain.items():
            for place in places(data, _schema(), path):
                for one in (place, mirrored(place)):
                    data = replaced(data, one, value)
                _check_pair(pairs, place, path, value)
        try:
            return self._made_of(data, self.folder, self)
        except AircraftError as error:
            raise AircraftError(_told_with(plain, str(error))) from None

    def __hash__(self) -> int:
        return hash((self.name, self.parameter_hash))

    @property
    def airfoils(self) -> dict[str, AirfoilTable]:
        """Section data by the names in the file; of an airfoil that was extended those for the first of its rotors."""
        pairs = zip(self.rotors, self.tables, strict=True)
        return {rotor.airfoil: table for rotor, table in reversed(list(pairs))}

    @cached_property
    def layout(self) -> StateLayout:
        """Places and names of the states of this aircraft."""
        return StateLayout(tuple(rotor.blades for rotor in self.rotors))

    @cached_property
    def parameter_hash(self) -> str:
        """SHA-256 over everything that the model takes from the aircraft file: equal for equal physics.

        It is taken of the values in SI units, not of how the compiled model holds them, so that other versions of this
        package know an aircraft again.
        """
        digest = hashlib.sha256()
        for part in (self.environment, self.body, self.options, *self.rotors):
            for name, value in vars(part).items():
                if name not in NOT_PHYSICS and (name, value) != EARLIER:
                    _digest(digest, name, value)
        for table in self.tables:
            for name in ("reynolds", "alpha", "cl", "cd"):
                _digest(digest, name, getattr(table, name))
        return digest.hexdigest()

    def files(self) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Everything that makes this aircraft: its mapping, which names airfoils by file, and those files by name.

        Raises
        ------
        AircraftError
            An airfoil's file is not there any more.
        """
        data, contents, names = separate(self.data), {}, {}
        for i, airfoil in enumerate(sorted(self.airfoils)):
            names[airfoil] = f"{i}_{Path(airfoil).stem}.csv"
            contents[names[airfoil]] = _find(airfoil, "airfoils", ".csv", self.folder).read_bytes()
        for entry in data["rotors"]:
            entry["airfoil"] = names[entry["airfoil"]]
        return data, contents

    def mix(self, controls: ArrayLike) -> Array:
        """Swashplate angles of all rotors [rad], shape (n_rotors, 3), of the pilot controls [rad], shape (4,)."""
        angles = np.empty((3 * len(self.rotors), 1))
        mixed(self.mixing, np.asarray(controls, dtype=float).reshape(-1, 1), ONE, angles)
        return angles.reshape(-1, 3)

    @cached_property
    def mixing(self) -> Array:
        """Swashplate angles of all rotors over the pilot controls, shape (3 n_rotors, 4)."""
        return np.concatenate([rotor.mixing for rotor in self.rotors])

    def unmix(self, angles: Array) -> Array:
        """Pilot controls [rad], shape (4,), whose mixture is nearest to swashplate angles [rad], (n_rotors, 3)."""
        return np.asarray(np.linalg.lstsq(self.mixing, np.ravel(angles), rcond=None)[0], dtype=np.float64)

    def fuselage(self) -> tuple[float, Array, Array]:
        """Mass [kg], first moment [kg m] and inertia [kg m^2] about the c.g. of the aircraft without blades.

        The printed totals minus the blades, undeflected and averaged over azimuth (theory.md section 5); the c.g. of
        the whole stays at the origin, so the fuselage has the first moment that balances the blades.
        """
        mass = self.body.mass
        first = np.zeros(3)
        inertia = self.body.inertia.copy()
        for rotor in self.rotors:
            blades = rotor.blades * rotor.blade_mass
            mass -= blades
            first -= blades * rotor.hub
            inertia -= _blades_inertia(rotor)
        return mass, first, inertia

    def model(self, lead_lag: bool = True, cyclic_inflow: bool = True) -> Model:
        """Records of the compiled model with the given fidelity (theory.md section 7), with a single lane everywhere.

        Parameters
        ----------
        lead_lag : bool
            False holds the blades at zero lag.
        cyclic_inflow : bool
            False holds lambdas and lambdac at zero.

        Returns
        -------
        Model
            Shared with other callers: read only. `sbs_sim.model.packing` arranges it for the processor.
        """
        return with_fidelity(self._model, lead_lag, cyclic_inflow)

    def arranged(self, lead_lag: bool, cyclic_inflow: bool, lanes: str) -> Model:
        """`model` with its blades in the lanes (lanes = "blades"), or copies of it ("points"); read only."""
        key = lead_lag, cyclic_inflow, lanes
        if key not in self._arrangements:
            model, count = self.model(lead_lag, cyclic_inflow), lane_count()
            made = by_blades(model, count) if lanes == "blades" else side_by_side([model] * count)
            self._arrangements[key] = made
        return self._arrangements[key]

    @cached_property
    def _arrangements(self) -> dict[tuple[bool, bool, str], Model]:
        return {}

    @cached_property
    def kept(self) -> dict[Any, Any]:
        """What is worked out once: rotors by momentum theory, hovers that trims begin from, matrices of `etd`."""
        return {}

    @cached_property
    def _model(self) -> Model:
        return model_of(self)

    @cached_property
    def stall_table(self) -> Array:
        """Reynolds numbers and stall angles of every rotor as `working_state` takes them, shape (n_rotors, 3, n)."""
        size = max(len(table.reynolds) for table in self.tables)
        return np.array(
            [
                np.pad((table.reynolds, *stall_angles(table)), ((0, 0), (0, size - len(table.reynolds))), "edge")
                for table in self.tables
            ]
        )


def _python(value: Any) -> Any:
    """A value as YAML gives it."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def _check_pair(pairs: dict[Place, tuple[str, Any]], place: Place, path: str, value: Any) -> None:
    """Raise AircraftError if the other side of a symmetric pair was given another value; keep this one."""
    across = mirrored(place)
    if across == place:
        return
    other, given = pairs.get(across, (path, value))
    if given != value and other != path:
        both = f"{other} = {checks.shown(given)}, {path} = {checks.shown(value)}"
        raise AircraftError(f"{both}: allowed is one value, the inertia is symmetric")
    pairs[place] = path, value


def _told_with(values: Mapping[str, Any], error: str) -> str:
    """What is wrong with an aircraft, with the changes that made it so, where it does not name them itself."""
    named = [path for path in values if error.startswith(f"{path} = ")]
    if named and len(values) == 1:
        return error
    changes = ", ".join(f"{path} = {checks.shown(value)}" for path, value in list(values.items())[:MOST_TOLD])
    more = f" and {len(values) - MOST_TOLD} more" if len(values) > MOST_TOLD else ""
    return f"{changes}{more}: {error}"


def config_folder() -> Path:
    """Folder with the aircraft and airfoil files that come with the package.

    Raises
    ------
    AircraftError
        The package was installed without them.
    """
    here = Path(__file__).resolve().parent
    places = [here.parent / "config", *(parent / "share/sbs_sim/config" for parent in here.parents)]
    for place in places:
        if (place / "aircraft").is_dir():
            return place
    raise AircraftError(f"no folder config/aircraft beside {here.parent} and none under share/sbs_sim above it")


def _find(path_or_name: str | Path, kind: str, suffix: str, folder: Path) -> Path:
    """Path of a configuration file given by path, relative ones from `folder`, or by name."""
    given = Path(path_or_name)
    for place in (folder, config_folder() / kind):
        for candidate in (place / given, place / f"{given}{suffix}"):
            if _is_file(candidate):
                return candidate
    known = ", ".join(sorted(path.stem for path in (config_folder() / kind).glob(f"*{suffix}")))
    raise AircraftError(f"{kind.rstrip('s')} = {str(path_or_name)!r}: allowed are a file's path or one of {known}")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have, a folder that may not be entered
        return False


@cache
def _schema() -> dict[str, Any]:
    return dict(json.loads((config_folder() / "aircraft.schema.json").read_text(encoding="utf-8")))


@cache
def _validator() -> Any:
    from jsonschema import Draft202012Validator  # here, because it is slow to import and needed once

    return Draft202012Validator(_schema())


def _check_schema(data: Any) -> None:
    """Raise AircraftError with all that is wrong with size, keys, types and plain ranges."""
    problems = config_file.problems(data, _validator())
    if problems:
        raise AircraftError("; ".join(problems))


def _rotor(entry: dict[str, Any]) -> Rotor:
    """Rotor of one entry of the file."""
    values = dict(entry)
    twist, chord, mixing = values.pop("twist_deg"), values.pop("chord"), values.pop("mixing")
    rows = [[mixing[angle].get(control, 0.0) for control in CONTROL_NAMES] for angle in SWASHPLATE_NAMES]
    numbers = {key: float(value) for key, value in values.items() if isinstance(value, (int, float))}
    numbers["speed"] = numbers.pop("speed_rpm") * math.pi / 30
    numbers["swashplate_phase"] = math.radians(numbers.pop("swashplate_phase_deg"))
    numbers["swashplate_rate"] = math.radians(numbers.pop("swashplate_rate_deg"))
    return Rotor(
        **{
            **numbers,
            "name": values["name"],
            "airfoil": values["airfoil"],
            "rotation": int(values["rotation"]),
            "blades": int(values["blades"]),
            "hub": _frozen(values["hub"]),
            "shaft_direction": _frozen(values["shaft_direction"]),
            "collective_range": _radians(values["collective_range_deg"]),
            "cyclic_range": _radians(values["cyclic_range_deg"]),
            "chord_root": float(chord["root"]),
            "chord_tip": float(chord["tip"]),
            "twist_root": math.radians(twist["root"]),
            "twist_tip": math.radians(twist["tip"]),
            "mixing": _frozen(rows),
        }
    )


def _frozen(values: Any) -> Array:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def _radians(degrees: list[float]) -> Range:
    return math.radians(degrees[0]), math.radians(degrees[1])


def _load_tables(rotors: tuple[Rotor, ...], folder: Path, similar: Aircraft | None) -> tuple[AirfoilTable, ...]:
    """Airfoil table of every rotor; a partial table is extended for the aspect ratio of its blades.

    What a similar aircraft from the same folder has read already is not read again.
    """
    known: dict[tuple[str, float], AirfoilTable] = {}
    if similar:
        known = {_section(rotor): table for rotor, table in zip(similar.rotors, similar.tables, strict=True)}
    tables = []
    for i, rotor in enumerate(rotors):
        section = _section(rotor)
        if section not in known:
            known[section] = _read_table(i, rotor, folder, {name: table for (name, _), table in known.items()})
        tables.append(known[section])
    return tuple(tables)


def _section(rotor: Rotor) -> tuple[str, float]:
    """Airfoil and aspect ratio of a rotor's blades."""
    return rotor.airfoil, 2 * rotor.radius / (rotor.chord_root + rotor.chord_tip)


def _read_table(i: int, rotor: Rotor, folder: Path, known: dict[str, AirfoilTable]) -> AirfoilTable:
    """Table of a rotor: the known one of its airfoil, if that is the same for every blade, else from the file."""
    try:
        path = _find(rotor.airfoil, "airfoils", ".csv", folder)
    except AircraftError as error:
        raise AircraftError(f"rotors[{i}].{error}") from None
    if rotor.airfoil in known and _covers_circle(path):
        return known[rotor.airfoil]
    try:
        return read_table(path, _section(rotor)[1])
    except AirfoilError as error:
        raise AirfoilError(f"rotors[{i}].airfoil = {rotor.airfoil!r}: {error}") from None


def _covers_circle(path: Path) -> bool:
    """True for a table that begins at -180 deg: it is not extended, and so the aspect ratio does not matter."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            rows = [line for line in itertools.islice(file, 1000) if line.strip() and not line.lstrip().startswith("#")]
        return float(rows[1].split(",")[1]) == -180.0  # the first row is the header
    except (OSError, ValueError, IndexError):  # what is wrong is told where the table is read
        return False


def _digest(digest: Any, name: str, value: Any) -> None:
    """Add a named number, text or array to a digest; whole numbers count as floats."""
    if isinstance(value, str):
        digest.update(f"{name}={value};".encode())
        return
    values = np.ascontiguousarray(value, dtype=np.float64) + 0.0  # there is one zero
    digest.update(f"{name}{values.shape}".encode() + values.tobytes())


def _blades_inertia(rotor: Rotor) -> Array:
    """Inertia about the c.g. of a rotor's undeflected blades, averaged over azimuth [kg m^2], shape (3, 3)."""
    e0 = rotor.hinge_offset
    polar = rotor.blades * (rotor.blade_mass * (e0 * e0) + 2 * e0 * rotor.first_moment + rotor.second_moment)
    axes = hub_axes(rotor.shaft_direction)
    about_hub = polar / 2 * (np.eye(3) + np.outer(axes[:, 2], axes[:, 2]))
    hub, mass = rotor.hub, rotor.blades * rotor.blade_mass
    distance = hub[0] * hub[0] + hub[1] * hub[1] + hub[2] * hub[2]
    return np.asarray(about_hub + mass * (distance * np.eye(3) - np.outer(hub, hub)))


def _physical_problems(aircraft: Aircraft) -> list[str]:
    """What no schema can say: relations between values that physics demands."""
    problems = _inertia_problems("body.inertia", aircraft.body.inertia)
    options = aircraft.options
    if options.coupling == "complete":
        for key, value in (("hub_moment", options.hub_moment), ("flap_inertia", options.flap_inertia)):
            if value in ("paper", "axis_to_tip"):
                problems.append(f"options.{key} = {value!r}: allowed with options.coupling = paper only")
    for name, limits in aircraft.control_ranges.items():
        problems += _range_problems(f"controls.{name}.range_deg", limits)
    for i, rotor in enumerate(aircraft.rotors):
        problems += [f"rotors[{i}].{problem}" for problem in _rotor_problems(rotor)]
    names = [rotor.name for rotor in aircraft.rotors]
    for path, name in (("name", aircraft.name), *((f"rotors[{i}].name", name) for i, name in enumerate(names))):
        if not name.isprintable():  # they are shown in terminals and pages
            problems.append(f"{path} = {name!r}: allowed are printable characters")
    problems += [f"rotors[{i}].name = {name!r}: used twice" for i, name in enumerate(names) if name in names[:i]]
    if problems:
        return problems
    mass, _, inertia = aircraft.fuselage()
    if mass <= 0:
        blades = aircraft.body.mass - mass
        return [f"body.mass = {aircraft.body.mass}: allowed is > {blades:g}, the mass of all blades"]
    return _inertia_problems("body.inertia without the blades", inertia)


def _inertia_problems(path: str, inertia: Array) -> list[str]:
    shown = inertia.round(6).tolist()
    if not np.allclose(inertia, inertia.T, rtol=0, atol=1e-12 * abs(inertia).max()):
        return [f"{path} = {shown}: allowed is a symmetric matrix"]
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] <= 0:
        return [f"{path} = {shown}: allowed is a positive definite matrix"]
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        return [f"{path} = {shown}: allowed are principal moments of which none exceeds the sum of the others"]
    return []


def _range_problems(path: str, limits: Range) -> list[str]:
    low, high = (round(math.degrees(value), 9) for value in limits)
    return [] if low <= high else [f"{path} = [{low:g}, {high:g}]: allowed is a lower end below the upper one"]


def _rotor_problems(rotor: Rotor) -> list[str]:
    length = rotor.blade_length
    checks = [
        (np.linalg.norm(rotor.shaft_direction) > 1e-6, "shaft_direction", "a vector that is not zero"),
        (rotor.hinge_offset < rotor.radius, "hinge_offset", f"< {rotor.radius:g}, the radius"),
        (
            rotor.flap_hinge_offset <= rotor.hinge_offset,
            "flap_hinge_offset",
            f"<= {rotor.hinge_offset:g}, the hinge_offset",
        ),
        (
            rotor.root_cutout < length or length <= 0,
            "root_cutout",
            f"< {length:g}, from the flap hinge to the tip",
        ),
        (
            rotor.blade_cg <= length / math.sqrt(3) or length <= 0,
            "blade_cg",
            f"<= {length / math.sqrt(3):.6g}, L/sqrt(3): the blade's second moment is m_b L^2/3",
        ),
    ]
    problems = [f"{key} = {_plain(getattr(rotor, key))}: allowed is {text}" for good, key, text in checks if not good]
    problems += _range_problems("collective_range_deg", rotor.collective_range)
    return problems + _range_problems("cyclic_range_deg", rotor.cyclic_range)


def _plain(value: Any) -> str:
    return str(value.tolist() if isinstance(value, np.ndarray) else value)
