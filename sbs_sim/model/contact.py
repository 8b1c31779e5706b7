"""Contact with the ground: skids and wheels as points with springs, dampers and friction (theory.md section 7.7).

Across the ground a one-sided spring and a damper that begins with the depth, as K. H. Hunt, F. R. E. Crossley:
Coefficient of restitution interpreted as damping in vibroimpact, Journal of Applied Mechanics 42, 1975, ask for: the
force begins at zero, and never pulls. Along it P. A. Cundall, O. D. L. Strack: A discrete numerical model for granular
assemblies, Geotechnique 29, 1979: a spring and a damper hold the point where it is until Coulomb's limit, and the
spring then gives way. Its deflections are states, so that what stands does not creep.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import (
    Vector,
    any_lane,
    as_lanes,
    as_records,
    cross,
    dot,
    maximum,
    minimum,
    rounded,
    seldom,
    select,
    sqrt,
    transposed,
    zeros_like,
)
from sbs_sim.model import state as S
from sbs_sim.model.blade import ForceMoment
from sbs_sim.model.frames import rotation
from sbs_sim.model.kernel import entry, kernel

TINY = 1e-30  # N^2; keeps the direction of no force finite
FORCE, DEPTH, CONTACT_SIZE = 0, 3, 4  # of what `contact_forces` gives


class Touch(NamedTuple):
    """A point and the ground.

    Attributes
    ----------
    depth : lanes
        Below the surface [m].
    normal : lanes
        Force of the ground across it, away from it [N].
    first, second : lanes
        Velocity of the point along the ground [m/s].
    ahead, aside : lanes
        Rolling direction of a wheel along the ground; of a skid without a meaning.
    """

    depth: Any
    normal: Any
    first: Any
    second: Any
    ahead: Any
    aside: Any


@kernel
def depth_of(ground, point, x, to_earth):
    """How far a point is below the ground [m]."""
    return dot(ground.down, S.vector_at(x, S.POSITION) + to_earth @ point.position) - ground.depth


@kernel
def touch(ground, point, x, to_earth, velocity, omega):
    """Depth, normal force and velocity of a point, eqs. (7.18) and (7.19)."""
    motion = to_earth @ (velocity + cross(omega, point.position))
    depth = depth_of(ground, point, x, to_earth)
    share = minimum(maximum(depth * point.inverse_onset, 0.0), 1.0)
    spring = point.stiffness * maximum(depth, 0.0)
    normal = maximum(spring + (point.damping * share) * dot(ground.down, motion), 0.0)
    wheel = to_earth @ point.rolling
    ahead, aside = dot(ground.first, wheel), dot(ground.second, wheel)
    scale = 1.0 / sqrt(ahead * ahead + aside * aside + TINY)
    return Touch(depth, normal, dot(ground.first, motion), dot(ground.second, motion), ahead * scale, aside * scale)


@kernel
def limited(point, touching, first, second):
    """Force along the ground within Coulomb's limit [N], eq. (7.20)."""
    most = rounded(point.friction * touching.normal)
    if point.is_wheel == 1:
        least = rounded(point.rolling_friction * touching.normal)
        along = first * touching.ahead + second * touching.aside  # of a wheel
        across = second * touching.ahead - first * touching.aside
        along, across = minimum(maximum(along, -least), least), minimum(maximum(across, -most), most)
        return along * touching.ahead - across * touching.aside, along * touching.aside + across * touching.ahead
    share = minimum(most / sqrt(first * first + second * second + TINY), 1.0)
    return rounded(first * share), rounded(second * share)


@kernel
def contact_force(ground, point, x, touching):
    """Force of the ground on a point, NED [N]."""
    side, damping = point.side_stiffness, point.side_damping
    first = side * x[point.state] + damping * touching.first
    second = side * x[point.state + 1] + damping * touching.second
    first, second = limited(point, touching, first, second)
    return -(ground.down * touching.normal + ground.first * first + ground.second * second)


@kernel
def contact_load(ground, contacts, memory, flight):
    """Load of the ground on the aircraft about the c.g., body axes [N, N m]; the rates of the deflections are kept."""
    none = 0.0 * flight.velocity.x
    force, moment = Vector(none, none, none), Vector(none, none, none)
    for i in range(contacts.shape[0]):
        memory.contact[0, i], memory.contact[1, i] = zeros_like(none), zeros_like(none)
    height = ground.depth - dot(ground.down, S.vector_at(memory.state, S.POSITION))
    if not seldom(any_lane(height < ground.reach)):
        return ForceMoment(force, moment)
    for i in range(contacts.shape[0]):
        point = contacts[i]
        if not any_lane(depth_of(ground, point, memory.state, flight.to_earth) > 0.0):
            continue
        touching = touch(ground, point, memory.state, flight.to_earth, flight.velocity, flight.omega)
        memory.contact[0, i] = select(touching.depth > 0.0, touching.first, 0.0)
        memory.contact[1, i] = select(touching.depth > 0.0, touching.second, 0.0)
        own = transposed(flight.to_earth) @ contact_force(ground, point, memory.state, touching)
        force, moment = force + own, moment + cross(point.position, own)
    return ForceMoment(force, moment)


@kernel
def set_contact_rates(contacts, rates, dx):
    """Set the rates of the deflections along the ground: the velocity of what touches it, as `contact_load` kept it."""
    for i in range(contacts.shape[0]):
        dx[contacts[i].state], dx[contacts[i].state + 1] = rates[0, i], rates[1, i]


@kernel
def give_way(ground, contacts, x):
    """Let the springs along the ground of a new state give way to Coulomb's limit, eq. (7.21)."""
    to_earth = rotation(S.attitude_at(x))
    velocity, omega = S.vector_at(x, S.VELOCITY), S.vector_at(x, S.RATES)
    for i in range(contacts.shape[0]):
        point = contacts[i]
        touching = touch(ground, point, x, to_earth, velocity, omega)
        first, second = point.side_stiffness * x[point.state], point.side_stiffness * x[point.state + 1]
        first, second = limited(point, touching, first, second)
        x[point.state], x[point.state + 1] = first / point.side_stiffness, second / point.side_stiffness


@entry
def contact_forces(model, states, out):
    """Forces of the ground on every point at some states.

    Parameters
    ----------
    model : Model
    states : ndarray, shape (m, size, n)
        Simulation states.
    out : ndarray, shape (m, n_points, CONTACT_SIZE, n)
        Output: force, body axes [N], and depth below the ground [m].
    """
    ground, contacts = as_records(model.ground), as_records(model.contacts)
    for i in range(states.shape[0]):
        x, rows = as_lanes(states[i], ground), as_lanes(out[i], ground)
        to_earth = rotation(S.attitude_at(x))
        velocity, omega = S.vector_at(x, S.VELOCITY), S.vector_at(x, S.RATES)
        for k in range(contacts.shape[0]):
            touching = touch(ground[0], contacts[k], x, to_earth, velocity, omega)
            force = transposed(to_earth) @ contact_force(ground[0], contacts[k], x, touching)
            rows[k, 0], rows[k, 1], rows[k, 2] = force.x, force.y, force.z
            rows[k, DEPTH] = touching.depth
