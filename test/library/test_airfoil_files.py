"""Airfoil data of other programs: what is read, joined, extended and written, and what is refused."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sbs_sim.aircraft.airfoil_files import import_airfoil, read_airfoil
from sbs_sim.aircraft.airfoil_files.c81 import c81_text
from sbs_sim.aircraft.airfoil_files.extension import METHODS, broadside_drag
from sbs_sim.aircraft.airfoil_files.table import at_reynolds, table_of
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import AirfoilTable, interpolate, read_table

ROOT = Path(__file__).resolve().parents[2]
EXECUTABLE = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim" / "airfoil"
AIRFOILS = ROOT / "config" / "airfoils"
DEG = math.pi / 180

XFOIL = """
       XFOIL         Version 6.99

 Calculated polar for: NACA <b>2412</b>

 1 1 Reynolds number fixed          Mach number fixed

 xtrf =   1.000 (top)        1.000 (bottom)
 Mach =   0.000     Re =     {re:.3f} e 6     Ncrit =   9.000

   alpha    CL        CD       CDp       CM     Top_Xtr  Bot_Xtr
  ------ -------- --------- --------- -------- -------- --------
"""
# Fixed fields without blanks between them, ten Mach numbers over two lines, other Mach numbers and angles for drag.
C81 = "\n".join(
    [
        "SC 0000 made for a test       10 3 2 4 0 0",
        " " * 7 + "".join(f"{0.1 * k:7.1f}" for k in range(9)),
        " " * 7 + f"{0.9:7.1f}",
        *(
            line
            for angle, lift in ((-180, 0.0), (0, -0.25), (180, 0.0))
            for line in (f"{angle:7.2f}" + "".join(f"{lift - 0.01 * k:7.4f}" for k in range(9)), f"       {lift:7.4f}")
        ),
        " " * 7 + "    0.0    0.9",
        *(
            f"{angle:7.1f}{drag:7.3f}{2 * drag:7.3f}"
            for angle, drag in ((-180, 0.02), (-90, 1.0), (90, 2), (180, 0.02))
        ),
    ]
)
AERODYN = """! ------------ AirfoilInfo v1.01.x Input File ----------------------------------
"DEFAULT"     InterpOrd   ! order
          2   NumTabs     ! Number of airfoil tables in this file.
       0.75   Re          ! Reynolds number in millions
          0   UserProp    ! User property (control) setting
          5   NumAlf      ! Number of data lines in the following table
!    Alpha      Cl      Cd        Cm
  -180.00    0.000   0.0185   0.0000
   -12.01   -0.953   0.0271  -0.0349
     0.00    0.521   0.0057  -0.1337
    10.00    1.358   0.0255  -0.1103
   180.00    0.000   0.0185   0.0000
       1.50   Re
          0   UserProp
          5   NumAlf
  -180.00    0.010   0.0185
   -12.00   -1.000   0.0300
     0.00    0.500   0.0050
    10.00    1.400   0.0200
   180.00    0.000   0.0205
"""


def write(folder, name, text):
    path = folder / name
    path.write_text(text)
    return path


def xfoil(folder, reynolds, last, name="a.txt"):
    rows = [
        f"{a:8.3f} {0.1 * a + 0.2:8.4f} {0.01 + 1e-4 * a * a:9.5f}   0.0 -0.05 1.0 1.0" for a in range(-8, last + 1)
    ]
    return write(folder, name, XFOIL.format(re=reynolds / 1e6) + "\n".join(rows) + "\n")


def polars(*paths):
    return [polar for path in paths for polar in read_airfoil(path).polars]


# --- readers ----------------------------------------------------------------------------------------


def test_c81_is_read_by_columns_and_lift_and_drag_are_joined(tmp_path):
    data = read_airfoil(write(tmp_path, "wing.c81", C81))
    assert (data.kind, data.name) == ("C81 table", "SC 0000 made for a test")
    assert [polar.numbers["mach"] for polar in data.polars] == pytest.approx([0.1 * k for k in range(10)])
    table, _ = table_of("wing", data.polars, "viterna", 10.0)
    assert table.axis == "mach"
    np.testing.assert_allclose(table.alpha / DEG, np.arange(-180, 181, 10), atol=1e-9)  # the wide gaps are filled
    np.testing.assert_allclose(table.cl[:9, 18], [-0.25 - 0.01 * k for k in range(9)], atol=1e-12)
    np.testing.assert_allclose(table.cl[4, 9], -0.5 * (0.04 + 0.29), atol=1e-12)  # between -180 and 0 deg
    np.testing.assert_allclose(table.cd[:, 18], 1.5 * (1 + np.arange(10) / 9), atol=1e-12)  # between both in both


def test_xfoil_polars_at_several_reynolds_numbers_are_extended_each_from_its_own_end(tmp_path):
    files = xfoil(tmp_path, 1e6, 14, "b.txt"), xfoil(tmp_path, 2e5, 10)
    data = read_airfoil(files[0])
    assert data.name == "NACA <b>2412</b>"
    table, remarks = table_of("wing", polars(*files), "viterna", 10.0)
    assert (table.axis, list(table.numbers)) == ("reynolds", [2e5, 1e6])
    assert interpolate(table, 1e6, 14 * DEG)[0] == pytest.approx(1.6, abs=1e-9)
    assert interpolate(table, 2e5, 10 * DEG)[0] == pytest.approx(1.2, abs=1e-9)
    assert interpolate(table, 2e5, 14 * DEG)[0] < 1.2
    assert "Reynolds number 200000, Mach number 0: extended below -8 and above 10 deg by viterna" in remarks
    cut, remarks = table_of("wing", polars(*files), None, 10.0)
    assert (cut.alpha[0], cut.alpha[-1]) == pytest.approx((-8 * DEG, 10 * DEG))
    assert "cut to -8 to 10 deg, which all polars have" in remarks


def test_polars_of_xflr5_may_have_commas_and_repeated_angles(tmp_path):
    text = xfoil(tmp_path, 1e6, 10).read_text().replace("XFOIL         Version 6.99", "xflr5 v6.47")
    head, _, rows = text.partition("--------\n")
    rows = "\n".join(",".join(line.split()) for line in [*rows.splitlines(), *rows.splitlines()[:2]])
    data = read_airfoil(write(tmp_path, "x.csv", f"{head.replace('alpha    CL        CD', 'alpha, CL, CD')}\n{rows}"))
    assert (data.kind, len(data.polars[0].alpha)) == ("XFOIL polar", 19)
    assert data.remarks == ("2 repeated angles left out",)


def test_aerodyn_tables_have_reynolds_numbers_in_millions_and_angles_without_a_common_step(tmp_path):
    table, remarks = table_of("wing", polars(write(tmp_path, "a.dat", AERODYN)), "viterna", 10.0)
    assert list(table.numbers) == [0.75e6, 1.5e6]
    assert interpolate(table, 0.75e6, 10 * DEG) == pytest.approx((1.358, 0.0255), abs=1e-9)
    assert interpolate(table, 1.5e6, -12 * DEG) == pytest.approx((-1.0, 0.03), abs=1e-9)
    # -12.01 deg is moved to -12, on the line to 0 deg
    assert interpolate(table, 0.75e6, -12 * DEG)[0] == pytest.approx(-0.953 + 0.01 / 12.01 * 1.474, abs=1e-9)
    assert any("moved to multiples of 0.1 deg by at most 0.01 deg, which" in remark for remark in remarks)
    assert any("differ by up to 0.01: the mean is taken" in remark for remark in remarks)


def test_polars_behind_one_another_in_one_file_are_all_read(tmp_path):
    texts = [xfoil(tmp_path, reynolds, 10).read_text() for reynolds in (1e6, 2e5, 5e5)]
    data = read_airfoil(write(tmp_path, "all.txt", "\n".join(texts)))
    assert [polar.numbers["reynolds"] for polar in data.polars] == [1e6, 2e5, 5e5]
    assert [len(polar.alpha) for polar in data.polars] == [19, 19, 19]


@pytest.mark.parametrize("number", ["1.500 e 6", "1.500e 6", "1500000", "1.500 e +06"])
def test_the_reynolds_number_may_be_written_in_several_ways(tmp_path, number):
    text = xfoil(tmp_path, 1e6, 10).read_text().replace("1.000 e 6", number)
    (polar,) = read_airfoil(write(tmp_path, "a.txt", text)).polars
    assert polar.numbers == {"reynolds": 1.5e6, "mach": 0.0}


def test_polars_of_airfoiltools(tmp_path):
    head = "Xfoil polar. Reynolds number fixed. Mach  number fixed\nPolar key,xf-n0012-il-50000\nAirfoil,n0012-il\n"
    head += "Reynolds number,50000\nNcrit,9\nMach,0\nMax Cl/Cd,37.4\nUrl,http://a.b/c\n\nAlpha,Cl,Cd,Cdp,Cm,Top_Xtr\n"
    rows = "".join(f"{angle},{0.1 * angle},0.02,0.01,0.0,1.0\n" for angle in (-9.25, 0.0, 9.25))
    data = read_airfoil(write(tmp_path, "a.csv", head + rows))
    assert (data.name, data.polars[0].numbers) == ("n0012-il", {"reynolds": 5e4, "mach": 0.0})
    np.testing.assert_allclose(data.polars[0].cl, [-0.925, 0.0, 0.925])


def test_the_table_is_over_the_number_that_is_chosen_where_both_vary(tmp_path):
    for mach in (0.1, 0.2, 0.3):
        text = xfoil(tmp_path, 1e7 * mach, 10).read_text().replace("Mach =   0.000", f"Mach =   {mach:.3f}")
        write(tmp_path, f"{mach}.txt", text)
    files = [tmp_path / f"{mach}.txt" for mach in (0.3, 0.1, 0.2)]
    for axis, numbers in (("mach", [0.1, 0.2, 0.3]), ("reynolds", [1e6, 2e6, 3e6])):
        table, airfoil, remarks = import_airfoil(files, axis=axis)
        assert (table.name, table.axis, airfoil) == ("0.3", axis, "NACA <b>2412</b>")
        assert list(table.numbers) == pytest.approx(numbers)
        assert remarks[0] == "0.3.txt: XFOIL polar of NACA <b>2412</b>, 1 polar"


def test_c81_numbers_between_blanks_and_card_numbers_behind_the_columns(tmp_path):
    """All twelve values of a row in a line, exponents of Fortran, a name that is short, and a deck's card numbers."""
    mach = " ".join(f"{0.05 * k:.4f}" for k in range(12))
    rows = [f"{angle} " + " ".join(f"{0.1 * angle + k:.6f}" for k in range(12)) for angle in (-10, 0, 10)]
    drag = [f"{7 * ' '}{0:7.1f}{0.5:7.1f}".ljust(72) + "C8100001"]
    drag += [f"{angle:7.1f}  2.D-2 30.D-3".ljust(72) + "C8100002" for angle in (-10, 0, 10)]
    text = "\n".join(["SHORT 12 3 2 3 0 0", mach, *rows, *drag])
    data = read_airfoil(write(tmp_path, "a.c81", text))
    assert (data.name, len(data.polars)) == ("SHORT", 12)
    np.testing.assert_allclose([polar.cl[2] for polar in data.polars], 1.0 + np.arange(12))
    np.testing.assert_allclose([polar.cd[0] for polar in data.polars[::11]], [0.02, 0.03])
    assert "drag held beyond its Mach numbers 0 to 0.5" in data.remarks
    other = text.replace(f"{10:7.1f}  2.D-2", f"{9:7.1f}  2.D-2")
    assert "cut to -10 to 9 deg, which both lift and drag have" in read_airfoil(write(tmp_path, "b.c81", other)).remarks


def test_csv_columns_may_have_other_names_and_any_order(tmp_path):
    head = "! of a test\nCd, Mach ,alpha [deg],Cl,f_st\n"
    rows = "".join(f"0.02,{mach},{angle},{mach * angle},1\n" for mach in (0.3, 0.6) for angle in (-10, 0, 10 * mach))
    data = read_airfoil(write(tmp_path, "a.csv", head + rows))
    assert [polar.numbers for polar in data.polars] == [{"mach": 0.3}, {"mach": 0.6}]
    np.testing.assert_allclose(data.polars[1].alpha, [-10, 0, 6])
    np.testing.assert_allclose(data.polars[1].cl, [-6, 0, 3.6])


def test_an_old_aerodyn_file_and_a_cylinder_at_three_angles(tmp_path):
    """The gaps of 180 deg are filled; a section without lift needs no extension."""
    head = "a file\nof a test\n 1 Number of airfoil tables in this file\n 0.0 Table ID parameter\n 0 No longer used\n"
    text = head + "-180.00 0.000 0.5000\n 0.00 0.000 0.5000\n 180.00 0.000 0.5000\nEOT\nremarks\n"
    table, _, remarks = import_airfoil([write(tmp_path, "Cylinder1.dat", text)])
    assert list(table.numbers) == [0.0]
    assert (np.abs(table.cl).max(), table.cd.min(), table.cd.max()) == (0.0, 0.5, 0.5)
    assert "polar: gaps between angles filled on the lines between the points" in remarks
    assert len(table.alpha) == 37


def test_comments_may_have_any_bytes_and_files_are_limited(tmp_path):
    path = write(tmp_path, "a.dat", AERODYN)
    path.write_bytes(b"! \xb1180 deg\n" + path.read_bytes())
    assert len(read_airfoil(path).polars) == 2
    with path.open("ab") as file:
        file.truncate(20_000_001)
    with pytest.raises(AirfoilError, match="more than 20000000 bytes, allowed for airfoil tables"):
        read_airfoil(path)


def test_a_polar_that_ends_at_90_deg_is_extended_from_below(tmp_path):
    rows = [
        f"{a},{math.sin(a * DEG) * math.cos(a * DEG)},{1.29 * math.sin(a * DEG) ** 2 + 0.01}" for a in range(-90, 91, 5)
    ]
    table, _, remarks = import_airfoil([write(tmp_path, "a.csv", "\n".join(["alpha,cl,cd", *rows]))])
    assert remarks[1:3] == [
        "polar: cut to -85 to 85 deg, below 90 deg, where extensions begin",
        "polar: extended below -85 and above 85 deg by viterna",
    ]
    assert interpolate(table, 0, 90 * DEG)[1] == pytest.approx(1.29, abs=1e-6)  # of an aspect ratio of 10


def test_a_symmetric_polar_is_mirrored(tmp_path):
    rows = [f"{a},{0.1 * a},0.02" for a in range(0, 11, 2)]
    table, _ = table_of("w", polars(write(tmp_path, "a.csv", "\n".join(["alpha_deg,cl,cd", *rows]))), None, 10.0)
    np.testing.assert_allclose(table.cl[0], np.arange(-10, 11, 2) / 10)


def test_a_table_for_all_reynolds_numbers_is_that_at_one(tmp_path):
    """So that --reynolds, which C81 tables need, takes polars without a number, too."""
    table, _ = table_of(
        "w", polars(write(tmp_path, "a.csv", "alpha_deg,cl,cd\n-5,-0.5,0.01\n0,0,0.01\n5,0.5,0.01")), None, 10.0
    )
    assert at_reynolds(table, 3e5) is table
    with pytest.raises(AirfoilError, match=r"Reynolds number 300000: allowed is 1e\+06$"):
        at_reynolds(replace(table, numbers=np.array([1e6])), 3e5)


@pytest.mark.parametrize("name", ["sc1095r8", "naca0015"])
def test_c81_tables_come_back(tmp_path, name):
    """Within the four decimals of a C81 table, and what 99 angles lose, which the writer tells."""
    table = read_table(AIRFOILS / f"{name}.csv", 10.0)
    one = table if table.axis == "mach" else at_reynolds(table, 3e5)
    text, errors = c81_text(one, name)
    assert max(map(len, text.splitlines())) <= 70
    again, _ = table_of(name, polars(write(tmp_path, "a.c81", text)), None, 10.0)
    for i, mach in enumerate(again.numbers):
        cl, cd = interpolate(one, mach if table.axis == "mach" else 3e5, again.alpha, "linear")
        np.testing.assert_allclose(again.cl[i], cl, rtol=0, atol=errors[0] + 5.1e-4)
        np.testing.assert_allclose(again.cd[i], cd, rtol=0, atol=errors[1] + 5.1e-5)
    assert errors[0] < 0.002
    assert errors[1] < 0.001


def test_a_c81_file_that_is_read_and_written_again_is_the_same_file(tmp_path):
    """Different angles of lift and drag, 14 Mach numbers over two lines, numbers that need a sign and three digits."""
    mach, angles = np.arange(14) * 0.07, np.array([-180, -90, -40, -8, 0, 6.5, 12, 40, 90, 180]) * DEG
    cl = np.sin(2 * angles) * (1.2 + mach[:, None])
    table = AirfoilTable("w", mach, angles, cl, 0.01 + np.sin(angles) ** 2 * np.ones_like(cl), axis="mach")
    text, errors = c81_text(table, "A WING")
    again, name, _ = import_airfoil([write(tmp_path, "a.c81", text)], extension=None)
    assert errors == (0.0, 0.0)
    at = np.rint(np.degrees(again.alpha) * 100).astype(int).tolist()
    kept = [at.index(angle) for angle in np.rint(np.degrees(angles) * 100).astype(int).tolist()]
    np.testing.assert_allclose(again.cl[:, kept][:, 1:-1], cl[:, 1:-1], rtol=0, atol=5.1e-4)
    assert c81_text(replace(again, alpha=angles, cl=again.cl[:, kept], cd=again.cd[:, kept]), name)[0] == text


# --- extensions -------------------------------------------------------------------------------------

ANGLES = np.arange(-10, 16) * DEG


def section(alpha, camber):
    """Lift that leaves its line, cl = 6 alpha + camber, towards stall; drag that grows."""
    lift = 6.0 * alpha + camber
    lift = np.where(np.abs(alpha) > 6 * DEG, lift - np.sign(alpha) * 25 * (np.abs(alpha) - 6 * DEG) ** 2, lift)
    return lift, 0.01 + 0.8 * alpha**2


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("camber", [0.0, 0.3])
def test_extensions_keep_the_polar_go_round_and_have_no_jump(method, camber):
    cl, cd = section(ANGLES, camber)
    circle, lift, drag = METHODS[method](ANGLES, cl, cd, 10.0)
    first = 180 - 10
    np.testing.assert_array_equal(lift[first : first + 26], cl)
    np.testing.assert_array_equal(drag[first : first + 26], cd)
    np.testing.assert_allclose(np.diff(circle), DEG, atol=1e-12)
    assert (lift[0], drag[0]) == (lift[-1], drag[-1])
    assert drag.min() > 0
    assert np.abs(np.diff(lift)).max() < 0.16  # the attached slope is 0.105 for a degree, Montgomerie's stall 0.157
    assert np.abs(np.diff(drag)).max() < 0.1


@pytest.mark.parametrize("method", METHODS)
def test_extensions_of_a_symmetric_section_are_symmetric(method):
    alpha = np.arange(-14, 15) * DEG
    cl, cd = section(alpha, 0.0)
    _, lift, drag = METHODS[method](alpha, cl, cd, 10.0)
    np.testing.assert_allclose(lift[1:-1], -lift[1:-1][::-1], atol=1e-10)
    np.testing.assert_allclose(drag, drag[::-1], atol=1e-10)


def test_montgomerie_passes_from_the_line_to_the_plate():
    """Lift of 0.03 above the plate's 15 deg after the end; at 90 deg that of 0.08 rad; drag of the plate broadside."""
    cl, cd = section(ANGLES, 0.3)
    slope, zero = np.polyfit(ANGLES[5:16], cl[5:16], 1)
    _, lift, drag = METHODS["montgomerie"](ANGLES, cl, cd, 10.0)

    def plate(alpha):
        angle = alpha - 0.08 * math.sin(alpha) + zero / slope * math.cos(alpha)
        return (1 + zero * math.sqrt(2) * math.sin(alpha)) * 1.29 * math.sin(angle) * math.cos(angle)

    assert broadside_drag(10.0) == pytest.approx(1.29)
    assert lift[180 + 30] == pytest.approx(plate(30 * DEG) + 0.03, abs=0.02)  # the slope is fitted over less here
    assert lift[180 + 90] == pytest.approx(plate(math.pi / 2), abs=5e-3)
    assert drag[180 + 90] == pytest.approx(1.29 + 0.006, abs=5e-3)
    assert plate(math.pi / 2) == pytest.approx((1 + 0.3 * math.sqrt(2)) * 1.29 * 0.08, rel=0.02)


def test_a_plate_has_its_normal_force_beyond_15_deg_of_the_end():
    cl, cd = section(ANGLES, 0.3)
    circle, lift, drag = METHODS["plate"](ANGLES, cl, cd, 30.0)
    beyond = circle > 30.1 * DEG
    np.testing.assert_allclose(lift[beyond], 1.65 * np.sin(circle[beyond]) * np.cos(circle[beyond]), atol=1e-12)
    np.testing.assert_allclose(drag[beyond], 1.65 * np.sin(circle[beyond]) ** 2 + 0.006, atol=1e-12)


def test_held_values_stay_to_90_deg():
    cl, cd = section(ANGLES, 0.3)
    circle, lift, drag = METHODS["hold"](ANGLES, cl, cd, 10.0)
    held = (circle >= 15 * DEG - 1e-9) & (circle <= math.pi / 2 + 1e-9)
    np.testing.assert_allclose((lift[held], drag[held]), np.tile([[cl[-1]], [cd[-1]]], held.sum()), atol=1e-12)
    assert lift[-1] == pytest.approx(0.5 * (cl[0] + cl[-1]))


# --- refusals ---------------------------------------------------------------------------------------

BAD = {
    "no airfoil": ("hello\n<b>x</b>\n", ":1: 'hello' begins no airfoil file, allowed are C81 tables,"),
    "an empty file": ("\n \n", ": the file is empty, must have airfoil data"),
    "a short C81 file": (C81.rpartition("\n")[0], ":13: the file ends where 3 more numbers must follow"),
    "a C81 field": (C81.replace("-0.2900", " 0.2x00"), ":6: field 6 '0.2x00' must be a finite number"),
    "Mach numbers that fall": (
        C81.replace("    0.8\n", "    0.2\n"),
        ":2: Mach numbers of cl: 0.2 must be greater than 0.7",
    ),
    "a polar with a moving Reynolds number": (
        XFOIL.format(re=1.0).replace("1 1 Reynolds number fixed", "2 1 Reynolds number ~ 1/sqrt(CL)"),
        ":6: '2 1 Reynolds number ~ 1/sqrt(CL) Mach number fixed' must be fixed Reynolds and Mach numbers",
    ),
    "an empty polar": (XFOIL.format(re=1.0), ":11: the polar has 0 angles, must have at least 3"),
    "a polar with text": (XFOIL.format(re=1.0) + "0.0 0.1 \x1b[31m\n", ":13: cd '?[31m' must be a finite number"),
    "a cut AeroDyn table": (
        AERODYN.replace("   180.00    0.000   0.0205\n", ""),
        ":19: the table ends after 4 lines, must have 5, its NumAlf",
    ),
    "tables that lack": (
        AERODYN.replace("          2   NumTabs", "          3   NumTabs"),
        ":20: the file has 2 tables, must have 3, its NumTabs",
    ),
    "a file of AeroDyn without a table": ("! NumAlf\n 1 Re\n", ":2: the file has no table, must have one"),
    "a flap": (
        AERODYN.replace("Re\n          0   UserProp", "Re\n          5   UserProp"),
        ":14: control setting 5 must be that of the first table",
    ),
    "a count of angles": (
        AERODYN.replace("5   NumAlf      !", "5.5 NumAlf      !"),
        ":6: NumAlf '5.5' must be an integer from 1 to 10000",
    ),
    "a C81 count that is too low": (
        C81.replace("10 3 2 4 0 0", "10 2 2 4 0 0"),
        ":8: field 2 '0.0000-0.0100",
    ),
    "lift beyond all": (AERODYN.replace("1.358", "1358."), ":11: cl 1358 at 10 deg must be between -100 and 100"),
    "an angle beyond": (AERODYN.replace("   -12.01", "  -192.01"), ":9: angle -192.01 must be between -180 and 180"),
    "angles in radians": ("alpha (rad),cl,cd\n0,0,1\n", ":1: 'alpha (rad),cl,cd' must have angles in degrees"),
    "a CSV row that is short": ("alpha,cl,cd\n0,0,1\n1,1\n", ":3: 2 values, must be 3, as in the header"),
    "a CSV field": ("alpha,cl,cd\n0,<i>,1\n", ":2: cl '<i>' must be a finite number"),
    "a CSV file without rows": ("# x\nalpha,cl,cd\n", ":2: no rows follow the header"),
    "numbers like the counts of a C81 file": (
        " -110.0 0.45 1.3 0.0E+0 -11.689840683245166 0.45\n -80 0 1 0 0 0\n",
        "begins no airfoil file",
    ),
    "a drag of zero": (AERODYN.replace("0.0205", "0.0"), ":20: cd 0 at 180 deg must be greater than 0 and at most 100"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_refused_in_one_line(tmp_path, case):
    text, message = BAD[case]
    path = write(tmp_path, "bad.txt", text)
    with pytest.raises(AirfoilError) as caught:
        read_airfoil(path)
    line = str(caught.value)
    assert line.startswith(f"{path}:")
    assert message in line
    assert line.isprintable()


def test_polars_that_do_not_fit_together_are_refused(tmp_path):
    one, same = xfoil(tmp_path, 1e6, 10), xfoil(tmp_path, 1e6, 10, "b.txt")
    with pytest.raises(
        AirfoilError, match=r"b.txt:11: a second polar with Reynolds number 1000000 beside .*a.txt:11, allowed is one"
    ):
        table_of("w", polars(one, same), None, 10.0)
    other = write(
        tmp_path, "c.txt", xfoil(tmp_path, 2e6, 10, "c.txt").read_text().replace("Mach =   0.0", "Mach =   0.3")
    )
    with pytest.raises(AirfoilError, match="at several Reynolds and several Mach numbers, allowed is one"):
        table_of("w", polars(one, other), None, 10.0)
    with pytest.raises(AirfoilError, match=r"has Reynolds numbers 50000, .*: choose one of them \(--reynolds\)"):
        c81_text(read_table(AIRFOILS / "naca0015.csv", 10.0), "x")
    with pytest.raises(AirfoilError, match="between that of a plate"):
        table_of("w", polars(one), "montgomerie", 10.0)  # its lift is on the line


def test_what_holds_for_every_polar_is_said_once(tmp_path):
    made = write(tmp_path, "a.c81", c81_text(read_table(AIRFOILS / "sc1095r8.csv", 10.0), "sc1095r8")[0])
    remarks = import_airfoil([made])[2]
    assert remarks[1:] == ["all polars: gaps between angles filled on the lines between the points"]
    some = [polars(xfoil(tmp_path, re, last, f"{last}.txt"))[0] for re, last in ((2e5, 10), (1e6, 10), (2e6, 14))]
    assert "all polars: extended below -8 and above 10 deg by viterna" in table_of("w", some[:2], "viterna", 10.0)[1]
    ends = [remark for remark in table_of("w", some, "viterna", 10.0)[1] if "extended" in remark]
    assert len(ends) == 3
    assert not any(remark.startswith("all polars") for remark in ends)


# --- the command ------------------------------------------------------------------------------------


def test_the_command_tells_what_it_does_and_writes_what_aircraft_take(tmp_path):
    xfoil(tmp_path, 2e5, 10), xfoil(tmp_path, 1e6, 14, "b.txt")
    command = [sys.executable, str(EXECUTABLE), "a.txt", "b.txt", "--out", "wing.csv"]
    made = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (made.returncode, made.stderr) == (0, "")
    assert "a.txt: XFOIL polar of NACA <b>2412</b>, 1 polar\n" in made.stdout
    assert "extended below -8 and above 10 deg by viterna" in made.stdout
    table = read_table(tmp_path / "wing.csv", 10.0)
    assert interpolate(table, 1e6, 4 * DEG)[0] == pytest.approx(0.6, abs=1e-6)
    assert (tmp_path / "wing.csv").read_text().startswith("# Made by `sbs-sim airfoil`.\n# a.txt: XFOIL polar of NACA")
    command = [sys.executable, str(EXECUTABLE), "wing.csv", "--out", "wing.c81"]
    refused = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert refused.stderr == (
        "wing: a C81 table is over the Mach number, the table has Reynolds numbers 200000, 1000000: choose one of them"
        " (--reynolds)\n"
    )
    assert not (tmp_path / "wing.c81").exists()
