"""Air loads of lifting surfaces and of a fuselage with tables (theory.md sections 5.8 and 5.9)."""

from sbs_sim.lanes import ZERO, Vector, cross, dot, floor, maximum, select, sqrt, table_row, zeros_like
from sbs_sim.model import state as S
from sbs_sim.model.blade import ForceMoment
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import TINY, angle_of, inverse_root

DEGREE = 3  # of the interpolation along the angle of attack
# Columns of the ramps of a part: airspeed and change of the slope of the incidence over it; skew of the wake, and
# changes of the slopes of the wash over it.
AIRSPEED, INCIDENCE, SKEW, DOWN, AFT = range(5)
RAMP_COLUMNS = 5


@kernel
def surface_load(density, surface, ramps, shapes, commands, motion, omega, wash):
    """Load of a lifting surface, eq. (5.15).

    Parameters
    ----------
    density : lanes
        [kg/m^3]
    surface : record SURFACE
    ramps : lanes, shape (points, 5)
    shapes : ndarray, shape (cells, 16)
        Coefficients of lift and drag over the angle of attack.
    commands : lanes, shape (3 n_rows,)
        Swashplate angles, and behind them what else pilot controls command.
    motion, omega : Vector
        Velocity of the c.g. relative to the air [m/s] and angular velocity [rad/s], body axes.
    wash : Vector
        Velocity relative to the air that the wash of a rotor adds [m/s], body axes.

    Returns
    -------
    ForceMoment
        About the c.g., body axes [N, N m].
    """
    own = motion + cross(omega, surface.position)
    incidence = surface.incidence
    if surface.is_scheduled == 1:
        incidence = incidence + ramp(ramps, AIRSPEED, INCIDENCE, sqrt(dot(own, own)))
    if surface.command_index >= 0:
        incidence = incidence + commands[surface.command_index]
    local = own + wash
    u, w = local.x, dot(surface.down, local)
    squared = u * u + w * w + TINY
    inverse_speed = inverse_root(squared)
    alpha = angle_of(w, u, inverse_speed) + incidence
    position = (alpha - surface.first_alpha) * surface.inverse_alpha_step
    column = cell_of(position, surface.alpha_cells)
    lift, drag, _, _ = table_row(shapes, surface.first_row + column, position - column, DEGREE)
    scale = (density * surface.half_area) * (squared * inverse_speed)
    lift_gain, drag_gain = lift * scale, drag * scale
    ahead = lift_gain * w - drag_gain * u
    below = -(lift_gain * u + drag_gain * w)
    force = Vector(ahead, ZERO, ZERO) + surface.down * below
    return ForceMoment(force, cross(surface.position, force))


@kernel
def fuselage_load(density, fuselage, shapes, motion, omega, wash):
    """Load of a fuselage with tables, eq. (5.18); the parameters are those of `surface_load`."""
    local = motion + cross(omega, fuselage.position) + wash
    u, v, w = local.x, local.y, local.z
    plane_squared = u * u + w * w + TINY
    inverse_plane = inverse_root(plane_squared)
    plane = plane_squared * inverse_plane
    squared = plane_squared + v * v
    inverse_speed = inverse_root(squared)
    cos_alpha, sin_alpha = u * inverse_plane, w * inverse_plane
    cos_beta, sin_beta = plane * inverse_speed, v * inverse_speed
    along = (angle_of(w, u, inverse_plane) - fuselage.first_alpha) * fuselage.inverse_alpha_step
    across = (angle_of(v, plane, inverse_speed) - fuselage.first_beta) * fuselage.inverse_beta_step
    column, line = cell_of(along, fuselage.alpha_cells), cell_of(across, fuselage.beta_cells)
    row = fuselage.first_row + (line * fuselage.alpha_cells + column) * 3.0
    x, y = along - column, across - line
    drag, drag_rise, side, side_rise = table_row(shapes, row, x, DEGREE)
    lift, lift_rise, roll, roll_rise = table_row(shapes, row + 1.0, x, DEGREE)
    pitch, pitch_rise, yaw, yaw_rise = table_row(shapes, row + 2.0, x, DEGREE)
    ahead = Vector(cos_alpha * cos_beta, sin_beta, sin_alpha * cos_beta)
    right = Vector(-(cos_alpha * sin_beta), cos_beta, -(sin_alpha * sin_beta))
    down = Vector(-sin_alpha, ZERO, cos_alpha)
    pressure = 0.5 * density * squared
    force = (
        right * (pressure * (side + side_rise * y))
        - ahead * (pressure * (drag + drag_rise * y))
        - down * (pressure * (lift + lift_rise * y))
    )
    moment = (
        ahead * (pressure * (roll + roll_rise * y))
        + right * (pressure * (pitch + pitch_rise * y))
        + down * (pressure * (yaw + yaw_rise * y))
    )
    return ForceMoment(force, moment + cross(fuselage.position, force))


@kernel
def rotor_wash(part, ramps, rotor, flow, x):
    """Velocity relative to the air that the wash of a rotor adds at a part, eq. (5.17).

    Parameters
    ----------
    part : record SURFACE or FUSELAGE
    ramps : lanes, shape (points, 5)
        Of the part.
    rotor : record ROTOR
    flow : record
        Velocity of the hub relative to the air, hub axes [m/s].
    x : lanes, shape (size,)
        Simulation state.
    """
    induced = rotor.inflow_speed * rotor.radius * x[rotor.inflow + S.UNIFORM]
    edgewise, through = flow.velocity.x, abs(induced - flow.velocity.z)
    inverse = inverse_root(edgewise * edgewise + through * through + TINY)
    skew = angle_of(edgewise, through, inverse)
    down, aft = part.wash_down + ramp(ramps, SKEW, DOWN, skew), part.wash_aft + ramp(ramps, SKEW, AFT, skew)
    return rotor.axes @ Vector(aft * induced, ZERO, -(down * induced))


@kernel
def ramp(ramps, knots, changes, at):
    """Rise from its first point of a curve of straight lines, by the changes of its slope at the points."""
    total = zeros_like(at)
    for k in range(ramps.shape[0]):
        total = total + maximum(at - ramps[k, knots], 0.0) * ramps[k, changes]
    return total


@kernel
def cell_of(position, cells):
    """Cell of a grid at a position in widths of a cell; one of the grid for any position, NaN included."""
    column = floor(select(position > 0.0, position, 0.0))
    return select(column < cells, column, cells - 1.0)
