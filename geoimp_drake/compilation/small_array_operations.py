"""What numba compiles for operations on small arrays: arithmetic, entries and slices.

Arithmetic is written out entry by entry, since a loop over three entries does not pay. Only long
products are loops. Importing this module registers them.
"""

import itertools
import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate, signature
from numba.extending import infer_getattr, lower_builtin, lower_getattr

from geoimp_drake.compilation.small_array_type import (
    SmallArray,
    entries_of,
    entry_pointer,
    is_number,
    of_shape,
    typed,
    value_of,
)

__all__: list[str] = []

# A product with up to so many multiplications is written out; a longer one becomes a loop. A law
# runs once in a step, and by the next step long code has left the caches.
_WRITTEN_OUT = 64


class _Place(types.Type):
    """Stands in a signature for a constant place, since a slice cannot be looked up."""

    def __init__(self, place: Any):
        super().__init__(name=f"Place({place})")


def _entry_by_entry(operation: Any, instruction: str) -> None:
    """Teaches numba a sum, difference or product of two arrays, entry by entry."""

    def result(a: types.Type, b: types.Type) -> Any:
        return signature(a, a, b) if isinstance(a, SmallArray) and a == b else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (entries_of(builder, value, sig.return_type) for value in args)
        each = getattr(builder, instruction)
        return value_of(builder, [each(x, y) for x, y in zip(a, b, strict=True)])

    typed(operation, result)
    lower_builtin(operation, SmallArray, SmallArray)(lower)


def _with_number(operation: Any, instruction: str, *, number_first: bool) -> None:
    """Teaches numba a product with, or a quotient by, a number."""
    place = 1 if number_first else 0

    def result(a: types.Type, b: types.Type) -> Any:
        kinds = (a, b)
        array, number = kinds[place], kinds[1 - place]
        if not (isinstance(array, SmallArray) and is_number(number)):
            return None
        return signature(
            array, *((types.float64, array) if number_first else (array, types.float64))
        )

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        entries = entries_of(builder, args[place], sig.return_type)
        each = getattr(builder, instruction)
        return value_of(builder, [each(x, args[1 - place]) for x in entries])

    kinds = (types.Float, SmallArray) if number_first else (SmallArray, types.Float)
    typed(operation, result)
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
    return signature(of_shape(a.shape[:-1] + b.shape[1:]), a, b)


typed(operator.neg, _negative_type)
typed(operator.matmul, _product_type)


@lower_builtin(operator.neg, SmallArray)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return value_of(builder, [builder.fneg(x) for x in entries_of(builder, args[0], sig.args[0])])


@lower_builtin(operator.matmul, SmallArray, SmallArray)
def _product(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    inner = sig.args[1].shape[0]
    columns = sig.args[1].size // inner
    if sig.args[0].size * columns > _WRITTEN_OUT and isinstance(sig.return_type, SmallArray):
        return _long_product(builder, sig, args, inner, columns)
    a, b = (entries_of(builder, *pair) for pair in zip(args, sig.args, strict=True))
    found = [
        _dot(builder, a[i : i + inner], b[k::columns])
        for i in range(0, len(a), inner)
        for k in range(columns)
    ]
    return value_of(builder, found) if isinstance(sig.return_type, SmallArray) else found[0]


def _long_product(builder: Any, sig: Any, args: Any, inner: int, columns: int) -> Any:
    """Returns a product by a loop over its entries; each is summed as if it were written out."""
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
    entries = entries_of(builder, value, kind)
    return value_of(builder, [entries[k] for k in kind.places().T.ravel()])


def _item_type(a: types.Type, place: Any) -> Any:
    if not isinstance(a, SmallArray):
        return None
    return signature(of_shape(np.shape(a.places()[place])), a, place)


def _assigned_type(target: types.Type, place: Any, a: types.Type) -> Any:
    """Accepts only slices with a constant stop, since the size of the array is not known."""
    if not (isinstance(target, types.Array) and isinstance(a, SmallArray)):
        return None
    parts = place if isinstance(place, tuple) else (place,)
    if target.dtype != types.float64 or target.ndim != len(parts) or _shape_at(parts) != a.shape:
        return None
    return signature(types.none, target, _Place(place), a)


typed("static_getitem", _item_type)
typed("static_setitem", _assigned_type)


@lower_builtin("static_getitem", SmallArray, types.Any)
def _item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind, (value, place) = sig.args[0], args
    entries = entries_of(builder, value, kind)
    chosen = kind.places()[place]
    return (
        value_of(builder, [entries[k] for k in chosen.ravel()]) if chosen.ndim else entries[chosen]
    )


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
    entries = entries_of(builder, value, sig.args[2])
    for indices, entry in zip(itertools.product(*ranges), entries, strict=True):
        builder.store(entry, entry_pointer(context, builder, sig.args[0], array, indices))
