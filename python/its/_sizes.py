"""Options as the library takes them."""

from __future__ import annotations

import os
import re
from operator import index
from typing import Any

from ._errors import FileError, OptionError

_units = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}


def bytes_of(size: int | str | None) -> int | None:
    """Bytes of a number or of text such as "800M" or "2G"."""
    if size is None or isinstance(size, int):
        return size
    found = isinstance(size, str) and re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([KMGT]?)B?\s*", size, re.IGNORECASE)
    if not found:
        raise OptionError(f"max_memory {size!r}: bytes are needed, such as 800_000_000 or '800M'")
    return int(float(found[1]) * _units[found[2].upper()])


def number(name: str, value: Any) -> float:
    """A real number that was given for an option."""
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise OptionError(f"{name} {value!r}: a number is needed") from error


def whole(name: str, value: Any) -> int:
    """A whole number that was given for an option."""
    try:
        return index(value)
    except TypeError as error:
        raise OptionError(f"{name} {value!r}: a whole number is needed") from error


def path_bytes(path: str | os.PathLike[str]) -> bytes:
    """A path as the system has it."""
    try:
        found = os.fsencode(path)
    except UnicodeEncodeError as error:
        raise FileError(f"{path!r}: no path on this system: {error}") from error
    if b"\0" in found:
        raise FileError(f"{path!r}: a path cannot have a character of code 0")
    return found


def given(**options: Any) -> dict[str, Any]:
    """Those that are not None: all others keep the library's defaults."""
    return {name: value for name, value in options.items() if value is not None}
