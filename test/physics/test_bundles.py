"""Bundles: what compiled code reads through one address is what the arrays hold, without a copy."""

import copy
import gc
import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from sbs_sim.lanes import as_lanes, as_records
from sbs_sim.lanes.bundles import Bundle, bundled
from sbs_sim.model.records import LANES, VECTOR, aligned, records


@bundled
class Inner(NamedTuple):
    """Numbers, and none."""

    numbers: Any
    none: Any


@bundled
class Outer(NamedTuple):
    """Arrays of several kinds around a bundle."""

    rows: Any
    inner: Inner
    items: Any


def made() -> Outer:
    rows = aligned((2, 3, 4), float)
    rows[:] = np.arange(24.0).reshape(2, 3, 4)
    items = records({"a": LANES, "b": VECTOR}, 5, 4)
    items["a"] = np.arange(20.0).reshape(5, 4)
    return Outer(rows, Inner(np.array([5, 7, 9]), np.zeros((0, 3))), items)


@numba.njit
def looked(outer: Any, out: Any) -> Any:
    """Sizes, strides and numbers of everything; writes one."""
    outer.rows[1, 2, 3] += 100.0
    lanes, items = as_lanes(outer.rows, as_records(outer.items)), as_records(outer.items)
    lanes[0, 1] = lanes[0, 1] + items[4].a
    for i, array in enumerate((outer.rows[0], outer.rows[1])):
        out[i] = array.sum()
    out[2], out[3], out[4] = outer.rows.size, outer.inner.numbers[2], outer.inner.none.shape[1]
    return outer.inner.none.shape[0] + outer.inner.numbers.sum() + outer.rows.strides[0] + outer.items.size


def test_compiled_code_reads_and_writes_the_arrays_themselves():
    outer, out = made(), np.zeros(5)
    assert looked(outer, out) == 0 + 21 + 96 + 5
    assert outer.rows[1, 2, 3] == 123.0
    np.testing.assert_array_equal(outer.rows[0, 1], [4 + 16, 5 + 17, 6 + 18, 7 + 19])
    np.testing.assert_array_equal(out, [outer.rows[0].sum(), outer.rows[1].sum(), 24, 9, 3])
    outer.rows[:] = 0.0
    looked(outer, out)
    assert out[1] == 100.0, "the same memory, later"


def test_another_bundle_of_the_same_kind_takes_the_same_code():
    first, second = made(), made()._replace(rows=np.ones((2, 3, 4)))
    assert isinstance(second, Bundle)
    out = np.zeros(5)
    looked(first, out)
    compiled = len(looked.signatures)
    looked(second, out)
    assert out[1] == 12 + 100
    assert len(looked.signatures) == compiled
    assert numba.typeof(first) == numba.typeof(second)
    assert pickle.loads(pickle.dumps(numba.typeof(first))) == numba.typeof(second), "as the cache of machine code does"


def test_fields_of_other_kinds_are_another_type():
    outer = made()
    other = outer._replace(inner=outer.inner._replace(numbers=np.array([0.5])))
    assert numba.typeof(other) != numba.typeof(outer)
    assert "numbers: array(int64, 1d, C)" in str(numba.typeof(outer))


def test_arrays_out_of_order_are_refused():
    outer = made()
    for rows in (outer.rows.T, outer.rows[:, :2]):
        with pytest.raises(
            TypeError, match=r"rows is array\(float64, 3d, [AF]\): allowed in a bundle are arrays in C order"
        ):
            numba.typeof(outer._replace(rows=rows))
    with pytest.raises(TypeError, match="inner is int64: allowed"):
        numba.typeof(outer._replace(inner=3))


def test_arrays_live_as_long_as_their_bundle():
    outer, out = made(), np.zeros(5)
    for _ in range(200):
        kept = outer._replace(rows=np.full((2, 3, 4), 2.0))
        gc.collect(0)
        np.full((2, 3, 4), 7.0)
        looked(kept, out)
        assert out[1] == 24 + 100


def test_copies_have_their_own_arrays():
    outer, out = made(), np.zeros(5)
    looked(outer, out)
    for other in (copy.deepcopy(outer), pickle.loads(pickle.dumps(outer))):
        other.rows[:] = 3.0
        looked(other, out)
        assert out[1] == 36 + 100
    assert outer.rows[1, 2, 3] == 123.0
    assert copy.copy(outer).rows is outer.rows


def test_threads_take_one_table():
    outer = made()
    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(lambda _: outer._address, range(64)))) == 1


def test_it_is_a_named_tuple():
    outer = made()
    rows, inner, items = outer
    assert (rows is outer.rows, inner is outer.inner, items is outer.items) == (True, True, True)
    assert Outer._fields == ("rows", "inner", "items")
    assert Outer.__doc__ == "Arrays of several kinds around a bundle."
    assert type(outer._replace(items=items)) is Outer
