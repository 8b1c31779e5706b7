"""Many loops quickly: margins and stability of sampled feedback by the modes of the plant.

The same numbers as `sbs_sim.pilot.feedback` gives by solving at every frequency, from one decomposition of the plant:
a design over an envelope with its uncertainty asks for thousands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent
from sbs_sim.pilot.feedback import (
    DELAY_POLE_RADIUS,
    Compensator,
    ComplexArray,
    Margin,
    Plant,
    disk_gains,
    disk_phase,
    reached,
    slowest_first,
)

Array = NDArray[np.float64]

LOWEST, POINTS = 0.05, 240  # rad/s, and number of frequencies from there to half the sampling rate
AROUND_A_POLE = np.array([-3.0, -1.5, -0.75, -0.3, 0.0, 0.3, 0.75, 1.5, 3.0])  # of its distance from the axis
LIGHTLY = 0.1  # damping ratio below which a pole is looked at closely


@dataclass(frozen=True, eq=False)
class ModalPlant(ByContent):
    """A plant by its modes: x' = poles x + drive u, y = seen x, complex.

    Attributes
    ----------
    poles : ndarray of complex, shape (n,)
        [rad/s]
    drive : ndarray of complex, shape (n, m)
    seen : ndarray of complex, shape (k, n)
    """

    poles: ComplexArray
    drive: ComplexArray
    seen: ComplexArray

    @classmethod
    def of(cls, plant: Plant) -> ModalPlant:
        """Decompose a plant; states that nothing depends on, such as the heading, are integrals of the others."""
        integrals = np.flatnonzero(~plant.a.any(axis=0))
        core = np.setdiff1d(np.arange(len(plant.a)), integrals)
        poles, vectors = np.linalg.eig(plant.a[np.ix_(core, core)])
        drive = np.linalg.solve(vectors, plant.b[core].astype(complex))
        added = plant.a[np.ix_(integrals, core)] @ vectors / poles  # of the integrals, in each mode
        return cls(
            np.concatenate([poles, np.zeros(len(integrals))]),
            np.vstack([drive, plant.b[integrals] - added @ drive]),
            np.hstack([plant.c[:, core] @ vectors + plant.c[:, integrals] @ added, plant.c[:, integrals]]),
        )

    def sampled(self, tick: float) -> tuple[ComplexArray, ComplexArray]:
        """Poles and drive from tick to tick [s] with controls that are held between."""
        angle = self.poles * tick
        small = np.abs(angle) < 1e-8
        growth = np.where(small, tick, np.expm1(angle) / np.where(small, 1.0, self.poles))
        return np.exp(angle), growth[:, None] * self.drive

    @cached_property
    def frequencies(self) -> Array:
        """Where its loops are to be looked at, up to high frequencies [rad/s]."""
        light = self.poles[(self.poles.imag > LOWEST) & (np.abs(self.poles.real) < LIGHTLY * self.poles.imag)]
        close = [pole.imag + AROUND_A_POLE * max(abs(pole.real), 1e-3 * pole.imag) for pole in light]
        return np.concatenate([np.empty(0), *close])


def grid(plant: ModalPlant, tick: float) -> Array:
    """Frequencies for the loops of a plant [rad/s]."""
    return np.union1d(even_grid(tick), close_grid(plant, tick))


def even_grid(tick: float) -> Array:
    """Frequencies evenly over the logarithm, to half the sampling rate [rad/s]."""
    return np.geomspace(LOWEST, 0.999 * math.pi / tick, POINTS)


def close_grid(plant: ModalPlant, tick: float) -> Array:
    """Frequencies around the lightly damped poles of a plant [rad/s]."""
    w = plant.frequencies
    return w[(w >= LOWEST) & (w < math.pi / tick)]


def sampled_response(plant: ModalPlant, tick: float, w: Array) -> ComplexArray:
    """Response of what is measured to controls that are held for a tick [s], shape (len(w), k, m)."""
    poles, drive = plant.sampled(tick)
    k, m = len(plant.seen), drive.shape[1]
    residues = (plant.seen.T[:, :, None] * drive[:, None, :]).reshape(len(poles), k * m)
    modes = 1.0 / (np.exp(1j * w * tick)[:, None] - poles)
    return np.asarray(modes @ residues).reshape(len(w), k, m)


def closed_poles(plant: ModalPlant, compensator: Compensator, tick: float, delay: int) -> ComplexArray:
    """Poles of the sampled loop, log(z) / tick [rad/s], slowest first, without pure delays."""
    a, b, c = _real_parts(*plant.sampled(tick), plant.seen)
    n, m = b.shape
    states = len(compensator.a)
    now = np.hstack([compensator.d @ c, compensator.c])
    matrix = np.zeros((n + states + delay * m,) * 2)
    matrix[:n, :n] = a
    matrix[n : n + states, : n + states] = np.hstack([compensator.b @ c, compensator.a])
    if delay == 0:
        matrix[:n, : n + states] += b @ now
    else:
        first, last = n + states, n + states + (delay - 1) * m
        matrix[:n, last:] = b
        matrix[first : first + m, : n + states] = now
        for row in range(first + m, last + m, m):
            matrix[row : row + m, row - m : row] = np.eye(m)
    z = np.linalg.eigvals(matrix).astype(complex)
    return slowest_first(np.log(z[np.abs(z) > DELAY_POLE_RADIUS]) / tick)


def _real_parts(poles: ComplexArray, drive: ComplexArray, seen: ComplexArray) -> tuple[Array, Array, Array]:
    """The same system in real numbers: real and imaginary part of one of each pair of modes."""
    single, upper = np.flatnonzero(poles.imag == 0.0), np.flatnonzero(poles.imag > 0.0)
    k, pairs = len(single), len(upper)
    a = np.diag(np.concatenate([poles[single].real, poles[upper].real, poles[upper].real]))
    first, second = k + np.arange(pairs), k + pairs + np.arange(pairs)
    a[first, second], a[second, first] = -poles[upper].imag, poles[upper].imag
    b = np.asarray(np.vstack([drive[single].real, drive[upper].real, drive[upper].imag]), float)
    return (
        np.asarray(a, float),
        b,
        np.hstack([seen[:, single].real, 2.0 * seen[:, upper].real, -2.0 * seen[:, upper].imag]).astype(float),
    )


def quick_margins(
    plant: ModalPlant, compensator: Compensator, tick: float, delay: int, is_stable: bool
) -> tuple[Margin, ...]:
    """`sbs_sim.pilot.feedback.margins` at fewer frequencies."""
    w = grid(plant, tick)
    loops = -compensator.at(w, tick) @ sampled_response(plant, tick, w) * lateness(w, tick, delay)
    return loop_margins(loops, w, is_stable)


def lateness(w: Array, tick: float, delay: int) -> ComplexArray:
    """Factor of a delay in ticks, shape (len(w), 1, 1)."""
    return np.asarray(np.exp(-1j * w * tick * delay)[:, None, None])


def loop_margins(loops: ComplexArray, w: Array, is_stable: bool) -> tuple[Margin, ...]:
    """Margins of loops broken at each control, of the feedback u = -L u, shape (len(w), m, m), and at all at once."""
    m = loops.shape[1]
    sensitivity = np.linalg.inv(np.eye(m) + loops)
    found = []
    for i in range(m):
        s = sensitivity[:, i, i]
        size = np.abs(s - 0.5)
        worst = int(np.argmax(size))
        disk = 1.0 / float(size[worst]) if is_stable else 0.0
        found.append(Margin(disk, float(w[worst]), *reached(1.0 / s - 1.0)))
    off = sensitivity - 0.5 * np.eye(m)
    squares = np.linalg.eigvalsh(np.conj(np.swapaxes(off, 1, 2)) @ off)[:, -1]
    worst = int(np.argmax(squares))
    disk = 1.0 / math.sqrt(float(squares[worst])) if is_stable else 0.0
    return (*found, Margin(disk, float(w[worst]), *disk_gains(disk), disk_phase(disk)))
