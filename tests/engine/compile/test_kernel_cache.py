"""Tests of the kernel cache on disk: its names, its age limit, and damaged files."""

import os
import platform
import shutil
import time
from pathlib import Path
from typing import Any

import pytest

from magfold_env.engine.compile import kernel_cache
from magfold_env.engine.compile.jit import numba_config
from magfold_env.engine.compile.kernel_cache import KEPT, fingerprint, remove_unused
from tests.command_line import python

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")


def test_only_kernels_long_unused_are_removed(tmp_path):
    ours, unused, others = (tmp_path / f"kernels-{name}" for name in ("a" * 16, "b" * 16, "other"))
    for path, age in [
        (ours / "old", 1.1), (ours / "recent", 0.9), (unused / "old", 1.1), (others / "old", 2.0)
    ]:  # fmt: skip
        path.parent.mkdir(exist_ok=True)
        path.touch()
        used = time.time() - age * KEPT
        os.utime(path, (used, used))
    remove_unused(tmp_path)
    assert set(tmp_path.rglob("*")) == {ours, ours / "recent", others, others / "old"}


SMALL = """
from types import ModuleType
import numpy as np
from magfold_env.engine.compile.jit import inlined, kernel
numbers = ModuleType("numbers")
numbers.FACTOR, numbers.OTHER = 2.0, 7.0
TABLE, SHAPE = np.array([1.0, 2.0]), (4, 5)
@kernel
def leaf(x, y=1.0):
    return x * numbers.FACTOR + TABLE[1] + y + SHAPE[0]
@kernel
def other(x):
    return x
@kernel
def root(x):
    return leaf(x) + 1.0
"""


def fingerprint_of(source: str) -> str:
    names: dict[str, Any] = {"__name__": "small"}
    exec(source, names)
    return fingerprint(names["root"])


@pytest.mark.parametrize(("old", "new", "seen"), [
    (") + 1.0", ") - 1.0", True),
    ("x * numbers", "x / numbers", True),
    ("2.0, 7.0", "2.5, 7.0", True),
    ("[1.0, 2.0]", "[1.0, 2.5]", True),
    ("(4, 5)", "(4.0, 5)", True),
    ("y=1.0", "y=2.0", True),
    ("@kernel\ndef leaf", "@inlined\ndef leaf", True),
    ("leaf(x) +", "other(x) +", True),
    ("2.0, 7.0", "2.0, 8.0", False),
    ("return x\n", "return -x\n", False),
    ("np\n", "np\n\n", False),
])  # fmt: skip
def test_an_edit_of_what_a_kernel_is_made_from_is_seen(old, new, seen):
    assert SMALL.count(old) == 1
    assert (fingerprint_of(SMALL.replace(old, new)) != fingerprint_of(SMALL)) == seen


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a package of the same name with the compiling modules and a few small kernels."""
    package = tmp_path / "sources" / "magfold_env"
    shutil.copytree(kernel_cache.FOLDER / "engine" / "compile", package / "engine" / "compile")
    for name, source in {"engine/__init__": "", "__init__": "", "small": SMALL}.items():
        (package / f"{name}.py").write_text(source)
    # What is tried out of numba once a version need not be tried here.
    directory = kernel_cache.cache_directory()
    if directory is not None and (directory / "checked").exists():
        kernel_cache.write(tmp_path / "cache" / directory.name / "checked", b"")
    return package


def run(copy: Path, before: str = "", **changes: str) -> list[float]:
    """Run kernels in a process that finds only the copy, and return the numbers it prints."""
    code = f"{before}\nfrom magfold_env.small import other, root\nprint(root(3.0), other(3.0))"
    cache = str(copy.parent.parent / "cache")
    surroundings: dict[str, Any] = {"PYTHONPATH": str(copy.parent), "NUMBA_CACHE_DIR": cache}
    surroundings |= {"PYTHONDONTWRITEBYTECODE": "1", **changes}
    printed = python("-W", "error", "-c", code, cwd=copy.parent, **surroundings).stdout
    return [float(each) for each in printed.split()]


def kept(copy: Path) -> dict[Path, bytes]:
    """Return the files of machine code and their contents."""
    files = (copy.parent.parent / "cache").rglob("*.nbc")
    return {path: path.read_bytes() for path in files}


def edit(copy: Path, old: str, new: str) -> None:
    (copy / "small.py").write_text(SMALL.replace(old, new))


@pytest.mark.medium
def test_an_edit_compiles_only_what_is_made_from_it(copy):
    assert run(copy) == [14.0, 3.0]
    before = kept(copy)
    edit(copy, "numbers.FACTOR, numbers.OTHER = 2.0", "\nnumbers.FACTOR, numbers.OTHER = 5.0")
    assert run(copy) == run(copy) == [23.0, 3.0]
    after = kept(copy)
    assert before.items() < after.items()
    (new,) = after.keys() - before.keys()
    assert new.name.startswith("small.root.")


DAMAGES = {
    "emptied": lambda content: b"",
    "truncated": lambda content: content[: len(content) // 2],
    "garbled at the beginning": lambda content: bytes(40) + content[40:],
    "garbled within": lambda content: content[:-100] + bytes(100),
    "something else": lambda content: b"not machine code",
}


@pytest.mark.medium
def test_what_is_damaged_is_compiled_again(copy):
    assert run(copy) == [14.0, 3.0]
    sound = again = kept(copy)
    for damage in DAMAGES.values():
        damaged = {path: damage(content) for path, content in sound.items()}
        for path, content in damaged.items():
            path.write_bytes(content)
        assert run(copy) == [14.0, 3.0]
        again = kept(copy)
        assert again.keys() == sound.keys()
        assert all(again[path] != damaged[path] for path in again)
    assert run(copy) == [14.0, 3.0]
    assert kept(copy) == again


@pytest.mark.medium
def test_nothing_is_kept_where_nothing_can_be_written(copy):
    cache, package = copy.parent.parent / "cache", copy / "__pycache__"
    shutil.rmtree(cache, ignore_errors=True)  # there is none where kernels were never compiled
    for file in (cache, package):
        file.write_text("a file where the folder would be")
    assert run(copy) == [14.0, 3.0]
    assert not kept(copy)


@pytest.mark.medium
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="shipped for x86-64 only")
def test_shipped_kernels_are_loaded_where_the_processor_has_what_they_use(copy):
    shipped = {"NUMBA_CACHE_DIR": str(copy / "kernels"), "NUMBA_CPU_FEATURES": ""}
    assert run(copy, NUMBA_CPU_NAME="x86-64-v3", **shipped) == [14.0, 3.0]
    assert run(copy) == [14.0, 3.0]
    assert not kept(copy)
    lesser = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    assert run(copy, **lesser) == [14.0, 3.0]
    assert len(kept(copy)) == 2
    edit(copy, "x * numbers", "x / numbers")
    assert run(copy) == [9.5, 3.0]


@pytest.mark.medium
def test_sources_in_an_archive_are_found(copy):
    archive = shutil.make_archive(str(copy.parent), "zip", copy.parent)
    first = f"import sys; sys.path.insert(0, {archive!r})"
    edit(copy, "x * numbers", "0.0 * numbers")  # not what the archive holds
    assert run(copy, first) == run(copy, first) == [14.0, 3.0]
    assert {path.name.split(".")[1] for path in kept(copy)} == {"root", "other"}
