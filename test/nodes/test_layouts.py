"""Layouts of Foxglove, PlotJuggler and RViz: every field that they show is in a real log and in the interfaces."""

import json
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Schema
from ruamel.yaml import YAML

from sbs_sim.config_file import config_folder
from sbs_sim.recording import read
from sbs_sim.recording.cdr import decode
from sbs_sim.recording.definitions import parse, short_name
from sbs_sim.recording.degrees import Degrees

ROOT = Path(__file__).resolve().parents[2]
LAYOUTS = config_folder() / "layouts"
MODIFIERS = {"@degrees"}  # those of Foxglove's message paths that are used


@pytest.fixture(scope="module")
def log():
    return read(ROOT / "bags" / "hover_step.mcap")


def foxglove(name="foxglove"):
    return json.loads((LAYOUTS / f"{name}.json").read_text())


def foxglove_paths(name="foxglove"):
    panels = foxglove(name)["configById"].values()
    return [path["value"] for panel in panels for path in panel.get("paths", [])]


def plotjuggler_curves():
    tree = ElementTree.parse(LAYOUTS / "plotjuggler.xml")
    return [curve.attrib["name"] for curve in tree.iter("curve")]


def values_of(log, topic, field):
    """Values of a field of a log; the last index may be one within an array."""
    group = log[topic.lstrip("/")]
    if field in group:
        return group[field]
    array, index = re.fullmatch(r"(.*)\[(\d+)\]", field).groups()
    return group[array][:, int(index)]


def check(log, topic, field):
    values = np.asarray(values_of(log, topic, field), dtype=float)
    assert len(values) > 0
    assert np.all(np.isfinite(values))


def test_every_path_of_foxglove_is_in_the_log(log):
    paths = foxglove_paths()
    assert len(paths) > 40
    for path in paths:
        topic, _, rest = path.partition(".")
        *fields, last = rest.split(".")
        if last.startswith("@"):
            assert last in MODIFIERS
        else:
            fields.append(last)
        check(log, topic, ".".join(fields))


def test_every_path_of_lichtblick_is_of_a_topic_or_of_one_that_the_server_makes_in_degrees(log):
    in_degrees = {}
    with (ROOT / "bags" / "hover_step.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if f"{channel.topic}_deg" not in in_degrees:
                degrees = Degrees(schema.name, schema.data.decode())
                made = Schema(0, degrees.definition.encode(), "ros2msg", degrees.type_name)
                fields = decode(made, *parsed(made), [degrees.convert(message.data)])
                in_degrees[f"{channel.topic}_deg"] = fields
    paths = foxglove_paths("lichtblick")
    angles = [path for path in paths if "attitude" in path]
    assert [path.rpartition(".")[2] for path in angles] == ["roll", "pitch", "heading"]  # in place of a quaternion
    quaternion = [path for path in foxglove_paths() if "attitude" in path]
    assert len(paths) - len(angles) == len(foxglove_paths()) - len(quaternion)
    converted = sum("@degrees" in path for path in foxglove_paths())
    assert sum("_deg" in path for path in paths) == converted + len(angles)
    for path in paths:
        topic, _, field = path.partition(".")
        assert "@" not in path
        if topic in in_degrees:
            assert re.sub(r"\[\d+\]$", "", field) in in_degrees[topic]
        else:
            check(log, topic, field)


def test_plots_of_lichtblick_follow_the_time_of_headers(log):
    plots = [panel for panel in foxglove("lichtblick")["configById"].values() if "paths" in panel]
    assert len(plots) == len({panel["lichtblickPanelTitle"] for panel in plots}) > 10
    for panel in plots:
        assert panel["followingViewWidth"] > 0.0
        for path in panel["paths"]:
            topic = path["value"].partition(".")[0].removesuffix("_deg").lstrip("/")
            stamp = log[topic]["header.stamp.sec"] + 1e-9 * log[topic]["header.stamp.nanosec"]
            stamped = np.allclose(stamp, log[topic].time, rtol=0.0, atol=1e-9)
            assert path["timestampMethod"] == ("headerStamp" if stamped else "receiveTime")


def parsed(schema):
    """Definitions of a schema, and the name of its type in them."""
    return parse(schema.name, schema.data.decode()), short_name(schema.name)


def test_every_curve_of_plotjuggler_is_in_the_log(log):
    curves = plotjuggler_curves()
    assert len(curves) > 40
    for curve in curves:
        _, topic, *fields = curve.split("/")
        check(log, topic, ".".join(fields))


def test_topics_of_panels_are_those_of_the_log(log):
    panels = foxglove()["configById"]
    topics = {panel[key] for panel in panels.values() for key in ("topicPath", "topicToRender") if key in panel}
    topics |= {topic for panel in panels.values() for topic in panel.get("topics", {})}
    assert topics == {"/odom", "/diagnostics", "/status", "/events"}
    assert topics <= {f"/{topic.lstrip('/')}" for topic in log.topics}


@pytest.mark.parametrize("name", ["foxglove", "lichtblick"])
def test_every_panel_is_shown_once(name):
    layout = foxglove(name)

    def leaves(node):
        if isinstance(node, str):
            return [node]
        assert node["direction"] in ("row", "column")
        assert 0.0 < node["splitPercentage"] < 100.0
        return leaves(node["first"]) + leaves(node["second"])

    shown = leaves(layout["layout"])
    for name in list(shown):
        for tab in layout["configById"][name].get("tabs", []):
            shown += leaves(tab["layout"])
    assert sorted(shown) == sorted(layout["configById"])


def test_splitters_of_plotjuggler_have_as_many_areas_as_they_say():
    tree = ElementTree.parse(LAYOUTS / "plotjuggler.xml")
    splitters = list(tree.iter("DockSplitter"))
    assert splitters
    for splitter in splitters:
        assert len(splitter) == int(splitter.attrib["count"]) == len(splitter.attrib["sizes"].split(";"))


def test_rviz_shows_topics_of_the_simulator_and_sends_targets(log):
    config = YAML(typ="safe", pure=True).load((LAYOUTS / "sbs_sim.rviz").read_text())["Visualization Manager"]
    by_class = {entry["Class"].rpartition("/")[2]: entry for entry in config["Displays"] + config["Tools"]}
    assert by_class["Odometry"]["Topic"]["Value"] == "/odom"
    assert by_class["SetGoal"]["Topic"]["Value"] == by_class["Pose"]["Topic"]["Value"] == "/target"
    assert by_class["RobotModel"]["Description Topic"]["Value"] == "/robot_description"  # of the node frames
    assert config["Global Options"]["Fixed Frame"] == log["odom"]["header.frame_id"][0]
    assert log["odom"].type == "nav_msgs/msg/Odometry"


def test_the_layouts_are_those_of_their_script(tmp_path):
    code = (
        "import sys, pathlib; sys.path.insert(0, 'tools'); import make_layouts;"
        f"make_layouts.FOLDER = pathlib.Path({str(tmp_path)!r}); make_layouts.main()"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)
    for name in ("foxglove.json", "lichtblick.json", "plotjuggler.xml"):
        assert (tmp_path / name).read_text() == (LAYOUTS / name).read_text()
