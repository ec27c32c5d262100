"""Surfaces at a proven distance from a mesh."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

from . import _its
from ._errors import OptionError
from ._html import table
from ._mesh import Mesh, MeshLike, as_arrays, say_rounding
from ._progress import ProgressLike, observer
from ._reports import Check
from ._sizes import bytes_of, given, number


@dataclass(eq=False, repr=False)
class Wrap(Mesh):
    """Closed, 2-manifold, without self-intersections, disjoint from the mesh that it is around or inside."""

    #: Proven, mesh units: lowest ≤ distance to the mesh ≤ highest for every point of it.
    lowest: float = 0.0
    highest: float = 0.0
    report: dict[str, Any] = field(default_factory=dict)

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """Writes a file, as :func:`its.write`. A LossWarning where its format rounds what was proven.

        With ``single=True`` the wrap's coordinates have 32 bits, and are proven so.
        """
        return say_rounding(self, path, super().save(path))

    def _rows(self) -> dict[str, object]:
        return {**super()._rows(), "nearest, proven": self.lowest, "farthest, proven": self.highest}


def wrap(
    mesh: MeshLike,
    faces: Any = None,
    *,
    clearance: float = 0.0,
    slack: float | None = None,
    side: str = "outer",
    single: bool = False,
    measure: bool = False,
    max_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Wrap:
    """A surface around a mesh, or inside it, no nearer to it than ``clearance`` and no farther than slack more.

    A mesh without an inside is wrapped around both sides of its sheets. A wrap with clearance 0 follows them as
    nearly as the slack says, through every hole, and is large: give a clearance, or more slack.

    :param clearance: mesh units; 0: as tight as the slack
    :param slack: mesh units; default: 2 % of the clearance or 0.1 % of the longest side, whichever is larger
    :param side: "outer" or "inner"; inside, the mesh must be closed
    :param single: coordinates of 32 bits, as in .stl and .glb: what is proven holds for them
    :param measure: measure the distances too: ``to_mesh`` and ``from_mesh`` of the report
    :raises OptionError: also if the mesh is too thin for such an inner wrap, or has no inside
    :raises InputError, MemoryLimitError, Cancelled:
    """
    options = given(
        clearance=number("clearance", clearance),
        slack=None if slack is None else number("slack", slack),
        side=side,
        single=single,
        measure=measure,
        max_memory=bytes_of(max_memory),
    )
    if slack is not None and not options["slack"] > 0:
        raise OptionError(f"slack {slack}: must be more than 0")
    arrays, report = _its.wrap(*as_arrays(mesh, faces), options, threads, observer(progress))
    if report["empty"]:
        raise OptionError(f"the {side} wrap is empty: {report['reason']}")
    return Wrap(*arrays, lowest=report["lowest"], highest=report["highest"], report=report)


def offset(mesh: MeshLike, distance: float, *, faces: Any = None, **options: Any) -> Wrap:
    """The surface moved outwards by a distance, or inwards if it is negative: see :func:`wrap`.

    :param distance: mesh units; the result is no nearer than that to the mesh, and no farther than slack more
    :param options: those of :func:`wrap` but ``clearance`` and ``side``
    """
    length = number("distance", distance)
    return wrap(mesh, faces, clearance=abs(length), side="inner" if length < 0 else "outer", **options)


@dataclass(frozen=True)
class CageCheck:
    """What the independent check of a cage or wrap found. True where all checks passed."""

    passed: bool
    checks: list[Check]
    nearest: float  #: proven, mesh units: nearest ≤ distance to the mesh ≤ farthest for every point of the cage
    farthest: float
    cage_components: int
    mesh_components: int

    def __bool__(self) -> bool:
        return self.passed

    def _repr_html_(self) -> str:
        rows: dict[str, object] = {"nearest, proven": self.nearest, "farthest, proven": self.farthest}
        rows.update({c.name: f"{'passed' if c.passed else 'FAILED'}: {c.detail}" for c in self.checks})
        return table("Cage", rows)


def verify_cage(
    cage: MeshLike,
    mesh: MeshLike,
    *,
    side: str = "outer",
    clearance: float | None = None,
    distance: float | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> CageCheck:
    """Whether a surface, whoever made it, encloses a mesh, or lies within it: by exact predicates.

    Closed, 2-manifold, free of self-intersections, disjoint from the mesh, on its side of each part; and
    between which distances from the mesh it is, proven. No code is shared with what makes such surfaces.

    :param side: "outer": the cage is around the mesh; "inner": within it
    :param clearance: no point of the cage may be nearer to the mesh; mesh units
    :param distance: none may be farther
    """
    if side not in ("outer", "inner"):
        raise OptionError(f"side {side!r}: choose outer or inner")
    options = given(
        inner=side == "inner",
        clearance=None if clearance is None else number("clearance", clearance),
        distance=None if distance is None else number("distance", distance),
    )
    found = _its.verify_cage(*as_arrays(cage), *as_arrays(mesh), options, threads, observer(progress))
    checks = [Check(**check) for check in found.pop("checks")]
    return CageCheck(**found, checks=checks)
