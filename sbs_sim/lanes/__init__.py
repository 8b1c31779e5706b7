"""Lanes: numbers side by side in a vector register, with arithmetic that gives the same bits everywhere.

Formulas are written once, as if for one number. What flows through them decides what the lanes are: flights of a batch,
perturbations of a Jacobian, azimuths of an average, or the blades of a rotor.

Types
-----
`Lanes`
    n numbers of double precision; n is 1, 2, 4 or 8.
`Product`
    What `a * b` gives: the two factors, not multiplied yet.
`ZERO`
    A number that is known to be zero, in components of vectors: `Vector(x, ZERO, ZERO)` lies along the first axis. A
    sum with it is the other part as it is, a product with it is ZERO, and neither costs an instruction.
`Mask`
    n truth values, from comparisons; combined by `&`, `|`, `~`.
`Vector`, `Matrix`
    Three components, three rows; of lanes.

Numbers (Python's floats and integers, numpy's) mix with all of these and are the same in every lane, and so is a single
lane that meets several.

Rules of rounding
-----------------
- A product that something is added to, or that is subtracted from something, is one fused operation with one rounding:
  `a * b + c`, `c + a * b`, `a * b - c`, `c - a * b`.
- Of two products that meet in a sum the right one is rounded first: `a * b + c * d` is fused(a, b, round(c d)).
- Any other use of a product rounds it: a factor, quotient, comparison, function, memory, component of `Vector(...)`.
- Everything else rounds once, to nearest, as IEEE 754 says. Nothing is reordered: sums go from the left to the right.

So the bits follow from the types alone. They do not depend on the processor, the level of optimisation, the number of
lanes, or what the lanes are. Numbers among themselves are plain arithmetic, which fuses nothing; constants of a formula
are therefore best worked out in Python.

What is not a number
--------------------
NaN and infinities go through arithmetic as IEEE 754 says, in their own lane only. A comparison with NaN is false.
`minimum(a, b)` and `maximum(a, b)` give the first argument where one of the two is NaN: put first the one whose NaN
must be kept.

Compiled and interpreted
------------------------
Functions that numba compiles use LLVM's vectors (`sbs_sim.lanes.compiled`). With NUMBA_DISABLE_JIT the same source runs
on the classes of `sbs_sim.lanes.interpreted`, to the same bits, for a debugger.

On a processor without fused multiplication every fused operation is a call of a library: the same bits, several times
slower.
"""

from sbs_sim.lanes import compiled as _compiled  # noqa: F401  (registers the types and functions below with numba)
from sbs_sim.lanes.interpreted import (
    ZERO,
    Lanes,
    Mask,
    Matrix,
    Product,
    Vector,
    all_lanes,
    any_lane,
    cross,
    dot,
    floor,
    inverse_root_guess,
    maximum,
    minimum,
    rounded,
    seldom,
    select,
    sqrt,
    transposed,
    with_sign,
    zeros_like,
)
from sbs_sim.lanes.memory import (
    add_record,
    add_to_quads,
    as_lanes,
    as_quads,
    as_records,
    copy_record,
    spread,
    table_row,
)

__all__ = [
    "ZERO",
    "Lanes",
    "Mask",
    "Matrix",
    "Product",
    "Vector",
    "add_record",
    "add_to_quads",
    "all_lanes",
    "any_lane",
    "as_lanes",
    "as_quads",
    "as_records",
    "copy_record",
    "cross",
    "dot",
    "floor",
    "inverse_root_guess",
    "maximum",
    "minimum",
    "rounded",
    "seldom",
    "select",
    "spread",
    "sqrt",
    "table_row",
    "transposed",
    "with_sign",
    "zeros_like",
]
