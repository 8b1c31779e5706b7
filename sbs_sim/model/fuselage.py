"""Drag of the fuselage as three flat plates (theory.md section 5)."""

from sbs_sim.lanes import Vector
from sbs_sim.model.kernel import kernel


@kernel
def plate_drag(density, areas, air):
    """Force at the c.g. in body axes [N].

    Parameters
    ----------
    density : lanes
        [kg/m^3]
    areas : Vector
        [m^2]
    air : Vector
        Velocity relative to the air, body axes [m/s].
    """
    half = -0.5 * density
    return Vector(
        half * areas.x * abs(air.x) * air.x, half * areas.y * abs(air.y) * air.y, half * areas.z * abs(air.z) * air.z
    )
