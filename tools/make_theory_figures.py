"""Draw the figures of docs/theory.md.

    ./run python tools/make_theory_figures.py [folder] [format]

writes docs/images/*.svg, or other files (png) into another folder, always with the same bytes for the same matplotlib.
"""

import itertools
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch, Polygon, Rectangle

from sbs_sim import Aircraft, simulate
from sbs_sim import trim as fly_trim

OUTPUT = Path(__file__).resolve().parent.parent / "docs" / "images"
STYLE = {
    "svg.hashsalt": "sbs_sim",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "mathtext.fontset": "dejavusans",
}
INK, FAINT, BLUE, RED, GREEN, PALE = "#222222", "#8a8a8a", "#1f5fa8", "#b3382c", "#2c7a4b", "#e8eef6"
Point = tuple[float, float]


def panel(figure: Figure, place: tuple[float, float, float, float], x: Point, y: Point, title: str = "") -> Axes:
    """Axes without frame in a part of the figure (left, bottom, width, height), equal scales."""
    axes = figure.add_axes(place)
    axes.set(xlim=x, ylim=y, aspect="equal")
    axes.set_axis_off()
    if title:
        axes.set_title(title, fontsize=10, color=INK)
    return axes


def arrow(
    axes: Axes,
    start: Point,
    end: Point,
    label: str = "",
    at: Point = (0.0, 0.0),
    color: str = INK,
    *,
    style: str = "-|>",
    width: float = 1.3,
    bend: float = 0.0,
    dashed: bool = False,
    size: float = 10.0,
) -> None:
    """Arrow from start to end; the label is put at its end, moved by `at`."""
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle=style,
            mutation_scale=11,
            linewidth=width,
            color=color,
            shrinkA=0,
            shrinkB=0,
            connectionstyle=f"arc3,rad={bend}",
            linestyle="--" if dashed else "-",
            zorder=3,
        )
    )
    if label:
        axes.text(end[0] + at[0], end[1] + at[1], label, color=color, ha="center", va="center", fontsize=size)


def line(axes: Axes, points: Sequence[Point], color: str = INK, width: float = 1.0, style: str = "-") -> None:
    """Line through points."""
    x, y = zip(*points, strict=True)
    axes.plot(x, y, color=color, linewidth=width, linestyle=style, solid_capstyle="butt")


def note(axes: Axes, at: Point, text: str, color: str = INK, size: float = 9.0, ha: str = "center") -> None:
    """Text centred at a point, or beginning or ending there."""
    axes.text(*at, text, color=color, fontsize=size, ha=ha, va="center", linespacing=1.35)


def angle(
    axes: Axes,
    centre: Point,
    radius: float,
    first: float,
    last: float,
    label: str,
    color: str = INK,
    out: float = 1.25,
    head: bool = True,
) -> None:
    """Arc from one direction to another [deg], with a head at the end and a label outside its middle."""
    turn = np.radians(np.linspace(first, last, 40))
    x, y = centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn)
    axes.plot(x, y, color=color, linewidth=1.0)
    if head:
        arrow(axes, (x[-4], y[-4]), (x[-1], y[-1]), color=color, width=1.0)
    middle = math.radians((first + last) / 2)
    note(
        axes,
        (centre[0] + out * radius * math.cos(middle), centre[1] + out * radius * math.sin(middle)),
        label,
        color,
        size=11,
    )


def extent(axes: Axes, start: Point, end: Point, label: str, at: Point, color: str = INK) -> None:
    """Dimension line between two points with a label near its middle."""
    arrow(axes, start, end, color=color, style="<|-|>", width=0.9)
    note(axes, ((start[0] + end[0]) / 2 + at[0], (start[1] + end[1]) / 2 + at[1]), label, color, size=11)


def unit(degrees: float) -> Point:
    """Direction of an angle [deg]."""
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def along(start: Point, direction: Point, length: float) -> Point:
    """Point at a distance from another."""
    return start[0] + length * direction[0], start[1] + length * direction[1]


# --- frames ---------------------------------------------------------------------------------------------------------


def frames() -> Figure:
    """Body and earth, seen from above and from the right."""
    figure = Figure(figsize=(9.2, 3.9), facecolor="white")
    _from_above(panel(figure, (0.0, 0.0, 0.58, 0.92), (-1.78, 1.78), (-1.25, 1.15), "from above, heading north"))
    _from_the_side(panel(figure, (0.58, 0.0, 0.42, 0.92), (-1.2, 1.3), (-1.15, 1.1), "from the right, not to scale"))
    return figure


def _from_above(axes: Axes) -> None:
    fuselage = [(0, 0.55), (0.12, 0.3), (0.12, -0.35), (0.05, -0.6), (-0.05, -0.6), (-0.12, -0.35), (-0.12, 0.3)]
    axes.add_patch(Polygon(fuselage, closed=True, facecolor=PALE, edgecolor=FAINT))
    line(axes, [(-0.95, 0), (0.95, 0)], FAINT, 2.5)
    for side, name in ((-1, "MR1 (left)\n$G=-1$"), (1, "MR2 (right)\n$G=+1$")):
        hub = (side * 0.95, 0.0)
        axes.add_patch(Circle(hub, 0.62, fill=False, edgecolor=BLUE, linewidth=1.2))
        axes.plot(*hub, "o", color=BLUE, markersize=4)
        for k in range(3):
            azimuth = math.radians(90 + 120 * k)
            tip = (hub[0] + side * 0.62 * math.sin(azimuth), hub[1] - 0.62 * math.cos(azimuth))
            line(axes, [hub, tip], BLUE, 2.0)
        # growing azimuth: from aft over the outer to the front side
        turn = np.radians(np.linspace(-50, -4, 30))
        x, y = hub[0] + side * 0.7 * np.cos(turn), hub[1] + 0.7 * np.sin(turn)
        axes.plot(x, y, color=RED, linewidth=1.4)
        arrow(axes, (x[-3], y[-3]), (x[-1], y[-1]), color=RED)
        note(axes, (hub[0], 0.84), name, BLUE)
        note(axes, (hub[0], -0.74), r"$\psi=0$", RED)
        note(axes, (hub[0] + side * 0.43, 0.13), r"$\psi=\frac{\pi}{2}$", RED)
        note(axes, (hub[0] - side * 0.36, -0.17), "retreats", FAINT, 8)
        note(axes, (hub[0] + side * 0.38, -0.17), "advances", FAINT, 8)
    arrow(axes, (0, 0), (0, 0.98), r"$x_B$", (0.13, 0.0))
    arrow(axes, (0, 0), (0.27, 0), r"$y_B$", (-0.03, 0.13))
    _into_the_page(axes, (0, 0), INK)
    note(axes, (-0.02, -0.17), r"$z_B$", size=10)
    corner = (-1.6, -1.1)
    arrow(axes, corner, (-1.6, -0.75), "$N$", (0.1, 0.02), GREEN)
    arrow(axes, corner, (-1.25, -1.1), "$E$", (0.07, 0.06), GREEN)
    _into_the_page(axes, corner, GREEN)
    note(axes, (-1.45, -1.2), "$D$", GREEN, 10)
    note(axes, (0.0, -1.05), r"$\mathbf{r}_{hub}=(0,\ \mp0.645,\ 0.066)$ m", INK, 9)


def _into_the_page(axes: Axes, at: Point, color: str) -> None:
    """Sign of an axis that points away from the reader."""
    size = 0.055
    axes.add_patch(Circle(at, size, facecolor="white", edgecolor=color, zorder=3))
    for side in (-1, 1):
        d = 0.7 * size
        axes.plot([at[0] - d, at[0] + d], [at[1] - side * d, at[1] + side * d], color=color, linewidth=0.9, zorder=4)


def _from_the_side(axes: Axes) -> None:
    pitch = 14.0
    forward, down = unit(pitch), (math.sin(math.radians(pitch)), -math.cos(math.radians(pitch)))

    def body(x: float, z: float) -> Point:
        return x * forward[0] + z * down[0], x * forward[1] + z * down[1]

    outline = [(0.55, 0.02), (0.3, -0.12), (-0.3, -0.12), (-0.65, -0.02), (-0.3, 0.14), (0.35, 0.14)]
    axes.add_patch(Polygon([body(*p) for p in outline], closed=True, facecolor=PALE, edgecolor=FAINT))
    hub = body(0, 0.24)
    line(axes, [body(-0.7, 0.24), body(0.7, 0.24)], BLUE, 2.5)
    axes.plot(*hub, "o", color=BLUE, markersize=5)
    axes.plot(0, 0, "o", color=INK, markersize=5)
    arrow(axes, (0, 0), body(0.98, 0), r"$x_B$", (0.02, 0.13))
    arrow(axes, (0, 0), body(0, 0.85), r"$z_B$", (0.13, 0.0))
    arrow(axes, hub, body(0, -0.6), r"$\mathbf{u}$ (thrust)", (0.02, 0.12), RED)
    line(axes, [(0, 0), (1.1, 0)], GREEN, 0.8, "--")
    note(axes, (0.98, -0.09), "horizon", GREEN, 8)
    angle(axes, (0, 0), 0.72, 0, pitch, r"$\theta$", out=1.12)
    arrow(axes, (-1.0, 0.75), (-1.0, 0.35), "$D$", (-0.1, 0.05), GREEN)
    arrow(axes, (-1.0, 0.75), (-0.6, 0.75), "$N$", (-0.02, 0.11), GREEN)
    note(axes, (-0.13, 0.03), "c.g.", size=9)
    note(axes, (-0.45, -0.55), "rotor plane,\n66 mm below the c.g.", BLUE, 9)
    arrow(axes, (-0.45, -0.42), (-0.36, -0.345), color=BLUE, width=0.8)
    arrow(axes, (0.6, 0.95), (0.6, 0.55), r"$\mathbf{g}$", (0.1, 0.02), FAINT)


# --- azimuth --------------------------------------------------------------------------------------------------------


def azimuth() -> Figure:
    """Azimuth and the directions of a blade on both senses of rotation."""
    figure = Figure(figsize=(8.8, 4.5), facecolor="white")
    for place, sense in (((0.0, 0.01, 0.5, 0.91), -1), ((0.5, 0.01, 0.5, 0.91), 1)):
        title = f"$G={sense:+d}$: {'counter-clockwise' if sense > 0 else 'clockwise'} from above"
        _blade_directions(panel(figure, place, (-1.55, 1.55), (-1.35, 1.45), title), sense)
    return figure


def _blade_directions(axes: Axes, sense: int) -> None:
    psi, lag = math.radians(62.0), math.radians(17.0)

    def page(x: float, y: float) -> Point:  # x forward is up, y right
        return y, x

    axes.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=FAINT, linewidth=0.8))
    arrow(axes, (0, 0), (0, 1.25), r"$x_h$", (0.13, 0.0), FAINT, width=1.0)
    arrow(axes, (0, 0), (1.25, 0), r"$y_h$", (0.0, 0.12), FAINT, width=1.0)
    line(axes, [(0, 0), (0, -1.15)], FAINT, 1.0, "--")
    note(axes, (0, -1.25), r"$\psi=0$ (aft)", FAINT)
    radial = page(-math.cos(psi), sense * math.sin(psi))
    motion = page(math.sin(psi), sense * math.cos(psi))
    hinge = along((0, 0), radial, 0.42)
    line(axes, [(0, 0), along((0, 0), radial, 1.0)], INK, 1.0, "--")
    line(axes, [(0, 0), hinge], INK, 3.0)
    arrow(axes, (0, 0), along((0, 0), radial, 1.3), r"$\mathbf{e}_y$", (0.1 * sense, -0.06), width=1.0)
    arrow(axes, hinge, along(hinge, motion, 0.5), r"$\mathbf{e}_t$", (0.09 * sense, 0.07))
    y_axis = (
        math.cos(lag) * radial[0] - math.sin(lag) * motion[0],
        math.cos(lag) * radial[1] - math.sin(lag) * motion[1],
    )
    t_axis = (
        math.sin(lag) * radial[0] + math.cos(lag) * motion[0],
        math.sin(lag) * radial[1] + math.cos(lag) * motion[1],
    )
    line(axes, [hinge, along(hinge, y_axis, 0.6)], BLUE, 3.0)
    arrow(axes, hinge, along(hinge, y_axis, 0.88), r"$\mathbf{y}$", (0.02 * sense, -0.1), BLUE)
    arrow(axes, hinge, along(hinge, t_axis, 0.5), r"$\mathbf{t}$", (0.12 * sense, 0.0), BLUE)
    axes.plot(*hinge, "o", color=INK, markersize=6, markerfacecolor="white")
    direction = math.degrees(math.atan2(radial[1], radial[0]))
    angle(axes, (0, 0), 0.3, -90, direction if sense > 0 else direction - 360 * (direction > 0), r"$\psi_k$", RED, 1.35)
    lagged = math.degrees(math.atan2(y_axis[1], y_axis[0]))
    if sense < 0:
        direction, lagged = direction % 360, lagged % 360
    angle(axes, hinge, 0.56, direction, lagged, r"$\xi$", BLUE, 1.18)
    spin = np.radians(np.linspace(35, 75, 30)) if sense > 0 else np.radians(np.linspace(145, 105, 30))
    axes.plot(1.1 * np.cos(spin), 1.1 * np.sin(spin), color=RED, linewidth=1.4)
    arrow(
        axes,
        (1.1 * math.cos(spin[-3]), 1.1 * math.sin(spin[-3])),
        (1.1 * math.cos(spin[-1]), 1.1 * math.sin(spin[-1])),
        color=RED,
    )
    middle = spin[15]
    note(axes, (1.24 * math.cos(middle), 1.24 * math.sin(middle)), r"$\Omega$", RED, 12)


# --- hinges ---------------------------------------------------------------------------------------------------------


def hinges() -> Figure:
    """Lag and flap hinge of one blade, from above and from the side."""
    figure = Figure(figsize=(9.0, 6.5), facecolor="white")
    _lag_hinge(
        panel(figure, (0.0, 0.47, 1.0, 0.49), (-0.6, 6.2), (-1.5, 1.0), "from above (along $-\\mathbf{u}$), $G=+1$")
    )
    _flap_hinge(
        panel(figure, (0.0, 0.0, 1.0, 0.42), (-0.6, 6.2), (-0.7, 1.5), "from the side (along $\\mathbf{t}$), $G=+1$")
    )
    return figure


def _lag_hinge(axes: Axes) -> None:
    lag = -14.0
    direction, across = unit(lag), unit(lag + 90)
    hinge = (1.1, 0.0)
    flap = along(hinge, direction, 0.75)
    tip = along(flap, direction, 3.2)
    line(axes, [(0, 0), (5.6, 0)], FAINT, 0.9, "--")
    line(axes, [(0, 0), hinge], INK, 4)
    line(axes, [hinge, flap], INK, 4)
    line(axes, [flap, tip], BLUE, 6)
    axes.plot(0, 0, "o", color=INK, markersize=9, markerfacecolor="white")
    note(axes, (-0.32, 0.0), "shaft")
    axes.plot(*hinge, "o", color=INK, markersize=8, markerfacecolor="white")
    note(axes, (1.1, 0.62), "lag hinge\n(about $\\mathbf{u}$)")
    arrow(axes, (1.1, 0.42), (1.1, 0.12), color=FAINT, width=0.8)
    mark = [along(flap, across, 0.16), along(flap, across, -0.16)]
    line(axes, mark, INK, 3)
    note(axes, (2.25, 0.62), "flap hinge\n(about $\\mathbf{t}$)")
    arrow(axes, (2.1, 0.42), (1.88, -0.02), color=FAINT, width=0.8)
    arrow(axes, (5.0, 0), (5.75, 0), r"$\mathbf{e}_y$", (0.0, 0.15), width=1.0)
    arrow(axes, (4.4, 0), (4.4, 0.62), r"$\mathbf{e}_t$", (0.16, 0.03), width=1.0)
    arrow(axes, tip, along(tip, direction, 0.6), r"$\mathbf{y}$", (0.1, -0.1), BLUE, width=1.0)
    foot = along(flap, direction, 2.2)
    arrow(axes, foot, along(foot, across, 0.75), r"$\mathbf{t}$", (0.14, 0.0), BLUE, width=1.0)
    angle(axes, hinge, 2.05, 0, lag, r"$\xi>0$", BLUE, 1.15)
    extent(axes, (0, -0.3), (1.1, -0.3), "$e_L$", (0, -0.17))
    low = along((0, 0), across, -0.32)
    extent(axes, (hinge[0] + low[0], hinge[1] + low[1]), (flap[0] + low[0], flap[1] + low[1]), "$e_F$", (-0.03, -0.19))
    extent(axes, (flap[0] + low[0], flap[1] + low[1]), (tip[0] + low[0], tip[1] + low[1]), "$L=R-e_0$", (-0.1, -0.2))
    arrow(axes, (5.0, 0.55), (5.0, 1.0), "motion", (0.38, -0.1), RED)


def _flap_hinge(axes: Axes) -> None:
    flap_angle = 16.0
    direction, normal = unit(flap_angle), unit(flap_angle + 90)
    flap = (1.85, 0.0)
    tip = along(flap, direction, 3.2)
    line(axes, [(0, -0.45), (0, 1.1)], FAINT, 0.9, "--")
    arrow(axes, (0, 0), (0, 1.15), r"$\mathbf{u}$", (-0.15, 0.0), width=1.0)
    line(axes, [(0, 0), flap], INK, 4)
    line(axes, [flap, (5.5, 0)], FAINT, 0.9, "--")
    line(axes, [flap, tip], BLUE, 6)
    line(axes, [(1.1, -0.16), (1.1, 0.16)], INK, 3)
    axes.plot(*flap, "o", color=INK, markersize=8, markerfacecolor="white")
    arrow(axes, (5.0, 0), (5.75, 0), r"$\mathbf{y}$", (0.0, 0.15), width=1.0)
    arrow(axes, tip, along(tip, direction, 0.65), r"$\mathbf{d}$", (0.05, 0.14), BLUE, width=1.0)
    point = along(flap, direction, 2.2)
    arrow(axes, point, along(point, normal, 0.7), r"$\mathbf{n}$", (-0.13, 0.03), BLUE, width=1.0)
    centre = along(flap, direction, 1.35)
    axes.plot(*centre, "o", color=BLUE, markersize=7, markerfacecolor="white")
    note(axes, (centre[0] + 0.05, centre[1] + 0.27), r"$m_b,\ r_G$", BLUE, 10)
    angle(axes, flap, 3.0, 0, flap_angle, r"$\beta$", BLUE, 1.06)
    extent(axes, (0, -0.3), (1.85, -0.3), "$e_0=e_L+e_F$", (0, -0.2))
    shift = along((0, 0), normal, -0.24)
    start, end = (flap[0] + shift[0], flap[1] + shift[1]), (point[0] + shift[0], point[1] + shift[1])
    extent(axes, start, end, "$s$", (0.08, -0.17))
    note(axes, (1.6, 0.72), "spring $K_\\beta$")
    arrow(axes, (1.7, 0.6), (1.83, 0.12), color=FAINT, width=0.8)


# --- section --------------------------------------------------------------------------------------------------------


def section() -> Figure:
    """Velocities and forces of a blade section, seen from the tip for G = +1."""
    figure = Figure(figsize=(8.8, 3.7), facecolor="white")
    left = panel(figure, (0.0, 0.0, 0.5, 0.9), (-1.7, 2.6), (-1.4, 1.85), "velocity of the section relative to the air")
    right = panel(figure, (0.5, 0.0, 0.5, 0.9), (-2.0, 2.3), (-1.4, 1.85), "forces on the element")
    pitch, flow = 30.0, 14.0
    for axes in (left, right):
        _profile(axes, pitch)
        line(axes, [(-1.45, 0), (1.5, 0)], FAINT, 0.8, "--")
    speed = 2.3
    end = along((0, 0), unit(flow), speed)
    arrow(left, (0, 0), end, r"$\mathbf{V}$", (0.02, 0.16), RED, width=1.6)
    arrow(left, (0, 0), (end[0], 0), r"$u_T$", (-0.35, -0.18), BLUE)
    arrow(left, (end[0], 0), end, r"$u_P$", (0.22, -0.27), BLUE)
    chord = along((0, 0), unit(pitch), 1.9)
    line(left, [(0, 0), chord], INK, 0.8, "--")
    angle(left, (0, 0), 1.35, 0, flow, r"$\varphi$", RED, 1.1)
    angle(left, (0, 0), 1.72, flow, pitch, r"$\alpha$", INK, 1.1)
    line(left, [(0, 0), along((0, 0), unit(pitch + 180), 1.6)], INK, 0.8, "--")
    angle(left, (0, 0), 1.42, 180, 180 + pitch, r"$\theta_s$", INK, 1.14)
    arrow(left, (-1.3, 0.65), (-1.3, 1.4), r"$\mathbf{n}$", (0.15, 0.0), width=1.0)
    arrow(left, (-1.3, 0.65), (-0.55, 0.65), r"$\mathbf{t}$", (0.05, 0.16), width=1.0)
    note(left, (0.6, -1.1), r"$\varphi=\mathrm{atan2}(u_P,u_T),\quad \alpha=\theta_s-\varphi$", size=10)
    lift_direction, drag_direction = unit(flow + 90), unit(flow + 180)
    lift, drag = along((0, 0), lift_direction, 1.5), along((0, 0), drag_direction, 0.75)
    total = (lift[0] + drag[0], lift[1] + drag[1])
    arrow(right, (0, 0), lift, r"$\mathrm{d}L$", (0.2, 0.05), BLUE)
    arrow(right, (0, 0), drag, r"$\mathrm{d}D$", (-0.2, 0.05), BLUE)
    arrow(right, (0, 0), total, r"$\mathrm{d}\mathbf{F}$", (-0.25, 0.05), RED, width=1.6)
    line(right, [lift, total], FAINT, 0.8, ":")
    line(right, [drag, total], FAINT, 0.8, ":")
    arrow(right, (0, 0), along((0, 0), unit(flow), 1.7), r"$\mathbf{V}$", (0.16, 0.06), RED, width=1.0)
    note(right, (1.0, -0.75), r"$\mathrm{d}F_n\propto c_l u_T-c_d u_P$", size=10)
    note(right, (1.0, -1.1), r"$\mathrm{d}F_t\propto -(c_l u_P+c_d u_T)$", size=10)
    return figure


def _profile(axes: Axes, pitch: float) -> None:
    """A symmetric section with its nose at 30 % of the chord ahead of the origin."""
    x = (1 - np.cos(np.linspace(0, math.pi, 60))) / 2
    y = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    outline = np.vstack([np.column_stack([x, y]), np.column_stack([x, -y])[::-1]])
    outline = 1.7 * (np.array([0.3, 0.0]) - outline * [1, -1])
    c, s = unit(pitch)
    axes.add_patch(Polygon(outline @ np.array([[c, s], [-s, c]]), closed=True, facecolor=PALE, edgecolor=FAINT))


# --- offsets --------------------------------------------------------------------------------------------------------


def offsets() -> Figure:
    """A swept blade from above, and one of its sections from the tip for G = +1."""
    figure = Figure(figsize=(9.2, 3.5), facecolor="white")
    above = panel(figure, (0.0, 0.0, 0.56, 0.88), (-0.5, 7.6), (-1.9, 2.0), "from above")
    _swept_blade(above)
    across = panel(figure, (0.58, 0.0, 0.42, 0.88), (-2.0, 2.2), (-1.35, 1.75), "a section from the tip")
    pitch = 25.0
    _profile(across, pitch)
    forward = unit(pitch)
    axis = along((0, 0), forward, -0.34)
    line(across, [(axis[0] - 1.2, axis[1]), (axis[0] + 2.0, axis[1])], FAINT, 0.8, "--")
    line(across, [along(axis, forward, -1.2), along(axis, forward, 1.8)], INK, 0.8, "--")
    across.plot(*axis, "o", color=INK, markersize=4)
    quarter, centre = along((0, 0), forward, 0.085), along(axis, forward, -0.3)
    across.plot(*quarter, "o", color=BLUE, markersize=5)
    across.plot(*centre, "s", color=RED, markersize=5)
    note(across, (axis[0] + 0.1, axis[1] - 0.26), r"$\mathbf{d}$, pitch axis", INK, 9, "left")
    arrow(across, quarter, along(quarter, unit(95), 0.85), "lift", (0.0, 0.14), BLUE)
    note(across, (quarter[0] + 0.75, quarter[1] - 0.02), "$x_c > 0$", BLUE, 11)
    note(across, (centre[0] - 0.35, centre[1] + 0.3), "$x_m < 0$", RED, 11)
    angle(across, axis, 1.6, 0, pitch, r"$\vartheta$", INK, 1.12)
    arrow(across, (-1.7, 0.7), (-1.7, 1.4), r"$\mathbf{n}$", (0.15, 0.0), width=1.0)
    arrow(across, (-1.7, 0.7), (-1.0, 0.7), r"$\mathbf{t}$", (0.08, 0.16), width=1.0)
    return figure


def _swept_blade(axes: Axes) -> None:
    """Hinges at the left, the blade to the right, its motion upwards; the tip is swept."""
    chord, inner, outer, tip, back = 1.0, 1.0, 5.2, 6.6, -0.75
    nose, tail = 0.42, 0.42 - chord
    shape = [(inner, nose), (outer, nose), (tip, nose + back), (tip, tail + back), (outer, tail), (inner, tail)]
    axes.add_patch(Polygon(shape, closed=True, facecolor=PALE, edgecolor=FAINT))
    line(axes, [(-0.3, 0), (7.3, 0)], INK, 0.9, "-.")
    note(axes, (-0.3, 0.2), "pitch axis", INK, 9, "left")
    quarter = nose - 0.25 * chord
    line(axes, [(inner, quarter), (outer, quarter), (tip, quarter + back)], BLUE, 1.6)
    line(axes, [(inner, -0.1), (outer, -0.1), (tip, -0.1 + 0.9 * back)], RED, 1.2, "--")
    note(axes, (2.9, 0.75), "quarter chords, $x_c(s)$", BLUE, 10)
    note(axes, (2.9, -0.9), "centres of gravity, $x_m(s)$", RED, 10)
    start = (outer, quarter)
    line(axes, [start, (tip + 0.6, quarter)], FAINT, 0.8, ":")
    sweep = math.degrees(math.atan2(back, tip - outer))
    angle(axes, start, 1.5, 0, sweep, r"$\Lambda$", BLUE, 1.14)
    arrow(axes, (0.3, 0.7), (0.3, 1.6), r"$\mathbf{t}$", (0.2, 0.0), width=1.0)
    arrow(axes, (0.3, 0.7), (1.2, 0.7), r"$\mathbf{d}$", (0.15, 0.15), width=1.0)
    across = unit(sweep + 90)
    middle = ((outer + tip) / 2, quarter + back / 2)
    arrow(axes, middle, along(middle, across, 1.15), r"$u_\nu$", (0.22, 0.08), BLUE)


# --- inflow ---------------------------------------------------------------------------------------------------------


def inflow() -> Figure:
    """The three inflow states over the disc, and the skew of the wake."""
    figure = Figure(figsize=(9.6, 2.9), facecolor="white")
    titles = (
        r"$\lambda_0$",
        r"$\lambda_c>0$, from the left",
        r"$\lambda_s>0$, from behind, $G=+1$",
        "wake in forward flight",
    )
    width = 0.25
    for i, title in enumerate(titles):
        axes = panel(figure, (i * width, 0.0, width, 0.9), (-1.4, 1.4), (-1.5, 1.15), title)
        if i < 3:
            _profile_of_inflow(axes, i)
        else:
            _wake(axes)
    return figure


def _profile_of_inflow(axes: Axes, which: int) -> None:
    line(axes, [(-1.0, 0), (1.0, 0)], INK, 3)
    for x in np.linspace(-1, 1, 9):
        # from the left the nose points to the left, so that the aft side (psi = 0) is on the right
        value = 0.55 if which == 0 else 0.62 * x
        if abs(value) > 1e-9:
            arrow(axes, (x, 0), (x, -value), color=BLUE, width=1.1)
    if which == 0:
        line(axes, [(-1, -0.55), (1, -0.55)], BLUE, 0.8, "--")
        note(axes, (0, -0.95), r"$v_i=\Omega R\,\lambda_0$", BLUE, 10)
        note(axes, (0, 0.25), "positive downwards", FAINT, 9)
        return
    line(axes, [(-1, 0.62), (1, -0.62)], BLUE, 0.8, "--")
    formulas = (r"$\Omega r\,\lambda_c\cos\psi$", r"$\Omega r\,\lambda_s\sin\psi$")
    note(axes, (-0.2, -0.95), formulas[which - 1], BLUE, 10)
    if which == 1:
        note(axes, (0.95, 0.28), "aft\n$\\psi=0$", RED, 9)
        note(axes, (-0.95, -0.28), "fore\n$\\psi=\\pi$", RED, 9)
    else:
        note(axes, (0.8, 0.3), "advancing\n$\\psi=\\pi/2$", RED, 9)
        note(axes, (-0.8, -0.3), "retreating\n$\\psi=3\\pi/2$", RED, 9)


def _wake(axes: Axes) -> None:
    skew = 52.0
    down = (math.sin(math.radians(skew)), -math.cos(math.radians(skew)))
    line(axes, [(-0.95, 0.35), (0.25, 0.35)], INK, 3)
    for x in (-0.95, 0.25):
        line(axes, [(x, 0.35), along((x, 0.35), down, 1.3)], FAINT, 1.0, "--")
    centre = (-0.35, 0.35)
    line(axes, [centre, (centre[0], -1.0)], FAINT, 0.9, "--")
    arrow(axes, centre, along(centre, down, 1.35), color=BLUE)
    angle(axes, centre, 1.1, -90, -90 + skew, r"$\chi$", BLUE, 1.13)
    arrow(axes, (-0.35, 0.8), (-1.0, 0.8), r"flight, $\mu_x>0$", (0.62, 0.2), RED)
    arrow(axes, centre, (centre[0] + 0.9, 0.35), r"$\mu$", (0.12, 0.0), INK, width=1.0)
    arrow(axes, centre, (centre[0], -0.32), r"$\lambda$", (-0.14, 0.0), INK, width=1.0)
    note(axes, (0.0, -1.35), r"$X=\tan(\chi/2)=\mu/(V_T+|\lambda|)$", INK, 10)


# --- mass matrix ----------------------------------------------------------------------------------------------------


def mass_matrix() -> Figure:
    """Arrow shape of the mass matrix of body and blades, and what is left of it."""
    figure = Figure(figsize=(9.2, 4.5), facecolor="white")
    axes = panel(figure, (0.0, 0.0, 1.0, 1.0), (-0.8, 34.2), (-19.6, 1.6))
    body, blades = 6, 6
    size = body + 2 * blades
    axes.add_patch(Rectangle((0, -size), size, size, facecolor="white", edgecolor=INK, linewidth=1.2))
    axes.add_patch(Rectangle((0, -body), body, body, facecolor="#c9d8ea", edgecolor=INK))
    note(axes, (body / 2, -body / 2), "$\\mathbf{J}$\n$6\\times6$", size=12)
    for i in range(blades):
        at = body + 2 * i
        for k, color, name in ((0, "#dbe9dd", r"A_1"), (1, "#f3dfd6", r"A_2")):
            place = at + k
            axes.add_patch(Rectangle((place, -body), 1, body, facecolor=color, edgecolor=FAINT, linewidth=0.6))
            axes.add_patch(Rectangle((0, -place - 1), body, 1, facecolor=color, edgecolor=FAINT, linewidth=0.6))
            axes.add_patch(Rectangle((place, -place - 1), 1, 1, facecolor=color, edgecolor=INK, linewidth=0.8))
            if i == 0:
                note(axes, (place + 0.5, -place - 0.5), f"${name}$", size=8)
        note(axes, (at + 1, 0.65), f"blade {i + 1}" if i in (0, 5) else r"$\cdots$" if i == 2 else "", FAINT, 8)
    note(axes, (body + 0.5, -body / 2), r"$\mathbf{c}_\beta$", size=9)
    note(axes, (body + 1.5, -body / 2), r"$\mathbf{c}_\xi$", size=9)
    note(axes, (body / 2, -body - 0.5), r"$\mathbf{c}_\beta^T$", size=9)
    note(axes, (body / 2, -body - 1.5), r"$\mathbf{c}_\xi^T$", size=9)
    note(axes, (14.6, -8.3), "blades meet in the\nbody only; flap and\nlag share no inertia", FAINT, 8)
    note(axes, (9.6, -15.6), "zero", FAINT, 8)
    for y, text in (
        (-2.2, r"$\mathbf{a}_g$"),
        (-4.0, r"$\dot{\mathbf{\omega}}$"),
        (-11.2, r"$\ddot\beta_k$"),
        (-13.0, r"$\ddot\xi_k$"),
    ):
        note(axes, (size + 1.2, y), text, size=12)
    for x in (size + 0.35, size + 2.05):
        line(axes, [(x, 0), (x, -size)], INK, 1.0)
    note(axes, (size + 2.9, -9), "=", size=13)
    note(axes, (size + 4.3, -body / 2), r"$\mathbf{b}$", size=12)
    note(axes, (size + 4.3, -11.3), r"$Q_\beta$", size=12)
    note(axes, (size + 4.3, -13.1), r"$Q_\xi$", size=12)
    for x in (size + 3.5, size + 5.1):
        line(axes, [(x, 0), (x, -size)], INK, 1.0)
    left = 26.6
    arrow(axes, (24.0, -9), (26.0, -9), color=INK)
    axes.add_patch(Rectangle((left, -6), 6, 6, facecolor="#c9d8ea", edgecolor=INK))
    note(axes, (left + 3, -3), r"$\mathbf{J}-\sum\frac{\mathbf{c}\,\mathbf{c}^T}{A}$", size=11)
    note(axes, (left + 3, 0.8), "blades eliminated", FAINT, 9)
    note(axes, (left + 3.1, -8.3), r"$\mathbf{b}-\sum\mathbf{c}\,\frac{Q}{A}$", size=11)
    note(axes, (left + 3.1, -6.9), "against", FAINT, 9)
    note(axes, (left + 3.1, -12.4), "then, blade by blade,", FAINT, 9)
    note(
        axes,
        (left + 3.1, -14.2),
        r"$\ddot\beta=\frac{1}{A_1}\left(Q_\beta-\mathbf{c}_\beta\cdot(\mathbf{a}_g,\dot\omega)\right)$",
        size=9,
    )
    note(
        axes,
        (left + 3.1, -16.4),
        r"$\ddot\xi=\frac{1}{A_2}\left(Q_\xi-\mathbf{c}_\xi\cdot(\mathbf{a}_g,\dot\omega)\right)$",
        size=9,
    )
    note(axes, (9, -19.0), r"two rotors of three blades: $6+2\times6=18$ unknowns", FAINT, 9)
    return figure


# --- trim -----------------------------------------------------------------------------------------------------------


def trim_flow() -> Figure:
    """Newton's method with its path, and the paper's two loops."""
    figure = Figure(figsize=(9.4, 6.2), facecolor="white")
    _newton_flow(panel(figure, (0.0, 0.0, 0.46, 0.94), (0, 10), (0, 13), "Newton's method"))
    _loops_flow(panel(figure, (0.46, 0.0, 0.54, 0.94), (0, 11.7), (0, 13), "two nested loops (paper, section 2.2)"))
    return figure


def box(axes: Axes, centre: Point, size: Point, text: str, color: str = PALE) -> None:
    """Rounded box with text."""
    x, y = centre[0] - size[0] / 2, centre[1] - size[1] / 2
    axes.add_patch(
        FancyBboxPatch(
            (x, y), *size, boxstyle="round,pad=0.02,rounding_size=0.15", facecolor=color, edgecolor=INK, linewidth=0.9
        )
    )
    note(axes, centre, text, size=8.5)


def _newton_flow(axes: Axes) -> None:
    stages = (
        ("first guess: momentum and\nblade-element theory", 12.2),
        ("Newton at hover, and from it\nat the wanted condition", 10.6),
        ("path from hover: step / 2 where there\nis no solution, else x 1.5", 9.0),
        ("Newton from the first guess\nat the condition itself", 7.4),
        ("path of growing weight and drag", 5.8),
        ("paths from other speeds", 4.2),
    )
    for text, height in stages:
        box(axes, (3.9, height), (6.6, 1.0), text)
    for (_, upper), (_, lower) in itertools.pairwise(stages):
        arrow(axes, (3.9, upper - 0.5), (3.9, lower + 0.5))
    box(axes, (8.75, 7.4), (2.3, 1.9), "within the\nlimits, no\nstalled rotor:\ndone", "#dbe9dd")
    line(axes, [(8.75, 4.2), (8.75, 6.45)], INK, 1.2)
    line(axes, [(8.75, 10.6), (8.75, 8.35)], INK, 1.2)
    for _, height in stages[1:]:
        line(axes, [(7.2, height), (8.75 if height != 7.4 else 7.6, height)], INK, 1.2)
    box(
        axes,
        (5, 2.1),
        (8.6, 1.2),
        "the best of what was found, else an error\nthat says what stops the trim",
        "#f3dfd6",
    )
    arrow(axes, (3.9, 3.7), (3.9, 2.7))
    note(axes, (5.6, 3.2), "nothing of that kind", FAINT, 8)


def _loops_flow(axes: Axes) -> None:
    axes.add_patch(Rectangle((0.75, 1.75), 9.7, 9.65, fill=False, edgecolor=FAINT, linewidth=1.0, linestyle="--"))
    note(axes, (9.2, 11.1), "outer loop", FAINT, 9)
    axes.add_patch(Rectangle((1.25, 3.55), 8.7, 4.55, fill=False, edgecolor=FAINT, linewidth=1.0, linestyle="--"))
    note(axes, (8.75, 7.8), "inner loop", FAINT, 9)
    box(axes, (5, 12.2), (6.4, 0.9), "(a) first guess: attitude, controls,\nflap, lag, inflow")
    box(axes, (5, 10.3), (7.2, 1.0), "(b, c) at every azimuth configuration: flap\nand lag whose accelerations vanish")
    box(axes, (5, 8.75), (7.2, 0.8), "(d) mean of the multiblade coordinates")
    box(
        axes,
        (5, 6.95),
        (7.2, 1.0),
        "(e, f, g) attitude and controls: mean force and\nmoment vanish at held flap and lag",
    )
    box(axes, (5, 5.5), (7.2, 0.8), "(h) half the way to the steady inflow")
    box(axes, (5, 4.2), (7.2, 0.7), "no unknown changes any more?")
    box(axes, (5, 2.5), (7.2, 0.8), "flap and lag do not change any more?")
    box(
        axes,
        (5, 0.75),
        (8.4, 1.0),
        "complete averaged equations fulfilled:\ntrim, else an error that says so",
        "#dbe9dd",
    )
    for start, end in ((11.75, 10.8), (9.8, 9.15), (8.35, 7.45), (6.45, 5.9), (5.1, 4.55)):
        arrow(axes, (5, start), (5, end))
    arrow(axes, (5, 3.85), (5, 2.9))
    note(axes, (5.45, 3.3), "yes", FAINT, 8)
    arrow(axes, (5, 2.1), (5, 1.25))
    note(axes, (5.45, 1.5), "yes", FAINT, 8)
    line(axes, [(8.6, 4.2), (9.4, 4.2), (9.4, 6.95)], INK, 1.2)
    arrow(axes, (9.4, 6.95), (8.6, 6.95))
    note(axes, (9.05, 4.45), "no", FAINT, 8)
    line(axes, [(8.6, 2.5), (10.2, 2.5), (10.2, 10.3)], INK, 1.2)
    arrow(axes, (10.2, 10.3), (8.6, 10.3))
    note(axes, (9.2, 2.75), "no", FAINT, 8)


def power() -> Figure:
    """Where the power goes after a step of collective (docs/howto/power.md)."""
    aircraft = Aircraft.load("sbs")
    cruise = fly_trim(aircraft, airspeed=10.0)
    steps = [cruise.controls + [0.02 * (i >= 20), 0.0, 0.0, 0.0] for i in range(101)]
    flight = simulate(aircraft, cruise, steps, duration=1.0, outputs=["power_balance"])
    figure = Figure(figsize=(7.2, 3.4))
    axes = figure.add_axes((0.1, 0.15, 0.66, 0.8))
    shown = ("engine", "induced", "profile", "gravity", "kinetic_body", "kinetic_blades", "apparent_mass")
    for name, color in zip(shown, (INK, BLUE, GREEN, RED, FAINT, "#8e5ea2", "#d18a1c"), strict=True):
        axes.plot(flight["time"], flight[f"power_{name}"], color=color, label=name, linewidth=1.3)
    axes.set(xlabel="time [s]", ylabel="power [W]", xlim=(0.0, 1.0))
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    return figure


FIGURES = {
    "frames": frames,
    "azimuth": azimuth,
    "hinges": hinges,
    "section": section,
    "offsets": offsets,
    "inflow": inflow,
    "mass_matrix": mass_matrix,
    "trim": trim_flow,
    "power": power,
}


def main(folder: str | Path = OUTPUT, suffix: str = "svg") -> None:
    """Write all figures."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        with rc_context(STYLE):
            metadata = {"Date": None} if suffix == "svg" else {}
            draw().savefig(target / f"{name}.{suffix}", metadata=metadata, dpi=130)


if __name__ == "__main__":
    main(*sys.argv[1:3])
