"""What is known of meshes, simplifications and shells."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

from . import _its
from ._arrays import Floats, Indices
from ._errors import OptionError
from ._html import table
from ._mesh import Mesh, MeshLike, _corner_values, as_arrays, as_mesh, read
from ._progress import ProgressLike, observer
from ._sizes import bytes_of, given, number


@dataclass(frozen=True)
class WrongPart:
    """A closed part that faces the wrong way."""

    fault: str  #: "inside-out" or "like-its-container"
    triangles: int
    first_triangle: int
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    volume: float
    depth: int  #: parts that it lies in
    overlaps: bool


@dataclass(frozen=True)
class Parts:
    """The closed parts of a mesh."""

    closed: int
    nested: int
    overlapping: int
    to_turn: int
    wrong: list[WrongPart]


@dataclass(frozen=True)
class Report:
    """What is right and wrong with a mesh, and what its inside can mean."""

    vertices: int
    triangles: int
    degenerate: int
    duplicate: int
    boundary_edges: int
    nonmanifold_edges: int
    inconsistent_edges: int
    unbalanced_edges: int
    odd_edges: int
    open_edges: int
    open_odd_edges: int
    t_junctions: int
    components: int
    euler: int
    closed: bool
    oriented: bool
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    signed_volume: float
    sign: str  #: the rule that "auto" chooses
    sign_reason: str
    sign_advice: str
    turned: int
    repaired: int
    separating: float
    parts: Parts
    warnings: list[str] = field(default_factory=list)  #: of reading the file

    @property
    def watertight(self) -> bool:
        """Closed: no boundary edge but those that cancel at T-junctions."""
        return self.closed

    def to_dict(self) -> dict[str, Any]:
        """Of plain values, as for JSON."""
        return asdict(self)

    def _repr_html_(self) -> str:
        shown = {name: value for name, value in self.to_dict().items() if name not in ("parts", "bounds")}
        return table("Mesh", shown)


def check(mesh: MeshLike, faces: Any = None, *, threads: int = 0, progress: ProgressLike = None) -> Report:
    """Examines a mesh: defects, bounds, and the meaning of inside that would be chosen, and why.

    Dirty meshes are no error.

    :raises InputError: without triangles, or with coordinates that are not finite
    """
    warnings: list[str] = []
    if faces is None and isinstance(mesh, str | os.PathLike):
        mesh = read(mesh)
        warnings = mesh.warnings
    found = _its.check(*as_arrays(mesh, faces), threads, observer(progress))
    parts = found.pop("parts")
    wrong = [WrongPart(**part) for part in parts.pop("wrong")]
    return Report(**found, parts=Parts(**parts, wrong=wrong), warnings=warnings)


@dataclass(frozen=True, eq=False)
class Simplified:
    """A simplified mesh, and what is proven of it."""

    mesh: Mesh
    #: Proven for every point of either mesh: no farther than this from the other. None: nothing is proven.
    proven_bound: float | None
    stop: str  #: "faces-reached", "tolerance-reached", "shell-reached", "topology-reached"
    report: dict[str, Any]

    def _repr_html_(self) -> str:
        return table("Simplified", {"faces": len(self.mesh.faces), **self.report})


def simplify(
    mesh: MeshLike,
    faces_of_mesh: Any = None,
    /,
    *,
    tolerance: float | None = None,
    faces: int | None = None,
    ratio: float | None = None,
    method: str | None = None,
    thickness: float | None = None,
    depth: int | None = None,
    sign: str | None = None,
    gamma: float | None = None,
    self_intersections: bool = True,
    turn_parts: bool | None = None,
    attributes: bool = True,
    max_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Simplified:
    """Fewer triangles, with a proven bound on the error.

    :param tolerance: mesh units; no point of either mesh is farther than this from the other
    :param faces: stop at so many triangles, within the least tolerance found that allows so few
    :param ratio: the same as a share of the mesh's triangles, in (0, 1]
    :param method: "certified"; "vertex", "priority" and "qem" prove nothing about distances
    :param thickness: stay, besides, in the shell of this thickness, mesh units
    :param depth: the same with the shell of this depth
    :param self_intersections: False: the result has none, and the mesh must have none
    :param attributes: carry colours and texture coordinates over
    :raises InputError, OptionError, MemoryLimitError, Cancelled:
    """
    base = as_mesh(mesh, faces_of_mesh)
    if ratio is not None:
        if faces is not None or not 0 < ratio <= 1:
            raise OptionError("ratio: give a share in (0, 1], and not faces as well")
        faces = max(1, round(ratio * len(base.faces)))
    options = given(
        tolerance=None if tolerance is None else number("tolerance", tolerance),
        faces=faces,
        method=method,
        thickness=None if thickness is None else number("thickness", thickness),
        depth=depth,
        sign=_rule(sign),
        gamma=gamma,
        turn_parts=turn_parts,
        no_self_intersections=None if self_intersections else True,
        max_memory=bytes_of(max_memory),
    )
    arrays, values, report = _its.simplify(
        *as_arrays(base), base._attributes() if attributes else {}, options, threads, observer(progress)
    )
    vertices, triangles = arrays
    return Simplified(
        Mesh(vertices, triangles, **_corner_values(values)), report["proven_bound"], report["stop"], report
    )


def _rule(sign: str | None) -> str | None:
    return None if sign == "auto" else sign


class Closest(NamedTuple):
    """The points of a mesh nearest to query points; of those that are not finite: NaN, and face −1."""

    point: Floats
    distance: Floats  #: mesh units, ≥ 0
    face: Indices
    barycentric: Floats  #: of the face's three corners


class WindingNumber(NamedTuple):
    """Winding numbers, and how far from them the true ones are at most: 0 where they are whole and exact."""

    value: Floats
    error: Floats


@dataclass(frozen=True)
class Check:
    """One promise, checked."""

    name: str
    passed: bool
    complete: bool  #: all there is was tested, not a sample
    tested: int
    violations: int
    worst: float  #: smallest margin, mesh units; negative: by how much it failed
    detail: str


@dataclass(frozen=True)
class Verification:
    """What the independent verifier found. True where all checks passed."""

    passed: bool
    checks: list[Check]
    sampled_min: float
    sampled_max: float
    proven_min: float
    proven_max: float

    def __bool__(self) -> bool:
        return self.passed

    def _repr_html_(self) -> str:
        return table(
            "Verification", {c.name: f"{'passed' if c.passed else 'FAILED'}: {c.detail}" for c in self.checks}
        )


class MeshDistance(NamedTuple):
    """One-sided distances d(x, other mesh), measured at points of a mesh; mesh units."""

    max: float  #: a lower bound of the one-sided Hausdorff distance
    mean: float
    rms: float


def mesh_distance(
    mesh: MeshLike, to: MeshLike, *, samples: int = 200_000, threads: int = 0, progress: ProgressLike = None
) -> MeshDistance:
    """Measures how far ``mesh`` is from ``to``, with exact closest points at vertices and samples."""
    found = _its.mesh_distance(*as_arrays(mesh), *as_arrays(to), samples, threads, observer(progress))
    return MeshDistance(*found)


def weld(mesh: MeshLike, length: float, *, faces: Any = None) -> Mesh:
    """Corners that are nearer than ``length`` become one. Vertices and triangles keep their numbers."""
    arrays, _ = _its.weld(*as_arrays(mesh, faces), number("length", length))
    return Mesh(*arrays)
