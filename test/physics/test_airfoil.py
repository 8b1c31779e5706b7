import importlib.util
import itertools
import math
from pathlib import Path

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_model import airfoil_coefficients

from sbs_sim.errors import AirfoilError, SbsError
from sbs_sim.lanes import as_lanes, as_records, table_row
from sbs_sim.model.airfoil import (
    HEADERS,
    AirfoilTable,
    cell_grid,
    cells,
    common_grid,
    common_half,
    extend_polar,
    interpolate,
    read_table,
    stall_angles,
    viterna,
    write_table,
)
from sbs_sim.model.frames import ONE
from sbs_sim.model.records import BLADE, records
from sbs_sim.model.section import DEGREE, table_cell

ROOT = Path(__file__).resolve().parents[2]
AIRFOILS = ROOT / "config" / "airfoils"
NAMES = ["naca0012", "linear_573"]
TABLES = {name: read_table(AIRFOILS / f"{name}.csv", aspect_ratio=10.0) for name in NAMES}
DEG = math.pi / 180


@numba.njit
def _look_up(like, blades, knots, table, given, out):
    blade = as_records(blades)[0]
    values, found = as_lanes(given, as_records(like)), as_lanes(out, as_records(like))
    cell = table_cell(blade, 3.0, as_lanes(knots, blade), values[0], values[1])
    lift, lift_slope, drag, drag_slope = table_row(table, cell.row, cell.fraction, DEGREE)
    found[0], found[1] = lift + lift_slope * cell.number, drag + drag_slope * cell.number
    found[2], found[3] = cell.row, cell.fraction


class Reader:
    """A table's cells between rows of NaN, so that a read outside shows, as blades read them."""

    def __init__(self, table: AirfoilTable, interpolation: str = "smooth"):
        rows = cells(table, interpolation)
        guard = np.full((3, rows.shape[1]), np.nan)
        self.rows = np.concatenate([guard, rows, guard])
        # the knots of a shorter table are padded in the aircraft's array
        self.knots = np.append(table.numbers[1:-1], [np.inf, np.inf])[:, np.newaxis]
        self.blade = records(BLADE, 1, 1)
        columns, first_angle, inverse_step = cell_grid(table)
        values = {
            "first_alpha": first_angle,
            "inverse_alpha_step": inverse_step,
            "alpha_cells": columns,
        }
        values |= {"min_number": table.numbers[0], "max_number": table.numbers[-1]}
        for name, value in values.items():
            self.blade[name] = value
        self.place(table.numbers[0], 0.0)  # compile

    def place(self, reynolds: float, alpha: float) -> tuple[float, float, float, float]:
        """Lift and drag coefficient, row of the table, fraction of the cell."""
        out = np.empty((4, 1))
        _look_up(ONE, self.blade, self.knots, self.rows, np.array([[reynolds], [alpha]]), out)
        return tuple(out[:, 0])

    def __call__(self, reynolds: float, alpha: float) -> tuple[float, float]:
        return self.place(reynolds, alpha)[:2]


READERS = {name: Reader(table) for name, table in TABLES.items()}
LINEAR = {name: Reader(table, "linear") for name, table in TABLES.items()}


# --- Viterna --------------------------------------------------------------------------------------

STALL = {"alpha_stall": 14 * DEG, "cl_stall": 1.1, "cd_stall": 0.05, "aspect_ratio": 10.0}


def test_viterna_passes_through_the_stall_point():
    cl, cd = viterna(14 * DEG, **STALL)
    assert cl == pytest.approx(1.1, abs=1e-12)
    assert cd == pytest.approx(0.05, abs=1e-12)


def test_viterna_follows_the_published_formula_at_45_deg():
    # cl = A1 sin 2a + A2 cos^2 a / sin a, cd = B1 sin^2 a + B2 cos a, worked out by hand for the point above.
    b1 = 1.11 + 0.018 * 10
    s, c = math.sin(14 * DEG), math.cos(14 * DEG)
    a2 = (1.1 - b1 * s * c) * s / c**2
    b2 = (0.05 - b1 * s**2) / c
    cl, cd = viterna(45 * DEG, **STALL)
    assert cl == pytest.approx(b1 / 2 + a2 * math.sqrt(0.5), abs=1e-12)
    assert cd == pytest.approx(b1 / 2 + b2 * math.sqrt(0.5), abs=1e-12)


def test_viterna_broadside_has_no_lift_and_the_drag_of_the_aspect_ratio():
    cl, cd = viterna(math.pi / 2, **STALL)
    assert cl == pytest.approx(0.0, abs=1e-12)
    assert cd == pytest.approx(1.29, abs=1e-12)


@pytest.mark.parametrize(
    ("aspect_ratio", "drag"),
    [(1.0, 1.128), (10.0, 1.29), (49.0, 1.992), (50.0, 2.01), (50.001, 2.01), (51.0, 2.01), (100.0, 2.01), (1e6, 2.01)],
)
@pytest.mark.parametrize("alpha", [math.pi / 2, -math.pi / 2])
def test_viterna_limits_the_drag_broadside_to_that_of_an_infinite_plate(aspect_ratio, drag, alpha):
    """1.11 + 0.018 AR up to an aspect ratio of 50, where it reaches 2.01, the drag of a long flat plate."""
    _, cd = viterna(alpha, **{**STALL, "aspect_ratio": aspect_ratio})
    assert cd == pytest.approx(drag, abs=1e-12)


def test_beyond_an_aspect_ratio_of_50_the_whole_continuation_stays():
    alpha = np.linspace(-math.pi, math.pi, 721)
    edge, beyond = (viterna(alpha, **{**STALL, "aspect_ratio": ratio}) for ratio in (50.0, 200.0))
    np.testing.assert_array_equal(beyond, edge)


@pytest.mark.parametrize("angle_deg", [30.0, 60.0, 89.0])
def test_viterna_is_reflected_past_90_deg(angle_deg):
    cl, cd = viterna(angle_deg * DEG, **STALL)
    reversed_cl, reversed_cd = viterna((180 - angle_deg) * DEG, **STALL)
    assert reversed_cl == pytest.approx(-0.7 * cl, abs=1e-12)
    assert reversed_cd == pytest.approx(cd, abs=1e-12)


def test_viterna_lift_of_the_reversed_airfoil_is_linear_through_180_deg():
    angles = np.array([180.0, 177.0, 173.0, 166.0]) * DEG
    cl, cd = viterna(angles, **STALL)
    np.testing.assert_allclose(cl, -0.7 * 1.1 * np.array([0, 3, 7, 14]) / 14, atol=1e-12)
    np.testing.assert_allclose(cd, 0.05, atol=1e-12)


@given(
    stall_deg=st.floats(2, 60),
    cl=st.floats(-0.5, 2),
    cd=st.floats(1e-3, 1),
    aspect_ratio=st.floats(1, 1000),
)
@settings(max_examples=40)  # each rounds thousands of sines right
def test_viterna_is_continuous_symmetric_and_its_drag_positive(stall_deg, cl, cd, aspect_ratio):
    alpha = np.concatenate([np.linspace(stall_deg, 180, 1001) * DEG, [math.pi / 2, math.pi]])
    alpha.sort()
    lift, drag = viterna(alpha, stall_deg * DEG, cl, cd, aspect_ratio)
    mirrored_lift, mirrored_drag = viterna(-alpha, stall_deg * DEG, cl, cd, aspect_ratio)
    np.testing.assert_array_equal(mirrored_lift, -lift)
    np.testing.assert_array_equal(mirrored_drag, drag)
    assert drag.min() > 0
    # No jump: the change per step of 0.18 deg stays within the steepest slope, some A2 / sin^2 at stall.
    steepest = 8 + 2 * (2 + 2.1) / math.sin(stall_deg * DEG) / math.cos(stall_deg * DEG) ** 2
    limit = steepest * (180 - stall_deg) / 1000 * DEG
    assert np.abs(np.diff(lift)).max() < limit
    assert np.abs(np.diff(drag)).max() < limit


# --- The tables of the package --------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_table_covers_the_circle_in_half_degrees(name):
    table = TABLES[name]
    assert table.name == name
    np.testing.assert_allclose(table.alpha, np.arange(-360, 361) * 0.5 * DEG, atol=1e-14)
    assert table.cl.shape == table.cd.shape == (len(table.numbers), 721)


def test_tables_cover_the_stated_reynolds_numbers():
    assert (TABLES["naca0012"].numbers[0], TABLES["naca0012"].numbers[-1]) == (5e4, 1e6)
    assert (TABLES["linear_573"].numbers[0], TABLES["linear_573"].numbers[-1]) == (2.5e4, 6e5)


@pytest.mark.parametrize("name", NAMES)
def test_table_is_exactly_symmetric(name):
    table = TABLES[name]
    np.testing.assert_array_equal(table.cl, -table.cl[:, ::-1])
    np.testing.assert_array_equal(table.cd, table.cd[:, ::-1])


@pytest.mark.parametrize("name", NAMES)
def test_file_holds_no_negative_zero(name):
    assert "-0.000000" not in (AIRFOILS / f"{name}.csv").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_table_has_no_jump(name):
    table = TABLES[name]
    # The steepest flank is the stall's: less than 0.1 in lift and 0.02 in drag for half a degree.
    assert np.abs(np.diff(table.cl)).max() < 0.1
    assert np.abs(np.diff(table.cd)).max() < 0.025
    assert table.cd.min() > 0.005


def join_index(table: AirfoilTable, row: int) -> int:
    """Index of the join with Viterna: past maximum lift, by what the header of the table says."""
    zero = len(table.alpha) // 2
    peak = zero + int(np.argmax(table.cl[row, zero : zero + 41]))
    return peak + (2 if table.name == "naca0012" else 0)


@pytest.mark.parametrize("name", NAMES)
def test_stalled_flow_is_viternas(name):
    table = TABLES[name]
    for row in range(len(table.numbers)):
        join = join_index(table, row)
        point = table.alpha[join], table.cl[row, join], table.cd[row, join]
        cl, cd = viterna(table.alpha[join:], *point, 10.0)
        np.testing.assert_allclose(table.cl[row, join:], cl, atol=3e-6)
        np.testing.assert_allclose(table.cd[row, join:], cd, atol=3e-6)


def slope(table: AirfoilTable, reynolds: float, limit_deg: float) -> float:
    """Lift slope [1/rad]: least squares through zero."""
    alpha = np.linspace(0, limit_deg, 50) * DEG
    cl, _ = interpolate(table, reynolds, alpha)
    return float(alpha @ cl / (alpha @ alpha))


def test_naca0012_lift_slope_agrees_with_experiment():
    # McCroskey, A critical assessment of wind tunnel results for the NACA 0012 airfoil, NASA TM 100019, 1987:
    # 0.1025 + 0.00485 log10(Re / 1e6) per degree, fitted to the better tunnels from some 1e6 upwards.
    measured = 0.1025 / DEG
    assert slope(TABLES["naca0012"], 1e6, 8.0) == pytest.approx(measured, rel=0.06)
    assert 5.7 < slope(TABLES["naca0012"], 3e5, 8.0) < 6.0


def test_naca0012_drag_at_zero_lift_agrees_with_experiment():
    # The same report, transition fixed: 0.0017 + 0.91 / log10(Re)^2.58.
    table = TABLES["naca0012"]
    zero = len(table.alpha) // 2
    measured = 0.0017 + 0.91 / 6.0**2.58
    assert table.cd[-1, zero] == pytest.approx(measured, rel=0.05)


def test_naca0012_drag_at_zero_lift_follows_turbulent_friction():
    # Flat plate 0.074 Re^-0.2 (Prandtl) on two sides times Hoerner's form factor 1 + 2 t/c + 60 (t/c)^4.
    table = TABLES["naca0012"]
    friction = 2 * 0.074 * table.numbers**-0.2 * (1 + 2 * 0.12 + 60 * 0.12**4)
    np.testing.assert_allclose(table.cd[:, len(table.alpha) // 2], friction, rtol=0.15)


def test_naca0012_maximum_lift_grows_with_reynolds_number():
    # Jacobs and Sherman, Airfoil section characteristics as affected by variations of the Reynolds number,
    # NACA TR 586, 1937: maximum lift of this airfoil rises throughout this range, from below 1 towards 1.3.
    table = TABLES["naca0012"]
    attached = np.abs(table.alpha) < 20 * DEG
    peak = table.cl[:, attached].max(axis=1)
    stall_deg = table.alpha[attached][table.cl[:, attached].argmax(axis=1)] / DEG
    assert np.all(np.diff(peak) > 0)
    assert 0.8 < peak[0] < 1.0
    assert 1.15 < peak[-1] < 1.4
    assert np.all((stall_deg >= 9) & (stall_deg <= 17))


# XFOIL 6.99 with the same outline (200 panels), n_crit 9, transition forced at 0.1 chord, at 0, 2 .. 10 deg.
XFOIL_LIFT = {
    5.0e4: [0, 0.1962, 0.3905, 0.5752, 0.7334, 0.8916],
    1.2e5: [0, 0.2048, 0.4069, 0.6023, 0.7738, 0.9418],
    3.0e5: [0, 0.2092, 0.4162, 0.6175, 0.7875, 0.9304],
    1.0e6: [0, 0.2150, 0.4285, 0.6372, 0.8274, 1.0024],
}
XFOIL_DRAG = {
    5.0e4: [0.02371, 0.02410, 0.02537, 0.02787, 0.03326, 0.05310],
    1.2e5: [0.01747, 0.01771, 0.01849, 0.02003, 0.02566, 0.03856],
    3.0e5: [0.01365, 0.01381, 0.01432, 0.01533, 0.01885, 0.02423],
    1.0e6: [0.01044, 0.01054, 0.01086, 0.01156, 0.01359, 0.01615],
}


@pytest.mark.parametrize("reynolds", XFOIL_LIFT)
def test_naca0012_agrees_with_xfoil(reynolds):
    cl, cd = interpolate(TABLES["naca0012"], reynolds, np.arange(0, 11, 2) * DEG)
    np.testing.assert_allclose(cl, XFOIL_LIFT[reynolds], atol=0.03)
    np.testing.assert_allclose(cd, XFOIL_DRAG[reynolds], rtol=0.04)


def test_linear_573_follows_its_formulas():
    table = TABLES["linear_573"]
    inside = np.abs(table.alpha) < 12.1 * DEG
    for row, reynolds in enumerate(table.numbers):
        for alpha, cl, cd in zip(table.alpha[inside], table.cl[row, inside], table.cd[row, inside], strict=True):
            lift = abs(alpha)
            if lift > 10.2 * DEG:
                # Tangent at 10.2 deg and level at 12 deg: a parabola with its top at 12 deg, 0.9 deg above.
                lift = 11.1 * DEG - (12 * DEG - lift) ** 2 / (2 * 1.8 * DEG)
            assert cl == pytest.approx(math.copysign(5.73 * lift, alpha), abs=6e-7)
            assert cd == pytest.approx(0.0105 * (reynolds / 3e5) ** -0.25 + 0.35 * alpha**2, abs=6e-7)


def test_linear_573_is_what_its_tool_writes(tmp_path):
    spec = importlib.util.spec_from_file_location("make_linear_573", ROOT / "tools" / "make_linear_573.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    write_table(tmp_path / "linear_573.csv", tool.make_table(), tool.COMMENTS)
    written = read_table(tmp_path / "linear_573.csv", 10.0)
    np.testing.assert_allclose(written.cl, TABLES["linear_573"].cl, atol=1.1e-6)
    np.testing.assert_allclose(written.cd, TABLES["linear_573"].cd, atol=1.1e-6)
    header = [line for line in (AIRFOILS / "linear_573.csv").read_text().splitlines() if line.startswith("#")]
    assert header == [f"# {comment}" for comment in tool.COMMENTS]


def test_sc1095r8_has_the_published_figures():
    """Corners of the tables of NASA CR-166309, and the join of both at 32 deg."""
    table = read_table(AIRFOILS / "sc1095r8.csv", 10.0)
    assert table.axis == "mach"
    assert list(table.numbers) == [0.0, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    assert len(table.alpha) == 181
    for mach, alpha_deg, cl, cd in [
        (0.0, 0, 0.0293, 0.0075),
        (0.4, 8, 0.9831, 0.014),
        (1.0, -32, -0.982, 0.6589),
        (0.7, 90, 0.025, 2.08),
        (0.2, -178, 0.195, 0.035),
    ]:
        assert interpolate(table, mach, alpha_deg * DEG) == pytest.approx((cl, cd), abs=1e-12)


def test_goettingen429_has_the_published_slope_and_mean_drag():
    table = read_table(AIRFOILS / "goettingen429.csv", 14.6)
    assert slope(table, 1.0, 10.0) == pytest.approx(5.85, rel=1e-5)
    assert interpolate(table, 2e6, 7 * DEG)[1] == pytest.approx(0.012, abs=1e-12)
    assert stall_angles(table)[0] == pytest.approx([14 * DEG])
    assert interpolate(table, 2e6, math.pi / 2)[1] == pytest.approx(1.11 + 0.018 * 14.6, abs=1e-9)


def test_naca0015_lifts_as_castles_and_gray_measured():
    """NACA TN 2474: slopes of 5.9 and 6.07 /rad at Mach 0.248 and 0.33; Prandtl and Glauert take them to Mach 0."""
    table = read_table(AIRFOILS / "naca0015.csv", 10.0)
    for reynolds, mach, measured in [(256e3, 0.248, 5.9), (341e3, 0.33, 6.07)]:
        assert slope(table, reynolds, 8.0) == pytest.approx(measured * math.sqrt(1 - mach**2), rel=0.03)
    np.testing.assert_array_equal(table.cl, -table.cl[:, ::-1])


def test_thin_2pi_is_what_its_tool_writes_and_its_formula(tmp_path):
    spec = importlib.util.spec_from_file_location("make_thin_airfoil", ROOT / "tools" / "make_thin_airfoil.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    write_table(tmp_path / "thin_2pi.csv", tool.make_table(), tool.COMMENTS)
    kept, written = (read_table(folder / "thin_2pi.csv", 10.0) for folder in (AIRFOILS, tmp_path))
    for table in (kept, written):
        np.testing.assert_allclose(table.cl, np.tile(2 * math.pi * np.sin(table.alpha), (2, 1)), atol=1.1e-6)
        np.testing.assert_array_equal(table.cd, 0.01)


# --- Look-up --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
@given(reynolds=st.floats(1e3, 2e6), alpha=st.floats(-3 * math.pi, 3 * math.pi))
def test_lookup_equals_interpolate(name, reynolds, alpha):
    for readers, interpolation in ((READERS, "smooth"), (LINEAR, "linear")):
        expected = interpolate(TABLES[name], reynolds, alpha, interpolation)
        np.testing.assert_allclose(readers[name](reynolds, alpha), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", NAMES)
def test_lookup_meets_the_table_at_its_points(name):
    table = TABLES[name]
    for row in range(len(table.numbers)):
        for column in range(0, 721, 7):
            expected = table.cl[row, column], table.cd[row, column]
            for readers in (READERS, LINEAR):
                values = readers[name](table.numbers[row], table.alpha[column])
                np.testing.assert_allclose(values, expected, rtol=0, atol=1e-11)


def test_linear_interpolation_is_bilinear():
    table = AirfoilTable(
        "plane",
        np.array([1.0, 2.0, 4.0]),
        np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * math.pi,
        np.array([[0.0, 1.0, 2.0, 1.0, 0.0]]) * np.array([[1.0], [3.0], [5.0]]),
        np.full((3, 5), 0.25),
    )
    # A quarter of the way from 2 to 4 in Reynolds number (3 to 5), half way from 1 to 2 in angle.
    cl, cd = interpolate(table, 2.5, -0.25 * math.pi, "linear")
    assert cl == pytest.approx(3.5 * 1.5, abs=1e-12)
    assert cd == pytest.approx(0.25, abs=1e-12)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("reynolds", [5e4, 1.7e5])
def test_smooth_interpolation_has_a_continuous_slope_and_follows_the_data(name, reynolds):
    """Slopes from both sides of every point agree; between two points no value leaves what these enclose."""
    table = TABLES[name]
    points, step, small = table.alpha[1:-1], table.alpha[1] - table.alpha[0], 1e-7
    values = [interpolate(table, reynolds, points + offset) for offset in (-small, 0.0, small)]
    for before, at, after in zip(*values, strict=True):
        largest = np.abs(np.diff(at)).max() / step
        np.testing.assert_allclose((after - at) / small, (at - before) / small, atol=1e-4 * largest)
    kinks = interpolate(table, reynolds, points + small, "linear")[0] - values[1][0]
    assert np.abs((kinks[1:] - kinks[:-1]) / small).max() > 0.1  # where the lines join they have kinks


@pytest.mark.parametrize("name", NAMES)
def test_smooth_interpolation_stays_between_the_points(name):
    """At the Reynolds numbers of the table; between them the limited slopes mix with those of their neighbours."""
    table = TABLES[name]
    step = table.alpha[1] - table.alpha[0]
    for reynolds, ends in itertools.product(table.numbers, (0, 1)):
        points = interpolate(table, reynolds, table.alpha)[ends]
        low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
        for share in (0.1, 0.5, 0.8):
            between = interpolate(table, reynolds, table.alpha[:-1] + share * step)[ends]
            assert (between >= low - 1e-12).all()
            assert (between <= high + 1e-12).all()


def test_smooth_interpolation_converges_with_the_third_power_of_the_step():
    """On a lift curve without extreme points: twice as many points, an eighth of the error."""
    errors = []
    for count in (72, 144):
        alpha = np.linspace(-math.pi, math.pi, count + 1)
        cl = np.tile(np.sin(alpha), (2, 1))
        table = AirfoilTable("sine", np.array([1e5, 2e5]), alpha, cl, np.ones_like(cl))
        angles = np.linspace(-1.2, 1.2, 5001)
        errors.append(np.abs(interpolate(table, 1.5e5, angles)[0] - np.sin(angles)).max())
    assert errors[0] / errors[1] == pytest.approx(8, rel=0.1)
    assert errors[1] < 2e-6


@pytest.mark.parametrize("turn", [-1, 1])
@given(alpha=st.floats(-math.pi, math.pi))
def test_lookup_is_periodic_in_angle(turn, alpha):
    read = READERS["naca0012"]
    shifted = read(2.1e5, alpha + turn * 2 * math.pi)
    np.testing.assert_allclose(shifted, read(2.1e5, alpha), rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", NAMES)
@given(alpha=st.floats(-math.pi, math.pi), beyond=st.floats(1, 1e300))
def test_reynolds_number_is_clamped(name, alpha, beyond):
    table, read = TABLES[name], READERS[name]
    low, high = table.numbers[0], table.numbers[-1]
    np.testing.assert_allclose(read(low / beyond, alpha), read(low, alpha), rtol=0, atol=1e-12)
    np.testing.assert_allclose(read(-beyond, alpha), read(low, alpha), rtol=0, atol=1e-12)
    np.testing.assert_allclose(read(high * min(beyond, 1e290), alpha), read(high, alpha), rtol=0, atol=1e-12)


@given(
    reynolds=st.floats(allow_nan=False, allow_infinity=True),
    alpha=st.floats(allow_nan=False, allow_infinity=True),
)
def test_lookup_never_reads_outside(reynolds, alpha):
    # The rows beside the table hold NaN.
    table = TABLES["naca0012"]
    cl, cd = READERS["naca0012"](reynolds, alpha)
    assert table.cl.min() - 1e-9 <= cl <= table.cl.max() + 1e-9
    assert table.cd.min() - 1e-9 <= cd <= table.cd.max() + 1e-9


@pytest.mark.parametrize("alpha", [1e3, -1e3, 1e18, -1e18, math.inf, -math.inf])
def test_angles_beyond_three_turns_are_clamped(alpha):
    read = READERS["naca0012"]
    np.testing.assert_allclose(read(3e5, alpha), read(3e5, math.copysign(math.pi, alpha)), atol=1e-11)


@pytest.mark.parametrize("reynolds", [math.nan, math.inf, -math.inf, 0.0, 5e4, 3e5, 1e6])
@pytest.mark.parametrize("alpha", [math.nan, math.inf, -math.inf, 1e300, -3 * math.pi, 0.1, 3 * math.pi])
def test_a_cell_inside_the_table_is_read_whatever_the_input(reynolds, alpha):
    table = TABLES["naca0012"]
    (n_alpha, _, _), n_re = cell_grid(table), len(table.numbers)
    row = READERS["naca0012"].place(reynolds, alpha)[2] - 3
    assert row in range((n_re - 1) * n_alpha)


@pytest.mark.parametrize(("reynolds", "alpha"), [(math.nan, 0.1), (3e5, math.nan), (math.nan, math.nan)])
def test_nan_stays_nan(reynolds, alpha):
    assert np.isnan(READERS["naca0012"](reynolds, alpha)).all()


def test_cells_are_two_cache_lines_each():
    rows = cells(TABLES["naca0012"], "smooth")
    assert rows.shape == (7 * 3 * 720, 16)
    assert rows.flags.c_contiguous
    assert rows.dtype == np.float64


# --- Mach numbers, uneven angles, a single number ---------------------------------------------------

# as C81 tables have them: a degree apart in attached flow, up to 30 deg beyond
UNEVEN_DEG = [-180.0, -150, -120, -90, -60, -40, -30, -20, -15, -12, -10, -8, *range(-6, 7), 7.5, 8, 10, 12, 15, 20]
UNEVEN_DEG += [30.0, 40, 60, 90, 120, 150, 180]
MACH = np.array([0.0, 0.3, 0.5, 0.75])


def uneven_table(mach: np.ndarray = MACH) -> AirfoilTable:
    """Cambered section: lift grows with the Mach number after Prandtl and Glauert."""
    alpha = np.array(UNEVEN_DEG) * DEG
    gain = 1 / np.sqrt(1 - mach[:, None] ** 2)
    cl = gain * (np.sin(2 * alpha) + 0.1 * np.cos(alpha) ** 2)
    return AirfoilTable("uneven", mach, alpha, cl, gain * (0.01 + 1.9 * np.sin(alpha) ** 2), axis="mach")


def test_uneven_angles_are_cut_to_their_common_step():
    table = uneven_table()
    assert table.half == 360  # 7.5 deg needs half a degree
    assert cells(table, "smooth").shape == (3 * 3 * 720, 16)


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_a_table_of_uneven_angles_is_met_at_its_points_and_between_them(interpolation):
    """At the points the values of the file; between them the plain interpolant through the points as they are."""
    table, alpha = uneven_table(), np.array(UNEVEN_DEG) * DEG
    read = Reader(table, interpolation)
    for row, column in itertools.product(range(len(MACH)), range(len(alpha))):
        expected = table.cl[row, column], table.cd[row, column]
        np.testing.assert_allclose(read(MACH[row], alpha[column]), expected, rtol=0, atol=1e-11)
    for mach, angle in [(0.4, 25 * DEG), (0.1, -100 * DEG), (0.75, 7.3 * DEG), (0.6, 14.9 * DEG), (0.2, 170 * DEG)]:
        expected = airfoil_coefficients(table, mach, angle, interpolation)
        np.testing.assert_allclose(read(mach, angle), expected, rtol=0, atol=1e-11)
        np.testing.assert_allclose(interpolate(table, mach, angle, interpolation), expected, rtol=0, atol=1e-11)


def test_a_single_number_holds_for_all():
    table = uneven_table(np.array([0.4]))
    read, (cl, cd) = Reader(table), interpolate(table, 0.4, 5 * DEG)
    column = UNEVEN_DEG.index(5)
    assert (cl, cd) == pytest.approx((table.cl[0, column], table.cd[0, column]), abs=1e-12)
    for mach in (0.0, 0.4, 0.99, 1e7):
        np.testing.assert_allclose(read(mach, 5 * DEG), (cl, cd), rtol=0, atol=1e-12)


def test_a_table_over_mach_numbers_with_uneven_angles_is_read_and_written_again(tmp_path):
    rows = [f"{mach},{angle},{0.1 * angle},0.02" for mach in (0, 0.5) for angle in (-20, -10, -4, 0, 2.5, 10)]
    table = read_table(write_csv(tmp_path, *rows, header="mach, alpha_deg, cl, cd"), 10.0)
    assert (table.axis, table.half, table.given) == ("mach", 360, (-20 * DEG, 10 * DEG))
    assert list(table.numbers) == [0.0, 0.5]
    inside = np.abs(table.alpha + 5 * DEG) < 15.1 * DEG
    np.testing.assert_allclose(table.alpha[inside] / DEG, (-20, -10, -4, 0, 2.5, 10), atol=1e-12)
    assert table.cl[0, -1] == table.cl[0, 0]
    write_table(tmp_path / "copy.csv", table)
    again = read_table(tmp_path / "copy.csv", 10.0)
    assert again.axis == "mach"
    np.testing.assert_array_equal(again.alpha, table.alpha)
    np.testing.assert_allclose(again.cl, table.cl, atol=5.1e-7)


def test_a_table_without_numbers_is_read(tmp_path):
    table = read_table(write_csv(tmp_path, "-5,-0.5,0.02", "0,0,0.01", "5,0.5,0.02", header="alpha_deg,cl,cd"), 10.0)
    assert table.range == (0.0, math.inf)
    assert interpolate(table, 1e5, 5 * DEG)[0] == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_tables_on_a_common_grid_have_their_own_values(interpolation):
    """What a table gives on the grid of several is what it gives on its own, and constant beyond its own numbers."""
    tables = uneven_table(), TABLES["linear_573"], uneven_table(np.array([0.1, 0.6])), uneven_table(np.array([0.4]))
    grid = common_grid([tables[0], *tables[2:]])
    assert grid == (360, (0.0, 0.1, 0.3, 0.5, 0.6, 0.75), (0.0, 0.75))
    width = np.pi / grid.half
    for table in (tables[0], *tables[2:]):
        rows = cells(table, interpolation, grid).reshape(len(grid.knots) - 1, -1, 4, 4)
        for i, mach in enumerate([0.05, 0.2, 0.4, 0.55, 0.7]):
            for alpha in (-2.0, -0.21, 0.137, 3.0):
                column = int((alpha + np.pi) / width)
                powers = ((alpha + np.pi) / width - column) ** np.arange(4)
                lift, lift_slope, drag, drag_slope = powers @ rows[i, column]
                expected = interpolate(table, mach, alpha, interpolation)
                assert (lift + lift_slope * mach, drag + drag_slope * mach) == pytest.approx(expected, abs=1e-11)
    assert common_grid([tables[0]]).half == 360
    assert common_half(tables[:2]) == 360


def test_stall_angles_of_uneven_tables_are_those_of_the_points():
    highest, lowest = stall_angles(uneven_table())
    assert np.all(highest / DEG == pytest.approx(np.full(4, 40.0)))
    assert np.all(lowest / DEG == pytest.approx(np.full(4, -40.0)))


# --- Files ----------------------------------------------------------------------------------------


def write_csv(folder: Path, *rows: str, header: str = "reynolds,alpha_deg,cl,cd") -> Path:
    path = folder / "wing.csv"
    path.write_text("\n".join(["# made for a test", header, *rows]) + "\n")
    return path


def block(reynolds: float, angles: list[float], cd: float = 0.02) -> list[str]:
    return [f"{reynolds},{angle},{angle / 10},{cd}" for angle in angles]


def test_partial_table_is_extended_from_its_last_points(tmp_path):
    angles = [-10, -5, 0, 5, 10, 15]
    path = write_csv(tmp_path, *block(1e5, angles, 0.02), "", "# between", *block(2e5, angles, 0.03))
    table = read_table(path, aspect_ratio=6.0)
    np.testing.assert_allclose(table.alpha, np.arange(-180, 181, 5) * DEG, atol=1e-14)
    np.testing.assert_allclose(table.cl[0, 34:40], np.array(angles) / 10, atol=1e-12)
    cl, cd = viterna(40 * DEG, 15 * DEG, 1.5, 0.02, 6.0)
    assert (table.cl[0, 44], table.cd[0, 44]) == pytest.approx((cl, cd), abs=1e-12)
    cl, cd = viterna(-120 * DEG, 10 * DEG, 1.0, 0.03, 6.0)
    assert (table.cl[1, 12], table.cd[1, 12]) == pytest.approx((cl, cd), abs=1e-12)


def test_extension_of_a_cambered_airfoil_closes_at_180_deg():
    alpha = np.arange(-8, 15) * DEG
    circle, cl, cd = extend_polar(alpha, 0.4 + 5.7 * alpha, 0.01 + 0.5 * (alpha + 0.1) ** 2, 10.0)
    assert (cl[0], cd[0]) == pytest.approx((cl[-1], cd[-1]), abs=1e-12)
    assert len(circle) == 361
    # Drag passes evenly from the one stall value to the other over the 8 + 14 deg around 180 deg.
    np.testing.assert_allclose(np.diff(cd[-15:]), (cd[180 - 8] - cd[180 + 14]) / 22, atol=1e-12)
    np.testing.assert_allclose(np.diff(cd[:9]), (cd[180 - 8] - cd[180 + 14]) / 22, atol=1e-12)
    assert cd.min() > 0


def test_a_written_table_reads_back(tmp_path):
    table = TABLES["naca0012"]
    write_table(tmp_path / "copy.csv", table, ["one", "two"])
    again = read_table(tmp_path / "copy.csv", 10.0)
    for name in ("numbers", "alpha", "cl", "cd"):
        np.testing.assert_array_equal(getattr(again, name), getattr(table, name))
    assert again.name == "copy"
    assert (tmp_path / "copy.csv").read_text().startswith("# one\n# two\nreynolds,alpha_deg,cl,cd\n50000,-180,0.0")


def test_a_byte_order_mark_and_spaces_do_no_harm(tmp_path):
    path = tmp_path / "wing.csv"
    rows = ["reynolds, alpha_deg, cl, cd", *block(1e5, [-5, 0, 5]), *block(2e5, [-5, 0, 5])]
    path.write_bytes(b"\xef\xbb\xbf" + "\r\n".join(rows).encode())
    assert len(read_table(path, 10.0).alpha) == 73


A = [-5, 0, 5]
BAD_ROWS = {
    "no rows": ([], "2: no rows follow the header"),
    "too few values": (["1e5,0,0"], "3: 3 values, must be 4: reynolds,alpha_deg,cl,cd"),
    "too many values": (["1e5,0,0,0.1,7"], "3: 5 values, must be 4: reynolds,alpha_deg,cl,cd"),
    "not a number": (["1e5,0,zero,0.1"], "3: cl 'zero' must be a finite number"),
    "empty": (["1e5,0, ,0.1"], "3: cl '' must be a finite number"),
    "nan": (["1e5,nan,0,0.1"], "3: alpha_deg 'nan' must be a finite number"),
    "infinite": (["1e5,0,-inf,0.1"], "3: cl '-inf' must be a finite number"),
    "negative Reynolds number": (["-1e5,0,0,0.1"], "3: reynolds -100000 must be greater than 0"),
    "zero Reynolds number": (["0,0,0,0.1"], "3: reynolds 0 must be greater than 0"),
    "negative drag": ([*block(1e5, A), "2e5,-5,0,-0.01"], "6: cd -0.01 must be greater than 0"),
    "zero drag": ([*block(1e5, A), "2e5,-5,0,0"], "6: cd 0 must be greater than 0"),
    "decreasing Reynolds number": (
        [*block(2e5, A), *block(1e5, A)],
        "6: reynolds 100000 must be at least 200000, the one above",
    ),
    "one angle": (
        ["1e5,0,0,0.1", "2e5,0,0,0.1"],
        "3: alpha_deg 0 must be one of at least 3 angles per Reynolds number",
    ),
    "other angle": (
        [*block(1e5, A), *block(2e5, [-5, 1, 5])],
        "7: alpha_deg 1 must be 0 as for the first Reynolds number",
    ),
    "short block": (
        [*block(1e5, A), *block(2e5, A[:2])],
        "7: alpha_deg 0 must be the last of 3 angles as for the first Reynolds number, not of 2",
    ),
    "long block": (
        [*block(1e5, A), *block(2e5, [*A, 10])],
        "9: alpha_deg 10 must be the last of 3 angles as for the first Reynolds number, not of 4",
    ),
    "uneven without a common step": (
        [*block(1e5, [-10, -5, 1.002, 2]), *block(2e5, [-10, -5, 1.002, 2])],
        "5: alpha_deg 1.002 must be a multiple of 0.05, as angles that are uneven or whose step does not divide 180",
    ),
    "coarse beside 30 deg": (
        [*block(1e5, [-40, -20, 0, 10]), *block(2e5, [-40, -20, 0, 10])],
        "5: alpha_deg 0 must be 0.01 to 10 above -20",
    ),
    "repeated angle": (
        [*block(1e5, [-5, -5, 0]), *block(2e5, [-5, -5, 0])],
        "4: alpha_deg -5 must be 0.01 to 10 above -5",
    ),
    "coarse step": (
        [*block(1e5, [-20, 0, 20]), *block(2e5, [-20, 0, 20])],
        "4: alpha_deg 0 must be 0.01 to 10 above -20",
    ),
    "no negative angle": (
        [*block(1e5, [0, 5, 10]), *block(2e5, [0, 5, 10])],
        "3: alpha_deg 0 must be -180, or between -90 and 0",
    ),
    "no positive angle": (
        [*block(1e5, [-10, -5, 0]), *block(2e5, [-10, -5, 0])],
        "5: alpha_deg 0 must be between 0 and 90 where the first angle is above -180",
    ),
    "from -180 deg, but not to 180": (
        [*block(1e5, [-180, -175, -170]), *block(2e5, [-180, -175, -170])],
        "5: alpha_deg -170 must be 180 where the first angle is -180",
    ),
    "open circle": (
        [*block(1e5, list(range(-180, 181, 10))), *block(2e5, list(range(-180, 181, 10)))],
        "39: cl 18 must be -18 as at -180 deg",
    ),
}


@pytest.mark.parametrize("case", BAD_ROWS)
def test_bad_rows_are_refused_in_one_line(tmp_path, case):
    rows, message = BAD_ROWS[case]
    path = write_csv(tmp_path, *rows)
    with pytest.raises(AirfoilError) as caught:
        read_table(path, 10.0)
    assert str(caught.value) == f"{path}:{message}"


def test_unequal_drag_at_the_ends_is_refused(tmp_path):
    rows = [f"{re},{a},0,0.1" for re in (1e5, 2e5) for a in range(-180, 181, 10)]
    path = write_csv(tmp_path, *rows[:-1], "2e5,180,0,0.2")
    with pytest.raises(AirfoilError) as caught:
        read_table(path, 10.0)
    assert str(caught.value) == f"{path}:76: cd 0.2 must be 0.1 as at -180 deg"


def test_a_wrong_header_is_refused_in_one_line(tmp_path):
    path = write_csv(tmp_path, *block(1e5, A), header="alpha,cl,cd")
    with pytest.raises(AirfoilError) as caught:
        read_table(path, 10.0)
    assert str(caught.value) == f"{path}:2: header 'alpha,cl,cd' must be {HEADERS}"


def test_a_file_of_another_kind_is_refused_with_the_way_to_convert_it(tmp_path):
    path = write_csv(tmp_path, header="NACA 0012                      2 99 2 99 2 99")
    with pytest.raises(AirfoilError, match=r"; the command airfoil makes tables of C81, XFOIL and AeroDyn files$"):
        read_table(path, 10.0)


def test_a_table_over_both_reynolds_and_mach_number_is_refused(tmp_path):
    path = write_csv(tmp_path, "1e5,0.3,0,0,0.1", header="reynolds,mach,alpha_deg,cl,cd")
    with pytest.raises(AirfoilError) as caught:
        read_table(path, 10.0)
    assert str(caught.value).endswith(f"must be {HEADERS}; a table over both Reynolds and Mach number is not read")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"# only a comment\n", f"holds no table, must begin with the header {HEADERS}"),
        (b"reynolds\xff", "byte 8 is not UTF-8 text"),
    ],
)
def test_a_file_that_is_no_table_is_refused(tmp_path, content, message):
    path = tmp_path / "wing.csv"
    path.write_bytes(content)
    with pytest.raises(AirfoilError) as caught:
        read_table(path, 10.0)
    assert str(caught.value) == f"{path}: {message}"


def test_a_missing_file_is_one_of_the_packages_errors(tmp_path):
    with pytest.raises(SbsError) as caught:
        read_table(tmp_path / "none.csv", 10.0)
    assert str(caught.value) == f"{tmp_path / 'none.csv'}: cannot be read: No such file or directory"
