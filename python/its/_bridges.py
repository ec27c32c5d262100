"""Meshes of other packages, none of which is needed: they are recognised by what they have."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._arrays import Array
from ._errors import InputError, LossWarning

if TYPE_CHECKING:
    from ._mesh import CornerValues, Mesh


class Found(NamedTuple):
    """What is in a mesh of another package."""

    vertices: Any
    faces: Any
    colours: Array | None = None  #: (n, 4) float32
    colour_corners: Array | None = None  #: None: by vertex


def find(mesh: Any) -> Found | None:
    """Vertices, faces and colours, or None if this is no mesh that we know."""
    if hasattr(mesh, "geometry") and hasattr(mesh, "to_mesh"):  # trimesh.Scene: its parts in their places
        mesh = mesh.to_mesh()
    for package in (_open3d_tensor, _pyvista, _meshio, _plain):
        found = package(mesh)
        if found is not None:
            return found
    return None


def _rgba(colours: Any) -> Array:
    """Colours of 3 or 4 numbers, of 8 bits or in [0, 1], as the library has them."""
    array = np.asarray(colours)
    scaled = array.astype(np.float32) / np.float32(255 if array.dtype == np.uint8 else 1)
    if scaled.shape[1] == 3:
        scaled = np.column_stack([scaled, np.ones(len(scaled), np.float32)])
    return scaled


def _plain(mesh: Any) -> Found | None:
    """trimesh has vertices and faces; Open3D's legacy meshes have triangles."""
    vertices = getattr(mesh, "vertices", None)
    faces = getattr(mesh, "faces", None)
    if faces is None:
        faces = getattr(mesh, "triangles", None)
    if vertices is None or faces is None:
        return None
    vertices, faces = np.asarray(vertices), np.asarray(faces)
    kind = getattr(getattr(mesh, "visual", None), "kind", None)
    if kind == "vertex":
        return Found(vertices, faces, _rgba(mesh.visual.vertex_colors))
    if kind == "face":
        of_face = np.repeat(np.arange(len(faces), dtype=np.uint32)[:, None], 3, axis=1)
        return Found(vertices, faces, _rgba(mesh.visual.face_colors), of_face)
    has_colours = getattr(mesh, "has_vertex_colors", None)
    if callable(has_colours) and has_colours():
        return Found(vertices, faces, _rgba(mesh.vertex_colors))
    return Found(vertices, faces)


def _open3d_tensor(mesh: Any) -> Found | None:
    if not (hasattr(mesh, "vertex") and hasattr(mesh, "triangle")):
        return None
    colours = _rgba(mesh.vertex["colors"].cpu().numpy()) if "colors" in mesh.vertex else None
    return Found(mesh.vertex["positions"].cpu().numpy(), mesh.triangle["indices"].cpu().numpy(), colours)


def _pyvista(mesh: Any) -> Found | None:
    if not (hasattr(mesh, "points") and hasattr(mesh, "extract_surface")):
        return None
    if not hasattr(mesh, "is_all_triangles"):
        mesh = mesh.extract_surface(algorithm="dataset_surface")  # of a grid or volume mesh: its outside
    if not mesh.is_all_triangles:
        mesh = mesh.triangulate()
    colours = _rgba(mesh.point_data["colours"]) if "colours" in mesh.point_data else None
    return Found(np.asarray(mesh.points), np.asarray(mesh.faces).reshape(-1, 4)[:, 1:], colours)


def _meshio(mesh: Any) -> Found | None:
    if not (hasattr(mesh, "points") and hasattr(mesh, "cells")):
        return None
    parts = []
    for block in mesh.cells:
        if block.type in ("vertex", "line"):
            continue  # no part of a surface
        if block.type not in ("triangle", "quad", "polygon"):
            raise InputError(f"cells of type {block.type}: only triangles and polygons make a surface")
        cells = np.asarray(block.data)
        parts += [cells[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)]
    if not parts:
        raise InputError("the mesh of meshio has no triangles")
    points = np.asarray(mesh.points)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    colours = _rgba(mesh.point_data["colours"]) if "colours" in mesh.point_data else None
    return Found(points, np.concatenate(parts), colours)


def _vertex_colours(mesh: Mesh, package: str) -> Array | None:
    """Colours by vertex; says what is lost."""
    for name in ("uv", "normals"):
        if getattr(mesh, name) is not None:
            warnings.warn(f"{name} are not handed to {package}", LossWarning, stacklevel=4)
    values = None if mesh.colours is None else _by_vertex(mesh.colours, mesh)
    if mesh.colours is not None and values is None:
        warnings.warn(f"colours are not handed to {package}: a vertex has several", LossWarning, stacklevel=4)
    return values


def _by_vertex(attribute: CornerValues, mesh: Mesh) -> Array | None:
    """None where a vertex has two values."""
    corners = attribute.values[attribute.corners].reshape(-1, attribute.values.shape[1])
    values = np.zeros((len(mesh.vertices), corners.shape[1]), corners.dtype)
    at = mesh.faces.reshape(-1)
    values[at] = corners
    return values if np.array_equal(values[at], corners) else None


def to_trimesh(mesh: Mesh) -> Any:
    """Vertices keep their numbers: nothing is merged."""
    import trimesh

    made: Any = trimesh.Trimesh(np.array(mesh.vertices), np.array(mesh.faces, np.int64), process=False)
    colours = _vertex_colours(mesh, "trimesh")
    if colours is not None:
        made.visual.vertex_colors = np.round(255 * colours).astype(np.uint8)
    return made


def to_open3d(mesh: Mesh, *, legacy: bool) -> Any:
    """Tensor meshes have float64 positions and int64 indices; legacy ones int32."""
    import open3d as o3d

    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    colours = _vertex_colours(mesh, "Open3D")
    if legacy:
        old = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces.astype(np.int32))
        )
        if colours is not None:
            old.vertex_colors = o3d.utility.Vector3dVector(colours[:, :3].astype(np.float64))
        return old
    new = o3d.t.geometry.TriangleMesh()
    new.vertex["positions"] = o3d.core.Tensor(vertices)
    new.triangle["indices"] = o3d.core.Tensor(faces.astype(np.int64))
    if colours is not None:
        new.vertex["colors"] = o3d.core.Tensor(np.ascontiguousarray(colours[:, :3], np.float32))
    return new


def to_pyvista(mesh: Mesh) -> Any:
    """Points stay float64."""
    import pyvista

    faces: Any = np.array(mesh.faces, np.int64)
    made = pyvista.PolyData.from_regular_faces(np.array(mesh.vertices), faces)
    colours = _vertex_colours(mesh, "PyVista")
    if colours is not None:
        made.point_data["colours"] = colours
    return made


def to_meshio(mesh: Mesh) -> Any:
    """One block of triangles."""
    import meshio

    colours = _vertex_colours(mesh, "meshio")
    data = {} if colours is None else {"colours": colours}
    return meshio.Mesh(np.array(mesh.vertices), [("triangle", np.array(mesh.faces, np.int64))], point_data=data)
