"""Pilot controls as the page shows them."""

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft


def axes_of(aircraft: Aircraft) -> NDArray[np.int64]:
    """Indices of the controls that heave, roll, pitch and yaw; empty where the page has no controls to move."""
    return aircraft.axis_controls if aircraft.has_axes else np.empty(0, dtype=np.int64)


def control_label(name: str) -> str:
    """Short name of a control: "Lateral" of lateral_cyclic."""
    words = name.split("_")
    return (words[0] if words[-1] == "cyclic" else " ".join(words)).capitalize()
