"""A stitched model in time: linear models of many steady flights as one nonlinear one (theory.md section 10)."""

import math
from typing import Any, NamedTuple

import numpy as np

from sbs_sim.lanes import as_lanes, as_records, zeros_like
from sbs_sim.model import state as S
from sbs_sim.model.kernel import entry, kernel

QUAD = 4
POWERS = 4  # coefficients of a cubic
STAGES = 4
QUADS = np.zeros(1, [("lanes", float, (QUAD,))])  # record of four lanes
DOWN_SIZE, MOTION_SIZE = 3, 6  # gravity's direction, and velocity and angular velocity
U, W = 0, 2  # of the motion
UNBROKEN = -1  # in place of a state that is not plausible


class Stitches(NamedTuple):
    """Cubics over the x-velocity relative to the air, by rows of climb; z are motion, kept states and inputs.

    Attributes
    ----------
    speeds : ndarray, shape (n_rows, n_anchors)
        x-velocity at the anchors, rising [m/s].
    trims : ndarray, shape (n_rows, n_anchors - 1, 4, 3 + n_z)
        Coefficients of the direction down and of z in trim.
    matrices : ndarray, shape (n_rows, n_anchors - 1, n_blocks, n_z, 4, 4)
        Coefficients, by powers, of what moves the aircraft, in blocks of four rows.
    output_trims : ndarray, shape (n_rows, n_anchors - 1, 4, n_outputs)
    output_matrices : ndarray, shape (n_rows, n_anchors - 1, n_output_blocks, n_z, 4, 4)
    inertia, inverse_inertia : ndarray, shape (3, 3)
        [kg m^2] and its inverse.
    gravity : ndarray, shape (1,)
        [m/s^2]
    quads : ndarray
        `QUADS`.
    """

    speeds: Any
    trims: Any
    matrices: Any
    output_trims: Any
    output_matrices: Any
    inertia: Any
    inverse_inertia: Any
    gravity: Any
    quads: Any


class StitchedMemory(NamedTuple):
    """Memory of a flight.

    Attributes
    ----------
    z : ndarray, shape (n_z,)
        Departures from trim.
    y : ndarray, shape (n_blocks, 4)
        Specific force [m/s^2], moments over the inertia [rad/s^2], rates of the kept states.
    outputs : ndarray, shape (n_output_blocks, 4)
    levels : ndarray, shape (n_rows,)
        z-velocity of the trims of each row [m/s].
    stage, last : ndarray, shape (size,)
    slopes : ndarray, shape (4, size)
    """

    z: Any
    y: Any
    outputs: Any
    levels: Any
    stage: Any
    last: Any
    slopes: Any


@entry
def fly_stitched(
    stitches, x, inputs, air, begin, ticks, steps, h, every, bounds, memory, states, forces, outputs, done
):
    """Fly ticks of classical Runge-Kutta steps, and keep some of their beginnings.

    Parameters
    ----------
    stitches : Stitches
    x : ndarray, shape (13 + n_kept,)
        Position, attitude, velocity, angular velocity as in a simulation state, then the kept states; overwritten by
        those at the end, or the last plausible ones.
    inputs : ndarray, shape (count, n_inputs)
        Of each tick; count = ticks, or one more, which is in force at the end.
    air : ndarray, shape (2 steps ticks + 1, 3) or (1, 3)
        Velocity of the air at every half step, or all the time, NED [m/s].
    begin, ticks, steps : int
        Number of the first tick, ticks to fly, steps of a tick.
    h : float
        Step [s].
    every : int
        Ticks from one row of the result to the next, counted from tick 0.
    bounds : ndarray, shape (13 + n_kept,)
        Largest plausible magnitudes.
    memory : StitchedMemory
        Its `slopes[0]` are afterwards the rates at the beginning of the last step, or at the end if there is one more
        row of inputs than ticks.
    states, forces, outputs : ndarray, shapes (n, 13 + n_kept), (n, 3), (n, n_outputs)
        Output: rows of states, specific forces and outputs.
    done : ndarray of int64, shape (3,)
        Output: steps that were made, rows that were written, and the state that is not plausible or -1.
    """
    row, made, last = 0, 0, air.shape[0] - 1
    done[2] = UNBROKEN
    slopes, stage, before = memory.slopes, memory.stage, memory.last
    for i in range(inputs.shape[0]):
        is_kept, is_flown = (begin + i) % every == 0, i < ticks
        for _ in range(steps if is_flown else 1):
            for j in range(x.size):
                before[j] = stage[j] = x[j]
            for n in range(STAGES if is_flown else 1):
                now = air[min(2 * made + (n + 1) // 2, last)]
                rates(stitches, stage, inputs[i], now, memory, slopes[n], is_kept and n == 0)
                if is_kept and n == 0:
                    for j in range(3):
                        forces[row, j] = memory.y[0, j]
                    for j in range(outputs.shape[1]):
                        outputs[row, j] = memory.outputs[j // QUAD, j % QUAD]
                    for j in range(x.size):
                        states[row, j] = x[j]
                    row, is_kept = row + 1, False
                ahead = h if n == 2 else 0.5 * h
                for j in range(x.size):
                    stage[j] = before[j] + ahead * slopes[n, j]
            if is_flown:
                combine(x, h / 6.0, before, slopes)
                done[2] = implausible(x, bounds)
                if done[2] != UNBROKEN:
                    for j in range(x.size):
                        stage[j], x[j] = x[j], before[j]
                    done[0], done[1] = made, row
                    return
                made += 1
    done[0], done[1] = made, row


@kernel
def combine(x, sixth, before, slopes):
    """State after the stages of a step, with a unit quaternion."""
    for j in range(x.size):
        x[j] = before[j] + sixth * (slopes[0, j] + 2.0 * slopes[1, j] + 2.0 * slopes[2, j] + slopes[3, j])
    square = 0.0
    for j in range(S.ATTITUDE, S.VELOCITY):
        square += x[j] * x[j]
    scale = 1.0 / math.sqrt(square)
    for j in range(S.ATTITUDE, S.VELOCITY):
        x[j] *= scale


@kernel
def implausible(x, bounds):
    """Index of a state beyond its bound, or that is not a number; -1 if there is none."""
    for i in range(x.size):
        if not abs(x[i]) <= bounds[i]:
            return i
    return UNBROKEN


@kernel
def rates(stitches, x, inputs, air, memory, dx, with_outputs):
    """Rates of the state; what moves it is left in `memory.y`, and outputs, if wanted, in `memory.outputs`."""
    w, i, j, k = x[S.ATTITUDE], x[S.ATTITUDE + 1], x[S.ATTITUDE + 2], x[S.ATTITUDE + 3]
    xx, xy, xz = 1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - w * k), 2.0 * (i * k + w * j)
    yx, yy, yz = 2.0 * (i * j + w * k), 1.0 - 2.0 * (i * i + k * k), 2.0 * (j * k - w * i)
    zx, zy, zz = 2.0 * (i * k - w * j), 2.0 * (j * k + w * i), 1.0 - 2.0 * (i * i + j * j)
    u, v, z = x[S.VELOCITY], x[S.VELOCITY + 1], x[S.VELOCITY + 2]
    p, q, r = x[S.RATES], x[S.RATES + 1], x[S.RATES + 2]
    north, east, down = air[0], air[1], air[2]
    along = u - (xx * north + yx * east + zx * down)
    across = v - (xy * north + yy * east + zy * down)
    below = z - (xz * north + yz * east + zz * down)
    motion = (along, across, below, p, q, r)
    clear(memory.y)
    if with_outputs:
        clear(memory.outputs)
    weigh(stitches, x, inputs, motion, memory, with_outputs)
    y, g = memory.y, stitches.gravity[0]
    dx[S.POSITION] = xx * u + xy * v + xz * z
    dx[S.POSITION + 1] = yx * u + yy * v + yz * z
    dx[S.POSITION + 2] = zx * u + zy * v + zz * z
    dx[S.ATTITUDE] = -0.5 * (i * p + j * q + k * r)
    dx[S.ATTITUDE + 1] = 0.5 * (w * p + j * r - k * q)
    dx[S.ATTITUDE + 2] = 0.5 * (w * q + k * p - i * r)
    dx[S.ATTITUDE + 3] = 0.5 * (w * r + i * q - j * p)
    dx[S.VELOCITY] = y[0, 0] + g * zx + (r * v - q * z)
    dx[S.VELOCITY + 1] = y[0, 1] + g * zy + (p * z - r * u)
    dx[S.VELOCITY + 2] = y[0, 2] + g * zz + (q * u - p * v)
    inertia, inverse = stitches.inertia, stitches.inverse_inertia
    hx = inertia[0, 0] * p + inertia[0, 1] * q + inertia[0, 2] * r
    hy = inertia[1, 0] * p + inertia[1, 1] * q + inertia[1, 2] * r
    hz = inertia[2, 0] * p + inertia[2, 1] * q + inertia[2, 2] * r
    mx, my, mz = r * hy - q * hz, p * hz - r * hx, q * hx - p * hy
    dx[S.RATES] = y[0, 3] + inverse[0, 0] * mx + inverse[0, 1] * my + inverse[0, 2] * mz
    dx[S.RATES + 1] = y[1, 0] + inverse[1, 0] * mx + inverse[1, 1] * my + inverse[1, 2] * mz
    dx[S.RATES + 2] = y[1, 1] + inverse[2, 0] * mx + inverse[2, 1] * my + inverse[2, 2] * mz
    for n in range(S.BODY_SIZE, x.size):
        place = n - S.BODY_SIZE + MOTION_SIZE
        dx[n] = y[place // QUAD, place % QUAD]


@kernel
def clear(values):
    """Set all to zero."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j] = 0.0


@kernel
def weigh(stitches, x, inputs, motion, memory, with_outputs):
    """Add the one or two rows of climb that are next to the z-velocity, each with its weight."""
    rows, levels = stitches.speeds.shape[0], memory.levels
    row, share = 0, 0.0
    if rows > 1:
        for n in range(rows):
            k, t, _ = interval(stitches.speeds, n, motion[U])
            levels[n] = cubic(stitches.trims[n, k], DOWN_SIZE + W, t)
        while row < rows - 2 and motion[W] < levels[row + 1]:  # climb rises, and with it the z-velocity falls
            row += 1
        share = (levels[row] - motion[W]) / (levels[row] - levels[row + 1])
        share = min(max(share, 0.0), 1.0)
        share = share * share * (3.0 - 2.0 * share)
    for n in range(2):
        weight = share if n else 1.0 - share
        if weight > 0.0:
            add_row(stitches, row + n, weight, x, inputs, motion, memory, with_outputs)


@kernel
def interval(speeds, row, speed):
    """Interval of a speed, its place in it from 0 to 1, and how far it is beyond the first or last anchor."""
    last = speeds.shape[1] - 1
    k = 0
    while k < last - 1 and speed >= speeds[row, k + 1]:
        k += 1
    if speed <= speeds[row, 0]:
        return 0, 0.0, speed - speeds[row, 0]
    if speed >= speeds[row, last]:
        return last - 1, 1.0, speed - speeds[row, last]
    return k, (speed - speeds[row, k]) / (speeds[row, k + 1] - speeds[row, k]), 0.0


@kernel
def add_row(stitches, row, weight, x, inputs, motion, memory, with_outputs):
    """Add what moves the aircraft, and its outputs, as one row of climb has it, with a weight."""
    k, t, beyond = interval(stitches.speeds, row, motion[U])
    c, z = stitches.trims[row, k], memory.z
    z[U] = beyond  # within the anchors the speed is that of the trim
    for n in range(1, MOTION_SIZE):
        z[n] = motion[n] - cubic(c, DOWN_SIZE + n, t)
    kept = x.size - S.BODY_SIZE
    for n in range(kept):
        z[MOTION_SIZE + n] = x[S.BODY_SIZE + n] - cubic(c, DOWN_SIZE + MOTION_SIZE + n, t)
    for n in range(inputs.size):
        z[MOTION_SIZE + kept + n] = inputs[n] - cubic(c, DOWN_SIZE + MOTION_SIZE + kept + n, t)
    pull = weight * stitches.gravity[0]
    for n in range(DOWN_SIZE):
        memory.y[0, n] -= pull * cubic(c, n, t)
    add_product(stitches.matrices[row, k], t, z, weight, stitches.quads, memory.y)
    if with_outputs:
        outputs, c = memory.outputs, stitches.output_trims[row, k]
        for n in range(c.shape[1]):
            outputs[n // QUAD, n % QUAD] += weight * cubic(c, n, t)
        add_product(stitches.output_matrices[row, k], t, z, weight, stitches.quads, outputs)


@kernel
def cubic(c, n, t):
    """Value of one of many cubics."""
    return c[0, n] + t * (c[1, n] + t * (c[2, n] + t * c[3, n]))


@kernel
def add_product(matrices, t, z, weight, quads, y):
    """Add a matrix of cubics times departures, with a weight."""
    records = as_records(quads)
    m, out = as_lanes(matrices, records), as_lanes(y, records)
    for block in range(m.shape[0]):
        a, b, c, d = zeros_like(out[block]), zeros_like(out[block]), zeros_like(out[block]), zeros_like(out[block])
        for j in range(z.size):
            a = a + m[block, j, 0] * z[j]
            b = b + m[block, j, 1] * z[j]
            c = c + m[block, j, 2] * z[j]
            d = d + m[block, j, 3] * z[j]
        out[block] = out[block] + (a + (b + (c + d * t) * t) * t) * weight
