"""The ground: a plane, and where the aircraft would touch it (theory.md section 7.5).

The fuselage has no shape: the centre of gravity and the rims of the rotor discs can touch the ground.
"""

from sbs_sim.lanes import as_lanes, as_records, dot, maximum, sqrt, transposed
from sbs_sim.model.frames import rotation, shaft_down
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.state import POSITION, attitude_at, vector_at


@entry
def lowest_point(ground, rotors, x, out):
    """Distance along `ground.down` from the origin to the lowest point of the aircraft [m].

    Parameters
    ----------
    ground : structured ndarray GROUND, shape (1,)
    rotors : structured ndarray ROTOR, shape (n_rotors,)
    x : ndarray, shape (size, n)
        Simulation states.
    out : ndarray, shape (1, n)
        Output.
    """
    records = as_records(rotors)
    as_lanes(out, records)[0] = lowest_coordinate(as_records(ground)[0], records, as_lanes(x, records))


@kernel
def lowest_coordinate(ground, rotors, x):
    """Distance along `ground.down` from the origin to the lowest point of the aircraft [m], eq. (7.9)."""
    down = transposed(rotation(attitude_at(x))) @ ground.down  # in body axes
    level = dot(ground.down, vector_at(x, POSITION))
    lowest = level + 0.0
    for j in range(rotors.shape[0]):
        rotor = rotors[j]
        cosine = dot(down, shaft_down(rotor.axes))  # of the shaft's angle to the vertical
        rim = rotor.radius * sqrt(maximum(1.0 - cosine * cosine, 0.0))  # below the hub
        lowest = maximum(lowest, level + dot(down, rotor.hub) + rim)
    return lowest
