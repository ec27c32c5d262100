"""Questions about points: any type, shape, order and stride gives the answers of float64 in C order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

import its
from conftest import cube, torus
from its._arrays import Floats, as_faces, as_points, as_vertices

QUESTIONS = ["classify", "contains", "signed_distance", "value", "gradient", "distance_bounds"]
ROW = {"gradient": (3,), "distance_bounds": (2,)}


def ask(shell: its.Shell, question: str) -> Callable[..., Any]:
    function: Callable[..., Any] = getattr(shell, question)
    return function


def test_sides_of_a_cube(box: its.Shell) -> None:
    asked: list[list[float]] = [
        [0.5, 0.5, 0.5],
        [0, 0.5, 0.5],
        [0, 0, 0],
        [1.5, 0.5, 0.5],
        [np.nan, 0, 0],
        [0, np.inf, 0],
    ]
    assert box.classify(asked).tolist() == [-1, 0, 0, 1, 2, 2]
    assert box.contains(asked).tolist() == [True, True, True, False, False, False]
    assert box.contains(asked, boundary=False).tolist() == [True, False, False, False, False, False]
    for point, code in zip(asked, [-1, 0, 0, 1, 2, 2], strict=True):
        assert box.classify(point) == code
        assert box.classify(tuple(float(x) for x in point)) == code
        assert its.Side(int(box.classify(np.array(point, float)))) == code
        for boundary in (False, True):
            assert box.contains(np.array(point, float), boundary=boundary) == (code < boundary)


def test_distances_of_a_cube(box: its.Shell) -> None:
    asked = np.array([[0.5, 0.5, 0.25], [2, 0.5, 0.5], [0.5, 0.5, 1], [2, 2, 0.5]])
    np.testing.assert_allclose(box(asked), [-0.25, 1, 0, np.sqrt(2)], rtol=0, atol=1e-15)
    assert np.isnan(box([np.nan, 0, 0]))
    found = box.closest(asked)
    np.testing.assert_allclose(found.point, [[0.5, 0.5, 0], [1, 0.5, 0.5], [0.5, 0.5, 1], [1, 1, 0.5]])
    corners = box.mesh.vertices[box.mesh.faces[found.face]]
    np.testing.assert_allclose(np.einsum("nk,nkc->nc", found.barycentric, corners), found.point, atol=1e-15)
    assert box.closest([np.inf, 0, 0]).face == -1


def test_sides_are_those_of_a_torus(ring: its.Shell, points: Floats) -> None:
    # The mesh's chords are within 0.4 (1 - cos(π/24)) + 1.4 (1 - cos(π/48)) of the torus.
    exact = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1, points[:, 2]) - 0.4
    clear = np.abs(exact) > 0.4 * (1 - np.cos(np.pi / 24)) + 1.4 * (1 - np.cos(np.pi / 48))
    assert clear.mean() > 0.95
    np.testing.assert_array_equal(ring.classify(points)[clear], np.sign(exact[clear]))


def test_side_is_the_sign_of_the_distance(ring: its.Shell, points: Floats) -> None:
    np.testing.assert_array_equal(np.sign(ring.signed_distance(points)), ring.classify(points))


def test_bounds_hold_the_distance(ring: its.Shell, points: Floats) -> None:
    bounds, distance = ring.distance_bounds(points), ring(points)
    assert (bounds[:, 0] <= distance).all()
    assert (distance <= bounds[:, 1]).all()


@pytest.mark.parametrize("question", QUESTIONS)
def test_batches_are_single_answers(ring: its.Shell, points: Floats, question: str) -> None:
    function = ask(ring, question)
    batch = function(points[:50])
    for point, answer in zip(points, batch[:50], strict=False):
        np.testing.assert_array_equal(function(point), answer)
        np.testing.assert_array_equal(function(point.tolist()), answer)
        np.testing.assert_array_equal(function(tuple(point.tolist())), answer)
        assert np.shape(function(point)) == ROW.get(question, ())


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("shape", [(3,), (0, 3), (1, 3), (4, 3), (2, 0, 3), (2, 3, 3), (2, 1, 2, 3)])
def test_shapes(ring: its.Shell, question: str, shape: tuple[int, ...]) -> None:
    given = np.random.default_rng(2).uniform(-1, 1, shape)
    answer = ask(ring, question)(given)
    assert np.shape(answer) == shape[:-1] + ROW.get(question, ())
    flat = ask(ring, question)(given.reshape(-1, 3))
    np.testing.assert_array_equal(np.reshape(answer, flat.shape), flat)


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", ">f4", ">f8", "i1", "i4", "<i8", "u1", ">u2", "?", "g"])
def test_types(ring: its.Shell, question: str, dtype: str) -> None:
    given = np.random.default_rng(3).uniform(0, 2, (100, 3)).astype(dtype)
    np.testing.assert_array_equal(ask(ring, question)(given), ask(ring, question)(given.astype(np.float64)))


@pytest.mark.parametrize("question", QUESTIONS)
def test_layouts(ring: its.Shell, points: Floats, question: str) -> None:
    expected = ask(ring, question)(points)
    wide = np.zeros((len(points), 7))
    wide[:, 1:7:2] = points
    packed = np.zeros(len(points), np.dtype([("tag", "u1"), ("at", "<f8", 3)]))  # unaligned
    packed["at"] = points
    frozen = points.copy()
    frozen.flags.writeable = False
    for given in (np.asfortranarray(points), wide[:, 1:7:2], points[::-1][::-1], packed["at"], frozen):
        np.testing.assert_array_equal(ask(ring, question)(given), expected)
    np.testing.assert_array_equal(ask(ring, question)(points[::-1]), expected[::-1])
    np.testing.assert_array_equal(ask(ring, question)(points.tolist()), expected)
    np.testing.assert_array_equal(ask(ring, question)(memoryview(points)), expected)  # type: ignore[arg-type]


class OnlyDLPack:
    """What has nothing but the protocol."""

    def __init__(self, array: Floats) -> None:
        self._array = array

    def __dlpack__(self, **options: Any) -> Any:
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self) -> Any:
        return self._array.__dlpack_device__()


def test_dlpack(ring: its.Shell, points: Floats) -> None:
    np.testing.assert_array_equal(ring.classify(OnlyDLPack(points)), ring.classify(points))


def test_torch(ring: its.Shell, points: Floats) -> None:
    torch = pytest.importorskip("torch")
    for tensor in (
        torch.tensor(points),
        torch.tensor(points, requires_grad=True),
        torch.tensor(points).T.clone().T,
    ):
        np.testing.assert_array_equal(ring.classify(tensor), ring.classify(points))


@pytest.mark.parametrize("question", ["classify", "signed_distance", "value", "gradient", "distance_bounds"])
def test_out(ring: its.Shell, points: Floats, question: str) -> None:
    expected = ask(ring, question)(points)
    out = np.empty_like(expected)
    assert ask(ring, question)(points, out=out) is out
    np.testing.assert_array_equal(out, expected)
    for bad in (
        np.empty_like(expected)[:-1],
        expected.astype(np.float32),
        np.empty((2 * len(points), *expected.shape[1:]), expected.dtype)[::2],
    ):
        with pytest.raises(its.OptionError, match="out: a writable array"):
            ask(ring, question)(points, out=bad)
    out.flags.writeable = False
    with pytest.raises(its.OptionError):
        ask(ring, question)(points, out=out)


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize(
    "bad",
    [[1, 2], [[1, 2]], 5, "abc", [[1j, 0, 0]], [[None, 0, 0]], np.zeros((3, 4)), [[1, 2, 3], [1, 2]], None],
)
def test_what_is_no_point(ring: its.Shell, question: str, bad: Any) -> None:
    with pytest.raises(its.InputError):
        ask(ring, question)(bad)


def test_masked_points(ring: its.Shell, points: Floats) -> None:
    masked = np.ma.masked_array(points)
    np.testing.assert_array_equal(ring.classify(masked), ring.classify(points))
    masked[3, 1] = np.ma.masked
    with pytest.raises(its.InputError, match="masked"):
        ring.classify(masked)


class InAnotherDevice(OnlyDLPack):
    """As a tensor in a GPU's memory behaves."""

    def __dlpack__(self, **options: Any) -> Any:
        raise BufferError("not in the processor's memory")


def test_what_numpy_cannot_have(ring: its.Shell, points: Floats) -> None:
    with pytest.raises(its.InputError, match="processor's memory"):
        ring.classify(InAnotherDevice(points))
    with pytest.raises(its.OptionError, match="numpy array"):
        ring.value(points, out=[0.0] * len(points))  # type: ignore[arg-type]


def test_value_and_gradient_are_the_two_calls(ring: its.Shell, points: Floats) -> None:
    value, gradient = ring.value_and_gradient(points)
    np.testing.assert_array_equal(value, ring.value(points))
    np.testing.assert_array_equal(gradient, ring.gradient(points))
    value, gradient = ring.value_and_gradient(points[0])
    assert value == ring.value(points[0])
    np.testing.assert_array_equal(gradient, ring.gradient(points[0]))


@pytest.mark.parametrize("question", QUESTIONS)
def test_threads_do_not_matter(ring: its.Shell, question: str) -> None:
    many = np.random.default_rng(4).uniform(-1.6, 1.6, (300_000 if question == "classify" else 30_000, 3))
    np.testing.assert_array_equal(ask(ring, question)(many, threads=1), ask(ring, question)(many, threads=2))
    with pytest.raises(its.OptionError):
        ask(ring, question)(many, threads=-1)


def test_winding_numbers(ring: its.Shell, points: Floats) -> None:
    number = ring.winding_number(points)
    np.testing.assert_array_equal(number.value, ring.contains(points))
    assert (number.error == 0).all()
    assert ring.winding_number(points[0]).value == number.value[0]
    vertices, faces = cube()
    twice = its.build(vertices, np.concatenate([faces, faces]), depth=3, sign="winding")
    assert twice.winding_number([0.3, 0.4, 0.5]).value == 2


def test_uncertain_sides() -> None:
    # A cube without its top: from a point of the opening, that takes half of all directions.
    vertices, faces = cube()
    shell = its.build(vertices, faces[:-2], depth=4)
    assert shell.sign == "generalized"
    number = shell.winding_number([0.5, 0.5, 0.7])
    opening = 4 * np.arctan(0.25 / (0.3 * np.sqrt(0.3**2 + 0.5)))  # the solid angle
    assert number.value == pytest.approx(1 - opening / (4 * np.pi), abs=1e-9)
    assert 0 < number.error < 1e-9
    asked = [[0.5, 0.5, 1], [0.25, 0.7, 1], [0.5, 0.5, 0.7], [0.5, 0.5, 2]]
    assert shell.classify(asked).tolist() == [3, 3, -1, 1]
    assert shell.classify(asked[0]) == its.Side.UNCERTAIN
    assert np.isnan(shell(asked)).tolist() == [True, True, False, False]
    for points in (asked, asked[0]):
        with pytest.raises(its.OptionError, match="uncertain"):
            shell.contains(points)
    for uncertain in (False, True):
        assert shell.contains(asked, uncertain=uncertain).tolist() == [uncertain, uncertain, True, False]
        assert shell.contains(asked[0], uncertain=uncertain) == uncertain
    assert shell.contains(asked[2])


angles = st.floats(0, 2 * np.pi)
shift = st.floats(-50, 50)
anything = st.floats(allow_nan=True, allow_infinity=True)


@hypothesis.settings(max_examples=15, deadline=None)
@hypothesis.given(angles, angles, st.tuples(shift, shift, shift))
def test_sides_move_with_the_mesh(a: float, b: float, shift: tuple[float, float, float]) -> None:
    vertices, faces = torus(16, 8)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    turn = turn @ np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    still = its.build(vertices, faces, depth=4)
    moved = its.build(vertices @ turn.T + shift, faces, depth=4)
    asked = np.random.default_rng(5).uniform(-1.6, 1.6, (500, 3))
    clear = np.abs(still(asked)) > 1e-9
    np.testing.assert_array_equal(moved.contains(asked @ turn.T + shift)[clear], still.contains(asked)[clear])


@hypothesis.settings(max_examples=50, deadline=None)
@hypothesis.given(
    st.lists(st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 3), min_size=1, max_size=20)
)
def test_any_number_at_all(asked: list[tuple[float, float, float]]) -> None:
    shell = SMALL
    codes = shell.classify(asked)
    finite = np.isfinite(asked).all(axis=1)
    np.testing.assert_array_equal(codes == its.Side.NOT_FINITE, ~finite)
    with np.errstate(all="ignore"):
        distance = shell(asked)
    np.testing.assert_array_equal(np.isnan(distance), ~finite)
    np.testing.assert_array_equal(np.sign(distance[finite]), codes[finite])


SMALL = its.build(*cube(), depth=3)


def test_nothing_is_copied_that_need_not_be(points: Floats) -> None:
    batch = np.zeros((4, 5, 3))
    for given in (points, batch, points[10:20]):
        assert np.shares_memory(as_points(given)[0], given)
    vertices, faces = torus()
    for v in (vertices, vertices.astype(np.float32), vertices[::2], np.asfortranarray(vertices)):
        assert np.shares_memory(as_vertices(v), v)
    for dtype in ("i2", "u2", "i4", "u4", "i8", "u8"):
        given = faces.astype(dtype)
        assert np.shares_memory(as_faces(given), given)
    shell = its.build(vertices, faces, depth=3)
    assert np.shares_memory(shell.mesh.vertices, shell.mesh.vertices)
