"""What differs of the air from one part of an aircraft to another, in rows behind its velocity at the c.g.

Air that is the same everywhere has three rows: its velocity, NED. Air that is not has more. For each rotor there are
nine: how much the velocity at its hub differs from that at the c.g., and its change per metre along the x and along
the y axis of the hub, all in hub axes; the air is linear over a disc. Then come three for each lifting surface and for
the fuselage with tables: how much the velocity there differs, body axes. The number of rows is the switch.
"""

from sbs_sim.lanes import Vector, dot, spread
from sbs_sim.model.blade import to_blade
from sbs_sim.model.duct import sheltered
from sbs_sim.model.kernel import kernel
from sbs_sim.model.offset import Flow
from sbs_sim.model.records import GUST_ROWS, Model
from sbs_sim.model.section import SectionFlow, SpanFlow
from sbs_sim.model.state import vector_at

CG_ROWS, PART_ROWS = 3, 3
AT_HUB, ALONG_X, ALONG_Y = 0, 3, 6  # first rows of those of a rotor


def air_rows(model: Model) -> int:
    """Rows of air that is not the same everywhere."""
    return CG_ROWS + GUST_ROWS * len(model.rotors) + PART_ROWS * (len(model.surfaces) + len(model.fuselages))


@kernel
def in_space(air):
    """True for air that is not the same everywhere."""
    return air.shape[0] > CG_ROWS


@kernel
def gust_of_rotor(air, j):
    """Velocity of the air at the hub of a rotor less that at the c.g., hub axes [m/s]."""
    return vector_at(air, CG_ROWS + GUST_ROWS * j)


@kernel
def gust_of_part(aircraft, air, i):
    """Velocity of the air at a surface, or behind them the fuselage, less that at the c.g., body axes [m/s]."""
    return vector_at(air, CG_ROWS + GUST_ROWS * aircraft.rotors.shape[0] + PART_ROWS * i)


@kernel
def gust_of_blade(aircraft, air, blade, first):
    """Three rows of the rotors that blades belong to, hub axes."""
    rows, quad = aircraft.indices.gust, blade.quad
    return Vector(
        spread(air, rows[first], quad, blade),
        spread(air, rows[first + 1], quad, blade),
        spread(air, rows[first + 2], quad, blade),
    )


@kernel
def gust_along_blade(aircraft, air, blade, basis):
    """Change of the air's velocity from the hub to the flap hinge [m/s], and its slope along the blade [1/s].

    Along (y, t, u), within a duct if there is one. The position of a section in the disc is its distance from the hub
    along y and t.
    """
    by_x = gust_of_blade(aircraft, air, blade, ALONG_X)
    by_y = gust_of_blade(aircraft, air, blade, ALONG_Y)
    if aircraft.switches[0].ducts == 1:
        by_x, by_y = sheltered(blade.duct_turning, by_x), sheltered(blade.duct_turning, by_y)
    return change_along_blade(blade, basis, by_x, by_y)


@kernel
def free_gust_along_blade(aircraft, air, blade, basis):
    """The same without a duct."""
    by_x = gust_of_blade(aircraft, air, blade, ALONG_X)
    by_y = gust_of_blade(aircraft, air, blade, ALONG_Y)
    return change_along_blade(blade, basis, by_x, by_y)


@kernel
def change_along_blade(blade, basis, by_x, by_y):
    """Change to the flap hinge and slope along the blade of what changes along the axes of its hub."""
    c, s, sense = basis.cosine, basis.sine, blade.sense
    outwards = to_blade(blade, basis, by_y * (sense * s) - by_x * c)
    forwards = to_blade(blade, basis, by_x * s + by_y * (sense * c))
    hinge = outwards * (basis.lag_hinge.x + basis.flap_hinge.x) + forwards * basis.lag_hinge.y
    return hinge, outwards * basis.cos_flap


@kernel
def with_gust_gradients(aircraft, air, blade, basis, flow):
    """Flow along blades with the change of the air's velocity over their discs, eq. (4.2)."""
    hinge, slope = gust_along_blade(aircraft, air, blade, basis)
    return SectionFlow(
        u_t_hinge=flow.u_t_hinge - hinge.y,
        u_t_slope=flow.u_t_slope - slope.y,
        u_p_hinge=flow.u_p_hinge - dot(basis.normal, hinge),
        u_p_slope=flow.u_p_slope - dot(basis.normal, slope),
    )


@kernel
def span_with_gust_gradients(aircraft, air, blade, basis, along):
    """Flow along the span with the same change."""
    hinge, slope = gust_along_blade(aircraft, air, blade, basis)
    return SpanFlow(along.hinge - dot(basis.span, hinge), along.slope - dot(basis.span, slope))


@kernel
def offset_with_gust_gradients(aircraft, air, blade, basis, flow):
    """The same of blades with offsets, eq. (4.11): each section meets the air of its point on the pitch axis."""
    hinge, slope = gust_along_blade(aircraft, air, blade, basis)
    d, n = basis.span, basis.normal
    return Flow(
        start=flow.start - Vector(dot(d, hinge), hinge.y, dot(n, hinge)),
        slope=flow.slope - Vector(dot(d, slope), slope.y, dot(n, slope)),
        turn=flow.turn,
    )
