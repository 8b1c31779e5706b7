"""Modes of a linear model: poles, participation, names (theory.md section 9).

A mode is named by what takes part in it, never by its place in a list. The participation of state k in mode i is
p_ki = |V_ki W_ik| with the right eigenvectors in the columns of V and W = inv(V), normalised to a sum of one: it does
not depend on the units of the states, nor on their order (Perez-Arriaga, Verghese, Schweppe, Selective modal analysis,
IEEE Trans. PAS 101, 1982).
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent
from sbs_sim.model.state import Part, part_of

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LONGITUDINAL, LATERAL = ("u", "w", "q", "theta"), ("v", "p", "phi", "r")
ALIKE = 1e-9  # poles that differ by less of the largest one are one multiple pole
OWNED = 0.7  # share of one rotor in a mode of several beyond which it is that rotor's
ROLLING = 0.15  # least share of p in a roll mode
COUPLED = 0.2  # share of flap, and of lag, from which a mode of the first matrix of eq. [32] is a coupled one


@dataclass(frozen=True, eq=False)
class Mode(ByContent):
    """One real pole, or one conjugate pair.

    Attributes
    ----------
    name : str
    pole : complex
        Eigenvalue, of a pair the one with the positive imaginary part [rad/s].
    vector : ndarray of complex, shape (n,)
        Right eigenvector, its largest component 1.
    participation : ndarray, shape (n,)
        Share of each state; the sum is 1.
    """

    name: str
    pole: complex
    vector: ComplexArray
    participation: Array

    @property
    def frequency(self) -> float:
        """Undamped natural frequency, the magnitude of the pole [rad/s]."""
        return abs(self.pole)

    @property
    def damping(self) -> float:
        """Damping ratio: 1 for a stable real pole, -1 for an unstable one, 0 for a pole at the origin."""
        return -self.pole.real / abs(self.pole) if self.pole else 0.0

    @property
    def is_oscillatory(self) -> bool:
        """True for a pair."""
        return self.pole.imag > 0.0

    @property
    def time_to_half(self) -> float:
        """Time in which the amplitude halves [s]; infinite where it does not decay."""
        return math.log(2.0) / -self.pole.real if self.pole.real < 0.0 else math.inf

    @property
    def time_to_double(self) -> float:
        """Time in which the amplitude doubles [s]; infinite where it does not grow."""
        return math.log(2.0) / self.pole.real if self.pole.real > 0.0 else math.inf

    @property
    def period(self) -> float:
        """Period of the oscillation [s]; infinite for a real pole."""
        return 2.0 * math.pi / self.pole.imag if self.is_oscillatory else math.inf


def modes(a: Array, state_names: Sequence[str]) -> tuple[Mode, ...]:
    """Modes of a state matrix, named, slowest first.

    Parameters
    ----------
    a : ndarray, shape (n, n)
    state_names : sequence of str, length n
        Linear states in any order, see `StateLayout.linear_names`.

    Returns
    -------
    tuple of Mode

    Raises
    ------
    ValueError
        A name that no linear state has, or not one name for each state.
    """
    parts = _parts(a, state_names)
    found = _unnamed(a, state_names)
    groups = _groups(parts, state_names)
    members: dict[str, list[Mode]] = defaultdict(list)
    for mode, group in zip(found, _assign(found, groups), strict=True):
        members[group].append(mode)
    named: list[Mode] = []
    for group, inside in members.items():
        if group == "longitudinal":
            named += _name_longitudinal(inside, state_names)
        elif group == "lateral":
            named += _name_lateral(inside, state_names)
        else:
            named += _name_rotor(inside, parts, state_names, groups[group])
    return tuple(sorted(_unique(named), key=lambda mode: (mode.frequency, mode.name)))


def first_matrix_modes(a: Array, state_names: Sequence[str]) -> tuple[Mode, ...]:
    """Modes of the first matrix of the paper's eq. [32], with the names of its Table 5.

    Parameters
    ----------
    a : ndarray, shape (n, n)
        Only flap and lag states.
    state_names : sequence of str, length n

    Returns
    -------
    tuple of Mode
        Slowest first; modes of several rotors carry the number of the rotor.
    """
    parts = _parts(a, state_names)
    rotors = {part.rotor for part in parts}
    named: list[Mode] = []
    for rotor in sorted(rotors):
        inside = np.array([i for i, part in enumerate(parts) if part.rotor == rotor])
        local = [parts[i] for i in inside]
        found = [
            replace(mode, name=_first_matrix_name(mode, local))
            for mode in _unnamed(a[np.ix_(inside, inside)], [state_names[i] for i in inside])
        ]
        found = _rank(found, "coupled cyclic", ("coupled regressing", "coupled advancing"))
        for mode in found:
            suffix = f", rotor {rotor + 1}" if len(rotors) > 1 else ""
            named.append(replace(_spread(mode, inside, len(parts)), name=f"{mode.name}{suffix}"))
    return tuple(sorted(_unique(named), key=lambda mode: (mode.frequency, mode.name)))


# --- eigenvalues and participation ------------------------------------------------------------------------------


def _parts(a: Array, state_names: Sequence[str]) -> list[Part]:
    if a.shape != (len(state_names), len(state_names)):
        raise ValueError(f"{len(state_names)} state names for a matrix of shape {a.shape}")
    return [part_of(name) for name in state_names]


def _unnamed(a: Array, state_names: Sequence[str]) -> list[Mode]:
    """Modes of a matrix without names."""
    poles, right = np.linalg.eig(a)
    try:
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError:  # fewer eigenvectors than states
        left = np.linalg.pinv(right)
    right, left = _separate(poles, right, left, state_names)
    shares = np.abs(right * left.T)
    shares /= shares.sum(axis=0)
    largest = right[np.abs(right).argmax(axis=0), np.arange(len(poles))]
    size = max(float(np.abs(poles).max()), 1.0)
    poles = np.where(np.abs(poles.imag) < 1e-14 * size, poles.real, poles)
    return [
        Mode("", complex(poles[i]), right[:, i] / largest[i], shares[:, i])
        for i in range(len(poles))
        if poles[i].imag >= 0.0
    ]


def _separate(
    poles: ComplexArray, right: ComplexArray, left: ComplexArray, state_names: Sequence[str]
) -> tuple[ComplexArray, ComplexArray]:
    """Choose eigenvectors of multiple poles that keep to one kind of state of one rotor as far as they can.

    The eigenvectors of a multiple pole may be any basis of their space. The one taken here diagonalises, within that
    space, a matrix that weighs every kind of state differently, which depends on neither order nor scales.
    """
    parts = [part_of(name) for name in state_names]
    kinds = sorted({(part.family, part.harmonic, part.rotor) for part in parts})
    weights = np.array([1.0 + kinds.index((part.family, part.harmonic, part.rotor)) for part in parts])
    right, left = right.astype(complex), left.astype(complex)
    alike = np.abs(poles[:, None] - poles) <= ALIKE * float(np.abs(poles).max())
    left_over = [i for i in range(len(poles)) if alike[i].sum() > 1]
    while left_over:
        cluster = [i for i in left_over if alike[left_over[0], i]]
        left_over = [i for i in left_over if i not in cluster]
        if len(cluster) > 1:
            inner = left[cluster] @ (weights[:, None] * right[:, cluster])
            _, turn = np.linalg.eig(inner)
            right[:, cluster] = right[:, cluster] @ turn
            left[cluster] = np.linalg.pinv(turn) @ left[cluster]
    return right, left


def _groups(parts: Sequence[Part], state_names: Sequence[str]) -> dict[str, list[int]]:
    """Indices of the states by what they describe."""
    groups: dict[str, list[int]] = defaultdict(list)
    for i, (part, name) in enumerate(zip(parts, state_names, strict=True)):
        if part.family == "body":
            groups["longitudinal" if name in LONGITUDINAL else "lateral"].append(i)
        else:
            groups[f"{part.family} {part.harmonic}"].append(i)
    return dict(groups)


def _assign(found: Sequence[Mode], groups: dict[str, list[int]]) -> list[str]:
    """Group of each mode: as many poles to a group as it has states, with the largest total participation."""
    slots = [(name, 1.0) for name, states in groups.items() for _ in states]
    participation = np.array([mode.participation for mode in found])
    shares = {name: participation[:, states].sum(axis=1).tolist() for name, states in groups.items()}
    return [names[0] for names in _match(found, [name for name, _ in slots], shares)]


def _match(found: Sequence[Mode], slots: Sequence[str], shares: dict[str, list[float]]) -> list[list[str]]:
    """Slots of each mode, two of a pair, that maximise the sum of the shares; the larger share first."""
    from scipy.optimize import linear_sum_assignment  # here: it takes a quarter of a second, and few need it

    owners = [i for i, mode in enumerate(found) for _ in range(1 + mode.is_oscillatory)]
    gain = np.array([shares[slot] for slot in slots]).T[owners].reshape(len(owners), len(slots))
    result: list[list[str]] = [[] for _ in found]
    for row, column in zip(*linear_sum_assignment(gain, maximize=True), strict=True):
        result[owners[row]].append(slots[column])
    return [sorted(taken, key=lambda slot: -shares[slot][i]) for i, taken in enumerate(result)]


# --- names of the body's modes ----------------------------------------------------------------------------------


def _share(mode: Mode, state_names: Sequence[str], wanted: Iterable[str]) -> float:
    return float(sum(mode.participation[state_names.index(name)] for name in wanted if name in state_names))


def _name_longitudinal(inside: list[Mode], state_names: Sequence[str]) -> list[Mode]:
    """Heave subsidence (or divergence) where w has a pole of its own, short period with q, phugoid with u, theta."""
    owners = {"heave subsidence": ("w",), "short period": ("q",), "phugoid": ("u", "theta")}
    slots = [name for name, states in owners.items() for state in states if state in state_names]
    shares = {name: [_share(mode, state_names, states) for mode in inside] for name, states in owners.items()}
    named = []
    for mode, taken in zip(inside, _match(inside, slots, shares), strict=True):
        name = taken[0] if taken else "longitudinal"
        if len(set(taken)) > 1:  # a pair of w and q is the short period of forward flight
            name = "short period" if "short period" in taken else "phugoid"
        growing = name == "heave subsidence" and mode.pole.real > 0.0
        named.append(replace(mode, name="heave divergence" if growing else name))
    return named


def _name_lateral(inside: list[Mode], state_names: Sequence[str]) -> list[Mode]:
    """Roll with p; of the others the pair is the Dutch roll, and the spiral is what takes least of v."""
    roll = [_share(mode, state_names, ("p",)) for mode in inside]
    side = [_share(mode, state_names, ("v",)) for mode in inside]
    pairs = sorted((i for i, mode in enumerate(inside) if mode.is_oscillatory), key=lambda i: -side[i])
    real = [i for i in range(len(inside)) if i not in pairs]
    names = dict.fromkeys(range(len(inside)), "Dutch roll")
    names.update(dict.fromkeys(pairs[1:], "roll-spiral"))
    rolling = max(real, key=lambda i: roll[i], default=None)
    if rolling is not None and roll[rolling] >= ROLLING:
        names[rolling] = "roll"
        real.remove(rolling)
    if real:
        spiral = min(real, key=lambda i: side[i])
        names[spiral] = "spiral"
    return [replace(mode, name=names[i]) for i, mode in enumerate(inside)]


# --- names of the rotors' modes ---------------------------------------------------------------------------------


def _name_rotor(inside: list[Mode], parts: Sequence[Part], state_names: Sequence[str], states: list[int]) -> list[Mode]:
    """Names of the modes of one family and harmonic, with what several rotors do together."""
    family, harmonic = parts[states[0]].family, parts[states[0]].harmonic
    rotors = sorted({parts[i].rotor for i in states})
    states = sorted(states, key=lambda i: state_names[i])  # so that the rotors' coordinates stand in one order
    name = _family_name(family, harmonic)
    base = [replace(mode, name=name) for mode in inside]
    if family != "inflow" and harmonic > 0:  # all rotors together: half of all poles are slow, whoever has them
        base = _rank(base, name, (f"regressing {name}", f"advancing {name}"))
    named = []
    for mode in base:
        owner = _owner(mode, parts, states, rotors)
        suffix = owner if owner != "together" else _symmetry(mode, parts, states, rotors)
        named.append(replace(mode, name=f"{mode.name}{suffix}"))
    return named


def _family_name(family: str, harmonic: int) -> str:
    if family == "inflow":
        return "cyclic inflow" if harmonic else "uniform inflow"
    if harmonic == 0:
        return "coning" if family == "flap" else "collective lag"
    if harmonic == -1:
        return f"differential {family}"
    return family if harmonic == 1 else f"{family} {harmonic}"


def _owner(mode: Mode, parts: Sequence[Part], states: list[int], rotors: list[int]) -> str:
    """Suffix of the rotor that has the mode alone, empty for an only rotor, "together" else."""
    if len(rotors) == 1:
        return ""
    total = mode.participation[states].sum()
    for rotor in rotors:
        own = mode.participation[[i for i in states if parts[i].rotor == rotor]].sum()
        if own > OWNED * total:
            return f", rotor {rotor + 1}"
    return "together"


def _symmetry(mode: Mode, parts: Sequence[Part], states: list[int], rotors: list[int]) -> str:
    """Suffix for two rotors: their coordinates move alike or against each other."""
    if len(rotors) != 2:
        return ""
    first, second = (mode.vector[[i for i in states if parts[i].rotor == rotor]] for rotor in rotors)
    if len(first) != len(second):
        return ""
    return ", symmetric" if np.vdot(first, second).real > 0.0 else ", antisymmetric"


def _rank(found: list[Mode], name: str, ways: tuple[str, str]) -> list[Mode]:
    """Rename modes called `name`: the slower half of their poles regress, the faster half advance.

    The modes of a cyclic coordinate with the rotating frequency nu are at |nu - n| and nu + n per revolution. A real
    pole does not oscillate at all and so belongs to the slower ones.
    """
    poles = sorted(
        (i for i, mode in enumerate(found) if mode.name == name for _ in range(1 + mode.is_oscillatory)),
        key=lambda i: (found[i].pole.imag, found[i].frequency),
    )
    regressing = set(poles[: len(poles) // 2])
    chosen = {i: ways[0] if i in regressing else ways[1] for i in poles}
    return [replace(mode, name=chosen.get(i, mode.name)) for i, mode in enumerate(found)]


def _first_matrix_name(mode: Mode, parts: Sequence[Part]) -> str:
    """Name after Table 5; the coupled cyclic modes are told apart by `_rank`."""
    flap = sum(share for share, part in zip(mode.participation, parts, strict=True) if part.family == "flap")
    cyclic = sum(share for share, part in zip(mode.participation, parts, strict=True) if part.harmonic != 0) > 0.5
    if COUPLED < flap < 1.0 - COUPLED:
        return "coupled cyclic" if cyclic else "coupled collective"
    if flap > 0.5:
        return "non-uniform disc tilt" if cyclic else "collective flap"
    return "non-uniform lag" if cyclic else "collective lag"


def _spread(mode: Mode, inside: NDArray[np.int64], size: int) -> Mode:
    """Mode of a part of the states as one of all of them."""
    vector, shares = np.zeros(size, dtype=complex), np.zeros(size)
    vector[inside], shares[inside] = mode.vector, mode.participation
    return replace(mode, vector=vector, participation=shares)


def _unique(named: list[Mode]) -> list[Mode]:
    """Give modes of one name a mark: (+) and (-) to two real poles, the right one first; numbers else."""
    counts = Counter(mode.name for mode in named)
    result = [mode for mode in named if counts[mode.name] == 1]
    for name, count in counts.items():
        if count == 1:
            continue
        alike = sorted((mode for mode in named if mode.name == name), key=lambda mode: -mode.pole.real)
        if count == 2 and not any(mode.is_oscillatory for mode in alike):
            marks = [f"{name} (+)", f"{name} (-)"]
        else:
            alike.sort(key=lambda mode: mode.frequency)
            marks = [f"{name} {i + 1}" for i in range(count)]
        result += [replace(mode, name=mark) for mode, mark in zip(alike, marks, strict=True)]
    return result
