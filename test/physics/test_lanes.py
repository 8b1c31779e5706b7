"""Lanes: every operation against exact rational arithmetic, compiled and interpreted, in every number of lanes."""

import itertools
import math
import os
import subprocess
import sys
import textwrap
from fractions import Fraction

import numba
import numpy as np
import pytest

from sbs_sim import lanes
from sbs_sim.lanes import (
    ZERO,
    Lanes,
    Mask,
    Matrix,
    Vector,
    all_lanes,
    any_lane,
    as_lanes,
    as_records,
    cross,
    dot,
    floor,
    inverse_root_guess,
    maximum,
    memory,
    minimum,
    rounded,
    seldom,
    select,
    sqrt,
    transposed,
    with_sign,
    zeros_like,
)
from sbs_sim.lanes import interpreted as plain
from sbs_sim.model.records import aligned, dtype_of

WIDTHS = (1, 2, 4, 8)
SPECIAL = [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e308, -1e308, math.inf, -math.inf, math.nan, 1e-160, 3.0, 1 + 2**-52]
LIKE = {n: np.zeros(1, np.dtype([("a", np.float64, (n,))])) for n in WIDTHS}


def compiled(function, arguments):
    """Function of so many lanes that takes and gives arrays, as compiled code."""
    names = ", ".join(f"x[i, {k}]" for k in range(arguments))
    code = f"""
    def run(data, result, like):
        records = as_records(like)
        x, out = as_lanes(data, records), as_lanes(result, records)
        for i in range(x.shape[0]):
            out[i] = function({names})
    """
    space = {"as_records": as_records, "as_lanes": as_lanes, "function": numba.njit(function)}
    exec(textwrap.dedent(code), space)
    return numba.njit(error_model="numpy")(space["run"])


def rows(arguments, n, seed=0, count=24):
    """Random and special arguments, shape (count, arguments, n)."""
    rng = np.random.default_rng(seed)
    data = rng.normal(size=(count, arguments, n)) * 10.0 ** rng.integers(-3, 4, (count, arguments, n))
    choice = rng.random(data.shape) < 0.25
    data[choice] = rng.choice(SPECIAL, choice.sum())
    return data


def alike(a, b):
    """Equal bits, but for the bits of what is not a number."""
    a, b = np.asarray(a), np.asarray(b)
    nan = np.isnan(a) & np.isnan(b)
    return np.array_equal(a[~nan].view(np.int64), b[~nan].view(np.int64)) and np.array_equal(np.isnan(a), np.isnan(b))


def both(function, arguments, seed=0):
    """Arguments and results of a function, which are the same compiled and interpreted in every number of lanes."""
    run, found = compiled(function, arguments), None
    for n in WIDTHS:
        data = rows(arguments, 8, seed).reshape(-1, arguments, 8 // n, n).swapaxes(1, 2).reshape(-1, arguments, n)
        result = np.empty((len(data), n))
        run(data, result, LIKE[n])
        with np.errstate(all="ignore"):
            expected = [rounded(function(*(Lanes(part) for part in row))).values for row in data]
        assert alike(result, np.array([np.broadcast_to(one, n) for one in expected]))
        flat = data.swapaxes(1, 2).reshape(-1, arguments), result.ravel()
        assert found is None or alike(found[1], flat[1])
        found = flat
    return found


def exactly(value):
    """A rational number rounded to double precision; zero has no sign here."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


ARITHMETIC = {
    "a + b": (lambda a, b: a + b, lambda a, b: a + b),
    "a - b": (lambda a, b: a - b, lambda a, b: a - b),
    "a * b": (lambda a, b: a * b, lambda a, b: a * b),
    "a * b + c": (lambda a, b, c: a * b + c, lambda a, b, c: a * b + c),
    "c + a * b": (lambda a, b, c: c + a * b, lambda a, b, c: c + a * b),
    "a * b - c": (lambda a, b, c: a * b - c, lambda a, b, c: a * b - c),
    "c - a * b": (lambda a, b, c: c - a * b, lambda a, b, c: c - a * b),
    "-(a * b) + c": (lambda a, b, c: -(a * b) + c, lambda a, b, c: c - a * b),
    "2 a + b": (lambda a, b: 2.0 * a + b, lambda a, b: 2 * a + b),
    "a - 3 b": (lambda a, b: a - 3 * b, lambda a, b: a - 3 * b),
    "1 - a b": (lambda a, b: 1.0 - a * b, lambda a, b: 1 - a * b),
}


@pytest.mark.parametrize("name", ARITHMETIC)
def test_sums_and_products_are_rounded_once(name):
    function, exact = ARITHMETIC[name]
    arguments, results = both(function, function.__code__.co_argcount)
    finite = np.isfinite(arguments).all(axis=1)
    assert finite.sum() > 50
    for row, result in zip(arguments[finite], results[finite], strict=True):
        expected = exactly(exact(*map(Fraction, row)))
        assert result == expected, row


def test_of_two_products_the_right_one_is_rounded_first():
    for sign, function in ((1, lambda a, b, c, d: a * b + c * d), (-1, lambda a, b, c, d: a * b - c * d)):
        arguments, results = both(function, 4)
        finite = np.isfinite(arguments).all(axis=1)
        for (a, b, c, d), result in zip(arguments[finite], results[finite], strict=True):
            right = exactly(Fraction(c) * Fraction(d))
            if math.isfinite(right):
                assert result == exactly(Fraction(a) * Fraction(b) + sign * Fraction(right))


OTHERS = {
    "a / b": lambda a, b: a / b,
    "1 / a": lambda a: 1.0 / a,
    "a b / c": lambda a, b, c: a * b / c,
    "a b c": lambda a, b, c: a * b * c + a,
    "-a": lambda a: -a,
    "abs": lambda a, b: abs(a * b),
    "sqrt": lambda a: sqrt(a),
    "floor": lambda a: floor(a),
    "minimum": lambda a, b: minimum(a, b),
    "maximum": lambda a, b: maximum(a, b * 2.0),
    "with_sign": lambda a, b: with_sign(a, b),
    "select": lambda a, b, c: select(a < b, a, c * 2.0),
    "masks": lambda a, b, c: select((a < b) & ~(b <= c) | (a >= c), 1.0, a),
    "greater": lambda a, b: select(a > b * 1.0, a, b),
    "guess": lambda a: inverse_root_guess(abs(a) + 1.0),
    "zeros": lambda a: zeros_like(a) + 2.0,
    "rounded": lambda a, b: rounded(a * b) - a * b,
    "in place": None,
}


def in_place(a, b):
    total = zeros_like(a)
    total += a
    total *= b
    total -= 1.0
    total /= 3.0
    return total


OTHERS["in place"] = in_place


@pytest.mark.parametrize("name", OTHERS)
def test_other_operations_are_the_same_compiled_and_interpreted(name):
    both(OTHERS[name], OTHERS[name].__code__.co_argcount)


def test_quotients_and_roots_are_rounded_once():
    arguments, results = both(lambda a, b: a / b, 2)
    for (a, b), result in zip(arguments, results, strict=True):
        if math.isfinite(a) and math.isfinite(b) and b:
            assert result == exactly(Fraction(a) / Fraction(b))
    arguments, results = both(lambda a: sqrt(a), 1)
    assert alike(results, [math.sqrt(a) if a >= 0 else math.nan for (a,) in arguments])


EXACT_OTHERS = {
    "floor": (lambda a: floor(a), lambda a: math.floor(a)),
    "minimum": (lambda a, b: minimum(a, b), min),
    "maximum": (lambda a, b: maximum(a, b), max),
    "abs": (lambda a: abs(a), abs),
    "select": (lambda a, b, c: select(a < b, b, c), lambda a, b, c: b if a < b else c),
    "a b c": (lambda a, b, c: a * b * c, None),
    "a b / c": (lambda a, b, c: a * b / c, None),
}


def rational(value):
    """Fraction of a double that is finite."""
    return Fraction(float(value))


@pytest.mark.parametrize("name", [name for name, (_, exact) in EXACT_OTHERS.items() if exact])
def test_what_rounds_nothing_is_exact(name):
    function, exact = EXACT_OTHERS[name]
    arguments, results = both(function, function.__code__.co_argcount)
    finite = np.isfinite(arguments).all(axis=1)
    for row, result in zip(arguments[finite], results[finite], strict=True):
        assert rational(result) == exact(*map(rational, row)), row


@pytest.mark.parametrize("divided", [False, True])
def test_a_product_that_goes_on_is_rounded_first(divided):
    function = EXACT_OTHERS["a b / c" if divided else "a b c"][0]
    arguments, results = both(function, 3)
    finite = np.isfinite(arguments).all(axis=1)
    for (a, b, c), result in zip(arguments[finite], results[finite], strict=True):
        first = exactly(rational(a) * rational(b))
        if math.isfinite(first) and (c or not divided):
            second = rational(first) / rational(c) if divided else rational(first) * rational(c)
            assert result == exactly(second)


def test_what_is_not_a_number_stays_in_its_lane_and_no_comparison_is_true_of_it():
    def compared(a, b):
        found = select(a < b, 1.0, 0.0) + select(a <= b, 2.0, 0.0)
        return found + select(a > b, 4.0, 0.0) + select(a >= b, 8.0, 0.0) + select(~(a < b), 16.0, 0.0)

    arguments, results = both(compared, 2)
    strange = np.isnan(arguments).any(axis=1)
    assert strange.any()
    assert (results[strange] == 16.0).all()
    for function in (lambda a, b: a + b, lambda a, b: a * b - 1.0, lambda a, b: sqrt(abs(a)) / b):
        arguments, results = both(function, 2)
        assert np.isnan(results[np.isnan(arguments).any(axis=1)]).all()
        ordinary = (np.abs(arguments) < 1e100).all(axis=1) & (np.abs(arguments) > 1e-100).all(axis=1)
        assert ordinary.any()
        assert np.isfinite(results[ordinary]).all()


def test_zeros_keep_the_signs_of_the_standard():
    """IEEE 754, section 6.3: an exact sum of zero is positive, but for two negative zeros."""
    cases = np.array(list(itertools.product([0.0, -0.0, 1.0, -1.0], repeat=3)))
    for function, exact in (
        (lambda a, b, c: a + b, lambda a, b, c: a + b),
        (lambda a, b, c: a - b, lambda a, b, c: a - b),
        (lambda a, b, c: a * b + c, lambda a, b, c: a * b + c),  # these products are exact
        (lambda a, b, c: c - a * b, lambda a, b, c: c - a * b),
        (lambda a, b, c: with_sign(a, b), lambda a, b, c: math.copysign(a, b)),
    ):
        result = np.empty((len(cases), 1))
        compiled(function, 3)(cases[:, :, None], result, LIKE[1])
        assert alike(result[:, 0], [exact(*map(float, case)) for case in cases])


def test_the_first_argument_survives_what_is_not_a_number():
    nan, one = Lanes([math.nan, 1.0]), Lanes([1.0, math.nan])
    for function in (minimum, maximum):
        assert alike(function(nan, one).values, [math.nan, 1.0])
    both(lambda a, b: minimum(maximum(a, b), a), 2)


def test_a_product_of_what_is_rounded_differs_from_a_fused_one():
    """Else nothing above could tell them apart."""
    a, b = 1 + 2**-30, 1 - 2**-30
    assert (Lanes(a) * Lanes(b) - 1.0).values[0] == -(2**-60)
    assert (rounded(Lanes(a) * Lanes(b)) - 1.0).values[0] == 0.0


def test_the_fused_operation_of_the_interpreter_is_that_of_the_processor():
    values = [0.0, -0.0, 1.5, -1e308, math.inf, -math.inf, math.nan, 5e-324, 1 + 2**-52, -(1 - 2**-53)]
    cases = np.array(list(itertools.product(values, repeat=3)))
    result = np.empty((len(cases), 1))
    compiled(lambda a, b, c: a * b + c, 3)(cases[:, :, None], result, LIKE[1])
    assert alike(result[:, 0], [plain.exact_fused(*map(float, case)) for case in cases])


def test_any_and_all_lanes():
    def count(a, b):
        found = zeros_like(a) + (1.0 if any_lane(a < b) else 0.0) + (2.0 if all_lanes(a < b) else 0.0)
        if seldom(any_lane(a < b)):
            return found + (4.0 if seldom(all_lanes(a < b)) else 8.0)
        return found

    for n in WIDTHS[1:]:
        data = np.ones((3, 2, n))
        data[0, 0], data[1, 0, -1] = 0.0, 0.0
        result = np.empty((3, n))
        compiled(count, 2)(data, result, LIKE[n])
        np.testing.assert_array_equal(result[:, 0], [7.0, 9.0, 0.0])
        assert [count(*map(Lanes, row)).values[0] for row in data] == [7.0, 9.0, 0.0]
    with pytest.raises(TypeError, match="any_lane or all_lanes"):
        bool(Mask([True, False]))


def test_lanes_of_different_numbers_do_not_mix():
    with pytest.raises(TypeError, match=r"different numbers meet: \[2, 4\]"):
        Lanes(np.ones(2)) * Lanes(np.ones(4)) + 1.0
    assert (Lanes(np.ones(4)) + Lanes([2.0])).n == 4


# --- vectors ----------------------------------------------------------------------------------------------------


def exact_dot(a, b):
    """Scalar product with the rounding that the rules give."""
    first = plain.fused(a[0], b[0], a[1] * b[1])
    return plain.fused(a[2], b[2], first)


VECTORS = {
    "dot": lambda a, b, c, d, e, f: dot(Vector(a, b, c), Vector(d, e, f)),
    "cross": lambda a, b, c, d, e, f: cross(Vector(a, b, c), Vector(d, e, f)).y,
    "sum": lambda a, b, c, d, e, f: (Vector(a, b, c) * d + Vector(d, e, f)).z,
    "difference": lambda a, b, c, d, e, f: (Vector(a, b, c) - e * Vector(d, e, f)).x,
    "matrix": lambda a, b, c, d, e, f: (Matrix(Vector(a, b, c), Vector(d, e, f), Vector(f, e, d)) @ Vector(c, b, a)).y,
    "transposed": lambda a, b, c, d, e, f: (
        (transposed(Matrix(Vector(a, b, c), Vector(d, e, f), Vector(f, e, d))) @ Vector(c, b, a)).y
    ),
    "sparse": lambda a, b, c, d, e, f: dot(cross(Vector(ZERO, ZERO, a), Vector(b, c, ZERO)), Vector(d, e, f)),
    "sparse sum": lambda a, b, c, d, e, f: (Vector(ZERO, a, b) * c - Vector(d, ZERO, ZERO) + Vector(d, e, f)).x,
    "negative": lambda a, b, c, d, e, f: (-(Vector(a, ZERO, c) * d)).x + e,
}


@pytest.mark.parametrize("name", VECTORS)
def test_vectors_are_the_same_compiled_and_interpreted(name):
    arguments, results = both(VECTORS[name], 6)
    expected = {
        "dot": lambda a, b, c, d, e, f: exact_dot((a, b, c), (d, e, f)),
        "cross": lambda a, b, c, d, e, f: plain.fused(c, d, -(a * f)),
        "sum": lambda a, b, c, d, e, f: plain.fused(c, d, f),
        "difference": lambda a, b, c, d, e, f: plain.fused(-e, d, a),
        "matrix": lambda a, b, c, d, e, f: exact_dot((d, e, f), (c, b, a)),
        "transposed": lambda a, b, c, d, e, f: exact_dot((b, e, e), (c, b, a)),
        "sparse": lambda a, b, c, d, e, f: plain.fused(-(a * c), d, (a * b) * e),
        "sparse sum": lambda a, b, c, d, e, f: -d + d,
        "negative": lambda a, b, c, d, e, f: plain.fused(-a, d, e),
    }[name]
    finite = np.isfinite(arguments).all(axis=1) & np.isfinite(results)
    for row, result in zip(arguments[finite], results[finite], strict=True):
        assert result == expected(*map(float, row))


def test_zero_stays_out_of_what_it_meets():
    nan = Lanes(math.nan)
    assert ZERO * nan is ZERO
    assert nan * ZERO is ZERO
    assert (ZERO + nan) is nan
    assert (nan - ZERO) is nan
    assert -ZERO is ZERO
    both(lambda a, b: dot(Vector(ZERO, a, ZERO), Vector(b, 2.0, b)), 2)


def test_a_variable_is_not_a_product_here_and_lanes_there():
    """Where it would be rounded could not be seen."""

    def hidden(a, b):
        total = a * b
        if any_lane(a < b):
            total = total + a
        return total

    with pytest.raises(numba.TypingError, match="Cannot unify"):
        compiled(hidden, 2)(np.ones((1, 2, 4)), np.ones((1, 4)), LIKE[4])


# --- memory -----------------------------------------------------------------------------------------------------

FIELDS = {"number": None, "a": (), "v": (3,), "m": (3, 3), "many": (5,)}


def run_both(source, *arguments):
    """Run a function compiled and interpreted on copies of arrays; the arrays afterwards."""
    found = []
    for interpreted in (False, True):
        space = {**globals(), **{name: getattr(lanes, name) for name in MEMORY}, "n": arguments[0]["a"].shape[-1]}
        if interpreted:
            space |= {name: getattr(memory, f"_plain_{name}") for name in MEMORY}
        exec(textwrap.dedent(source), space)
        copies = [argument.copy() for argument in arguments]
        run = space["run"] if interpreted else numba.njit(error_model="numpy")(space["run"])
        run(*copies)
        found.append(copies)
    for one, other in zip(*found, strict=True):
        assert one.tobytes() == other.tobytes()
    return found[0]


MEMORY = ("as_records", "as_lanes", "spread", "add_to_quads", "table_row", "copy_record", "add_record")


def filled(fields, shape, n, seed=0):
    """Random records."""
    made = aligned(shape, dtype_of(fields, n))
    rng = np.random.default_rng(seed)
    for name, kind in fields.items():
        size = made[name].shape
        made[name] = rng.integers(0, 9, size) if kind is None else rng.normal(size=size)
    return made


@pytest.mark.parametrize("n", WIDTHS)
def test_records_hold_lanes_vectors_matrices_and_several_lanes(n):
    (found,) = run_both(
        """
        def run(data):
            records = as_records(data)
            for i in range(records.shape[0]):
                r = records[i]
                r.v = r.m @ r.v + r.v * r.a
                r.many[r.number % 5] = r.many[0] * r.a + 1.0
                r.a = r.m.y.z
                r.number = r.number + 1
        """,
        before := filled(FIELDS, 3, n),
    )
    np.testing.assert_array_equal(found["number"], before["number"] + 1)
    np.testing.assert_array_equal(found["a"], before["m"][:, 1, 2])
    np.testing.assert_allclose(
        found["v"],
        np.einsum("kijn,kjn->kin", before["m"], before["v"]) + before["v"] * before["a"][:, None],
        rtol=1e-14,
    )


@pytest.mark.parametrize(("narrow", "wide"), [(1, 1), (1, 4), (1, 8), (4, 4), (8, 8)])
def test_values_of_quads_reach_their_blades(narrow, wide):
    data, values = filled({"a": ()}, 2, wide), np.arange(5.0 * narrow).reshape(5, narrow)
    places = np.array([3, 1, 2, 0])
    _, _, _, out = (
        run_both(
            """
        def run(data, values, places, result):
            blades = as_records(data)
            narrow = as_lanes(values, NARROW)
            as_lanes(result, blades)[0] = spread(narrow, places, 1, blades[0])
        """.replace("NARROW", "blades" if narrow == wide else "as_records(values_like)"),
            data,
            values,
            places,
            np.zeros((1, wide)),
        )
        if narrow == wide
        else run_narrow(data, values, places, wide)
    )
    expected = values[places[1]] if narrow == wide else np.repeat(values[places[1 : 1 + wide // 4], 0], 4)
    np.testing.assert_array_equal(out[0], expected)


def run_narrow(data, values, places, wide):
    """The same where values have one lane and blades several."""
    single = filled({"a": ()}, 1, 1)
    found = run_both(
        """
        def run(data, values, places, result, single):
            blades = as_records(data)
            narrow = as_lanes(values, as_records(single))
            as_lanes(result, blades)[0] = spread(narrow, places, 1, blades[0])
        """,
        data,
        values,
        places,
        np.zeros((1, wide)),
        single,
    )
    return found[:4]


SUMMED = {"first": (), "a": (), "v": (3,), "last": ()}


@pytest.mark.parametrize("wide", [4, 8])
def test_sums_over_blades_and_over_flights_have_the_same_bits(wide):
    """Blades in lanes, or one blade of one flight after the other: from blade to blade, then from quad to quad."""
    blades, quads = filled({"a": (), "v": (3,)}, 1, wide), wide // 4
    source = """
        def run(data, sums):
            blade, total = as_records(data)[0], as_records(sums)
            add_to_quads(total, 0, BEGINS, "a", (blade.a * blade.a, blade.v * blade.a))
    """
    _, together = run_both(source.replace("BEGINS", "1"), blades, aligned(quads, dtype_of(SUMMED, 1)))
    apart = aligned(quads, dtype_of(SUMMED, 1))
    for lane in range(wide):
        one = aligned(1, dtype_of({"a": (), "v": (3,)}, 1))
        one["a"], one["v"] = blades["a"][:, lane : lane + 1], blades["v"][:, :, lane : lane + 1]
        own = apart[lane // 4 : lane // 4 + 1].copy()
        _, own = run_both(source.replace("BEGINS", str(int(lane % 4 == 0))), one, own)
        apart[lane // 4] = own[0]
    assert together.tobytes() == apart.tobytes()
    assert together["first"].any() == together["last"].any() == False  # noqa: E712  (nothing else is touched)
    np.testing.assert_allclose(together["a"][:, 0], (blades["a"][0] ** 2).reshape(quads, 4).sum(axis=1), rtol=1e-14)


def test_records_are_copied_and_added():
    fields = {"a": (), "v": (3,), "many": (21,)}
    for n in WIDTHS:
        data = filled(fields, 3, n)
        (found,) = run_both(
            """
            def run(data):
                records = as_records(data)
                add_record(records, 0, records, 1)
                copy_record(records, 2, records, 1)
            """,
            data,
        )
        for name in fields:
            np.testing.assert_array_equal(found[name][0], data[name][0] + data[name][1])
            np.testing.assert_array_equal(found[name][2], data[name][1])


@pytest.mark.parametrize("n", WIDTHS)
def test_rows_of_a_table_are_polynomials(n):
    rng = np.random.default_rng(5)
    table, records = rng.normal(size=(9, 16)), filled({"row": (), "x": (), "a": ()}, 6, n)
    records["row"] = rng.integers(0, 9, records["row"].shape)
    _, found, _ = run_both(
        """
        def run(data, result, table):
            records = as_records(data)
            out = as_lanes(result, records)
            for i in range(records.shape[0]):
                out[i, 0], out[i, 1], out[i, 2], out[i, 3] = table_row(table, records[i].row, records[i].x, 3)
        """,
        records,
        np.zeros((6, 4, n)),
        table,
    )
    powers = records["x"][:, None, :] ** np.arange(4)[:, None]
    expected = np.einsum("ipn,inpc->icn", powers, table[records["row"].astype(int)].reshape(6, n, 4, 4))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


# --- one digest -------------------------------------------------------------------------------------------------

DIGEST = """
    import hashlib, sys
    sys.path[:0] = ["test/support", "test/physics"]
    import numpy as np
    import test_lanes as T
    digest = hashlib.sha256()
    for name, (function, _) in T.ARITHMETIC.items():
        run = T.compiled(function, function.__code__.co_argcount)
        data = T.rows(function.__code__.co_argcount, 8)
        result = np.empty((len(data), 8))
        run(data, result, T.LIKE[8])
        result[np.isnan(result)] = np.nan
        digest.update(result.tobytes())
    print(digest.hexdigest())
"""
TARGETS = [
    {},
    {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""},
    {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},  # without fused multiplication in hardware
    {"NUMBA_OPT": "0"},
]


def test_the_bits_do_not_depend_on_the_processor_or_the_optimiser():
    found = set()
    for target in TARGETS:
        environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")} | target
        output = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(DIGEST)],
            env=environment, capture_output=True, text=True, check=True, timeout=120,
        )  # fmt: skip
        found.add(output.stdout)
    assert len(found) == 1
