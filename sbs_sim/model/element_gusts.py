"""Air at blade elements, as derivatives find it; `sbs_sim.model.air_elements` sets it."""

from typing import Any, NamedTuple

from sbs_sim.lanes import Vector, dot, rounded
from sbs_sim.model.kernel import kernel
from sbs_sim.model.state import vector_at


class ElementGusts(NamedTuple):
    """Air at the elements of a register of blades.

    Attributes
    ----------
    rows : lanes, shape (elements, 3)
        Velocity less that at the hub, along (y, t, u) [m/s].
    turning : lanes
        Share t that the lip of a duct turns of what comes along the disc.
    basis : Basis
    """

    rows: Any
    turning: Any
    basis: Any


@kernel
def in_elements(memory):
    """True for air that is sampled at every blade element."""
    return memory.gusts.shape[0] > 0


@kernel
def element_gusts(memory, blade, basis, r):
    """Air at the elements of a register of blades."""
    return ElementGusts(memory.gusts[r], blade.duct_turning, basis)


@kernel
def free_gust_at(gusts, i):
    """Velocity of the air at an element less that at the hub, along (d, t, n)."""
    gust, basis = vector_at(gusts.rows[i], 0), gusts.basis
    return Vector(dot(basis.span, gust), gust.y, dot(basis.normal, gust))


@kernel
def gust_at(gusts, i):
    """The same within a duct."""
    gust, basis, kept = vector_at(gusts.rows[i], 0), gusts.basis, 1.0 - gusts.turning
    inner = Vector(rounded(kept * gust.x), rounded(kept * gust.y), gust.z)
    return Vector(dot(basis.span, inner), inner.y, dot(basis.normal, inner))
