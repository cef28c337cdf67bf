"""What numba compiles for the arrays of `small_arrays.py`: values, which take no memory.

Importing this module teaches numba their type, how they are made, read and written, and arithmetic
on them: written out entry by entry, and as loops for long products only. Entries are in the order
of NumPy, row by row.
"""

import itertools
import math
import operator
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_global,
    signature,
)
from numba.extending import (
    box,
    infer,
    infer_getattr,
    lower_builtin,
    lower_getattr,
    models,
    register_model,
)

from geoimp_drake.compilation.small_arrays import (
    identity_like,
    joined,
    matrix,
    sized,
    sized_like,
    stored,
    vector,
)

__all__ = ["SmallArray"]

# So many multiplications of a product are written out; one with more becomes a loop: a law runs
# once in a step, and until the next one long code has left the caches.
_WRITTEN_OUT = 64


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


class _Place(types.Type):
    """Stands in a signature for a constant place, since a slice cannot be looked up."""

    def __init__(self, place: Any):
        super().__init__(name=f"Place({place})")


def _entries(builder: Any, value: Any, kind: SmallArray) -> list[Any]:
    return [builder.extract_value(value, k) for k in range(kind.size)]


def _value(builder: Any, entries: Sequence[Any]) -> Any:
    value = ir.Constant(ir.ArrayType(ir.DoubleType(), len(entries)), ir.Undefined)
    for k, entry in enumerate(entries):
        value = builder.insert_value(value, entry, k)
    return value


def _of_shape(shape: tuple[int, ...]) -> types.Type:
    return SmallArray(shape) if shape else types.float64


def _is_number(kind: types.Type) -> bool:
    return isinstance(kind, types.Float | types.Integer)


def _typed(function: Any, result: Callable[..., Any], literal: bool = False) -> None:
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
    if not all(map(_is_number, entries)):
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


def _identity_type(A: types.Type) -> Any:
    known = isinstance(A, SmallArray)
    return signature(A if known else types.Array(types.float64, 2, "C"), A)


_typed(vector, _vector_type)
_typed(matrix, _matrix_type)
_typed(joined, _joined_type)
_typed(sized, _sized_type, literal=True)
_typed(sized_like, _sized_like_type)
_typed(stored, _stored_type)
_typed(identity_like, _identity_type)


@lower_builtin(vector, types.VarArg(types.Float))
def _make_vector(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _value(builder, args)


@lower_builtin(matrix, types.UniTuple, types.UniTuple, types.UniTuple)
def _make_matrix(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _value(builder, [builder.extract_value(row, k) for row in args for k in range(3)])


@lower_builtin(joined, SmallArray, SmallArray)
def _join(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    first, second = (_entries(builder, *pair) for pair in zip(args, sig.args, strict=True))
    return _value(builder, first + second)


@lower_builtin(sized, types.VarArg(types.Any))
@lower_builtin(sized_like, types.Any, types.Any)
def _read_array(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    if sig.args[0] == sig.return_type:
        return impl_ret_borrowed(context, builder, sig.return_type, args[0])
    places = np.ndindex(*sig.return_type.shape)
    pointers = [_pointer(context, builder, sig.args[0], args[0], place) for place in places]
    return _value(builder, [builder.load(pointer) for pointer in pointers])


@lower_builtin(stored, types.Any)
def _store_array(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.args[0]
    if not isinstance(kind, SmallArray):
        return impl_ret_borrowed(context, builder, kind, args[0])
    shape = kind.shape

    def allocate() -> Any:
        return np.empty(shape)

    array = context.compile_internal(builder, allocate, signature(sig.return_type), ())
    for place, entry in zip(np.ndindex(*shape), _entries(builder, args[0], kind), strict=True):
        builder.store(entry, _pointer(context, builder, sig.return_type, array, place))
    return array


@lower_builtin(identity_like, types.Any)
def _identity(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    if not isinstance(sig.return_type, SmallArray):

        def unit(A: Any) -> Any:
            return np.eye(len(A))

        return context.compile_internal(builder, unit, sig, args)
    n = sig.return_type.shape[0]
    return _value(builder, [ir.DoubleType()(float(i == k)) for i in range(n) for k in range(n)])


def _pointer(context: Any, builder: Any, kind: Any, array: Any, place: Sequence[int]) -> Any:
    struct = context.make_array(kind)(context, builder, array)
    indices = [context.get_constant(types.intp, k) for k in place]
    return cgutils.get_item_pointer(context, builder, kind, struct, indices)


# ------------------------------------------------------------------------------------- arithmetic


def _entry_by_entry(operation: Any, instruction: str) -> None:
    """Teaches numba a sum, difference or product of two arrays, entry by entry."""

    def result(a: types.Type, b: types.Type) -> Any:
        return signature(a, a, b) if isinstance(a, SmallArray) and a == b else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (_entries(builder, value, sig.return_type) for value in args)
        each = getattr(builder, instruction)
        return _value(builder, [each(x, y) for x, y in zip(a, b, strict=True)])

    _typed(operation, result)
    lower_builtin(operation, SmallArray, SmallArray)(lower)


def _with_number(operation: Any, instruction: str, *, number_first: bool) -> None:
    """Teaches numba a product with, or a quotient by, a number."""
    place = 1 if number_first else 0

    def result(a: types.Type, b: types.Type) -> Any:
        kinds = (a, b)
        array, number = kinds[place], kinds[1 - place]
        if not (isinstance(array, SmallArray) and _is_number(number)):
            return None
        return signature(
            array, *((types.float64, array) if number_first else (array, types.float64))
        )

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        entries = _entries(builder, args[place], sig.return_type)
        each = getattr(builder, instruction)
        return _value(builder, [each(x, args[1 - place]) for x in entries])

    kinds = (types.Float, SmallArray) if number_first else (SmallArray, types.Float)
    _typed(operation, result)
    lower_builtin(operation, *kinds)(lower)


_entry_by_entry(operator.add, "fadd")
_entry_by_entry(operator.sub, "fsub")
_entry_by_entry(operator.mul, "fmul")
_with_number(operator.mul, "fmul", number_first=True)
_with_number(operator.mul, "fmul", number_first=False)
_with_number(operator.truediv, "fdiv", number_first=False)


def _negative_type(a: types.Type) -> Any:
    return signature(a, a) if isinstance(a, SmallArray) else None


def _product_type(a: types.Type, b: types.Type) -> Any:
    if not (isinstance(a, SmallArray) and isinstance(b, SmallArray)):
        return None
    if a.shape[-1] != b.shape[0]:
        return None
    return signature(_of_shape(a.shape[:-1] + b.shape[1:]), a, b)


_typed(operator.neg, _negative_type)
_typed(operator.matmul, _product_type)


@lower_builtin(operator.neg, SmallArray)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _value(builder, [builder.fneg(x) for x in _entries(builder, args[0], sig.args[0])])


@lower_builtin(operator.matmul, SmallArray, SmallArray)
def _product(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    inner = sig.args[1].shape[0]
    columns = sig.args[1].size // inner
    if sig.args[0].size * columns > _WRITTEN_OUT and isinstance(sig.return_type, SmallArray):
        return _long_product(builder, sig, args, inner, columns)
    a, b = (_entries(builder, *pair) for pair in zip(args, sig.args, strict=True))
    found = [
        _dot(builder, a[i : i + inner], b[k::columns])
        for i in range(0, len(a), inner)
        for k in range(columns)
    ]
    return _value(builder, found) if isinstance(sig.return_type, SmallArray) else found[0]


def _long_product(builder: Any, sig: Any, args: Any, inner: int, columns: int) -> Any:
    """Returns a product by a loop over its entries; each is summed as it is when written out."""
    a, b = (cgutils.alloca_once_value(builder, value) for value in args)
    result = ir.ArrayType(ir.DoubleType(), sig.return_type.size)
    found = cgutils.alloca_once(builder, result)
    place = ir.IntType(64)

    def entry(array: Any, row: Any, width: int, column: Any) -> Any:
        index = builder.add(builder.mul(row, place(width)), column)
        return builder.gep(array, [place(0), index], inbounds=True)

    with (
        cgutils.for_range(builder, place(sig.return_type.size // columns)) as rows,
        cgutils.for_range(builder, place(columns)) as across,
    ):
        i, k = rows.index, across.index
        left = [builder.load(entry(a, i, inner, place(j))) for j in range(inner)]
        right = [builder.load(entry(b, place(j), columns, k)) for j in range(inner)]
        builder.store(_dot(builder, left, right), entry(found, i, columns, k))
    return builder.load(found)


def _dot(builder: Any, a: Sequence[Any], b: Sequence[Any]) -> Any:
    total = builder.fmul(a[0], b[0])
    for x, y in zip(a[1:], b[1:], strict=True):
        total = builder.fadd(total, builder.fmul(x, y))
    return total


# ----------------------------------------------------------- entries and slices at constant places


@infer_getattr
class _Attributes(AttributeTemplate):
    key = SmallArray

    def resolve_T(self, a: SmallArray) -> SmallArray:
        return SmallArray(a.shape[::-1])


@lower_getattr(SmallArray, "T")
def _transpose(context: Any, builder: Any, kind: SmallArray, value: Any) -> Any:
    entries = _entries(builder, value, kind)
    return _value(builder, [entries[k] for k in kind.places().T.ravel()])


def _item_type(a: types.Type, place: Any) -> Any:
    if not isinstance(a, SmallArray):
        return None
    return signature(_of_shape(np.shape(a.places()[place])), a, place)


def _assigned_type(target: types.Type, place: Any, a: types.Type) -> Any:
    """Accepts slices with a constant stop only: the size of the array is not known."""
    if not (isinstance(target, types.Array) and isinstance(a, SmallArray)):
        return None
    parts = place if isinstance(place, tuple) else (place,)
    if target.dtype != types.float64 or target.ndim != len(parts) or _shape_at(parts) != a.shape:
        return None
    return signature(types.none, target, _Place(place), a)


_typed("static_getitem", _item_type)
_typed("static_setitem", _assigned_type)


@lower_builtin("static_getitem", SmallArray, types.Any)
def _item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind, (value, place) = sig.args[0], args
    entries = _entries(builder, value, kind)
    chosen = kind.places()[place]
    return _value(builder, [entries[k] for k in chosen.ravel()]) if chosen.ndim else entries[chosen]


def _shape_at(parts: tuple) -> tuple[int, ...] | None:
    """Returns the shape at a constant place of an array; None if it depends on the array's."""
    shape = []
    for part in parts:
        if isinstance(part, slice):
            start = part.start or 0
            if part.stop is None or part.step is not None or not 0 <= start < part.stop:
                return None
            shape.append(part.stop - start)
        elif part < 0:
            return None
    return tuple(shape)


@lower_builtin("static_setitem", types.Array, _Place, SmallArray)
def _store(context: Any, builder: Any, sig: Any, args: Any) -> None:
    array, place, value = args
    ranges = [
        range(part.start or 0, part.stop) if isinstance(part, slice) else [part]
        for part in (place if isinstance(place, tuple) else (place,))
    ]
    entries = _entries(builder, value, sig.args[2])
    for indices, entry in zip(itertools.product(*ranges), entries, strict=True):
        builder.store(entry, _pointer(context, builder, sig.args[0], array, indices))


# ------------------------------------------------------------------------------- back to Python


def _as_array(shape: tuple[int, ...], *entries: float) -> Any:
    return np.array(entries).reshape(shape)


@box(SmallArray)
def _to_python(kind: SmallArray, value: Any, c: Any) -> Any:
    """A law that is called from Python returns an ordinary array."""
    make = c.pyapi.unserialize(c.pyapi.serialize_object(partial(_as_array, kind.shape)))
    entries = [c.pyapi.float_from_double(x) for x in _entries(c.builder, value, kind)]
    array = c.pyapi.call_function_objargs(make, entries)
    for held in (make, *entries):
        c.pyapi.decref(held)
    return array
