"""Steps in time: order, agreement of the methods, flights that are repeated, bounded, and answer rightly."""

import math

import numpy as np
import pytest
from helpers import Model, build, linear_airfoil, wind_velocity
from scipy.linalg import expm
from test_conservation import ONE_SECOND, PSI, STEP, differences, disturbed

from sbs_sim import Aircraft, Simulation, linearize, simulate, trim
from sbs_sim.errors import SimulationError
from sbs_sim.flight.rotor_matrices import rotor_matrices
from sbs_sim.flight.simulation import METHODS
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model import wind as W
from sbs_sim.model.exponential import coefficients
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.integrate import CLASSICAL, ETD, PARTITIONED, RK4, TSIT5, TSITOURAS

QUARTER = 0.25  # s, ten revolutions
FIVE_DEG = 720  # steps of 5 deg in that time


@pytest.fixture(scope="module")
def smooth_model(tmp_path_factory):
    """The aircraft with an airfoil table without kinks in use, which would cost the order."""
    airfoil = linear_airfoil(tmp_path_factory.mktemp("airfoils") / "plain.csv")
    return Model(build(every_rotor={"airfoil": airfoil}))


def flights(model, hover, refinements, method=RK4):
    """Return the states after a quarter of a second with steps of 5 deg / refinement."""
    x, swash = disturbed(model, hover)
    counts = [round(FIVE_DEG * k) for k in refinements]
    return [model.fly(x, count, QUARTER / count, swash, method=method) for count in counts]


def changes(states):
    """Return the largest differences of successive states."""
    return np.abs(np.diff(states, axis=0)).max(axis=1)


# -- order ---------------------------------------------------------------------------------------------------


def test_runge_kutta_is_of_fourth_order(smooth_model, hover):
    """Half the step, a sixteenth of the change."""
    change = changes(flights(smooth_model, hover, (1, 2, 4, 8)))
    np.testing.assert_allclose(change[:-1] / change[1:], 16.0, atol=1.0)


def test_tsitouras_is_of_fifth_order(smooth_model, hover):
    """Half the step, a thirty-second of the change, to the solution of the other method."""
    coarse = flights(smooth_model, hover, (1, 2, 4), TSIT5)
    change = changes(coarse)
    np.testing.assert_allclose(change[:-1] / change[1:], 32.0, atol=4.0)
    np.testing.assert_allclose(coarse[-1], flights(smooth_model, hover, (16,))[0], atol=1e-8)


def test_exponential_steps_are_of_fourth_order(smooth_model, hover):
    """Half the step, a sixteenth of the change, to the solution of the other methods."""
    coarse = flights(smooth_model, hover, (0.5, 1, 2, 4), ETD)
    change = changes(coarse)
    np.testing.assert_allclose(change[1:-1] / change[2:], 16.0, atol=2.0)
    np.testing.assert_allclose(coarse[-1], flights(smooth_model, hover, (16,))[0], atol=1e-8)


def test_long_exponential_steps_are_as_good_as_short_classical_ones(sbs, hover):
    """In steps of 14.4 deg the error of every state is the smaller one, for a third of the derivatives."""
    fine, coarse = flights(Model(sbs), hover, (16, 1))
    exponential = flights(Model(sbs), hover, (5.0 / 14.4,), ETD)[0]
    assert np.abs(exponential - fine).max() < np.abs(coarse - fine).max()


def test_long_steps_of_fifth_order_are_as_good_as_short_ones_of_fourth(sbs, hover):
    """Six stages in 12 deg cost as much as four in 8 deg; the error of every state is the smaller one."""
    fine = flights(Model(sbs), hover, (16,))[0]
    x, swash = disturbed(Model(sbs), hover)
    fifth, fourth = (
        np.abs(Model(sbs).fly(x, steps, QUARTER / steps, swash, method=method) - fine).max()
        for steps, method in ((300, TSIT5), (450, RK4))
    )
    assert fifth < 0.2 * fourth


# -- the steps as in a textbook ------------------------------------------------------------------------------


class Disturbed:
    """Anything but a trim, in air that changes within the tick: steps that can be followed by hand."""

    psi0, first_step, steps, h = np.array([0.4, 5.1]), 7, 2, 4e-4
    swash = np.array([[0.1, 0.02, -0.03], [0.12, -0.01, 0.04]])

    def __init__(self):
        self.model = Model(build(options={"elements": 3}))
        rng = np.random.default_rng(6)
        self.x = self.model.state((4.0, -1.0, 2.0), (0.3, -0.2, 0.5), 0.04)
        self.x[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(0.5, 0.2, -0.3)
        self.x[S.BODY_SIZE :] += 0.02 * rng.standard_normal(self.x.size - S.BODY_SIZE)
        self.air = np.zeros(W.WIND_SIZE)
        self.air[W.STEADY : W.STEADY + 3] = 1.0, 2.0, -0.5
        self.air[W.GUST : W.GUST + 3], self.air[W.GUST_START], self.air[W.GUST_DURATION] = 3.0, 0.002, 0.004
        self.air[W.TURBULENCE_FROM : W.TURBULENCE_FROM + 3] = 0.5, -0.4, 0.3
        self.air[W.TURBULENCE_TO : W.TURBULENCE_TO + 3] = -0.2, 0.6, 0.1

    def slope(self, x, ahead):
        """Derivative so many steps after the first of the tick."""
        psi = self.psi0 + self.model.speeds * self.h * (self.first_step + ahead)
        air = wind_velocity(self.air, self.h * (self.first_step + ahead), ahead / self.steps)
        return self.model.derivative(x, self.swash, psi, air)

    def flown(self, method, bounds=None):
        """Steps made, the failed state, and the state after a tick of `advance`."""
        bounds = np.full(self.x.size + 1, np.inf) if bounds is None else bounds
        numbers = (self.first_step, self.steps, self.h)
        return self.model.tick(self.x, self.swash, self.psi0, *numbers, self.air, method, bounds)


def unit_attitude(x):
    x[S.ATTITUDE : S.VELOCITY] /= np.linalg.norm(x[S.ATTITUDE : S.VELOCITY])
    return x


def test_classical_steps_are_kuttas():
    flight = Disturbed()
    x, h = flight.x.copy(), flight.h
    for i in range(flight.steps):
        k1 = flight.slope(x, i)
        k2 = flight.slope(x + h / 2 * k1, i + 0.5)
        k3 = flight.slope(x + h / 2 * k2, i + 0.5)
        k4 = flight.slope(x + h * k3, i + 1)
        x = unit_attitude(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    done, failed_state, found = flight.flown(RK4)
    assert (done, failed_state) == (flight.steps, -1)
    np.testing.assert_allclose(found, x, rtol=1e-11, atol=1e-13)


def test_partitioned_steps_are_those_of_figure_3():
    """Rotor accelerations are of the first stage, but for what the turning of the coordinates adds.

    With three blades, a1'' + i b1'' has 2 i Omega (a1' + i b1') + Omega^2 (a1 + i b1).
    """
    flight = Disturbed()
    layout, x, h = flight.model.layout, flight.x.copy(), flight.h

    def turning(x):
        added = np.zeros(x.size)
        for j, omega in enumerate(flight.model.speeds):
            pairs = ((layout.flap(j), layout.flap_rate(j)), (layout.lag(j), layout.lag_rate(j)))
            for angles, rates in pairs:
                disc, rate = x[angles][1] + 1j * x[angles][2], x[rates][1] + 1j * x[rates][2]
                sum_ = 2j * omega * rate + omega**2 * disc
                added[rates] = 0.0, sum_.real, sum_.imag
        return added

    accelerations = np.zeros(x.size, dtype=bool)
    for j in range(2):
        accelerations[layout.flap_rate(j)] = accelerations[layout.lag_rate(j)] = True

    for i in range(flight.steps):
        first = flight.slope(x, i)

        def slope(stage, ahead, x=x, first=first):
            frozen = first + turning(stage) - turning(x)
            return np.where(accelerations, frozen, flight.slope(stage, ahead))

        k2 = slope(x + h / 2 * first, i + 0.5)
        k3 = slope(x + h / 2 * k2, i + 0.5)
        k4 = slope(x + h * k3, i + 1)
        x = unit_attitude(x + h / 6 * (first + 2 * k2 + 2 * k3 + k4))
    np.testing.assert_allclose(flight.flown(PARTITIONED)[2], x, rtol=1e-11, atol=1e-13)


def test_tsitouras_coefficients_meet_the_conditions_of_order_five():
    """Butcher's; E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.2.

    The printed coefficients, up to 11.7, have 15 digits.
    """
    a, b = TSITOURAS[:-1], TSITOURAS[-1]
    c, one = a.sum(axis=1), np.ones(len(b))
    trees = {
        1: [one],
        2: [c],
        6: [a @ c],
        24: [a @ a @ c],
        8: [c * (a @ c)],
        12: [a @ c**2],
        3: [c**2],
        4: [c**3],
        5: [c**4],
        10: [c**2 * (a @ c)],
        15: [c * (a @ c**2)],
        30: [c * (a @ a @ c)],
        20: [(a @ c) ** 2, a @ c**3],
        40: [a @ (c * (a @ c))],
        60: [a @ a @ c**2],
        120: [a @ a @ a @ c],
    }
    assert sum(map(len, trees.values())) == 17
    for density, weights in trees.items():
        for weight in weights:
            assert b @ weight == pytest.approx(1.0 / density, abs=1e-12)
    np.testing.assert_array_equal(np.triu(a), 0.0)


def test_tsitouras_steps_are_those_of_the_tableau():
    flight = Disturbed()
    x, c = flight.x.copy(), TSITOURAS[:-1].sum(axis=1)
    for i in range(flight.steps):
        slopes = []
        for row, ahead in zip(TSITOURAS[:-1], c, strict=True):
            stage = x + flight.h * sum((a * k for a, k in zip(row, slopes, strict=False)), np.zeros(x.size))
            slopes.append(flight.slope(stage, i + ahead))
        x = unit_attitude(x + flight.h * TSITOURAS[-1] @ np.array(slopes))
    np.testing.assert_allclose(flight.flown(TSIT5)[2], x, rtol=1e-11, atol=1e-13)


def phi(z, count=4):
    """phi_0 .. phi_3 of a matrix: the blocks of an exponential (N. J. Higham, Functions of Matrices, theorem 10.9)."""
    m = len(z)
    large = np.zeros((count * m, count * m))
    large[:m, :m] = z
    large[:-m, m:] += np.eye((count - 1) * m)
    return np.hsplit(expm(large)[:m], count)


def test_exponential_steps_are_krogstads():
    """Eqs. (51) to (54) of the paper, by what differs from the linear part at the beginning."""
    flight = Disturbed()
    x, h, linear = flight.x.copy(), flight.h, linear_part(flight.model, flight.h)
    (_, half1, half2, _), (_, one1, one2, one3) = phi(0.5 * h * linear), phi(h * linear)
    for i in range(flight.steps):
        first = flight.slope(x, i)

        def other(stage, ahead, x=x, first=first):
            return flight.slope(stage, ahead) - first - linear @ (stage - x)

        second = x + h / 2 * half1 @ first
        na = other(second, i + 0.5)
        third = second + h * half2 @ na
        nb = other(third, i + 0.5)
        fourth = x + h * one1 @ first + 2 * h * one2 @ nb
        nc = other(fourth, i + 1)
        x = x + h * (one1 @ first + (2 * one2 - 4 * one3) @ (na + nb) + (4 * one3 - one2) @ nc)
        x = unit_attitude(x)
    np.testing.assert_allclose(flight.flown(ETD)[2], x, rtol=1e-10, atol=1e-12)


def linear_part(model, h):
    """L of all states."""
    linear, matrices = np.zeros((model.layout.size, model.layout.size)), rotor_matrices(model.aircraft, True, True, h)
    for block, own in zip(matrices.blocks, matrices.linear, strict=True):
        linear[np.ix_(block, block)] = own
    return linear


@pytest.mark.parametrize("size", [1.0, 30.0, 1e4])
def test_coefficients_solve_linear_equations_exactly(size):
    """A whole step of y' = L y multiplies by the exponential of h L, whatever else the stages are."""
    rng, h = np.random.default_rng(4), 0.01
    linear = size * (rng.standard_normal((6, 6)) - 3.0 * np.eye(6))
    found, tableau = coefficients(linear, h), ((0,), (1, 2), (3, 4, 5), (6, 7, 8, 9))
    y = rng.standard_normal(6)
    slopes = [linear @ y]
    for row in tableau:
        stage = y + sum(found[k] @ slope for k, slope in zip(row, slopes, strict=True))
        slopes.append(linear @ stage)
    np.testing.assert_allclose(stage, expm(h * linear) @ y, rtol=1e-10, atol=1e-12)


def test_coefficients_without_a_linear_part_are_the_classical_ones():
    weights = (*CLASSICAL[1, :1], *CLASSICAL[2, :2], *CLASSICAL[3, :3], *CLASSICAL[-1, :4])
    np.testing.assert_allclose(
        coefficients(np.zeros((2, 2)), 0.3), 0.3 * np.multiply.outer(weights, np.eye(2)), atol=1e-16
    )


@pytest.mark.parametrize("blades", [3, 4, 5, 7])
def test_linear_part_of_a_rotor_in_vacuum_has_its_frequencies(blades):
    """A hinge at the axis with a spring flaps with nu; in multiblade coordinates harmonic n with nu +- n Omega."""
    rotor = {"blades": blades, "hinge_offset": 0.0, "flap_hinge_offset": 0.0, "flap_spring": 60.0, "lag_spring": 0.0}
    made = build(every_rotor=rotor, environment={"air_density": 0.0}, options={"coupling": "paper"})
    matrices, own = rotor_matrices(made, True, True, 1e-3), made.rotors[0]
    flap = math.sqrt(1.0 + own.flap_spring / (own.second_moment * own.speed**2))
    for block, linear in zip(matrices.blocks, matrices.linear, strict=True):
        names = [made.layout.names[i] for i in block if "xi" not in made.layout.names[i]]
        harmonic = 0 if names[0].startswith("ad") else max(S.part_of(name).harmonic for name in names)
        found = np.sort(np.abs(np.linalg.eigvals(linear).imag) / own.speed)
        wanted = abs(np.array([flap + harmonic, flap - harmonic]))
        assert all(np.abs(found - frequency).min() < 1e-6 for frequency in wanted), names


def test_a_stiff_rotor_takes_long_steps(sbs):
    """A flap spring whose frequency is far above that of the steps: the blade moves as one without a hinge does."""
    stiff = build(every_rotor={"flap_spring": 1e7})
    hover = trim(stiff)
    kick = hover.controls + np.radians([0.5, 0.3, 0.2, 0.0])
    coarse, fine = (simulate(stiff, hover, kick, 0.3, azimuth_step=math.radians(step)) for step in (14.4, 1.0))
    body = slice(S.VELOCITY, S.BODY_SIZE)
    np.testing.assert_allclose(coarse["state"][:, body], fine["state"][:, body], atol=1e-3)


@pytest.mark.parametrize("state", [S.POSITION, S.POSITION + 2], ids=["north", "down"])
def test_a_tick_ends_before_what_is_implausible(state):
    """The bound of a state, were it the very first, is passed in the second step: the state is that after the first."""
    flight = Disturbed()
    after = [flight.x]
    for steps in (1, 2):
        cut = Disturbed()
        cut.air[W.TURBULENCE_TO : W.TURBULENCE_TO + 3] = cut.air[W.TURBULENCE_FROM : W.TURBULENCE_FROM + 3]
        cut.steps = steps
        after.append(cut.flown(RK4)[2])
    flight.air[W.TURBULENCE_TO : W.TURBULENCE_TO + 3] = flight.air[W.TURBULENCE_FROM : W.TURBULENCE_FROM + 3]
    bounds = np.full(flight.x.size + 1, np.inf)
    bounds[state] = 0.5 * abs(after[1][state] + after[2][state])
    assert abs(after[1][state]) < bounds[state] < abs(after[2][state])
    done, failed_state, x = flight.flown(RK4, bounds)
    assert (done, failed_state) == (1, state)
    np.testing.assert_array_equal(x, after[1])


def test_five_degrees_are_enough_for_the_real_airfoil(sbs, hover):
    """In a violent quarter of a second no state is off by more than 1e-4 of its unit (1.6e-5 measured)."""
    coarse, fine = flights(Model(sbs), hover, (1, 16))
    assert np.abs(coarse - fine).max() < 1e-4


def test_partitioned_scheme_is_of_first_order(smooth_model, hover):
    """The paper's Figure 3, forcing of the previous step (theory.md section 7): half the step, half the change."""
    change = changes(flights(smooth_model, hover, (8, 16, 32, 64), PARTITIONED))
    np.testing.assert_allclose(change[:-1] / change[1:], 2.0, atol=0.15)


def test_partitioned_scheme_converges_to_the_coupled_solution(smooth_model, hover):
    coupled = flights(smooth_model, hover, (8,))[0]
    errors = [np.abs(x - coupled).max() for x in flights(smooth_model, hover, (8, 16, 32, 64), PARTITIONED)]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, atol=0.15)
    # at the same step the coupled solution is better by orders of magnitude
    coarse, fine = flights(smooth_model, hover, (8, 32))
    assert np.abs(coarse - fine).max() < 1e-4 * errors[0]


def test_methods_by_name(sbs, hover):
    """`simulate` offers all methods; in the equilibrium of hover they agree."""
    first, *others = (simulate(sbs, hover, hover.controls, 0.2, method=name) for name in METHODS)
    assert len(others) == 3
    for flight in others:
        np.testing.assert_allclose(flight["state"], first["state"], atol=1e-9)


# -- flights -------------------------------------------------------------------------------------------------


def test_same_commands_give_the_same_flight_to_the_last_bit(sbs, hover):
    """Two simulations side by side, with their ticks interleaved."""

    def commands(tick):
        return hover.swashplate + 0.01 * np.sin(0.3 * tick + np.arange(6).reshape(2, 3))

    pair = [Simulation(sbs, trimmed_state(sbs, hover), commands(0)) for _ in range(2)]
    for tick in range(50):
        for simulation in pair:
            simulation.set_swashplate(commands(tick))
            simulation.advance()
    np.testing.assert_array_equal(pair[1].state, pair[0].state)
    assert pair[0].step == 50 * pair[0].steps_per_tick
    assert pair[0].time == pytest.approx(0.5, abs=1e-12)


def test_ticks_only_divide_the_flight(sbs, hover):
    """Ticks of 5 and 10 ms with the same step give the same flight."""
    x, swash = disturbed(Model(sbs), hover)
    ends = []
    for tick, count in ((0.005, 100), (0.01, 50)):
        simulation = Simulation(sbs, x, swash, tick=tick, azimuth_step=np.radians(4.8))
        for _ in range(count):
            simulation.advance()
        ends.append(simulation.state)
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-12)


def test_azimuth_step_is_kept(sbs, hover):
    """The step is the largest part of the tick that turns the fastest rotor by no more than asked."""
    for degrees in (1.0, 5.0, 7.3):
        simulation = Simulation(sbs, trimmed_state(sbs, hover), hover.swashplate, azimuth_step=np.radians(degrees))
        per_step = np.degrees(simulation.step_size * sbs.rotors[0].speed)
        assert per_step <= degrees * (1 + 1e-9)
        assert per_step > degrees * simulation.steps_per_tick / (simulation.steps_per_tick + 1) - 1e-9


def test_quaternion_stays_a_rotation(sbs, hover):
    model = Model(sbs)
    x, swash = disturbed(model, hover)
    x[S.RATES : S.BODY_SIZE] = 3.0, -2.0, 4.0
    x = model.fly(x, ONE_SECOND, STEP, swash, PSI)
    assert np.linalg.norm(x[S.ATTITUDE : S.VELOCITY]) == pytest.approx(1.0, abs=1e-14)


def test_rotors_turn_for_hours_without_losing_their_phase(sbs, hover):
    """A flight that begins at step 10^9 (four days) after whole revolutions is the one from step 0."""
    model = Model(sbs)
    x, swash = disturbed(model, hover)
    h = np.radians(5.0) / model.speeds[0]
    start = model.fly(x, 72, h, swash)
    late = model.fly(x, 72, h, swash, first_step=72 * 13_888_889)
    # 7e7 rad keep 1e-8 rad in double precision
    assert differences(late, start).max() < 1e-5


@pytest.mark.parametrize("descent", [2.0, 4.0, 7.0, 10.0, 15.0, 25.0])
def test_descent_through_the_rotors_wake_stays_finite(sbs, hover, descent):
    """Vortex ring and turbulent wake, where momentum theory does not hold: one second, finite and plausible."""
    start = trimmed_state(sbs, hover)
    start[S.VELOCITY : S.RATES] = 0.3, 0.2, descent
    flight = simulate(sbs, start, hover.controls, 1.0)
    assert np.all(np.isfinite(flight["state"]))
    assert flight["w"][-1] < descent  # the thrust rises, as a rotor's that is met from below
    assert flight["thrust"].min() > 50.0


def test_flight_without_lag_and_cyclic_inflow_holds_them(sbs, hover):
    """What is switched off keeps zero all the flight, whatever the other states do."""
    x, _ = disturbed(Model(sbs), hover)
    layout = sbs.layout
    for j in range(2):
        x[layout.lag(j)] = x[layout.inflow(j).start + 1 : layout.inflow(j).stop] = 0.0
    flight = simulate(sbs, x, hover.controls, 0.3, lead_lag=False, cyclic_inflow=False)
    for j in range(2):
        for part in (layout.lag(j), layout.lag_rate(j), slice(layout.inflow(j).start + 1, layout.inflow(j).stop)):
            np.testing.assert_array_equal(flight["state"][:, part], 0.0)
    assert np.abs(np.diff(flight["a1(1)"])).max() > 1e-4


def test_implausible_state_stops_the_flight_at_the_last_good_step(sbs, hover):
    """The message names step, time, state and bound; the state kept is finite and within the bounds."""
    start = trimmed_state(sbs, hover)
    start[sbs.layout.flap_rate(0).start] = 600.0  # overshoots 1.5 rad within a revolution
    simulation = Simulation(sbs, start, hover.swashplate, tick=0.1)
    reached = r"step \d+ \(t = [\d.]+ s\) would take \S+ to .*: plausible are"
    with pytest.raises(SimulationError, match=reached):
        simulation.advance()
    assert np.all(np.isfinite(simulation.state))
    simulation.checked_state(simulation.state)
    simulation.reset(trimmed_state(sbs, hover), hover.swashplate)
    simulation.advance()


# -- answers to the controls ---------------------------------------------------------------------------------


def answer(aircraft, hover, control, seconds=0.15):
    """Return the change of p, q, r [rad/s] and of w [m/s] after one more degree of one control."""
    controls = hover.controls.copy()
    controls[control] += np.radians(1.0)
    flight = simulate(aircraft, hover, controls, seconds)
    return {name: flight[name][-1] for name in "pqrw"}


@pytest.mark.parametrize(
    ("control", "axis", "sign", "others"),
    [
        (0, "w", -1, 0.001),  # collective: up
        (1, "p", 1, 0.25),  # lateral cyclic: right side down, with some adverse yaw
        (2, "q", -1, 0.001),  # longitudinal cyclic: nose down
        (3, "r", -1, 0.25),  # its difference tilts the right rotor forward, the left one back: nose left
    ],
)
def test_every_control_moves_its_axis(sbs, hover, control, axis, sign, others):
    """With the phase of sbs.yaml longitudinal cyclic is almost pure pitch, its difference almost pure yaw."""
    found = answer(sbs, hover, control)
    assert sign * found[axis] > 0.015
    assert max(abs(value) for name, value in found.items() if name not in (axis, "w")) < others * abs(found[axis])


def test_phase_decides_what_longitudinal_cyclic_does(sbs, hover):
    """With a phase of 0 two thirds of the pitch are lost, and the difference is roll more than yaw (section 4)."""
    unrigged = build(every_rotor={"swashplate_phase_deg": 0.0})
    share = answer(unrigged, hover, 2)["q"] / answer(sbs, hover, 2)["q"]
    assert share == pytest.approx(1 / 3, abs=0.08)
    difference = answer(unrigged, hover, 3)
    assert abs(difference["p"]) > 2 * abs(difference["r"])


def test_the_matrices_are_those_of_the_rotors_in_hover():
    """Poles of each block beside those of the linear model about the trimmed hover, which is found in another way."""
    sbs = Aircraft.load("sbs")
    model, found = linearize(sbs), rotor_matrices(sbs, True, True, 1e-3)
    first = S.BODY_SIZE - S.LINEAR_BODY_SIZE
    for block, matrix in zip(found.blocks, found.linear, strict=True):
        chosen = [i - first for i in block]
        hover, ours = (np.sort_complex(np.linalg.eigvals(m)) for m in (model.a[np.ix_(chosen, chosen)], matrix))
        np.testing.assert_allclose(ours, hover, rtol=1e-3, atol=0.05)
