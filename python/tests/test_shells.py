"""Building, files, pickles, surfaces, checks."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import its
from conftest import cube, torus
from its._arrays import Floats


def test_what_is_known(ring: its.Shell) -> None:
    vertices, faces = torus()
    assert ring.sign == "winding"
    assert "every edge" in ring.sign_reason
    assert ring.depth == 6
    low, high = ring.epsilon
    assert low <= 0 <= high
    assert ring.thickness == high - low
    np.testing.assert_array_equal(ring.bounds, [vertices.min(axis=0), vertices.max(axis=0)])
    assert ring.cell_width == pytest.approx(2.8 / 64, rel=1e-6)
    assert ring.nbytes > 100_000
    assert len(ring.input_hash) == 32
    np.testing.assert_array_equal(ring.mesh.vertices, vertices)
    np.testing.assert_array_equal(ring.mesh.faces, faces)
    assert not ring.mesh.vertices.flags.writeable
    assert "its.Shell" in repr(ring)
    assert "<table>" in ring._repr_html_()
    with pytest.raises(TypeError, match=r"its\.build"):
        its.Shell()


def test_f_on_the_mesh_is_between_its_bounds(ring: its.Shell) -> None:
    corners = ring.mesh.vertices[ring.mesh.faces]
    weights = np.random.default_rng(0).dirichlet([1, 1, 1], (20, len(corners)))
    value = ring.value(np.einsum("snk,nkc->snc", weights, corners))
    assert ring.epsilon[0] <= value.min()
    assert value.max() <= ring.epsilon[1]


def test_options_reach_the_library() -> None:
    thin = its.build(*torus(), thickness=0.01)
    assert thin.thickness <= 0.01
    assert its.build(*torus(), sign="unsigned", depth=3).sign == "unsigned"
    assert its.build(*torus(), sign="even-odd", depth=3).sign == "even-odd"
    assert its.build(*torus(), depth=3, weld=1e-6).info["weld"] == 1e-6
    assert its.build(*torus(), depth=3, extrema="candidates").info["extrema"] == "candidates"
    with pytest.raises(its.NotReached) as caught:
        its.build(*torus(), thickness=1e-4, max_cells=2000, strict=True)
    assert caught.value.shell.thickness > 1e-4
    with pytest.raises(its.NotReached):  # nor the default one
        its.build(*torus(), max_cells=500, strict=True)
    with pytest.warns(its.NotReachedWarning, match="too coarse"):
        assert its.build(*torus(), max_cells=500).info["coarse_cells"] > 0
    with pytest.raises(its.MemoryLimitError):
        its.build(*torus(), depth=10, max_memory="2M")


@pytest.mark.parametrize(
    "options",
    [
        {"depth": 99},
        {"depth": "5"},
        {"depth": 2.5},
        {"depth": 5, "strict": True},
        {"depth": 5, "max_cells": 1000},
        {"thickness": "thin"},
        {"thickness": [1, 2]},
        {"weld": {}},
        {"sign": "none"},
        {"max_memory": "lots"},
        {"max_memory": 1.5},
        {"threads": -1},
    ],
)
def test_options_out_of_range(options: dict[str, object]) -> None:
    with pytest.raises((its.OptionError, TypeError)):
        its.build(*cube(), **options)  # type: ignore[arg-type]


def test_same_bytes_for_any_number_of_threads() -> None:
    one, two = (its.build(*torus(), depth=6, threads=threads).to_bytes() for threads in (1, 2))
    assert one == two


def test_equality(ring: its.Shell, box: its.Shell) -> None:
    again = its.build(*torus(), depth=6)
    assert ring == again
    assert hash(ring) == hash(again)
    assert ring != box
    assert ring != its.build(*torus(), depth=5)
    assert ring != 5
    assert len({ring, again, box}) == 2


def test_files(ring: its.Shell, points: Floats, tmp_path: Path) -> None:
    path = tmp_path / "ring with ünicode.its"
    ring.save(path)
    assert path.read_bytes() == ring.to_bytes()
    for shell in (its.load(path), its.load(str(path), check="quick"), its.from_bytes(ring.to_bytes())):
        assert shell == ring
        np.testing.assert_array_equal(shell.classify(points), ring.classify(points))
    with pytest.raises(its.OptionError):
        its.load(path, check="none")
    damaged = bytearray(ring.to_bytes())
    damaged[len(damaged) // 2] ^= 1
    with pytest.raises(its.InputError):
        its.from_bytes(bytes(damaged))
    with pytest.raises(its.FileError) as caught:
        its.load(tmp_path / "none.its")
    assert isinstance(caught.value, OSError)
    with pytest.raises(its.FileError):
        ring.save(tmp_path / "none" / "a.its")


def test_pickles(ring: its.Shell, tmp_path: Path) -> None:
    assert pickle.loads(pickle.dumps(ring)) == ring
    path = tmp_path / "ring.its"
    ring.save(path)
    loaded = its.load(os.path.relpath(path))
    pickled = pickle.dumps(loaded)
    assert len(pickled) < 1000  # the path, not the shell
    assert pickle.loads(pickled) == ring
    its.build(*torus(), depth=5).save(path)
    with pytest.raises(its.InputError, match="not the shell that was pickled"):
        pickle.loads(pickled)
    path.unlink()
    with pytest.raises(its.FileError):
        pickle.loads(pickled)


def _count(job: tuple[its.Shell, int]) -> int:
    shell, seed = job
    return int(shell.contains(np.random.default_rng(seed).uniform(-1.6, 1.6, (1000, 3))).sum())


def test_worker_processes(ring: its.Shell, tmp_path: Path) -> None:
    ring.save(tmp_path / "ring.its")
    shell = its.load(tmp_path / "ring.its")
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(_count, [(shell, seed) for seed in range(4)]) == [
            _count((ring, seed)) for seed in range(4)
        ]


def test_surfaces_enclose(ring: its.Shell) -> None:
    outer, inner = ring.surface(), ring.surface("inner")
    assert outer.certified
    assert inner.certified
    assert its.check(outer).watertight
    assert not ring.contains(outer.vertices).any()
    assert (ring.classify(inner.vertices) == its.Side.INSIDE).all()
    assert its.build(outer, depth=5).contains(ring.mesh.vertices, boundary=False).all()
    zero = ring.surface("zero")
    assert not zero.certified
    assert "table" in zero._repr_html_()
    assert ring.surface(resolution=20).report["cell_width"] == pytest.approx(2.8 / 20, rel=1e-6)


def test_what_cannot_be_certified_is_said(ring: its.Shell) -> None:
    with pytest.raises(its.NotCertified) as caught:
        ring.surface("outer", level=0.0)
    assert not caught.value.surface.certified
    assert len(caught.value.surface.faces) > 0
    assert len(ring.surface("outer", level=0.0, require_certified=False).faces) > 0
    with pytest.raises(its.NotCertified):
        its.build(*torus(), depth=4, sign="unsigned").surface("inner")


def test_verification(ring: its.Shell) -> None:
    found = ring.verify(samples=10_000)
    assert found
    assert all(check.passed and check.tested > 0 for check in found.checks)
    vertices, faces = torus()
    assert not ring.verify((vertices * 1.01, faces), samples=10_000)
    assert "FAILED" in ring.verify((vertices * 1.01, faces), samples=10_000)._repr_html_()


def test_grids(box: its.Shell) -> None:
    values, affine = box.grid(10)
    assert values.shape == (15, 15, 15)
    index = np.array([3, 7, 12])
    position = affine[:3, :3] @ index + affine[:3, 3]
    np.testing.assert_allclose(position, index / 10 - 0.2, atol=1e-12)
    assert values[tuple(index)] == box(position)
    codes, _ = box.grid(10, field="classify", padding=0)
    assert codes.dtype == np.int8
    assert codes.shape == (11, 11, 11)
    assert (codes[1:-1, 1:-1, 1:-1] == -1).all()
    with pytest.raises(its.OptionError):
        box.grid(10, field="colour")
    for resolution in (0, 2.5, "10"):
        with pytest.raises(its.OptionError, match="resolution"):
            box.grid(resolution)  # type: ignore[arg-type]
    slab, _ = its.build(cube()[0] * [1, 0.5, 0.25], cube()[1], depth=4).grid(8, padding=0)
    assert slab.shape == (9, 5, 3)
    with pytest.raises(its.InputError, match="one point"):
        its.build(np.ones((3, 3)), [[0, 1, 2]], depth=2).grid(8)
    with pytest.raises(its.Cancelled):
        box.grid(10, progress=lambda stage, fraction: False)


def test_pages(box: its.Shell, tmp_path: Path) -> None:
    from its import _its

    if not _its.has_page:
        with pytest.raises(its.Error, match="npm"):
            box.show()
        return
    page = box.show(title="A <cube>", up="y")
    assert page.html.lower().startswith("<!doctype html>")
    assert "<iframe srcdoc=" in page._repr_html_()
    page.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == page.html


def test_program(tmp_path: Path) -> None:
    its.write(tmp_path / "torus.ply", torus())
    program = Path(sys.executable).parent / "its"
    subprocess.run(
        [program, "build", tmp_path / "torus.ply", "-o", tmp_path / "a.its", "--depth", "6"], check=True
    )
    assert its.load(tmp_path / "a.its") == its.build(tmp_path / "torus.ply", depth=6)
