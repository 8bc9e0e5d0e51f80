"""The arrays of `views` without reference counting, which would take time at every slice."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

Found = tuple[Any, Any]
"""A signature, and the function that generates the code."""


def _vector(_: Any, data: Any, start: Any, n: Any) -> Found:
    return _view(data, 1)


def _matrix(_: Any, data: Any, start: Any, rows: Any, columns: Any) -> Found:
    return _view(data, 2)


def _matrices(_: Any, data: Any, start: Any, count: Any, rows: Any, columns: Any) -> Found:
    return _view(data, 3)


def _view(data: Any, dimensions: int) -> Found:
    """Returns a view of `data` that begins at an index, as an array with this number of dimensions."""
    array = types.Array(data.dtype, dimensions, "C")

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        given, start, *shape = arguments
        given, found = context.make_array(data)(context, builder, given), context.make_array(array)
        size = context.get_abi_sizeof(context.get_data_type(data.dtype))
        strides = [context.get_constant(types.intp, size)]
        for extent in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], extent))
        found = found(context, builder)
        populate_array(found, builder.gep(given.data, [start]), shape, strides, size, None)
        return found._getvalue()

    return array(data, *(1 + dimensions) * (types.intp,)), generate


def _unowned(_: Any, array: Any) -> Found:
    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        given, found = (context.make_array(array)(context, builder, *each) for each in ((arguments[0],), ()))
        for name in ("nitems", "itemsize", "data", "shape", "strides"):
            setattr(found, name, getattr(given, name))
        for name in ("meminfo", "parent"):
            setattr(found, name, cgutils.get_null_value(getattr(found, name).type))
        return found._getvalue()

    return array(array), generate


vector: Any = intrinsic(_vector)
matrix: Any = intrinsic(_matrix)
matrices: Any = intrinsic(_matrices)
borrowed: Any = intrinsic(_unowned)
