"""Working state of each rotor, and how far it is outside of the validity of the model (theory.md section 6.1)."""

from sbs_sim.lanes import (
    Vector,
    add_to_quads,
    as_lanes,
    dot,
    maximum,
    select,
    sqrt,
    transposed,
    zeros_like,
)
from sbs_sim.model import state as S
from sbs_sim.model.dynamics import in_lanes, memory_in_lanes
from sbs_sim.model.frames import rotation
from sbs_sim.model.ground_effect import ground_height
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.records import OTHERS
from sbs_sim.model.separation import interpolated
from sbs_sim.model.trigonometry import TINY, angle_of, inverse_root

# columns of a rotor's row
ADVANCE_RATIO, HOVER_INFLOW, DESCENT, FLOW, STALLED, REVERSED, OUTSIDE, HEIGHT, BEHIND = range(9)
WORKING_SIZE = 9

# rows of the stall angles
NUMBER, HIGHEST, LOWEST, LEAST, MOST = range(5)


@entry
def working_state(model, work, out):
    """Working state of every rotor at the instant of the last `derivative`.

    Parameters
    ----------
    model : Model
    work : Work
        As the derivative left it.
    out : ndarray, shape (n_rotors, WORKING_SIZE, n)
        Output: advance ratio; hover inflow ratio of the present thrust, a_w sqrt(2 |C_T|); velocity of the hub against
        the thrust and flow through the disc with it, both over the tip speed; shares of the disc, between flap hinge
        and tip, where sections are stalled, where the flow comes from behind, and where the Reynolds or Mach number
        is outside of the airfoil's table, as the blades meet it now; height of the hub above the ground over the
        radius; how far the hub is behind that of another rotor whose wake is swept back over it, over the radius of
        that, 0 where there is none.
    """
    aircraft, memory = in_lanes(model), memory_in_lanes(work)
    angles, rows = as_lanes(model.stall, aircraft.blades), as_lanes(out, aircraft.rotors)
    for r in range(aircraft.blades.shape[0]):
        blade = aircraft.blades[r]
        fractions = disc_fractions(aircraft, blade, memory.terms[r], angles[r])
        add_to_quads(memory.hubs, blade.quad, blade.starts_quad, "force", fractions)
    ground = aircraft.ground[0]
    down = transposed(rotation(S.attitude_at(memory.state))) @ ground.down
    position = dot(ground.down, S.vector_at(memory.state, S.POSITION))
    for j in range(aircraft.rotors.shape[0]):
        rotor, row, flow = aircraft.rotors[j], rows[j], memory.flow[j].velocity
        thrust, scale = memory.totals[j].thrust, rotor.inverse_tip_speed
        thrust_sign = select(thrust >= 0.0, 1.0, -1.0)  # a negative thrust turns the flow over
        through = flow.z * scale
        row[ADVANCE_RATIO] = sqrt(flow.x * flow.x + flow.y * flow.y) * scale
        row[HOVER_INFLOW] = rotor.duct_expansion * sqrt(2.0 * abs(thrust) * rotor.coefficient_scale)
        row[DESCENT] = thrust_sign * through
        flow_through = memory.state[rotor.inflow] - through
        if aircraft.switches[0].wash == 1:
            flow_through = flow_through + memory.wash[OTHERS, j]
        row[FLOW] = thrust_sign * flow_through
        found, area = Vector(0.0, 0.0, 0.0), zeros_like(scale)
        for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
            own = memory.hubs[quad]
            found, area = found + own.force, area + own.moment.x
        row[HEIGHT] = ground_height(ground, rotor, position, down)
        row[BEHIND] = zeros_like(scale)
        row[STALLED], row[REVERSED], row[OUTSIDE] = found.x / area, found.y / area, found.z / area
    for k in range(aircraft.pairs.shape[0]):
        row = rows[aircraft.pairs[k].target]
        row[BEHIND] = maximum(row[BEHIND], behind(aircraft, memory, aircraft.pairs[k]))


@kernel
def behind(aircraft, memory, pair):
    """How far the hub of a pair's target is behind that of its source, whose wake goes aft more than down."""
    source, target = aircraft.rotors[pair.source], aircraft.rotors[pair.target]
    flow = memory.flow[pair.source].velocity
    offset = transposed(source.axes) @ (target.hub - source.hub)
    speed = sqrt(flow.x * flow.x + flow.y * flow.y + TINY)
    inverse = 1.0 / (speed * source.radius)
    aft = -(offset.x * flow.x + offset.y * flow.y) * inverse
    aside = abs(offset.x * flow.y - offset.y * flow.x) * inverse
    through = abs(memory.state[source.inflow] - flow.z * source.inverse_tip_speed)
    swept = (speed * source.inverse_tip_speed > through) & (aside * source.radius < source.radius + target.radius)
    return select(swept, maximum(aft, 0.0), 0.0)


@kernel
def disc_fractions(aircraft, blade, terms, angles):
    """Areas of the disc, up to a common factor: stalled, in reverse flow, outside of the airfoil table, and all."""
    elements = aircraft.elements[blade.elements]
    area = stalled = reversed_ = outside = zeros_like(terms.pitch)
    for i in range(elements.shape[0]):
        element = elements[i]
        part = (blade.hinge_offset + element.span) * element.half_area / element.chord
        ut, up = terms.u_t_hinge + terms.u_t_slope * element.span, terms.u_p_hinge + terms.u_p_slope * element.span
        squared = ut * ut + up * up + TINY
        inverse_speed = inverse_root(squared)
        alpha = terms.pitch + element.twist - angle_of(up, ut, inverse_speed)
        number = squared * inverse_speed * element.number_scale
        low, high, least, most = limits(angles[0], number)
        for k in range(1, angles.shape[0]):
            is_outboard, own = element.airfoil >= float(k), limits(angles[k], number)
            low, high = select(is_outboard, own[0], low), select(is_outboard, own[1], high)
            least, most = select(is_outboard, own[2], least), select(is_outboard, own[3], most)
        backwards = ut <= 0.0
        attached = (alpha >= low) & (alpha <= high)
        area = area + part
        reversed_ = reversed_ + select(backwards, part, 0.0)
        stalled = stalled + select(backwards | attached, 0.0, part)
        known = (number >= least) & (number <= most)
        outside = outside + select(known, 0.0, part)
    return stalled, reversed_, outside, area


@kernel
def limits(angles, number):
    """Angles of attack between which an airfoil is not stalled, and numbers between which its table holds."""
    low = interpolated(angles[NUMBER], angles[LOWEST], number)
    high = interpolated(angles[NUMBER], angles[HIGHEST], number)
    return low, high, angles[LEAST][0], angles[MOST][0]
