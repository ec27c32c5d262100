"""Options as the library takes them."""

from __future__ import annotations

import re
from typing import Any

from ._errors import OptionError

_units = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}


def bytes_of(size: int | str | None) -> int | None:
    """Bytes of a number or of text such as "800M" or "2G"."""
    if size is None or isinstance(size, int):
        return size
    found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*([KMGT]?)B?\s*", size, re.IGNORECASE)
    if not found:
        raise OptionError(f"max_memory {size!r}: bytes are needed, such as 800_000_000 or '800M'")
    return int(float(found[1]) * _units[found[2].upper()])


def given(**options: Any) -> dict[str, Any]:
    """Those that are not None: all others keep the library's defaults."""
    return {name: value for name, value in options.items() if value is not None}
