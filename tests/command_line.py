"""Functions that run `magfold` in this process, read its output, and start Python."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from typer.testing import CliRunner, Result

from magfold_env.cli import app


def run(*arguments: object, code: int | None = None) -> Result:
    """Run the command, which must end with the exit code if one is given."""
    result = CliRunner().invoke(app.app, [str(argument) for argument in arguments])
    assert code in (None, result.exit_code), result.output
    return result


def python(
    *arguments: object, check: bool = True, cwd: Any = None, **env: Any
) -> subprocess.CompletedProcess[str]:
    """Run Python with the search path of this process and a changed environment."""
    command = [sys.executable, *map(str, arguments)]
    surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **env}
    return subprocess.run(
        command, env=surroundings, cwd=cwd, check=check, capture_output=True, text=True
    )


def interrupt_import(module: str, folder: Path) -> None:
    """Make Python, with ``folder`` on its path, receive Ctrl-C when it imports ``module``."""
    (folder / "sitecustomize.py").write_text(f"""
import sys

class Interrupts:
    def find_spec(self, name, *_):
        if name == "{module}":
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupts())
""")


def rows(text: str) -> list[list[str]]:
    """Return the cells of the tables' rows, without headings."""
    lines = (line for line in text.splitlines() if line.startswith("│"))
    return [[cell.strip() for cell in line.strip("│").split("│")] for line in lines]


def fails_in_one_line(result: Result, *parts: str) -> None:
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr
    for part in ("error: ", *parts):
        assert part in result.stderr
