"""Meshes: what is taken for one, reports, files, attributes, simplification."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import its
from conftest import cube, torus

DTYPES = ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i4"]


def test_reports() -> None:
    report = its.check(*torus())
    assert report.watertight
    assert report.oriented
    assert (report.vertices, report.triangles, report.euler, report.sign) == (1152, 2304, 0, "winding")
    vertices, faces = cube()
    open_cube = its.check(vertices, faces[2:])
    assert not open_cube.watertight
    assert open_cube.boundary_edges == 4
    assert open_cube.to_dict()["parts"]["closed"] == 0
    assert "boundary_edges" in open_cube._repr_html_()
    inward = its.check(vertices, np.concatenate([faces, faces[:, ::-1] + 8]) % 8)
    assert inward.duplicate == 12


def test_parts_that_face_wrong() -> None:
    vertices, faces = cube()
    two = np.concatenate([vertices, vertices / 2 + 0.25])
    part = its.check(two, np.concatenate([faces, faces + 8])).parts.wrong[0]
    assert (part.fault, part.triangles, part.depth) == ("like-its-container", 12, 1)


@pytest.mark.parametrize("dtype", DTYPES)
def test_faces_of_any_type(dtype: str) -> None:
    vertices, faces = cube()
    assert its.build(vertices, faces.astype(dtype), depth=3) == its.build(vertices, faces, depth=3)


@pytest.mark.parametrize("dtype", ["f4", "f8", ">f8", "i4", "f2"])
def test_vertices_of_any_type(dtype: str) -> None:
    vertices, faces = cube()
    assert its.build(vertices.astype(dtype), faces, depth=3) == its.build(vertices, faces, depth=3)


def test_layouts() -> None:
    vertices, faces = torus()
    expected = its.build(vertices, faces, depth=4)
    frozen = vertices.copy()
    frozen.flags.writeable = False
    for v in (np.asfortranarray(vertices), np.repeat(vertices, 2, axis=0)[::2], vertices.tolist(), frozen):
        for f in (np.asfortranarray(faces), faces[::-1][::-1], faces.tolist()):
            assert its.build(v, f, depth=4) == expected


class Other:
    """A mesh of somebody's own."""

    def __init__(self) -> None:
        self.vertices, self.faces = torus()


def test_what_is_a_mesh(tmp_path: Path) -> None:
    expected = its.build(*torus(), depth=4)
    path = tmp_path / "torus.ply"
    assert its.write(path, torus()) == []
    for mesh in (path, str(path), torus(), list(torus()), its.read(path), Other(), expected.mesh):
        assert its.build(mesh, depth=4) == expected
    bad: Any
    for bad in (
        5,
        None,
        {},
        (1, 2, 3),
        "none.stl",
        (np.zeros((3, 2)), [[0, 1, 2]]),
        (np.zeros((3, 3)), [[0.0, 1, 2]]),
    ):
        with pytest.raises((its.InputError, its.FileError)):
            its.build(bad, depth=4)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        ([], []),
        ([[0, 0, 0]], []),
        ([[0, 0, 0]], [[0, 0, 1]]),
        ([[0, 0, np.nan]] * 3, [[0, 1, 2]]),
        ([[0, 0, 0]] * 3, [[0, 1, -1]]),
    ],
)
def test_what_cannot_be_built(vertices: Any, faces: Any) -> None:
    with pytest.raises(its.InputError) as caught:
        its.build(vertices, faces, depth=3)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("name", ["a.obj", "a.stl", "a.ply", "a.off", "a.glb"])
def test_files(name: str, tmp_path: Path) -> None:
    vertices, faces = torus()
    its.write(tmp_path / name, vertices, faces)
    mesh = its.read(tmp_path / name)
    assert len(mesh.faces) == len(faces)
    assert mesh.format
    exact = not name.endswith(("stl", "glb"))
    corners = mesh.vertices[mesh.faces]
    np.testing.assert_allclose(corners, vertices[faces], rtol=0, atol=0 if exact else 1e-7)


def test_errors_of_files(tmp_path: Path) -> None:
    with pytest.raises(its.FileError):
        its.read(tmp_path / "none.obj")
    with pytest.raises(its.OptionError):
        its.write(tmp_path / "a.xyz", torus())
    with pytest.raises(its.OptionError):
        its.write(tmp_path / "a.glb", torus(), up="w")
    (tmp_path / "bad\udcff.obj").write_text("nothing")
    with pytest.raises(its.InputError):
        its.read(tmp_path / "bad\udcff.obj")


def test_paths_are_never_cut_off(tmp_path: Path) -> None:
    file = tmp_path / "cube.obj"
    its.write(file, cube())
    for use in (its.read, its.build, its.load, its.build(file, depth=2).save):
        with pytest.raises(its.FileError, match="code 0"):
            use(f"{file}\0.stl")


def test_what_a_file_lost_is_said(tmp_path: Path) -> None:
    file = tmp_path / "cube.obj"
    its.write(file, cube())
    file.write_text(file.read_text() + "surf 0 1 0 1 1 2 3 4\n")
    assert its.read(file).warnings
    for use in (its.build, its.as_mesh, lambda path: its.simplify(path, tolerance=0.1)):
        with pytest.warns(its.FileWarning, match=r"cube\.obj"):
            use(file)


def test_attributes(tmp_path: Path) -> None:
    vertices, faces = cube()
    colours = np.random.default_rng(0).integers(0, 256, (8, 4)) / 255
    mesh = its.Mesh(vertices, faces.astype(np.uint32), colours=its.CornerValues(colours, faces))
    assert its.write(tmp_path / "a.ply", mesh) == []
    again = its.read(tmp_path / "a.ply", attributes=True)
    assert again.colours is not None
    np.testing.assert_allclose(again.colours.values[again.colours.corners], colours[faces], atol=1 / 255)
    assert its.read(tmp_path / "a.ply").colours is None
    lost = its.write(tmp_path / "a.stl", mesh)
    assert any("colour" in line for line in lost)
    assert "colours" in mesh._repr_html_()
    assert "8 vertices" in repr(mesh)


def test_simplification() -> None:
    fine = torus(96, 48)
    simple = its.simplify(fine, tolerance=0.02)
    assert len(simple.mesh.faces) < len(fine[1]) // 4
    assert simple.proven_bound is not None
    assert simple.proven_bound <= 0.02
    assert its.mesh_distance(simple.mesh, fine, samples=2000).max <= simple.proven_bound
    assert its.mesh_distance(fine, simple.mesh, samples=2000).max <= simple.proven_bound
    few = its.simplify(fine, ratio=0.1)
    assert few.report["faces_after"] <= 922
    assert few.stop == "faces-reached"
    assert its.simplify(*fine, faces=900, method="qem").proven_bound is None
    assert "stop" in few._repr_html_()
    for bad in ({"ratio": 2.0}, {"ratio": 0.5, "faces": 10}, {"tolerance": -1.0}, {"method": "best"}):
        with pytest.raises(its.OptionError):
            its.simplify(fine, **bad)


def test_simplification_keeps_colours() -> None:
    vertices, faces = torus()
    colours = np.ones((len(vertices), 4))
    colours[:, 0] = vertices[:, 0] > 0
    mesh = its.Mesh(vertices, faces.astype(np.uint32), colours=its.CornerValues(colours, faces))
    simple = its.simplify(mesh, tolerance=0.05).mesh
    assert simple.colours is not None
    assert simple.colours.corners.shape == simple.faces.shape
    assert its.simplify(mesh, tolerance=0.05, attributes=False).mesh.colours is None


def test_welding() -> None:
    vertices, faces = cube()
    apart = vertices[faces.reshape(-1)] + np.random.default_rng(0).uniform(-1e-6, 1e-6, (36, 3))
    assert not its.check(apart, np.arange(36).reshape(-1, 3)).watertight
    assert its.check(its.weld((apart, np.arange(36).reshape(-1, 3)), 1e-5)).watertight
    with pytest.raises(its.OptionError):
        its.weld(cube(), -1)
