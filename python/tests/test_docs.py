"""Every example of docs/python runs, page by page."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import its
from conftest import torus
from its import _its

DOCS = Path(__file__).parents[2] / "docs" / "python"


def _examples(page: Path) -> list[str]:
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    return re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.iterdir()))
def test_examples_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    its.write("model.stl", torus())
    Path("models").mkdir()
    if page.endswith(".ipynb") and not _its.has_page:
        pytest.skip("it shows a page, and the package was built without")
    names: dict[str, Any] = {}
    examples = _examples(DOCS / page)
    assert examples
    for example in examples:
        exec(compile(example, page, "exec"), names)
