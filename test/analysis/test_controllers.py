"""Control laws in the loop of flights: compiled and of Python, alone and in batches, with sensors, delay and lag."""

import math

import numba
import numpy as np
import pytest

from sbs_sim import Case, Controller, Sensors, simulate, simulate_batch, trim
from sbs_sim.errors import PilotError, SimulationError
from sbs_sim.flight import measured as M
from sbs_sim.flight import sortie
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.law_pilot import LawPilot
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

DURATION = 0.4


def hold(time, measured, memory, parameters, controls):
    memory[0] += 0.01 * measured[M.PITCH]
    for i in range(4):
        controls[i] = parameters[i]
    controls[1] += -0.3 * measured[M.ROLL] - 0.1 * measured[M.P]
    controls[2] += 0.3 * (measured[M.PITCH] - parameters[4] + memory[0]) + 0.1 * measured[M.Q]


FAST = numba.njit(hold)


@numba.njit
def step(time, measured, memory, parameters, controls):
    controls[0] = parameters[0]


@numba.njit
def fails(time, measured, memory, parameters, controls):
    if time > parameters[0]:
        controls[2] = math.nan


@pytest.fixture(scope="module")
def hover(sbs):
    return trim(sbs)


@pytest.fixture(scope="module")
def numbers(hover):
    return np.append(hover.controls, hover.pitch)


def gusts(seed):
    return Wind(velocity=(3.0, -1.0, 0.5), turbulence_intensity=(1.5, 1.0, 0.5), turbulence_seed=seed)


def controller(numbers, seed=0, law=FAST, **options):
    sensors = Sensors(noise={"p": 0.01, "theta": 0.002}, bias={"phi": 0.01}, seed=seed)
    return Controller(law, numbers, [0.0], sensors=sensors, **options)


def test_a_law_flies_as_a_pilot_who_sees_every_state(sbs, hover, numbers):
    """Through the compiled mixer as through that of the live flight, which the rates of the actuators limit."""
    quick = Controller(FAST, 3.0 * numbers - 2.0 * np.append(hover.controls, 0.0), [0.0], delay=0.02)
    expected = simulate_with_pilot(sbs, hover, LawPilot(quick, hover.controls), DURATION, delay=2)
    flight = simulate(sbs, hover, quick, DURATION)
    assert np.ptp(flight["controls"], axis=0)[2] > 0.0
    for name in ("state", "swashplate", "power"):
        np.testing.assert_allclose(flight[name], expected[name], rtol=0.0, atol=1e-12)


def test_a_law_of_python_flies_as_the_compiled_one(sbs, hover, numbers):
    options = {"period": 0.02, "delay": 0.01, "lag": 0.05}
    compiled = simulate(sbs, hover, controller(numbers, 3, **options), DURATION, wind=gusts(1))
    asked = simulate(sbs, hover, controller(numbers, 3, hold, **options), DURATION, wind=gusts(1))
    for name in ("state", "controls", "power"):
        np.testing.assert_allclose(asked[name], compiled[name], rtol=0.0, atol=1e-12)


def test_flights_of_a_batch_are_single_flights_to_the_last_bit(sbs, hover, numbers, monkeypatch):
    options = {"period": 0.03, "delay": 0.02}
    cases = [
        Case(sbs, hover, controller(numbers + 0.001 * i, i, lag=0.01 * (i % 3), **options), gusts(i)) for i in range(9)
    ]
    cases[4] = Case(sbs, hover, Controller(fails, [0.2]))
    batch = simulate_batch(cases, DURATION, every=4, workers=1)
    monkeypatch.setattr(sortie, "BLOCK", 7)  # the others fly in one piece
    for i in (0, 3, 8):
        flight = simulate(sbs, hover, cases[i].controls, DURATION, wind=cases[i].wind)
        for name in ("state", "controls", "swashplate", "power"):
            np.testing.assert_array_equal(batch[name][i], flight[name][::4])
    assert batch.failed == (4,)
    assert "controls at 0.21 s: longitudinal_cyclic = nan: allowed are" in batch.errors[4]
    assert np.count_nonzero(~np.isnan(batch["u"][4])) == 6  # 0 to 0.2 s


def test_what_is_measured(sbs, hover):
    """State, attitude and air of each instant; the noise and the bias have their sizes."""
    seen = []

    def look(time, measured, memory, parameters, controls):
        seen.append((time, *measured))

    wind = Wind(velocity=(3.0, -1.0, 0.5))
    flight = simulate(sbs, hover, Controller(look, period=0.02), 0.1, wind=wind)
    rows = np.array(seen)
    np.testing.assert_array_equal(rows[:, 0], flight["time"][::2])
    for i, name in enumerate(M.NAMES[: M.U_AIR]):
        np.testing.assert_array_equal(rows[:, 1 + i], flight[name][::2], err_msg=name)
    for row, x in zip(rows, flight["state"][::2], strict=True):
        expected = x[7:10] - rotation_matrix(x[3:7]).T @ wind.velocity
        np.testing.assert_allclose(row[1 + M.U_AIR :], expected, atol=1e-12)
    errors = Sensors(noise={"q": 0.5}, bias={"phi": 0.2}, seed=4).errors()
    parts = np.concatenate([errors.next(n) for n in (1, 2000, 500)])
    assert parts[:, M.Q].std() == pytest.approx(0.5, rel=0.05)
    assert not np.delete(parts, M.Q, axis=1).any()
    biases = np.array([Sensors(bias={"phi": 0.2}, seed=i).errors().bias[M.ROLL] for i in range(400)])
    assert biases.std() == pytest.approx(0.2, rel=0.15)
    np.testing.assert_array_equal(Sensors(noise={"q": 0.5}, seed=4).errors().next(2501), parts)


def test_delay_and_lag_of_a_step(sbs, hover):
    start, end, lag, delay = hover.controls[0], hover.controls[0] + 0.02, 0.04, 3
    flight = simulate(sbs, hover, Controller(step, [end], delay=0.03, lag=lag), 0.2)
    ticks = np.arange(21) - delay + 1  # the first controls that arrive act on a whole tick
    expected = np.where(ticks > 0, end + (start - end) * np.exp(-0.01 * ticks / lag), start)
    np.testing.assert_allclose(flight["controls"][:, 0], expected, atol=1e-15)


def test_ranges_are_kept_and_said(sbs, hover):
    flight = simulate(sbs, hover, Controller(step, [1.0]), 0.05)
    collective = sbs.controls[0]
    assert flight.warnings[-1].startswith("clipped: ")
    assert any(f"{collective.name} at its limit" in line for line in flight.warnings)
    reach = sbs.rows[0].rate * 0.01
    assert np.abs(np.diff(flight["swashplate"][:, :, 0], axis=0)).max() == pytest.approx(reach)


def test_a_law_that_raises_ends_its_flight_only(sbs, hover, numbers):
    def raises(time, measured, memory, parameters, controls):
        if time > 0.05:
            raise ValueError("two\nlines")

    cases = [Case(sbs, hover, Controller(raises)), Case(sbs, hover, controller(numbers))]
    batch = simulate_batch(cases, 0.1)
    assert batch.errors == ("controls at 0.06 s: the law raised ValueError: two lines", None)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Controller("law"), "law = 'law': allowed are functions"),
        (lambda: Controller(hold, [math.nan]), "parameters have shape"),
        (lambda: Controller(hold, delay=-1.0), "delay = -1.0: allowed are 0 to 10 s"),
        (lambda: Sensors(noise={"x": 1.0}), "noise of 'x': allowed are north, east"),
        (lambda: Sensors(bias={"p": -1.0}), "bias of p = -1.0: allowed are 0 to"),
    ],
)
def test_what_is_refused(make, text):
    with pytest.raises(SimulationError, match=text):
        make()


@pytest.mark.parametrize(
    ("own", "text"),
    [
        (Controller(FAST, period=0.015), "period = 0.015 s: allowed are multiples of the tick, 0.01 s"),
        (Controller(numba.njit(lambda t, m, k, p, c: 1.0)), "returns something"),
        (Controller(numba.njit(lambda t, m, k, p, c: c.foo())), "numba cannot compile it"),
        (Controller(FAST, initial=[0.0]), r"controls have shape \(1,\)"),
    ],
)
def test_what_a_flight_refuses(sbs, hover, own, text):
    with pytest.raises(SimulationError, match=text):
        simulate(sbs, hover, own, 0.05)


def test_a_state_needs_controls_to_start_with(sbs, hover, numbers):
    state = simulate(sbs, hover, hover.controls, 0.02)["state"][-1]
    with pytest.raises(SimulationError, match="initial"):
        simulate(sbs, state, controller(numbers), 0.02)
    own = Controller(FAST, numbers, [0.0], initial=hover.controls)
    assert len(simulate(sbs, state, own, 0.02)["time"]) == 3


def test_a_pilot_by_a_law_begins_anew(hover, numbers):
    pilot = LawPilot(Controller(hold, numbers, [0.0], period=0.02), hover.controls)
    body = np.zeros(13)
    body[3:7] = math.cos(0.1), 0.0, math.sin(0.1), 0.0
    first = pilot(0.0, body)
    np.testing.assert_array_equal(pilot(0.01, body), first)
    assert pilot(0.02, body)[2] > first[2]
    np.testing.assert_array_equal(pilot(0.0, body), first)
    with pytest.raises(PilotError, match="controls = "):
        LawPilot(Controller(fails, [-1.0]), hover.controls).controls(0.0, body)
