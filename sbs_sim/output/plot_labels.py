"""Names beside poles, where they cover no other name and few poles."""

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

Array = NDArray[np.float64]

PLAIN: dict[str, Any] = {"parse_math": False}  # names come from files and messages: a $ begins no formula
LABEL_SIZE = 7.5  # points
SAME_PLACE = 8.0  # pixels between poles that cannot be distinguished
LABEL_ANGLES = (15, -15, 165, -165, 60, -60, 120, -120, 90, -90)  # deg, in the order of preference
LABEL_DISTANCES = (8, 16, 26, 38, 52, 70, 90, 115)  # points


def name_poles(
    axes: Axes,
    poles: Mapping[str, complex],
    dots: NDArray[np.complex128],
    size: float = LABEL_SIZE,
    joined: Callable[[list[str]], str] = "\n".join,
) -> None:
    """Write every name beside its pole, with a line between them; the layout of the figure is settled.

    Parameters
    ----------
    axes : Axes
        Real part over imaginary part.
    poles : mapping of str to complex
    dots : ndarray of complex
        All that is drawn and not to be covered.
    size : float
        Of the letters [points].
    joined : callable
        One text of the names of poles that cannot be distinguished.
    """
    pixels = _pixels(axes, dots)
    taken: list[Bbox] = []
    for pole, names in _together(axes, poles):
        label = axes.annotate(
            joined(names),
            (pole.real, pole.imag),
            xytext=(0.0, 0.0),
            textcoords="offset points",
            fontsize=size,
            linespacing=1.1,
            va="center",
            arrowprops={"arrowstyle": "-", "color": "0.5", "linewidth": 0.5, "shrinkA": 0.0, "shrinkB": 2.0},
            zorder=3,
            **PLAIN,
        )
        label.set_in_layout(False)  # however long a name is, the axes keep their room
        taken.append(_place(label, axes.bbox, pixels, taken))


def _pixels(axes: Axes, poles: NDArray[np.complex128]) -> Array:
    return np.asarray(axes.transData.transform(np.column_stack([poles.real, poles.imag])))


def _together(axes: Axes, poles: Mapping[str, complex]) -> list[tuple[complex, list[str]]]:
    """Poles, the uppermost first, each with the names of all that are there as far as one can see."""
    groups: list[tuple[complex, list[str]]] = []
    for name in sorted(poles, key=lambda name: (-poles[name].imag, -poles[name].real)):
        for pole, names in groups:
            if np.abs(np.diff(_pixels(axes, np.array([pole, poles[name]])), axis=0)).max() < SAME_PLACE:
                names.append(name)
                break
        else:
            groups.append((poles[name], [name]))
    return groups


def _place(label: Annotation, frame: Bbox, dots: Array, taken: list[Bbox]) -> Bbox:
    """Move a label to the best of the positions to try; the box that it fills."""
    figure = label.get_figure(root=True)
    axes = label.axes
    assert isinstance(axes, Axes)
    assert figure is not None
    dots_per_point = figure.dpi / 72.0
    origin = _pixels(axes, np.array([complex(*label.xy)]))[0]
    # as a text: the box of an annotation has its line in it
    size = Text.get_window_extent(label, figure.canvas.get_renderer())  # type: ignore[attr-defined]
    positions = [(distance, math.radians(angle)) for distance in LABEL_DISTANCES for angle in LABEL_ANGLES]
    costs = []
    for distance, angle in positions:
        along, up = math.cos(angle), math.sin(angle)
        x, y = origin + distance * dots_per_point * np.array([along, up])
        x -= {"left": 0.0, "center": 0.5, "right": 1.0}[_side(along)] * size.width
        box = Bbox.from_bounds(x, y - size.height / 2, size.width, size.height).padded(1.0)
        costs.append((_cost(box, frame, dots, taken) + distance / 50.0, box))
    best = min(range(len(costs)), key=lambda i: costs[i][0])
    distance, angle = positions[best]
    label.set_position((distance * math.cos(angle), distance * math.sin(angle)))
    label.set_horizontalalignment(_side(math.cos(angle)))
    return costs[best][1]


def _side(along: float) -> Literal["left", "center", "right"]:
    """Side of a text that is next to its pole."""
    return "left" if along > 0.1 else "right" if along < -0.1 else "center"


def _cost(box: Bbox, frame: Bbox, dots: Array, taken: list[Bbox]) -> float:
    """How bad a position is: names on names, outside of the frame, poles covered."""
    inside = (dots[:, 0] > box.x0) & (dots[:, 0] < box.x1) & (dots[:, 1] > box.y0) & (dots[:, 1] < box.y1)
    outside = box.x0 < frame.x0 or box.x1 > frame.x1 or box.y0 < frame.y0 or box.y1 > frame.y1
    return 20.0 * sum(box.overlaps(other) for other in taken) + 50.0 * outside + float(inside.sum())
