"""Layout of the state vectors: names, units, places, and the way between the two vectors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.state import (
    ATTITUDE,
    BODY_SIZE,
    CONTROL_NAMES,
    LINEAR_BODY_SIZE,
    POSITION,
    RATES,
    SWASHPLATE_NAMES,
    VELOCITY,
    StateLayout,
    multiblade_suffixes,
)

# Eq. [18] of the paper: [u w q theta v p phi r | beta(1) beta(2) | dbeta(1) dbeta(2) | xi(1) xi(2) | dxi(1) dxi(2) |
# lambda(1) lambda(2)], beta = (a0, a1, b1), xi = (xi0, xic, xis), lambda = (lambda0, lambdas, lambdac).
PAPER_BODY = "u w q theta v p phi r"
PAPER_ROTORS = (
    "a0(1) a1(1) b1(1) a0(2) a1(2) b1(2) "
    "da0(1) da1(1) db1(1) da0(2) da1(2) db1(2) "
    "xi0(1) xic(1) xis(1) xi0(2) xic(2) xis(2) "
    "dxi0(1) dxic(1) dxis(1) dxi0(2) dxic(2) dxis(2) "
    "lambda0(1) lambdas(1) lambdac(1) lambda0(2) lambdas(2) lambdac(2)"
)
BLADES = [(3, 3), (4,), (5, 3), (3, 4, 5), (6, 7)]


def test_the_38_states_are_in_the_papers_order():
    layout = StateLayout((3, 3))
    assert layout.linear_size == 38
    assert " ".join(layout.linear_names) == f"{PAPER_BODY} {PAPER_ROTORS}"
    rad, rate = ["rad"] * 6, ["rad/s"] * 6
    body = ["m/s", "m/s", "rad/s", "rad", "m/s", "rad/s", "rad", "rad/s"]
    assert list(layout.linear_units) == body + rad + rate + rad + rate + ["1"] * 6


def test_the_simulation_state_has_43_values():
    layout = StateLayout((3, 3))
    assert layout.size == 43
    assert " ".join(layout.names[:BODY_SIZE]) == "north east down qw qx qy qz u v w p q r"
    assert (POSITION, ATTITUDE, VELOCITY, RATES) == (0, 3, 7, 10)
    assert " ".join(layout.names[BODY_SIZE:]) == PAPER_ROTORS


def test_names_of_controls():
    assert " ".join(CONTROL_NAMES) == ("collective lateral_cyclic longitudinal_cyclic differential_longitudinal_cyclic")
    assert " ".join(SWASHPLATE_NAMES) == "collective lateral_cyclic longitudinal_cyclic"


@pytest.mark.parametrize(
    ("blades", "suffixes", "flap", "lag"),
    [
        (3, "0 c s", "a0 a1 b1", "xi0 xic xis"),
        (4, "0 c s d", "a0 a1 b1 ad", "xi0 xic xis xid"),
        (5, "0 c s 2c 2s", "a0 a1 b1 a2 b2", "xi0 xic xis xi2c xi2s"),
        (6, "0 c s 2c 2s d", "a0 a1 b1 a2 b2 ad", "xi0 xic xis xi2c xi2s xid"),
        (7, "0 c s 2c 2s 3c 3s", "a0 a1 b1 a2 b2 a3 b3", "xi0 xic xis xi2c xi2s xi3c xi3s"),
    ],
)
def test_multiblade_names(blades, suffixes, flap, lag):
    assert " ".join(multiblade_suffixes(blades)) == suffixes
    layout = StateLayout((blades,))
    names = np.array(layout.names)
    assert list(names[layout.flap(0)]) == [f"{name}(1)" for name in flap.split()]
    assert list(names[layout.flap_rate(0)]) == [f"d{name}(1)" for name in flap.split()]
    assert list(names[layout.lag(0)]) == [f"{name}(1)" for name in lag.split()]
    assert list(names[layout.lag_rate(0)]) == [f"d{name}(1)" for name in lag.split()]
    assert list(names[layout.inflow(0)]) == ["lambda0(1)", "lambdas(1)", "lambdac(1)"]


@pytest.mark.parametrize("blades", BLADES)
def test_indices_cover_the_state_once(blades):
    layout = StateLayout(blades)
    assert layout.blade_count == sum(blades)
    assert layout.size == BODY_SIZE + 4 * sum(blades) + 3 * len(blades)
    assert layout.linear_size == LINEAR_BODY_SIZE + 4 * sum(blades) + 3 * len(blades)
    parts = (layout.flap, layout.flap_rate, layout.lag, layout.lag_rate, layout.inflow)
    index = np.arange(layout.size)
    places = [index[part(rotor)] for part in parts for rotor in range(len(blades))]
    assert np.concatenate(places).tolist() == list(range(BODY_SIZE, layout.size))
    for rotor, count in enumerate(blades):
        assert [len(index[part(rotor)]) for part in parts] == [count] * 4 + [3]


@pytest.mark.parametrize("blades", BLADES)
def test_every_state_has_one_name_and_a_unit(blades):
    layout = StateLayout(blades)
    assert len(set(layout.names)) == len(layout.names) == layout.size
    assert len(set(layout.linear_names)) == len(layout.linear_names) == layout.linear_size
    assert len(layout.linear_units) == layout.linear_size
    units = dict(zip(layout.linear_names, layout.linear_units, strict=True))
    for name, unit in units.items():
        expected = "1" if name.startswith("lambda") else "rad/s" if name.startswith("d") else "rad"
        expected = {"u": "m/s", "v": "m/s", "w": "m/s", "p": "rad/s", "q": "rad/s", "r": "rad/s"}.get(name, expected)
        assert unit == expected, name


def test_the_linear_state_of_a_simulation_state():
    layout = StateLayout((3, 4))
    state = np.arange(1.0, layout.size + 1)
    state[ATTITUDE:VELOCITY] = euler_to_quaternion(0.7, 0.2, -0.3)
    linear = dict(zip(layout.linear_names, layout.to_linear(state), strict=True))
    named = dict(zip(layout.names, state, strict=True))
    assert linear.pop("theta") == pytest.approx(0.2, abs=1e-15)
    assert linear.pop("phi") == pytest.approx(-0.3, abs=1e-15)
    assert linear == {name: named[name] for name in linear}


@given(st.sampled_from(BLADES), st.data())
def test_linear_state_to_simulation_state_and_back(blades, data):
    layout = StateLayout(blades)
    size = layout.linear_size
    linear = np.array(data.draw(st.lists(st.floats(-100, 100), min_size=size, max_size=size)))
    theta, phi = layout.linear_names.index("theta"), layout.linear_names.index("phi")
    linear[theta] *= 0.0156  # within a right angle
    linear[phi] *= 0.0314  # within half a turn
    heading = data.draw(st.floats(-math.pi, math.pi))
    state = layout.from_linear(linear, heading)
    assert state.shape == (layout.size,)
    np.testing.assert_array_equal(state[POSITION:ATTITUDE], 0.0)
    expected = euler_to_quaternion(heading, linear[theta], linear[phi])
    np.testing.assert_array_equal(state[ATTITUDE:VELOCITY], expected)
    back = layout.to_linear(state)
    np.testing.assert_allclose(back, linear, atol=1e-9)
    exact = np.delete(np.arange(size), [theta, phi])
    np.testing.assert_array_equal(back[exact], linear[exact])
