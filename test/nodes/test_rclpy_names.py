"""Our nodes set nothing that rclpy keeps under the same name."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "robustness"))
import rclpy_names

# Lyrical moved these into a base class or made them: rclpy pull requests 1637 and 1645
LYRICAL = {
    *(f"_create_{kind}_handle" for kind in ("publisher", "subscription", "service", "client")),
    *("_create_service", "_parameter_event_publisher", "_type_description_service", "_time_source", "_clock"),
    *("wait_for_node", "get_clock"),
}


def test_no_node_takes_a_name_of_rclpy():
    assert rclpy_names.clashes(rclpy_names.installed()) == []


def test_no_node_takes_a_name_of_lyrical():
    own = rclpy_names.classes(sorted(rclpy_names.OURS.glob("*.py")))
    nodes = [found for name, found in own.items() if "Node" in rclpy_names.roots(name, own)]
    assert len(nodes) > 10
    assert {name for found in nodes for name in rclpy_names.names_of(found) & LYRICAL} == set()


def test_a_taken_name_is_found(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from rclpy.node import Node\n\n\nclass Base(Node):\n    pass\n\n\n"
        "class Mine(Base):\n    def __init__(self):\n        self._services, self._free = [], 0\n\n"
        "    def get_clock(self):\n        return None\n"
    )
    assert rclpy_names.clashes(rclpy_names.installed(), tmp_path) == [
        "Mine._services is a name of rclpy's Node",
        "Mine.get_clock is a name of rclpy's Node",
    ]
