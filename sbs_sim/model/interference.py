"""Wash of rotors on one another (theory.md section 6.5)."""

from sbs_sim.lanes import Vector, any_lane, floor, maximum, minimum, rounded, select, sqrt, table_row
from sbs_sim.model import state as S
from sbs_sim.model.inflow import MIN_FLOW
from sbs_sim.model.kernel import kernel
from sbs_sim.model.records import OTHERS

DEGREE = 3  # of the table along each component of the skew
TURNING = 0.25  # flow through the disc, over the inflow, below which the wake has no direction of its own
VALUES = 3  # in a cell: mean, slope forward, slope to the right


@kernel
def add_interference(aircraft, memory):
    """Add to the wash of every rotor what the inflow of the others makes of the flow through its disc."""
    for k in range(aircraft.pairs.shape[0]):
        pair = aircraft.pairs[k]
        target, i = aircraft.rotors[pair.target], pair.target
        mean, ahead, right = influence(aircraft, memory, pair)
        uniform = memory.state[aircraft.rotors[pair.source].inflow + S.UNIFORM]
        for_blades, wash = pair.blade_scale * uniform + 0.0, memory.wash
        wash[S.UNIFORM, i] = wash[S.UNIFORM, i] + for_blades * mean
        wash[S.COSINE, i] = wash[S.COSINE, i] - for_blades * ahead  # psi = 0 is aft
        wash[S.SINE, i] = wash[S.SINE, i] + (target.sense * for_blades) * right
        wash[OTHERS, i] = wash[OTHERS, i] + (pair.flow_scale * uniform) * mean


@kernel
def influence(aircraft, memory, pair):
    """Mean flow through the target and its slopes forward and to the right for a unit of inflow of the source.

    The skew of the wake is that of eq. (6.4), from the flow that the source has without the others. Where hardly any
    air goes through its disc, the wake passes from below it to above, eq. (6.22).
    """
    source, table = aircraft.rotors[pair.source], aircraft.influences
    mu, uniform = memory.flow[pair.source].velocity * source.inverse_tip_speed, memory.state[source.inflow + S.UNIFORM]
    through = uniform - mu.z
    reach = maximum(TURNING * abs(uniform), MIN_FLOW)
    turns = abs(through) < reach
    size = select(turns, (through * through + reach * reach) / (2.0 * reach), abs(through))
    total = sqrt(mu.x * mu.x + mu.y * mu.y + size * size + MIN_FLOW * MIN_FLOW)
    inverse = (0.5 * pair.cells) / (total + size)
    x, y = mu.x * inverse + 0.5 * pair.cells, mu.y * inverse + 0.5 * pair.cells
    column, line = cell_within(x, pair.cells), cell_within(y, pair.cells)
    cell, above = column * pair.cells + line, pair.cells * pair.cells
    row, x, y = pair.first_row + VALUES * cell, x - column, y - line
    mean, ahead, right = cell_values(table, row + select(through < 0.0, VALUES * above, 0.0), x, y)
    if any_lane(turns):
        down, up = cell_values(table, row, x, y), cell_values(table, row + VALUES * above, x, y)
        ratio = minimum(maximum(through / reach, -1.0), 1.0)
        share = 0.5 + rounded(ratio * (0.75 - 0.25 * ratio * ratio))
        mean = select(turns, up[0] + share * (down[0] - up[0]), mean)
        ahead = select(turns, up[1] + share * (down[1] - up[1]), ahead)
        right = select(turns, up[2] + share * (down[2] - up[2]), right)
    return mean, ahead, right


@kernel
def cell_values(table, row, x, y):
    """Mean, slope forward and slope to the right in a cell of the table."""
    a, b, c, d = table_row(table, row, x, DEGREE)
    e, f, g, h = table_row(table, row + 1.0, x, DEGREE)
    p, q, r, s = table_row(table, row + 2.0, x, DEGREE)
    return a + y * (b + y * (c + y * d)), e + y * (f + y * (g + y * h)), p + y * (q + y * (r + y * s))


@kernel
def met_with_wash(memory, j, mu):
    """Velocity of a hub relative to the air that the other rotors move, over the tip speed, hub axes."""
    return Vector(mu.x, mu.y, mu.z - memory.wash[OTHERS, j])


@kernel
def cell_within(position, cells):
    """Cell of a grid at a position in widths of a cell; one of the grid for any position, NaN included."""
    return minimum(floor(maximum(0.0, position)), cells - 1.0)
