"""Lanes in memory: arrays and records of numpy's whose last axis are the lanes.

An array of shape (..., n) is an array of shape (...) of lanes. A structured array whose fields have shapes (n,), (3,
n), (3, 3, n) or (m, n) is an array of records of lanes, vectors, matrices, or m lanes; fields of integers stay
integers. Nothing is copied: writing changes the numpy array. `as_quads` makes four lanes of a last axis of four
numbers, whatever the lanes of the rest are.

Quads of blades
---------------
Where the lanes are blades, four of them make a quad: blades of one rotor, in order; the last quad of a rotor is padded
with weightless blades. A register of eight lanes holds two quads, which may belong to two rotors. `spread` copies
a value of a quad (or of its rotor) to its blades, `add_to_quads` sums over the blades of a quad. Where the lanes are
flights, a register holds the same blade of each flight; then the two only read and add. The bits are the same in both
cases, since sums always go from blade to blade of a quad, and then from quad to quad.
"""

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config
from numba.core import cgutils, types
from numba.core.datamodel.models import CompositeModel
from numba.core.imputils import impl_ret_borrowed, lower_builtin, lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import intrinsic, register_model
from numba.np import arrayobj

from sbs_sim.lanes.compiled import (
    DOUBLE,
    INT32,
    INT64,
    LanesType,
    MatrixType,
    Typed,
    VectorType,
    as_type,
    broadcast,
    element,
    intrinsic_call,
    lanes_vector,
    parts_of,
    shuffle,
    vector_of,
)
from sbs_sim.lanes.interpreted import Lanes, Matrix, Vector, fused, rounded

QUAD = 4  # blades

# --- in plain Python --------------------------------------------------------------------------------------------


class LanesArray:
    """View of an array (..., n) as an array of lanes."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self.shape = data.shape[:-1]
        self.size = int(np.prod(self.shape))

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, index: Any) -> Any:
        found = self.data[index]
        return Lanes(found.copy()) if found.ndim == 1 else LanesArray(found)

    def __setitem__(self, index: Any, value: Any) -> None:
        self.data[index] = rounded(value).values


class RecordArray:
    """View of a structured array as an array of records of lanes."""

    def __init__(self, data: Any) -> None:
        self.data, self.shape = data, data.shape

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, index: Any) -> Any:
        found = self.data[index]
        return RecordArray(found) if getattr(found, "ndim", 0) else Record(found)


class Record:
    """Fields of one record; setting one writes into the array."""

    def __init__(self, data: Any) -> None:
        object.__setattr__(self, "data", data)

    def __getattr__(self, name: str) -> Any:
        value = self.data[name]
        kind = _field_kind(self.data.dtype[name])
        if kind is None:
            return int(value)
        return {"lanes": _copied, "vector": _vector, "matrix": _matrix, "array": LanesArray}[kind](value)

    def __setattr__(self, name: str, value: Any) -> None:
        kind = _field_kind(self.data.dtype[name])
        if kind is None:
            self.data[name] = value
        elif kind == "lanes":
            self.data[name] = rounded(value).values
        elif kind == "matrix":
            for row, vector in zip(self.data[name], (value.x, value.y, value.z), strict=True):
                for axis, part in enumerate(vector):
                    row[axis] = rounded(part).values
        else:
            for axis, part in enumerate(value):
                self.data[name][axis] = rounded(part).values


def _copied(values: Any) -> Lanes:
    return Lanes(values.copy())


def _vector(values: Any) -> Vector:
    return Vector(*(_copied(part) for part in values))


def _matrix(values: Any) -> Matrix:
    return Matrix(*(_vector(row) for row in values))


def _field_kind(dtype: np.dtype[Any]) -> str | None:
    """Kind of value in a field of a structured array; None for an integer."""
    if dtype.base.kind == "i":
        return None
    if len(dtype.shape) == 1:
        return "lanes"
    if len(dtype.shape) == 3:
        return "matrix"
    return "vector" if dtype.shape[0] == 3 else "array"


# --- types ------------------------------------------------------------------------------------------------------


class RecordType(types.Type):
    """A record of lanes; a value is a pointer into the array."""

    def __init__(self, n: int, fields: dict[str, tuple[Any, int]], size: int) -> None:
        self.n, self.fields, self.size = n, fields, size
        text = ",".join(f"{name}:{kind}@{offset}" for name, (kind, offset) in fields.items())
        super().__init__(f"LanesRecord({text};{size})")


class FieldArrayType(types.Type):
    """A field of m lanes; a value is a pointer to the first."""

    def __init__(self, n: int, m: int) -> None:
        self.n, self.m = n, m
        super().__init__(f"LanesField({m}x{n})")


class _PointerModel(CompositeModel):
    """Values are pointers to bytes in memory."""

    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of)
        size = of.size if isinstance(of, RecordType) else 8 * of.n * of.m
        self._data = ir.ArrayType(ir.IntType(8), size)

    def get_value_type(self) -> Any:
        return self._data.as_pointer()

    def get_argument_type(self) -> Any:
        return self._data.as_pointer()

    def get_data_type(self) -> Any:
        return self._data

    def as_argument(self, builder: Any, value: Any) -> Any:
        return value

    def from_argument(self, builder: Any, value: Any) -> Any:
        return value

    def as_return(self, builder: Any, value: Any) -> Any:
        return value

    def from_return(self, builder: Any, value: Any) -> Any:
        return value

    def load_from_data_pointer(self, builder: Any, ptr: Any, align: Any = None) -> Any:
        return ptr


register_model(RecordType)(_PointerModel)
register_model(FieldArrayType)(_PointerModel)


def _field_type(kind: Any) -> tuple[Any, int]:
    """Type of a field of a structured array for compiled code, and its number of lanes (0 for an integer)."""
    if not isinstance(kind, types.NestedArray):
        return kind, 0
    *parts, n = kind.shape
    if not parts:
        return LanesType(n), n
    if len(parts) == 2:
        return MatrixType(n), n
    return (lanes_vector(n) if parts[0] == 3 else FieldArrayType(n, parts[0])), n


def record_type(record: Any) -> RecordType:
    """Type of the records of lanes that records of numpy's are."""
    found = {name: (*_field_type(field.type), field.offset) for name, field in record.fields.items()}
    n = max(lanes for _, lanes, _ in found.values())
    return RecordType(n, {name: (kind, offset) for name, (kind, _, offset) in found.items()}, record.size)


@infer_getattr
class _RecordAttributes(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, record: RecordType, attr: str) -> Any:
        """Type of a field."""
        return record.fields[attr][0] if attr in record.fields else None


def _address(context: Any, builder: Any, record: Any, pointer: Any, name: str) -> tuple[Any, Any]:
    """Type of a field and a pointer to it."""
    kind, offset = record.fields[name]
    start = builder.gep(builder.bitcast(pointer, ir.IntType(8).as_pointer()), [INT64(offset)], inbounds=True)
    return kind, builder.bitcast(start, context.get_data_type(kind).as_pointer())


@lower_getattr_generic(RecordType)
def _get_field(context: Any, builder: Any, record: Any, pointer: Any, name: str) -> Any:
    kind, address = _address(context, builder, record, pointer, name)
    return context.unpack_value(builder, kind, address, align=8)


@lower_setattr_generic(RecordType)
def _set_field(context: Any, builder: Any, sig: Any, args: Any, name: str) -> None:
    (record, given), (pointer, value) = sig.args, args
    kind, address = _address(context, builder, record, pointer, name)
    context.pack_value(builder, kind, context.cast(builder, value, given, kind), address, align=8)


@infer_global(operator.getitem)
class _FieldItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Type of one of the lanes of a field."""
        if isinstance(args[0], FieldArrayType) and isinstance(args[1], types.Integer):
            return signature(LanesType(args[0].n), args[0], types.intp)
        return None


@lower_builtin(operator.getitem, FieldArrayType, types.Integer)
def _get_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_pointer(context, builder, sig.args[0], *args), align=8)


@infer_global(operator.setitem)
class _FieldSetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Setting one of the lanes of a field."""
        if isinstance(args[0], FieldArrayType) and isinstance(args[1], types.Integer):
            return signature(types.none, args[0], types.intp, LanesType(args[0].n))
        return None


@lower_builtin(operator.setitem, FieldArrayType, types.Integer, LanesType)
def _set_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _pointer(context, builder, sig.args[0], *args[:2]), align=8)
    return context.get_dummy_value()


# --- views ------------------------------------------------------------------------------------------------------


def _view(context: Any, builder: Any, given: Any, value: Any, wanted: Any, size: int) -> Any:
    """Array of another type of elements over the memory of an array; its axes are the first ones of that."""
    array = arrayobj.make_array(given)(context, builder, value)
    made = arrayobj.make_array(wanted)(context, builder)
    axes = range(wanted.ndim)
    shape = cgutils.unpack_tuple(builder, array.shape, given.ndim)
    strides = cgutils.unpack_tuple(builder, array.strides, given.ndim)
    arrayobj.populate_array(
        made,
        data=builder.bitcast(array.data, context.get_data_type(wanted.dtype).as_pointer()),
        shape=[shape[axis] for axis in axes],
        strides=[strides[axis] for axis in axes],
        itemsize=context.get_constant(types.intp, size),
        meminfo=array.meminfo,
        parent=array.parent,
    )
    return impl_ret_borrowed(context, builder, wanted, made._getvalue())


@intrinsic
def _as_records(typingctx: Any, array: Any) -> Any:
    wanted = types.Array(record_type(array.dtype), array.ndim, "C", aligned=False)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _view(context, builder, array, args[0], wanted, array.dtype.size)

    return wanted(array), codegen


@intrinsic
def _as_lanes(typingctx: Any, array: Any, like: Any) -> Any:
    n = _lanes_of(like)
    wanted = types.Array(LanesType(n), array.ndim - 1, "C", aligned=False)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _view(context, builder, array, args[0], wanted, 8 * n)

    return wanted(array, like), codegen


@intrinsic
def _as_quads(typingctx: Any, array: Any) -> Any:
    wanted = types.Array(LanesType(QUAD), array.ndim - 1, "C", aligned=False)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _view(context, builder, array, args[0], wanted, 8 * QUAD)

    return wanted(array), codegen


def _lanes_of(like: Any) -> int:
    """Number of lanes of an array of lanes or records, of a record, or of lanes."""
    return int(like.dtype.n if isinstance(like, types.Array) else like.n)


# --- quads of blades --------------------------------------------------------------------------------------------


def _pointer(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    """Pointer to an element of an array of one axis, or of a field of lanes."""
    if isinstance(kind, FieldArrayType):
        first = builder.bitcast(array, context.get_data_type(LanesType(kind.n)).as_pointer())
    else:
        first = arrayobj.make_array(kind)(context, builder, array).data
    return builder.gep(first, [index])


@intrinsic
def _spread(typingctx: Any, values: Any, indices: Any, quad: Any, like: Any) -> Any:
    narrow, wide = _lanes_of(values), _lanes_of(like)
    quads = 1 if narrow == wide else wide // QUAD

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = arrayobj.make_array(indices)(context, builder, args[1]).data
        first = context.cast(builder, args[2], sig.args[2], types.int64)
        found = []
        for i in range(quads):
            index = builder.load(builder.gep(data, [builder.add(first, INT64(i))]))
            found.append(builder.load(_pointer(context, builder, values, args[0], index), align=8))
        if narrow == wide:
            return found[0]
        parts = [broadcast(builder, part, QUAD) for part in found]
        if quads == 1:
            return parts[0]
        return shuffle(builder, parts[0], parts[1], [0] * QUAD + [QUAD] * QUAD)

    return LanesType(wide)(values, indices, quad, like), codegen


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Four lanes of each of four rows as four rows of four."""
    a, b = (shuffle(builder, rows[0], rows[1], order) for order in ([0, 4, 2, 6], [1, 5, 3, 7]))
    c, d = (shuffle(builder, rows[2], rows[3], order) for order in ([0, 4, 2, 6], [1, 5, 3, 7]))
    low, high = [0, 1, 4, 5], [2, 3, 6, 7]
    return [shuffle(builder, *pair, order) for order in (low, high) for pair in ((a, c), (b, d))]


def _summed(builder: Any, columns: list[Any]) -> Any:
    """Sum in order."""
    total = columns[0]
    for column in columns[1:]:
        total = builder.fadd(total, column)
    return total


def _quad_sums(builder: Any, values: list[Any], quad: int) -> list[Any]:
    """Sum over the blades of one quad of each of some values, four sums to a vector."""
    order = list(range(QUAD * quad, QUAD * (quad + 1)))
    own = [shuffle(builder, value, value, order) if value.type.count > QUAD else value for value in values]
    while len(own) % QUAD:
        own.append(ir.Constant(own[0].type, None))
    return [_summed(builder, _transposed(builder, own[i : i + QUAD])) for i in range(0, len(own), QUAD)]


def _flat(context: Any, builder: Any, kinds: Sequence[Any], values: Sequence[Any], n: int) -> list[Any]:
    """Lanes of values and of the components of vectors."""
    found = []
    for kind, value in zip(kinds, values, strict=True):
        given = Typed(kind, value)
        parts = parts_of(builder, given) if isinstance(kind, VectorType) else [given]
        found += [as_type(context, builder, part, LanesType(n)) for part in parts]
    return found


@intrinsic(prefer_literal=True)
def _add_to_quads(typingctx: Any, sums: Any, quad: Any, begins: Any, first: Any, values: Any) -> Any:
    narrow = sums.dtype.n
    wide = max(kind.n for kind in values if not isinstance(kind, types.Number))
    start = sums.dtype.fields[first.literal_value][1]

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        array = arrayobj.make_array(sums)(context, builder, args[0])
        number = context.cast(builder, args[1], sig.args[1], types.int64)
        kinds = tuple(sig.args[4])
        parts = [builder.extract_value(args[4], i) for i in range(len(kinds))]
        flat = _flat(context, builder, kinds, parts, wide)
        for i in range(1 if narrow == wide else wide // QUAD):
            record = builder.gep(array.data, [builder.add(number, INT64(i))])
            base = builder.gep(builder.bitcast(record, ir.IntType(8).as_pointer()), [INT64(start)])
            if narrow != wide:  # all blades of the quad at once
                _store(builder, base, _quad_sums(builder, flat, i), len(flat) * narrow, False)
                continue
            with builder.if_else(context.is_true(builder, sig.args[2], args[2])) as (then, otherwise):
                with then:
                    _store(builder, base, flat, len(flat) * narrow, False)
                with otherwise:
                    _store(builder, base, flat, len(flat) * narrow, True)
        return context.get_dummy_value()

    return types.none(sums, quad, begins, first, values), codegen


def _store(builder: Any, base: Any, vectors: list[Any], count: int, add: bool) -> None:
    """Add vectors to zero, or to what is there, in consecutive numbers in memory, not beyond `count` of them."""
    done = 0
    for vector in vectors:
        size = vector.type.count if isinstance(vector.type, ir.VectorType) else 1
        if done + size > count:  # the last of the sums, filled up with zeros
            for lane in range(count - done):
                _store(builder, _ahead(builder, base, done + lane), [element(builder, vector, lane)], 1, add)
            return
        pointer = builder.bitcast(_ahead(builder, base, done), vector.type.as_pointer())
        before = builder.load(pointer, align=8) if add else ir.Constant(vector.type, None)
        builder.store(builder.fadd(before, vector), pointer, align=8)
        done += size


def _ahead(builder: Any, base: Any, count: int) -> Any:
    return builder.gep(base, [INT64(8 * count)])


# --- entire records ----------------------------------------------------------------------------------------------


def _numbers(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> list[Any]:
    """Pointers to the numbers of a record of lanes, as vectors that are as long as those they were written by."""
    data = arrayobj.make_array(kind)(context, builder, array).data
    base = builder.bitcast(builder.gep(data, [index]), ir.IntType(8).as_pointer())
    found, count = [], kind.dtype.size // 8
    for size in (2 * QUAD, QUAD, 2, 1) if kind.dtype.n > QUAD else (QUAD, 2, 1):
        while count >= size:
            pointer = builder.gep(base, [INT64(kind.dtype.size - 8 * count)])
            found.append(builder.bitcast(pointer, vector_of(DOUBLE, size).as_pointer()))
            count -= size
    return found


@intrinsic
def _copy_record(typingctx: Any, to: Any, index: Any, records: Any, number: Any) -> Any:
    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        for target, source in zip(*_two_records(context, builder, sig, args), strict=True):
            builder.store(builder.load(source, align=8), target, align=8)
        return context.get_dummy_value()

    return types.none(to, index, records, number), codegen


def _two_records(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Numbers of the records to and from."""
    indices = (context.cast(builder, args[i], sig.args[i], types.int64) for i in (1, 3))
    arrays = zip((sig.args[0], sig.args[2]), (args[0], args[2]), indices, strict=True)
    return [_numbers(context, builder, *array) for array in arrays]


@intrinsic
def _add_record(typingctx: Any, to: Any, index: Any, records: Any, number: Any) -> Any:
    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        for target, source in zip(*_two_records(context, builder, sig, args), strict=True):
            total = builder.fadd(builder.load(target, align=8), builder.load(source, align=8))
            builder.store(total, target, align=8)
        return context.get_dummy_value()

    return types.none(to, index, records, number), codegen


# --- rows of a table --------------------------------------------------------------------------------------------


@intrinsic(prefer_literal=True)
def _table_row(typingctx: Any, table: Any, row: Any, x: Any, degree: Any) -> Any:
    n = max(row.n, x.n)
    out = types.UniTuple(LanesType(n), QUAD)  # type: ignore[attr-defined]
    powers = degree.literal_value

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows, ahead = (as_type(context, builder, Typed(sig.args[i], args[i]), LanesType(n)) for i in (1, 2))
        integers = builder.fptosi(rows, ir.VectorType(INT64, n) if n > 1 else INT64)
        data = arrayobj.make_array(table)(context, builder, args[0]).data
        width = INT64(QUAD * (powers + 1))
        starts = [builder.gep(data, [builder.mul(element(builder, integers, lane), width)]) for lane in range(n)]
        # two rows in a register where there are enough
        groups = [(lane, lane + QUAD) for lane in range(QUAD)] if n > QUAD else [(lane,) for lane in range(n)]
        found = []
        for group in groups:
            own = _each_four(builder, ahead, group)
            value = _fours(builder, starts, group, powers)
            for power in range(powers - 1, -1, -1):
                value = intrinsic_call(builder, "fma", value, own, _fours(builder, starts, group, power))
            found.append(value)
        return context.make_tuple(builder, out, _columns(builder, found, n))

    return out(table, row, x, degree), codegen


def _each_four(builder: Any, values: Any, lanes: Sequence[int]) -> Any:
    """Lanes, each four times."""
    if not isinstance(values.type, ir.VectorType):
        return broadcast(builder, values, QUAD)
    return shuffle(builder, values, values, [lane for lane in lanes for _ in range(QUAD)])


def _fours(builder: Any, starts: Sequence[Any], lanes: Sequence[int], power: int) -> Any:
    """The four coefficients of a power of the rows of some lanes, side by side."""
    parts = []
    for lane in lanes:
        pointer = builder.gep(starts[lane], [INT64(QUAD * power)])
        parts.append(builder.load(builder.bitcast(pointer, ir.VectorType(DOUBLE, QUAD).as_pointer()), align=8))
    return parts[0] if len(parts) == 1 else shuffle(builder, parts[0], parts[1], list(range(2 * QUAD)))


def _columns(builder: Any, rows: list[Any], n: int) -> list[Any]:
    """Four columns of n rows of four, as vectors of n; of eight, rows k and k + 4 share a register."""
    if n == 1:
        return [builder.extract_element(rows[0], INT32(i)) for i in range(QUAD)]
    if n == 2:
        return [shuffle(builder, rows[0], rows[1], [i, QUAD + i]) for i in range(QUAD)]
    if n == QUAD:
        return _transposed(builder, rows)
    even, odd = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
    a, b = (shuffle(builder, rows[0], rows[1], order) for order in (even, odd))
    c, d = (shuffle(builder, rows[2], rows[3], order) for order in (even, odd))
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    return [shuffle(builder, *pair, order) for order in (low, high) for pair in ((a, c), (b, d))]


# --- what kernels call ------------------------------------------------------------------------------------------


def _plain_as_records(array: Any) -> Any:
    return RecordArray(array)


def _plain_as_lanes(array: Any, like: Any) -> Any:
    return LanesArray(array)


def _plain_as_quads(array: Any) -> Any:
    return LanesArray(array)


def _width(like: Any) -> int:
    """Number of lanes of an array of lanes or records, of a record, or of lanes."""
    if isinstance(like, Lanes):
        return like.n
    if isinstance(like, LanesArray):
        return int(like.data.shape[-1])
    dtype = like.data.dtype
    return max(int(dtype[name].shape[-1]) for name in dtype.names if dtype[name].shape)


def _plain_spread(values: Any, indices: Any, quad: int, like: Any) -> Lanes:
    narrow, wide = _width(values), _width(like)
    if narrow == wide:
        return Lanes(values[indices[quad]].values)
    return Lanes(np.concatenate([np.repeat(values[indices[quad + i]].values, QUAD) for i in range(wide // QUAD)]))


def _plain_add_to_quads(sums: Any, quad: int, begins: int, first: str, values: Any) -> None:
    flat = [part for value in values for part in (value if isinstance(value, Vector) else (value,))]
    lanes = [rounded(part).values for part in flat]
    wide, narrow = max(len(own) for own in lanes), _width(sums)
    lanes = [np.broadcast_to(own, wide) for own in lanes]
    for i in range(1 if narrow == wide else wide // QUAD):
        memory = sums.data[quad + i : quad + i + 1]
        start = memory.dtype.fields[first][1] // 8
        numbers = memory.view(np.float64)[start : start + len(lanes) * narrow].reshape(-1, narrow)
        for target, own in zip(numbers, lanes, strict=True):
            if narrow == wide:
                target[:] = (0.0 if begins else target) + own
            else:
                a, b, c, d = own[QUAD * i : QUAD * (i + 1)]
                target[:] = 0.0 + (a + b + c + d)


def _plain_copy_record(to: Any, index: int, records: Any, number: int) -> None:
    to.data[index : index + 1] = records.data[number : number + 1]


def _plain_add_record(to: Any, index: int, records: Any, number: int) -> None:
    to.data[index : index + 1].view(np.float64)[:] += records.data[number : number + 1].view(np.float64)


def _plain_table_row(table: Any, row: Any, x: Any, degree: int) -> tuple[Lanes, ...]:
    columns = []
    for index, own in zip(*np.broadcast_arrays(rounded(row).values, rounded(x).values), strict=True):
        powers = table[int(index)].reshape(degree + 1, QUAD)
        value = list(powers[-1])
        for lower in powers[-2::-1]:
            value = [fused(high, float(own), float(low)) for high, low in zip(value, lower, strict=True)]
        columns.append(value)
    return tuple(Lanes(column) for column in zip(*columns, strict=True))


if config.DISABLE_JIT:
    as_records, as_lanes, spread = _plain_as_records, _plain_as_lanes, _plain_spread
    as_quads = _plain_as_quads
    add_to_quads, table_row = _plain_add_to_quads, _plain_table_row
    copy_record, add_record = _plain_copy_record, _plain_add_record
else:
    as_records, as_lanes, spread = _as_records, _as_lanes, _spread
    as_quads = _as_quads
    add_to_quads, table_row = _add_to_quads, _table_row
    copy_record, add_record = _copy_record, _add_record
