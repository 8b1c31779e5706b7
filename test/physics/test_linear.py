"""The Jacobian of the model in the coordinates of the linear state, and the average, one evaluation at a time."""

import numpy as np
import pytest
from helpers import Model, build

from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.linear import SPECIFIC_FORCE_SIZE, jacobian

COLUMNS = ("w", "q", "theta", "phi", "r", "b1(1)", "xi0(2)", "dxic(2)", "lambda0(1)", "lambdac(2)")


@pytest.fixture(scope="module")
def model():
    """Two rotors that differ, few elements."""
    return Model(build(options={"elements": 2}, rotors=[{}, {"blades": 4, "speed_rpm": 2300.0}]))


@pytest.fixture(scope="module")
def point(model):
    """Linear state and pilot controls, far from any trim."""
    rng = np.random.default_rng(8)
    body = [5.0, 1.0, -0.2, 0.15, -2.0, 0.3, -0.25, 0.4]
    rotors = 0.03 * rng.standard_normal(model.layout.linear_size - S.LINEAR_BODY_SIZE)
    return np.concatenate([body, rotors, [0.15, 0.02, -0.01, 0.03]])


def outputs(model, point, psi):
    """Rates of the linear state, specific force and loads, by the derivative of the simulation state."""
    state, controls = point[:-4], point[-4:]
    x = model.layout.from_linear(state)
    dx = model.derivative(x, model.aircraft.mix(controls), psi)
    rates = model.layout.to_linear(dx)  # but for the attitude's
    _, _, q, theta, _, p, phi, r = state[: S.LINEAR_BODY_SIZE]
    # rates of the Euler angles are those that these columns, their axes in the body, make the body rates of
    sine, cosine = np.sin(phi), np.cos(phi)
    matrix = np.array([[1, 0, -np.sin(theta)], [0, cosine, sine * np.cos(theta)], [0, -sine, cosine * np.cos(theta)]])
    rates[S.LINEAR_PHI], rates[S.LINEAR_THETA], _ = np.linalg.solve(matrix, [p, q, r])
    # what accelerometers feel: acceleration without gravity, in axes that turn
    gravity = model.aircraft.environment.gravity
    down = gravity * np.array([-np.sin(theta), sine * np.cos(theta), cosine * np.cos(theta)])
    force = dx[S.VELOCITY : S.RATES] + np.cross(x[S.RATES : S.BODY_SIZE], x[S.VELOCITY : S.RATES]) - down
    return np.concatenate([rates, force, model.loads.ravel()])


def jacobians(model, point, steps, psi):
    """Transposed Jacobians; NaN where nothing is written."""
    engine, layout = model.points, model.layout
    rotors = [S.part_of(name).rotor for name in layout.linear_names] + [-1] * len(S.CONTROL_NAMES)
    owners = np.array([2 if rotor < 0 else rotor for rotor in rotors])
    size = layout.linear_size + SPECIFIC_FORCE_SIZE + 2 * R.LOAD_SIZE
    found = np.full((len(psi), len(point), size), np.nan)
    jacobian(
        *(engine.code.derivative, engine.model, point, model.aircraft.rigging, steps, owners, psi),
        *(engine.work, engine.tick, engine.memory(len(point)), np.empty((2, size))),
        *(np.empty(engine.n, dtype=np.int64), found),
    )
    return found


def test_jacobian_is_the_difference_of_the_outputs(model, point):
    """Column by column, those of body, rotors and controls; a column without a step is left alone."""
    psi, step = np.array([[0.7, 3.9]]), 1e-5
    names = [*model.layout.linear_names, *S.CONTROL_NAMES]
    chosen = [names.index(name) for name in (*COLUMNS, S.CONTROL_NAMES[3])]
    steps = np.zeros(len(point))
    steps[chosen] = step
    given = point.copy()
    found = jacobians(model, given, steps, psi)
    np.testing.assert_array_equal(given, point)
    for i in chosen:
        moved = step * np.eye(len(point))[i]
        expected = (outputs(model, point + moved, psi[0]) - outputs(model, point - moved, psi[0])) / (2 * step)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[0, i], expected, rtol=1e-6, atol=1e-9 * scale, err_msg=names[i])
    assert np.isnan(np.delete(found[0], chosen, axis=0)).all()


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 12])
def test_jacobians_are_the_same_for_any_number_of_azimuths(model, point, count):
    """To the last bit: a lane tells nothing of its neighbours, and a blade nothing of what was worked out before."""
    steps, psi = np.full(len(point), 1e-4), azimuths((3, 4), count)
    alone = [
        [jacobians(model, point, own, psi[k : k + 1])[0, i] for i, own in enumerate(np.diag(steps))]
        for k in range(count)
    ]
    np.testing.assert_array_equal(jacobians(model, point, steps, psi), alone)


def test_average_is_the_mean_over_the_azimuths(model, point):
    """Configuration k of N has the first blade at the share k/N of the way to where the rotor is the same again.

    That is the next blade of three, and the one after the next of four, for the differential coordinate.
    """
    x, swash, count = model.layout.from_linear(point[:-4]), model.aircraft.mix(point[-4:]), 3
    rates, loads = [], []
    for k in range(count):
        psi = [2 * np.pi * k / (passages * count) for passages in (3, 2)]
        np.testing.assert_allclose(azimuths((3, 2), count)[k], psi, rtol=1e-15)
        rates.append(model.derivative(x, swash, psi))
        loads.append(model.loads.copy())
    found, found_loads = model.averaged(x, swash, count)
    np.testing.assert_allclose(found, np.mean(rates, axis=0), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(found_loads, np.mean(loads, axis=0), rtol=1e-11, atol=1e-11)
