"""The folder of shipped settings, hashes of sources, and functions that read and write files."""

import ast
import hashlib
import json
import os
import reprlib
import uuid
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, cast

PACKAGE = Path(__file__).resolve().parent


def configs_dir() -> Path:
    """Return the folder of shipped settings.

    In a wheel, it is inside the package and lacks the settings of agents. In a checkout, it is
    beside the package.
    """
    inside = PACKAGE / "configs"
    return inside if inside.is_dir() else PACKAGE.parent / "configs"


def pip_install(extra: str) -> str:
    """Return the command that installs an extra.

    In a checkout, the command installs from the checkout, because no index has the package.
    """
    inside = configs_dir().parent == PACKAGE
    return f"pip install 'magfold_env[{extra}]'" if inside else f"pip install -e '.[{extra}]'"


@cache
def physics_digest() -> str:
    """Return a hash of the sources that determine how a scene folds.

    Stored results belong to the current physics only if their hash equals this one. The hash does
    not depend on docstrings and comment lines.
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
    """Return the lines of a module without docstrings, comment lines and empty lines."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            first, last = node.lineno - 1, node.end_lineno or node.lineno
            # Only strings that share no line with other code.
            if isinstance(node.value.value, str) and not lines[first][: node.col_offset].strip():
                lines[first:last] = [""] * (last - first)
    return "\n".join(line for line in lines if line.strip() and not line.lstrip().startswith("#"))


def a_path(key: str, value: str | os.PathLike[str]) -> Path:
    """Return a value as a path; if it is not a path, raise a ValueError that names ``key``."""
    with suppress(TypeError, UnicodeError):
        if (name := os.fsencode(value)) and b"\0" not in name:
            return Path(value)
    raise ValueError(f"{key}: {reprlib.repr(value)} is not allowed; must be a path")


def read_text(path: Path, most: int = 1 << 40) -> str:
    """Return the text of a file; refuse folders, devices and files of more than `most` bytes."""
    if path.exists() and not path.is_file():
        raise ValueError("a folder or device is not allowed; must be a file")
    if (size := path.stat().st_size) > most:
        raise ValueError(f"{size} bytes are not allowed; must be at most {most}")
    return path.read_text(encoding="utf-8")


@contextmanager
def replacing(path: str | Path) -> Generator[Path]:
    """Yield the path of a temporary file beside `path`, and move this file to `path` on success.

    The folder must exist. The temporary file has the suffix of `path`. An OSError names `path`. A
    device, such as ``/dev/stdout``, is written to and not replaced.
    """
    path = a_path("path", path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: the folder {path.parent} does not exist")
    replaced = path.is_file() or not path.exists()
    name = path.with_name(f".{uuid.uuid4().hex[:16]}{path.suffix}") if replaced else path
    try:
        if replaced:
            name.touch(exist_ok=False)
        yield name
        if replaced:
            with name.open("rb+") as written:
                os.fsync(written.fileno())  # otherwise a power cut could leave an empty file
            name.replace(path)
    except OSError as error:
        named = error.filename, error.filename2
        # An error on a full disk has no file name.
        if error.errno is not None and (named == (None, None) or str(name) in map(str, named)):
            raise OSError(error.errno, error.strerror, str(path)) from None
        raise
    finally:
        if replaced:
            name.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` as UTF-8 to `path`, through a temporary file."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: str | Path, data: Mapping[str, Any], listed: str) -> None:
    """Write a mapping as JSON through a temporary file, with the list ``data[listed]`` last."""
    lines = ",\n  ".join(json.dumps(each, allow_nan=False) for each in data[listed])
    rest = {key: value for key, value in data.items() if key != listed}
    head = json.dumps(rest, indent=1, allow_nan=False).removesuffix("\n}")
    write_text(path, f'{head},\n "{listed}": [\n  {lines}\n ]\n}}\n')


@contextmanager
def reading_json(path: str | Path, what: str, form: str) -> Generator[dict[str, Any]]:
    """Yield the content of a JSON file: an object whose key ``format`` has the value `form`.

    If the file is not such an object, or its use raises a ValueError, KeyError or TypeError, a
    ValueError names the path and ``what`` was expected, such as "a design".
    """
    path = a_path("path", path)
    try:
        content = json.loads(read_text(path))
        if not isinstance(content, dict):
            raise TypeError("must be a mapping of keys")
        data = cast("dict[str, Any]", content)
        if (given := data["format"]) != form:
            raise ValueError(f"format: {reprlib.repr(given)} is not allowed; must be {form!r}")
        yield data
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: is not {what}; {error}") from None
