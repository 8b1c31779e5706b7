"""Blade elements: flow, coefficients and forces of the sections of up to four blades at once (theory.md section 4).

The elements go by in chunks, each in passes over the rows of `Work.strip`: arithmetic that the compiler turns into
vector instructions, look-ups that it cannot, and arithmetic again. The rows lie at constant places of one array, so
that the compiler sees that they do not overlap.
"""

import math

import numpy as np

from sbs_sim.model import params as P
from sbs_sim.model.airfoil import cell_of, clamp, coefficients_in
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import arctangent2

CHUNK, GROUP = P.CHUNK, P.KNOT_GROUP
SPEED, REYNOLDS, ALPHA, RE, LIFT, DRAG = (CHUNK * row for row in range(P.STRIP_ROWS))


@kernel
def section_loads(p, j, row, blades, strip, cell):
    """Sums of the aerodynamic forces along the blades of one block of rotor j.

    The velocities relative to the air are linear in the distance s from the flap hinge: u_T = UT0 + UT1 s along the
    motion, u_P = UP0 + UP1 s along the blade's normal n [m/s]; PITCH is the angle of the blade's root [rad]. Outputs
    are FORCE_N, FORCE_T [N] and the first moments about the flap hinge MOMENT_N, MOMENT_T [N m], n up and t forward.

    Parameters
    ----------
    p : Params
    j : int
    row : ndarray, shape (BLADE_SIZE,)
        One block of `Work.blade`.
    blades : int
        Blades in this block.
    strip, cell : ndarray
        `Work.strip` and `Work.cell`.
    """
    for i in range(blades):
        row[P.FORCE_N + i] = row[P.FORCE_T + i] = row[P.MOMENT_N + i] = row[P.MOMENT_T + i] = 0.0
    elements = p.grid_index[j, 3]
    for chunk in range(p.element.shape[1]):
        count = min(CHUNK, elements - chunk * CHUNK)
        for i in range(blades):
            _flow(p, j, p.element[j, chunk], row, i, strip[i], count)
        for i in range(blades):
            _cells(p, j, strip[i], cell[i], count)
        for i in range(blades):
            _coefficients(p.cells, strip[i], cell[i], count)
        for i in range(blades):
            _forces(p.air[P.DENSITY], p.element[j, chunk], row, i, strip[i], count)


@kernel
def _flow(p, j, element, row, lane, strip, count):
    """Speed, Reynolds number, and place in the airfoil table along the angle, in cells, of the elements of a blade."""
    inverse_viscosity, largest = p.air[P.INVERSE_VISCOSITY], 1.0 * p.grid_index[j, 1]
    alpha0, inverse_step = p.grid[j, 0], p.grid[j, 1]
    ut0, ut1, up0, up1 = row[P.UT0 + lane], row[P.UT1 + lane], row[P.UP0 + lane], row[P.UP1 + lane]
    pitch = row[P.PITCH + lane]
    for i in range(count):
        s = element[P.SPAN + i]
        ut = ut0 + ut1 * s
        up = up0 + up1 * s
        speed = math.sqrt(ut * ut + up * up)
        alpha = pitch + element[P.TWIST + i] - arctangent2(up, ut)
        strip[SPEED + i] = speed
        strip[REYNOLDS + i] = speed * element[P.CHORD + i] * inverse_viscosity
        strip[ALPHA + i] = clamp((alpha - alpha0) * inverse_step, largest)
        strip[RE + i] = 0.0


@kernel
def _cells(p, j, strip, cell, count):
    """Cell of the airfoil table of every element, and its place within."""
    first, n_alpha, n_re = p.grid_index[j, 0], p.grid_index[j, 1], p.grid_index[j, 2]
    half = (p.grid.shape[1] - 2) // 2
    for k in range(0, n_re, GROUP):
        w0, w1, w2, w3, w4, w5, w6, w7 = _eight(p.grid[j], 2 + k)
        r0, r1, r2, r3, r4, r5, r6, r7 = _eight(p.grid[j], 2 + half + k)
        for i in range(count):
            reynolds = strip[REYNOLDS + i]
            low = clamp(reynolds * w0 - r0, 1.0) + clamp(reynolds * w1 - r1, 1.0)
            low += clamp(reynolds * w2 - r2, 1.0) + clamp(reynolds * w3 - r3, 1.0)
            high = clamp(reynolds * w4 - r4, 1.0) + clamp(reynolds * w5 - r5, 1.0)
            high += clamp(reynolds * w6 - r6, 1.0) + clamp(reynolds * w7 - r7, 1.0)
            strip[RE + i] += low + high
    rows, columns = 1.0 * n_re, 1.0 * n_alpha
    for i in range(count):
        along_re, along_alpha = cell_of(strip[RE + i], rows), cell_of(strip[ALPHA + i], columns)
        strip[RE + i] -= along_re
        strip[ALPHA + i] -= along_alpha
        cell[i] = np.int32(first + along_re * columns + along_alpha)


@kernel
def _eight(values, at):
    """Numbers in a row: loads that the compiler need not repeat."""
    return (
        values[at],
        values[at + 1],
        values[at + 2],
        values[at + 3],
        values[at + 4],
        values[at + 5],
        values[at + 6],
        values[at + 7],
    )


@kernel
def _coefficients(cells, strip, cell, count):
    """Lift and drag coefficient of every element."""
    for i in range(count):
        cl, cd = coefficients_in(cells, np.uintp(cell[i]), strip[ALPHA + i], strip[RE + i])
        strip[LIFT + i] = cl
        strip[DRAG + i] = cd


@kernel
def _forces(density, element, row, lane, strip, count):
    """Add the forces and first moments of a chunk of a blade's elements."""
    ut0, ut1, up0, up1 = row[P.UT0 + lane], row[P.UT1 + lane], row[P.UP0 + lane], row[P.UP1 + lane]
    fn = ft = mn = mt = 0.0
    for i in range(count):
        s = element[P.SPAN + i]
        ut = ut0 + ut1 * s
        up = up0 + up1 * s
        cl = strip[LIFT + i] * element[P.LIFT_FRACTION + i]
        cd = strip[DRAG + i]
        scale = density * element[P.HALF_AREA + i] * strip[SPEED + i]
        dn = scale * (cl * ut - cd * up)
        dt = -scale * (cl * up + cd * ut)
        fn += dn
        ft += dt
        mn += s * dn
        mt += s * dt
    row[P.FORCE_N + lane] += fn
    row[P.FORCE_T + lane] += ft
    row[P.MOMENT_N + lane] += mn
    row[P.MOMENT_T + lane] += mt
