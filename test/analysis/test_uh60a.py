"""The UH-60A files against the trims and derivatives of NASA TM-85890, and over their speeds."""

import math

import numpy as np
import pytest

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.trim import trim

KNOT = 0.514444
# Table 4 [kt, deg]: pitch attitude; root collective C5 + C6 dc; tail collective C7 + C8 (dp + SK11 dc)
TABLE_4 = {
    1: (5.05, 22.25, 22.98),
    20: (5.83, 21.67, 21.59),
    40: (4.34, 20.42, 18.42),
    60: (3.49, 19.80, 17.92),
    100: (2.47, 20.17, 16.80),
    140: (-0.30, 22.25, 17.35),
}
WASHED = (40, 60)  # kt, where the wash of the rotor crosses the stabilator: see docs/validation.md


@pytest.fixture(scope="module")
def tm85890():
    return Aircraft.load("uh60a_tm85890")


@pytest.mark.parametrize("speed", TABLE_4)
def test_trims_are_those_of_table_4(tm85890, speed):
    pitch, collective, tail = TABLE_4[speed]
    point = trim(tm85890, speed * KNOT)
    assert math.degrees(point.controls[0]) == pytest.approx(collective, abs=1.0)
    assert math.degrees(point.controls[3]) == pytest.approx(tail, abs=1.5)
    if speed not in WASHED:
        assert math.degrees(point.pitch) == pytest.approx(pitch, abs=1.5)
    if speed == 1:
        assert math.degrees(point.roll) == pytest.approx(-2.34, abs=0.5)


def test_hover_derivatives_with_the_options_of_the_source(tm85890):
    """Tables 12 to 15 at 0.5 kt, with uniform inflow and flap alone; moments over the inertia of table 1."""
    found = linearize(tm85890, 0.5 * KNOT, lead_lag=False, cyclic_inflow=False).derivatives()
    assert found["Z_w"] == pytest.approx(-0.2748, rel=0.1)
    assert found["L'_p"] - 2264.2 / 7631.9 * found["N'_p"] == pytest.approx(-3.3484, rel=0.25)
    assert found["N'_r"] - 2264.2 / 50436.4 * found["L'_r"] == pytest.approx(-0.2879, rel=0.25)


def test_a_cyclic_inflow_raises_the_roll_damping_as_curtiss_has_it(tm85890):
    """The Lock number that the blades feel falls by 1 + a sigma / (16 lambda): about 1.55 here."""
    damping = [
        linearize(tm85890, 0.0, lead_lag=False, cyclic_inflow=cyclic).derivatives()["L'_p"] for cyclic in (True, False)
    ]
    inflow = math.sqrt(7438.9 * 9.80665 / (2 * 1.225 * math.pi * 8.1778**2)) / (27.0 * 8.1778)
    assert damping[0] / damping[1] == pytest.approx(1 + 5.73 * 0.0821 / (16 * inflow), rel=0.1)


@pytest.mark.parametrize("speed", [0, 40, 80, 120, 160])
def test_genhel_flies_from_hover_to_160_knots(speed):
    aircraft = Aircraft.load("uh60a_genhel")
    point = trim(aircraft, speed * KNOT)
    assert point.residual < 1e-9
    assert point.beyond_limits == ()
    model = linearize(aircraft, point=point)
    assert np.isfinite(model.a).all()
    assert np.isfinite(model.b).all()
    assert model.growing_rotor_modes == ()
    # the section of the main rotor is that of the source, over the Mach number up to 1
    assert not [line for line in point.warnings if line.startswith("main: ") and "number" in line]


def test_the_stabilator_holds_the_nose_in_fast_flight(tm85890):
    """Without it the angle of attack is less stable; with the schedule of hover the nose is pressed down."""
    stable = linearize(tm85890, 100 * KNOT).derivatives()["M_w"]
    bare = linearize(tm85890.with_value("body.surfaces.stabilator.area", 1e-6), 100 * KNOT).derivatives()["M_w"]
    assert stable < bare
    down = tm85890.with_value("body.surfaces.stabilator.schedule.incidence_deg", [15.0] * 9)
    assert trim(down, 100 * KNOT).pitch < trim(tm85890, 100 * KNOT).pitch - math.radians(2.0)
