"""Meshes of other packages, none of which is needed: they are recognised by what they have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._arrays import Array
from ._errors import InputError

if TYPE_CHECKING:
    from ._mesh import CornerValues, Mesh


def arrays_of(mesh: Any) -> tuple[Any, Any] | None:
    """(vertices, faces), or None if this is no mesh that we know."""
    if hasattr(mesh, "geometry") and hasattr(mesh, "to_mesh"):  # trimesh.Scene: its parts in their places
        mesh = mesh.to_mesh()
    for find in (_open3d_tensor, _pyvista, _meshio, _plain):
        found = find(mesh)
        if found is not None:
            return found
    return None


def _plain(mesh: Any) -> tuple[Any, Any] | None:
    """trimesh has vertices and faces; Open3D's legacy meshes have triangles."""
    vertices = getattr(mesh, "vertices", None)
    faces = getattr(mesh, "faces", None)
    if faces is None:
        faces = getattr(mesh, "triangles", None)
    return None if vertices is None or faces is None else (np.asarray(vertices), np.asarray(faces))


def _open3d_tensor(mesh: Any) -> tuple[Any, Any] | None:
    if not (hasattr(mesh, "vertex") and hasattr(mesh, "triangle")):
        return None
    return mesh.vertex["positions"].cpu().numpy(), mesh.triangle["indices"].cpu().numpy()


def _pyvista(mesh: Any) -> tuple[Any, Any] | None:
    if not (hasattr(mesh, "points") and hasattr(mesh, "is_all_triangles")):
        return None
    if hasattr(mesh, "extract_surface") and not hasattr(mesh, "faces"):
        mesh = mesh.extract_surface()  # a grid or volume mesh: its outside
    if not mesh.is_all_triangles:
        mesh = mesh.triangulate()
    return np.asarray(mesh.points), np.asarray(mesh.faces).reshape(-1, 4)[:, 1:]


def _meshio(mesh: Any) -> tuple[Any, Any] | None:
    if not (hasattr(mesh, "points") and hasattr(mesh, "cells")):
        return None
    parts = []
    for block in mesh.cells:
        if block.type not in ("triangle", "quad", "polygon"):
            if block.type in ("vertex", "line"):
                continue  # no part of a surface
            raise InputError(f"cells of type {block.type}: only triangles and polygons make a surface")
        cells = np.asarray(block.data)
        for k in range(1, cells.shape[1] - 1):
            parts.append(cells[:, [0, k, k + 1]])
    if not parts:
        raise InputError("the mesh of meshio has no triangles")
    points = np.asarray(mesh.points)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    return points, np.concatenate(parts)


def _by_vertex(attribute: CornerValues | None, mesh: Mesh) -> Array | None:
    """The values by vertex; None where there are none, or a vertex has two."""
    if attribute is None:
        return None
    corners = attribute.values[attribute.corners].reshape(-1, attribute.values.shape[1])
    values = np.zeros((len(mesh.vertices), corners.shape[1]), corners.dtype)
    values[mesh.faces.reshape(-1)] = corners
    return values if np.array_equal(values[mesh.faces.reshape(-1)], corners) else None


def to_trimesh(mesh: Mesh) -> Any:
    """Vertices keep their numbers: nothing is merged."""
    import trimesh

    made: Any = trimesh.Trimesh(np.array(mesh.vertices), np.array(mesh.faces, np.int64), process=False)
    colours = _by_vertex(mesh.colours, mesh)
    if colours is not None:
        made.visual.vertex_colors = np.round(255 * colours).astype(np.uint8)
    return made


def to_open3d(mesh: Mesh, *, legacy: bool) -> Any:
    """Tensor meshes have float64 positions and int64 indices; legacy ones int32."""
    import open3d as o3d

    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    colours = _by_vertex(mesh.colours, mesh)
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

    made = pyvista.PolyData.from_regular_faces(np.array(mesh.vertices), np.array(mesh.faces, np.int64))
    colours = _by_vertex(mesh.colours, mesh)
    if colours is not None:
        made.point_data["colours"] = colours
    return made


def to_meshio(mesh: Mesh) -> Any:
    """One block of triangles."""
    import meshio

    colours = _by_vertex(mesh.colours, mesh)
    data = {} if colours is None else {"colours": colours}
    return meshio.Mesh(np.array(mesh.vertices), [("triangle", np.array(mesh.faces, np.int64))], point_data=data)
