"""Round trips through other packages: the real ones, where they are installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import its
from conftest import cube, torus


@pytest.fixture
def coloured() -> its.Mesh:
    """A torus with a colour at each vertex, of 8 bits as most packages have them."""
    vertices, faces = torus(24, 12)
    colours = np.random.default_rng(0).integers(0, 256, (len(vertices), 4)).astype(np.float32) / 255
    return its.Mesh(
        vertices, faces.astype(np.uint32), colours=its.CornerValues(colours, faces.astype(np.uint32))
    )


def same(a: its.MeshLike, b: its.MeshLike) -> bool:
    """Whether the shells are: that they were built from the same numbers."""
    return its.build(a, depth=3) == its.build(b, depth=3)


def colours_of(mesh: its.Mesh) -> Any:
    assert mesh.colours is not None
    return mesh.colours.values[mesh.colours.corners]


def test_trimesh(coloured: its.Mesh) -> None:
    trimesh = pytest.importorskip("trimesh")
    made = coloured.to_trimesh()
    assert isinstance(made, trimesh.Trimesh)
    assert made.is_watertight
    assert same(made, coloured)
    back = its.as_mesh(made)
    np.testing.assert_array_equal(back.vertices, coloured.vertices)
    np.testing.assert_array_equal(colours_of(back), colours_of(coloured))
    assert its.as_mesh(trimesh.creation.box()).colours is None  # its grey is nobody's colour


def test_trimesh_scene() -> None:
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.Trimesh(*cube()))
    scene.add_geometry(
        trimesh.Trimesh(*cube()), transform=trimesh.transformations.translation_matrix([3, 0, 0])
    )
    shell = its.build(scene, depth=4)
    assert shell.contains([[0.5, 0.5, 0.5], [3.5, 0.5, 0.5], [2, 0.5, 0.5]]).tolist() == [True, True, False]


def test_trimesh_agrees() -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=2)
    shell = its.build(mesh, depth=4)
    assert its.check(mesh).signed_volume == pytest.approx(mesh.volume)
    np.testing.assert_array_equal(shell.bounds, mesh.bounds)


def test_meshio(coloured: its.Mesh) -> None:
    meshio = pytest.importorskip("meshio")
    made = coloured.to_meshio()
    assert same(made, coloured)
    np.testing.assert_array_equal(colours_of(its.as_mesh(made)), colours_of(coloured))
    quads = meshio.Mesh(cube()[0], [("quad", [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6]])])
    assert len(its.as_mesh(quads).faces) == 8
    mixed = meshio.Mesh(cube()[0], [("line", [[0, 1]]), ("triangle", cube()[1])])
    assert same(mixed, cube())
    with pytest.raises(its.InputError, match="tetra"):
        its.check(meshio.Mesh(cube()[0], [("tetra", [[0, 1, 2, 4]])]))
    with pytest.raises(its.InputError, match="no triangles"):
        its.check(meshio.Mesh(cube()[0], [("line", [[0, 1]])]))


def test_pyvista(coloured: its.Mesh) -> None:
    pyvista = pytest.importorskip("pyvista")
    made = coloured.to_pyvista()
    assert isinstance(made, pyvista.PolyData)
    assert made.points.dtype == np.float64
    assert same(made, coloured)
    np.testing.assert_array_equal(colours_of(its.as_mesh(made)), colours_of(coloured))
    assert its.check(pyvista.Box((0, 1, 0, 1, 0, 1), quads=True).clean()).watertight
    assert its.check(pyvista.ImageData(dimensions=(3, 3, 3))).triangles == 48  # the outside of its cells


def test_open3d(coloured: its.Mesh) -> None:
    o3d = pytest.importorskip("open3d")
    made = coloured.to_open3d()
    assert isinstance(made, o3d.t.geometry.TriangleMesh)
    assert made.to_legacy().is_watertight()
    assert same(made, coloured)
    np.testing.assert_array_equal(colours_of(its.as_mesh(made))[..., :3], colours_of(coloured)[..., :3])
    legacy = coloured.to_open3d(legacy=True)
    assert isinstance(legacy, o3d.geometry.TriangleMesh)
    assert same(legacy, coloured)
    np.testing.assert_array_equal(colours_of(its.as_mesh(legacy))[..., :3], colours_of(coloured)[..., :3])


def test_attributes_with_seams_are_left_out(coloured: its.Mesh) -> None:
    corners = np.arange(3 * len(coloured.faces), dtype=np.uint32).reshape(-1, 3)
    values = np.random.default_rng(1).uniform(0, 1, (corners.size, 4)).astype(np.float32)
    seams = its.Mesh(coloured.vertices, coloured.faces, colours=its.CornerValues(values, corners))
    pytest.importorskip("trimesh")
    with pytest.warns(its.LossWarning, match="colours"):
        made = seams.to_trimesh()
    assert its.as_mesh(made).colours is None
