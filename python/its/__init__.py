"""Implicit thin shells of triangle meshes: exact inside and outside, distances, proven surfaces.

Install the distribution ``implicit-thin-shell``; the package is ``its``. Negative is inside.

>>> import its
>>> shell = its.build("model.stl")
>>> shell.contains([[0, 0, 0], [9, 9, 9]])
"""

from ._batch import BatchReport, BuildJob, Done, batch
from ._errors import (
    Cancelled,
    Error,
    FileError,
    FileWarning,
    InputError,
    LossWarning,
    MemoryLimitError,
    NotCertified,
    NotReached,
    NotReachedWarning,
    OptionError,
)
from ._its import version as __version__
from ._mesh import CornerValues, Mesh, MeshLike, Surface, as_mesh, read, write
from ._reports import (
    Check,
    Closest,
    MeshDistance,
    Parts,
    Report,
    Simplified,
    Verification,
    WindingNumber,
    WrongPart,
    check,
    mesh_distance,
    simplify,
    weld,
)
from ._shell import Page, Shell, Side, build, from_bytes, load
from ._wrap import CageCheck, Wrap, offset, verify_cage, wrap

__all__ = [
    "BatchReport",
    "BuildJob",
    "CageCheck",
    "Cancelled",
    "Check",
    "Closest",
    "CornerValues",
    "Done",
    "Error",
    "FileError",
    "FileWarning",
    "InputError",
    "LossWarning",
    "MemoryLimitError",
    "Mesh",
    "MeshDistance",
    "MeshLike",
    "NotCertified",
    "NotReached",
    "NotReachedWarning",
    "OptionError",
    "Page",
    "Parts",
    "Report",
    "Shell",
    "Side",
    "Simplified",
    "Surface",
    "Verification",
    "WindingNumber",
    "Wrap",
    "WrongPart",
    "__version__",
    "as_mesh",
    "batch",
    "build",
    "check",
    "from_bytes",
    "load",
    "mesh_distance",
    "offset",
    "read",
    "simplify",
    "verify_cage",
    "weld",
    "wrap",
    "write",
]
