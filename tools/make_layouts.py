"""Writes config/layouts/foxglove.json, lichtblick.json and plotjuggler.xml: `./run python tools/make_layouts.py`.

All show the same curves, listed once here. Foxglove turns angles into degrees, Lichtblick takes the topics that the
simulator's server has in degrees, and PlotJuggler shows radians.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

from sbs_sim.recording.degrees import EULER_ANGLES

FOLDER = Path(__file__).resolve().parent.parent / "config" / "layouts"
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b")
XYZ = ("x", "y", "z")
CONTROLS = ("collective", "lateral_cyclic", "longitudinal_cyclic", "differential_longitudinal_cyclic")
ROTORS = (0, 1)
LIVE = 30  # s of a live flight that Lichtblick shows
LEGEND, LETTER = 118, 8.5  # pixels of its width that Lichtblick is asked for without text, and for a letter
ATTITUDE = "Attitude, body to NED [-]"
ANGLES = "Attitude [deg]"  # in its place
Curve = tuple[str, str, str]  # path of the field, label, what Foxglove does with it
DEGREES, PLAIN = ".@degrees", ""

# tab: plots of it, each a title with the unit in Foxglove and curves
TABS: dict[str, dict[str, list[Curve]]] = {
    "Flight": {
        "Position NED [m]": [(f"/state.position.{axis}", name, PLAIN) for axis, name in zip(XYZ, "NED", strict=True)],
        "Velocity, body [m/s]": [
            (f"/state.velocity.{axis}", name, PLAIN) for axis, name in zip(XYZ, "uvw", strict=True)
        ],
        "Rates, body [deg/s]": [
            (f"/state.angular_velocity.{axis}", name, DEGREES) for axis, name in zip(XYZ, "pqr", strict=True)
        ],
        ATTITUDE: [(f"/state.attitude.{axis}", f"q{axis}", PLAIN) for axis in ("w", *XYZ)],
        "Controls [deg]": [(f"/controls.{name}", name.replace("_cyclic", ""), DEGREES) for name in CONTROLS],
        "Height [m]": [("/odom.pose.pose.position.z", "height", PLAIN)],
    },
    "Rotors": {
        "Flap a0, a1, b1 [deg]": [
            (f"/rotors.rotors[{j}].flap[{i}]", f"{name}({j + 1})", DEGREES)
            for j in ROTORS
            for i, name in enumerate(("a0", "a1", "b1"))
        ],
        "Lag xi0, xic, xis [deg]": [
            (f"/rotors.rotors[{j}].lag[{i}]", f"{name}({j + 1})", DEGREES)
            for j in ROTORS
            for i, name in enumerate(("xi0", "xic", "xis"))
        ],
        "Thrust [N]": [(f"/rotors.rotors[{j}].thrust", f"thrust({j + 1})", PLAIN) for j in ROTORS],
        "Power [W]": [(f"/rotors.rotors[{j}].power", f"power({j + 1})", PLAIN) for j in ROTORS],
        "Inflow [-]": [
            (f"/inflow.rotors[{j}].{field}", f"{name}({j + 1})", PLAIN)
            for j in ROTORS
            for field, name in (("uniform", "lambda0"), ("sine", "lambdas"), ("cosine", "lambdac"))
        ],
        "Swashplates [deg]": [
            (f"/swashplate.rotors[{j}].{field}{cyclic}", f"{field}({j + 1})", DEGREES)
            for j in ROTORS
            for field, cyclic in (("collective", ""), ("lateral", "_cyclic"), ("longitudinal", "_cyclic"))
        ],
    },
    "Simulation": {
        "Real-time factor [-]": [("/status.real_time_factor", "real-time factor", PLAIN)],
        "Missed and lost": [
            ("/status.missed_deadlines", "missed deadlines", PLAIN),
            ("/status.dropped_messages", "ticks not published", PLAIN),
            ("/status.log_dropped", "messages not logged", PLAIN),
        ],
    },
}


def main() -> None:
    """Write all."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "foxglove.json").write_text(json.dumps(foxglove(), indent=1) + "\n")
    (FOLDER / "lichtblick.json").write_text(json.dumps(lichtblick(), indent=1) + "\n")
    tree = ElementTree.ElementTree(plotjuggler())
    ElementTree.indent(tree, " ")
    tree.write(FOLDER / "plotjuggler.xml", encoding="UTF-8", xml_declaration=True)
    with (FOLDER / "plotjuggler.xml").open("a") as file:
        file.write("\n")


# --- Foxglove ---------------------------------------------------------------------------------------------------


def foxglove(shown: Mapping[str, Mapping[str, list[Curve]]] = TABS) -> dict:
    """Tabs of plots, in the last one a view from above and the health beside the plots."""
    panels: dict[str, dict] = {
        "3D!view": view(),
        "DiagnosticSummary!health": {"topicToRender": "/diagnostics", "minLevel": 0, "sortByLevel": True},
        "RawMessages!status": {"topicPath": "/status"},
        "RawMessages!events": {"topicPath": "/events"},
    }
    tabs = []
    for tab, plots in shown.items():
        names = []
        for number, (title, curves) in enumerate(plots.items()):
            names.append(f"Plot!{tab.lower()}{number}")
            panels[names[-1]] = foxglove_plot(title, curves)
        if tab == "Simulation":
            names = ["DiagnosticSummary!health", "RawMessages!status", *names, "RawMessages!events"]
        if tab == "Flight":
            names.append("3D!view")
        tabs.append({"title": tab, "layout": grid(names)})
    panels["Tab!all"] = {"activeTabIdx": 0, "tabs": tabs}
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": "Tab!all",
    }


def lichtblick() -> dict:
    """The same for Lichtblick, which knows no modifiers and shows paths and poses, but no odometry.

    It shows a flight live: plots and view follow it. Legends lie beside the curves, which fill the plots then. It gives
    messages the time at which they come, so that the plots take that of their headers where there is one.
    """
    layout = foxglove({tab: dict(readable(plots)) for tab, plots in TABS.items()})
    for panel in layout["configById"].values():
        if "paths" in panel:
            panel["lichtblickPanelTitle"] = panel.pop("foxglovePanelTitle")
            width = LEGEND + LETTER * max(len(path["label"]) for path in panel["paths"])
            panel |= {"followingViewWidth": LIVE, "legendDisplay": "left", "sidebarDimension": round(width)}
        for path in panel.get("paths", []):
            path["timestampMethod"] = "receiveTime" if path["value"].startswith("/controls.") else "headerStamp"
            path["value"] = in_degrees(path["value"])
    scene = layout["configById"]["3D!view"]
    scene |= {"followMode": "follow-position", "followTf": "base_link"}
    scene["cameraState"]["distance"] = 8
    scene["scene"] = {"transforms": {"showLabel": False, "axisScale": 0, "lineWidth": 0}}  # `frames` has dozens
    scene["topics"] = {"/odom_path": {"visible": True, "lineWidth": 0.05}, "/odom_pose": {"visible": True}}
    urdf = {"layerId": "foxglove.Urdf", "sourceType": "topic", "topic": "/robot_description", "visible": True}
    scene["layers"]["urdf"] = {"instanceId": "urdf", "label": "URDF", "order": 2, **urdf}
    return layout


def readable(plots: Mapping[str, list[Curve]]) -> Iterator[tuple[str, list[Curve]]]:
    """The plots, with roll, pitch and heading in place of the quaternion."""
    for name, curves in plots.items():
        if name == ATTITUDE:
            yield ANGLES, [(f"/state_deg.attitude_deg.{angle}", angle, PLAIN) for angle in EULER_ANGLES]
        else:
            yield name, curves


def in_degrees(path: str) -> str:
    """The field of the topic in degrees, see sbs_sim/recording/degrees.py, that holds what a path turns into them."""
    if not path.endswith(DEGREES):
        return path
    topic, *fields = path.removesuffix(DEGREES).split(".")
    holder = -2 if fields[-1] in XYZ else -1
    name, bracket, index = fields[holder].partition("[")
    fields[holder] = f"{name}_deg{bracket}{index}"
    return ".".join([f"{topic}_deg", *fields])


def view() -> dict:
    """Path and attitude of the aircraft in the axes of REP 103."""
    return {
        "cameraState": {"distance": 15, "perspective": True, "phi": 60, "thetaOffset": 45, "target": [0, 0, 0]},
        "followMode": "follow-none",
        "followTf": "odom",
        "layers": {"grid": {"instanceId": "grid", "layerId": "foxglove.Grid", "visible": True, "size": 40}},
        "topics": {"/odom": {"visible": True, "type": "arrow"}},
    }


def foxglove_plot(title: str, curves: list[Curve]) -> dict:
    """Plot over the time at which messages were logged, which is that of the simulation."""
    return {
        "foxglovePanelTitle": title,
        "paths": [
            {
                "value": path + change,
                "label": label,
                "enabled": True,
                "timestampMethod": "receiveTime",
                "color": COLOURS[number % len(COLOURS)],
            }
            for number, (path, label, change) in enumerate(curves)
        ],
        "xAxisVal": "timestamp",
        "isSynced": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showXAxisLabels": True,
        "showYAxisLabels": True,
    }


def grid(names: list[str]) -> str | dict:
    """Panels in two columns."""
    half = (len(names) + 1) // 2
    return split("row", [split("column", names[:half]), split("column", names[half:])])


def split(direction: str, parts: list) -> str | dict:
    """Parts of equal size side by side (row) or one above the other (column)."""
    parts = [part for part in parts if part]
    if len(parts) <= 1:
        return parts[0] if parts else ""
    rest = split(direction, parts[1:])
    return {"direction": direction, "first": parts[0], "second": rest, "splitPercentage": 100 / len(parts)}


# --- PlotJuggler ------------------------------------------------------------------------------------------------


def plotjuggler() -> ElementTree.Element:
    """Tabs of plots in two columns."""
    root = ElementTree.Element("root")
    window = ElementTree.SubElement(root, "tabbed_widget", name="Main Window", parent="main_window")
    for tab, plots in TABS.items():
        place = ElementTree.SubElement(window, "Tab", tab_name=tab, containers="1")
        container = ElementTree.SubElement(place, "Container")
        items = list(plots.items())
        half = (len(items) + 1) // 2
        columns = splitter(container, "|", 2)
        for part in (items[:half], items[half:]):
            rows = splitter(columns, "-", len(part))
            for title, curves in part:
                plotjuggler_plot(rows, title, curves)
    ElementTree.SubElement(window, "currentTabIndex", index="0")
    ElementTree.SubElement(root, "use_relative_time_offset", enabled="1")
    return root


def splitter(parent: ElementTree.Element, orientation: str, count: int) -> ElementTree.Element:
    """Areas of equal size: "|" side by side, "-" one above the other."""
    sizes = ";".join([f"{1 / count:.6f}"] * count)
    return ElementTree.SubElement(parent, "DockSplitter", orientation=orientation, count=str(count), sizes=sizes)


def plotjuggler_plot(parent: ElementTree.Element, title: str, curves: list[Curve]) -> None:
    """Plot in SI units: degrees of a title are radians here."""
    area = ElementTree.SubElement(parent, "DockArea", name=title.replace("deg", "rad"))
    options = {"mode": "TimeSeries", "style": "Lines", "flip_x": "false", "flip_y": "false"}
    plot = ElementTree.SubElement(area, "plot", options)
    ElementTree.SubElement(plot, "limitY")
    for number, (path, _, _) in enumerate(curves):
        name = path.replace(".", "/")
        ElementTree.SubElement(plot, "curve", name=name, color=COLOURS[number % len(COLOURS)])


if __name__ == "__main__":
    main()
