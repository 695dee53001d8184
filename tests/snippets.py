"""Python lines, commands and settings that the pages show to readers."""

import ast
import io
import os
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    [
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
        *(ROOT / "agents").glob("*.md"),
    ]
)
_PROGRAMS = ("magfold", "python", "pytest", "pip", "cp", "git", "sphinx-build", "twine", "source")
_RECORD = """
tell() { printf '%s\\0' "$@"; printf '\\n'; }
python() { if [ "$1" = -c ]; then "$PYTHON" "$@"; else tell python "$@"; fi; }
"""


class Statement(NamedTuple):
    """A statement on a page, and the output that its comment states."""

    code: str
    comment: str


def blocks(page: Path, language: str) -> list[str]:
    """Return a page's blocks of code in a language."""
    text = page.read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def statements(code: str) -> Iterator[Statement]:
    """Yield the statements of a block, each with the comment at its end or below it."""
    comments = {
        token.start[0]: token.string.lstrip("# ")
        for token in tokenize.generate_tokens(io.StringIO(code).readline)
        if token.type == tokenize.COMMENT
    }
    for each in ast.parse(code).body:
        assert each.end_lineno is not None
        below = comments.get(each.end_lineno + 1, "")
        yield Statement(ast.unparse(each), comments.get(each.end_lineno, below))


def commands(shell: str) -> list[list[str]]:
    """Return the words of every command of a block, with loops and variables expanded.

    Bash itself parses the block, with functions in place of the programs.
    """
    stubs = "".join(f'{name}() {{ tell {name} "$@"; }}\n' for name in _PROGRAMS if name != "python")
    paths = re.sub(r"(?<!\S)\.venv/bin/", "", shell)
    paths = re.sub(r"(?<!\S)(\.ci/\w+)", r"tell \1", paths).replace("python3 ", "python ")
    told = subprocess.run(
        ["bash", "-ec", _RECORD + stubs + paths], env={**os.environ, "PYTHON": sys.executable},
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    return [line.rstrip("\0").split("\0") for line in told.splitlines()]


def commands_in_sentences(page: Path) -> list[str]:
    """Return the commands in the sentences and tables of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    found = re.findall(r"`((?:magfold|python -m|pytest|\.ci/\w+) [^`]*)`", text)
    return [" ".join(each.split()) for each in found]
