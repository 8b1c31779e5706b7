"""Loops of linear models: closed forms, python-control, the sampled loops of the pilots; quickness and rejections."""

import math
from types import SimpleNamespace

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from sbs_sim import linearize, qualities
from sbs_sim.analysis.bandwidth import bandwidth_of
from sbs_sim.analysis.frequency_response import Actuator
from sbs_sim.analysis.linear_loop import LinearLaw, linear_loop
from sbs_sim.analysis.qualities_plots import drawings, rejection_figure
from sbs_sim.analysis.quality_limits import limits
from sbs_sim.analysis.quickness import of_pulses, of_step
from sbs_sim.errors import LinearizationError, PilotError
from sbs_sim.pilot import hover_hold as H
from sbs_sim.pilot.envelope import PERIOD, design_envelope
from sbs_sim.pilot.envelope_check import nominal
from sbs_sim.pilot.linear_laws import attitude_law, augmentation_law, hover_hold_law, sampled_law

FREQUENCY, DAMPING = 3.0, 0.4


def double_integrator():
    """Attitude with q' = control."""
    return SimpleNamespace(
        a=np.array([[0.0, 1.0], [0.0, 0.0]]),
        b=np.array([[0.0], [1.0]]),
        c=np.array([[1.0, 0.0]]),
        d=np.zeros((1, 1)),
        state_names=("theta", "q"),
        control_names=("stick",),
        control_units=("rad",),
        output_names=("theta",),
        output_units=("rad",),
    )


def second_order(frequency=FREQUENCY, damping=DAMPING):
    """A stick that commands the attitude of a second-order system."""
    gains = np.array([[-(frequency**2), -2.0 * damping * frequency, frequency**2]])
    empty = np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((1, 0))
    return LinearLaw(*empty, gains, ("theta", "q"), ("pitch stick",), ("pitch",), ("stick",))


@pytest.fixture(scope="module")
def hover_model(sbs):
    return linearize(sbs)


# -- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", [0.4, 0.7, 1.5])
def test_rejection_has_its_closed_form(damping):
    """S = (s^2 + 2 z w s) / (s^2 + 2 z w s + w^2): |S|^2 = 10^-0.3 is quadratic in the frequency's square."""
    found = linear_loop(double_integrator(), second_order(damping=damping)).rejection("theta")
    half = 2.0 * damping**2 + 1.0
    # |S| is 3 dB below at 10^(-3/20), not at sqrt(1/2)
    level = 10.0 ** (-0.3)
    a, b = 1.0 - level, 4.0 * damping**2 * (1.0 - level) + 2.0 * level
    square = (-b + math.sqrt(b * b + 4.0 * a * level)) / (2.0 * a)
    assert found.bandwidth == pytest.approx(FREQUENCY * math.sqrt(square), rel=1e-6)
    assert found.bandwidth == pytest.approx(FREQUENCY * math.sqrt(-half + math.sqrt(half**2 + 1.0)), rel=0.01)

    def size(frequency):
        s = 1j * frequency
        return abs((s * s + 2.0 * damping * FREQUENCY * s) / (s * s + 2.0 * damping * FREQUENCY * s + FREQUENCY**2))

    grid = np.geomspace(0.1, 100.0, 40001)
    assert found.peak == pytest.approx(20.0 * math.log10(size(grid).max()), abs=1e-5)
    assert found.peak_frequency == pytest.approx(grid[size(grid).argmax()], rel=1e-3)


def test_a_loop_that_lets_all_through_has_no_rejection():
    law = second_order()
    gains = law.d.copy()
    gains[:, 0] = 0.0
    still = LinearLaw(law.a, law.b, law.c, gains, law.measured, law.commands, law.axes, law.controls)
    found = linear_loop(double_integrator(), still).rejection("theta")
    assert math.isnan(found.bandwidth)
    assert found.remark == "a slow disturbance is not reduced by 3 dB"


def test_loops_are_those_of_python_control():
    """Command to attitude through Padé's delay and an actuator, closed by python-control."""
    delay, lag = 0.03, Actuator(25.0, 0.6)
    loop = linear_loop(double_integrator(), second_order(), delay, lag)
    late = control.tf(*control.pade(delay, 3)) * control.tf([625.0], [1.0, 30.0, 625.0])
    plant = control.tf([1.0], [1.0, 0.0, 0.0])
    compensator = control.tf([2.0 * DAMPING * FREQUENCY, FREQUENCY**2], [1.0])
    theirs = FREQUENCY**2 * plant * late / (1.0 + plant * late * compensator)
    frequencies = np.geomspace(0.1, 60.0, 40)
    ours = loop.transfer("pitch stick", "theta").at(frequencies)
    np.testing.assert_allclose(ours, theirs(1j * frequencies), rtol=1e-8)
    sensitivity = (1.0 + plant * late * 2.0 * DAMPING * control.tf([FREQUENCY, 0.0], [1.0])) / (
        1.0 + plant * late * compensator
    )
    np.testing.assert_allclose(loop.sensitivity("theta", frequencies), sensitivity(1j * frequencies), rtol=1e-7)


@pytest.mark.parametrize(("frequency", "damping"), [(3.0, 0.4), (2.0, 0.7)])
def test_quickness_of_an_attitude_has_its_closed_form(frequency, damping):
    times = np.linspace(0.0, 12.0, 20001)
    root = math.sqrt(1.0 - damping**2)
    fall = np.exp(-damping * frequency * times) / root
    attitude = 1.0 - fall * np.sin(root * frequency * times + math.acos(damping))
    rate = frequency * fall * np.sin(root * frequency * times)
    over = math.exp(-math.pi * damping / root)
    peak = frequency * math.exp(-damping * math.acos(damping) / root)
    for sign in (1.0, -1.0):
        found = of_step(sign * attitude, sign * rate, 0.5)
        assert found.at(0.1) == pytest.approx(peak / (1.0 + over), rel=1e-4)
        assert found.reach == pytest.approx(0.5 * (1.0 - over**2), rel=1e-4)


def test_quickness_of_a_rate_has_its_closed_form():
    """P' = -p / T + L: a pulse gives the rate room L T (1 - exp(-t/T)), and an attitude when a twentieth is left."""
    constant, effect, room = 0.3, 20.0, 0.1
    times = np.linspace(0.0, 6.0, 6001)
    rate = effect * constant * -np.expm1(-times / constant)
    attitude = effect * constant * (times + constant * np.expm1(-times / constant))
    found = of_pulses(attitude, rate, room)
    top = room * effect * constant
    for change, value in zip(found.changes, found.values, strict=True):
        length = brentq(
            lambda t, change=change: top * (t - 0.05 * constant * -math.expm1(-t / constant)) - change, 1e-3, 4.0
        )
        assert value * change == pytest.approx(top * -math.expm1(-length / constant), rel=0.01)
    assert (np.diff(found.values) < 0.0).all()


# -- the pilots of this package --------------------------------------------------------------------------------------


def test_hover_hold_in_continuous_time_is_the_sampled_one(hover_model):
    """Its slow poles, with a delay of a tick.

    Controls are held for half a tick on average, the computer takes one, and the sampled lags of the controls are half
    a tick ahead of continuous ones.
    """
    found = H.design(H.HoverModel.of(hover_model))
    loop = linear_loop(hover_model, hover_hold_law(hover_model, found), H.TICK)
    assert loop.is_stable
    for pole in found.complete_poles[:12]:
        assert np.abs(loop.poles - pole).min() < 0.01 * abs(pole) + 0.01


def test_a_sampled_law_in_continuous_time_has_its_poles(hover_model):
    """The bilinear transformation, with half a tick of held controls and one of the computer as delay."""
    found = H.design(H.HoverModel.of(hover_model))
    names = hover_hold_law(hover_model, found).controls
    law = sampled_law(H.compensator(found.gains), H.TICK, H.MEASURED, (), (), names)
    loop = linear_loop(hover_model, law, 1.5 * H.TICK)
    for pole in found.complete_poles[:16]:
        assert np.abs(loop.poles - pole).min() < 1e-3 * abs(pole) + 1e-4


def test_targets_are_reached(hover_model):
    loop = linear_loop(hover_model, hover_hold_law(hover_model))
    still = loop.d - loop.c @ np.linalg.solve(loop.a, loop.b)
    rows = [loop.output_names.index(name) for name in ("heading", "forward", "right", "down")]
    order = [loop.control_names.index(f"{name} target") for name in ("heading", "forward", "right", "down")]
    np.testing.assert_allclose(still[np.ix_(rows, order)], np.eye(4), atol=1e-6)


def test_the_way_in_forward_flight(sbs):
    """Heading turns the way to the right with the airspeed; climb is that of the linear model."""
    model = linearize(sbs, airspeed=5.0)
    loop = linear_loop(model, augmentation_law(model))
    names = loop.state_names
    own, heading = names.index("right"), names.index("heading")
    assert loop.a[own, heading] == pytest.approx(5.0, rel=1e-6)
    size = len(model.state_names)
    climb = model.c[model.output_names.index("climb_rate")]
    np.testing.assert_allclose(loop.a[names.index("down"), :size], -climb, atol=1e-6)


@pytest.fixture(scope="module")
def augmented(sbs):
    return qualities(sbs, [0.0], delay=0.01, actuator=Actuator(60.0, 0.7), law=augmentation_law, law_name="it")


def test_augmentation_gives_bandwidth_and_rejects(augmented):
    """The bare airframe has no bandwidth of pitch in hover; with the augmentation it has, and rejects disturbances."""
    found = augmented
    rows = {name: row[0] for name, row in found.rows().items()}
    assert rows["pitch_bandwidth"].level == 1
    assert rows["roll_bandwidth"].level == 1
    assert rows["pitch_rejection_bandwidth"].value == pytest.approx(
        found.points[0].loop.rejection("theta").bandwidth, rel=1e-9
    )
    assert rows["yaw_rejection_bandwidth"].remark == "the attitude is not fed back"
    assert 0.5 < rows["pitch_quickness"].value < rows["pitch_bandwidth"].value
    assert not any(row.level == 4 for row in rows.values())
    assert found.to_dict()["law"] == "it"


def test_rejections_are_drawn(augmented):
    """Pitch and roll are fed back, the heading is not; the dotted line is that of the bandwidth."""
    figure = rejection_figure(augmented)
    assert [len(axes.lines) for axes in figure.axes] == [2, 2, 1]
    assert len(drawings(augmented)) == 8


def test_an_attitude_that_is_measured_is_what_the_loop_holds(hover_model):
    """With integrals of position a slow disturbance of the heading is gone: S = 0 at zero frequency."""
    loop = linear_loop(hover_model, hover_hold_law(hover_model))
    assert abs(loop.sensitivity("heading", [1e-3])[0]) < 0.01


# -- levels ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("angle", "value", "level"), [(5.0, 1.6, 1), (5.0, 1.59, 2), (27.5, 0.98, 2), (40.0, 0.3, 3)])
def test_levels_of_a_curve(angle, value, level):
    limit = limits().by_name["pitch_quickness"]
    assert limit.level_at(angle, value) == level
    assert limit.level_at(angle, math.nan) == 3


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"measured": ("theta", "alpha")}, "measured = 'alpha': allowed are theta, q"),
        ({"controls": ("throttle",)}, "controls = 'throttle': allowed are stick"),
    ],
)
def test_unknown_names_are_refused(change, text):
    law = second_order()
    given = {name: getattr(law, name) for name in law.__dataclass_fields__} | change
    with pytest.raises(LinearizationError) as caught:
        linear_loop(double_integrator(), LinearLaw(**given))
    assert str(caught.value).startswith(text)


def test_outputs_that_a_control_moves_at_once_are_refused(hover_model):
    law = second_order()
    given = {name: getattr(law, name) for name in law.__dataclass_fields__}
    given |= {"measured": ("theta", "specific_force_z"), "controls": ("collective",)}
    with pytest.raises(LinearizationError, match="a control moves specific_force_z at once"):
        linear_loop(hover_model, LinearLaw(**given))


def test_the_envelope_controller_is_judged_alike_in_continuous_time(sbs):
    """Bandwidth and rejections as its own check has them, which is of discrete time and of sampled responses."""
    models = [linearize(sbs, airspeed=speed) for speed in (0.0, 5.0)]
    found = design_envelope(sbs, models)
    checked = nominal(found, sbs, [0.0, 5.0])
    for model, own in zip(models, checked, strict=True):
        loop = linear_loop(model, attitude_law(model, found), 1.5 * PERIOD, Actuator(500.0, 5.0))
        for i, (axis, attitude) in enumerate((("pitch", "theta"), ("roll", "phi"))):
            rejected = loop.rejection(attitude, (0.05, 50.0))
            assert rejected.bandwidth == pytest.approx(own.rejection[i], rel=0.03)
            assert rejected.peak == pytest.approx(own.peak[i], abs=0.3)
            transfer = loop.transfer(f"{axis} command", attitude)
            assert bandwidth_of(transfer, axis, attitude, False).bandwidth == pytest.approx(own.bandwidth[i], rel=0.03)


def test_a_controller_of_another_aircraft_is_refused(sbs, hover_model):
    found, other = design_envelope(sbs, [hover_model]), linearize(sbs.with_value("body.mass", 22.0))
    with pytest.raises(PilotError, match="allowed is one for this aircraft"):
        attitude_law(other, found)
