"""What numba compiles for the arrays of `small_arrays.py`: values, which take no memory.

Importing this module teaches numba their type, and how they are made, read and written. Arithmetic
is in `small_array_operations.py`. Entries are in the order of NumPy, row by row.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import (
    AbstractTemplate,
    infer_global,
    signature,
)
from numba.extending import (
    box,
    infer,
    lower_builtin,
    models,
    register_model,
)
from numba.np.arrayobj import populate_array

from geoimp_drake.compilation.small_arrays import (
    identity_like,
    joined,
    local,
    matrix,
    sized,
    sized_like,
    stored,
    vector,
)

__all__ = [
    "SmallArray",
    "entries_of",
    "entry_pointer",
    "is_number",
    "of_shape",
    "typed",
    "value_of",
]


class SmallArray(types.Type):
    """The type of an array of `float` with one or two dimensions and a known shape."""

    def __init__(self, shape: tuple[int, ...]):
        self.shape = shape
        self.size = math.prod(shape)
        super().__init__(name=f"SmallArray{shape}")

    def places(self) -> Any:
        """Returns an array of the same shape that holds the place of each entry."""
        return np.arange(self.size).reshape(self.shape)


@register_model(SmallArray)
class _Model(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: SmallArray):
        super().__init__(dmm, fe_type, ir.ArrayType(ir.DoubleType(), fe_type.size))


def entries_of(builder: Any, value: Any, kind: SmallArray) -> list[Any]:
    """Returns the entries of a value, in machine code."""
    return [builder.extract_value(value, k) for k in range(kind.size)]


def value_of(builder: Any, entries: Sequence[Any]) -> Any:
    """Returns the value with these entries, in machine code."""
    value = ir.Constant(ir.ArrayType(ir.DoubleType(), len(entries)), ir.Undefined)
    for k, entry in enumerate(entries):
        value = builder.insert_value(value, entry, k)
    return value


def of_shape(shape: tuple[int, ...]) -> types.Type:
    """Returns the type of an array of a shape; without dimensions it is a number."""
    return SmallArray(shape) if shape else types.float64


def is_number(kind: types.Type) -> bool:
    """Whether a type is that of a number."""
    return isinstance(kind, types.Float | types.Integer)


def typed(function: Any, result: Callable[..., Any], literal: bool = False) -> None:
    """Teaches numba the type of a function's result: `result` of the types of its arguments.

    `result` returns None for types that are not its own.
    """

    class Template(AbstractTemplate):
        prefer_literal = literal

        def generic(self, args: tuple, kws: dict) -> Any:
            return result(*args)

    if isinstance(function, str):
        Template.key = function
        infer(Template)
    else:
        infer_global(function)(Template)


# ------------------------------------------------------------------------------ making and reading


def _vector_type(*entries: types.Type) -> Any:
    if not all(map(is_number, entries)):
        return None
    return signature(SmallArray((len(entries),)), *[types.float64] * len(entries))


def _matrix_type(*rows: types.Type) -> Any:
    row = types.UniTuple(types.float64, 3)
    return signature(SmallArray((3, 3)), row, row, row)


def _joined_type(a: types.Type, b: types.Type) -> Any:
    if not (isinstance(a, SmallArray) and isinstance(b, SmallArray)):
        return None
    return signature(SmallArray((a.size + b.size,)), a, b) if len(a.shape + b.shape) == 2 else None


def _sized_type(a: types.Type, *shape: types.Type) -> Any:
    if not all(isinstance(n, types.IntegerLiteral) for n in shape):
        return None
    sizes = tuple(n.literal_value for n in shape)
    known = isinstance(a, SmallArray) and a.shape == sizes
    if known or (isinstance(a, types.Array) and a.ndim == len(sizes) and a.dtype == types.float64):
        return signature(SmallArray(sizes), a, *shape)
    return None


def _sized_like_type(a: types.Type, pattern: types.Type) -> Any:
    known = isinstance(pattern, SmallArray) and isinstance(a, types.Array)
    return signature(pattern if known else a, a, pattern)


def _stored_type(a: types.Type) -> Any:
    if isinstance(a, SmallArray):
        return signature(types.Array(types.float64, len(a.shape), "C"), a)
    return signature(a, a)


def _local_type(a: types.Type) -> Any:
    dimensions = len(a.shape) if isinstance(a, SmallArray) else a.ndim
    return signature(types.Array(types.float64, dimensions, "C"), a)


def _identity_type(A: types.Type) -> Any:
    known = isinstance(A, SmallArray)
    return signature(A if known else types.Array(types.float64, 2, "C"), A)


typed(vector, _vector_type)
typed(matrix, _matrix_type)
typed(joined, _joined_type)
typed(sized, _sized_type, literal=True)
typed(sized_like, _sized_like_type)
typed(stored, _stored_type)
typed(local, _local_type)
typed(identity_like, _identity_type)


@lower_builtin(vector, types.VarArg(types.Float))
def _make_vector(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return value_of(builder, args)


@lower_builtin(matrix, types.UniTuple, types.UniTuple, types.UniTuple)
def _make_matrix(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return value_of(builder, [builder.extract_value(row, k) for row in args for k in range(3)])


@lower_builtin(joined, SmallArray, SmallArray)
def _join(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    first, second = (entries_of(builder, *pair) for pair in zip(args, sig.args, strict=True))
    return value_of(builder, first + second)


@lower_builtin(sized, types.VarArg(types.Any))
@lower_builtin(sized_like, types.Any, types.Any)
def _read_array(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    if sig.args[0] == sig.return_type:
        return impl_ret_borrowed(context, builder, sig.return_type, args[0])
    places = np.ndindex(*sig.return_type.shape)
    pointers = [entry_pointer(context, builder, sig.args[0], args[0], place) for place in places]
    return value_of(builder, [builder.load(pointer) for pointer in pointers])


@lower_builtin(stored, types.Any)
def _store_array(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.args[0]
    if not isinstance(kind, SmallArray):
        return impl_ret_borrowed(context, builder, kind, args[0])
    shape = kind.shape

    def allocate() -> Any:
        return np.empty(shape)

    array = context.compile_internal(builder, allocate, signature(sig.return_type), ())
    for place, entry in zip(np.ndindex(*shape), entries_of(builder, args[0], kind), strict=True):
        builder.store(entry, entry_pointer(context, builder, sig.return_type, array, place))
    return array


@lower_builtin(local, types.Any)
def _local_array(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.args[0]
    if not isinstance(kind, SmallArray):
        return context.compile_internal(builder, lambda a: a.copy(), sig, args)
    place = cgutils.alloca_once_value(builder, args[0])
    array = context.make_array(sig.return_type)(context, builder)
    data = builder.bitcast(place, ir.DoubleType().as_pointer())
    width = ir.DoubleType().get_abi_size(context.target_data)
    strides = [width * math.prod(kind.shape[k + 1 :]) for k in range(len(kind.shape))]
    shape, steps = (
        [context.get_constant(types.intp, n) for n in sizes] for sizes in (kind.shape, strides)
    )
    populate_array(array, data, shape, steps, width, meminfo=None)
    return array._getvalue()


@lower_builtin(identity_like, types.Any)
def _identity(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    if not isinstance(sig.return_type, SmallArray):

        def unit(A: Any) -> Any:
            return np.eye(len(A))

        return context.compile_internal(builder, unit, sig, args)
    n = sig.return_type.shape[0]
    return value_of(builder, [ir.DoubleType()(float(i == k)) for i in range(n) for k in range(n)])


def entry_pointer(context: Any, builder: Any, kind: Any, array: Any, place: Sequence[int]) -> Any:
    """Returns where an entry of an array in memory is, in machine code."""
    struct = context.make_array(kind)(context, builder, array)
    indices = [context.get_constant(types.intp, k) for k in place]
    return cgutils.get_item_pointer(context, builder, kind, struct, indices)


# ------------------------------------------------------------------------------- back to Python


def _as_array(shape: tuple[int, ...], *entries: float) -> Any:
    return np.array(entries).reshape(shape)


@box(SmallArray)
def _to_python(kind: SmallArray, value: Any, c: Any) -> Any:
    """A law that is called from Python returns an ordinary array."""
    make = c.pyapi.unserialize(c.pyapi.serialize_object(partial(_as_array, kind.shape)))
    entries = [c.pyapi.float_from_double(x) for x in entries_of(c.builder, value, kind)]
    array = c.pyapi.call_function_objargs(make, entries)
    for held in (make, *entries):
        c.pyapi.decref(held)
    return array
