"""The paper's results computed anew, beside the printed ones (theory.md section 9).

Two aircraft: the complete model, and the paper's reading, whose assumptions make the printed poles of Tables 1 to 3
come out. Nothing is fitted here and nothing is left out: every printed number has its entry, and every entry that is
off by more than a fifth says why, or that the reason is not known.
"""

import math
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linear_model import LinearModel, settle
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.modes import Mode, first_matrix_modes, modes
from sbs_sim.analysis.paper_tables import TABLES, Cell, Row, Table, Value, contents, printed_tables
from sbs_sim.analysis.reproduce_remarks import UNEXPLAINED, general_remarks, remark_on
from sbs_sim.analysis.sweep import Sweep, sweep
from sbs_sim.model.state import CONTROL_NAMES, INFLOW_NAMES, LINEAR_BODY_NAMES, part_of
from sbs_sim.output.json_text import plain

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]
Poles = Sequence[complex]

COMPLETE, READING, READING_NACA = "complete", "paper_reading", "paper_reading_naca0012"
READING_UNIFORM = "paper_reading_uniform_inflow"
AIRFOIL = "naca0012"  # the paper's reading is shown with this one as well: damping goes with the lift slope
FIDELITIES = {  # lead-lag, cyclic inflow
    "table1": (False, False),
    "table2": (True, False),
    "table4": (True, True),
}
PITCH_RATE = 0.01  # rad/s, of Table 3
PRINTED_CONING = math.radians(0.53)  # of Table 3 without lag; the one that the poles of Table 5 belong to
AIRSPEEDS = np.arange(0.0, 31.0)  # m/s
MISMATCH = 0.2  # departure of a ratio from 1 that needs a remark
NEARLY_ZERO = 0.05  # deg or rad/s: what is this small agrees with a printed zero
ROUNDING = 1e-9  # parts of a pole below this share of the fastest one are rounding

# Names that a mode may have; "phugoid" is a pair, (+) and (-) are two real poles.
MODES = {
    "short_period": ("short period",),
    "phugoid": ("phugoid", "phugoid (+)"),
    "phugoid_plus": ("phugoid (+)", "phugoid"),
    "phugoid_minus": ("phugoid (-)", "phugoid"),
    "heave": ("heave subsidence",),
    "roll": ("roll",),
    "dutch_roll": ("Dutch roll", "Dutch roll (+)"),
    "spiral": ("spiral", "spiral (+)"),
    "coupled_collective": ("coupled collective",),
    "coupled_advancing": ("coupled advancing",),
    "coupled_regressing": ("coupled regressing",),
    "collective_flap": ("collective flap",),
    "non_uniform_disc_tilt": ("non-uniform disc tilt",),
    "collective_lag": ("collective lag",),
    "non_uniform_lag": ("non-uniform lag",),
}
WITH_CONING = ("coupled_collective", "coupled_advancing", "coupled_regressing")  # poles that follow the coning
INFLOW_MODES = {"uniform": "uniform inflow", "lateral_longitudinal": "cyclic inflow"}


@dataclass(frozen=True)
class Entry:
    """One printed number and what it is here.

    Attributes
    ----------
    label, unit : str
    printed : Cell
    complete, paper_reading : complex, float or None
        Poles are complex, of a pair the one with the positive imaginary part; None where there is no such mode.
    others : mapping
        Further values of the same thing by name: numbers, poles, or lists of poles.
    remark : str
        Why it differs: what kind of reason, and the section; may be empty where it does not.
    columns : mapping of str to Entry
        "frequency" and "damping" of a pole where the paper prints them.
    """

    label: str
    unit: str
    printed: Cell
    complete: Value | None
    paper_reading: Value | None
    others: Mapping[str, Value | Poles | None] = field(default_factory=dict)
    remark: str = ""
    columns: "Mapping[str, Entry]" = field(default_factory=dict)

    def ratio(self, ours: Value | None) -> float | None:
        """Ours over the printed number.

        Of real poles and numbers with the sign, so that an unstable pole for a stable one shows; of magnitudes where
        one of the two is a pair. None where nothing, or zero, is printed.
        """
        printed = self.printed.value
        if not printed or ours is None:
            return None
        if complex(ours).imag == 0.0 and complex(printed).imag == 0.0:
            return complex(ours).real / complex(printed).real
        return abs(ours) / abs(printed)

    @property
    def ratio_complete(self) -> float | None:
        """Of the complete model."""
        return self.ratio(self.complete)

    @property
    def ratio_paper_reading(self) -> float | None:
        """Of the paper's reading."""
        return self.ratio(self.paper_reading)

    def is_off(self, ours: Value | None) -> bool:
        """True where a value is more than a fifth away from print, or another kind of pole, or missing."""
        printed = self.printed.value
        if printed is None:
            return False
        if ours is None:
            return True
        if printed == 0:
            return abs(ours) > NEARLY_ZERO
        ratio = self.ratio(ours)
        of_another_kind = (complex(ours).imag == 0.0) != (complex(printed).imag == 0.0)
        return of_another_kind or ratio is None or abs(ratio - 1.0) > MISMATCH

    @property
    def is_mismatch(self) -> bool:
        """True where one of the two models is off, here or in a column."""
        own = self.is_off(self.complete) or self.is_off(self.paper_reading)
        return own or any(column.is_mismatch for column in self.columns.values())

    def to_dict(self) -> dict[str, Any]:
        """Plain lists and numbers for JSON; poles are [real, imag]."""
        return {
            "label": self.label,
            "unit": self.unit,
            "paper": _listed(self.printed.value),
            "paper_as_printed": self.printed.text,
            "complete": _listed(self.complete),
            "paper_reading": _listed(self.paper_reading),
            "ratio_complete": self.ratio_complete,
            "ratio_paper_reading": self.ratio_paper_reading,
            "remark": self.remark,
            **{name: _listed(value) for name, value in self.others.items()},
            **{name: column.to_dict() for name, column in self.columns.items()},
        }


@dataclass(frozen=True)
class Comparison:
    """One printed table beside ours: entries by group and key; a table without groups has one, called ""."""

    title: str
    groups: Mapping[str, Mapping[str, Entry]]
    group_labels: Mapping[str, str]

    def entries(self) -> Iterator[Entry]:
        """All entries, in order."""
        for group in self.groups.values():
            yield from group.values()

    def to_dict(self) -> dict[str, Any]:
        """Entries by key; where there are groups, by group and key."""
        groups = {name: {key: entry.to_dict() for key, entry in group.items()} for name, group in self.groups.items()}
        return groups.get("", groups)


@dataclass(frozen=True)
class Report:
    """Everything that was computed anew.

    Attributes
    ----------
    tables : mapping of str to Comparison
        "table1" ... "table5", "inflow_poles", "hover".
    facts : mapping
        What explains the differences, see `_facts`; poles are complex.
    remarks : tuple of str
        What holds for all of it.
    conditions : mapping
        Of all computations, SI units.
    versions : mapping of str to str
    parameter_hashes : mapping of str to str
        By the names of the aircraft in this report.
    models : mapping
        Linear models by aircraft and fidelity ("table1", "table2", "table4").
    rotor_modes : mapping
        Modes of the first matrix of eq. [32] and the names of its states, by aircraft.
    flights : mapping of str to Sweep
        Trims over the forward speed.
    """

    tables: Mapping[str, Comparison]
    facts: Mapping[str, Any]
    remarks: tuple[str, ...]
    conditions: Mapping[str, Any]
    versions: Mapping[str, str]
    parameter_hashes: Mapping[str, str]
    models: Mapping[str, Mapping[str, LinearModel]]
    rotor_modes: Mapping[str, tuple[Sequence[Mode], Sequence[str]]]
    flights: Mapping[str, Sweep]

    def trim_curves(self) -> dict[str, dict[str, Any]]:
        """Trims over the forward speeds by aircraft, see `_trim_curve`."""
        return {name: _trim_curve(flight) for name, flight in self.flights.items()}

    def to_dict(self) -> dict[str, Any]:
        """Everything but the linear models as plain lists and numbers for JSON; poles are [real, imag]."""
        tables = {name: table.to_dict() for name, table in self.tables.items()}
        text = {
            "source": contents()["source"],
            "remarks": self.remarks,
            "conditions": self.conditions,
            "versions": self.versions,
            "parameter_hashes": self.parameter_hashes,
        }
        trims = {"paper": contents()["trim_forward"]["statement"], "airspeed": AIRSPEEDS, **self.trim_curves()}
        return dict(plain({**tables, "facts": _listed_all(self.facts), "trim_forward": trims, **text}))


def reproduce(
    aircraft: Aircraft | None = None, paper_aircraft: Aircraft | None = None, *, progress: Progress | None = None
) -> Report:
    """Compute the paper's results.

    Parameters
    ----------
    aircraft : Aircraft, optional
        The complete model, `undamped_sbs` if not given.
    paper_aircraft : Aircraft, optional
        The paper's reading, `sbs_paper` if not given.
    progress : callable, optional
        Called with the number of pieces of work done and that of all, as each ends.

    Returns
    -------
    Report

    Raises
    ------
    SbsError
        One of the aircraft has no hover, or the airfoil `naca0012` is missing.
    """
    reading = paper_aircraft or Aircraft.load("sbs_paper")
    craft = {
        COMPLETE: aircraft or undamped_sbs(),
        READING: reading,
        READING_NACA: reading.with_value("rotors.airfoil", AIRFOIL),
    }
    step = _Steps(len(craft) * len(FIDELITIES) + 3 * len(AIRSPEEDS), progress)
    models = {name: {table: step(_model(one, table)) for table in FIDELITIES} for name, one in craft.items()}
    flights = {
        COMPLETE: _flight(craft[COMPLETE], True, step),
        READING: _flight(reading, True, step),
        READING_UNIFORM: _flight(reading, False, step),
    }
    computed = _Computed(craft, models)
    tables = {name: _comparison(name, printed_tables()[name], computed) for name in TABLES}
    facts = _facts(computed, tables)
    return Report(
        tables=tables,
        facts=facts,
        remarks=(
            *_other_aircraft(craft),
            *general_remarks(facts, {name: _trim_curve(flight) for name, flight in flights.items()}),
        ),
        conditions=_conditions(craft, models),
        versions=_versions(),
        parameter_hashes={name: one.parameter_hash for name, one in craft.items()},
        models=models,
        rotor_modes={
            name: (found, _blade_states(models[name]["table4"])) for name, found in computed.rotor_modes.items()
        },
        flights=flights,
    )


def undamped_sbs() -> Aircraft:
    """The aircraft `sbs` without lag dampers: the paper names none."""
    return Aircraft.load("sbs").with_value("rotors.lag_damping", 0.0)


def _other_aircraft(craft: Mapping[str, Aircraft]) -> tuple[str, ...]:
    """A warning where an aircraft is not the one that the remarks are written for."""
    usual = {COMPLETE: undamped_sbs(), READING: Aircraft.load("sbs_paper")}
    others = [craft[name].name for name, own in usual.items() if craft[name].parameter_hash != own.parameter_hash]
    if not others:
        return ()
    return (
        f"Not the paper's aircraft: {' and '.join(others)}. The remarks are written for sbs without lag dampers and for"
        " sbs_paper.",
    )


class _Steps:
    """Count of the pieces of work."""

    def __init__(self, total: int, progress: Progress | None) -> None:
        self.done, self.total, self.progress = 0, total, progress

    def __call__(self, result: Any = None, *_: Any) -> Any:
        """Count one piece and hand on its result."""
        self.done += 1
        if self.progress is not None:
            self.progress(self.done, self.total)
        return result


def _model(aircraft: Aircraft, table: str) -> LinearModel:
    """Linear model of hover with the fidelity of a table."""
    lead_lag, cyclic_inflow = FIDELITIES[table]
    return linearize(aircraft, lead_lag=lead_lag, cyclic_inflow=cyclic_inflow)


def _flight(aircraft: Aircraft, cyclic_inflow: bool, step: _Steps) -> Sweep:
    """Trims over the forward speed."""
    return sweep(aircraft, "airspeed", AIRSPEEDS, cyclic_inflow=cyclic_inflow, linear=False, progress=step)


def _trim_curve(flight: Sweep) -> dict[str, Any]:
    """Attitude and controls in degrees, NaN where there is no trim, and what cannot be flown."""
    angles = {f"{name}_deg": np.degrees(flight[name]) for name in ("pitch", "roll", *CONTROL_NAMES)}
    beyond = [point.trim.beyond_limits if point.trim else () for point in flight.points]
    return {**angles, "beyond_limits": beyond, "errors": {f"{p.value:g}": p.error for p in flight.failed}}


# --- what the tables ask for ------------------------------------------------------------------------------------


class _Computed:
    """Values by aircraft: poles by name, disc tilt, first matrix, inflow."""

    def __init__(self, craft: Mapping[str, Aircraft], models: Mapping[str, Mapping[str, LinearModel]]) -> None:
        self.craft, self.models = craft, models
        full = {name: own["table4"] for name, own in models.items()}
        self.quasi_static = {
            name: {table: model.quasi_static() for table, model in own.items()} for name, own in models.items()
        }
        self.derivatives = {
            name: {table: model.derivatives() for table, model in own.items()} for name, own in models.items()
        }
        self.blocks = {name: _blocks(craft[name], model) for name, model in full.items()}
        self.rotor_modes = {name: _rotor_modes(self.blocks[name], model) for name, model in full.items()}
        # the paper's coning in place of the own one, all else as it is
        self.rotor_modes_at_printed = {
            name: _rotor_modes(_blocks(craft[name], model, PRINTED_CONING), model) for name, model in full.items()
        }


def _blocks(aircraft: Aircraft, model: LinearModel, coning: float | None = None) -> Mapping[str, Array]:
    """Blocks of the paper's construction about a trim, or about one with another coning in all rotors."""
    point = model.trim
    if coning is not None:
        coordinates = [i for i, name in enumerate(point.state_names) if name.startswith("a0(")]
        state = point.state.copy()
        state[coordinates] = coning
        point = replace(point, state=state)
    return linearize(aircraft, method="paper", point=point).blocks


def _rotor_modes(blocks: Mapping[str, Array], model: LinearModel) -> tuple[Mode, ...]:
    """Modes of the first matrix of eq. [32]."""
    return first_matrix_modes(blocks["A_R_first"], _blade_states(model))


def _blade_states(model: LinearModel) -> list[str]:
    return [name for name in model.state_names if part_of(name).family in ("flap", "lag")]


def _pole(found: Sequence[Mode], key: str) -> complex | None:
    """Pole of the mode with one of the names of a key, of several rotors that of the first; None if there is none."""
    poles = {mode.name: mode.pole for mode in found}
    size = max(abs(pole) for pole in poles.values())
    for name in MODES[key]:
        for own in (name, f"{name}, rotor 1"):
            if own in poles:
                return _rounded(poles[own], size)
    return None


def _rounded(pole: complex, size: float) -> complex:
    """Pole without the parts that are rounding only."""
    parts = (part if abs(part) > ROUNDING * size else 0.0 for part in (pole.real, pole.imag))
    return complex(*parts)


def _body_values(computed: _Computed, table: str, key: str) -> dict[str, Any]:
    """Complete model: the full matrix; the paper's reading: the quasi-static one; and each the other way."""
    full, reduced = computed.models, computed.quasi_static
    return {
        COMPLETE: _pole(full[COMPLETE][table].modes, key),
        READING: _pole(reduced[READING][table].modes, key),
        "complete_quasi_static": _pole(reduced[COMPLETE][table].modes, key),
        "paper_reading_full_matrix": _pole(full[READING][table].modes, key),
        READING_NACA: _pole(reduced[READING_NACA][table].modes, key),
    }


def _tilt_values(computed: _Computed, group: str, key: str) -> dict[str, Any]:
    """Table 3."""
    table = {"flap_only": "table1", "flap_lag": "table2"}[group]
    if key in ("M_q", "L_p"):
        symbol = {"M_q": "M_q", "L_p": "L'_p"}[key]
        return {name: own[table][symbol] for name, own in computed.derivatives.items()}
    coordinate = key.removesuffix("_deg")
    return {
        name: math.degrees(_settled(own[table], "q", PITCH_RATE)[f"{coordinate}(1)"])
        for name, own in computed.models.items()
    }


def _settled(model: LinearModel, motion: str, size: float) -> dict[str, float]:
    """Rotor and inflow states that a held motion of the body leads to."""
    slow = [model.state_names.index(name) for name in LINEAR_BODY_NAMES]
    _, _, by_state, _ = settle(model.a, model.b, slow)
    change = size * by_state[:, LINEAR_BODY_NAMES.index(motion)]
    trim = dict(zip(model.trim.state_names, model.trim.state, strict=True))
    names = [name for name in model.state_names if name not in LINEAR_BODY_NAMES]
    return {name: float(trim[name] + own) for name, own in zip(names, change, strict=True)}


def _rotor_values(computed: _Computed, key: str) -> dict[str, Any]:
    """Table 5."""
    values: dict[str, Any] = {name: _pole(found, key) for name, found in computed.rotor_modes.items()}
    if key in WITH_CONING:
        for name in (COMPLETE, READING):
            values[f"{name}_at_printed_coning"] = _pole(computed.rotor_modes_at_printed[name], key)
    return values


def _inflow_values(computed: _Computed, key: str) -> dict[str, Any]:
    """Poles of C^lambda alone, of the first rotor, and those that the inflow has in the complete matrix."""
    values: dict[str, Any] = {}
    for name in (COMPLETE, READING):
        alone = modes(computed.blocks[name]["C_lambda"][:3, :3], [f"{own}(1)" for own in INFLOW_NAMES])
        values[name] = next(mode.pole for mode in alone if mode.name.startswith(INFLOW_MODES[key]))
        coupled = computed.models[name]["table4"].modes
        values[f"{name}_coupled"] = [mode.pole for mode in coupled if mode.name.startswith(INFLOW_MODES[key])]
    return values


def _hover_values(computed: _Computed, key: str) -> dict[str, Any]:
    """Controls and coning in hover with lead-lag and cyclic inflow [deg]."""
    return {name: _hover_value(own["table4"], key) for name, own in computed.models.items()}


def _hover_value(model: LinearModel, key: str) -> float:
    if key == "coning_deg":
        return math.degrees(model.trim.state[model.trim.state_names.index("a0(1)")])
    control = key.removesuffix("_deg").replace("differential", "differential_longitudinal")
    return math.degrees(model.trim.controls[CONTROL_NAMES.index(control)])


# --- entries ----------------------------------------------------------------------------------------------------


def _comparison(name: str, table: Table, computed: _Computed) -> Comparison:
    """One table beside ours."""
    groups = {}
    for group, rows in table.groups.items():
        find: Callable[[str], dict[str, Any]] = {
            "table3": partial(_tilt_values, computed, group),
            "table5": partial(_rotor_values, computed),
            "inflow_poles": partial(_inflow_values, computed),
            "hover": partial(_hover_values, computed),
        }.get(name) or partial(_body_values, computed, name)
        groups[group] = {key: _entry(row, find(key), remark_on(name, group, key)) for key, row in rows.items()}
    return Comparison(table.title, groups, table.group_labels)


def _entry(row: Row, values: dict[str, Any], remark: str) -> Entry:
    """Entry of a printed row, with an entry for each of its other printed columns."""
    complete, reading = values.pop(COMPLETE), values.pop(READING)
    columns = {}
    for name, cell in row.columns.items():
        measure = {"frequency": _frequency, "damping": _growth}[name]
        others = {key: measure(value) for key, value in values.items() if not isinstance(value, list)}
        unit = "rad/s" if name == "frequency" else "1"
        columns[name] = Entry(name, unit, cell, measure(complete), measure(reading), others)
    entry = Entry(row.label, row.unit, row.cell, complete, reading, values, remark, columns)
    if entry.is_mismatch and not remark:
        entry = replace(entry, remark=UNEXPLAINED)
    columns = {name: replace(column, remark=entry.remark) for name, column in columns.items()}
    return replace(entry, columns=columns)


def _frequency(pole: complex | None) -> float | None:
    return None if pole is None else abs(pole)


def _growth(pole: complex | None) -> float | None:
    """The paper's damping: real part over magnitude, positive for an oscillation that grows."""
    return None if pole is None or not pole else pole.real / abs(pole)


def _listed(value: Any) -> Any:
    """Poles as [real, imag]."""
    if isinstance(value, complex | np.complexfloating):
        return [float(value.real), float(value.imag)]
    return [_listed(item) for item in value] if isinstance(value, list | tuple) else value


def _listed_all(value: Any) -> Any:
    return {key: _listed_all(item) for key, item in value.items()} if isinstance(value, Mapping) else _listed(value)


# --- facts ------------------------------------------------------------------------------------------------------


def _facts(computed: _Computed, tables: Mapping[str, Comparison]) -> dict[str, Any]:
    """What explains the differences.

    "hub_damping" [N m s/rad] by table: what all hubs give in roll and pitch, rotors settled, and what the printed poles
    imply, see `_implied_damping`. "equation_32": poles of its first matrix with the last row in the printed order, and
    in that of eq. [14]. "rotor_poles": those of the complete matrix by mode. "lambdac_reversed": quasi-static poles of
    Table 4 with the sign of lambdac reversed in all loads. "lag_changes_M_q": relative, from Table 1 to Table 2.
    """
    papers = undamped_sbs()  # whatever was computed, the printed poles are of this one
    printed = {table: _implied_damping(tables[table], papers) for table in FIDELITIES}
    hubs = {
        table: {
            **{name: _hub_damping(computed.quasi_static[name][table]) for name in (COMPLETE, READING)},
            "printed_poles": printed[table],
        }
        for table in FIDELITIES
    }
    damping = {name: computed.derivatives[name] for name in (COMPLETE, READING)}
    return {
        "hub_damping": hubs,
        "equation_32": _column_order(computed.blocks[READING], computed.models[READING]["table4"]),
        "rotor_poles": {
            name: {mode.name: mode.pole for mode in computed.models[name]["table4"].modes if _is_of_blades(mode.name)}
            for name in (COMPLETE, READING)
        },
        "lambdac_reversed": {
            name: {mode.name: mode.pole for mode in _reversed(computed, name).quasi_static().modes}
            for name in (COMPLETE, READING)
        },
        "lag_changes_M_q": {name: own["table2"]["M_q"] / own["table1"]["M_q"] - 1.0 for name, own in damping.items()},
    }


def _is_of_blades(name: str) -> bool:
    return any(word in name for word in ("flap", "lag", "coning"))


def _hub_damping(model: LinearModel) -> dict[str, float]:
    """Derivatives of the summed hub moments by the rates about the same axis [N m s/rad]."""
    rows = {axis: [i for i, name in enumerate(model.output_names) if f"hub_moment_{axis}" in name] for axis in "xy"}
    roll = -float(model.c[rows["x"], model.state_names.index("p")].sum())
    pitch = -float(model.c[rows["y"], model.state_names.index("q")].sum())
    return {"roll": roll, "pitch": pitch, "pitch_over_roll": pitch / roll}


def _implied_damping(table: Comparison, aircraft: Aircraft) -> dict[str, float]:
    """Hub damping that printed poles imply [N m s/rad]: inertia times the fast pole.

    In roll, less what the distance of the rotors gives: heave damping of the mass m at the hubs' distances y from the
    plane of symmetry, m |Z_w| <y^2>, with the printed heave pole for Z_w.
    """
    rows = table.groups[""]
    inertia = aircraft.body.inertia
    printed = {key: complex(rows[key].printed.value or 0.0).real for key in ("short_period", "roll", "heave")}
    distance = float(np.mean([rotor.hub[1] ** 2 for rotor in aircraft.rotors]))
    roll = -float(inertia[0, 0]) * printed["roll"] + aircraft.body.mass * distance * printed["heave"]
    pitch = -float(inertia[1, 1]) * printed["short_period"]
    return {"roll": roll, "pitch": pitch, "pitch_over_roll": pitch / roll}


def _column_order(blocks: Mapping[str, Array], model: LinearModel) -> dict[str, list[complex]]:
    """Poles of one rotor's first matrix of eq. [32] with its last row as printed, and as eq. [14] has it."""
    names = _blade_states(model)
    one = [i for i, name in enumerate(names) if part_of(name).rotor == 0]
    parts = [part_of(names[i]) for i in one]
    flap = [i for i, part in enumerate(parts) if part.family == "flap"]
    lag = [i for i, part in enumerate(parts) if part.family == "lag"]
    last = [i for i in lag if parts[i].is_rate]
    matrix = blocks["A_R_first"][np.ix_(one, one)]
    printed = matrix.copy()
    printed[np.ix_(last, flap)] = matrix[np.ix_(last, lag)]
    printed[np.ix_(last, lag)] = matrix[np.ix_(last, flap)]
    return {"as_printed": _upper_poles(printed), "as_equation_14": _upper_poles(matrix)}


def _upper_poles(matrix: Array) -> list[complex]:
    """Poles with the upper one of each pair, slowest first."""
    poles = np.linalg.eigvals(matrix)
    size = float(np.abs(poles).max())
    # a multiple pole at the origin is only found to a root of the rounding
    cleaned = [_rounded(pole, 1e3 * size) for pole in poles]
    return sorted((pole for pole in cleaned if pole.imag >= 0.0), key=lambda pole: (round(abs(pole), 6), pole.real))


def _reversed(computed: _Computed, name: str) -> LinearModel:
    """Model of Table 4 in which lambdac acts on all loads with the other sign; its own gain C^lambda stays."""
    model = computed.models[name]["table4"]
    inflow = [i for i, own in enumerate(model.state_names) if part_of(own).family == "inflow"]
    gain = np.zeros_like(model.a)
    gain[np.ix_(inflow, inflow)] = computed.blocks[name]["C_lambda"]
    sign = np.array([-1.0 if own.startswith("lambdac") else 1.0 for own in model.state_names])
    return replace(model, a=(model.a - gain) * sign + gain)


# --- circumstances ----------------------------------------------------------------------------------------------


def _conditions(craft: Mapping[str, Aircraft], models: Mapping[str, Mapping[str, LinearModel]]) -> dict[str, Any]:
    """What all numbers were computed with, SI units."""
    point = models[COMPLETE]["table4"].trim
    return {
        "flight": "hover",
        "azimuth_count": point.azimuth_count,
        "pitch_rate": PITCH_RATE,
        "printed_coning": PRINTED_CONING,
        "fidelity": {
            table: {"lead_lag": lead_lag, "cyclic_inflow": cyclic} for table, (lead_lag, cyclic) in FIDELITIES.items()
        },
        "aircraft": {
            name: {
                "name": one.name,
                "airfoil": sorted({name for rotor in one.rotors for name in rotor.airfoil_names}),
                "air_density": one.environment.air_density,
                "gravity": one.environment.gravity,
                "trim_residual": max(model.trim.residual for model in models[name].values()),
            }
            for name, one in craft.items()
        },
    }


def _versions() -> dict[str, str]:
    packages = {name: _version(name) for name in ("sbs_sim", "numpy", "scipy", "numba", "matplotlib")}
    return {"python": platform.python_version(), **packages}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
