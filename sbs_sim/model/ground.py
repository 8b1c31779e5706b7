"""The ground: a level plane, and where the aircraft would touch it (theory.md section 7.5).

The fuselage has no shape: the centre of gravity and the rims of the rotor discs can touch the ground.
"""

from sbs_sim.lanes import as_lanes, as_records, dot, maximum, sqrt
from sbs_sim.model.frames import rotation, shaft_down
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.state import DOWN, attitude_at


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
    as_lanes(out, records)[0] = lowest_down_coordinate(records, as_lanes(x, records))


@kernel
def lowest_down_coordinate(rotors, x):
    """Down coordinate of the lowest point of the aircraft [m], eq. (7.9)."""
    down = rotation(attitude_at(x)).z  # the direction down in body axes
    lowest_down = x[DOWN]
    for j in range(rotors.shape[0]):
        rotor = rotors[j]
        cosine = dot(down, shaft_down(rotor.axes))  # of the shaft's angle to the vertical
        rim = rotor.radius * sqrt(maximum(1.0 - cosine * cosine, 0.0))  # below the hub
        lowest_down = maximum(lowest_down, x[DOWN] + dot(down, rotor.hub) + rim)
    return lowest_down
