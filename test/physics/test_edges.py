"""The edges of the model: what it says of itself there, that it stays finite, and that it comes back; the ground."""

import csv
import dataclasses
import math

import numpy as np
import pytest
from helpers import aircraft_data

from sbs_sim import Aircraft, Case, Simulation, linearize, simulate, simulate_batch, sweep, trim
from sbs_sim.analysis.export import sweep_to_csv
from sbs_sim.errors import SimulationError
from sbs_sim.flight.refly import refly
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight.validity import (
    NORMAL,
    TURBULENT_WAKE,
    UNLOADED,
    VORTEX_RING,
    WINDMILL,
    inflow_state,
    tip_mach,
    warnings,
    working_state,
)
from sbs_sim.model import state as S
from sbs_sim.model import working_state as W
from sbs_sim.model.airfoil import AirfoilTable, read_table, stall_angles
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.wind import Wind

GUST = 30.0  # m/s
ATTITUDES = {
    "nose down": (0.0, -math.pi / 2, 0.0),
    "nose up": (0.0, math.pi / 2, 0.0),
    "on its side": (0.0, 0.0, math.pi / 2),
    "upside down": (0.0, 0.0, math.pi),
}
AIRS = {
    "vortex ring": (0.0, 0.0, -6.0),
    "turbulent wake": (0.0, 0.0, -18.0),
    "windmill": (-3.0, 0.0, -25.0),
    "reverse flow": (-80.0, 0.0, 0.0),
    "sideways": (0.0, GUST, 0.0),
    "from above": (0.0, 0.0, GUST),
    "from below": (0.0, 0.0, -GUST),
}


def hovering(aircraft, point, **options):
    return Simulation(aircraft, trimmed_state(aircraft, point), point.swashplate, **options)


def held(simulation, seconds):
    """Snapshots of a flight on a stand: the body is put back after every tick."""
    body = simulation.state[: S.BODY_SIZE].copy()
    for _ in range(round(seconds / simulation.tick)):
        simulation.advance()
        simulation.state[: S.BODY_SIZE] = body
        yield simulation.snapshot()


def end_of(simulation, seconds=10.0):
    """What ends a flight early; all that is reported of it is finite as long as it lasts."""
    try:
        for _ in range(round(seconds / simulation.tick)):
            simulation.advance()
            snapshot = simulation.snapshot()
            assert all(np.isfinite(part).all() for part in (snapshot.acceleration, snapshot.loads, snapshot.working))
    except SimulationError as error:
        return str(error)
    return "nothing"


def states(snapshot):
    return [working_state(row) for row in snapshot.working]


# --- what rotors are made to do ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("descent", "edgewise", "with_thrust", "expected"),
    [
        (0.0, 0.0, True, NORMAL),
        (-2.0, 0.0, True, NORMAL),
        (0.3, 0.0, True, NORMAL),
        (1.0, 0.0, True, VORTEX_RING),
        (1.0, 0.5, False, VORTEX_RING),
        (1.0, 1.0, True, NORMAL),  # it flies out of its wake
        (1.0, 1.0, False, WINDMILL),
        (1.7, 0.0, False, TURBULENT_WAKE),
        (2.5, 0.0, True, TURBULENT_WAKE),
        (2.5, 0.0, False, WINDMILL),
    ],
)
def test_inflow_states_are_those_of_momentum_theory(descent, edgewise, with_thrust, expected):
    assert inflow_state(descent, edgewise, with_thrust) == expected


def test_hover_and_climb_are_within_the_model(sbs, hover):
    snapshot = hovering(sbs, hover).snapshot()
    assert warnings(sbs, snapshot.working) == []
    for state in states(snapshot):
        assert state.inflow_state == NORMAL
        assert state.advance_ratio == pytest.approx(0.0, abs=1e-12)
        assert state.stalled_share == state.reversed_share == 0.0
    climbing = hovering(sbs, hover, wind=Wind(velocity=(0.0, 0.0, 3.0)))
    assert all(state.descent_ratio < 0.0 for state in states(climbing.snapshot()))


def test_hover_inflow_is_that_of_a_ducted_disc(sbs, hover):
    """T = rho pi R^2 v^2 / (2 a_w^2), where hover has settled to it."""
    snapshot = hovering(sbs, hover).snapshot()
    for j in range(len(sbs.rotors)):
        uniform = snapshot.state[sbs.layout.inflow(j)][0]
        assert snapshot.working[j, W.HOVER_INFLOW] == pytest.approx(uniform, rel=0.01)
        assert snapshot.working[j, W.FLOW] == pytest.approx(uniform)


@pytest.mark.parametrize("speed", [40.0, 100.0])
def test_reverse_flow_is_a_circle_beside_the_hub(sbs, hover, speed):
    """Of diameter mu R, on the retreating side: r + mu R sin(psi) < 0; summed over the annulus from hinge to tip."""
    state = trimmed_state(sbs, hover)
    state[S.BODY_SIZE :] = 0.0
    simulation = Simulation(sbs, state, hover.swashplate, wind=Wind(velocity=(-speed, 0.0, 0.0)))
    rotor = sbs.rotors[0]
    shares = []
    for _ in range(50):
        row = simulation.snapshot().working[0]
        shares.append(row[W.REVERSED])
        simulation.advance()
        simulation.state[:] = state
    mu = speed / (rotor.speed * rotor.radius)
    assert row[W.ADVANCE_RATIO] == pytest.approx(mu * math.cos(hover.pitch), rel=0.01)
    edges = np.linspace(rotor.hinge_offset, rotor.radius, 401)
    r, psi = np.meshgrid((edges[1:] + edges[:-1]) / 2, np.linspace(0.0, 2 * math.pi, 721)[:-1])
    expected = np.average(r + mu * rotor.radius * np.sin(psi) < 0.0, weights=r)
    assert np.mean(shares) == pytest.approx(expected, abs=0.01)


HALF_DEGREES = np.radians(np.arange(-180.0, 180.5, 0.5))


def table_of(*polars, alpha=HALF_DEGREES):
    """Table with the lift of functions of the angle in degrees, one for each Reynolds number."""
    cl = np.array([polar(np.degrees(alpha)) for polar in polars])
    return AirfoilTable("x", 1e5 * np.arange(1.0, len(polars) + 1.0), alpha, cl, np.ones_like(cl))


def stall_deg(table):
    """Highest and lowest angle of each Reynolds number [deg]."""
    return [np.degrees(angles).tolist() for angles in stall_angles(table)]


def measured(alpha, high=12.0, low=-12.0, no_lift=0.0, plate=1.0):
    """Lift that is linear up to near stall, largest there, lost over 8 deg more, and a plate's lift beyond."""
    tops = (high, low)
    attached = 0.105 * (alpha - no_lift)
    for top in tops:
        over = np.maximum(0.0, np.sign(top) * (alpha - top) + 3.0)
        attached = attached - np.sign(top) * 0.105 / 6.0 * np.minimum(over, 6.0) ** 2  # level at the top
    stalled = plate * np.sin(2.0 * np.radians(alpha))
    share = np.interp(alpha, [low - 8.0, low - 1.0, high + 1.0, high + 8.0], [0.0, 1.0, 1.0, 0.0])
    return share * attached + (1.0 - share) * stalled


def test_stall_begins_where_lift_stops_to_grow():
    alpha = np.radians(np.arange(-180.0, 181.0, 1.0))
    peaks = np.radians([[9.0, -7.0], [14.0, -12.0]])
    cl = np.array(
        [np.where(alpha > 0, np.sin(alpha / a * math.pi / 2), np.sin(alpha / -b * math.pi / 2)) for a, b in peaks]
    )
    table = AirfoilTable("x", np.array([1e5, 1e6]), alpha, cl, np.ones_like(cl))
    highest, lowest = stall_angles(table)
    np.testing.assert_allclose(highest, peaks[:, 0])
    np.testing.assert_allclose(lowest, peaks[:, 1])


def test_stall_of_a_cambered_section_and_of_one_that_lifts_more_at_45_deg():
    """Every Reynolds number by itself: its tops are where the curves were given them."""
    tops = [(12.0, -12.0), (14.0, -8.0), (9.0, -14.0), (16.0, -10.0)]
    plates = (0.6, 1.0, 1.4, 1.4)
    table = table_of(
        *(
            lambda alpha, high=high, low=low, plate=plate: measured(alpha, high, low, -0.2 * (high + low), plate)
            for (high, low), plate in zip(tops, plates, strict=True)
        )
    )
    assert table.cl[2, 360 + 90] > 2.0 * table.cl[2, 360 + 18]  # at 45 deg, and at its top at 9 deg
    np.testing.assert_allclose(stall_deg(table), np.transpose(tops), atol=1e-9)


@pytest.mark.parametrize("depth", [1e-6, 1e-3, 0.05])
def test_a_dent_is_no_stall(depth):
    for place in (*range(1, 22), 30):  # anywhere up to 11 deg, and in stalled flow
        cl = measured(np.degrees(HALF_DEGREES))
        for side in (1, -1):
            cl[360 + side * place] = cl[360 + side * (place - 1)] - side * depth
        assert stall_deg(table_of(lambda _, cl=cl: cl)) == [[pytest.approx(12.0)], [pytest.approx(-12.0)]], place


def test_plateaus_are_no_stall_but_for_the_highest():
    """Equal neighbours of a file with few decimals; lift that stays at its top stops to grow where it gets there."""
    steps = table_of(lambda alpha: np.round(measured(alpha), 1))
    tops = np.array(stall_deg(steps))[:, 0]
    assert steps.cl[0].max() == pytest.approx(np.interp(math.radians(tops[0]), HALF_DEGREES, steps.cl[0]))
    assert 9.5 <= tops[0] <= 12.0
    assert tops[1] == -tops[0]
    level = table_of(lambda alpha: np.interp(alpha, [-90, -25, -11, 11, 25, 90], [0, -1.1, -1.1, 1.1, 1.1, 0]))
    assert stall_deg(level) == [[pytest.approx(11.0)], [pytest.approx(-11.0)]]


def test_noise_of_a_measurement_moves_stall_no_further_than_the_top_is_wide():
    """Errors of 0.03, more than half of what lift gains in half a degree, reach places with 0.06 less than the top."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        noise = rng.uniform(-0.03, 0.03, len(HALF_DEGREES))
        (highest,), (lowest,) = stall_deg(table_of(lambda alpha, noise=noise: measured(alpha) + noise))
        clean = measured(np.array([highest, -lowest]))
        assert (clean >= measured(np.array([12.0])) - 0.06).all()
        assert 10.0 <= highest <= 14.0
        assert -14.0 <= lowest <= -10.0


def test_a_section_that_never_loses_its_lift_never_stalls():
    never = table_of(lambda alpha: 0.1 * np.interp(np.abs(alpha), [0, 90, 180], [0, 90, 0]) * np.sign(alpha))
    assert stall_deg(never) == [[pytest.approx(90.0)], [pytest.approx(-90.0)]]  # where the flow comes from behind
    assert stall_deg(table_of(np.zeros_like)) == [[pytest.approx(180.0)], [pytest.approx(-180.0)]]


@pytest.mark.parametrize(("last", "aspect_ratio"), [(8, 10.0), (14, 10.0), (14, 60.0)])
def test_a_table_that_is_extended_is_stalled_beyond_its_end(tmp_path, last, aspect_ratio):
    """Before stall too, and where a slender blade's lift rises on from there to that of a plate at 45 deg."""
    rows = [
        f"{reynolds},{alpha},{0.065 * alpha},0.02" for reynolds in (1e5, 1e6) for alpha in range(-last + 2, last + 1)
    ]
    path = tmp_path / "wing.csv"
    path.write_text("\n".join(["reynolds,alpha_deg,cl,cd", *rows]) + "\n")
    table = read_table(path, aspect_ratio)
    highest, lowest = stall_deg(table)
    assert highest == pytest.approx([last, last])
    assert lowest == pytest.approx([2 - last, 2 - last])


def test_a_dented_airfoil_does_not_stall_in_hover(sbs, hover):
    """The default one with a dent of a millionth at 4.5 deg, of which more than half of the disc sees more."""
    table = sbs.sections[0][0]
    cl, zero = table.cl.copy(), len(table.alpha) // 2
    for side in (1, -1):
        cl[:, zero + 9 * side] = cl[:, zero + 8 * side] - side * 1e-6
    dented = dataclasses.replace(sbs, sections=((dataclasses.replace(table, cl=cl),),) * len(sbs.rotors))
    assert [state.stalled_share for state in states(hovering(dented, hover).snapshot())] == [0.0, 0.0]


def test_all_of_a_disc_at_rest_across_the_wind_is_stalled(sbs, hover):
    """At 90 m/s from below the angle of attack is beyond 30 deg even at the tip, which goes at 127 m/s."""
    snapshot = hovering(sbs, hover, wind=Wind(velocity=(0.0, 0.0, -90.0))).snapshot()
    assert all(state.stalled_share == pytest.approx(1.0) for state in states(snapshot))


def test_mirrored_wind_mirrors_what_the_rotors_do(sbs, hover):
    left, right = (hovering(sbs, hover, wind=Wind(velocity=(-40.0, y, -5.0))).snapshot().working for y in (-10.0, 10.0))
    np.testing.assert_allclose(left, right[::-1], atol=1e-9)
    assert not np.allclose(left, right, atol=1e-4)


def test_a_rotor_without_thrust_has_no_inflow_state(sbs, hover):
    vacuum = sbs.with_value("environment.air_density", 0.0)
    state = hovering(vacuum, hover).snapshot()
    assert [found.inflow_state for found in states(state)] == [UNLOADED, UNLOADED]


def test_air_drives_a_rotor_in_the_windmill_state(sbs, hover):
    swashplate = hover.swashplate * 0.0
    simulation = Simulation(sbs, trimmed_state(sbs, hover), swashplate, wind=Wind(velocity=(-10.0, 0.0, -12.0)))
    *_, last = held(simulation, 2.0)
    assert [state.inflow_state for state in states(last)] == [WINDMILL, WINDMILL]
    assert (last.loads[:, 1] < 0.0).all()  # torque: the shaft has to be held back


# --- results say it too -----------------------------------------------------------------------------------------


RING = [f"{name}: vortex ring state, where momentum theory does not hold" for name in ("MR1", "MR2")]
WAKE = [line.replace("vortex ring", "turbulent wake") for line in RING]
MACH = [f"{name}: tip Mach number above 0.44, where incompressible section data do not hold" for name in ("MR1", "MR2")]


def test_trims_and_all_that_is_based_on_them_say_where_the_model_does_not_hold(sbs, hover):
    """-7 m/s is about one hover inflow velocity down: the middle of the ring; -20 m/s is behind it."""
    assert hover.warnings == linearize(sbs, point=hover).warnings == ()
    ring, wake = trim(sbs, climb_rate=-7.0), trim(sbs, climb_rate=-20.0)
    assert list(ring.warnings) == RING
    assert list(wake.warnings) == WAKE
    model = linearize(sbs, point=wake)
    assert list(model.warnings) == WAKE
    assert wake.to_dict()["warnings"] == model.to_dict()["warnings"] == model.to_dict()["trim"]["warnings"] == WAKE
    found = sweep(sbs, "climb_rate", [0.0, -7.0, -60.0], linear=False)
    assert found.warnings == ((), tuple(RING), ())
    assert [point["warnings"] for point in found.to_dict()["points"]] == [[], RING, []]
    rows = list(csv.DictReader(sweep_to_csv(found).splitlines()))
    assert [row["warnings"] for row in rows] == ["", "; ".join(RING), ""]


def test_trims_by_the_two_loops_say_it_too(sbs):
    assert list(trim(sbs.with_value("rotors.speed_rpm", 2900.0), method="two_loop").warnings) == MACH


def test_a_flight_says_where_the_model_did_not_hold(sbs, hover):
    """Each line once, though it is looked for ten times a second; the air comes from below for 0.4 s."""
    assert simulate(sbs, hover, hover.controls, 0.3).warnings == ()
    gust = Wind(gust=(0.0, 0.0, -10.0), gust_delay=0.5, gust_duration=0.4)
    assert simulate(sbs, hover, hover.controls, 0.4, wind=gust).warnings == ()
    assert list(simulate(sbs, hover, hover.controls, 1.0, wind=gust).warnings) == RING
    assert list(simulate(sbs, hover, hover.controls, 1.0, wind=gust, tick=0.002, method="tsit5").warnings) == RING
    cases = [Case(sbs, hover), Case(sbs, hover, wind=gust), Case(sbs, {"airspeed": 900.0})]
    batch = simulate_batch(cases, 1.0, every=50, outputs=["u"])
    assert batch.warnings == ((), tuple(RING), ())


def test_looking_changes_no_bit(sbs, hover):
    """Ticks one by one, without a look, and 2000 of them in blocks with one every tenth."""
    wind = Wind(turbulence_intensity=(1.0, 1.0, 1.0), turbulence_seed=2)
    flight = simulate(sbs, hover, hover.controls, 2.0, tick=0.001, wind=wind)
    simulation = hovering(sbs, hover, tick=0.001, wind=wind)
    for row in flight["state"][1:]:
        simulation.advance()
        assert simulation.state.tobytes() == row.tobytes()


@pytest.mark.parametrize(("rpm", "reported"), [(2700.0, []), (2900.0, MACH), (4000.0, MACH)])
def test_mach_numbers_that_the_sections_do_not_have_are_reported(sbs, rpm, reported):
    """0.44 times 340.3 m/s is 149.7 m/s: the tips of 0.505 m go faster from 2831 rpm on."""
    fast = sbs.with_value("rotors.speed_rpm", rpm)
    point = trim(fast)
    assert [line for line in point.warnings if "Mach" in line] == reported
    snapshot = hovering(fast, point).snapshot()
    assert [line for line in warnings(fast, snapshot.working) if "Mach" in line] == reported
    expected = rpm * math.pi / 30 * 0.505 / 340.3
    for rotor, row in zip(fast.rotors, snapshot.working, strict=True):
        assert tip_mach(fast, rotor, row) == pytest.approx(expected, rel=1e-9)


def test_the_advancing_tip_and_the_speed_of_sound_count(sbs):
    point = trim(sbs, airspeed=15.0)
    tip = (2400 * math.pi / 30 * 0.505 + 15.0 * math.cos(point.pitch)) / 340.3
    assert [state.advance_ratio > 0.1 for state in states(hovering(sbs, point).snapshot())] == [True, True]
    row = hovering(sbs, point).snapshot().working[0]
    assert tip_mach(sbs, sbs.rotors[0], row) == pytest.approx(tip, rel=1e-6)
    cold = sbs.with_value("environment.speed_of_sound", 320.0)
    assert cold.parameter_hash == sbs.parameter_hash  # it changes nothing else
    assert trim(sbs, airspeed=15.0).warnings == ()
    assert list(trim(cold, airspeed=15.0).warnings) == MACH
    data = aircraft_data()
    del data["environment"]["speed_of_sound"]
    assert Aircraft.from_dict(data).environment.speed_of_sound == 340.3


def test_reynolds_numbers_that_the_table_does_not_have_are_reported(sbs):
    """In air that is ten times as viscous all sections are below 50000; in one of four times those up to 57.3 m/s.

    Those lie within 0.228 m, which is 18.6 % of the disc between the flap hinge and the tip.
    """
    line = "MR1: Reynolds number outside 50000 to 1e+06, those of the airfoil table, on more than 10% of the disc"
    for factor, least, most in ((1.0, 0.0, 0.0), (4.0, 0.17, 0.19), (10.0, 1.0, 1.0)):
        viscous = sbs.with_value("environment.kinematic_viscosity", 1.46e-5 * factor)
        point = trim(viscous)
        shares = [state.outside_share for state in states(hovering(viscous, point).snapshot())]
        assert all(least <= share <= most for share in shares), shares
        assert (line in point.warnings) == (least > 0.1)


def test_of_airfoils_along_the_span_each_has_its_own_numbers_and_its_own_stall(sbs, tmp_path):
    """An outboard table of Reynolds numbers that no section has is missed by its share of the disc alone."""
    rows = [f"{reynolds},{angle},{0.1 * angle},0.02" for reynolds in (2e6, 4e6) for angle in range(-2, 3)]
    (tmp_path / "fast.csv").write_text("\n".join(["reynolds,alpha_deg,cl,cd", *rows]) + "\n")
    outboard = {"stations": [0.8], "values": [str(tmp_path / "fast.csv")]}
    mixed = sbs.with_value("rotors[0].outboard_airfoils", outboard)
    left, right = states(hovering(mixed, trim(sbs)).snapshot())
    share = (1 - 0.8**2) * 0.505**2 / (0.505**2 - 0.075**2)
    assert left.outside_share == pytest.approx(share, abs=0.05)  # in steps of an element
    assert left.stalled_share == pytest.approx(share, abs=0.05)  # beyond 2 deg
    assert (right.outside_share, right.stalled_share) == (0.0, 0.0)
    line = "MR1: Reynolds number outside those of the airfoil tables, on more than 10% of the disc"
    assert line in warnings(mixed, hovering(mixed, trim(sbs)).snapshot().working)


def test_of_a_table_over_the_mach_number_its_range_counts_and_the_speed_of_sound_is_physics(sbs, tmp_path):
    """Tips at Mach 0.373 of a table that ends at 0.3: that is reached at 80 % of the radius, outside 36 % of the disc.

    A table that ends at 0.4 has all of the disc. The tip's Mach number itself says nothing.
    """
    found = {}
    for end in (0.3, 0.4):
        rows = [f"{mach},{angle},{0.1 * angle},0.02" for mach in (0, end) for angle in range(-12, 13, 2)]
        (tmp_path / f"to_{end}.csv").write_text("\n".join(["mach,alpha_deg,cl,cd", *rows]) + "\n")
        over_mach = sbs.with_value("rotors.airfoil", str(tmp_path / f"to_{end}.csv"))
        found[end] = trim(over_mach).warnings, states(hovering(over_mach, trim(over_mach)).snapshot())[0].outside_share
    line = "MR1: Mach number outside 0 to 0.3, those of the airfoil table, on more than 10% of the disc"
    assert line in found[0.3][0]
    inside = (0.3 * 340.3 / (2400 * math.pi / 30)) ** 2 - 0.075**2
    assert found[0.3][1] == pytest.approx(1 - inside / (0.505**2 - 0.075**2), abs=0.05)  # in steps of an element
    assert found[0.4] == ((), 0.0)
    cold = over_mach.with_value("environment.speed_of_sound", 320.0)
    assert cold.parameter_hash != over_mach.parameter_hash
    assert not any("Mach" in line for line in trim(cold).warnings)


# --- finite, and back again -------------------------------------------------------------------------------------


@pytest.mark.parametrize("air", AIRS)
def test_rotors_come_back_from_every_air(sbs, hover, air):
    """Three seconds on a stand in that air, six in calm: the thrust is that of hover again, and nothing is reported."""
    simulation = hovering(sbs, hover, wind=Wind(velocity=AIRS[air]))
    reported = set()
    for snapshot in held(simulation, 3.0):
        assert np.isfinite(snapshot.state).all()
        assert np.isfinite(snapshot.loads).all()
        assert np.isfinite(snapshot.working).all()
        reported.update(warnings(sbs, snapshot.working))
    if air in ("vortex ring", "turbulent wake", "reverse flow"):
        assert any(air in line for line in reported)
    simulation.set_wind(Wind())
    *_, last = held(simulation, 6.0)
    assert warnings(sbs, last.working) == []
    np.testing.assert_allclose(last.loads[:, 0], hovering(sbs, hover).snapshot().loads[:, 0], rtol=0.05)


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("gust", [(0, 0, 0), (GUST, 0, 0), (0, GUST, 0), (0, 0, GUST), (0, 0, -GUST)])
def test_free_flight_stays_finite_or_ends_in_words(sbs, hover, attitude, gust):
    """And a reset flies on as if nothing had been."""
    state = trimmed_state(sbs, hover)
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(*ATTITUDES[attitude])
    simulation = Simulation(sbs, state, hover.swashplate, wind=Wind(gust=gust, gust_duration=1.0))
    end = end_of(simulation, 3.0)
    assert end == "nothing" or "plausible are magnitudes up to" in end
    assert np.isfinite(simulation.state).all()
    simulation.set_wind(Wind())
    simulation.reset(trimmed_state(sbs, hover), hover.swashplate)
    for _ in range(50):
        simulation.advance()
    assert np.abs(simulation.state[: S.ATTITUDE]).max() < 1e-3  # an unstable hover, undisturbed
    assert warnings(sbs, simulation.snapshot().working) == []


@pytest.mark.parametrize("along", [0.0, 1e-9])
def test_rates_are_finite_where_no_air_goes_through_the_disc(sbs, hover, along):
    """V_T of (6.3) is nothing but its guard there: lambda = lambda0 - mu_z = 0, mu = 0."""
    simulation = hovering(sbs, hover)
    inflow = simulation.state[sbs.layout.inflow(0)]
    rotor = sbs.rotors[0]
    simulation.set_wind(Wind(velocity=(along, 0.0, -inflow[0] * rotor.speed * rotor.radius)))
    assert simulation.snapshot().working[0, W.FLOW] == pytest.approx(0.0, abs=1e-12)
    for _ in range(100):
        simulation.advance()
    assert np.isfinite(simulation.state).all()


# --- ground -----------------------------------------------------------------------------------------------------


def fall(aircraft, point, ground, attitude=(0.0, 0.0, 0.0)):
    """Fall without air until the ground ends it; the simulation and what it says."""
    vacuum = aircraft.with_value("environment.air_density", 0.0)
    state = trimmed_state(aircraft, point)
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(*attitude)
    state[S.BODY_SIZE :] = 0.0
    simulation = Simulation(vacuum, state, point.swashplate, ground_altitude=ground, lead_lag=False)
    return simulation, end_of(simulation)


@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (1.0, 0.0, math.pi / 2), (0.0, 0.5, 0.3)])
def test_a_falling_aircraft_touches_the_ground_with_its_lowest_point(sbs, hover, attitude):
    """Free fall takes sqrt(2 h / g) from the lowest of c.g. and rims."""
    _, pitch, roll = attitude
    reach = 0.0
    for rotor in sbs.rotors:
        x, y, z = rotor.hub
        down = -x * math.sin(pitch) + (y * math.sin(roll) + z * math.cos(roll)) * math.cos(pitch)
        reach = max(reach, down + rotor.radius * math.sqrt(1.0 - (math.cos(roll) * math.cos(pitch)) ** 2))
    simulation, reported = fall(sbs, hover, -2.0, attitude)
    expected = math.sqrt(2 * (2.0 - reach) / sbs.environment.gravity)
    assert simulation.time == pytest.approx(expected, abs=simulation.step_size + 2e-3)
    speed = sbs.environment.gravity * simulation.time
    assert reported == (
        f"ground contact after step {simulation.step} (t = {simulation.time:.4f} s) at {speed:.3g} m/s:"
        " the ground is at -2 m"
    )


def test_after_the_ground_a_reset_flies_on(sbs, hover):
    simulation, _ = fall(sbs, hover, -1.0)
    with pytest.raises(SimulationError, match="ground contact"):
        simulation.advance()
    simulation.reset(trimmed_state(sbs, hover), hover.swashplate)
    simulation.advance()


def test_nothing_begins_below_the_ground(sbs, hover):
    line = "state position: the aircraft reaches down to -.*: allowed is above 0 m, the ground"
    with pytest.raises(SimulationError, match=line):
        hovering(sbs, hover, ground_altitude=0.0)
    with pytest.raises(SimulationError, match="ground_altitude = nan: allowed are -inf to 1e"):
        hovering(sbs, hover, ground_altitude=math.nan)


def test_a_complete_flight_ends_at_the_same_step(sbs, hover):
    """`simulate`, tick by tick, and flown again from its events."""
    controls = hover.controls * [0.5, 1.0, 1.0, 1.0]
    simulation = hovering(sbs, hover, ground_altitude=-3.0)
    simulation.set_swashplate(sbs.mix(controls))
    start = simulation.beginning()
    flown = end_of(simulation)
    with pytest.raises(SimulationError) as whole:
        simulate(sbs, hover, controls, 10.0, ground_altitude=-3.0)
    assert str(whole.value) == flown
    with pytest.raises(SimulationError) as again:
        list(refly(sbs, [start], 10**6, **simulation.options))
    assert str(again.value) == flown
