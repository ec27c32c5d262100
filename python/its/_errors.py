"""Errors: each is an :class:`Error`, and also the built-in exception that fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._mesh import Surface
    from ._shell import Shell


class Error(Exception):
    """Base of all errors of this package. The message says what is wrong, where, and what to do."""


class InputError(Error, ValueError):
    """A mesh, array or file whose content cannot be used."""


class OptionError(Error, ValueError):
    """An option outside its range, or options that contradict each other."""


class FileError(Error, OSError):
    """A file that cannot be opened, read or written."""


class MemoryLimitError(Error, MemoryError):
    """The call needs more memory than it may take; raised before the memory is taken."""


class Cancelled(Error):  # noqa: N818
    """The progress callback asked to stop."""


class NotCertified(Error):  # noqa: N818
    """A surface could not be proven to be what was asked for. It is in ``surface`` all the same."""

    def __init__(self, message: str, surface: Surface) -> None:
        super().__init__(message)
        self.surface = surface


class NotReached(Error):  # noqa: N818
    """With ``strict``: the shell is thicker than was asked for. It is in ``shell`` all the same."""

    def __init__(self, message: str, shell: Shell) -> None:
        super().__init__(message)
        self.shell = shell


class LossWarning(UserWarning):
    """Something of a mesh could not be handed to another package."""


class FileWarning(UserWarning):
    """Something of a mesh's file was left out or mended. Of :func:`its.read` it is in ``warnings`` instead."""


class NotReachedWarning(UserWarning):
    """Without ``strict``: the shell is thicker than was asked for."""
