"""Every example of docs/python runs, page by page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import its
from conftest import torus

DOCS = Path(__file__).parents[2] / "docs" / "python"


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.glob("*.md")))
def test_examples_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    its.write("model.stl", torus())
    names: dict[str, Any] = {}
    examples = re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), re.M | re.S)
    assert examples
    for example in examples:
        exec(compile(example, page, "exec"), names)
