"""Frequency responses and bandwidths of linear models, against closed forms, python-control and flights."""

import math
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.analysis.bandwidth import bandwidth_of
from sbs_sim.analysis.frequency_response import Actuator, Transfer, frequency_response
from sbs_sim.analysis.step_response import output_row, step_response
from sbs_sim.errors import LinearizationError

PITCH = ("longitudinal_cyclic", "theta")
ROLL = ("lateral_cyclic", "phi")


@pytest.fixture(scope="module", params=[0.0, 10.0, 20.0])
def model(request, sbs):
    return linearize(sbs, airspeed=request.param)


def rate_response(damping, delay, gain=10.0):
    """Transfer function gain exp(-s delay) / (s (s + damping))."""
    a = np.array([[0.0, 1.0], [0.0, -damping]])
    return Transfer(a, np.array([0.0, gain]), np.array([1.0, 0.0]), 0.0, delay)


def attitude_response(frequency, damping, delay):
    """Transfer function exp(-s delay) / (s^2 + 2 damping frequency s + frequency^2)."""
    a = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * damping * frequency]])
    return Transfer(a, np.array([0.0, 1.0]), np.array([1.0, 0.0]), 0.0, delay)


# -- responses -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("stick", "output"), [PITCH, ROLL, ("collective", "climb_rate"), ("collective", "thrust(1)")])
def test_is_that_of_python_control(model, stick, output):
    found = model.frequency_response(stick, output)
    other = model.to_control()[model.output_names.index(output), model.control_names.index(stick)]
    theirs = control.frequency_response(other, found.frequencies).frdata[0, 0]
    np.testing.assert_allclose(found.response, theirs, rtol=1e-6, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize(("control", "output"), [PITCH, ROLL, ("collective", "w")])
def test_phase_is_continuous_and_that_of_the_response(model, control, output):
    found = model.frequency_response(control, output, np.geomspace(1e-3, 500.0, 300))
    np.testing.assert_allclose(np.exp(1j * found.phase), found.response / found.gain, atol=1e-9)
    fine = model.frequency_response(control, output, np.geomspace(1e-3, 500.0, 6000))
    assert np.abs(np.diff(fine.phase)).max() < math.radians(90.0)


@pytest.mark.parametrize("output", ["theta", "phi", "w", "climb_rate"])
def test_settled_rotors_end_at_a_quarter_turn_for_each_order(model, output):
    """An attitude follows two integrations, a velocity one; the other half turn is the sign of the control."""
    control = {"theta": PITCH[0], "phi": ROLL[0]}.get(output, "collective")
    order = 2 if output in ("theta", "phi") else 1
    reduced = model.quasi_static()
    found = frequency_response(reduced, control, output, [1e5])
    moved = "q" if output == "theta" else "p" if output == "phi" else "w"
    effect = reduced.b[reduced.state_names.index(moved), reduced.control_names.index(control)]
    is_up = (effect > 0.0) != (output == "climb_rate")  # w is down
    expected = -90.0 * order + (0.0 if is_up else 180.0)
    assert found.phase_deg[0] == pytest.approx(expected, abs=0.1)


def test_rotors_do_not_move_the_low_phase(model):
    """At low frequencies rotors and inflow have settled: both models are on the same turn."""
    full, reduced = (m.frequency_response(*PITCH, [0.01, 0.1]) for m in (model, model.quasi_static()))
    np.testing.assert_allclose(full.phase_deg, reduced.phase_deg, atol=5.0)


def test_delay_turns_the_phase_alone(model):
    frequencies = np.geomspace(0.1, 50.0, 40)
    plain, late = (model.frequency_response(*PITCH, frequencies, delay) for delay in (0.0, 0.05))
    np.testing.assert_allclose(late.gain, plain.gain, rtol=1e-12)
    np.testing.assert_allclose(late.phase, plain.phase - 0.05 * frequencies, atol=1e-9)


def test_small_flights_answer_so(sbs):
    """The nonlinear flight under a sine of 0.005 deg, whose values are held for a step: half a step of delay."""
    frequency, amplitude = 25.0, math.radians(0.005)
    point = trim(sbs)
    index = point.control_names.index(ROLL[0])
    period = 2.0 * math.pi / frequency

    def stick(time):
        controls = point.controls.copy()
        controls[index] += amplitude * math.sin(frequency * time)
        return controls

    flight = simulate(sbs, point, stick, duration=6.0 * period)
    late = flight["time"] >= 4.0 * period
    time, rate = flight["time"][late], flight["p"][late]
    basis = np.column_stack([np.sin(frequency * time), np.cos(frequency * time), time**0, time])
    sine, cosine, *_ = np.linalg.lstsq(basis, rate, rcond=None)[0]
    held = 0.5 * (flight["time"][1] - flight["time"][0])
    found = linearize(sbs).frequency_response(ROLL[0], "p", [frequency], held).response[0]
    assert abs(complex(sine, cosine) / amplitude - found) < 0.03 * abs(found)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"input_name": "throttle"}, "input = 'throttle': allowed are collective, "),
        ({"output_name": "altitude"}, "output = 'altitude': allowed are u, w, "),
        ({"frequencies": [1.0, 0.5]}, "frequencies: allowed are one or more rising numbers"),
        ({"frequencies": []}, "frequencies: allowed are one or more rising numbers"),
        ({"frequencies": [0.0, 1.0]}, "frequencies = 0.0: allowed are 0.0001 to 100000 rad/s"),
        ({"frequencies": [math.nan]}, "frequencies = nan: allowed are 0.0001 to 100000 rad/s"),
        ({"frequencies": "1"}, "frequencies = '1': allowed are numbers"),
        ({"delay": -0.1}, "delay = -0.1: allowed are 0 to 10 s"),
    ],
)
def test_wrong_input_is_refused(sbs, given, text):
    model = linearize(sbs).quasi_static()
    arguments = {"input_name": PITCH[0], "output_name": PITCH[1]} | given
    with pytest.raises(LinearizationError) as caught:
        model.frequency_response(**arguments)
    assert str(caught.value).startswith(text)


# -- bandwidth -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("damping", "delay"), [(4.0, 0.05), (1.0, 0.02), (10.0, 0.2)])
def test_rate_response_has_its_closed_form(damping, delay, sign):
    found = bandwidth_of(rate_response(damping, delay, 10.0 * sign), "stick", "theta")

    def phase(frequency):
        return -math.pi / 2.0 - math.atan(frequency / damping) - delay * frequency

    crossing = brentq(lambda frequency: phase(frequency) + math.pi, 1e-3, 1e3)
    assert found.sign == sign
    assert found.crossing == pytest.approx(crossing, rel=1e-9)
    assert found.phase_bandwidth == pytest.approx(brentq(lambda w: phase(w) + 0.75 * math.pi, 1e-3, 1e3), rel=1e-9)
    assert found.phase_delay == pytest.approx(-(phase(2.0 * crossing) + math.pi) / (2.0 * crossing), rel=1e-9)

    def gain(frequency):
        return 1.0 / (frequency * math.hypot(frequency, damping))

    twice = brentq(lambda w: gain(w) - 10.0**0.3 * gain(crossing), 1e-4, crossing)
    assert found.gain_bandwidth == pytest.approx(twice, rel=1e-9)
    assert found.bandwidth == min(found.phase_bandwidth, found.gain_bandwidth)


def test_actuators_are_in_series(model):
    """Against python-control's product of both systems, in gain, and with a phase that goes on below -180 deg."""
    lag = Actuator(40.0, 0.6)
    frequencies = np.geomspace(0.5, 300.0, 60)
    found = model.frequency_response("lateral_cyclic", "phi", frequencies, 0.01, lag)
    plain = model.frequency_response("lateral_cyclic", "phi", frequencies, 0.01)
    theirs = control.tf([1600.0], [1.0, 48.0, 1600.0])(1j * frequencies)
    np.testing.assert_allclose(found.response, plain.response * theirs, rtol=1e-9)
    np.testing.assert_allclose(np.exp(1j * found.phase), found.response / np.abs(found.response), atol=1e-9)
    np.testing.assert_allclose(found.phase - plain.phase, np.unwrap(np.angle(theirs)), atol=1e-9)
    assert found.to_dict()["actuator"] == {"frequency": 40.0, "damping": 0.6}


def test_actuators_take_bandwidth():
    """The crossing of -180 deg is where the phases of pole, integrator, delay and actuator add up."""
    lag = Actuator(20.0, 0.8)
    found = bandwidth_of(replace(rate_response(4.0, 0.02), actuator=lag), "stick", "theta")

    def phase(w):
        return -math.pi / 2 - math.atan(w / 4.0) - 0.02 * w - math.atan2(1.6 * w / 20.0, 1.0 - (w / 20.0) ** 2)

    assert found.crossing == pytest.approx(brentq(lambda w: phase(w) + math.pi, 0.1, 50.0), rel=1e-9)
    assert found.phase_bandwidth == pytest.approx(brentq(lambda w: phase(w) + 0.75 * math.pi, 0.1, 50.0), rel=1e-9)


def test_steps_through_actuators(sbs):
    model, lag = linearize(sbs, airspeed=10.0), Actuator(30.0, 0.5)
    row = output_row(model, "climb_rate")[np.newaxis]
    ours = step_response(model, "collective", row, 1.0, actuator=lag)[0]
    column = model.control_names.index("collective")
    plant = control.ss(model.a, model.b[:, [column]], row[:, : len(model.a)], row[:, [len(model.a) + column]])
    theirs = control.step_response(plant * control.tf([900.0], [1.0, 30.0, 900.0]), np.linspace(0.0, 1.0, 401)).outputs
    np.testing.assert_allclose(ours, theirs, atol=1e-6 * np.abs(theirs).max())


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ((0.0, 0.7), "actuator.frequency = 0.0: allowed are 0.0001 to 100000 rad/s"),
        ((9.0, 0.0), "actuator.damping = 0.0"),
    ],
)
def test_actuators_are_checked(given, text):
    with pytest.raises(LinearizationError) as caught:
        Actuator(*given)
    assert str(caught.value).startswith(text)


@pytest.mark.parametrize(("frequency", "damping"), [(2.0, 0.7), (3.0, 0.4)])
def test_attitude_response_has_its_closed_form(frequency, damping):
    """Without a delay the phase of a second-order system never reaches -180 deg; -135 deg has a closed form."""
    found = bandwidth_of(attitude_response(frequency, damping, 0.0), "stick", "theta", is_rate_command=False)
    expected = frequency * (damping + math.sqrt(damping**2 + 1.0))  # tan(135 deg) of the denominator's phase
    assert found.bandwidth == pytest.approx(expected, rel=1e-9)
    assert math.isnan(found.crossing)
    assert found.remark == "no phase delay: the phase does not fall to -180 deg"


def resonant_response(frequency, damping, delay=0.0):
    """Transfer function exp(-s delay) / (s (s^2 + 2 damping frequency s + frequency^2))."""
    a = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -(frequency**2), -2.0 * damping * frequency]])
    return Transfer(a, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 0.0, delay)


def test_gain_may_be_the_limit():
    """A resonance at the crossing, where the phase of the pair is -90 deg, leaves little to a pilot."""
    found = bandwidth_of(resonant_response(5.0, 0.15), "stick", "theta")
    assert found.crossing == pytest.approx(5.0, rel=1e-9)
    # (25 - w^2) = 2 0.15 5 w
    assert found.phase_bandwidth == pytest.approx((-1.5 + math.sqrt(1.5**2 + 100.0)) / 2.0, rel=1e-9)
    level = 10.0**0.3 / (5.0 * 1.5 * 5.0)
    expected = brentq(lambda w: 1.0 / (w * math.hypot(25.0 - w * w, 1.5 * w)) - level, 0.1, 4.0)
    assert found.gain_bandwidth == pytest.approx(expected, rel=1e-9)
    assert found.bandwidth == found.gain_bandwidth < found.phase_bandwidth
    assert found.remark.startswith("limited by the gain")
    as_attitude = bandwidth_of(resonant_response(5.0, 0.15), "stick", "theta", is_rate_command=False)
    assert as_attitude.bandwidth == as_attitude.phase_bandwidth == found.phase_bandwidth


def test_gain_may_leave_nothing():
    """A second-order system whose gain at the crossing is its largest has no margin anywhere."""
    found = bandwidth_of(attitude_response(5.0, 0.05, 0.2), "stick", "theta")
    assert not math.isnan(found.phase_bandwidth)
    assert math.isnan(found.bandwidth)
    assert found.remark == "no bandwidth: the gain is nowhere 6 dB above that where the phase is -180 deg"


def test_bare_pitch_has_none(model):
    """Pitch of the side-by-side helicopter: the phase never rises above -135 deg from hover to 20 m/s."""
    found = model.bandwidth(*PITCH)
    assert math.isnan(found.bandwidth)
    assert found.highest_phase < math.radians(-135.0)
    assert found.sign == -1  # the stick forward puts the nose down
    assert found.remark.startswith("no bandwidth: the phase is -1")


def test_damping_of_roll_gives_one():
    """Bare roll of the UH-60A is a rate response L_p / (s (s - L_p)), -135 deg at -L_p, behind the lag of its rotor."""
    model = linearize(Aircraft.load("uh60a_tm85890"))
    found = model.bandwidth(*ROLL)
    roll_damping = -model.derivatives()["L'_p"]
    assert 0.5 * roll_damping < found.bandwidth < roll_damping
    assert 0.0 < found.phase_delay < 0.1


def test_what_does_not_move_has_no_bandwidth():
    still = Transfer(np.diag([-1.0, -2.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.0)
    with pytest.raises(LinearizationError, match="phi: stick does not move it"):
        bandwidth_of(still, "stick", "phi")
