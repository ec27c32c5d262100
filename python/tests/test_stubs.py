"""The types that users see: complete, documented, and changed only on purpose."""

from __future__ import annotations

import importlib.metadata
import inspect
import os
import re
import types
from importlib import resources
from pathlib import Path

import its

API = Path(__file__).with_name("api.txt")


def _signatures() -> str:
    """One line for each public name and member."""
    lines = []
    for name in its.__all__:
        thing = getattr(its, name)
        if inspect.isclass(thing):
            lines.append(f"class {name}({', '.join(base.__name__ for base in thing.__bases__)})")
            for key, member in sorted(vars(thing).items()):
                if isinstance(member, types.FunctionType) and (not key.startswith("_") or key == "__call__"):
                    lines.append(f"    {key}{inspect.signature(member)}")
                elif isinstance(member, property):
                    assert member.fget is not None
                    lines.append(f"    {key}: {inspect.signature(member.fget).return_annotation}")
        elif inspect.isfunction(thing):
            lines.append(f"{name}{inspect.signature(thing)}")
        else:
            lines.append(name)
    return "\n".join(lines) + "\n"


def test_the_interface_is_what_is_written_down() -> None:
    """ITS_UPDATE=1 pytest python/tests/test_stubs.py writes it anew: then look at the difference."""
    now = _signatures()
    if os.environ.get("ITS_UPDATE"):
        API.write_text(now, encoding="utf-8")
    assert now == API.read_text(encoding="utf-8")


def test_everything_is_documented() -> None:
    for name in its.__all__:
        thing = getattr(its, name)
        if not inspect.isclass(thing) and not inspect.isfunction(thing):
            continue
        assert thing.__doc__, name
        if inspect.isclass(thing):
            for key, member in vars(thing).items():
                if not key.startswith("_") and isinstance(member, types.FunctionType | property):
                    assert member.__doc__, f"{name}.{key}"


def test_types_are_installed() -> None:
    assert resources.files("its").joinpath("py.typed").is_file()
    stub = resources.files("its").joinpath("_its.pyi").read_text(encoding="utf-8")
    assert "arg0" not in stub
    assert "class Shell" in stub


def test_version() -> None:
    assert its.__version__ == importlib.metadata.version("implicit-thin-shell")
    assert re.fullmatch(r"\d+\.\d+\.\d+", its.__version__)
