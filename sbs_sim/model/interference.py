"""Wash of rotors on one another (theory.md section 6.5)."""

from sbs_sim.lanes import floor, maximum, minimum, select, sqrt, table_row
from sbs_sim.model import state as S
from sbs_sim.model.inflow import MIN_FLOW
from sbs_sim.model.kernel import kernel
from sbs_sim.model.records import OTHERS

DEGREE = 3  # of the table along each component of the skew
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

    The skew of the wake is that of eq. (6.4), from the flow that the source has without the others.
    """
    source, table = aircraft.rotors[pair.source], aircraft.influences
    mu = memory.flow[pair.source].velocity * source.inverse_tip_speed
    through = memory.state[source.inflow + S.UNIFORM] - mu.z
    total = sqrt(mu.x * mu.x + mu.y * mu.y + through * through + MIN_FLOW * MIN_FLOW)
    inverse = (0.5 * pair.cells) / (total + abs(through))
    x, y = mu.x * inverse + 0.5 * pair.cells, mu.y * inverse + 0.5 * pair.cells
    column, line = cell_within(x, pair.cells), cell_within(y, pair.cells)
    cell = select(through < 0.0, pair.cells * pair.cells, 0.0) + column * pair.cells + line
    row, x, y = pair.first_row + VALUES * cell, x - column, y - line
    a, b, c, d = table_row(table, row, x, DEGREE)
    e, f, g, h = table_row(table, row + 1.0, x, DEGREE)
    p, q, r, s = table_row(table, row + 2.0, x, DEGREE)
    return a + y * (b + y * (c + y * d)), e + y * (f + y * (g + y * h)), p + y * (q + y * (r + y * s))


@kernel
def cell_within(position, cells):
    """Cell of a grid at a position in widths of a cell; one of the grid for any position, NaN included."""
    return minimum(floor(maximum(0.0, position)), cells - 1.0)
