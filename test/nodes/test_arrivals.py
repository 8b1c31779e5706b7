"""Commands that are late, out of order, of another clock, from several or from nobody; a real mixer, real DDS."""

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from ros_harness import DOMAINS, controls_message, nanoseconds, world  # noqa: E402

from sbs_msgs.msg import BodyState, Controls, SwashplateArray  # noqa: E402


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    with world(next(DOMAINS), tmp_path_factory.mktemp("arrivals")) as made:
        for topic, kind in (("state", BodyState), ("diagnostics", DiagnosticArray), ("swashplate", SwashplateArray)):
            made.client.watch(topic, kind)
        made.start("simulator", record="off")
        made.client.next("state")
        yield made


def mixer_status(array):
    return next((status for status in array.status if status.name == "control_mixer"), None)


def rejections(client):
    status = mixer_status(client.next("diagnostics", mixer_status))
    return {pair.key: pair.value for pair in status.values}


def stamped(hover, time_ns):
    message = controls_message(hover.controls)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 10**9)
    return message


def now(client):
    return nanoseconds(client.next("state"))


def reported(client, text):
    return lambda array: (
        (status := mixer_status(array)) and status.level == DiagnosticStatus.WARN and text in status.message
    )


def test_a_command_from_before_the_one_in_force_is_refused(flight, hover):
    """Both come at once; where a busy machine holds the second back for long, its clock counts as put back: again."""
    client = flight.client
    before = after = int(rejections(client)["rejected_messages"])
    tries = 0
    while after == before and tries < 10:
        tries += 1
        last = now(client)
        for stamp in (last, last - 10_000_000):
            client.publish("controls", stamped(hover, stamp))
        client.next("diagnostics", mixer_status)  # which may be of before
        found = rejections(client)
        after = int(found["rejected_messages"])
    assert after == before + 1, tries
    assert found["last_rejection"].endswith("0.01 s before that of the command in force")


def test_the_same_stamp_again_and_no_stamp_are_new_commands(flight, hover):
    client = flight.client
    before = int(rejections(client)["rejected_messages"])
    stamp = now(client)
    for message in (stamped(hover, stamp), stamped(hover, stamp), controls_message(hover.controls)):
        client.publish("controls", message)
        client.next("swashplate")
    assert int(rejections(client)["rejected_messages"]) == before


def test_a_clock_that_has_been_put_back_is_taken_after_a_while(flight, hover):
    client = flight.client
    client.publish("controls", stamped(hover, now(client)))
    client.next("swashplate")
    client.spin(0.8)
    client.publish("controls", stamped(hover, 1))
    client.next("swashplate")


@pytest.mark.parametrize(
    ("age", "text"), [(2.0, "controls stamped up to "), (-1.7e9, "s ahead of /clock, not by use_sim_time")]
)
def test_stamps_far_from_the_simulation_time_are_taken_and_reported(flight, hover, age, text):
    client = flight.client
    client.spin(0.8)  # whatever the test before has stamped
    stamp = now(client) - round(age * 1e9)
    if stamp <= 0:
        client.until(lambda: now(client) > 2.2e9, "time")
        stamp = now(client) - round(age * 1e9)
    client.publish("controls", stamped(hover, stamp))
    client.next("diagnostics", reported(client, text))


def test_two_pilots_are_named_and_a_lost_one_is_missed(flight, hover):
    client = flight.client
    client.publish("controls", controls_message(hover.controls))
    other = rclpy.create_node("other_pilot", context=client._context)
    second = other.create_publisher(Controls, "controls", QoSProfile(depth=1))
    client.next(
        "diagnostics",
        reported(client, "2 publishers of controls, the newest command counts: /other_pilot, /test_client"),
    )
    other.destroy_publisher(second)
    other.destroy_node()
    client.next("diagnostics", lambda a: (s := mixer_status(a)) and "publishers of controls" not in s.message)
    client.node.destroy_publisher(client._publishers.pop("controls"))
    client.next("diagnostics", reported(client, "controls has lost its publisher, the last command is held"))


def test_a_killed_mixer_is_missed_and_a_new_one_joins(tmp_path, hover):
    """With -9 nobody says goodbye: the flight goes on, tells what is missing, and takes a new mixer as it comes."""
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        for topic, kind in (("state", BodyState), ("diagnostics", DiagnosticArray), ("swashplate", SwashplateArray)):
            client.watch(topic, kind)
        simulator = made.start("simulator", components="[simulator]")
        mixer = made.start("control_mixer")
        # Until the simulator hears the mixer, not only the test.
        climb = controls_message(hover.controls + [0.02, 0.0, 0.0, 0.0])
        client.publish_until("controls", climb, "state", lambda m: m.velocity.z < -0.02)
        mixer.kill()

        def missed(array):
            found = next((status for status in array.status if status.name == "simulator"), None)
            return found and "swashplate has lost its publisher, the last command is held" in found.message

        client.next("diagnostics", missed)
        made.start("control_mixer")
        moved = client.publish_until("controls", controls_message(hover.controls + 0.001), "swashplate", lambda _: True)
        assert np.isfinite(moved.rotors[0].collective)
        assert simulator.running
