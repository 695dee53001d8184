"""Parts of a benchmark as its command measures and writes them."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from typer.testing import CliRunner

from magfold_env.cli import app


def measuring(
    benchmark: str, temporary: pytest.TempPathFactory
) -> Callable[[str], tuple[Any, set[str]]]:
    """Return what measures a part, once, and returns it and its files' names."""
    pytest.importorskip("matplotlib.figure")

    @cache
    def measure(name: str) -> tuple[Any, set[str]]:
        out = temporary.mktemp(name) / "out"
        arguments = ["bench", benchmark, "--quick", "--only", name, "--out", str(out)]
        result = CliRunner().invoke(app.app, arguments)
        assert result.exit_code == 0, result.stderr
        data = json.loads((out / f"{benchmark}.json").read_text(encoding="utf-8"))
        return data["parts"][name], {path.name for path in out.iterdir()}

    return measure
