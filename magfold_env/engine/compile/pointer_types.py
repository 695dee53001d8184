# Numba's own modules have no type annotations.
# pyright: basic

"""NamedTuples that kernels access through one pointer, and kernels that others call by address.

Numba passes a tuple field by field, and an array as seven numbers: a model and its scratch space
are more than a thousand arguments in each call, which take seconds per kernel to compile. The
contents of a class marked with `by_pointer` are therefore written once to words of eight bytes, and
kernels pass their address. A word is a number, the address of an array's data, or one of the
array's dimensions; inner tuples are written in place. The words never change; the arrays do.

A kernel contains the code of those that it calls. Most of the engine's compile time is the
integrator's, so the kernel that runs many chains calls it by address: the integrator is compiled
once, and one chain and many run the same machine code. A call by name from Python, however, first
determines the types of everything in its arguments, which takes 40 µs for a chain. Addresses are
plain integers, and a `Pointer` knows its type.
"""

from __future__ import annotations

import functools
import operator
import struct
import zlib
from ctypes import addressof, c_char
from functools import cached_property
from typing import Any, cast

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import load_item, store_item

WORD = 8  # bytes
NUMBERS = (types.boolean, types.int64, types.float64)
ITEM = (operator.getitem, operator.setitem)
ADDRESS = ir.IntType(8).as_pointer()

# Type checkers should see the kernels' types, not the types of the code generators.
_intrinsic = cast("Any", intrinsic)


class Packed:
    """Members that a marked class gets in addition to its fields."""

    @cached_property
    def words(self) -> bytearray:
        """Numbers, addresses and dimensions, one after the other."""
        codes: list[str] = []
        values: list[Any] = []
        for value in cast("tuple[Any, ...]", self):
            if isinstance(value, np.ndarray):
                codes.append("q" * (1 + value.ndim))
                values.append(address_of(value))
                values += value.shape
            elif isinstance(value, float):
                codes.append("d")
                values.append(value)
            elif isinstance(value, Packed):
                # The words of shared tuples, such as the magnets, are written only once.
                codes.append(f"{len(value.words)}s")
                values.append(value.words)
            else:
                codes.append("q")
                values.append(int(value))
        return bytearray(struct.pack("".join(codes), *values))

    @cached_property
    def address(self) -> int:
        """Address of the words, which is fixed as long as this object exists."""
        return address_of(self.words)

    @cached_property
    def pointer(self) -> Pointer:
        """The tuple in the form for fast calls from Python."""
        return Pointer(self)

    def __getstate__(self) -> None:
        """Omit the words from copies, because copies have other arrays."""


class Pointer:
    """A marked NamedTuple with its type, so that numba need not inspect its fields at each call."""

    def __init__(self, packed: Packed) -> None:
        self.packed = packed  # keeps the words alive
        self.address = packed.address
        self._numba_type_ = typeof_impl(packed, None)


def address_of(buffer: Any) -> int:
    """Return the address of the data of an array or a bytearray."""
    try:
        # This takes a third of the fallback's time, which matters for hundreds of arrays.
        return addressof(c_char.from_buffer(buffer))
    except (TypeError, ValueError):  # read-only, or empty
        return buffer.ctypes.data


def words_of(packed: Any) -> np.ndarray[Any, Any]:
    """Return the words of a marked NamedTuple as integers."""
    return np.frombuffer(packed.words, dtype=np.int64)


def place_of(packed: Any, name: str) -> int:
    """Return the index of the word with which a field of a marked NamedTuple begins."""
    return cast("PackedType", typeof_impl(packed, None)).places[name][0]


class PackedType(types.Type):
    """A marked class's type for the compiler: the fields' names, types and places.

    Parameters
    ----------
    title
        Name of the class.
    fields
        Names and types of the fields, in order.
    """

    def __init__(self, title: str, fields: tuple[tuple[str, types.Type], ...]) -> None:
        self.title, self.fields = title, fields
        self.places: dict[str, tuple[int, types.Type]] = {}
        self.size = 0
        for name, field in fields:
            self.places[name] = self.size, field
            self.size += _size(field)
        # Kernels' names contain their types' names, so this one is short.
        super().__init__(f"{title}_{zlib.crc32(repr(fields).encode()):08x}")


def _size(field: Any) -> int:
    """Return the number of words in a field."""
    if isinstance(field, PackedType):
        return field.size
    return 1 + field.ndim if isinstance(field, types.Array) else 1


@register_model(PackedType)
class _Model(models.OpaqueModel):
    pass


@typeof_impl.register(Packed)
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
    # Inserted values are half as much code for the compiler as numba's arrays in memory.
    fields = context.data_model_manager[field]
    shape = [_load(builder, value, begin + 1 + k, ir.IntType(64)) for k in range(field.ndim)]
    sizes: list[Any] = [ir.IntType(64)(context.get_abi_sizeof(context.get_data_type(field.dtype)))]
    for extent in reversed(shape):
        sizes.insert(0, builder.mul(sizes[0], extent))
    data = _load(builder, value, begin, context.get_data_type(field.dtype).as_pointer())
    items = functools.reduce(builder.mul, shape)
    made = context.get_constant_null(field)
    for name, part in (("data", data), ("nitems", items), ("itemsize", sizes[-1])):
        made = builder.insert_value(made, part, fields.get_field_position(name))
    for name, parts in (("shape", shape), ("strides", sizes[1:])):
        for k, part in enumerate(parts):
            made = builder.insert_value(made, part, [fields.get_field_position(name), k])
    return made


def _load(builder: ir.IRBuilder, pointer: Any, place: int, word: ir.Type) -> Any:
    """Load a word, and tell the compiler that it never changes."""
    at = builder.gep(pointer, [ir.IntType(64)(WORD * place)])
    loaded = builder.load(builder.bitcast(at, word.as_pointer()))
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded


def item_code(function: Any, signature: Any, context: Any) -> Any:
    """Return a generator of short code that reads or writes a number in an array.

    Indices do not count from the end. Returns None if the signature is not that of one number in a
    contiguous array, or if numba is to check bounds.
    """
    known = isinstance(function, types.Function) and function.typing_key in ITEM
    if not known or context.enable_boundscheck:
        return None
    kind, index, *written = signature.args
    indices = getattr(index, "types", (index,))
    if not isinstance(kind, types.Array) or kind.layout != "C" or len(indices) != kind.ndim:
        return None
    if {*indices} != {types.int64} or kind.dtype not in NUMBERS[1:] or {*written} - {kind.dtype}:
        return None

    def generate(builder: ir.IRBuilder, arguments: Any) -> Any:
        array, index, *value = arguments
        fields = context.data_model_manager[kind]
        shape = builder.extract_value(array, fields.get_field_position("shape"))
        place = ir.IntType(64)(0)
        below = ir.IntType(64)(1)  # items for each step of an index
        for k in reversed(range(kind.ndim)):
            at = builder.extract_value(index, k) if len(indices) > 1 else index
            place = builder.add(builder.mul(at, below), place)
            below = builder.mul(below, builder.extract_value(shape, k))
        data = builder.extract_value(array, fields.get_field_position("data"))
        pointer = builder.gep(data, [place])
        if value:
            return store_item(context, builder, kind, value[0], pointer)
        return load_item(context, builder, kind, pointer)

    return generate


def code_of(kernel: Any, *arguments: Any) -> int:
    """Return the address of a kernel's code for arguments of these types; compile it if necessary.

    The address stays valid as long as the process lives.
    """
    signature = tuple(numba.typeof(each) for each in arguments)
    kernel.compile(signature)
    compiled = kernel.overloads[signature]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def _call(result: types.Type, count: int) -> Any:
    """Return signature and code generator of a call with ``count`` pointers and a number."""
    kinds = (*[types.voidptr] * count, types.float64)

    def generate(context: Any, builder: ir.IRBuilder, _signature: Any, args: Any) -> Any:
        convention = context.call_conv
        function = convention.get_function_type(result, kinds)
        code = builder.inttoptr(args[0], function.as_pointer())
        passed = [*[builder.inttoptr(each, ADDRESS) for each in args[1:-1]], args[-1]]
        return convention.call_function(builder, code, result, kinds, passed)[1]

    return result(*[types.int64] * (1 + count), types.float64), generate


@_intrinsic
def call_int(
    _typing: Any, code: Any, model: Any, state: Any, work: Any, record: Any, x: Any
) -> Any:
    """Call code ``(Model, State, Work, Record, float) -> int``; code and tuples are addresses."""
    return _call(types.int64, 4)


@_intrinsic
def call_float(_typing: Any, code: Any, model: Any, state: Any, work: Any, x: Any) -> Any:
    """Call code ``(Model, State, Work, float) -> float``; code and tuples are addresses."""
    return _call(types.float64, 3)


@_intrinsic
def take(_typing: Any, counter: Any) -> Any:
    """Atomically add one to a counter, an array of one integer; return the old value."""

    def generate(context: Any, builder: ir.IRBuilder, _signature: Any, args: Any) -> Any:
        array = context.make_array(counter)(context, builder, args[0])
        return builder.atomic_rmw("add", array.data, ir.IntType(64)(1), "monotonic")

    return types.int64(counter), generate
