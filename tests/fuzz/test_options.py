"""Options that make no sense are told in words, never by a traceback."""

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import magfold_env as mf
from magfold_env.cli import app
from magfold_env.envs.tasks.feed_tasks import read_tasks
from magfold_env.envs.tasks.targets import resolve_targets
from tests.fuzz.mutations import VALUES

patient = settings(
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
)
NUMBERS = ["0", "-1", "1", "0.1", "1e400", "nan", "-inf", "1e-320", "9" * 30, "", "x", "٣"]
WORDS = ["free", "forward", "tube", "pinned", "", "x", "None", "LR", "LSR", "[red]", "\n", "é"]
SPREADS = ["friction=0.1", "friction=1", "mass", "=", "start_angles=0.1", "x=1", "mass=nan"]
GRIDS = ["friction=0:1:2", "friction=1:0", "friction=nan:1", "x=0:1", "friction=0,1", "=", ":", ""]
OPTIONS: Mapping[str, Mapping[str, list[str]]] = {
    "fold": {
        "--mount": WORDS, "--direction": WORDS, "--speed": ["0.5", *NUMBERS],
        "--friction": NUMBERS, "--seed": NUMBERS, "--json": ["nowhere/x.json", ".", ""],
    },
    "minimise": {"--mode": WORDS, "--top": NUMBERS, "--among": ["all", "stable", *WORDS]},
    "ensemble": {
        "--runs": ["1", "2", "0", "-1", "x", ""], "--seed": NUMBERS, "--mode": WORDS,
        "--spread": SPREADS, "--workers": ["0", "-1", "x"], "--backend": ["x", "threads"],
    },
    "sweep": {
        "--runs": ["1", "0", "x"], "--over": GRIDS, "--outcome": WORDS, "--seed": NUMBERS,
    },
    "stress": {
        "--only": WORDS, "--cases": ["0", "-1", "x"], "--seed": ["-1", "x"], "--rerun": WORDS,
    },
}  # fmt: skip


@pytest.mark.parametrize("command", OPTIONS)
@settings(patient, max_examples=settings().max_examples // 4)
@given(data=st.data())
def test_options_are_taken_or_refused(command: str, data: st.DataObject, quick: str) -> None:
    pairs = {name: st.sampled_from(values) for name, values in OPTIONS[command].items()}
    # Of a campaign only what is refused is fast.
    needed = {"--cases": pairs.pop("--cases")} if command == "stress" else {}
    given = data.draw(st.fixed_dictionaries(needed, optional=pairs))
    arguments = [] if command == "stress" else [quick]
    options = [part for pair in given.items() for part in pair]
    result = CliRunner().invoke(app.app, [command, *arguments, *options])
    assert result.exit_code in {0, 1, 2}, result.exception
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert "Traceback" not in result.output


@patient
@given(
    st.dictionaries(st.sampled_from(sorted(mf.Scene.model_fields)) | st.text(max_size=3), VALUES)
)
def test_scenes_of_any_values_are_made_or_refused(values: dict[str, Any]) -> None:
    told(lambda: mf.Scene(**{"sequence": ("NSNS",) * 3, **values}))


@patient
@given(VALUES)
def test_targets_of_any_kind_are_taken_or_refused(value: Any) -> None:
    for read in (lambda: resolve_targets(value, 3), lambda: read_tasks(value)):
        assert "must" in (told(read) or "must")


def told(make: Callable[[], object]) -> str:
    """Return what a `ValueError` says, if there is one; nothing else may be raised."""
    try:
        make()
    except ValueError as error:
        return str(error)
    return ""


def test_folders_in_the_place_of_files_are_refused() -> None:
    with tempfile.TemporaryDirectory() as folder:
        for command in ("fold", "minimise", "ensemble"):
            result = CliRunner().invoke(app.app, [command, str(Path(folder))])
            assert result.exit_code == 2
            assert "Traceback" not in result.output
