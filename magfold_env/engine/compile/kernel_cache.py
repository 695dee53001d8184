"""The cache of compiled kernels on disk: its file names, and how long files are kept.

Numba's own cache notices edits in a kernel's file, but not in functions that the kernel calls or in
constants, which are compiled into it. A file's name is therefore a hash of the kernel's code, the
global values that it uses, and the kernels that it calls, at any depth: after an edit, only kernels
that contain the edited code are compiled again. Each version of numba, Python and `engine.compile`
has its own directory. A wheel may bring such directories, with code for the common x86-64
processors (`.ci/kernels` makes them): a kernel that a user has not compiled is loaded from there.
"""

import hashlib
import os
import sys
import time
import uuid
from contextlib import suppress
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, cast

import numba
import numpy as np
import platformdirs
from numpy.typing import NDArray

PACKAGE = "magfold_env"
FOLDER = Path(__file__).parents[2]
V3 = """
+avx +avx2 +bmi +bmi2 +cx16 +f16c +fma +lzcnt +movbe +popcnt +sahf +sse3 +sse4.1 +sse4.2 +ssse3
+xsave
"""  # what LLVM calls the parts of x86-64-v3
KEPT = 30.0 * 24.0 * 3600.0  # [s] kernels unused for longer are removed


# --- what a kernel is compiled from --------------------------------------------------------


@cache
def fingerprint(kernel: Any) -> str:
    """Return a hash of everything that a kernel is compiled from, except its arguments' types."""
    found: dict[Any, str] = {}
    left = [kernel]
    while left:
        each = left.pop()
        if each not in found:
            found[each], called = _made_of(each)
            left += called
    return _short_hash("\n".join(found.values()).encode())


@cache
def _made_of(kernel: Any) -> tuple[str, tuple[Any, ...]]:
    """Return a text that describes a kernel's own code, and the functions that it may call."""
    function = kernel.py_func
    called: dict[Any, None] = {}
    cells = [each.cell_contents for each in function.__closure__ or ()]
    names = _names(function.__code__)
    values = {name: function.__globals__[name] for name in names if name in function.__globals__}
    parts = (kernel.targetoptions, function.__defaults__, function.__code__, *cells)
    texts = [_described(each, names, called) for each in (kernel, *parts, *values.values())]
    return "\n".join(texts), tuple(called)


def _names(code: CodeType) -> tuple[str, ...]:
    """Return the names of global values and attributes in code, including inner functions."""
    within = [_names(each) for each in code.co_consts if isinstance(each, CodeType)]
    return sum(within, code.co_names)


def _described(value: Any, names: tuple[str, ...], called: dict[Any, None]) -> str:
    """Return a text that identifies a value that code uses; add its kernels to ``called``."""
    if hasattr(value, "py_func"):
        called[value] = None
        value = value.py_func
    if isinstance(value, CodeType):
        code = value.co_code, value.co_names, value.co_varnames
        return f"{code}{_described(value.co_consts, names, called)}"
    if isinstance(value, tuple):
        return f"{[_described(each, names, called) for each in cast('tuple[Any, ...]', value)]}"
    if isinstance(value, (ModuleType, type)):
        texts = [value.__name__]
        for name in names:
            if name in vars(value):
                others = tuple(each for each in names if each != name)  # so that the recursion ends
                texts.append(_described(vars(value)[name], others, called))
        return f"{texts}"
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        return f"{array.dtype}{array.shape}{_short_hash(array.tobytes())}"
    if hasattr(value, "__qualname__"):  # a function
        return f"{value.__module__}.{value.__qualname__}"
    return repr(value)


def _short_hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


# --- directories ---------------------------------------------------------------------------


@cache
def cache_root() -> Path | None:
    """Return the folder for all kernel directories, or None if it is not writable.

    The variable ``NUMBA_CACHE_DIR`` overrides its location.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir(PACKAGE)
    for root in (Path(chosen), FOLDER / "__pycache__"):
        with suppress(OSError):
            root.mkdir(parents=True, exist_ok=True)
            if os.access(root, os.W_OK):
                return root
    return None


@cache
def cache_directory(package: str = f"{PACKAGE}.engine.compile") -> Path | None:
    """Return the directory for kernels compiled from a package's current sources with this numba.

    Returns None if it is not writable.
    """
    root = cache_root()
    return None if root is None else root / _directory_name(package)


@cache
def shipped_directory() -> Path:
    """Return the directory of the wheel's kernels for this numba, which is missing elsewhere."""
    return FOLDER / "kernels" / _directory_name(f"{PACKAGE}.engine.compile")


def shipped_levels(processor: tuple[str, str, str]) -> list[tuple[str, str, str]]:
    """Return the shipped kinds of processor whose code a processor can run, best first.

    A kind is what numba calls its system, its name and its features.
    """
    system, _, features = processor
    if not system.startswith("x86_64"):
        return []
    better = {*V3.split()} <= {*features.split(",")}
    return [(system, name, "") for name in (["x86-64-v3"] if better else []) + ["x86-64"]]


@cache
def _directory_name(package: str) -> str:
    versions = numba.__version__, sys.version_info[:2]
    content = [repr(versions).encode()]
    left = [files(package)]
    for each in left:
        if each.is_dir():
            left += sorted(each.iterdir(), key=lambda entry: entry.name)
        elif each.name.endswith(".py"):
            content.append(each.read_bytes())
    return f"kernels-{_short_hash(b''.join(content))}"


def remove_unused(root: Path | None = None) -> None:
    """Remove the files that no process has used within `KEPT`.

    A process that later needs a removed file only has to compile it again.
    """
    root = root or cache_root()
    if root is None:
        return
    for file in root.glob(f"kernels-{'[0-9a-f]' * 16}/*"):
        with suppress(OSError):
            if time.time() - file.stat().st_mtime > KEPT:
                file.unlink()
                file.parent.rmdir()  # only succeeds if it is empty


def write(path: Path, content: bytes) -> None:
    """Write a file atomically; do nothing if the file system refuses."""
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}")
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            temporary.write_bytes(content)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
