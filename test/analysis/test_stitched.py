"""Stitched models: exact at their anchors, near the full model between them and in manoeuvres."""

import math

import numpy as np
import pytest

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.analysis.stitched import local_model, stitch
from sbs_sim.commands.stitch import main
from sbs_sim.errors import ExportError, LinearizationError, SimulationError
from sbs_sim.flight.stitched_file import load, save
from sbs_sim.flight.stitched_simulation import StitchedSimulation, simulate_stitched
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, to_body
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.piloted_flight import simulate_with_pilot
from sbs_sim.pilot.stitched_check import Manoeuvre, SpeedPilot, manoeuvre_differences

AIRSPEEDS = (-2.0, 0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0)
ATTITUDE = [S.LINEAR_THETA, S.LINEAR_PHI]


@pytest.fixture(scope="module")
def aircraft():
    return Aircraft.load("sbs")


@pytest.fixture(scope="module")
def complete(aircraft):
    """Model with all 38 states."""
    return stitch(aircraft, AIRSPEEDS)


@pytest.fixture(scope="module")
def rigid(aircraft):
    """Model of the body alone, in rows of climb."""
    return stitch(aircraft, AIRSPEEDS, states="body", climb_rates=[-1.0, 0.0, 2.0])


@pytest.fixture
def disturbed(aircraft, rigid):
    """State and swashplate angles far from any trim, between the rows of climb."""
    state, swash = rigid.trim(3.0)
    state[S.VELOCITY : S.BODY_SIZE] += [0.3, 0.4, -0.7, 0.2, -0.1, 0.15]
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(0.4, 0.25, -0.35)
    return state, swash + 0.01 * np.random.default_rng(1).standard_normal(swash.shape)


@pytest.mark.parametrize("airspeed", [0.0, 10.0])
@pytest.mark.parametrize("which", ["complete", "rigid"])
def test_anchors_are_exact(aircraft, which, airspeed, request):
    model, full = request.getfixturevalue(which), linearize(aircraft, airspeed)
    state, swash = model.trim(airspeed)
    assert state == pytest.approx(aircraft.layout.from_linear(full.trim.state), abs=1e-14)
    assert swash == pytest.approx(full.trim.swashplate, abs=1e-14)
    rates, outputs = model.rates(state, swash)
    assert abs(rates[S.ATTITUDE :]).max() < 1e-12
    loads = outputs[:16].reshape(2, 8)
    assert loads[:, 0] == pytest.approx(full.trim.thrust)
    assert loads[:, 1] == pytest.approx(full.trim.torque)
    linear = full if which == "complete" else full.quasi_static()
    local = local_model(model, state, swash)
    assert local.state_names == linear.state_names
    assert local.control_names == linear.control_names
    others = np.delete(np.arange(len(linear.a)), ATTITUDE)
    assert local.a[:, others] == pytest.approx(linear.a[:, others], rel=1e-12, abs=1e-12)
    assert local.a[:, ATTITUDE] == pytest.approx(linear.a[:, ATTITUDE], abs=3e-6)  # what its differences cut off
    assert local.b == pytest.approx(linear.b, rel=1e-11, abs=1e-8)


def test_it_is_near_the_full_model_between_anchors(aircraft, complete):
    full = linearize(aircraft, 7.0)
    state, swash = complete.trim(7.0)
    assert state == pytest.approx(aircraft.layout.from_linear(full.trim.state), abs=3e-5)
    assert abs(complete.rates(state, swash)[0][S.VELOCITY :]).max() < 3e-6
    body, linear = local_model(complete, state, swash), full
    assert body.a[:8] == pytest.approx(linear.a[:8], abs=2e-3 * abs(linear.a[:8]).max())


def test_linear_models_are_the_derivative_of_its_rates(aircraft, rigid, disturbed):
    state, swash = disturbed
    local = local_model(rigid, state, swash)
    linear = aircraft.layout.to_linear(state)

    def rates(values, angles):
        x = state.copy()
        u, w, q, theta, v, p, phi, r = values
        x[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(0.0, theta, phi)
        x[S.VELOCITY : S.BODY_SIZE] = u, v, w, p, q, r
        dx = rigid.rates(x, angles)[0]
        du, dv, dw, dp, dq, dr = dx[S.VELOCITY :]
        turn = (q * math.sin(phi) + r * math.cos(phi)) / math.cos(theta)
        pitch = q * math.cos(phi) - r * math.sin(phi)
        return np.array([du, dw, dq, pitch, dv, dp, p + turn * math.sin(theta), dr])

    for i, step in enumerate([1e-4] * 8):
        change = step * np.eye(8)[i]
        column = (rates(linear[:8] + change, swash) - rates(linear[:8] - change, swash)) / (2 * step)
        assert local.a[:, i] == pytest.approx(column, abs=1e-5), local.state_names[i]
    for i in range(4):
        change = aircraft.mixing[:, i].reshape(swash.shape) * 1e-3
        column = (rates(linear[:8], swash + change) - rates(linear[:8], swash - change)) / 2e-3
        assert local.b[:, i] == pytest.approx(column, abs=1e-6)


def test_gravity_and_kinematics_hold_at_any_attitude(aircraft, rigid, disturbed):
    """The same motion relative to the air at two attitudes differs by the direction of gravity alone."""
    state, swash = disturbed
    gravity = np.array([[0.0, 0.0, aircraft.environment.gravity]])
    felt = []
    for angles in ((0.0, 0.25, -0.35), (2.0, -1.2, 3.0)):
        state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(*angles)
        rates = rigid.rates(state, swash)[0]
        pull = to_body(state[np.newaxis, S.ATTITUDE : S.VELOCITY], gravity)[0]
        felt.append(np.append(rates[S.VELOCITY : S.RATES] - pull, rates[S.RATES :]))
        assert np.linalg.norm(rates[:3]) == pytest.approx(np.linalg.norm(state[S.VELOCITY : S.RATES]))
    assert felt[0] == pytest.approx(felt[1], abs=1e-12)


def test_steady_wind_gives_the_same_motion_relative_to_the_air(aircraft, complete):
    wind = np.array([3.0, -2.0, 0.5])
    controls = complete.aircraft.unmix(complete.trim(6.0)[1]) + np.radians([0.2, 0.1, 0.2, -0.1])
    still = simulate_stitched(complete, 6.0, controls, 1.0)
    blown = simulate_stitched(complete, 6.0, controls, 1.0, wind=Wind(velocity=tuple(wind)))
    for name in ("phi", "theta", "psi", "p", "q", "r", "thrust", "V"):
        assert blown[name] == pytest.approx(still[name], abs=1e-9), name
    drift = blown["state"][:, :3] - still["state"][:, :3]
    assert drift == pytest.approx(np.outer(still["time"], wind), abs=1e-9)


def test_mirrored_controls_give_the_mirrored_flight(aircraft):
    symmetric = aircraft.with_values({"body.inertia[0][1]": 0.0, "body.inertia[1][2]": 0.0})
    model = stitch(symmetric, [4.0, 6.0, 8.0])
    held = symmetric.unmix(model.trim(6.0)[1])
    pulse = np.radians([0.0, 0.5, 0.0, 0.3])
    right, left = (simulate_stitched(model, 6.0, held + sign * pulse, 1.0) for sign in (1.0, -1.0))
    for name in ("v", "p", "r", "phi"):
        assert right[name] == pytest.approx(-left[name], abs=1e-7)
    for name in ("u", "w", "q", "theta"):
        assert right[name] == pytest.approx(left[name], abs=1e-7)
    assert np.ptp(right["phi"]) > 0.05


@pytest.mark.parametrize("control", range(4))
def test_responses_are_those_of_the_full_model(aircraft, complete, control):
    point, ticks = trim(aircraft, 6.0), 100
    controls = np.tile(point.controls, (ticks + 1, 1))
    controls[10:40, control] += math.radians(0.5)
    controls[40:70, control] -= math.radians(0.5)
    full, stitched = simulate(aircraft, point, controls, 1.0), simulate_stitched(complete, point, controls, 1.0)
    moved = {0: ("w",), 1: ("p", "phi"), 2: ("q", "theta"), 3: ("r",)}[control]
    for name in moved:
        assert abs(full[name] - stitched[name]).max() < 0.05 * np.ptp(full[name]), name


MANOEUVRES = (
    Manoeuvre("acceleration", 0.0, 4.0, lambda t: min(2.0 * t, 10.0), lambda t: 0.0),
    Manoeuvre("quick stop", 10.0, 4.0, lambda t: max(10.0 - 3.0 * t, 0.0), lambda t: 0.0),
    Manoeuvre("turn", 8.0, 4.0, lambda t: 8.0, lambda t: math.radians(20.0) * min(t, 1.0)),
)


@pytest.mark.parametrize("which", ["complete", "rigid"])
def test_manoeuvres_are_those_of_the_full_model(rigid, which, request):
    """Under the same pilot, to a few hundredths of a metre per second and a fifth of a degree."""
    model = request.getfixturevalue(which)
    for one in manoeuvre_differences(model, MANOEUVRES, SpeedPilot(rigid)):
        assert one.velocity < 0.04, one
        assert one.attitude < 0.004, one
        assert one.controls < math.radians(0.3), one
        assert max(one.pitch, one.roll) > math.radians(8.0), one


def test_ticks_one_by_one_are_the_same_flight(aircraft, rigid):
    state, swash = rigid.trim(4.0)
    wind = Wind(velocity=(1.0, 0.0, 0.0), gust=(0.0, 2.0, 0.0), gust_duration=0.2, turbulence_intensity=(0.5, 0.5, 0.5))
    one, other = (StitchedSimulation(rigid, state, swash, wind=wind) for _ in range(2))
    for _ in range(30):
        one.advance()
    rows = other.fly(np.tile(swash, (31, 1, 1)), 30).rows
    assert np.array_equal(one.state, other.state)
    last = one.snapshot()
    assert np.array_equal(last.state, rows.state[-1])
    assert last.step == rows.step[-1]
    assert last.acceleration == pytest.approx(rows.acceleration[-1], abs=1e-12)
    assert last.wind == pytest.approx(rows.wind[-1], abs=1e-15)


def test_a_ground_ends_the_flight(rigid):
    state, swash = rigid.trim(0.0)
    state[S.DOWN] = -1.0
    simulation = StitchedSimulation(rigid, state, swash - np.array([0.05, 0.0, 0.0]), ground_altitude=0.0)
    flown = simulation.fly(np.tile(simulation.swashplate, (1000, 1, 1)), 1000)
    assert "ground contact" in str(flown.fault)
    assert -1.0 < simulation.state[S.DOWN] < 0.5


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"ground.effect": "cheeseman_bennett", "ground.altitude": -5.0}, "ground.effect"),
        ({"rotors.blades": 2}, "2 blades"),
    ],
)
def test_what_it_cannot_describe_is_refused(aircraft, values, message):
    with pytest.raises(LinearizationError, match=message):
        stitch(aircraft.with_values(values), [0.0, 2.0])


@pytest.mark.parametrize(
    ("airspeeds", "options", "message"),
    [
        ([2.0], {}, "airspeeds has shape"),
        ([2.0, 0.0], {}, "rising"),
        ([0.0, 60.0], {}, "airspeed = 60"),
        ([0.0, 2.0], {"states": ["lambda9"]}, "lambda9"),
        ([0.0, 2.0], {"states": "some"}, "states = 'some'"),
    ],
)
def test_wrong_arguments_are_refused(aircraft, airspeeds, options, message):
    with pytest.raises(LinearizationError, match=message):
        stitch(aircraft, airspeeds, **options)


def test_air_that_is_not_the_same_everywhere_is_refused(rigid):
    with pytest.raises(SimulationError, match="same everywhere"):
        simulate_stitched(rigid, 0.0, None, 1.0, wind=Wind(velocity=(3.0, 0.0, 0.0), wind_profile="logarithmic"))
    with pytest.raises(SimulationError, match="no engines"):
        StitchedSimulation(rigid, *rigid.trim(0.0)).fail_engine()
    with pytest.raises(SimulationError, match="another aircraft"):
        simulate_with_pilot(
            rigid.aircraft.with_value("body.mass", 20.0), rigid.trim(0.0)[0], lambda t, x: np.zeros(4), 1.0, model=rigid
        )


def test_a_file_gives_back_the_model(rigid, disturbed, tmp_path):
    path = tmp_path / "model.npz"
    save(rigid, path)
    again = load(path)
    assert again == rigid
    assert np.array_equal(again.rates(*disturbed)[0], rigid.rates(*disturbed)[0])
    again.aircraft.files()  # it can be written once more
    with np.load(path) as file:  # anybody can read it
        assert file["z_names"].tolist()[-1] == f"{rigid.aircraft.rotors[-1].name} longitudinal_cyclic"
        assert len(file["z_units"]) == file["matrices"].shape[-1]
        assert len(file["output_names"]) == len(file["output_units"]) == file["output_trims"].shape[-1]
    with pytest.raises(ExportError, match="npz"):
        save(rigid, tmp_path / "model.txt")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": np.array("something else")}, "format = 'something else'"),
        ({"matrices": np.full((3, 8, 6, 12), np.nan)}, "matrices is not finite"),
        ({"matrices": np.zeros((3, 8, 6, 11))}, "matrices has shape"),
        ({"inputs": np.array([0, 1, 2, 3, 4, 6])}, "inputs: allowed are"),
        ({"kept": np.array(["lambda9"])}, "kept names a state"),
        ({"parameter_hash": np.array("0")}, "hash differs"),
        ({"format_version": np.array(2)}, "format_version = 2"),
        ({"residuals": None}, "residuals is missing"),
    ],
)
def test_other_files_are_refused(rigid, tmp_path, change, message):
    path = tmp_path / "model.npz"
    save(rigid, path)
    with np.load(path) as file:
        contents = {name: file[name] for name in file.files} | change
    np.savez(path, **{name: values for name, values in contents.items() if values is not None})
    with pytest.raises(SimulationError, match=message):
        load(path)


def test_what_is_no_file_of_a_model_is_refused(tmp_path):
    with pytest.raises(SimulationError, match="cannot be read"):
        load(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("no model")
    with pytest.raises(SimulationError, match="no file of a stitched model"):
        load(tmp_path / "text.npz")


def test_the_command_writes_a_file_and_says_how_good_it_is(aircraft, tmp_path, monkeypatch, capsys):
    path = tmp_path / "model.npz"
    words = ["stitch", "4", "8", "3", "--states", "body", "--workers", "1", "--out", str(path)]
    monkeypatch.setattr("sys.argv", words)
    monkeypatch.setattr("sbs_sim.commands.common._behave_on_a_terminal", lambda: None)
    assert main() == 0
    printed = capsys.readouterr().out
    assert "stitched model of sbs: 3 airspeeds, 4 to 8 m/s" in printed
    rows = [line.split() for line in printed.splitlines() if line.strip().startswith(("5 ", "7 "))]
    assert len(rows) == 2
    for row in rows:
        assert all(float(value) < 1e-5 for value in row[2:4])  # trim, m/s^2 and rad/s^2
        assert all(float(value) < 10.0 for value in row[-4:])  # % of a response
    table = printed[printed.index("manoeuvres under the same pilot") :].splitlines()[2:5]
    assert [line.split("  ")[0] for line in table] == ["acceleration", "quick stop", "turn"]
    assert all(float(line.split()[-4]) < 0.1 for line in table)  # m/s
    assert load(path) == stitch(aircraft, [4.0, 6.0, 8.0], states="body")
