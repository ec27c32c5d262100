"""Results as tables of HTML, for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape


def text(value: object) -> str:
    """A value as a person reads it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)


def table(title: str, rows: Mapping[str, object]) -> str:
    """One row for each entry."""
    body = "".join(
        f"<tr><th style='text-align:left'>{escape(name)}</th>"
        f"<td style='text-align:left'>{escape(text(value))}</td></tr>"
        for name, value in rows.items()
    )
    return f"<table><caption style='text-align:left'>{escape(title)}</caption>{body}</table>"
