"""Shells: building, loading, questions about points, surfaces."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from enum import IntEnum
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _its
from ._arrays import Array, Bools, Codes, Floats, PointsLike, as_points, out_array
from ._errors import Cancelled, Error, InputError, NotCertified, NotReached, NotReachedWarning, OptionError
from ._html import table
from ._mesh import Mesh, MeshLike, Surface, as_arrays
from ._progress import ProgressLike, observer
from ._reports import Check, Closest, Verification, WindingNumber, _rule
from ._sizes import bytes_of, given, number, path_bytes, whole


class Side(IntEnum):
    """Where a point is: the codes of :meth:`Shell.classify`."""

    INSIDE = -1
    ON_SURFACE = 0
    OUTSIDE = 1
    NOT_FINITE = 2  #: a coordinate is NaN or infinite
    UNCERTAIN = 3  #: the winding number is within its proven error of ½; of meshes with holes only


_codes = {side.value: np.int8(side.value) for side in Side}
_inside = {boundary: {code: np.bool_(code < boundary) for code in _codes} for boundary in (False, True)}


class Shell:
    """An implicit thin shell: f, negative inside, with epsilon[0] ≤ f ≤ epsilon[1] on all of the mesh, proven.

    Made by :func:`build` or :func:`load`. Immutable; any number of threads may use it. Points are array-likes
    of shape (..., 3) of any real type; nothing is copied of float64 in C order. Results have shape (...) or
    (..., 3); for a single point of shape (3,) they are numpy scalars. Lengths are in mesh units.
    """

    __slots__ = ("__weakref__", "_bounds", "_core", "_info", "_path")

    def __init__(self) -> None:
        raise TypeError("its.Shell is made by its.build() and its.load()")

    _core: _its.Shell
    _info: dict[str, Any]
    _path: str | None
    _bounds: Floats | None

    @classmethod
    def _of(cls, core: _its.Shell, path: str | None = None) -> Shell:
        self = object.__new__(cls)
        self._core = core
        self._info = core.info()
        self._path = path
        self._bounds = None
        return self

    # What is known of it.

    @property
    def depth(self) -> int:
        """K: the finest cells are scale · 2**-K wide."""
        return int(self._info["depth"])

    @property
    def sign(self) -> str:
        """The meaning of inside: "winding", "generalized", "even-odd" or "unsigned"."""
        return str(self._info["sign"])

    @property
    def sign_reason(self) -> str:
        """Why, in one sentence."""
        return str(self._info["sign_reason"])

    @property
    def epsilon(self) -> tuple[float, float]:
        """(ε₁, ε₂): on every point of the mesh ε₁ ≤ f ≤ ε₂, and ε₁ ≤ 0 ≤ ε₂."""
        return self._info["epsilon_inner"], self._info["epsilon_outer"]

    @property
    def thickness(self) -> float:
        """ε₂ - ε₁."""
        return float(self._info["thickness"])

    @property
    def cell_width(self) -> float:
        """Of the finest cells."""
        return float(self._info["cell_width"])

    @property
    def bounds(self) -> Floats:
        """Of the mesh: (2, 3), least and greatest coordinates."""
        if self._bounds is None:
            mesh = self.mesh
            used = mesh.vertices[mesh.faces.reshape(-1)]
            self._bounds = np.stack([used.min(axis=0), used.max(axis=0)])
        return self._bounds.copy()

    @property
    def nbytes(self) -> int:
        """Bytes of the shell without its copy of the mesh."""
        return int(self._info["memory_bytes"])

    @property
    def input_hash(self) -> str:
        """Of all that the shell was built from: 32 hexadecimal digits."""
        high, low = self._info["input_hash"]
        return f"{high:016x}{low:016x}"

    @property
    def mesh(self) -> Mesh:
        """The mesh that it was built from, read-only: nothing is copied."""
        return Mesh(*self._core.mesh())

    @property
    def info(self) -> dict[str, Any]:
        """All that is known, by the names of ``its info --json``."""
        return dict(self._info)

    def __repr__(self) -> str:
        return (
            f"<its.Shell: {self._info['mesh_triangles']:,} triangles, {self.sign}, "
            f"thickness {self.thickness:.6g}, {self.nbytes:,} bytes>"
        )

    def _repr_html_(self) -> str:
        shown = [
            "mesh_triangles",
            "sign",
            "sign_reason",
            "depth",
            "cell_width",
            "epsilon_inner",
            "epsilon_outer",
        ]
        shown += ["thickness", "surface_cells", "cells", "memory_bytes"]
        return table("Implicit thin shell", {name: self._info[name] for name in shown})

    def __eq__(self, other: object) -> bool:
        return self._core.same(other._core) if isinstance(other, Shell) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._info["input_hash"])

    def __reduce__(self) -> tuple[Callable[..., Shell], tuple[Any, ...]]:
        if self._path is not None:
            return _reload, (self._path, _fingerprint(self._info))
        return _decode, (self._core.encode(0),)

    # Points.

    def classify(
        self, points: PointsLike, *, out: Codes | None = None, threads: int = 0, progress: ProgressLike = None
    ) -> Codes:
        """The exact side of each point as a code of :class:`Side`: -1 inside, 0 on the surface, 1 outside.

        By the shell's sign rule, as if by exact arithmetic; 2 where a coordinate is NaN or infinite. Under the
        rule "generalized", of meshes with holes, whether the winding number is over ½, and 3 where its proven
        error leaves both sides possible.
        """
        if out is None:
            code = self._core.classify_point(points)
            if code is not None:
                return _codes[code]  # type: ignore[return-value]
        array, shape = as_points(points)
        result = out_array(out, shape, np.int8)
        self._core.classify(array, result.reshape(-1), threads, observer(progress))
        return result if shape or out is not None else result[()]

    def contains(
        self,
        points: PointsLike,
        *,
        boundary: bool = True,
        uncertain: bool | None = None,
        threads: int = 0,
        progress: ProgressLike = None,
    ) -> Bools:
        """Whether each point is inside. False for what is not finite.

        :param boundary: what to say of points on the surface
        :param uncertain: what to say where :meth:`classify` says uncertain, which it may of meshes with holes
        :raises OptionError: if it does and nothing is said
        """
        code = self._core.classify_point(points)
        if code is not None and code != Side.UNCERTAIN:
            return _inside[boundary][code]  # type: ignore[return-value]
        codes = self.classify(points, threads=threads, progress=progress)
        inside: Bools = codes <= 0 if boundary else codes < 0
        if self.sign != "generalized":
            return inside
        unknown: Bools = codes == Side.UNCERTAIN
        if uncertain is None and unknown.any():
            raise OptionError(
                f"contains: the side of {unknown.sum():,} points is uncertain; say what to take with uncertain="
            )
        return inside | unknown if uncertain else inside

    def signed_distance(
        self, points: PointsLike, *, out: Floats | None = None, threads: int = 0, progress: ProgressLike = None
    ) -> Floats:
        """The distance to the mesh, negative inside: exact up to rounding, its sign that of :meth:`classify`.

        Positive everywhere under the rule "unsigned". NaN where a coordinate is not finite or the side is
        uncertain. The first call prepares a search tree: about a second per million triangles.
        """
        return self._floats(self._core.signed_distance, points, out, (), threads, progress)

    __call__ = signed_distance

    def closest(self, points: PointsLike, *, threads: int = 0, progress: ProgressLike = None) -> Closest:
        """The nearest point of the mesh, its distance, face and barycentric coordinates."""
        array, shape = as_points(points)
        point, barycentric = np.empty((len(array), 3)), np.empty((len(array), 3))
        distance, face = np.empty(len(array)), np.empty(len(array), np.int64)
        self._core.closest(array, point, distance, face, barycentric, threads, observer(progress))
        return Closest(
            point.reshape(*shape, 3),
            distance.reshape(shape)[()],
            face.reshape(shape)[()],
            barycentric.reshape(*shape, 3),
        )

    def value(
        self, points: PointsLike, *, out: Floats | None = None, threads: int = 0, progress: ProgressLike = None
    ) -> Floats:
        """f, negative inside, in mesh units; NaN where a coordinate is not finite."""
        if out is None:
            value = self._core.value_point(points)
            if value is not None:
                return np.float64(value)  # type: ignore[return-value]
        return self._floats(self._core.value, points, out, (), threads, progress)

    def gradient(
        self, points: PointsLike, *, out: Floats | None = None, threads: int = 0, progress: ProgressLike = None
    ) -> Floats:
        """∇f, (..., 3); on lattice planes, where f has a kink, the one-sided one."""
        return self._floats(self._core.gradient, points, out, (3,), threads, progress)

    def value_and_gradient(
        self, points: PointsLike, *, threads: int = 0, progress: ProgressLike = None
    ) -> tuple[Floats, Floats]:
        """The same bits as those of :meth:`value` and :meth:`gradient`."""
        array, shape = as_points(points)
        array = array.reshape(*shape, 3)
        options: dict[str, Any] = {"threads": threads, "progress": progress}
        return self.value(array, **options), self.gradient(array, **options)

    def distance_bounds(
        self, points: PointsLike, *, out: Floats | None = None, threads: int = 0, progress: ProgressLike = None
    ) -> Floats:
        """(..., 2): the signed distance is between these, proven, and nothing but the shell is looked at.

        :raises OptionError: under the rule "generalized"
        """
        return self._floats(self._core.distance_bounds, points, out, (2,), threads, progress)

    def _floats(
        self,
        answer: Callable[[Any, Any, int, Any], None],
        points: PointsLike,
        out: Floats | None,
        row: tuple[int, ...],
        threads: int,
        progress: ProgressLike,
    ) -> Floats:
        array, shape = as_points(points)
        result = out_array(out, shape + row, np.float64)
        answer(array, result.reshape(-1, *row), threads, observer(progress))
        return result if result.ndim or out is not None else result[()]

    def winding_number(
        self, points: PointsLike, *, threads: int = 0, progress: ProgressLike = None
    ) -> WindingNumber:
        """How often the mesh winds around each point, with a proven bound of the error; NaN on the surface."""
        array, shape = as_points(points)
        found = np.empty((len(array), 2))
        self._core.winding_number(array, found, threads, observer(progress))
        return WindingNumber(found[:, 0].reshape(shape)[()], found[:, 1].reshape(shape)[()])

    # What can be made of it.

    def surface(
        self,
        side: str = "outer",
        *,
        level: float | None = None,
        resolution: int | None = None,
        require_certified: bool = True,
        max_memory: int | str | None = None,
        threads: int = 0,
        progress: ProgressLike = None,
    ) -> Surface:
        """A level set of f: "outer" encloses the mesh, "inner" is enclosed by it, proven; "zero" is along it.

        :param level: extract at this value of f, mesh units, and do not move it
        :param resolution: cells along the longest side; None: the shell's own
        :param require_certified: raise NotCertified where the proof fails; not of "zero": it crosses the mesh
        """
        options = given(
            side=side,
            level=None if level is None else number("level", level),
            resolution=resolution,
            max_memory=bytes_of(max_memory),
        )
        arrays, report = self._core.surface(options, threads, observer(progress))
        vertices, faces = arrays
        surface = Surface(
            vertices,
            faces,
            certified=report["certified"],
            reason=report["reason"],
            level=report["level"],
            report=report,
        )
        if require_certified and side != "zero" and not surface.certified:
            raise NotCertified(f"{side} surface: {surface.reason or 'not certified'}", surface)
        return surface

    def grid(
        self,
        resolution: int,
        *,
        field: str = "signed_distance",
        padding: int = 2,
        threads: int = 0,
        progress: ProgressLike = None,
    ) -> tuple[Array, Floats]:
        """Samples on a regular grid around the mesh, and the affine matrix (4, 4) from indices to positions.

        :param resolution: steps along the longest side of the mesh's bounds; the step in mesh units is that
            side over it
        :param field: "signed_distance", "value" or "classify"
        :param padding: further steps on each side
        """
        answers: dict[str, Callable[..., Any]] = {
            "signed_distance": self.signed_distance,
            "value": self.value,
            "classify": self.classify,
        }
        if field not in answers:
            raise OptionError(f"field {field!r}: choose among {', '.join(answers)}")
        resolution, padding = whole("resolution", resolution), whole("padding", padding)
        if resolution < 1 or padding < 0:
            raise OptionError(f"resolution {resolution}, padding {padding}: at least 1 and 0")
        low, high = self.bounds
        longest = float((high - low).max())
        if longest == 0:
            raise InputError("grid: all triangles of the mesh are one point, so there is no side to divide")
        step = longest / resolution
        counts = np.ceil((high - low) / longest * resolution).astype(int) + 1 + 2 * padding
        affine = np.diag([step, step, step, 1.0])
        affine[:3, 3] = (low + high) / 2 - step * (counts - 1) / 2
        values = np.empty(counts, np.int8 if field == "classify" else np.float64)
        self._fill(answers[field], values, affine, threads, observer(progress))
        return values, affine

    @staticmethod
    def _fill(answer: Callable[..., Any], values: Array, affine: Floats, threads: int, watch: Any) -> None:
        """Some planes of x at a time, so that their points take little memory."""
        nx, ny, nz = values.shape
        planes = max(1, 2**19 // (ny * nz))
        axes = [affine[i, 3] + affine[i, i] * np.arange(n) for i, n in enumerate(values.shape)]
        for x in range(0, nx, planes):
            block = values[x : x + planes]
            points = np.stack(np.meshgrid(axes[0][x : x + planes], axes[1], axes[2], indexing="ij"), axis=-1)
            answer(points, out=block, threads=threads)
            if watch is not None and not watch("grid", min(1.0, (x + planes) / nx)):
                raise Cancelled("stopped by the caller")

    def verify(
        self,
        mesh: MeshLike | None = None,
        *,
        samples: int | None = None,
        grid_samples: int | None = None,
        seed: int | None = None,
        complete: bool | None = None,
        threads: int = 0,
        progress: ProgressLike = None,
    ) -> Verification:
        """Checks the shell's promises with code that the builder does not share.

        :param mesh: that it was built from; None: the copy that the shell has
        :param complete: compare all grid points, however many
        """
        options = given(samples=samples, grid_samples=grid_samples, seed=seed, complete=complete)
        arrays = as_arrays(self.mesh if mesh is None else mesh)
        found = self._core.verify(*arrays, options, threads, observer(progress))
        checks = [Check(**check) for check in found.pop("checks")]
        return Verification(**found, checks=checks)

    def save(self, path: str | os.PathLike[str], *, threads: int = 0) -> None:
        """Writes an .its file; an existing one is replaced only by a complete one."""
        self._core.save(path_bytes(path), threads)

    def to_bytes(self, *, threads: int = 0) -> bytes:
        """What :meth:`save` would write."""
        return self._core.encode(threads)

    def show(
        self,
        *,
        title: str = "Implicit thin shell",
        up: str = "z",
        resolution: int | None = None,
        max_triangles: int | None = None,
        threads: int = 0,
        progress: ProgressLike = None,
    ) -> Page:
        """The page of ``its view``, for a notebook: surfaces, mesh, and a plane with f, in three dimensions."""
        if not _its.has_page:
            raise Error(
                "show: this package was built without pages, which need npm; install npm and build again"
            )
        if up not in ("x", "y", "z"):
            raise OptionError(f"up {up!r}: choose x, y or z")
        options = given(title=title, up="xyz".index(up), resolution=resolution, max_triangles=max_triangles)
        return Page(self._core.page(options, threads, observer(progress)))


class Page:
    """One HTML text that loads nothing else; a notebook shows it."""

    def __init__(self, html: str) -> None:
        self.html = html

    def _repr_html_(self) -> str:
        return f"<iframe srcdoc='{escape(self.html)}' style='width:100%;height:600px;border:0'></iframe>"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.html)


def build(
    mesh: MeshLike,
    faces: npt.ArrayLike | None = None,
    *,
    thickness: float | None = None,
    depth: int | None = None,
    sign: str = "auto",
    max_cells: int | None = None,
    max_depth: int | None = None,
    weld: float | None = None,
    turn_parts: bool | None = None,
    extrema: str | None = None,
    strict: bool = False,
    max_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Shell:
    """Builds the shell of any mesh, of which it keeps a copy.

    :param mesh: vertices, with ``faces``; or a path, (vertices, faces), a mesh of another package
    :param thickness: ε₂ - ε₁ shall be at most this, mesh units; default: 0.2 % of the longest side
    :param depth: instead: K of a shell with cells of one size, scale · 2**-K wide
    :param sign: "auto", "winding", "generalized", "even-odd" or "unsigned"
    :param max_cells, max_depth, max_memory: limits of a shell that is built to a thickness
    :param weld: corners that are nearer than this become one first
    :param turn_parts: turn closed parts around by nesting: solid, cavity, solid
    :param strict: raise NotReached where the limits do not allow the thickness; else NotReachedWarning says so
    :raises InputError, OptionError, FileError, MemoryLimitError, Cancelled:
    """
    if depth is not None and (strict or max_cells is not None or max_depth is not None):
        raise OptionError(
            "max_cells, max_depth and strict are of a shell that is built to a thickness, not a depth"
        )
    options = given(
        thickness=None if thickness is None else number("thickness", thickness),
        depth=depth,
        sign=_rule(sign),
        max_cells=max_cells,
        max_depth=max_depth,
        weld=None if weld is None else number("weld", weld),
        turn_parts=turn_parts,
        extrema=extrema,
        max_memory=bytes_of(max_memory),
    )
    shell = Shell._of(_its.build(*as_arrays(mesh, faces), options, threads, observer(progress)))
    if shell._info["coarse_cells"] > 0:
        short = (
            f"the shell is {shell.thickness:.6g} thick, not {shell._info['thickness_asked']:.6g}: "
            f"{shell._info['coarse_cells']:,} cells are too coarse; allow more cells or memory"
        )
        if strict:
            raise NotReached(short, shell)
        warnings.warn(short, NotReachedWarning, stacklevel=2)
    return shell


def load(path: str | os.PathLike[str], *, check: str = "full", threads: int = 0) -> Shell:
    """Maps an .its file into memory: processes share its pages.

    :param check: "full" examines every byte; "quick" what is needed to be safe, in milliseconds, but damage
        of the values goes unnoticed
    """
    core = _its.load(path_bytes(path), {"check": check}, threads)
    return Shell._of(core, os.path.abspath(os.fsdecode(path)))


def from_bytes(data: bytes, *, check: str = "full", threads: int = 0) -> Shell:
    """The shell in the bytes of an .its file, which are copied."""
    return Shell._of(_its.decode(data, {"check": check}, threads))


def _fingerprint(info: dict[str, Any]) -> tuple[Any, ...]:
    names = ("input_hash", "depth", "cells", "epsilon_inner", "epsilon_outer", "mesh_triangles")
    return tuple(info[name] for name in names)


def _reload(path: str, fingerprint: tuple[Any, ...]) -> Shell:
    """Of a pickle: the file was examined when the shell was first loaded."""
    shell = load(path, check="quick")
    if _fingerprint(shell._info) != fingerprint:
        raise InputError(f"{path}: this is not the shell that was pickled; the file was replaced")
    return shell


def _decode(data: bytes) -> Shell:
    return from_bytes(data, check="quick")
