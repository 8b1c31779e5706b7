"""docs/validity.md: its numbers are those of the model, and every warning is on it."""

import ast
import math
import re
from pathlib import Path

import numpy as np
import pytest

from sbs_sim import trim
from sbs_sim.flight import validity

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "validity.md").read_text(encoding="utf-8")


def said(pattern):
    """The one number on the page that a pattern with a group finds."""
    found = set(re.findall(pattern, PAGE))
    assert len(found) == 1, (pattern, found)
    return float(found.pop())


@pytest.fixture(scope="module")
def rotor(sbs):
    return sbs.rotors[0]


@pytest.fixture(scope="module")
def tip_speed(rotor):
    return rotor.speed * rotor.radius


@pytest.fixture(scope="module")
def hover_inflow(sbs, rotor):
    """By momentum theory [m/s]: the root of T / (2 rho A)."""
    thrust = sbs.body.mass * sbs.environment.gravity / 2
    return math.sqrt(thrust / (2 * sbs.environment.air_density * math.pi * rotor.radius**2))


def test_speeds_of_the_rotor(rotor, tip_speed, hover_inflow):
    assert said(r"tip speed (\d+) m/s") == pytest.approx(tip_speed, abs=0.5)
    assert said(r"hover inflow ([\d.]+) m/s") == pytest.approx(hover_inflow, abs=0.05)
    assert said(r"reduced frequency of one per revolution: ([\d.]+) at") == pytest.approx(
        rotor.chord_root / (2 * 0.75 * rotor.radius), abs=0.005
    )


def test_where_descent_ends(hover_inflow):
    begin, end = validity.RING_DESCENT[0] * hover_inflow, validity.WINDMILL_BEGIN * hover_inflow
    assert said(r"descent up to ([\d.]+) m/s") == pytest.approx(begin, abs=0.05)
    assert said(r"3\.2 to (\d+) m/s") == said(r"descent above (\d+) m/s") == pytest.approx(end, abs=0.5)
    assert said(r"slower than ([\d.]+) m/s along") == pytest.approx(validity.RING_EDGEWISE * hover_inflow, abs=0.05)


def test_where_the_sections_end(sbs, tip_speed):
    sound = sbs.environment.speed_of_sound
    assert said(r"advance ratio 0\.4: (\d+) m/s") == pytest.approx(validity.MAX_ADVANCE_RATIO * tip_speed, abs=0.5)
    assert said(r"in hover it is ([\d.]+), and") == pytest.approx(tip_speed / sound, abs=5e-4)
    assert said(r"in hover it is [\d.]+, and ([\d.]+) %") == pytest.approx(
        100 * (1 / math.sqrt(1 - (tip_speed / sound) ** 2) - 1), abs=0.05
    )
    assert said(r"where that is (\d+) %") == pytest.approx(
        100 * (1 / math.sqrt(1 - validity.MAX_TIP_MACH**2) - 1), abs=0.5
    )
    reversed_at = 2 * math.sqrt(validity.MAX_REVERSED)
    assert said(r"an advance ratio of ([\d.]+): 80") == pytest.approx(reversed_at, abs=0.005)
    assert said(r"an advance ratio of 0\.63: (\d+) m/s") == pytest.approx(reversed_at * tip_speed, abs=0.5)


@pytest.mark.parametrize(
    ("warning", "number"),
    [("tip Mach number", r"where that is 11 %: (\d+) m/s"), ("stall on more", r"in level flight at ([\d.]+) m/s")],
)
def test_where_warnings_begin_in_level_flight(sbs, warning, number):
    def warned(airspeed):
        return any(warning in line for line in trim(sbs, airspeed=airspeed).warnings)

    speed = said(number)
    assert not warned(speed - 1.0)
    assert warned(speed + 1.0)


def test_the_ground_effect_that_is_left_out():
    """Cheeseman and Bennett at one and two radii."""
    gains = [100 * (1 / (1 - 1 / (4 * z) ** 2) - 1) for z in (1, 2)]
    assert said(r"lifts (\d+) % more") == pytest.approx(gains[0], abs=0.5)
    assert said(r"at two radii ([\d.]+) %") == pytest.approx(gains[1], abs=0.05)


def test_every_warning_is_explained():
    texts = []
    for node in ast.walk(ast.parse(Path(validity.__file__).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "append":
            (reported,) = node.args
            texts.append([part.value for part in reported.values if isinstance(part, ast.Constant)])
    assert len(texts) == len(re.findall(r"^\| \"", PAGE, re.MULTILINE)) - 1 == 13  # the states of the inflow are two
    table = PAGE[PAGE.index("## The warnings") : PAGE.index("## How it was checked")]
    quoted = re.findall(r"^\| \"([^\"]+)\"", table, re.MULTILINE)
    for parts in texts:
        longest = max(parts, key=len).strip(" :,")
        assert any(longest.split(",")[0].removesuffix(" on more than") in line for line in quoted), parts
    assert np.all([f"{state} state" in table for state in (validity.VORTEX_RING, validity.TURBULENT_WAKE)])
