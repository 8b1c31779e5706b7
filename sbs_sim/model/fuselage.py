"""Drag of the fuselage as three flat plates (theory.md section 5)."""

from sbs_sim.model.kernel import kernel


@kernel
def plate_drag(density, area_x, area_y, area_z, u, v, w):
    """Force at the c.g. in body axes [N] for the velocity u, v, w relative to the air [m/s]."""
    half = -0.5 * density
    return half * area_x * abs(u) * u, half * area_y * abs(v) * v, half * area_z * abs(w) * w
