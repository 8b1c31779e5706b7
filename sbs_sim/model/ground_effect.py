"""Ground effect: what the ground takes from the induced velocity at the blades of a rotor (theory.md section 6.3).

I. C. Cheeseman, W. E. Bennett: The effect of the ground on a helicopter rotor in forward flight, ARC R&M 3021, 1955: a
source and its image. R. W. Prouty: Helicopter Performance, Stability, and Control: a measured curve.
"""

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import dot, maximum, minimum, rounded, select, sqrt, transposed
from sbs_sim.model import state as S
from sbs_sim.model.cubics import pieces
from sbs_sim.model.frames import shaft_down
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import TINY

NO_EFFECT, CHEESEMAN_BENNETT, MEASURED = range(3)  # in the order of `sbs_sim.aircraft.description.GROUND_EFFECTS`
LEAST_HEIGHT = 0.5  # over the radius; below it Cheeseman and Bennett's (R/4z)^2 goes on along its tangent
# Height over the diameter, and induced velocity over that far from the ground.
CURVE = np.array([[0.127, 0.627], [0.269, 0.737], [0.459, 0.830], [0.663, 0.901], [0.902, 0.955], [1.2, 1.0]])


def monotone_cubics(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of x^0 to x^3 from each point to the next, shape (len(points) - 1, 4); the curve ends level.

    F. N. Fritsch, J. Butland: A method for constructing local monotone piecewise cubic interpolants, SIAM Journal on
    Scientific and Statistical Computing 5, 1984: harmonic means of the slopes; at the beginning that of the first part.
    """
    width, rise = np.diff(points, axis=0).T
    secant = rise / width
    slope = np.zeros(len(points))
    slope[0] = secant[0]
    first, second = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    slope[1:-1] = (first + second) / (first / secant[:-1] + second / secant[1:])
    return pieces(points[:, 0], points[:, 1], slope)


CUBICS = monotone_cubics(CURVE)


@kernel
def ground_height(ground, rotor, position, down):
    """Height of a hub above the ground, across it, over the radius.

    `down` is the unit vector into the ground in body axes, `position` how far the c.g. is from the origin along it [m].
    """
    return (ground.depth - (position + dot(down, rotor.hub))) / rotor.radius


@kernel
def add_ground_wash(aircraft, memory, flight):
    """Add to the wash of every rotor what the ground takes from its own inflow, eqs. (6.12) to (6.15)."""
    ground, x = aircraft.ground[0], memory.state
    down = transposed(flight.to_earth) @ ground.down
    position = dot(ground.down, S.vector_at(x, S.POSITION))
    for j in range(aircraft.rotors.shape[0]):
        rotor, motion = aircraft.rotors[j], memory.flow[j].velocity
        height = maximum(ground_height(ground, rotor, position, down), 0.0)
        across = transposed(rotor.axes) @ down
        sinking = dot(across, motion)
        along = (dot(motion, motion) - sinking * sinking) * (rotor.inverse_tip_speed * rotor.inverse_tip_speed)
        uniform, sine, cosine = (
            x[rotor.inflow + S.UNIFORM],
            x[rotor.inflow + S.SINE],
            x[rotor.inflow + S.COSINE],
        )
        squared = rounded(uniform * uniform)
        share = squared / (squared + maximum(along, 0.0) + TINY)
        share = rounded(share * maximum(dot(down, shaft_down(rotor.axes)), 0.0))
        if aircraft.switches[0].ground_effect == CHEESEMAN_BENNETT:
            left = 1.0 - image_share(height) * share
            less = left * sqrt(left) - 1.0
        else:
            less = rounded((measured_ratio(0.5 * height) - 1.0) * share)
        wash = memory.wash
        wash[S.UNIFORM, j] = wash[S.UNIFORM, j] + less * uniform
        wash[S.SINE, j] = wash[S.SINE, j] + less * sine
        wash[S.COSINE, j] = wash[S.COSINE, j] + less * cosine


@kernel
def image_share(height):
    """(R/4z)^2 at a height over the radius; below `LEAST_HEIGHT` its tangent there."""
    above = maximum(height, LEAST_HEIGHT)
    steep = 0.125 / (LEAST_HEIGHT * LEAST_HEIGHT * LEAST_HEIGHT)
    return 0.0625 / (above * above) + steep * (above - height)


@kernel
def measured_ratio(height):
    """Induced velocity over that far from the ground, at a height over the diameter."""
    ratio = CUBICS[0, 0] + CUBICS[0, 1] * (height - CURVE[0, 0])  # below the lowest point along the tangent
    for i in range(CUBICS.shape[0]):
        h = minimum(height, CURVE[i + 1, 0]) - CURVE[i, 0]
        cubic = CUBICS[i, 0] + h * (CUBICS[i, 1] + h * (CUBICS[i, 2] + h * CUBICS[i, 3]))
        ratio = select(height > CURVE[i, 0], cubic, ratio)
    return select(height < CURVE[CURVE.shape[0] - 1, 0], ratio, 1.0)
