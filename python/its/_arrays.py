"""Array-likes of any kind as the arrays that the library reads."""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ._errors import InputError, OptionError

Array = npt.NDArray[Any]
Floats = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int8]
Indices = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


class SupportsDLPack(Protocol):
    """An array in the processor's memory, of any package."""

    def __dlpack__(self, **options: Any) -> Any: ...
    def __dlpack_device__(self) -> Any: ...


#: Points: anything that numpy makes an array of real numbers of, whose last axis has three.
PointsLike: TypeAlias = "npt.ArrayLike | SupportsDLPack"


def as_array(given: Any, what: str) -> Array:
    """A numpy array of real numbers: the same memory where that is possible."""
    if isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        raise InputError(f"{what}: an array with masked elements; fill them or leave them out first")
    try:
        if hasattr(given, "__dlpack__") and not hasattr(given, "__array__"):
            given = np.from_dlpack(given)
        elif hasattr(given, "detach") and hasattr(given, "cpu"):  # a tensor of torch that wants a gradient
            given = given.detach()
        array: Array = np.asarray(given)
    except (TypeError, ValueError, RuntimeError, BufferError) as error:
        raise InputError(f"{what}: no array can be made of {type(given).__name__}: {error}") from error
    if array.dtype.kind not in "fiub":
        if array.size:
            raise InputError(f"{what}: an array of {array.dtype} is not one of real numbers")
        array = array.astype(np.float64)
    return array


def as_points(given: Any) -> tuple[Floats, tuple[int, ...]]:
    """Points as (n, 3) float64 in C order, and the shape without its last axis."""
    array = as_array(given, "points")
    if array.ndim == 0 or array.shape[-1] != 3:
        if array.ndim == 1 and array.size == 0:
            return np.empty((0, 3)), (0,)
        raise InputError(f"points of shape {array.shape}: the last axis must have 3 coordinates")
    shape = array.shape[:-1]
    array = np.require(array, np.float64, ["C", "A"])
    if not array.dtype.isnative:
        array = array.astype(np.float64)
    return array.reshape(-1, 3), shape


def out_array(out: Array | None, shape: tuple[int, ...], dtype: npt.DTypeLike) -> Array:
    """The array that results go to: the caller's if it fits."""
    if out is None:
        return np.empty(shape, dtype)
    if not isinstance(out, np.ndarray):
        raise OptionError(f"out: a numpy array is needed, not {type(out).__name__}")
    flags = out.flags
    if (
        out.shape != shape
        or out.dtype != dtype
        or not (flags.c_contiguous and flags.writeable and flags.aligned)
    ):
        raise OptionError(
            f"out: a writable array in C order of shape {shape} and type {np.dtype(dtype)} is needed, "
            f"not shape {out.shape} and type {out.dtype}"
        )
    return out


def as_vertices(given: Any) -> Array:
    """Vertices as floating-point numbers of 32 or 64 bits, of any strides."""
    array = as_array(given, "vertices")
    if array.size == 0 and array.ndim < 2:
        array = array.reshape(0, 3)
    if array.dtype not in (np.float32, np.float64) or not array.dtype.isnative:
        array = array.astype(np.float64)
    return _strided(array, "vertices")


def as_faces(given: Any) -> Array:
    """Triangles as whole numbers that the library reads, of any strides."""
    array = as_array(given, "faces")
    if array.size == 0:
        array = array.astype(np.int64) if array.dtype.kind == "f" else array
        if array.ndim < 2:
            array = array.reshape(0, 3)
    if array.dtype.kind not in "iu":
        raise InputError(f"faces of type {array.dtype}: they must be whole numbers")
    if array.dtype.itemsize == 1 or not array.dtype.isnative:
        array = array.astype(np.int64 if array.dtype.kind == "i" else np.uint64)
    return _strided(array, "faces")


def _strided(array: Array, what: str) -> Array:
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{what} of shape {array.shape}: (n, 3) is needed")
    if not array.flags.aligned or any(stride % array.dtype.itemsize for stride in array.strides):
        array = array.copy()
    return array
