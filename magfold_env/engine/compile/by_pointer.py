# Numba's own modules know no types.
# pyright: basic

"""NamedTuples that kernels see through one pointer.

Numba passes a tuple on field by field, and an array as seven numbers: with a model and its scratch
space, more than a thousand arguments at every call, which take seconds to compile, a kernel. So
what a class marked with `by_pointer` holds is written down once in words of eight bytes, and its
address is what kernels pass on. A word is a number, the address of an array's data or one of its
dimensions; tuples within are written in place. The words never change, only what is in the arrays
does.
"""

from __future__ import annotations

import struct
import zlib
from ctypes import addressof, c_char
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import populate_array

WORD = 8  # bytes
CODES = ("q", "qq", "qqq", "qqqq")  # of an array's words, by its dimensions
NUMBERS = (types.boolean, types.int64, types.float64)

T = TypeVar("T", bound=tuple[Any, ...])


class _Packed:
    """What a marked class gets besides its fields."""

    @cached_property
    def _words(self) -> bytearray:
        codes: list[str] = []
        values: list[Any] = []
        for value in cast("tuple[Any, ...]", self):
            if isinstance(value, np.ndarray):
                codes.append(CODES[value.ndim])
                values += (address_of(value), *value.shape)
            elif isinstance(value, _Packed):
                # Those of what chains share, such as their magnets, are written only once.
                codes.append(f"{len(value._words)}s")
                values.append(value._words)
            elif isinstance(value, float):
                codes.append("d")
                values.append(value)
            else:
                codes.append("q")
                values.append(int(value))
        return bytearray(struct.pack("".join(codes), *values))

    @cached_property
    def address(self) -> int:
        """Where the words begin; they stay there as long as this object exists."""
        return address_of(self._words)

    def __getstate__(self) -> None:
        """Leave the words out of copies, which have other arrays."""


def by_pointer(cls: type[T]) -> type[T]:
    """Mark a NamedTuple of numbers, C-contiguous arrays and others of its kind."""
    body = {name: getattr(cls, name) for name in ("__doc__", "__module__", "__qualname__")}
    return cast("type[T]", type(cls.__name__, (_Packed, cls), body))


def write_down(*packed: Any) -> None:
    """Find the addresses of marked NamedTuples now, so that their first use need not."""
    for each in packed:
        _ = each.address


def address_of(buffer: Any) -> int:
    """Return where the data of an array, or a bytearray, begin."""
    try:
        # A third of the time of the other, which counts where there are hundreds.
        return addressof(c_char.from_buffer(buffer))
    except (TypeError, ValueError):  # read-only, or empty
        return buffer.ctypes.data


def words_of(packed: Any) -> np.ndarray[Any, Any]:
    """Return the words of a marked NamedTuple, as integers."""
    return np.frombuffer(packed._words, dtype=np.int64)


def place_of(packed: Any, name: str) -> int:
    """Return which word a field of a marked NamedTuple is, or begins with."""
    return cast("PackedType", typeof_impl(packed, None)).places[name][0]


class PackedType(types.Type):
    """What the compiler knows of a marked class: names and types of the fields, and their places.

    Parameters
    ----------
    title
        Of the class.
    fields
        Names and types, in order.
    """

    def __init__(self, title: str, fields: tuple[tuple[str, types.Type], ...]) -> None:
        self.title, self.fields = title, fields
        self.places: dict[str, tuple[int, types.Type]] = {}
        self.size = 0
        for name, field in fields:
            self.places[name] = self.size, field
            self.size += _size(field)
        # Names of types are in the names of all kernels: this one is kept short.
        super().__init__(f"{title}_{zlib.crc32(repr(fields).encode()):08x}")


def _size(field: Any) -> int:
    """Words that a field takes."""
    if isinstance(field, PackedType):
        return field.size
    return 1 + field.ndim if isinstance(field, types.Array) else 1


@register_model(PackedType)
class _Model(models.OpaqueModel):
    pass


@typeof_impl.register(_Packed)
def _typeof(value: Any, context: Any) -> PackedType:
    fields = tuple(
        (name, _typeof_field(name, field, context))
        for name, field in zip(value._fields, value, strict=True)
    )
    return PackedType(type(value).__name__, fields)


def _typeof_field(name: str, value: Any, context: Any) -> types.Type:
    found: Any = typeof_impl(value, context)
    if isinstance(found, types.Array):
        if found.layout != "C":
            msg = f"{name}: kernels take C-contiguous arrays only"
            raise TypeError(msg)
        return types.Array(found.dtype, found.ndim, "C")
    if found not in NUMBERS and not isinstance(found, PackedType):
        msg = f"{name}: must be a bool, an int, a float, an array or by_pointer, not {found}"
        raise TypeError(msg)
    return found


@unbox(PackedType)
def _unbox(_typ: PackedType, value: ir.Value, c: Any) -> NativeValue:
    pointer = cgutils.alloca_once_value(c.builder, c.context.get_constant_null(types.voidptr))
    address = c.pyapi.object_getattr_string(value, "address")
    with cgutils.if_likely(c.builder, cgutils.is_not_null(c.builder, address)):
        c.builder.store(c.pyapi.long_as_voidptr(address), pointer)
        c.pyapi.decref(address)
    return NativeValue(c.builder.load(pointer), is_error=c.pyapi.c_api_error())


@infer_getattr
class _Attributes(AttributeTemplate):
    key = PackedType

    def generic_resolve(self, value: PackedType, attr: str) -> types.Type | None:
        return dict(value.fields).get(attr)


@lower_getattr_generic(PackedType)
def _getattr(context: Any, builder: ir.IRBuilder, typ: PackedType, value: Any, attr: str) -> Any:
    begin, field = typ.places[attr]
    if isinstance(field, PackedType):
        return builder.gep(value, [ir.IntType(64)(WORD * begin)])
    if not isinstance(field, types.Array):
        word = context.get_value_type(field) if field != types.boolean else ir.IntType(64)
        loaded = _load(builder, value, begin, word)
        return builder.trunc(loaded, ir.IntType(1)) if field == types.boolean else loaded
    made = context.make_array(field)(context, builder)
    item = context.get_abi_sizeof(context.get_data_type(field.dtype))
    shape = [_load(builder, value, begin + 1 + k, ir.IntType(64)) for k in range(field.ndim)]
    strides: list[Any] = [ir.IntType(64)(item)]
    for extent in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], extent))
    populate_array(
        made,
        data=_load(builder, value, begin, context.get_data_type(field.dtype).as_pointer()),
        shape=shape,
        strides=strides,
        itemsize=item,
        meminfo=None,
    )
    return made._getvalue()


def _load(builder: ir.IRBuilder, pointer: Any, place: int, word: ir.Type) -> Any:
    """Load a word, and tell the compiler that it never changes."""
    at = builder.gep(pointer, [ir.IntType(64)(WORD * place)])
    loaded = builder.load(builder.bitcast(at, word.as_pointer()))
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded
