"""Numbers of the compiled model for lifting surfaces and a fuselage with tables (theory.md sections 5.8 and 5.9)."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.description import AngleTable, Body, Fuselage, Rotor, Surface, Wash
from sbs_sim.model import records as R
from sbs_sim.model.airfoil import extend_polar, periodic_cubics
from sbs_sim.model.elementary import cosine_and_sine
from sbs_sim.model.surfaces import AFT, AIRSPEED, DEGREE, DOWN, INCIDENCE, RAMP_COLUMNS, SKEW

Array = NDArray[np.float64]

STEP_DEG = 1.0  # of the angle of attack in the tables of surfaces
TURNS = 3  # -540 to 540 deg: an angle of the flow, from -180 to 180, and an incidence
MIN_STEP_DEG = 0.5  # of the angles of a fuselage's tables
COEFFICIENTS = (("drag", "side"), ("lift", "roll"), ("pitch", "yaw"))  # two in a row of the tables


class Parts(NamedTuple):
    """Fields of `sbs_sim.model.records.Model`."""

    surfaces: NDArray[Any]
    fuselages: NDArray[Any]
    ramps: Array
    shapes: Array


def parts_of(body: Body, rotors: Sequence[Rotor]) -> Parts:
    """Records and tables of an aircraft's surfaces and fuselage, those of the fuselage last."""
    surfaces, names = body.surfaces, [rotor.name for rotor in rotors]
    fuselages = [body.fuselage] if body.fuselage is not None else []
    parts = Parts(
        surfaces=R.records(R.SURFACE, len(surfaces), 1),
        fuselages=R.records(R.FUSELAGE, len(fuselages), 1),
        ramps=_ramps([*surfaces, *fuselages]),
        shapes=_joined([*map(_surface_shape, surfaces), *map(_fuselage_shape, fuselages)]),
    )
    row = 0
    for record, surface in zip(parts.surfaces, surfaces, strict=True):
        row = _fill(record, _surface_values(surface), surface.wash, names, row, TURNS * _cells_of_circle())
        record["is_scheduled"] = len(surface.schedule.airspeed) > 0
    for record, fuselage in zip(parts.fuselages, fuselages, strict=True):
        _fill(record, _fuselage_values(fuselage), fuselage.wash, names, row, 0)
    return parts


def _cells_of_circle() -> int:
    return round(360.0 / STEP_DEG)


def _fill(record: Any, values: dict[str, Any], wash: Wash, names: Sequence[str], row: int, rows: int) -> int:
    """Set a record; the row of the table behind its own is returned."""
    values = {**values, "wash_down": wash.down[0], "wash_aft": wash.aft[0], "first_row": row}
    for name, value in values.items():
        record[name][..., 0] = value
    record["rotor"] = names.index(wash.rotor) if wash.rotor else -1
    return row + rows


def _surface_values(surface: Surface) -> dict[str, Any]:
    cosine, sine = cosine_and_sine(surface.dihedral)
    scheduled = surface.schedule.incidence
    return {
        "position": surface.position,
        "down": (0.0, sine, cosine),
        "half_area": surface.area * surface.dynamic_pressure / 2,
        "incidence": surface.incidence + (scheduled[0] if len(scheduled) else 0.0),
        "first_alpha": -TURNS * math.pi,
        "inverse_alpha_step": _cells_of_circle() / (2.0 * math.pi),
        "alpha_cells": TURNS * _cells_of_circle(),
    }


def _fuselage_values(fuselage: Fuselage) -> dict[str, Any]:
    alpha, beta = _grid(fuselage.alpha_deg, 180.0), _grid(fuselage.beta_deg, 90.0)
    return {
        "position": fuselage.reference,
        "first_alpha": -math.pi,
        "inverse_alpha_step": (len(alpha) - 1) / (2.0 * math.pi),
        "alpha_cells": len(alpha) - 1,
        "first_beta": -math.pi / 2.0,
        "inverse_beta_step": (len(beta) - 1) / math.pi,
        "beta_cells": len(beta) - 1,
    }


# -- curves of straight lines ----------------------------------------------------------------------------


def _ramps(parts: Sequence[Surface | Fuselage]) -> Array:
    """Changes of slope of the curves of every part, shape (parts, points, 5, 1)."""
    curves = [_curves(part) for part in parts]
    points = max((len(curve[0]) for own in curves for curve in own), default=0)
    ramps = R.aligned((len(parts), points, RAMP_COLUMNS, 1), float)
    for i, own in enumerate(curves):
        for knots, values, at, to in own:
            ramps[i, : len(knots), at, 0] = knots
            ramps[i, : len(knots), to, 0] = slope_changes(knots, values)
    return ramps


def _curves(part: Surface | Fuselage) -> list[tuple[Array, Array, int, int]]:
    wash = part.wash
    aft = wash.aft if len(wash.aft) == len(wash.skew) else np.full(len(wash.skew), wash.aft[0])
    found = [(wash.skew, wash.down, SKEW, DOWN), (wash.skew, aft, SKEW, AFT)] if wash.rotor else []
    if isinstance(part, Surface):
        found.append((part.schedule.airspeed, part.schedule.incidence, AIRSPEED, INCIDENCE))
    return found


def slope_changes(knots: Array, values: Array) -> Array:
    """Change of the slope at every point of a curve that is level before the first and behind the last."""
    slopes = np.diff(values) / np.diff(knots)
    return np.diff(np.concatenate([[0.0], slopes, [0.0]])) if len(knots) else np.zeros(0)


# -- shapes: coefficients over angles ----------------------------------------------------------------------


def _joined(shapes: Sequence[Array]) -> Array:
    joined = R.aligned((sum(map(len, shapes)), 4 * (DEGREE + 1)), float)
    if shapes:
        joined[:] = np.concatenate(shapes)
    return joined


def _surface_shape(surface: Surface) -> Array:
    _, lift, drag = surface_polar(surface)
    cubics = periodic_cubics(np.stack([lift, drag, np.zeros_like(lift), np.zeros_like(lift)]))
    rows = cubics.transpose(2, 0, 1)  # cell, power, column
    return np.tile(rows, (TURNS, 1, 1)).reshape(-1, 4 * (DEGREE + 1))


def surface_polar(surface: Surface) -> tuple[Array, Array, Array]:
    """Lift and drag coefficient of a surface over the angle of attack (theory.md section 5.8).

    Returns
    -------
    alpha, lift, drag : ndarray, shape (361,)
        From -pi to pi [rad].
    """
    if len(surface.polar.angle_deg):
        return _given_polar(surface)
    step, slope = math.radians(STEP_DEG), surface.slope
    first = math.floor((surface.zero_lift_angle - surface.max_lift / slope) / step)
    last = math.ceil((surface.zero_lift_angle + surface.max_lift / slope) / step)
    alpha = np.arange(first, last + 1, dtype=np.float64) * step
    lift = np.clip(slope * (alpha - surface.zero_lift_angle), -surface.max_lift, surface.max_lift)
    induced = 1.0 / (math.pi * surface.aspect_ratio * surface.span_efficiency)
    drag = surface.zero_lift_drag + induced * (lift * lift)
    return extend_polar(alpha, lift, drag, surface.aspect_ratio)


def _given_polar(surface: Surface) -> tuple[Array, Array, Array]:
    polar = surface.polar
    half = _cells_of_circle() // 2
    degrees = np.arange(-half, half + 1, dtype=np.float64) * STEP_DEG
    folded, is_folded = _folded(degrees, polar.angle_deg)
    lift, drag = _between(folded, polar.angle_deg, polar.lift), _between(folded, polar.angle_deg, polar.drag)
    return np.arange(-half, half + 1, dtype=np.float64) * (math.pi / half), np.where(is_folded, -lift, lift), drag


def _folded(degrees: Array, given: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Angles within those given, -90 to 90 deg: of flow from behind those of the reversed body."""
    is_folded = np.abs(degrees) > given[-1]
    return np.where(is_folded, np.copysign(180.0, degrees) - degrees, degrees), is_folded


def _between(at: Array, points: Array, values: Array) -> Array:
    """Values on the straight lines between points; the first axis of `values` is that of the points."""
    k = np.clip(np.searchsorted(points, at, side="right") - 1, 0, len(points) - 2)
    share = ((at - points[k]) / (points[k + 1] - points[k])).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray(values[k] + share * (values[k + 1] - values[k]))


def grid_step(angles_deg: Array) -> float:
    """Largest step that the angles of a table are multiples of [deg]; 0 where it is less than 0.01."""
    hundredths = np.rint(angles_deg * 100.0)
    if np.abs(hundredths - angles_deg * 100.0).max() > 1e-6:
        return 0.0
    return math.gcd(9000, *(int(value) for value in hundredths)) / 100.0


def _grid(angles_deg: Array, end: float) -> Array:
    count = round(2.0 * end / grid_step(angles_deg))
    return np.arange(count + 1, dtype=np.float64) * (2.0 * end / count) - end


def _fuselage_shape(fuselage: Fuselage) -> Array:
    """Rows of all cells, the angle of attack running fastest, three to a cell; see `fuselage_load`."""
    rows = []
    for pair in COEFFICIENTS:
        columns = []
        for name in pair:
            values = fuselage_table(fuselage, name)  # alpha, beta
            cubics = periodic_cubics(values.T).transpose(1, 2, 0)  # beta, alpha, power
            columns += [cubics[:-1], np.diff(cubics, axis=0)]
        rows.append(np.stack(columns, axis=-1))
    return np.stack(rows, axis=2).reshape(-1, 4 * (DEGREE + 1))


def fuselage_table(fuselage: Fuselage, name: str) -> Array:
    """One coefficient on the model's grid: angle of attack from -180 to 180 deg, sideslip from -90 to 90 deg.

    Parameters
    ----------
    fuselage : Fuselage
    name : str
        "drag", "side", "lift" [m^2], "roll", "pitch" or "yaw" [m^3].
    """
    table: AngleTable = getattr(fuselage, name)
    alpha, beta = _grid(fuselage.alpha_deg, 180.0), _grid(fuselage.beta_deg, 90.0)
    folded, is_folded = _folded(alpha, fuselage.alpha_deg)
    over_alpha, over_beta, grid = table.alpha, table.beta, table.grid
    found = np.zeros((len(alpha), len(beta)))
    if len(grid):
        found = found + _between(beta, fuselage.beta_deg, _between(folded, fuselage.alpha_deg, grid).T).T
    if len(over_alpha):
        found = found + _between(folded, fuselage.alpha_deg, over_alpha)[:, None]
    if len(over_beta):
        found = found + _between(beta, fuselage.beta_deg, over_beta)
    return np.where(is_folded[:, None], -found, found) if name == "lift" else found
