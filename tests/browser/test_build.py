"""Tests of the folder that a page loads."""

import gzip
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from magfold_env.browser import __main__ as command
from magfold_env.browser import build, wasm
from magfold_env.cli.options import application_of
from tests.browser import built
from tests.command_line import fails_in_one_line

LARGEST = 1_450_000  # bytes gzipped, of 1.5 MB that it may have
EXPORTS = {
    "begin_search", "choose", "couple", "draw", "ending", "energy", "far_error", "fill_far_table",
    "fill_near_table", "film", "judge", "look", "observe", "overlap", "resize", "run", "set_up",
    "size_magnets", "take_in", "visit", "memory", "__heap_base",
}  # fmt: skip


@pytest.mark.medium
def test_the_module_imports_nothing_and_the_folder_is_small() -> None:
    told = built.run({"task": "module"})
    assert told["imports"] == []
    assert set(told["exports"]) == EXPORTS
    files = list(built.folder().iterdir())
    assert {each.name for each in files} == {
        build.KERNELS, build.MEMORY, build.LAYOUT, build.GAMES, build.PAGE, *build.SCRIPTS
    }  # fmt: skip
    assert len(gzip.compress(built.folder().joinpath(build.PAGE).read_bytes())) < LARGEST


@pytest.mark.slow
def test_the_same_sources_give_the_same_bytes(tmp_path: Path) -> None:
    build.build(tmp_path)
    for each in built.folder().iterdir():
        assert tmp_path.joinpath(each.name).read_bytes() == each.read_bytes(), each.name


def test_without_a_linker_one_line_says_what_is_missing(monkeypatch, tmp_path):
    monkeypatch.setattr(wasm, "linker", lambda: None)
    app = application_of(command.main)
    fails_in_one_line(CliRunner().invoke(app, ["--out", str(tmp_path)]), "needs")
    for wrong in ("--out=", "--out=/proc/x", f"--out={'a/' * 1500}"):
        fails_in_one_line(CliRunner().invoke(app, [wrong]), "--out: '")


def test_wrong_options_are_told_as_by_other_commands(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["browser", "--no-such-option"])
    with pytest.raises(SystemExit, match="2"):
        runpy.run_path(command.__file__, run_name="__main__")
    assert capsys.readouterr().err.splitlines()[-1] == "Error: No such option: --no-such-option"


def test_exponentials_and_products_are_rounded_as_they_should() -> None:
    x = np.concatenate([np.linspace(-700.0, 700.0, 20_001), np.linspace(-2.0, 0.0, 20_001)])
    found = np.array([wasm.exponential(float(each)) for each in x])
    assert (np.abs(found - np.exp(x)) <= np.spacing(np.exp(x))).all()
    assert wasm.exponential(-800.0) == 0.0
    assert wasm.exponential(800.0) == np.inf
    from fractions import Fraction  # noqa: PLC0415

    rng = np.random.default_rng(0)
    for _ in range(2000):
        a, b = (float(x) for x in rng.standard_normal(2) * 2.0 ** rng.integers(-30, 30, 2))
        c = -a * b * (1.0 + float(rng.integers(-4, 5)) * 2.0**-52)
        exact = Fraction(a) * Fraction(b) + Fraction(c)
        assert wasm.fused(a, b, c) == float(exact)
