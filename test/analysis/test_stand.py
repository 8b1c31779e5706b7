"""Trims and linear models on a stand: rest under given controls, and the motion about it (theory.md section 8.5)."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from helpers import aircraft_data, build
from scipy.linalg import expm

from sbs_sim import Aircraft, linearize, simulate, sweep, trim
from sbs_sim.analysis.floquet import floquet
from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.validation.hammond import eigenvalues
from sbs_sim.errors import AircraftError, LinearizationError, SimulationError, TrimError
from sbs_sim.flight.trimmed_state import standing_state, trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler

RUN = Path(__file__).resolve().parents[2] / "run"
G = 9.80665
SPRUNG = {"mass": [30.0, 30.0, 20.0, 3.0, 4.0, 6.0], "spring": [9e3, 8e3, 2e4, 2e3, 3e3, 4e3], "damping": [50.0] * 6}
COLLECTIVE = "controls.collective.held_deg"


@pytest.fixture(scope="module")
def hammond():
    return Aircraft.load("hammond")


def on_springs():
    """Return the side-by-side aircraft on springs in every axis, with its collective held."""
    return build(body={"stand": SPRUNG}).with_value(COLLECTIVE, 8.0)


@pytest.mark.parametrize("speed", [100.0, 200.0, 300.0])
def test_hammonds_eigenvalues_are_those_of_the_rotor_alone_on_its_stand(hammond, speed):
    """Another way to the same matrix; the states have the names of the file's axes."""
    craft = hammond.with_value("rotors.speed_rpm", speed)
    model = linearize(craft)
    assert model.state_names[:4] == ("x", "y", "u", "v")
    expected = eigenvalues({"rotors.speed_rpm": speed})
    found = np.linalg.eigvals(model.a)
    assert max(abs(found - value).min() for value in expected) < 1e-6
    assert any(mode.name.startswith("stand ") for mode in model.modes)


def test_springs_carry_what_rotors_and_blades_weigh_and_lift():
    """Down: weight of the blades less thrust; about the vertical: the sum of the shafts' torques, and both in the roll.

    The stand's own weight is balanced where it rests.
    """
    craft = on_springs()
    point = trim(craft)
    blades = sum(rotor.blades * rotor.blade_mass for rotor in craft.rotors)
    assert point.residual < 1e-9
    assert point.thrust.min() > 50.0
    assert point.position[2] == pytest.approx((blades * G - point.thrust.sum()) / 2e4, rel=1e-3)
    assert point.position[:2] == pytest.approx([0.0, 0.0], abs=1e-3)
    turning = sum(-rotor.rotation * torque for rotor, torque in zip(craft.rotors, point.torque, strict=True))
    assert point.heading == pytest.approx(turning / 4e3, abs=1e-6)
    assert point["collective"] == pytest.approx(math.radians(8.0))


def test_the_rest_is_at_rest_and_the_linear_model_tells_how_it_comes_back():
    """A flight from the rest stays there, but for what varies with the azimuth; every mode decays."""
    craft = on_springs()
    point = trim(craft)
    model = linearize(craft, point=point)
    flown = simulate(craft, point, point.controls, 0.5)
    assert np.abs(flown["down"] - point.position[2]).max() < 1e-5
    assert np.abs(flown["theta"] - point.pitch).max() < 1e-5
    assert {f"stand {axis}" for axis in S.DEFLECTIONS} <= {mode.name for mode in model.modes}
    pushed = point.simulation_state(craft.layout)
    pushed[S.POSITION + 2] += 1e-4
    flown = simulate(craft, pushed, point.controls, 0.1, method="rk4")
    state = np.zeros(len(model.state_names))
    state[model.state_names.index("z")] = 1e-4
    expected = (expm(0.1 * model.a) @ state)[model.state_names.index("z")]
    assert flown["down"][-1] - point.position[2] == pytest.approx(expected, rel=0.02)


def test_more_collective_pulls_the_stand_up_as_the_model_has_it():
    """The slope of the rest over the collective is -A^-1 B."""
    craft = on_springs()
    model = linearize(craft)
    change = -np.linalg.solve(model.a, model.b)[model.state_names.index("z"), 0]
    down = [trim(craft.with_value(COLLECTIVE, 8.0 + step)).position[2] for step in (0.05, -0.05)]
    assert (down[0] - down[1]) / math.radians(0.1) == pytest.approx(change, rel=1e-3)
    found = sweep(craft, COLLECTIVE, [4.0, 8.0], linear=False)
    assert found.points[1].trim.position[2] < found.points[0].trim.position[2] < 0.0


def test_a_locked_stand_moves_through_the_air_and_its_rotor_is_the_rotor_alone():
    """Wind tunnel: with all axes locked the trim is that of a hub in steady motion."""
    data = aircraft_data(rotors=[{"hub": [0.0, 0.0, 0.0]}])
    data["body"]["stand"] = {"free": []}
    craft = Aircraft.from_dict(data).with_value(COLLECTIVE, 6.0)
    point = trim(craft, 12.0)
    alone = IsolatedRotor(craft).steady((math.radians(6.0), 0.0, 0.0), 12.0)
    assert point.thrust[0] == pytest.approx(alone.thrust, rel=1e-9)
    names = linearize(craft, point=point).state_names
    assert names == tuple(name for name in craft.layout.linear_names if name not in S.LINEAR_BODY_NAMES)


def test_a_drive_on_a_stand_finds_its_speed():
    """A motor at a fixed throttle turns two mirrored rotors; the torque of the motor is that of the rotors."""
    data = aircraft_data()
    data["body"]["stand"] = SPRUNG
    engine = {"kind": "engine", "max_torque": 8.0, "throttle": 0.6}
    craft = Aircraft.from_dict(data | {"drives": [{"rotors": ["R1", "R2"], "engine": engine}]})
    point = trim(craft.with_value(COLLECTIVE, 8.0))
    assert point.torque.sum() == pytest.approx(0.6 * 8.0, rel=1e-9)
    assert "Omega(1)" in linearize(craft.with_value(COLLECTIVE, 8.0)).state_names


def test_a_stand_begins_at_its_rest_and_what_is_given_is_on_top():
    """Deflection and heading of the rest, a place and a heading; rotors at rest leave the stand straight."""
    data = aircraft_data()
    data["body"]["stand"] = SPRUNG
    engine = {"kind": "engine", "max_torque": 8.0, "throttle": 0.6}
    craft = Aircraft.from_dict(data | {"drives": [{"rotors": ["R1"], "engine": engine}]}).with_value(COLLECTIVE, 8.0)
    rest = trim(craft)
    assert abs(rest.heading) > 1e-6
    own = rest.simulation_state(craft.layout)
    np.testing.assert_array_equal(trimmed_state(craft, rest), own)
    moved = trimmed_state(craft, rest, position=(1.0, 2.0, 3.0), heading=0.5)
    np.testing.assert_allclose(moved[: S.ATTITUDE], own[: S.ATTITUDE] + [1.0, 2.0, 3.0])
    heading, pitch, roll = quaternion_to_euler(moved[S.ATTITUDE : S.VELOCITY])
    np.testing.assert_allclose((heading, pitch, roll), (rest.heading + 0.5, rest.pitch, rest.roll), atol=1e-12)
    straight = standing_state(craft, rotor_speed=0.0)
    np.testing.assert_allclose(trimmed_state(craft, rest, rotor_speed=0.0)[: S.VELOCITY], straight[: S.VELOCITY])
    raised = craft.with_values({"controls.lateral_cyclic.range_deg": [2.0, 12.0]})
    assert trim(raised).beyond_limits == ()
    assert trim(raised)["lateral_cyclic"] == pytest.approx(math.radians(2.0))


def test_a_rotor_alone_is_said_to_need_a_stand():
    with pytest.raises(TrimError, match=r"^no trim: a rotor alone .* body\.stand holds its hub"):
        trim(build(rotors=[{}]))


def test_what_a_stand_does_not_allow_is_refused_in_a_line(hammond, sbs, hover):
    point = trim(hammond)
    free = build(body={"stand": {**SPRUNG, "spring": [9e3, 8e3, 0.0, 2e3, 3e3, 4e3]}})
    for call, text in (
        (lambda: trim(hammond, 3.0), "^airspeed = 3: allowed is 0 on a stand that is free in x, y"),
        (lambda: trim(hammond, method="two_loop"), "^method = 'two_loop': allowed on a stand is newton"),
        (lambda: trim(hammond, guess=hover), "^guess: allowed on a stand is a trim on it"),
        (lambda: trim(free), "^no rest on the stand: z is free without a spring, and has an acceleration"),
        (lambda: IsolatedRotor(driven_rotor()), r"^drives\[0\]\.engine\.kind = "),
    ):
        with pytest.raises(TrimError, match=text):
            call()
    for call, text in (
        (lambda: linearize(hammond, point=point).quasi_static(), r"^body\.stand: "),
        (lambda: linearize(hammond, point=point, method="paper"), "^method = 'paper'"),
        (lambda: floquet(hammond, point), r"^body\.stand: .*IsolatedRotor.exponents"),
    ):
        with pytest.raises(LinearizationError, match=text):
            call()
    with pytest.raises(SimulationError, match=r"^body\.stand: allowed on a stand is a start from a trim on it"):
        simulate(hammond, hover, hover.controls, 0.1)
    with pytest.raises(AircraftError, match="controls: allowed are 4 that trims find"):
        sbs.with_value(COLLECTIVE, 5.0)
    assert linearize(hammond, point=point).control_effects == ()


def driven_rotor():
    """Return a rotor with an engine."""
    return Aircraft.from_dict(
        aircraft_data(rotors=[{}]) | {"drives": [{"rotors": ["R1"], "engine": {"kind": "engine", "max_torque": 8.0}}]}
    )


def test_the_command_prints_the_rest():
    """With the deflections, and no effects of controls."""
    command = [str(RUN), "trim", "--aircraft", "hammond"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    assert "yaw [deg]" in result.stdout
