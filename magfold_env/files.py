"""Files: where shipped settings lie, writing that never leaves half a file, and reading back."""

import ast
import hashlib
import json
import os
import tempfile
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, cast

PACKAGE = Path(__file__).resolve().parent


def configs_dir() -> Path:
    """Return the folder of shipped settings.

    A wheel carries it inside the package, but for what only agents read; in a checkout it lies
    beside the package.
    """
    inside = PACKAGE / "configs"
    return inside if inside.is_dir() else PACKAGE.parent / "configs"


def pip_install(extra: str) -> str:
    """Return the command that installs an extra.

    In a checkout it names that: no package index has the package, and pip would ask one wherever
    the package is not installed.
    """
    inside = configs_dir().parent == PACKAGE
    return f"pip install 'magfold_env[{extra}]'" if inside else f"pip install -e '.[{extra}]'"


@cache
def physics_digest() -> str:
    """Return a hash of the sources on which it depends how a scene folds.

    Results that were kept are those of today's physics only if it is the same. What only readers
    see, docstrings and lines of comment, does not count.
    """
    return sources_digest("engine/**/*.py", "scene/*.py", "shapes.py", "simulation/*.py")


def sources_digest(*patterns: str, folder: Path | None = None) -> str:
    """Return a hash of the files that match `Path.glob` patterns in a folder, or in the package."""
    digest = hashlib.sha256()
    for pattern in patterns:
        for path in sorted((folder or PACKAGE).glob(pattern)):
            digest.update(path.name.encode())
            digest.update(_code(path.read_text(encoding="utf-8")).encode())
    return digest.hexdigest()[:16]


def _code(source: str) -> str:
    """Return the lines of a module but for docstrings, lines of comment and empty ones."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            first, last = node.lineno - 1, node.end_lineno or node.lineno
            # Not what stands on a line with something else.
            if isinstance(node.value.value, str) and not lines[first][: node.col_offset].strip():
                lines[first:last] = [""] * (last - first)
    return "\n".join(line for line in lines if line.strip() and not line.lstrip().startswith("#"))


def a_path(key: str, value: str | os.PathLike[str]) -> Path:
    """Return a path, or refuse what is none.

    Raises
    ------
    ValueError
        It names ``key``.
    """
    given = cast("object", value)
    if not isinstance(given, str | os.PathLike):
        raise ValueError(f"{key}: {given!r} is not allowed; must be a path")
    return Path(value)


@contextmanager
def replacing(path: str | Path) -> Generator[Path]:
    """Offer a temporary name beside `path` and move the file into place on success.

    Parameters
    ----------
    path
        Where the file shall be; its folder must exist. The temporary name keeps the suffix.

    Raises
    ------
    FileNotFoundError
        If the folder does not exist.
    OSError
        If it cannot be written; it names `path`.
    """
    path = a_path("path", path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: the folder {path.parent} does not exist")
    handle, name = tempfile.mkstemp(prefix=".", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes private files; give the result the mode that open() would have.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except OSError as error:
        if error.errno is not None:  # writing to a full disk tells no name
            error.filename = error.filename or str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` as UTF-8 to a temporary name and move it to `path`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: str | Path, data: Mapping[str, Any], listed: str) -> None:
    """Write a mapping as JSON, under a temporary name first; the list of one key comes last.

    Each entry of that list has a line.
    """
    lines = ",\n  ".join(json.dumps(each, allow_nan=False) for each in data[listed])
    rest = {key: value for key, value in data.items() if key != listed}
    head = json.dumps(rest, indent=1, allow_nan=False).removesuffix("\n}")
    write_text(path, f'{head},\n "{listed}": [\n  {lines}\n ]\n}}\n')


@contextmanager
def reading_json(path: str | Path, what: str, form: str) -> Generator[dict[str, Any]]:
    """Offer the content of a JSON file; whatever is wrong with it is told with its path.

    Parameters
    ----------
    path
        The file: an object whose key ``format`` is `form`.
    what
        What it holds, for messages: "a design".
    form
        Name and version of the format.

    Raises
    ------
    ValueError
        If the file is no such object, or if using it raises one, a `KeyError` or a `TypeError`.
    """
    path = a_path("path", path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(content, dict):
            raise TypeError("must be a mapping of keys")
        data = cast("dict[str, Any]", content)
        if data["format"] != form:
            raise ValueError(f"format: {data['format']!r} is not allowed; must be {form!r}")
        yield data
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: is not {what}; {error}") from None
