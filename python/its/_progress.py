"""Progress of long calls: a bar, or a function of the caller."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Protocol, TypeAlias

#: True: a bar on standard error. A function of stage and fraction: called some twenty times a second, on the
#: thread that made the call; when it returns False the call stops and raises Cancelled.
ProgressLike: TypeAlias = "bool | Callable[[str, float], bool | None] | None"


class _Observer(Protocol):
    def __call__(self, stage: str, fraction: float, /) -> bool: ...


class _Bar:
    """A line that is drawn anew; nothing unless standard error is a terminal or a notebook."""

    def __init__(self) -> None:
        self._start = time.monotonic()

    def __call__(self, stage: str, fraction: float, /) -> bool:
        seconds = time.monotonic() - self._start
        done = int(30 * fraction)
        end = "\n" if fraction >= 1 else ""
        bar = "█" * done + "░" * (30 - done)
        sys.stderr.write(f"\r{stage[:24]:24} {bar} {100 * fraction:3.0f} % {seconds:6.1f} s{end}")
        sys.stderr.flush()
        return True


def observer(progress: ProgressLike) -> _Observer | None:
    """What the library calls; None where nobody wants to know."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return _Bar()
    function = progress

    def call(stage: str, fraction: float, /) -> bool:
        return function(stage, fraction) is not False

    return call
