"""Modes of a linear model: poles, participation, names (theory.md section 9).

A mode is named by what takes part in it, never by its index. The participation of state k in mode i is
p_ki = |V_ki W_ik| with the right eigenvectors in the columns of V and W = inv(V), normalised to a sum of one: it does
not depend on the units of the states, nor on their order (Perez-Arriaga, Verghese, Schweppe, Selective modal analysis,
IEEE Trans. PAS 101, 1982).
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent
from sbs_sim.model.state import DEFLECTIONS, Part, part_of

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Indices = NDArray[np.int64]

LONGITUDINAL, LATERAL = ("u", "w", "q", "theta"), ("v", "p", "phi", "r")
DRIVE_MODES = {"Omega": "rotor speed", "engine_torque": "engine", "governor": "governor"}
ALIKE = 1e-9  # poles that differ by less of the largest one are one multiple pole
OWNED = 0.7  # share of one rotor in a mode of several beyond which it is that rotor's
LEVEL = 0.9  # of the largest share: a family or rotor that comes as near to it has the mode as well
NEXT = 0.8  # of the leading state's share: with as much the other half of the body has the mode as well
NOTABLE = 0.5  # of the largest share: from here on a state has a say in the name
PITCHING = 0.05  # share of q and theta over that of w from which what diverges is pitch
STANDING = 1e-6  # of a revolution: slower than this a wave stands still as seen by the rotor
SAME_SPEED = 0.01  # relative difference up to which rotors of one number of blades are alike
COUPLED = 0.2  # share of flap, and of lag, from which a mode of the first matrix of eq. [32] is a coupled one

Key = TypeVar("Key")


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
    family : str
        What the mode is of, and named after: "body", "flap", "lag" or "inflow".
    rotors : tuple of int
        Numbers of the rotors that have it, from 1 as in the names of the states; empty for the body's.
    """

    name: str
    pole: complex
    vector: ComplexArray
    participation: Array
    family: str = ""
    rotors: tuple[int, ...] = ()

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
    def is_growing(self) -> bool:
        """True if the amplitude grows, by more than rounding gives."""
        return self.pole.real > ALIKE * abs(self.pole)

    @property
    def time_to_half(self) -> float:
        """Time in which the amplitude halves [s]; infinite where it does not decay, by more than rounding gives."""
        return math.log(2.0) / -self.pole.real if self.pole.real < -ALIKE * abs(self.pole) else math.inf

    @property
    def time_to_double(self) -> float:
        """Time in which the amplitude doubles [s]; infinite where it does not grow, see `is_growing`."""
        return math.log(2.0) / self.pole.real if self.is_growing else math.inf

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
    _check_shape(a, state_names)
    states = _states(tuple(state_names))
    speeds = {rotor: _speed(a, states, rotor) for rotor in states.kinds}
    named = _named(_Found(_unnamed(a, state_names)), speeds, states)
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
            own = replace(_spread(mode, inside, len(parts)), name=f"{mode.name}{suffix}", rotors=(rotor + 1,))
            flap = sum(share for share, part in zip(own.participation, parts, strict=True) if part.family == "flap")
            named.append(replace(own, family="flap" if flap >= 0.5 else "lag"))
    return tuple(sorted(_unique(named), key=lambda mode: (mode.frequency, mode.name)))


# --- eigenvalues and participation ------------------------------------------------------------------------------


def _check_shape(a: Array, state_names: Sequence[str]) -> None:
    if a.shape != (len(state_names), len(state_names)):
        raise ValueError(f"{len(state_names)} state names for a matrix of shape {a.shape}")


def _parts(a: Array, state_names: Sequence[str]) -> list[Part]:
    _check_shape(a, state_names)
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
    poles = np.where(np.abs(poles.imag) < 1e-14 * size, poles.real, poles).astype(complex)
    kept = np.flatnonzero(poles.imag >= 0.0)
    vectors, shares = (right / largest).T[kept], shares.T[kept]
    return [Mode("", *found) for found in zip(poles[kept].tolist(), vectors, shares, strict=True)]


def _separate(
    poles: ComplexArray, right: ComplexArray, left: ComplexArray, state_names: Sequence[str]
) -> tuple[ComplexArray, ComplexArray]:
    """Choose eigenvectors of multiple poles that keep to one kind of state of one rotor as far as they can.

    The eigenvectors of a multiple pole may be any basis of their space. The one taken here diagonalises, within that
    space, a matrix that weighs every kind of state differently, which depends on neither order nor scales.
    """
    right, left = right.astype(complex), left.astype(complex)
    alike = np.abs(poles[:, None] - poles) <= ALIKE * float(np.abs(poles).max())
    left_over = np.flatnonzero(alike.sum(axis=1) > 1).tolist()
    if not left_over:
        return right, left
    parts = [part_of(name) for name in state_names]
    kinds = sorted({(part.family, part.harmonic, part.rotor) for part in parts})
    weights = np.array([1.0 + kinds.index((part.family, part.harmonic, part.rotor)) for part in parts])
    while left_over:
        cluster = [i for i in left_over if alike[left_over[0], i]]
        left_over = [i for i in left_over if i not in cluster]
        if len(cluster) > 1:
            inner = left[cluster] @ (weights[:, None] * right[:, cluster])
            _, turn = np.linalg.eig(inner)
            right[:, cluster] = right[:, cluster] @ turn
            left[cluster] = np.linalg.pinv(turn) @ left[cluster]
    return right, left


# --- what a mode is of ------------------------------------------------------------------------------------------


class _Label(NamedTuple):
    """Name, family and rotors of a mode."""

    name: str
    family: str
    rotors: tuple[int, ...] = ()


class _Found:
    """Modes without names.

    Attributes
    ----------
    modes : list of Mode
    participation : ndarray, shape (n_modes, n)
    rows : list of list of float
        The same.
    """

    def __init__(self, modes: list[Mode]) -> None:
        self.modes = modes
        self.participation = np.array([mode.participation for mode in modes])
        self.rows: list[list[float]] = self.participation.tolist()

    def sums(self, indices: Indices) -> list[float]:
        """Share of some states in every mode."""
        return self.participation.take(indices, axis=1).sum(axis=1).tolist()

    def largest(self, indices: Indices) -> list[float]:
        """The largest share of one of some states in every mode."""
        return self.participation.take(indices, axis=1).max(axis=1).tolist()


@dataclass(frozen=True, eq=False)
class _States:
    """States of a matrix, and where those are that belong together."""

    names: tuple[str, ...]
    parts: tuple[Part, ...]

    @cached_property
    def is_stand(self) -> bool:
        """The body is a stand, with deflections among its states."""
        return not DEFLECTIONS.keys().isdisjoint(self.names)

    @cached_property
    def halves(self) -> list["_Group"]:
        """Groups of the body; a stand is one."""
        body = self.where(family="body")
        if self.is_stand:
            return [_Group("body", False, (), body, {}, {}, {})]
        halves = [np.array([i for i in body if (self.names[i] in LATERAL) == half]) for half in (False, True)]
        return [_Group("body", bool(i), (), half, {}, {}, {}) for i, half in enumerate(halves) if len(half)]

    @cached_property
    def drives(self) -> list["_Group"]:
        """The group of the drives, if there are any."""
        found = self.where(family="drive")
        return [_Group("drive", False, (), found, {}, {}, {})] if len(found) else []

    @cached_property
    def indices(self) -> dict[str, int]:
        """Index of each state by name."""
        return {name: i for i, name in enumerate(self.names)}

    @cached_property
    def families(self) -> dict[str, Indices]:
        """Indices of the states of each family."""
        return {family: self.where(family=family) for family in dict.fromkeys(part.family for part in self.parts)}

    @cached_property
    def kinds(self) -> dict[int, tuple[tuple[str, int, bool], ...]]:
        """Family and harmonic of the states of each rotor, and whether they are rates."""
        return {
            rotor: tuple(
                sorted((part.family, part.harmonic, part.is_rate) for part in self.parts if part.rotor == rotor)
            )
            for rotor in sorted({part.rotor for part in self.parts} - {-1})
        }

    @cached_property
    def turning(self) -> dict[int, list[Indices]]:
        """Indices of the rates of the first harmonic of flap and of lag of each rotor."""
        pairs = {
            rotor: [self.where(family=family, harmonic=1, rotor=rotor, is_rate=True) for family in ("flap", "lag")]
            for rotor in self.kinds
        }
        return {rotor: [pair for pair in found if len(pair) == 2] for rotor, found in pairs.items()}

    def where(self, **wanted: object) -> Indices:
        """Indices of the states whose parts have these attributes, in the order of their names."""
        items = wanted.items()
        found = [i for i, part in enumerate(self.parts) if all(getattr(part, key) == value for key, value in items)]
        return np.array(sorted(found, key=lambda i: self.names[i]), dtype=np.int64)


@cache
def _states(names: tuple[str, ...]) -> _States:
    return _States(names, tuple(part_of(name) for name in names))


@dataclass(frozen=True, eq=False)
class _Group(ByContent):
    """States that have modes together: the longitudinal ones, the lateral ones, a family of rotors that are alike.

    Attributes
    ----------
    family : str
    is_lateral : bool
    rotors : tuple of int
        Their indices.
    states : ndarray of int
        Indices of the states.
    by_harmonic, by_rotor, by_both : dict of ndarray of int
        Indices of those of a harmonic, of a rotor, and of a rotor and a harmonic without rates; of rotors only.
    """

    family: str
    is_lateral: bool
    rotors: tuple[int, ...]
    states: Indices
    by_harmonic: dict[int, Indices]
    by_rotor: dict[int, Indices]
    by_both: dict[tuple[int, int], Indices]


@cache
def _rotor_groups(states: _States, rotors: tuple[int, ...]) -> list[_Group]:
    """Groups of some rotors, which are alike."""
    families = dict.fromkeys(part.family for part in states.parts if part.rotor == rotors[0])
    return [_rotor_group(states, family, rotors) for family in families]


def _rotor_group(states: _States, family: str, rotors: tuple[int, ...]) -> _Group:
    by_rotor = {rotor: states.where(family=family, rotor=rotor) for rotor in rotors}
    together = np.concatenate(list(by_rotor.values()))
    harmonics = np.array([states.parts[i].harmonic for i in together])
    by_harmonic = {int(harmonic): together[harmonics == harmonic] for harmonic in dict.fromkeys(harmonics)}
    by_both = {
        (rotor, harmonic): states.where(family=family, rotor=rotor, harmonic=harmonic, is_rate=False)
        for rotor in rotors
        for harmonic in by_harmonic
    }
    return _Group(family, False, rotors, together, by_harmonic, by_rotor, by_both)


def _alike_rotors(speeds: Mapping[int, float], states: _States) -> list[tuple[int, ...]]:
    """Rotors with states of the same kinds and one speed, which may share modes."""
    found: list[list[int]] = []
    for rotor, speed in speeds.items():
        for members in found:
            other = speeds[members[0]]
            # a speed that is not known is no difference
            if states.kinds[rotor] == states.kinds[members[0]] and not abs(speed - other) > SAME_SPEED * other:
                members.append(rotor)
                break
        else:
            found.append([rotor])
    return [tuple(members) for members in found]


def _speed(a: Array, states: _States, rotor: int) -> float:
    """Speed of a rotor [rad/s], not a number where the states do not show it.

    The turning of the multiblade coordinates couples the rates of the two of the nth harmonic by -2 n Omega and
    2 n Omega (theory.md eq. 1.8). The product of both elements does not depend on units. Flap gives it to 1e-5, lag,
    whose inertia the hub adds to, to some per cent.
    """
    for cosine, sine in states.turning[rotor]:
        if (product := a[cosine, sine] * a[sine, cosine]) < 0.0:
            return math.sqrt(-product) / 2.0
    return math.nan


def _leading(shares: Mapping[Key, float], first: Key) -> list[Key]:
    """Those with the largest share or next to it, largest first; `first` before all if it is one of them."""
    limit = LEVEL * max(shares.values())
    return sorted((key for key in shares if shares[key] >= limit), key=lambda key: (key != first, -shares[key]))


def _choices(found: _Found, groups: Sequence[_Group], states: _States) -> list[list[tuple[_Group, float]]]:
    """Groups that each mode may be of, the best one first, with what it has of them relative to that.

    The family with the largest share, and in it the half of the body with the leading state, or the rotors with the
    largest share. Others that come near remain choices.
    """
    leads = found.participation.argmax(axis=1).tolist()
    families = {family: found.sums(indices) for family, indices in states.families.items()}
    measures = [_measures(found, group) for group in groups]
    return [
        _own_choices(
            {family: shares[i] for family, shares in families.items()},
            states.parts[lead].family,
            [(group, shares[i]) for group, shares in zip(groups, measures, strict=True)],
        )
        for i, lead in enumerate(leads)
    ]


def _measures(found: _Found, group: _Group) -> list[float]:
    """What every mode has of a group: the largest share of the body's states; the share of the rotors it would name."""
    if group.family == "body":
        return found.largest(group.states)
    total = found.sums(group.states)
    if len(group.rotors) < 2:
        return total
    largest = map(max, zip(*(found.sums(indices) for indices in group.by_rotor.values()), strict=True))
    return [_named_share(one, both) for one, both in zip(largest, total, strict=True)]


def _named_share(largest: float, total: float) -> float:
    """Share of the rotor that alone is named, or of all."""
    return largest if largest > OWNED * total else total


def _own_choices(
    shares: Mapping[str, float], lead: str, measured: Sequence[tuple[_Group, float]]
) -> list[tuple[_Group, float]]:
    """Choices of one mode by its shares of the families, the family of its leading state, and what groups measure."""
    found: list[tuple[_Group, float]] = []
    for family in _leading(shares, lead):
        least = NEXT if family == "body" else LEVEL
        own = [choice for choice in measured if choice[0].family == family]
        largest = max(share for _, share in own)
        near = [(group, share / largest) for group, share in own if share >= least * largest]
        found += sorted(near, key=lambda choice: -choice[1])
    return found


def _named(found: _Found, speeds: Mapping[int, float], states: _States) -> list[Mode]:
    """Every mode with the name that its group gives; of two with one name one takes its next choice if that is free."""
    groups = [*states.halves, *states.drives]
    for rotors in _alike_rotors(speeds, states):
        groups += _rotor_groups(states, rotors)
    choices = _choices(found, groups, states)
    chosen = [own[0][0] for own in choices]
    labels = _labels(found, chosen, speeds, states)
    others = [(share, i, group) for i, own in enumerate(choices) for group, share in own[1:]]
    for _, i, group in sorted(others, key=lambda other: -other[0]):
        if (different := _name_count(labels)) == len(labels):
            break
        trial = [*chosen[:i], group, *chosen[i + 1 :]]
        again = _labels(found, trial, speeds, states)
        if _name_count(again) > different:
            chosen, labels = trial, again
    return [_with_label(found.modes[i], label) for i, label in labels.items()]


def _name_count(labels: Mapping[int, _Label]) -> int:
    return len({label.name for label in labels.values()})


def _with_label(mode: Mode, label: _Label) -> Mode:
    return Mode(label.name, mode.pole, mode.vector, mode.participation, label.family, label.rotors)


def _labels(found: _Found, chosen: Sequence[_Group], speeds: Mapping[int, float], states: _States) -> dict[int, _Label]:
    """What the groups of modes call them, by the number of the mode; group after group."""
    labels: dict[int, _Label] = {}
    for group in {id(group): group for group in chosen}.values():
        inside = [i for i, own in enumerate(chosen) if own is group]
        if group.family == "drive":
            labels |= {i: _Label(_drive_name(found.rows[i], states), "drive") for i in inside}
            continue
        if group.family != "body":
            labels |= zip(inside, _rotor_labels(found, inside, group, speeds, states), strict=True)
            continue
        if states.is_stand:
            labels |= {i: _Label(_stand_name(found.rows[i], states), "body") for i in inside}
            continue
        names = (_lateral_names if group.is_lateral else _longitudinal_names)(found, inside, states)
        for i, name in zip(inside, names, strict=True):
            labels[i] = _Label("heave-yaw" if _is_heave_yaw(found, i, states) else name, "body")
    return labels


def _drive_name(row: Sequence[float], states: _States) -> str:
    """Name of a mode after the state of a drive that has the largest share."""
    indices = states.where(family="drive").tolist()
    name, _, number = states.names[max(indices, key=lambda i: row[i])].partition("(")
    several = len({states.names[i].partition("(")[2] for i in indices}) > 1
    return f"{DRIVE_MODES[name]}{', drive ' + number.rstrip(')') if several else ''}"


def _stand_name(row: Sequence[float], states: _States) -> str:
    """Name of a mode after the axis of the stand that has the largest share."""
    shares = {axis: sum(_shares(row, states, (axis, rate)).values()) for axis, rate in DEFLECTIONS.items()}
    return f"stand {max(shares, key=lambda axis: shares[axis])}"


# --- names of the body's modes ----------------------------------------------------------------------------------


def _shares(row: Sequence[float], states: _States, wanted: Iterable[str]) -> dict[str, float]:
    """Shares of states in a mode, 0 of those that there are not."""
    indices = states.indices
    return {name: row[indices[name]] if name in indices else 0.0 for name in wanted}


def _is_heave_yaw(found: _Found, number: int, states: _States) -> bool:
    """True for an oscillation of w and r against each other, which has none of the classical names."""
    if not found.modes[number].is_oscillatory:
        return False
    shares = _shares(found.rows[number], states, (*LONGITUDINAL, *LATERAL))
    first, second = sorted(shares, key=lambda name: -shares[name])[:2]
    return {first, second} == {"w", "r"} and shares[second] >= NOTABLE * shares[first]


def _longitudinal_names(found: _Found, inside: Sequence[int], states: _States) -> list[str]:
    """Phugoid of u and theta, short period of q, or of w and q if they oscillate, heave of w; or what diverges."""
    return [_longitudinal_name(found.modes[i], _shares(found.rows[i], states, LONGITUDINAL)) for i in inside]


def _longitudinal_name(mode: Mode, share: Mapping[str, float]) -> str:
    if mode.is_oscillatory:
        return "short period" if share["w"] + share["q"] > share["u"] + share["theta"] else "phugoid"
    lead = max(share, key=lambda name: share[name])
    if lead in ("u", "theta"):
        return "phugoid"
    if mode.is_growing:
        return "pitch divergence" if share["q"] + share["theta"] >= PITCHING * share["w"] else "heave divergence"
    return "short period" if lead == "q" else "heave subsidence"


def _lateral_names(found: _Found, inside: Sequence[int], states: _States) -> list[str]:
    """Dutch roll of v with phi or r, roll of p, spiral of r or phi; roll-spiral for a pair with little of v.

    Without a pair for the Dutch roll real poles with much of v are it, and what diverges of v and r is yaw; but of
    several real poles the one with least of v is the spiral.
    """
    modes_inside = [found.modes[i] for i in inside]
    shares = [_shares(found.rows[i], states, LATERAL) for i in inside]
    names = [
        _lateral_pair(share) if mode.is_oscillatory else "roll" if share["p"] == max(share.values()) else ""
        for mode, share in zip(modes_inside, shares, strict=True)
    ]
    left = sorted((i for i, name in enumerate(names) if not name), key=lambda i: shares[i]["v"])
    slipping = [i for i in left if "Dutch roll" not in names and shares[i]["v"] >= NOTABLE * max(shares[i].values())]
    for i in left:
        is_yaw = modes_inside[i].is_growing and shares[i]["r"] > shares[i]["phi"]
        names[i] = ("yaw divergence" if is_yaw else "Dutch roll") if i in slipping else "spiral"
    if len(left) == len(slipping) > 1:
        names[left[0]] = "spiral"
    return names


def _lateral_pair(share: Mapping[str, float]) -> str:
    lead = max(share.values())
    if share["v"] >= NOTABLE * lead:
        return "Dutch roll"
    return "roll" if max(share["phi"], share["r"]) < NOTABLE * lead else "roll-spiral"


# --- names of the rotors' modes ---------------------------------------------------------------------------------


def _rotor_labels(
    found: _Found, inside: Sequence[int], group: _Group, speeds: Mapping[int, float], states: _States
) -> list[_Label]:
    """Names of the modes of a family: as many poles to a harmonic as it has states, with the largest participation.

    One for one, because some are close together: with nu near 1/2 collective and regressing lag are.
    """
    slots = [harmonic for harmonic, indices in group.by_harmonic.items() for _ in indices]
    shares = {harmonic: _of(found.sums(indices), inside) for harmonic, indices in group.by_harmonic.items()}
    by_rotor = {rotor: _of(found.sums(indices), inside) for rotor, indices in group.by_rotor.items()}
    own = [found.modes[i] for i in inside]
    largest = [max(shares, key=lambda harmonic: shares[harmonic][i]) for i in range(len(inside))]
    return [
        _rotor_label(
            *(mode, {rotor: having[i] for rotor, having in by_rotor.items()}, group),
            *(taken[0] if taken else largest[i], speeds, states),
        )
        for i, (mode, taken) in enumerate(zip(own, _match(own, slots, shares), strict=True))
    ]


def _of(values: Sequence[float], numbers: Sequence[int]) -> list[float]:
    return [values[i] for i in numbers]


def _match(found: Sequence[Mode], slots: Sequence[int], shares: Mapping[int, list[float]]) -> list[list[int]]:
    """Slots of each mode, two of a pair, that maximise the sum of the shares; the larger share first."""
    from scipy.optimize import linear_sum_assignment  # here: it takes a quarter of a second, and few need it

    owners = [i for i, mode in enumerate(found) for _ in range(1 + mode.is_oscillatory)]
    gain = np.array([shares[slot] for slot in slots]).T[owners].reshape(len(owners), len(slots))
    result: list[list[int]] = [[] for _ in found]
    for row, column in zip(*linear_sum_assignment(gain, maximize=True), strict=True):
        result[owners[row]].append(slots[column])
    return [sorted(taken, key=lambda slot: -shares[slot][i]) for i, taken in enumerate(result)]


def _rotor_label(
    mode: Mode,
    shares: Mapping[int, float],
    group: _Group,
    harmonic: int,
    speeds: Mapping[int, float],
    states: _States,
) -> _Label:
    """Name of a mode of a harmonic, with the rotor that has it, or what several do together; by each rotor's share."""
    name = _family_name(group.family, harmonic)
    owner = max(shares, key=lambda rotor: shares[rotor])
    if group.family != "inflow" and harmonic > 0:
        name = f"{_way(mode, harmonic * speeds[owner], group.by_both[owner, harmonic])} {name}".strip()
    having = (owner,) if shares[owner] > OWNED * sum(shares.values()) else group.rotors
    name += _rotors_suffix(having, len(states.kinds))
    if len(having) == 2:
        first, second = (mode.vector[group.by_both[rotor, harmonic]] for rotor in having)
        name += ", symmetric" if np.vdot(first, second).real > 0.0 else ", antisymmetric"
    return _Label(name, group.family, tuple(rotor + 1 for rotor in having))


def _family_name(family: str, harmonic: int) -> str:
    if family == "inflow":
        return "cyclic inflow" if harmonic else "uniform inflow"
    if family == "wake" and harmonic >= 0:
        return ("collective wake", "wake")[harmonic] if harmonic < 2 else f"wake {harmonic}"
    if harmonic == 0:
        return "coning" if family == "flap" else "collective lag"
    if harmonic == -1:
        return f"differential {family}"
    return family if harmonic == 1 else f"{family} {harmonic}"


def _rotors_suffix(having: Sequence[int], everybody: int) -> str:
    """Which rotors have a mode, where not all of them do."""
    if len(having) == everybody:
        return ""
    numbers = [str(rotor + 1) for rotor in having]
    return f", rotor {numbers[0]}" if len(numbers) == 1 else f", rotors {', '.join(numbers[:-1])} and {numbers[-1]}"


def _way(mode: Mode, turning: float, coordinates: Indices) -> str:
    """Regressing or advancing, as the rotor sees the wave of a cyclic coordinate; empty where it does neither.

    With the rotating frequency nu the modes of the nth harmonic are at |nu - n| and nu + n per revolution. Slower than
    n revolutions (`turning`) is regressing. A faster one turns against the rotor if it regresses (nu above 2 n), the
    sine coordinate before the cosine one, and with the rotor if it advances.
    """
    if not mode.is_oscillatory or mode.pole.imag < turning * (1.0 - STANDING):
        return "regressing"
    if not mode.pole.imag > turning * (1.0 + STANDING) or len(coordinates) != 2:
        return ""
    cosine, sine = mode.vector[coordinates]  # a1 and b1, xic and xis: in the order of their names
    return "regressing" if (cosine.conjugate() * sine).imag > 0.0 else "advancing"


def _rank(found: list[Mode], name: str, ways: tuple[str, str]) -> list[Mode]:
    """Rename modes of one rotor that are called `name`: the slower half of their poles regress, the faster advance."""
    poles = sorted(
        (i for i, mode in enumerate(found) if mode.name == name for _ in range(1 + mode.is_oscillatory)),
        key=lambda i: (found[i].pole.imag, found[i].frequency),
    )
    regressing = set(poles[: len(poles) // 2])
    chosen = {i: ways[0] if i in regressing else ways[1] for i in poles}
    return [replace(mode, name=chosen.get(i, mode.name)) for i, mode in enumerate(found)]


def _first_matrix_name(mode: Mode, parts: Sequence[Part]) -> str:
    """Name after Table 5; `_rank` distinguishes the coupled cyclic modes."""
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
