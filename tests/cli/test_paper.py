"""Tests of the `magfold paper` command."""

from pathlib import Path

import pytest

from magfold_bench.paper.run import PARTS
from tests.command_line import run


def test_a_table_is_reproduced(tmp_path: Path) -> None:
    result = run("paper", "--only", "table-1", "--quick", "--out", tmp_path, code=0)
    assert "Table 1 and Figure 6: energy minimisation" in result.stdout
    text = (tmp_path / "paper.html").read_text(encoding="utf-8")
    assert "S1C (LRLLR)" in text
    assert "Agrees by construction" in text


@pytest.mark.slow
def test_everything_is_reproduced(tmp_path: Path) -> None:
    run("paper", "--quick", "--out", tmp_path, code=0)
    text = (tmp_path / "paper.html").read_text(encoding="utf-8")
    for part in PARTS.values():
        assert part.title in text
        assert f"magfold paper --only {part.name}" in text
    assert text.count("data:image/png;base64,") == sum(1 for _ in tmp_path.glob("*.png"))
