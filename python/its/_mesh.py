"""Meshes, and anything that is one to somebody: a path, a pair of arrays, an object of another package."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from . import _bridges, _its
from ._arrays import Array, Floats, as_faces, as_vertices
from ._bridges import Found, find
from ._errors import FileWarning, InputError, LossWarning, OptionError
from ._html import table
from ._progress import ProgressLike, observer
from ._sizes import path_bytes

Faces = npt.NDArray[np.uint32]


class CornerValues(NamedTuple):
    """Values at the corners of triangles: corner k of triangle t has ``values[corners[t, k]]``.

    Where triangles meet, equal values mean that the attribute is continuous, different ones a seam.
    """

    values: Array
    corners: Faces


@runtime_checkable
class _VerticesAndFaces(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


#: A path, a pair (vertices, faces), a Mesh, or a mesh of trimesh, Open3D, PyVista, meshio, libigl, …
MeshLike: TypeAlias = "Mesh | str | os.PathLike[str] | tuple[Any, Any] | _VerticesAndFaces | Any"


@dataclass(eq=False, repr=False)
class Mesh:
    """A triangle mesh: vertices (n, 3) float64, faces (m, 3) uint32, counter-clockwise seen from outside."""

    vertices: Floats
    faces: Faces
    colours: CornerValues | None = None  #: red, green, blue (sRGB), alpha, in [0, 1]
    uv: CornerValues | None = None
    normals: CornerValues | None = None
    format: str | None = None  #: of the file that it was read from
    up: str | None = None  #: the axis that the file's format calls upwards
    warnings: list[str] = field(default_factory=list)  #: what was left out or mended on the way

    def __repr__(self) -> str:
        return f"<its.{type(self).__name__}: {len(self.vertices):,} vertices, {len(self.faces):,} faces>"

    def _rows(self) -> dict[str, object]:
        rows: dict[str, object] = {"vertices": len(self.vertices), "faces": len(self.faces)}
        rows["attributes"] = ", ".join(self._attributes()) or "none"
        if self.warnings:
            rows["warnings"] = "; ".join(self.warnings)
        return rows

    def _repr_html_(self) -> str:
        return table(type(self).__name__, self._rows())

    def _attributes(self) -> dict[str, tuple[Array, Array]]:
        kinds = {"colours": np.float32, "uv": np.float64, "normals": np.float64}
        given = {name: getattr(self, name) for name in kinds}
        return {
            name: (
                np.ascontiguousarray(value.values, kinds[name]),
                np.ascontiguousarray(value.corners, np.uint32),
            )
            for name, value in given.items()
            if value is not None
        }

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """Writes a file, as :func:`its.write`."""
        return write(path, self)

    def to_trimesh(self) -> Any:
        """A ``trimesh.Trimesh``. Colours go along where no vertex has two; what does not is a LossWarning."""
        return _bridges.to_trimesh(self)

    def to_open3d(self, *, legacy: bool = False) -> Any:
        """An ``open3d.t.geometry.TriangleMesh`` with float64 positions, or a legacy mesh."""
        return _bridges.to_open3d(self, legacy=legacy)

    def to_pyvista(self) -> Any:
        """A ``pyvista.PolyData``."""
        return _bridges.to_pyvista(self)

    def to_meshio(self) -> Any:
        """A ``meshio.Mesh``."""
        return _bridges.to_meshio(self)


@dataclass(eq=False, repr=False)
class Surface(Mesh):
    """A level set of f: closed, 2-manifold, without self-intersections."""

    certified: bool = False  #: proven: off the mesh and, by side, around all of it or within it
    reason: str = ""  #: why it is empty or not certified
    level: float = 0.0  #: the value of f that was extracted; mesh units
    report: dict[str, Any] = field(default_factory=dict)

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """Writes a file, as :func:`its.write`. A LossWarning where its format rounds what was proven."""
        return say_rounding(self, path, super().save(path))

    def _rows(self) -> dict[str, object]:
        return {
            **super()._rows(),
            "certified": self.certified,
            "reason": self.reason or "–",
            "level": self.level,
        }


def say_rounding(mesh: Mesh, path: str | os.PathLike[str], lines: list[str]) -> list[str]:
    """Of a proven surface: that its proof is lost if it is, besides the lines that writing gave."""
    rounded = Path(path).suffix.lower() in (".stl", ".glb")
    if not rounded or np.array_equal(mesh.vertices, np.asarray(mesh.vertices).astype(np.float32)):
        return lines
    lost = (
        "coordinates were rounded to 32 bits: nothing is proven of the file; .ply, .obj, .off keep all digits"
    )
    warnings.warn(f"{os.fspath(path)}: {lost}", LossWarning, stacklevel=3)
    return [*lines, lost]


def as_arrays(mesh: MeshLike, faces: Any = None) -> tuple[Array, Array]:
    """(vertices, faces) of anything that is a mesh."""
    if faces is not None:
        return as_vertices(mesh), as_faces(faces)
    if isinstance(mesh, Mesh):
        return as_vertices(mesh.vertices), as_faces(mesh.faces)
    if isinstance(mesh, str | os.PathLike):
        mesh = _read_aloud(mesh)
        return mesh.vertices, mesh.faces
    if isinstance(mesh, tuple | list) and len(mesh) == 2:
        return as_vertices(mesh[0]), as_faces(mesh[1])
    found = _found(mesh)
    return as_vertices(found.vertices), as_faces(found.faces)


def _found(mesh: Any) -> Found:
    found = find(mesh)
    if found is None:
        raise InputError(
            f"a mesh is needed, not {type(mesh).__name__}: a path, (vertices, faces), or an object with "
            "vertices and faces, such as those of trimesh, Open3D, PyVista and meshio"
        )
    return found


def as_mesh(mesh: MeshLike, faces: Any = None) -> Mesh:
    """Anything that is a mesh as a Mesh, with the attributes of its file or the colours of its package.

    A Mesh is returned as it is; arrays may share memory with what was given.
    """
    if isinstance(mesh, Mesh):
        return mesh
    if faces is None and isinstance(mesh, str | os.PathLike):
        return _read_aloud(mesh, attributes=True)
    if faces is not None or (isinstance(mesh, tuple | list) and len(mesh) == 2):
        return Mesh(*as_arrays(mesh, faces))
    found = _found(mesh)
    triangles = as_faces(found.faces)
    colours = None
    if found.colours is not None:
        corners = triangles if found.colour_corners is None else found.colour_corners
        colours = CornerValues(found.colours, corners.astype(np.uint32))
    return Mesh(as_vertices(found.vertices), triangles, colours=colours)


def _read_aloud(path: str | os.PathLike[str], *, attributes: bool = False) -> Mesh:
    """What :func:`read` would put into ``warnings`` becomes a FileWarning each."""
    mesh = read(path, attributes=attributes)
    for warning in mesh.warnings:
        warnings.warn(f"{os.fspath(path)}: {warning}", FileWarning, stacklevel=4)
    return mesh


def _corner_values(found: dict[str, tuple[Array, Array]]) -> dict[str, Any]:
    return {name: CornerValues(*pair) for name, pair in found.items()}


def read(path: str | os.PathLike[str], *, attributes: bool = False, progress: ProgressLike = None) -> Mesh:
    """Reads .obj, .stl, .ply, .off, .glb, .gltf or .3mf, by content where the extension disagrees.

    Polygons are triangulated. What is left out or mended is said in ``warnings``.

    :param attributes: read colours, texture coordinates and normals too
    :raises FileError: if the file cannot be read
    :raises InputError: if it holds no usable triangle, or is malformed
    """
    found = _its.read(path_bytes(path), attributes, observer(progress))
    vertices, faces = found["mesh"]
    return Mesh(
        vertices,
        faces,
        **_corner_values(found["attributes"]),
        format=found["format"],
        up=found["up"],
        warnings=list(found["warnings"]),
    )


def write(
    path: str | os.PathLike[str], mesh: MeshLike, faces: Any = None, *, single: bool = False, up: str = ""
) -> list[str]:
    """Writes .obj, .stl, .ply, .off or .glb; an existing file is replaced only by a complete one.

    STL and GLB round coordinates to 32 bits, the others keep every bit.

    :param single: write 32-bit coordinates in .ply, .obj and .off too
    :param up: of .glb: the axis ("x", "y", "z") of the mesh that points upwards
    :returns: a line for each thing that the format cannot hold
    :raises FileError: if the file cannot be written
    :raises OptionError: for an extension that is not known
    """
    given = as_mesh(mesh, faces)
    if up not in ("", "x", "y", "z"):
        raise OptionError(f"up {up!r}: choose x, y or z")
    return list(
        _its.write(
            path_bytes(path),
            as_vertices(given.vertices),
            as_faces(given.faces),
            given._attributes(),
            single,
            up,
        )
    )
