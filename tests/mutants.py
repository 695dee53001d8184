"""Mutation tests, which plant one error at a time: ``python -m tests.mutants [PART …]``.

``mutants.yaml`` lists errors and the tests that must detect them. Each error is planted in a copy
of the tree. Without the error, its tests must pass. With the error, an assertion of one of them
must fail. An error in a fixture, during collection or in the code under test does not count.
``PART`` selects the mutants whose name or file contains it. The exit code is 1 unless all mutants
are killed. Mutants with ``interpreted`` in the table run without compilation. This module is also
the pytest plugin that detects the failed assertion.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import platformdirs
import pytest
import yaml

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_suffix(".yaml")
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "runs", ".*_cache", ".hypothesis")
LIMIT = 1800.0
"""Time limit of the tests of a mutant [s], because some errors make loops endless."""

NOTICED = 32  # none of pytest's exit codes
tell = partial(print, flush=True)

Fate = Literal["killed", "survived", "broken"]


class Mutant(NamedTuple):
    """An error, the file in which it is planted, and the tests that must detect it."""

    topic: str
    what: str
    """Description of the error."""
    file: str
    old: str
    """Text that occurs once in the file."""
    new: str
    tests: list[str]
    interpreted: bool = False
    """Whether the tests run without compilation."""


def mutants() -> list[Mutant]:
    """Return all mutants of the table."""
    content = yaml.safe_load(TABLE.read_text(encoding="utf-8"))
    return [Mutant(topic, **each) for topic, listed in content.items() for each in listed]


def plant(mutant: Mutant, tree: Path) -> None:
    """Write a mutant's error into a copy of the tree.

    Raises
    ------
    ValueError
        If the text to replace does not occur exactly once.
    """
    path = tree / mutant.file
    text = path.read_text(encoding="utf-8")
    if (times := text.count(mutant.old)) != 1:
        raise ValueError(f"{mutant.file}: must hold {mutant.old!r} once, not {times} times")
    path.unlink()  # it may be a link to the sound file
    path.write_text(text.replace(mutant.old, mutant.new), encoding="utf-8")


def pytest_exception_interact(call: Any, report: Any) -> None:
    """End a run of pytest at the first assertion of a test that fails."""
    if report.when == "call" and _is_failed_assertion(call.excinfo.value):
        pytest.exit("an assertion failed", returncode=NOTICED)


def _is_failed_assertion(error: BaseException) -> bool:
    if isinstance(error, BaseExceptionGroup):  # hypothesis raises several at once
        return any(map(_is_failed_assertion, error.exceptions))
    return isinstance(error, AssertionError | pytest.fail.Exception)


def run_tests(tree: Path, tests: Iterable[str], interpreted: bool) -> tuple[int, str]:
    """Run some tests of a tree; return pytest's exit code and what it printed.

    The code is `NOTICED` if an assertion fails, and negative if the tests take too long.
    """
    options = ["-q", "-m", "", "-p", "no:cacheprovider", "-p", __spec__.name]
    paths = {"PYTHONPATH": os.pathsep.join([str(tree), str(ROOT)])}
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=tree,
            env={**os.environ, **paths, "NUMBA_DISABLE_JIT": str(int(interpreted))},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -1, f"took longer than {LIMIT:g} s"
    return done.returncode, done.stdout


def fate(mutant: Mutant, sound: Path) -> tuple[Fate, str]:
    """Return the fate of a mutant, and the output of its tests if it survives."""
    with tempfile.TemporaryDirectory(prefix="mutant-") as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(sound, tree, copy_function=os.link)
        plant(mutant, tree)
        code, said = run_tests(tree, mutant.tests, mutant.interpreted)
        if code == NOTICED:
            return "killed", ""
        return "survived" if code == 0 else "broken", said


def sound_tests(chosen: list[Mutant], sound: Path) -> Iterator[str]:
    """Yield the output of tests that fail without a planted error."""
    for interpreted in (True, False):
        tests = {t: None for m in chosen if m.interpreted == interpreted for t in m.tests}
        code, said = run_tests(sound, tests, interpreted) if tests else (0, "")
        if code != 0:
            yield said


def main() -> int:
    """Plant the chosen mutants and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    chosen = [
        each
        for each in mutants()
        if not given.parts or any(part in f"{each.file} {each.what}" for part in given.parts)
    ]
    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        sound = Path(folder) / "sound"
        shutil.copytree(ROOT, sound, ignore=LEFT_OUT)
        # Kernels that were compiled before serve here; those of mutants go with the folder.
        known = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("magfold_env")
        kernels = Path(folder) / "kernels"
        if Path(known).is_dir():
            shutil.copytree(known, kernels)
        os.environ["NUMBA_CACHE_DIR"] = str(kernels)
        if wrong := list(sound_tests(chosen, sound)):
            tell(*wrong, "these tests fail without any mutant", sep="\n")
            return 1
        tell(f"{len(chosen)} mutants; their tests pass without them")
        fates: dict[Fate, int] = {"killed": 0, "survived": 0, "broken": 0}
        with ThreadPoolExecutor(given.workers) as pool:
            found = zip(chosen, pool.map(lambda each: fate(each, sound), chosen), strict=True)
            for mutant, (end, said) in found:
                fates[end] += 1
                tell(f"{end:8} | {mutant.topic:9} | {mutant.what} | {mutant.file}")
                if said:
                    tell(said)
    counts = ", ".join(f"{count} {end}" for end, count in fates.items())
    tell(f"{counts}; {time.monotonic() - begun:.0f} s")
    return int(fates["killed"] != len(chosen))


if __name__ == "__main__":
    sys.exit(main())
