"""Aircraft: read from YAML files, checked, held as frozen dataclasses, and made into records of the compiled model.

`sbs_sim.aircraft.description` declares the values of a file. To add a value see `sbs_sim.aircraft.declaration`.
"""

from __future__ import annotations  # `help` then shows types by their names

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks, config_file, validation
from sbs_sim.aircraft.airfoils import load_tables
from sbs_sim.aircraft.blade_offsets import blade_moments
from sbs_sim.aircraft.commands import Row, drive_offset, padded, rows_of, scheduled_controls
from sbs_sim.aircraft.consistency import consistency_problems, table_problems
from sbs_sim.aircraft.declaration import cached_by_class, declarations, frozen, schema_of, values_of
from sbs_sim.aircraft.description import CONTACT, Array, Description, Range, Rotor
from sbs_sim.aircraft.model_records import drive_of, first_rotor, gear, model_of, with_fidelity, with_steady_sections
from sbs_sim.aircraft.paths import (
    Location,
    check_path,
    instead_of,
    locations,
    mirrored,
    path_of,
    replaced,
    separate,
    value_at,
    without,
)
from sbs_sim.content import same
from sbs_sim.errors import AircraftError
from sbs_sim.model.airfoil import AirfoilTable
from sbs_sim.model.frames import ONE, hub_axes
from sbs_sim.model.mixing import mixed
from sbs_sim.model.packing import by_blades, lane_count, side_by_side
from sbs_sim.model.records import QUAD, Model
from sbs_sim.model.state import CONTROL_AXES, CONTROL_NAMES, SECTION_NAMES, SPEED, SWASHPLATE_NAMES, StateLayout

MAX_CHANGES_SHOWN = 5  # in a refusal
TYPICAL_ANGLE = 0.3  # rad; the range of a control that is no angle counts as that in trims
COEFFICIENTS = ("alpha", "cl", "cd")  # of airfoil tables


@dataclass(frozen=True, eq=False)
class Aircraft(Description):
    """An aircraft as its file describes it, checked.

    Attributes
    ----------
    name, description : str
    environment : Environment
    body : Body
    options : Options
    controls : tuple of Control
        Pilot controls: those of the paper's aircraft in its order, then others in that of the file.
    rotors : tuple of Rotor
    ground : Ground
    contact_points : tuple of ContactPoint
    drives : tuple of Drive
    sections : tuple of tuple of AirfoilTable
        Section data of each rotor's blades from the root outwards, see `Rotor.airfoil_at`; one object for sections
        that are the same.
    data : dict
        The mapping of the file, with its keys and units; not to be changed.
    folder : Path
        Where relative paths of airfoils start.
    """

    sections: tuple[tuple[AirfoilTable, ...], ...] = field(repr=False, kw_only=True)
    data: dict[str, Any] = field(repr=False, compare=False, kw_only=True)
    folder: Path = field(repr=False, compare=False, kw_only=True)

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
        path = config_file.find_file(path_or_name, "aircraft", ".yaml", Path())
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
        """Checked aircraft of a mapping; airfoil tables that a similar aircraft has are not read again."""
        if problems := validation.problems(data, _validator(cls), similar and similar.data):
            raise AircraftError("; ".join(problems))
        data = separate(data)
        values = values_of(cls, data)
        if problems := table_problems(values["rotors"]):
            raise AircraftError("; ".join(problems))
        known = (similar.rotors, similar.sections) if similar else ((), ())
        sections = load_tables(values["rotors"], folder, *known)
        aircraft = cls(**values, sections=sections, data=data, folder=folder.absolute())
        if problems := consistency_problems(aircraft):
            raise AircraftError("; ".join(problems))
        return aircraft

    def value(self, path: str) -> Any:
        """Value of the file at a path, see `with_value`; a list where the path stands for that of every rotor.

        Raises
        ------
        AircraftError
            A path that does not exist.
        """
        found = [value_at(self.data, location) for location in locations(self.data, schema_of(type(self)), path)]
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
            Paths and values as for `with_value`. Where two paths stand for one value the later one counts:
            {"rotors.radius": 0.4, "rotors.MR1.radius": 0.5}. An element of the inertia off the diagonal sets the
            symmetric one, too: "body.inertia[0][1]" is "body.inertia[1][0]". "environment.altitude" takes the place
            of density, viscosity and speed of sound, "rotors.mass_distribution" that of mass, c.g. and inertia of a
            blade.

        Raises
        ------
        AircraftError
            See `with_value`; or different values for two symmetric elements of the inertia.
        """
        checks.instance("values", values, Mapping, AircraftError)
        plain = {path: _python(value) for path, value in values.items()}
        data, pairs, given = self.data, dict[Location, tuple[str, Any]](), list[Location]()
        for path, value in plain.items():
            for location in locations(data, schema_of(type(self)), path):
                for one in (location, mirrored(location)):
                    data = replaced(data, one, value)
                given.append(location)
                _check_pair(pairs, location, path, value)
        for location in dict.fromkeys(other for one in given for other in instead_of(one) if other not in given):
            data = without(data, location)
        try:
            return self._made_of(data, self.folder, self)
        except AircraftError as error:
            named = {
                path_of(location): path for path in plain for location in locations(data, schema_of(type(self)), path)
            }
            raise AircraftError(_with_changes(plain, _as_given(str(error), named))) from None

    def __hash__(self) -> int:
        return hash((self.name, self.parameter_hash))

    @property
    def airfoils(self) -> dict[str, AirfoilTable]:
        """Section data by the names in the file; of an extended airfoil the table of its first rotor."""
        pairs = [
            pair
            for rotor, tables in zip(self.rotors, self.sections, strict=True)
            for pair in zip(rotor.airfoil_names, tables, strict=True)
        ]
        return dict(reversed(pairs))

    def table_at(self, rotor: int, radius: float) -> AirfoilTable:
        """Section data of the blades of a rotor, by its number, at a share of the radius from the axis."""
        one = self.rotors[rotor]
        return self.sections[rotor][int(one.airfoil_at(radius * one.radius - one.hinge_offset))]

    def number_axis(self, rotor: int) -> str:
        """What the airfoil tables of a rotor, by its number, are over besides the angle: "reynolds" or "mach"."""
        tables = self.sections[rotor]
        return next((table.axis for table in tables if len(table.numbers) > 1), tables[0].axis)

    @cached_property
    def layout(self) -> StateLayout:
        """Indices and names of the states of this aircraft."""
        return StateLayout(
            tuple(rotor.blades for rotor in self.rotors),
            tuple(drive.state_names for drive in self.drives),
            len(self.contact_points) if self.has_contact else 0,
            tuple(rotor.has_wake_states for rotor in self.rotors),
            self._sections if self.section_states else 0,
            self.section_states,
        )

    @property
    def _sections(self) -> int:
        """Sections of all blades, which have room in eights of two quads (`sbs_sim.model.records`)."""
        quads = sum(-(-rotor.blades // QUAD) for rotor in self.rotors)
        return -(-quads // 2) * 2 * QUAD * self.options.elements

    @property
    def section_states(self) -> int:
        """States of every section: 0 of steady ones, 1 of late separation, 4 with a vortex."""
        if any(rotor.has_stall_vortex for rotor in self.rotors):
            return len(SECTION_NAMES)
        return int(any(rotor.has_late_separation for rotor in self.rotors))

    @property
    def has_contact(self) -> bool:
        """Its contact points carry it on the ground."""
        return self.ground.contact == CONTACT

    @cached_property
    def locked_names(self) -> frozenset[str]:
        """Names of states that hold the coning of teetering rotors, which is given."""
        rotors = [j + 1 for j, rotor in enumerate(self.rotors) if rotor.is_teetering]
        return frozenset(f"{name}({j})" for j in rotors for name in ("a0", "da0"))

    @cached_property
    def passages(self) -> tuple[int, ...]:
        """How often each rotor and its multiblade coordinates are the same again in one revolution.

        With every blade; with every other one of an even number, whose differential coordinate changes its sign from
        one to the next; once if the blades differ.
        """
        return tuple(_passages(rotor) for rotor in self.rotors)

    @cached_property
    def parameter_hash(self) -> str:
        """SHA-256 over everything that the model takes from the aircraft file: equal for equal physics.

        It covers the values in SI units, not the records of the compiled model, so that it is the same in other
        versions of this package. A value that has the default of its declaration is left out: values that are added
        to the declarations later do not change the hash of older files.
        """
        digest = hashlib.sha256()
        points = self.contact_points if self.has_contact else ()
        for part in (self.environment, self.body, self.options, self.ground, *points, *self.rotors, *self.drives):
            self._digest_part(digest, part)
        if self.control_names != CONTROL_NAMES or any(c.held is not None or not c.is_angle for c in self.controls):
            for control in self.controls:
                held = math.nan if control.held is None else control.held
                _digest(digest, f"control {control.name} {control.unit}", held)
        for table in (table for tables in self.sections for table in tables):
            for name, values in ((table.axis, table.numbers), *((key, getattr(table, key)) for key in COEFFICIENTS)):
                _digest(digest, name, values)
        if any(self.number_axis(j) == "mach" for j in range(len(self.rotors))):
            _digest(digest, "speed_of_sound", self.environment.speed_of_sound)
        return digest.hexdigest()

    def files(self) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Mapping of this aircraft, which names airfoils by file, and the contents of those files by name.

        Raises
        ------
        AircraftError
            An airfoil's file does not exist any more.
        """
        data, contents, names = separate(self.data), {}, {}
        for i, airfoil in enumerate(sorted(self.airfoils)):
            names[airfoil] = f"{i}_{Path(airfoil).stem}.csv"
            contents[names[airfoil]] = config_file.find_file(airfoil, "airfoils", ".csv", self.folder).read_bytes()
        for entry in data["rotors"]:
            entry["airfoil"] = names[entry["airfoil"]]
            if "outboard_airfoils" in entry:
                entry["outboard_airfoils"]["values"] = [names[name] for name in entry["outboard_airfoils"]["values"]]
        return data, contents

    def mix(self, controls: ArrayLike) -> Array:
        """Swashplate angles of all rotors [rad], shape (n_rotors, 3), of the pilot controls, shape (n_controls,).

        Of an aircraft whose controls act on drives too, a row for each such drive follows: throttle, set point of the
        governor over the speed in the file, and zero; then for each surface that controls act on one with the incidence
        that they add [rad], and zeros; then for each control whose factors change with the airspeed one with its value,
        and zeros, see `rows`. All that is called swashplate has these rows. The angles are those without what
        `schedule` of a rotor adds at the present airspeed, which `scheduled` has.
        """
        angles = np.empty((3 * len(self.rows), 1))
        mixed(self.rigging, np.asarray(controls, dtype=float).reshape(-1, 1), ONE, angles)
        return angles.reshape(-1, 3)

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """What pilot controls command: the swashplate of each rotor, and drives and surfaces that controls act on."""
        return rows_of(self)

    @cached_property
    def commanded_drives(self) -> tuple[int, ...]:
        """Indices of the drives that pilot controls act on."""
        return tuple(i for i, drive in enumerate(self.drives) if drive.mixing)

    @cached_property
    def commanded_surfaces(self) -> tuple[int, ...]:
        """Indices of the surfaces that pilot controls act on."""
        return tuple(i for i, surface in enumerate(self.body.surfaces) if surface.mixing)

    @cached_property
    def mixing(self) -> Array:
        """Swashplate angles of all rotors over the pilot controls, shape (3 n_rows, n_controls), see `mix`."""
        moved = [self.drives[i].mixing for i in self.commanded_drives]
        moved += [self.body.surfaces[i].mixing for i in self.commanded_surfaces]
        moved += [{"": {name: 1.0}} for name in scheduled_controls(self)]
        others = [padded(self._factors(mixing)) for mixing in moved]
        return frozen(np.concatenate([*(self._factors(rotor.mixing) for rotor in self.rotors), *others]))

    def _digest_part(self, digest: Any, part: object) -> None:
        """Add the values of a part of the file that have not their default, those of its own parts included."""
        for name, declaration in declarations(type(part)).items():
            value = getattr(part, name)
            if not declaration.is_physics or same(value, declaration.internal_default):
                continue
            if declaration.record is None:
                _digest(digest, name, self._factors(value) if name == "mixing" else value)
                continue
            for inner in value if isinstance(value, tuple) else (value,):
                digest.update(f"{name}:".encode())
                self._digest_part(digest, inner)

    def _factors(self, mixing: Mapping[str, Mapping[str, float]]) -> Array:
        """Factors of one rotor, shape (3, n_controls), or of one drive (2, n_controls) or surface (1, n_controls)."""
        return np.array([[row.get(name, 0.0) for name in self.control_names] for row in mixing.values()])

    @cached_property
    def rigging(self) -> Array:
        """`mixing`, and as its last column the swashplate angles where all controls are zero [rad]."""
        drives = [drive_offset(self.drives[i]) for i in self.commanded_drives]
        offsets = np.concatenate([*(rotor.swashplate_offset for rotor in self.rotors), *drives])
        others = np.zeros(len(self.mixing) - len(offsets))
        return frozen(np.column_stack([self.mixing, np.concatenate([offsets, others])]))

    def scheduled(self, rows: ArrayLike, airspeed: float) -> Array:
        """Commands of `mix` with what the schedules of the rotors add at an airspeed [m/s], shape (n_rows, 3)."""
        given = np.asarray(rows, dtype=float)
        found, names = given.copy(), scheduled_controls(self)
        controls = dict(zip(names, given[len(given) - len(names) :, 0], strict=True))
        for j, rotor in enumerate(self.rotors):
            for entry in rotor.schedule:
                share = np.interp(airspeed, entry.airspeed, entry.values)
                found[j, SWASHPLATE_NAMES.index(entry.angle)] += share * controls.get(entry.control, 1.0)
        return found

    @property
    def rotor_span(self) -> float:
        """Distance in y of the outermost blade tips, rotors taken as circles [m]."""
        sides = [(rotor.hub[1] - rotor.reach, rotor.hub[1] + rotor.reach) for rotor in self.rotors]
        return float(max(right for _, right in sides) - min(left for left, _ in sides))

    @cached_property
    def control_names(self) -> tuple[str, ...]:
        """Names of the pilot controls."""
        return tuple(control.name for control in self.controls)

    @property
    def control_units(self) -> tuple[str, ...]:
        """Units of the pilot controls: "rad" for angles."""
        return tuple(control.unit for control in self.controls)

    @property
    def control_ranges(self) -> dict[str, Range]:
        """Range of each pilot control [rad, or its unit]."""
        return {control.name: control.range for control in self.controls}

    @cached_property
    def trimmed_controls(self) -> NDArray[np.int64]:
        """Indices of the pilot controls that a trim finds."""
        return np.array([i for i, control in enumerate(self.controls) if control.held is None], dtype=np.int64)

    @cached_property
    def axis_controls(self) -> NDArray[np.int64]:
        """Indices of the pilot controls that heave, roll, pitch and yaw an aircraft, shape (4,).

        Raises
        ------
        AircraftError
            No control has one of these axes.
        """
        return axis_controls(tuple(control.axis for control in self.controls), self.control_units)

    @cached_property
    def has_axes(self) -> bool:
        """It has controls for sticks and controllers, see `axis_controls`."""
        try:
            return len(self.axis_controls) == len(CONTROL_AXES)
        except AircraftError:
            return False

    def with_axes(self, values: ArrayLike) -> Array:
        """All pilot controls, shape (n_controls,), of those of the four axes; the others are held.

        Raises
        ------
        AircraftError
            See `axis_controls`.
        """
        controls = self.held_controls.copy()
        controls[self.axis_controls] = values
        return controls

    @cached_property
    def held_controls(self) -> Array:
        """Values of the pilot controls that trims do not change, 0 for the others, shape (n_controls,)."""
        return frozen([control.held or 0.0 for control in self.controls])

    @cached_property
    def resting_controls(self) -> Array:
        """Pilot controls on a stand, shape (n_controls,): what is held, else nearest to 0 in the range."""
        low, high = np.array([control.range for control in self.controls]).T
        return frozen(np.clip(self.held_controls, low, high))

    @cached_property
    def trim_scales(self) -> Array:
        """Change that counts as a radian of each control that a trim finds: 1 rad, of others some ranges."""
        controls = [self.controls[i] for i in self.trimmed_controls]
        return frozen([1.0 if c.is_angle else max(map(abs, c.range)) / TYPICAL_ANGLE or 1.0 for c in controls])

    @cached_property
    def trim_rigging(self) -> Array:
        """`rigging` over the unknown controls of a trim; what the others are held at is in the last column."""
        constant = self.rigging[:, -1] + self.mixing @ self.held_controls
        return frozen(np.column_stack([self.mixing[:, self.trimmed_controls] * self.trim_scales, constant]))

    def trim_unknowns(self, controls: Array) -> Array:
        """Those of the pilot controls, shape (n_controls,), that a trim finds, over `trim_scales`."""
        return np.asarray(controls[self.trimmed_controls] / self.trim_scales)

    def with_held(self, unknowns: Array) -> Array:
        """All pilot controls, shape (n_controls,), of `trim_unknowns`."""
        controls = self.held_controls.copy()
        controls[self.trimmed_controls] = unknowns * self.trim_scales
        return controls

    def unmix(self, angles: Array) -> Array:
        """Pilot controls, shape (n_controls,), whose mixture is nearest to swashplate angles [rad], (n_rows, 3)."""
        change = np.ravel(angles) - self.trim_rigging[:, -1]
        found = np.linalg.lstsq(self.trim_rigging[:, :-1], change, rcond=None)[0]
        return self.with_held(np.asarray(found, dtype=np.float64))

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
            if rotor.has_offsets:
                more_first, more_inertia = _offset_inertia(rotor)
                first -= more_first
                inertia -= more_inertia
        return mass, first, inertia

    def drive_speed(self, drive: int) -> float:
        """Speed in the file of the first rotor of a drive [rad/s], which is the scale of its speed and of its gears."""
        return first_rotor(self, self.drives[drive]).speed

    def rotor_speeds(self, state: Array) -> Array:
        """Speeds of the rotors [rad/s], shape (..., n_rotors), at simulation states, shape (..., size)."""
        speeds = np.array([rotor.speed for rotor in self.rotors])
        return speeds + self._turned(state, SPEED, [-self.drive_speed(i) for i in range(len(self.drives))])

    def turned(self, azimuths: Array, state: Array) -> Array:
        """Azimuths of the rotors [rad] with those of their drives; arguments of shape (..., n_rotors), (..., size)."""
        if not self.drives:
            return azimuths
        return np.asarray((azimuths + self._turned(state, "azimuth", [0.0] * len(self.drives))) % (2.0 * np.pi))

    def _turned(self, state: Array, name: str, offsets: list[float]) -> Array:
        """State of the drives by its name, plus an offset of each, at the rotors; 0 for those without a drive."""
        found = np.zeros((*np.shape(state)[:-1], len(self.rotors)))
        for j, rotor in enumerate(self.rotors):
            if (i := drive_of(self, rotor)) >= 0:
                found[..., j] = gear(self, rotor) * (state[..., self.layout.drive(i)[name]] + offsets[i])
        return found

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
        """`model` with its blades in the lanes (lanes = "blades"), or copies of it ("points"); read only.

        Points are those of trims and linear models, whose sections have the separation of the flow at the instant.
        """
        key = lead_lag, cyclic_inflow, lanes
        if key not in self._arrangements:
            model, count = self.model(lead_lag, cyclic_inflow), lane_count()
            if lanes == "points":
                model = with_steady_sections(model)
            made = by_blades(model, count) if lanes == "blades" else side_by_side([model] * count)
            self._arrangements[key] = made
        return self._arrangements[key]

    @cached_property
    def _arrangements(self) -> dict[tuple[bool, bool, str], Model]:
        return {}

    @cached_property
    def kept(self) -> dict[Any, Any]:
        """Cache of derived results: rotors by momentum theory, hovers that trims start from, matrices of `etd`."""
        return {}

    @cached_property
    def _model(self) -> Model:
        return model_of(self)

    @cached_property
    def stall_table(self) -> Array:
        """What is known of the stall of every airfoil of every rotor, shape (n_rotors, airfoils, 10, n).

        Reynolds or Mach numbers, the highest and lowest angle of attack [rad] at which the section is not stalled, the
        least and largest number for which the table holds, slope of the lift of attached flow [1/rad], angle without
        lift [rad], lift coefficients at the lowest and the highest angle, and 1 over the distance from the number
        before, 0 for the first; filled up with copies of the last.
        """
        size = max(len(table.numbers) for tables in self.sections for table in tables)
        most = max(map(len, self.sections))
        rows = [[table.stall for table in _filled_up(tables, most)] for tables in self.sections]
        return np.array([[np.pad(one, ((0, 0), (0, size - one.shape[1])), "edge") for one in own] for own in rows])


def _filled_up(tables: tuple[AirfoilTable, ...], count: int) -> tuple[AirfoilTable, ...]:
    return (*tables, *[tables[-1]] * (count - len(tables)))


def axis_controls(axes: Sequence[str], units: Sequence[str]) -> NDArray[np.int64]:
    """Indices of the controls that heave, roll, pitch and yaw, of the axes and units of all.

    Raises
    ------
    AircraftError
        No control has one of these axes, or it is no angle.
    """
    for axis in CONTROL_AXES:
        if axis not in axes:
            needed = ", ".join(CONTROL_AXES)
            raise AircraftError(f"controls: no control has axis = {axis}: sticks and controllers need {needed}")
        if units[axes.index(axis)] != "rad":
            raise AircraftError(f"controls: axis = {axis}: sticks and controllers need an angle, with range_deg")
    return np.array([axes.index(axis) for axis in CONTROL_AXES], dtype=np.int64)


@cached_by_class
def _validator(record: type) -> Any:
    """JSON schema validator of files with the declared values of a dataclass."""
    return validation.validator_of(schema_of(record))


def _python(value: Any) -> Any:
    """A value as YAML gives it."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def _check_pair(pairs: dict[Location, tuple[str, Any]], location: Location, path: str, value: Any) -> None:
    """Raise AircraftError if the symmetric element was given another value; keep this one."""
    across = mirrored(location)
    if across == location:
        return
    other, given = pairs.get(across, (path, value))
    if given != value and other != path:
        both = f"{other} = {checks.shown(given)}, {path} = {checks.shown(value)}"
        raise AircraftError(f"{both}: allowed is one value, the inertia is symmetric")
    pairs[location] = path, value


def _as_given(error: str, named: Mapping[str, str]) -> str:
    """Faults with the paths that were given in place of those of single rotors, each once."""
    lines = []
    for line in error.split("; "):
        path, equals, rest = line.partition(" = ")
        lines.append(f"{named.get(path, path)}{equals}{rest}")
    return "; ".join(dict.fromkeys(lines))


def _with_changes(values: Mapping[str, Any], error: str) -> str:
    """Fault of a changed aircraft with the changes before it, where it does not name all of them itself."""
    named = {line.partition(" = ")[0] for line in error.split("; ")}
    if named == set(values):
        return error
    changes = ", ".join(f"{path} = {checks.shown(value)}" for path, value in list(values.items())[:MAX_CHANGES_SHOWN])
    more = f" and {len(values) - MAX_CHANGES_SHOWN} more" if len(values) > MAX_CHANGES_SHOWN else ""
    return f"{changes}{more}: {error}"


def _digest(digest: Any, name: str, value: Any) -> None:
    """Add a named number, text or array to a digest; integers count as floats."""
    if isinstance(value, tuple) and value and isinstance(value[0], str):
        value = "/".join(value)
    if isinstance(value, str):
        digest.update(f"{name}={value};".encode())
        return
    values = np.ascontiguousarray(value, dtype=np.float64) + 0.0  # there is one zero
    digest.update(f"{name}{values.shape}".encode() + values.tobytes())


def _passages(rotor: Rotor) -> int:
    """See `Aircraft.passages`."""
    if not rotor.has_equal_blades:
        return 1
    return rotor.blades // 2 if rotor.blades % 2 == 0 else rotor.blades


def _offset_inertia(rotor: Rotor) -> tuple[Array, Array]:
    """What offsets of the blades add to the first moment about the c.g. and to `_blades_inertia`."""
    moments, hub = blade_moments(rotor), rotor.hub
    up = -hub_axes(rotor.shaft_direction)[:, 2]
    along, mass = rotor.hinge_offset, rotor.blade_mass
    normal = moments.normal_first + moments.height * mass  # along the shaft, undeflected and without pitch
    height = moments.normal_second + moments.height * (2.0 * moments.normal_first + moments.height * mass)
    extended = moments.second - rotor.second_moment + 2.0 * along * (moments.first - rotor.first_moment)
    across = (extended + moments.chord_second) / 2.0  # the mean over the azimuth of the moment in the plane
    crossed = np.outer(hub, up) * normal
    second = across * (np.eye(3) - np.outer(up, up)) + height * np.outer(up, up) + crossed + crossed.T
    return rotor.blades * normal * up, rotor.blades * (np.trace(second) * np.eye(3) - second)


def _blades_inertia(rotor: Rotor) -> Array:
    """Inertia about the c.g. of a rotor's undeflected blades, averaged over azimuth [kg m^2], shape (3, 3)."""
    e0 = rotor.hinge_offset
    polar = rotor.blades * (rotor.blade_mass * (e0 * e0) + 2 * e0 * rotor.first_moment + rotor.second_moment)
    axes = hub_axes(rotor.shaft_direction)
    about_hub = polar / 2 * (np.eye(3) + np.outer(axes[:, 2], axes[:, 2]))
    hub, mass = rotor.hub, rotor.blades * rotor.blade_mass
    distance = hub[0] * hub[0] + hub[1] * hub[1] + hub[2] * hub[2]
    return np.asarray(about_hub + mass * (distance * np.eye(3) - np.outer(hub, hub)))
