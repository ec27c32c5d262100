"""Wraps and the check of cages, through Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import its
from conftest import cube, torus


@pytest.mark.parametrize("side", ["outer", "inner"])
def test_a_wrap_keeps_its_distance(side: str) -> None:
    ring = torus()
    wrap = its.wrap(*ring, clearance=0.1, slack=0.02, side=side)
    assert 0.1 <= wrap.lowest <= wrap.highest <= 0.1 + 0.02
    distances = its.build(*ring, depth=5).signed_distance(wrap.vertices)
    assert (np.abs(distances) >= wrap.lowest * (1 - 1e-12)).all()
    assert (np.abs(distances) <= wrap.highest * (1 + 1e-12)).all()
    assert ((distances < 0) == (side == "inner")).all()
    assert its.check(wrap).watertight
    found = its.verify_cage(wrap, ring, side=side, clearance=0.1, distance=0.12)
    assert found
    assert found.passed
    assert 0.1 <= found.nearest <= found.farthest <= 0.12
    assert found.cage_components == found.mesh_components == 1
    assert "passed" in found._repr_html_()
    assert "nearest" in wrap._repr_html_()


def test_an_offset_is_a_wrap() -> None:
    for distance, side in ((0.1, "outer"), (-0.1, "inner")):
        moved = its.offset(torus(), distance, slack=0.02)
        wrap = its.wrap(torus(), clearance=0.1, slack=0.02, side=side)
        np.testing.assert_array_equal(moved.vertices, wrap.vertices)
        np.testing.assert_array_equal(moved.faces, wrap.faces)


def test_a_cage_that_is_none() -> None:
    small, large = (np.array(cube()[0]) * s - s / 2 for s in (1.0, 2.0))
    faces = cube()[1]
    assert its.verify_cage((large, faces), (small, faces))
    assert not its.verify_cage((small, faces), (large, faces))
    assert its.verify_cage((small, faces), (large, faces), side="inner")
    assert not its.verify_cage((large, faces), (small, faces), distance=0.5)
    assert not its.verify_cage((large, faces[:-1]), (small, faces))


def test_files_that_round_say_so(tmp_path: Path) -> None:
    wrap = its.wrap(torus(), clearance=0.1, slack=0.02)
    with pytest.warns(its.LossWarning, match="nothing is proven"):
        assert "rounded" in wrap.save(tmp_path / "wrap.stl")[-1]
    assert wrap.save(tmp_path / "wrap.ply") == []
    single = its.wrap(torus(), clearance=0.1, slack=0.02, single=True)
    assert single.save(tmp_path / "wrap.stl") == []
    assert its.verify_cage(tmp_path / "wrap.stl", torus(), clearance=0.1, distance=0.12)
    with pytest.warns(its.LossWarning, match="nothing is proven"):
        its.build(*torus(), depth=5).surface().save(tmp_path / "surface.stl")


def test_options() -> None:
    measured = its.wrap(torus(), clearance=0.1, slack=0.02, measure=True)
    assert measured.report["to_mesh"] <= measured.highest
    single = its.wrap(torus(), clearance=0.1, slack=0.02, single=True)
    np.testing.assert_array_equal(single.vertices, single.vertices.astype(np.float32))
    with pytest.raises(its.OptionError, match="inner wrap is empty"):
        its.wrap(torus(), clearance=0.5, slack=0.02, side="inner")


@pytest.mark.parametrize(
    "options",
    [{"clearance": -1}, {"slack": 0}, {"slack": -1}, {"side": "both"}, {"clearance": "x"}, {"threads": -1}],
)
def test_what_cannot_be_made(options: dict[str, Any]) -> None:
    with pytest.raises(its.OptionError):
        its.wrap(torus(), **options)
    with pytest.raises(its.OptionError):
        its.verify_cage(torus(), torus(), side="above")
