"""What ROS's own tools take for granted of every node: its parameters answer, its name is its own."""

import ast
import importlib
import inspect
import pkgutil
import socket
import textwrap
import time

import pytest

rclpy = pytest.importorskip("rclpy")

from rclpy.action import ActionServer  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.parameter_client import AsyncParameterClient  # noqa: E402
from recorded_flights import HOVER_STEP  # noqa: E402
from ros_harness import DOMAINS, Terminal, world  # noqa: E402

import sbs_sim.nodes  # noqa: E402
from sbs_msgs.action import Sweep  # noqa: E402

# Names that nodes have in releases after Jazzy: rclpy 9.1 (Kilted), and what rclpy 11 (Rolling) moved to a BaseNode.
LATER = {
    "__enter__",
    "__exit__",
    "_handle",
    "_create_client_handle",
    "_create_publisher_handle",
    "_create_service_handle",
    "_create_subscription_handle",
    "_validate_qos_or_depth_parameter",
}
ASK_AGAIN = 10.0  # s without an answer
OVERRIDDEN = {"destroy_node", "notify_execute"}  # on purpose, and they call the one below
OF_EVERY_CLASS = {"__init__", "__module__", "__doc__", "__qualname__", "__firstlineno__", "__static_attributes__"}
OF_EVERY_CLASS |= {"__parameters__", "__orig_bases__"}  # of a generic base, as rclpy's are since Kilted


def own_classes(base):
    """Classes of the package that stand on one of rclpy's."""
    modules = [
        importlib.import_module(f"sbs_sim.nodes.{item.name}") for item in pkgutil.iter_modules(sbs_sim.nodes.__path__)
    ]
    found = {value for module in modules for value in vars(module).values() if inspect.isclass(value)}
    return [kind for kind in found if issubclass(kind, base) and kind.__module__.startswith("sbs_sim.")]


def names_of(kind):
    """Methods and attributes that a class gives its objects, by its source."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    attributes = {
        item.attr
        for item in ast.walk(tree)
        if isinstance(item, ast.Attribute) and isinstance(item.ctx, ast.Store) and ast.unparse(item.value) == "self"
    }
    return (attributes | set(vars(kind))) - OF_EVERY_CLASS


@pytest.fixture
def own_world(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        yield made


def test_no_name_of_ours_is_one_of_rclpys(own_world):
    """A node that overwrites an attribute of its base class breaks whatever of ROS stands on it."""
    node = own_world.client.node
    actions = ActionServer(node, Sweep, "sweep", lambda goal: None)
    try:
        for base, made in ((Node, node), (ActionServer, actions)):
            theirs = {*dir(base), *vars(made), *LATER} - OVERRIDDEN
            assert "_parameters" in theirs or base is ActionServer
            classes = own_classes(base)
            assert len(classes) >= (8 if base is Node else 1)
            clashes = {kind.__name__: names for kind in classes if (names := names_of(kind) & theirs)}
            assert clashes == {}
    finally:
        actions.destroy()


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return taken.getsockname()[1]


def answers(client, name):
    """Answers of all six parameter services of a node, asked as `ros2 param` asks them."""
    asked = AsyncParameterClient(client.node, name)
    client.until(asked.services_are_ready, f"the parameters of {name}")

    def got(ask, *arguments):
        """An answer is lost if the node has not yet met the reader of it: on a busy machine one asks again."""
        futures, asked_at = [ask(*arguments)], time.monotonic()

        def answered():
            nonlocal asked_at
            if time.monotonic() - asked_at > ASK_AGAIN:
                futures.append(ask(*arguments))
                asked_at = time.monotonic()
            return next((future for future in futures if future.done()), None)

        return client.until(answered, f"an answer of {name}").result()

    names = got(asked.list_parameters, [], 0).result.names
    values = got(asked.get_parameters, names).values
    types = got(asked.get_parameter_types, names).types
    described = got(asked.describe_parameters, names).descriptors
    same = [Parameter("use_sim_time", value=False)]
    results = [*got(asked.set_parameters, same).results, got(asked.set_parameters_atomically, same).result]
    return names, values, types, described, results


def check_parameters(client, name):
    names, values, types, described, results = answers(client, name)
    assert "use_sim_time" in names
    assert len(names) == len(values) == len(types) == len(described)
    assert [descriptor.name for descriptor in described] == list(names)
    assert [value.type for value in values] == list(types)
    assert all(result.successful for result in results)


def test_every_parameter_service_of_every_node_answers(own_world):
    own_world.start("simulator", record="off")
    own_world.start("joystick")
    own_world.start("hover_hold")
    own_world.start("cockpit", arguments=["--attach", "--port", str(free_port())])
    terminal = Terminal(own_world.domain, own_world.folder)
    try:
        nodes = ("simulator", "control_mixer", "analysis", "recorder", "joystick", "hover_hold", "cockpit", "teleop")
        for name in nodes:
            check_parameters(own_world.client, name)
    finally:
        terminal.close()


def test_the_parameters_of_a_replay_answer_too(own_world):
    own_world.start("replay", arguments=[str(HOVER_STEP), "--loop"])
    check_parameters(own_world.client, "replay")
