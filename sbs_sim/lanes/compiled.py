"""Lanes for functions that numba compiles: types, and the code of every operation as LLVM instructions.

The meaning is that of `sbs_sim.lanes.interpreted`; test/physics/test_lanes.py compares both, operation by operation.

A value is built from `Typed` pairs of numba's type and LLVM's value, so that what is said of numbers once holds for the
components of vectors too. Parts of numba that are no public interface are used here and in `memory` alone: templates of
typing, data models, `arrayobj.populate_array`.
"""

import operator
from collections.abc import Callable
from typing import Any, NamedTuple

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin, lower_cast, lower_constant
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import make_attribute_wrapper, models, register_model, type_callable, typeof_impl

from sbs_sim.lanes import interpreted as plain

DOUBLE, BIT, INT32, INT64 = ir.DoubleType(), ir.IntType(1), ir.IntType(32), ir.IntType(64)

# --- types ------------------------------------------------------------------------------------------------------


class LanesType(types.Type):
    """n numbers."""

    def __init__(self, n: int) -> None:
        self.n = n
        super().__init__(f"Lanes{n}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """What becomes lanes by itself: numbers and a single lane, and in memory products too.

        A variable must not be a product here and lanes there: where it is rounded would be hidden (`rounded` says it).
        """
        if isinstance(other, ProductType) and other.n in (1, self.n):
            return Conversion.unsafe
        single = isinstance(other, LanesType) and other.n == 1
        return Conversion.safe if single or isinstance(other, types.Number) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Type of a variable that is now this, now that."""
        if isinstance(other, (types.Number, LanesType)):
            return LanesType(max(self.n, getattr(other, "n", 1)))
        return None


class ProductType(types.Type):
    """Two lanes that are not multiplied yet."""

    def __init__(self, n: int) -> None:
        self.n = n
        super().__init__(f"Product{n}")


class MaskType(types.Type):
    """n truth values."""

    def __init__(self, n: int) -> None:
        self.n = n
        super().__init__(f"Mask{n}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A truth value is that of all lanes."""
        return Conversion.safe if isinstance(other, types.Boolean) else None


class ZeroType(types.Type):
    """A number that is known to be zero."""

    n = 1

    def __init__(self) -> None:
        super().__init__("Zero")


ZERO = ZeroType()


class VectorType(types.Type):
    """Three components, each of which is lanes, a product or zero."""

    def __init__(self, elements: Any) -> None:
        self.elements = tuple(elements)
        self.n = max(element.n for element in self.elements)
        super().__init__(f"Vector({','.join(map(str, self.elements))})")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """In memory and as arguments vectors become vectors of lanes; a variable is of one kind, see `LanesType`."""
        if not isinstance(other, VectorType) or not self.is_lanes or other.n not in (1, self.n):
            return None
        return Conversion.safe if other.is_lanes else Conversion.unsafe

    @property
    def is_lanes(self) -> bool:
        """True if no component is a product, or zero."""
        return all(isinstance(element, LanesType) for element in self.elements)

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Vectors of lanes may have different numbers of them."""
        if isinstance(other, VectorType) and self.is_lanes and other.is_lanes:
            return lanes_vector(max(self.n, other.n))
        return None


def lanes_vector(n: int) -> VectorType:
    """Type of a vector of lanes."""
    return VectorType([LanesType(n)] * 3)


class MatrixType(types.Type):
    """Three vectors of lanes."""

    def __init__(self, n: int) -> None:
        self.n, self.row = n, lanes_vector(n)
        super().__init__(f"Matrix{n}")


class TransposedType(types.Type):
    """A matrix whose columns are taken for rows."""

    def __init__(self, n: int) -> None:
        self.n, self.row = n, lanes_vector(n)
        super().__init__(f"Transposed{n}")


def vector_of(element: Any, n: int) -> Any:
    """LLVM's type of n elements."""
    return ir.VectorType(element, n) if n > 1 else element


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: LanesType) -> None:
        super().__init__(manager, of, vector_of(DOUBLE, of.n))


@register_model(ProductType)
class _ProductModel(models.StructModel):
    def __init__(self, manager: Any, of: ProductType) -> None:
        super().__init__(manager, of, [("a", LanesType(of.n)), ("b", LanesType(of.n))])


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: MaskType) -> None:
        super().__init__(manager, of, vector_of(BIT, of.n))


@register_model(VectorType)
class _VectorModel(models.StructModel):
    def __init__(self, manager: Any, of: VectorType) -> None:
        super().__init__(manager, of, list(zip("xyz", of.elements, strict=True)))


@register_model(ZeroType)
class _ZeroModel(models.OpaqueModel):
    pass


@register_model(MatrixType)
@register_model(TransposedType)
class _MatrixModel(models.StructModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, [(axis, of.row) for axis in "xyz"])


for _axis in "xyz":
    make_attribute_wrapper(VectorType, _axis, _axis)
    make_attribute_wrapper(MatrixType, _axis, _axis)

# --- values -----------------------------------------------------------------------------------------------------


class Typed(NamedTuple):
    """A value while code is built."""

    type: Any
    value: Any


def broadcast(builder: Any, value: Any, n: int) -> Any:
    """One number in all of n lanes."""
    if n == 1:
        return value
    first = builder.insert_element(ir.Constant(vector_of(value.type, n), ir.Undefined), value, INT32(0))
    return shuffle(builder, first, first, [0] * n)


def shuffle(builder: Any, a: Any, b: Any, order: list[int]) -> Any:
    """Lanes of a, then of b, by their numbers."""
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(INT32, len(order)), order))


def element(builder: Any, value: Any, lane: int) -> Any:
    """One lane of a value of LLVM's."""
    return builder.extract_element(value, INT32(lane)) if isinstance(value.type, ir.VectorType) else value


def intrinsic_call(builder: Any, name: str, *arguments: Any) -> Any:
    """Call of one of LLVM's intrinsic functions of numbers."""
    kind = arguments[0].type
    suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
    function = ir.FunctionType(kind, [argument.type for argument in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, function, f"llvm.{name}.{suffix}"), arguments)


def as_type(context: Any, builder: Any, given: Typed, wanted: Any) -> Any:
    """LLVM's value of the wanted type."""
    return context.cast(builder, given.value, given.type, wanted)


@lower_cast(types.Number, LanesType)
def _number_to_lanes(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return broadcast(builder, context.cast(builder, value, given, types.float64), wanted.n)


@lower_cast(LanesType, LanesType)
def _lanes_to_lanes(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return value if given.n == wanted.n else broadcast(builder, value, wanted.n)


@lower_cast(ProductType, LanesType)
def _product_to_lanes(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    product = builder.fmul(builder.extract_value(value, 0), builder.extract_value(value, 1))
    return product if given.n == wanted.n else broadcast(builder, product, wanted.n)


@lower_cast(types.Boolean, MaskType)
def _truth_to_mask(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    bit = builder.trunc(value, BIT) if value.type.width > 1 else value
    return broadcast(builder, bit, wanted.n)


@lower_cast(MaskType, MaskType)
def _mask_to_mask(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return value if given.n == wanted.n else broadcast(builder, value, wanted.n)


@lower_cast(VectorType, VectorType)
def _vector_to_vector(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    parts = parts_of(builder, Typed(given, value))
    return structure(
        context,
        builder,
        wanted,
        [as_type(context, builder, *pair) for pair in zip(parts, wanted.elements, strict=True)],
    )


@lower_cast(ZeroType, LanesType)
def _zero_to_lanes(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return ir.Constant(context.get_value_type(wanted), None)


@typeof_impl.register(plain.Zero)
def _typeof_zero(value: Any, c: Any) -> ZeroType:
    return ZERO


@lower_constant(ZeroType)
def _zero_constant(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return context.get_dummy_value()


def structure(context: Any, builder: Any, kind: Any, parts: list[Any]) -> Any:
    """LLVM's structure of its parts."""
    made = ir.Constant(context.get_value_type(kind), ir.Undefined)
    for i, part in enumerate(parts):
        made = builder.insert_value(made, part, i)
    return made


# --- numbers ----------------------------------------------------------------------------------------------------

SCALARS = (LanesType, ProductType)


def width(arguments: Any) -> int:
    """Common number of lanes of lanes, products and numbers; 0 where they are something else, or all are numbers."""
    found = {argument.n for argument in arguments if isinstance(argument, SCALARS)}
    if not found or not all(isinstance(argument, (*SCALARS, types.Number)) for argument in arguments):
        return 0
    wide = found - {1}
    return 0 if len(wide) > 1 else max(wide, default=1)


def type_times(a: Any, b: Any) -> Any:
    """Type of a product; None where there is none."""
    if ZERO in (a, b):
        return ZERO if isinstance(b if a == ZERO else a, (*SCALARS, types.Number, ZeroType)) else None
    return ProductType(n) if (n := width((a, b))) else None


def type_plus(a: Any, b: Any) -> Any:
    """Type of a sum or difference; None where there is none."""
    if ZERO in (a, b):
        other = b if a == ZERO else a
        return other if isinstance(other, (*SCALARS, ZeroType)) else None
    return LanesType(n) if (n := width((a, b))) else None


def type_negative(a: Any) -> Any:
    """Type of a value with the other sign; None where there is none."""
    return a if isinstance(a, (*SCALARS, ZeroType)) else None


def times(context: Any, builder: Any, a: Typed, b: Typed) -> Typed:
    """Product of two values, not rounded."""
    kind = type_times(a.type, b.type)
    if kind == ZERO:
        return Typed(ZERO, context.get_dummy_value())
    parts = [as_type(context, builder, part, LanesType(kind.n)) for part in (a, b)]
    return Typed(kind, structure(context, builder, kind, parts))


def plus(context: Any, builder: Any, a: Typed, b: Typed, minus: bool = False) -> Typed:
    """Sum of two values, or their difference; a product in it is fused, of two the left one."""
    if b.type == ZERO:
        return a
    if a.type == ZERO:
        return negative(context, builder, b) if minus else b
    kind = type_plus(a.type, b.type)
    if isinstance(a.type, ProductType):
        addend = as_type(context, builder, b, kind)
        return Typed(kind, _fused(context, builder, a, builder.fneg(addend) if minus else addend, kind, False))
    first = as_type(context, builder, a, kind)
    if isinstance(b.type, ProductType):
        return Typed(kind, _fused(context, builder, b, first, kind, minus))
    second = as_type(context, builder, b, kind)
    return Typed(kind, builder.fsub(first, second) if minus else builder.fadd(first, second))


def minus(context: Any, builder: Any, a: Typed, b: Typed) -> Typed:
    """Difference of two values, see `plus`."""
    return plus(context, builder, a, b, minus=True)


def _fused(context: Any, builder: Any, product: Typed, addend: Any, kind: Any, is_negative: bool) -> Any:
    own = LanesType(product.type.n)
    factors = [as_type(context, builder, Typed(own, builder.extract_value(product.value, i)), kind) for i in (0, 1)]
    if is_negative:
        factors[0] = builder.fneg(factors[0])
    return intrinsic_call(builder, "fma", *factors, addend)


def negative(context: Any, builder: Any, a: Typed) -> Typed:
    """The value with the other sign; a product stays one."""
    if a.type == ZERO:
        return a
    if isinstance(a.type, ProductType):
        first = builder.fneg(builder.extract_value(a.value, 0))
        return Typed(a.type, builder.insert_value(a.value, first, 0))
    return Typed(a.type, builder.fneg(a.value))


def register(operations: Any, kinds: Any, result: Callable[..., Any], build: Callable[..., Typed]) -> None:
    """Teach numba operations.

    Parameters
    ----------
    operations : sequence of callable
    kinds : sequence of type
        Classes of types, one combination of which an argument has to be for the code to be found.
    result : callable
        Takes the types of the arguments, gives that of the result, or None where they do not fit.
    build : callable
        Takes context, builder and the arguments as `Typed`, gives the result as `Typed`.
    """
    for operation in operations:

        @infer_global(operation)
        class _Template(AbstractTemplate):
            key = operation

            def generic(self, args: Any, kws: Any) -> Any:
                found = result(*args)
                return None if found is None else signature(found, *map(types.unliteral, args))  # type: ignore[attr-defined]

        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            made = build(context, builder, *(Typed(kind, value) for kind, value in zip(sig.args, args, strict=True)))
            return as_type(context, builder, made, sig.return_type)

        for combination in kinds:
            lower_builtin(operation, *combination)(lower)


NUMBERS = (LanesType, ProductType, types.Number)
ONE = [(LanesType,), (ProductType,)]
TWO = [(a, b) for a in NUMBERS for b in NUMBERS if (a, b) != (types.Number, types.Number)]
WITH_ZERO = [(ZeroType, kind) for kind in (*NUMBERS, ZeroType)] + [(kind, ZeroType) for kind in NUMBERS]


def _lanes_result(*arguments: Any) -> Any:
    return LanesType(n) if (n := width(arguments)) else None


def _mask_result(a: Any, b: Any) -> Any:
    return MaskType(n) if (n := width((a, b))) else None


register((operator.mul, operator.imul), TWO + WITH_ZERO, type_times, times)
register((operator.add, operator.iadd), TWO + WITH_ZERO, type_plus, plus)
register((operator.sub, operator.isub), TWO + WITH_ZERO, type_plus, minus)
register((operator.neg,), [*ONE, (ZeroType,)], type_negative, negative)


def _of_lanes(build: Callable[..., Any]) -> Callable[..., Typed]:
    """Builder of a function of lanes, which products and numbers become first."""

    def made(context: Any, builder: Any, *arguments: Typed) -> Typed:
        kind = LanesType(width(tuple(argument.type for argument in arguments)))
        values = [as_type(context, builder, argument, kind) for argument in arguments]
        return Typed(kind, build(builder, *values))

    return made


def _compared(sign: str) -> Callable[..., Typed]:
    def made(context: Any, builder: Any, a: Typed, b: Typed) -> Typed:
        n = width((a.type, b.type))
        values = [as_type(context, builder, argument, LanesType(n)) for argument in (a, b)]
        return Typed(MaskType(n), builder.fcmp_ordered(sign, *values))

    return made


register((operator.truediv, operator.itruediv), TWO, _lanes_result, _of_lanes(lambda builder, a, b: builder.fdiv(a, b)))
for _function, _name in ((abs, "fabs"), (plain.sqrt, "sqrt"), (plain.floor, "floor")):
    register(
        (_function,),
        ONE,
        _lanes_result,
        _of_lanes(lambda builder, a, name=_name: intrinsic_call(builder, name, a)),
    )


def _inverse_root_guess(builder: Any, a: Any) -> Any:
    n = a.type.count if isinstance(a.type, ir.VectorType) else 1
    integers = vector_of(INT64, n)

    def constant(value: int) -> Any:
        return ir.Constant(integers, [value] * n if n > 1 else value)

    half = builder.lshr(builder.bitcast(a, integers), constant(1))
    return builder.bitcast(builder.sub(constant(plain.INVERSE_ROOT), half), vector_of(DOUBLE, n))


register((plain.inverse_root_guess,), ONE, _lanes_result, _of_lanes(_inverse_root_guess))
register((plain.zeros_like,), ONE, _lanes_result, _of_lanes(lambda builder, a: ir.Constant(a.type, None)))
register((plain.rounded,), ONE, _lanes_result, _of_lanes(lambda builder, a: a))
register(
    (plain.with_sign,), TWO, _lanes_result, _of_lanes(lambda builder, a, b: intrinsic_call(builder, "copysign", a, b))
)
register(
    (plain.minimum,),
    TWO,
    _lanes_result,
    _of_lanes(lambda builder, a, b: builder.select(builder.fcmp_ordered("<", b, a), b, a)),
)
register(
    (plain.maximum,),
    TWO,
    _lanes_result,
    _of_lanes(lambda builder, a, b: builder.select(builder.fcmp_ordered(">", b, a), b, a)),
)
for _operation, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    register((_operation,), TWO, _mask_result, _compared(_sign))

# --- truth values -----------------------------------------------------------------------------------------------


def _masks_result(a: Any, b: Any) -> Any:
    return a if isinstance(a, MaskType) and a == b else None


for _operation, _method in ((operator.and_, "and_"), (operator.or_, "or_")):
    register(
        (_operation,),
        [(MaskType, MaskType)],
        _masks_result,
        lambda context, builder, a, b, method=_method: Typed(a.type, getattr(builder, method)(a.value, b.value)),
    )
register(
    (operator.invert,),
    [(MaskType,)],
    lambda a: a if isinstance(a, MaskType) else None,
    lambda context, builder, a: Typed(a.type, builder.not_(a.value)),
)


def _select_result(mask: Any, a: Any, b: Any) -> Any:
    kinds = [kind for kind in (a, b) if not isinstance(kind, types.Number)]
    if not isinstance(mask, (MaskType, types.Boolean)):
        return None
    others = [LanesType(mask.n)] if isinstance(mask, MaskType) else []
    return LanesType(n) if (n := width((*kinds, *others))) and width((a, b, *others)) else None


def _select(context: Any, builder: Any, mask: Typed, a: Typed, b: Typed) -> Typed:
    n = _select_result(mask.type, a.type, b.type).n
    values = [as_type(context, builder, argument, LanesType(n)) for argument in (a, b)]
    return Typed(LanesType(n), builder.select(as_type(context, builder, mask, MaskType(n)), *values))


register(
    (plain.select,),
    [(mask, a, b) for mask in (MaskType, types.Boolean) for a in NUMBERS for b in NUMBERS],
    _select_result,
    _select,
)


def _reduced(what: str) -> Callable[..., Typed]:
    def made(context: Any, builder: Any, mask: Typed) -> Typed:
        n = mask.type.n
        if n == 1:
            return Typed(types.boolean, mask.value)
        bits = builder.bitcast(mask.value, ir.IntType(n))
        none, every = ir.Constant(bits.type, 0), ir.Constant(bits.type, 2**n - 1)
        answer = builder.icmp_unsigned("!=", bits, none) if what == "any" else builder.icmp_unsigned("==", bits, every)
        return Typed(types.boolean, answer)

    return made


for _test, _what in ((plain.any_lane, "any"), (plain.all_lanes, "all")):
    register(
        (_test,),
        [(MaskType,)],
        lambda mask: types.boolean if isinstance(mask, MaskType) else None,
        _reduced(_what),
    )


def _seldom(context: Any, builder: Any, condition: Typed) -> Typed:
    expect = builder.module.declare_intrinsic("llvm.expect", [BIT], ir.FunctionType(BIT, [BIT, BIT]))
    return Typed(types.boolean, builder.call(expect, [condition.value, ir.Constant(BIT, 0)]))


register(
    (plain.seldom,),
    [(types.Boolean,)],
    lambda flag: types.boolean if isinstance(flag, types.Boolean) else None,
    _seldom,
)

# --- vectors ----------------------------------------------------------------------------------------------------


def parts_of(builder: Any, vector: Typed) -> list[Typed]:
    """Components of a vector."""
    return [Typed(kind, builder.extract_value(vector.value, i)) for i, kind in enumerate(vector.type.elements)]


def vector(context: Any, builder: Any, parts: list[Typed]) -> Typed:
    """Vector of components."""
    kind = VectorType([part.type for part in parts])
    return Typed(kind, structure(context, builder, kind, [part.value for part in parts]))


@type_callable(plain.Vector)
def _type_of_vector(context: Any) -> Any:
    def typer(x: Any, y: Any, z: Any) -> Any:
        kinds = (x, y, z)
        if not all(isinstance(kind, (*SCALARS, ZeroType, types.Number)) for kind in kinds):
            return None
        return VectorType([ZERO if kind == ZERO else LanesType(getattr(kind, "n", 1)) for kind in kinds])

    return typer


@type_callable(plain.Matrix)
def _type_of_matrix(context: Any) -> Any:
    def typer(x: Any, y: Any, z: Any) -> Any:
        rows = (x, y, z)
        return MatrixType(max(row.n for row in rows)) if all(isinstance(row, VectorType) for row in rows) else None

    return typer


def _constructed(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.return_type
    inner = kind.elements if isinstance(kind, VectorType) else [kind.row] * 3
    parts = [
        as_type(context, builder, Typed(given, value), wanted)
        for given, value, wanted in zip(sig.args, args, inner, strict=True)
    ]
    return structure(context, builder, kind, parts)


COMPONENTS = (*NUMBERS, ZeroType)
for _x in COMPONENTS:
    for _y in COMPONENTS:
        for _z in COMPONENTS:
            lower_builtin(plain.Vector, _x, _y, _z)(_constructed)
lower_builtin(plain.Matrix, VectorType, VectorType, VectorType)(_constructed)


def _columns(*kinds: Any) -> list[Any]:
    """Types of the arguments component by component; a number goes with every component."""
    spread = [kind.elements if isinstance(kind, VectorType) else (kind,) * 3 for kind in kinds]
    return list(zip(*spread, strict=True))


def _type_componentwise(rule: Callable[..., Any]) -> Callable[..., Any]:
    """Rule for the types of vectors of that for their components; all arguments are vectors, or one is a number."""

    def found(*kinds: Any) -> Any:
        elements = [rule(*column) for column in _columns(*kinds)]
        return None if None in elements else VectorType(elements)

    return found


def _componentwise(build: Callable[..., Typed]) -> Callable[..., Typed]:
    """Builder for vectors of what is built for their components."""

    def made(context: Any, builder: Any, *arguments: Typed) -> Typed:
        spread = [
            parts_of(builder, argument) if isinstance(argument.type, VectorType) else [argument] * 3
            for argument in arguments
        ]
        return vector(context, builder, [build(context, builder, *column) for column in zip(*spread, strict=True)])

    return made


def _both_vectors(rule: Callable[..., Any]) -> Callable[..., Any]:
    return lambda a, b: rule(a, b) if isinstance(a, VectorType) and isinstance(b, VectorType) else None


def _type_scaled(a: Any, b: Any) -> Any:
    one = isinstance(a, VectorType) != isinstance(b, VectorType)
    return _type_componentwise(type_times)(a, b) if one else None


VECTORS = [(VectorType, VectorType)]
type_vector_sum = _both_vectors(_type_componentwise(type_plus))
vector_times, vector_plus = _componentwise(times), _componentwise(plus)
register((operator.add, operator.iadd), VECTORS, type_vector_sum, vector_plus)
register((operator.sub, operator.isub), VECTORS, type_vector_sum, _componentwise(minus))
register(
    (operator.neg,),
    [(VectorType,)],
    lambda a: a if isinstance(a, VectorType) else None,
    _componentwise(negative),
)
register(
    (operator.mul, operator.imul),
    [(VectorType, kind) for kind in COMPONENTS] + [(kind, VectorType) for kind in COMPONENTS],
    _type_scaled,
    vector_times,
)


def type_dot(a: Any, b: Any) -> Any:
    """Type of a scalar product; None where there is none."""
    first, *others = (type_times(*column) for column in _columns(a, b))
    for other in others:
        first = None if None in (first, other) else type_plus(first, other)
    return first


def dot(context: Any, builder: Any, a: Typed, b: Typed) -> Typed:
    """Scalar product."""
    columns = zip(parts_of(builder, a), parts_of(builder, b), strict=True)
    first, *others = (times(context, builder, *column) for column in columns)
    for other in others:
        first = plus(context, builder, first, other)
    return first


CROSS = ((1, 2), (2, 0), (0, 1))  # axes of the factors of each component, and the other way round


def type_cross(a: Any, b: Any) -> Any:
    """Type of a vector product; None where there is none."""
    p, q = a.elements, b.elements
    pairs = [(type_times(p[i], q[j]), type_times(p[j], q[i])) for i, j in CROSS]
    elements = [None if None in pair else type_plus(*pair) for pair in pairs]
    return None if None in elements else VectorType(elements)


def cross(context: Any, builder: Any, a: Typed, b: Typed) -> Typed:
    """Vector product."""
    p, q = parts_of(builder, a), parts_of(builder, b)
    return vector(
        context,
        builder,
        [
            minus(context, builder, times(context, builder, p[i], q[j]), times(context, builder, p[j], q[i]))
            for i, j in CROSS
        ],
    )


register((plain.dot,), VECTORS, _both_vectors(type_dot), dot)
register((plain.cross,), VECTORS, _both_vectors(type_cross), cross)


def _rows_of(builder: Any, matrix: Typed) -> list[Typed]:
    return [Typed(matrix.type.row, builder.extract_value(matrix.value, i)) for i in range(3)]


def _type_matrix_times(matrix: Any, by: Any) -> Any:
    if not isinstance(matrix, (MatrixType, TransposedType)) or not isinstance(by, VectorType):
        return None
    if isinstance(matrix, MatrixType):
        element = type_dot(matrix.row, by)
        return None if element is None else VectorType([element] * 3)
    first, *others = (_type_scaled(matrix.row, kind) for kind in by.elements)
    for other in others:
        first = None if None in (first, other) else type_vector_sum(first, other)
    return first


def _matrix_times(context: Any, builder: Any, matrix: Typed, by: Typed) -> Typed:
    rows = _rows_of(builder, matrix)
    if isinstance(matrix.type, MatrixType):
        return vector(context, builder, [dot(context, builder, row, by) for row in rows])
    columns = zip(rows, parts_of(builder, by), strict=True)
    first, *others = (vector_times(context, builder, *column) for column in columns)
    for other in others:
        first = vector_plus(context, builder, first, other)
    return first


register(
    (operator.matmul,), [(MatrixType, VectorType), (TransposedType, VectorType)], _type_matrix_times, _matrix_times
)
register(
    (plain.transposed,),
    [(MatrixType,)],
    lambda a: TransposedType(a.n) if isinstance(a, MatrixType) else None,
    lambda context, builder, a: Typed(TransposedType(a.type.n), a.value),
)
