"""Options that make no sense are told in words, never by a traceback."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

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
