"""The node `excite`: a real flight with a multisine, and what `identify` finds in its log."""

import time

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from ros_harness import DOMAINS, nanoseconds, world  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import ControlValues, SwashplateArray  # noqa: E402
from sbs_msgs.srv import Step  # noqa: E402
from sbs_sim import Aircraft, linearize  # noqa: E402
from sbs_sim.analysis.identification import identify  # noqa: E402
from sbs_sim.errors import IdentificationError  # noqa: E402
from sbs_sim.nodes.excite import PARAMETERS, excitation_parts  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.flight_signals import signals_of_log  # noqa: E402

NAME = "longitudinal_cyclic"


def fly_in_steps(made, excite):
    """Fly on tick by tick, each answered before the next: the log does not depend on the machine."""
    client, answers = made.client, [made.client.messages[topic] for topic in ("excitation", "swashplate")]
    step = client.node.create_client(Step, "step")
    client.until(step.service_is_ready, "the service step")
    while excite.running:
        stepped = step.call_async(Step.Request(ticks=1))
        client.until(stepped.done, "an answer of step")
        now = 1e9 * stepped.result().sim_time
        late = time.monotonic() + 0.5  # it has not begun, or has ended

        def answered(now=now, late=late):
            return all(kept and nanoseconds(kept[-1]) > now - 1e3 for kept in answers) or time.monotonic() > late

        client.until(answered, "the control")


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """Path of the log of a flight with a multisine and without a controller."""
    folder = tmp_path_factory.mktemp("excite")
    with world(next(DOMAINS), folder) as made:
        made.client.watch("excitation", ControlValues)
        made.client.watch("swashplate", SwashplateArray)
        sines = {"low": 6.0, "high": 22.0, "period": 2.0, "periods": 3.0, "pause": 0.5, "amplitude_deg": 0.3}
        excite = made.start("excite", controls=f"[{NAME}]", signal="multisine", **sines)
        simulator = made.start("simulator", record=folder / "flight.mcap")
        assert made.client.call(SetBool, "pause", data=True).success
        fly_in_steps(made, excite)
        assert excite.wait() == 0, excite.output
        assert "excitation has ended" in excite.output
        assert simulator.interrupt() == 0, simulator.output
    return folder / "flight.mcap"


def test_the_log_has_the_excitation_and_the_controls_follow_it(flight):
    log = read(flight)
    signals, _ = signals_of_log(log)
    assert signals.excitations == (f"excitation_{NAME}",)
    added, moved = signals.values[f"excitation_{NAME}"], signals.values[NAME]
    assert np.abs(added).max() == pytest.approx(np.radians(0.3), rel=0.02)
    assert moved[-1] == pytest.approx(moved[0], abs=1e-9)
    # messages take their time, which depends on the machine: a control has what one of them asked for
    asked_for = np.array([float(values[0]) for values in log["excitation"]["values"]])
    assert max(np.abs(asked_for - change).min() for change in moved - moved[0]) < 1e-12
    assert signals.values["collective"] == pytest.approx(signals.values["collective"][0], abs=1e-9)


def test_what_is_identified_in_the_log_is_the_linear_model(flight):
    """Within twice the printed random error, or 0.5 dB and 3 deg; the aircraft is still near its trim."""
    log = read(flight)
    whole, flown = signals_of_log(log)
    excited = whole.begin + whole.tick * np.flatnonzero(whole.values[f"excitation_{NAME}"])
    signals, _ = signals_of_log(log, excited[0] - 0.3, excited[-1] + 0.2)
    asked = 2.0 * np.pi / 2.0 * np.arange(3, 7)  # harmonics of the period: 9.4 to 18.8 rad/s
    # nobody feeds back: by the controls that acted, whatever came between them and the excitation
    found = identify(signals, [NAME], ["q"], frequencies=asked)[NAME, "q"]
    gain, phase = found.departure(linearize(flown.aircraft).frequency_response(NAME, "q", asked))
    assert found.valid.all(), found.coherence
    assert np.all(np.abs(gain) <= np.maximum(2.0 * found.gain_error_db, 0.5))
    assert np.all(np.abs(phase) <= np.maximum(2.0 * found.phase_error_deg, 3.0))
    assert np.median(found.gain_error_db) < 1.5


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"signal": "step"}, "parameter signal = 'step': allowed are chirp, multisine"),
        ({"controls": ["pedal"]}, "parameter controls = \\['pedal'\\]: allowed are collective"),
        ({"controls": [NAME, NAME]}, "each once"),
        ({"duration": 1.0}, "duration = 1.0: allowed are 6.28319 to 3600 s"),
        ({"signal": "multisine", "period": 0.3}, "hold 0 harmonics for 1 control"),
    ],
)
def test_what_cannot_be_excited_is_refused(change, text):
    settings = {name: parameter.default for name, parameter in PARAMETERS.items()} | change
    with pytest.raises(IdentificationError, match=text):
        excitation_parts(Aircraft.load("sbs"), settings)


def test_chirps_follow_one_another_and_multisines_go_together():
    settings = {name: parameter.default for name, parameter in PARAMETERS.items()} | {"controls": [NAME, "collective"]}
    aircraft = Aircraft.load("sbs")
    first, second = excitation_parts(aircraft, settings)
    assert first.end + settings["pause"] == pytest.approx(second.begin)
    together = excitation_parts(aircraft, settings | {"signal": "multisine"})
    assert together[0].begin == together[1].begin
