"""Noise of the vortex ring of every rotor, the same to the last bit on every machine (theory.md section 6.6).

The ring gathers at the disc and is shed again and again: every 20 to 50 revolutions, with changes of the thrust of up
to 95 % of its mean from peak to peak, as J. Stack, F. X. Caradonna, O. Savas found: Flow visualizations and extended
thrust time histories of rotor vortex wakes in descent (DTIC ADA529846).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.kernel import entry
from sbs_sim.model.noise import normal
from sbs_sim.model.turbulence import discretised

Array = NDArray[np.float64]

REVOLUTIONS = (20.0, 50.0)  # from one shedding of the ring to the next
BLOCK = 1000  # ticks whose noise is made at once
STREAM = 3  # of the seed's: 1 and 2 are those of turbulence
DRAWS = 2  # integers for the two normal numbers that a rotor takes in a tick


class RingNoise:
    """Noise of rotors at ticks, of variance 1: a function of the seed and of the number of the tick alone.

    White noise through the band pass with its half-power points at `REVOLUTIONS`, sampled exactly at every tick.

    Parameters
    ----------
    speeds : sequence of float
        Of the rotors [rad/s].
    seed : int
    tick : float
        [s]
    """

    def __init__(self, speeds: Sequence[float], seed: int, tick: float) -> None:
        self.seed, self._count = seed, len(speeds)
        slow, fast = (1.0 / count for count in reversed(REVOLUTIONS))  # over the speed of the rotor
        centre = (fast * slow) ** 0.5
        damping = 0.5 * (fast - slow) / centre
        shape = (0.0, 1.0), (1.0, 2.0 * damping, 1.0)  # the rate of an oscillator
        parts = [discretised(*shape, 2.0 * damping**0.5, 1.0, 0.0, centre * speed * tick) for speed in speeds]
        self._transition, self._factor, self._output = (
            np.array([getattr(part, name) for part in parts]) for name in ("transition", "factor", "velocity")
        )
        numbers = [normal(source, 1)[0] for source in self._sources(0)]
        begin = [(part.start * own).sum(axis=1) for part, own in zip(parts, numbers, strict=True)]
        self._states = [np.array(begin)]  # at the beginning of every block that was reached
        self._block, self._noise = -1, np.empty((0, self._count))

    def ends(self, first: int, count: int) -> Array:
        """Noise at so many ticks and at the end of the last, from the tick of a number on: (count + 1, rotors)."""
        blocks = range(first // BLOCK, (first + count) // BLOCK + 1)
        begin = first - blocks[0] * BLOCK
        return np.concatenate([self._made(block) for block in blocks])[begin : begin + count + 1]

    def _made(self, block: int) -> Array:
        """Noise of a block, shape (BLOCK, rotors)."""
        for number in range(len(self._states) - 1, block):
            self._make(number)
        if block != self._block:
            self._make(block)
        return self._noise

    def _make(self, block: int) -> None:
        """Make the noise of a block that was reached."""
        numbers = np.stack([normal(source, BLOCK) for source in self._sources(1 + block * BLOCK)], axis=1)
        states, noise = self._states[block].copy(), np.empty((BLOCK, self._count))
        _filter(self._transition, self._factor, self._output, numbers, states, noise)
        if block + 1 == len(self._states):
            self._states.append(states)
        self._block, self._noise = block, noise

    def _sources(self, ticks: int) -> list[np.random.PCG64]:
        """Integers of every rotor after so many ticks."""
        sources = [np.random.PCG64(np.random.SeedSequence([self.seed, STREAM, j])) for j in range(self._count)]
        return [source.advance(DRAWS * ticks) for source in sources]


@entry
def _filter(transition, factor, output, numbers, states, noise):
    """Filter normal numbers, shape (ticks, rotors, 2), from `states` on, which it changes."""
    for tick in range(noise.shape[0]):
        for j in range(noise.shape[1]):
            x, y, own = states[j, 0], states[j, 1], numbers[tick, j]
            noise[tick, j] = output[j, 0] * x + output[j, 1] * y
            first = transition[j, 0, 0] * x + transition[j, 0, 1] * y
            second = transition[j, 1, 0] * x + transition[j, 1, 1] * y
            states[j, 0] = first + factor[j, 0, 0] * own[0]
            states[j, 1] = second + (factor[j, 1, 0] * own[0] + factor[j, 1, 1] * own[1])
