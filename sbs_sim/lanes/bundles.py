"""Named tuples of arrays that compiled code takes by reference.

numba hands a tuple of arrays on as the addresses, sizes and strides of all of them, several hundred numbers of a model
and its memory, and twice at each call of a derivative. A `Bundle` is handed on as one address, that of a table with
address and shape of every array, out of which each function reads what it needs.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_getattr_generic
from numba.core.pythonapi import NativeValue
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import models, register_model, typeof_impl, unbox
from numba.np import arrayobj
from numpy.typing import NDArray

Kind = TypeVar("Kind")
WORD = ir.IntType(64)


class Bundle:
    """First base of what `bundled` makes."""

    @cached_property
    def _numba_type(self) -> "BundleType":
        """What numba takes it for."""
        values = zip(self._fields, self, strict=True)  # type: ignore[attr-defined, call-overload]
        return BundleType(type(self).__name__, tuple((name, _type_of(name, value)) for name, value in values))

    @property
    def _address(self) -> int:
        """Of the table of addresses and shapes, which lives as long as the bundle."""
        kept: tuple[NDArray[np.int64], int] | None = self.__dict__.get("_kept")
        if kept is None:
            table = np.array(list(_words(self)), dtype=np.int64)
            # of threads that come here together all take the first one's
            kept = self.__dict__.setdefault("_kept", (table, table.__array_interface__["data"][0]))
        return kept[1]

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy, also one in another process, has its own table."""
        return type(self), tuple(self)  # type: ignore[arg-type]


def bundled(kind: type[Kind]) -> type[Kind]:
    """Let a named tuple of arrays in C order, and of bundles, be one; its arrays have to stay where they are."""
    names = {name: getattr(kind, name) for name in ("__doc__", "__module__", "__qualname__")}
    return type(kind.__name__, (Bundle, kind), names)


def _words(value: Any) -> Iterator[int]:
    if isinstance(value, Bundle):
        for part in value:  # type: ignore[attr-defined]
            yield from _words(part)
    else:
        yield value.__array_interface__["data"][0]
        yield from value.shape


def _type_of(name: str, value: Any) -> types.Type:
    if isinstance(value, Bundle):
        return value._numba_type
    found = typeof_impl(value, None)
    if not isinstance(found, types.Array) or found.layout != "C":
        raise TypeError(f"{name} is {found}: allowed in a bundle are arrays in C order")
    return found


class BundleType(types.Type):
    """A bundle.

    Parameters
    ----------
    name : str
    fields : tuple of (str, numba type)
    """

    words: int

    def __init__(self, name: str, fields: tuple[tuple[str, Any], ...]) -> None:
        self.fields = dict(fields)
        sizes = [kind.words if isinstance(kind, BundleType) else 1 + kind.ndim for kind in self.fields.values()]
        *starts, self.words = np.cumsum([0, *sizes]).tolist()
        self.offsets = dict(zip(self.fields, starts, strict=True))
        super().__init__(f"{name}({', '.join(f'{field}: {kind}' for field, kind in fields)})")


@typeof_impl.register(Bundle)
def _type_of_bundle(bundle: Bundle, _: Any) -> BundleType:
    return bundle._numba_type


@register_model(BundleType)
class _BundleModel(models.OpaqueModel):
    pass


@unbox(BundleType)
def _unbox_bundle(_: BundleType, bundle: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(bundle, "_address")
    address = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return NativeValue(address, is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred()))


@infer_getattr
class _BundleFields(AttributeTemplate):
    key = BundleType

    def generic_resolve(self, bundle: BundleType, name: str) -> Any:
        return bundle.fields.get(name)


@lower_getattr_generic(BundleType)
def _field(context: Any, builder: Any, bundle: BundleType, table: Any, name: str) -> Any:
    kind, first = bundle.fields[name], bundle.offsets[name]
    words = builder.bitcast(table, WORD.as_pointer())
    if isinstance(kind, BundleType):
        return builder.bitcast(builder.gep(words, [ir.Constant(WORD, first)]), cgutils.voidptr_t)

    def word(i: int) -> Any:
        read = builder.load(builder.gep(words, [ir.Constant(WORD, first + i)]))
        read.set_metadata("invariant.load", builder.module.add_metadata([]))  # it may be read again in place of kept
        return read

    shape = [word(1 + i) for i in range(kind.ndim)]
    item = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    strides = [ir.Constant(WORD, item)]
    for size in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], size))
    made = arrayobj.make_array(kind)(context, builder)
    arrayobj.populate_array(
        made,
        data=builder.inttoptr(word(0), context.get_data_type(kind.dtype).as_pointer()),
        shape=cgutils.pack_array(builder, shape) if shape else (),
        strides=cgutils.pack_array(builder, strides) if shape else (),
        itemsize=ir.Constant(WORD, item),
        meminfo=None,
    )
    return made._getvalue()
