"""The ground: a level plane, and where the aircraft would touch it (theory.md section 7.5).

The model knows nothing of a fuselage's shape: what can touch are the centre of gravity and the rims of the rotor discs.
"""

import math

from sbs_sim.model import params as P
from sbs_sim.model.frames import rotation_rows
from sbs_sim.model.kernel import entry, kernel


@entry
def lowest_point(p, x):
    """Down coordinate of the lowest point of the aircraft [m].

    Parameters
    ----------
    p : Params
    x : ndarray, shape (size,)
        Simulation state.
    """
    return lowest(p, x)


@kernel
def lowest(p, x):
    """What `lowest_point` gives, for compiled callers."""
    rot = rotation_rows(x[3], x[4], x[5], x[6])
    down = x[2]
    for j in range(p.rotor.shape[0]):
        rotor, a = p.rotor[j], p.axes[j]
        hub = rot[6] * rotor[P.HUB_X] + rot[7] * rotor[P.HUB_Y] + rot[8] * rotor[P.HUB_Z]
        upright = rot[6] * a[0, 2] + rot[7] * a[1, 2] + rot[8] * a[2, 2]  # cosine of the shaft's angle to the vertical
        rim = x[2] + hub + rotor[P.RADIUS] * math.sqrt(max(0.0, 1.0 - upright * upright))
        down = max(down, rim)
    return down
