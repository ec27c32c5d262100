"""Meshes that all tests share."""

from __future__ import annotations

import numpy as np
import pytest

import its
from its._arrays import Array, Floats


def cube() -> tuple[Floats, Array]:
    """The unit cube, facing outward."""
    vertices = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return vertices, np.array(faces)


def torus(around: int = 48, across: int = 24) -> tuple[Floats, Array]:
    """Of radii 1 and 0.4, around z."""
    u, v = np.meshgrid(
        np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij"
    )
    r = 1 + 0.4 * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), 0.4 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (x.reshape(-1) for x in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


@pytest.fixture(scope="session")
def box() -> its.Shell:
    """The shell of the unit cube."""
    return its.build(*cube(), depth=5)


@pytest.fixture(scope="session")
def ring() -> its.Shell:
    """The shell of a torus."""
    return its.build(*torus(), depth=6)


@pytest.fixture(scope="session")
def points() -> Floats:
    """Uniform around the torus."""
    return np.random.default_rng(1).uniform(-1.6, 1.6, (2000, 3))
