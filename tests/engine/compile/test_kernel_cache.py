"""What is kept of kernels on disk: under the right names, none for ever, and no harm if damaged."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from magfold_env.engine.compile import insides, kernel_cache
from magfold_env.engine.compile.insides import numba_config
from magfold_env.engine.compile.kernel_cache import KEPT, remove_unused

pytestmark = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")


# --- directories ---------------------------------------------------------------------------


def aged(path, seconds):
    path.mkdir()
    (path / "kernel.nbc").write_bytes(b"code")
    os.utime(path, (time.time() - seconds,) * 2)
    return path


def test_only_directories_of_kernels_long_unused_are_removed(tmp_path):
    old = aged(tmp_path / f"kernels-{'a' * 16}", 1.1 * KEPT)
    recent = aged(tmp_path / f"kernels-{'b' * 16}", 0.9 * KEPT)
    other = aged(tmp_path / "kernels-of-others", 2.0 * KEPT)
    remove_unused(tmp_path)
    assert not old.exists()
    assert all(path.exists() for path in (recent, other))


SMALL = {
    "__init__.py": "",
    "numbers.py": "FACTOR = 2.0\n",
    "leaf.py": """
from magfold_env.engine.compile.jit import kernel
from magfold_env import numbers
@kernel
def leaf(x: float) -> float:
    return x * numbers.FACTOR
""",
    "root.py": """
from magfold_env.engine.compile.jit import kernel
from magfold_env.leaf import leaf
@kernel
def root(x: float) -> float:
    return leaf(x) + 1.0
""",
    "other.py": """
from magfold_env.engine.compile.jit import kernel
@kernel
def other(x: float) -> float:
    return x
""",
}
RUN = """
from magfold_env.root import root
from magfold_env.other import other
print(root(3.0), other(3.0))
"""


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A package of the same name with what compiles, and a few small kernels."""
    package = tmp_path / "sources" / "magfold_env"
    shutil.copytree(kernel_cache.FOLDER / "engine" / "compile", package / "engine" / "compile")
    (package / "engine" / "__init__.py").touch()
    for name, source in SMALL.items():
        (package / name).write_text(source)
    # What is tried out of numba once a version need not be tried here.
    tried = kernel_cache.cache_directory(insides.__file__)
    if tried is not None and tried.is_dir():
        shutil.copytree(tried, tmp_path / "cache" / tried.name)
    return package


def run(copy: Path, code: str = RUN) -> list[float]:
    """Run code in a process that finds only the copy, and return the numbers it prints."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(copy.parent),
        "NUMBA_CACHE_DIR": str(copy.parent.parent / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    printed = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env=environment, cwd=copy.parent, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    return [float(each) for each in printed.split()]


def kept(copy: Path, name: str = "") -> dict[Path, int]:
    """Files of machine code of a kernel, or all, and when they were written."""
    files = (copy.parent.parent / "cache").rglob(f"{name}*.nbc")
    return {path: path.stat().st_mtime_ns for path in files}


def edit(path: Path, old: str, new: str) -> None:
    source = path.read_text(encoding="utf-8")
    assert old in source
    path.write_text(source.replace(old, new), encoding="utf-8")


@pytest.mark.medium
@pytest.mark.parametrize(
    ("file", "old", "new", "expected"),
    [
        ("leaf.py", "x * numbers", "x + 10.0 * numbers", 24.0),
        ("numbers.py", "2.0", "5.0", 16.0),
        ("root.py", "+ 1.0", "- 1.0", 5.0),
    ],
    ids=["a kernel called", "a constant", "the kernel"],
)
def test_an_edit_is_seen_and_compiles_only_what_is_made_from_it(copy, file, old, new, expected):
    assert run(copy) == run(copy) == [7.0, 3.0]
    before = kept(copy)
    edit(copy / file, old, new)
    assert run(copy) == [expected, 3.0]
    after = kept(copy)
    assert before.items() < after.items()
    assert {path.name.partition(".")[0] for path in after.keys() - before.keys()} == {"root"}


DAMAGES = {
    "emptied": lambda content: b"",
    "truncated": lambda content: content[: len(content) // 2],
    "garbled at the beginning": lambda content: bytes(40) + content[40:],
    "garbled within": lambda content: content[:-100] + bytes(100),
    "something else": lambda content: b"not machine code",
}


@pytest.mark.medium
def test_what_is_damaged_is_compiled_again(copy):
    assert run(copy) == [7.0, 3.0]
    again = kept(copy)
    sound = {path: path.read_bytes() for path in again}
    for damage in DAMAGES.values():
        for path, content in sound.items():
            path.write_bytes(damage(content))
        damaged = kept(copy)
        assert run(copy) == [7.0, 3.0]
        again = kept(copy)
        assert again.keys() == sound.keys()
        assert all(again[path] != damaged[path] for path in again)
    assert run(copy) == [7.0, 3.0]
    assert kept(copy) == again


@pytest.mark.medium
def test_nothing_is_kept_where_nothing_can_be_written(copy):
    cache, package = copy.parent.parent / "cache", copy / "__pycache__"
    shutil.rmtree(cache, ignore_errors=True)  # there is none where kernels were never compiled
    for file in (cache, package):
        file.write_text("a file where the folder would be")
    assert run(copy) == [7.0, 3.0]
    assert not kept(copy)


# --- in a copy of the whole ----------------------------------------------------------------


@pytest.mark.medium
def test_sources_in_an_archive_are_found(copy):
    archive = shutil.make_archive(str(copy.parent), "zip", copy.parent)
    code = f"import sys; sys.path.insert(0, {archive!r})\n{RUN}"
    edit(copy / "leaf.py", "numbers.FACTOR", "0.0")  # not what the archive holds
    assert run(copy, code) == run(copy, code) == [7.0, 3.0]
    assert {path.name.partition(".")[0] for path in kept(copy)} == {"root", "other"}
