"""The ground: a level plane, and where the aircraft would touch it (theory.md section 7.5).

The model knows nothing of a fuselage's shape: what can touch are the centre of gravity and the rims of the rotor discs.
"""

from sbs_sim.lanes import Vector, as_lanes, as_records, dot, greatest, sqrt
from sbs_sim.model.frames import rotation
from sbs_sim.model.kernel import entry, kernel


@entry
def lowest_point(rotors, x, out):
    """Down coordinate of the lowest point of the aircraft [m].

    Parameters
    ----------
    rotors : structured ndarray ROTOR, shape (n_rotors,)
    x : ndarray, shape (size, n)
        Simulation states.
    out : ndarray, shape (1, n)
        Output.
    """
    records = as_records(rotors)
    as_lanes(out, records)[0] = lowest(records, as_lanes(x, records))


@kernel
def lowest(rotors, x):
    """What `lowest_point` gives, for compiled callers."""
    down = rotation(x[3], x[4], x[5], x[6]).z  # the direction down in body axes
    deepest = x[2]
    for j in range(rotors.shape[0]):
        rotor = rotors[j]
        shaft = Vector(rotor.axes.x.z, rotor.axes.y.z, rotor.axes.z.z)
        upright = dot(down, shaft)  # cosine of the shaft's angle to the vertical
        rim = rotor.radius * sqrt(greatest(1.0 - upright * upright, 0.0))
        deepest = greatest(deepest, x[2] + dot(down, rotor.hub) + rim)
    return deepest
