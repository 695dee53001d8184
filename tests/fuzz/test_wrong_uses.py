"""Wrong values of every option, key and argument there is: one line names them and what may be."""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, get_type_hints

import gymnasium
import pytest
import typer
import yaml
from pydantic import BaseModel

import magfold_env as mf
from agents.settings import TrainSettings, checked
from magfold_env.cli import app
from magfold_env.envs.tasks.feed_tasks import FeedOptions
from magfold_env.envs.tasks.world import ChainOptions, FoldOptions
from tests.command_line import fails_in_one_line, run

NO_NUMBERS = ("x?", "nan", "")
"""Nor words, modes or files of any kind."""

ARGUMENTS: Mapping[str, list[str]] = {
    "fold": ["paper/sequence-3"],
    "hold": ["paper/sequence-3"],
    "minimise": ["paper/sequence-3"],
    "ensemble": ["paper/sequence-3"],
    "sweep": ["paper/sequence-3", "--over", "friction=0.1:0.2:2"],
    "design": ["LR"],
    "score": ["actions.json", "--env", "MagFold/UnknownFloor-v0"],
}
"""What commands need, but for their options."""

FREE = {"address", "out", "help", "env", "minutes", "goal", "target"}
"""Options that take any text, or of which some value above is right or another one is at fault."""


def options() -> Iterator[tuple[str, str]]:
    """Yield commands and their options that take a value."""
    group: Any = typer.main.get_command(app.app)
    for name, command in group.commands.items():
        if name in ARGUMENTS or name in {"stress", "play"}:
            for option in command.params:
                if option.opts[0].startswith("--") and not option.is_flag:
                    yield name, option.opts[0]


CASES = [
    (command, option, value)
    for command, option in options()
    for value in NO_NUMBERS
    if option.removeprefix("--") not in FREE
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the file that a command needs."""
    folder = tmp_path_factory.mktemp("uses")
    (folder / "actions.json").write_text("{}", encoding="utf-8")
    return folder


@pytest.mark.parametrize(("command", "option", "value"), CASES)
def test_wrong_options_of_commands_are_told(
    command: str, option: str, value: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    result = run(command, *ARGUMENTS.get(command, []), option, value)
    # Numbers of a scene are named by its keys, "feed.speed".
    fails_in_one_line(result, option.removeprefix("--").rstrip("s"), value)
    assert "must" in result.stderr or "allowed" in result.stderr or "no such" in result.stderr
    assert {path.name for path in folder.iterdir()} == {"actions.json"}


def keys(model: type[BaseModel], outer: str = "") -> Iterator[str]:
    """Yield the dotted keys of a model and of those that it holds."""
    for name, field in model.model_fields.items():
        inner = field.annotation
        yield outer + name
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from keys(inner, f"{outer}{name}.")


def nested(key: str, value: object) -> dict[str, Any]:
    """Return a mapping of mappings in which a dotted key has a value."""
    outer, _, inner = key.partition(".")
    return {outer: nested(inner, value) if inner else value}


def is_told(make: Callable[[], object], key: str, value: object) -> None:
    """Check that an error of one line names key and value, and what is allowed."""
    with pytest.raises(ValueError) as raised:  # noqa: PT011 - what it says is looked at
        make()
    said = str(raised.value)
    assert said.count("\n") == 0
    assert key in said
    assert repr(value) in said
    assert "must" in said


@pytest.mark.parametrize("value", [{"no": 1}, b"\xff"], ids=str)
@pytest.mark.parametrize("key", [*keys(mf.Scene)])
def test_wrong_values_of_scenes_are_told(key: str, value: object) -> None:
    wrong = value if not isinstance(value, dict) else {"no": 1}
    content: dict[str, Any] = {"sequence": ("NSNS",) * 3, **nested(key, wrong)}
    with pytest.raises(mf.SceneError) as raised:
        mf.Scene(**content)
    assert all(key in line and "must" in line for line in str(raised.value).split("\n"))


@pytest.mark.parametrize("key", [*keys(mf.Scene)])
def test_wrong_values_of_scenes_in_files_are_told(key: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump({"sequence": ["NSNS"] * 3, **nested(key, "x?")}), "utf-8")
    is_told(lambda: mf.load_scene(path), key, "x?")


FREE_SETTINGS = {"name", "env.scene", "env.targets", "env.tasks", "start"}
"""That take any text, or say in other words what is wrong with it."""


@pytest.mark.parametrize("key", [key for key in keys(TrainSettings) if key not in FREE_SETTINGS])
def test_wrong_settings_of_training_are_told(key: str) -> None:
    content = {"name": "a", **nested(key, "x?")}
    is_told(lambda: checked(TrainSettings, content, "settings"), key, "x?")


ENVS = {
    "MagFold/TubeFeed-v0": FoldOptions,
    "MagFold/SequenceDesign-v0": FoldOptions,
    "MagFold/TubeFeedGoal-v0": ChainOptions,
    **{
        f"MagFold/{name}-v0": FeedOptions for name in ("UnknownFloor", "Reprogram", "Lumen", "Tray")
    },
    "MagFold/Anchor-v0": FeedOptions,
}


def test_all_environments_are_among_them() -> None:
    assert {name for name in gymnasium.registry if name.startswith("MagFold/")} == set(ENVS)


@pytest.mark.parametrize("value", ["x?", -1.5], ids=str)
@pytest.mark.parametrize(
    ("env_id", "option"),
    [(name, key) for name, kind in ENVS.items() for key in get_type_hints(kind)],
)
def test_wrong_options_of_environments_are_told(env_id: str, option: str, value: Any) -> None:
    is_told(lambda: gymnasium.make(env_id, **{option: value}), option, value)


CALLS: list[tuple[Callable[..., object], str, object]] = [
    (function, name, value)
    for function, names in (
        (mf.simulate, {"frame_rate": (0.0, -1.0, math.nan)}),
        (mf.ensemble, {"runs": (0, -1), "seed": (-1,), "workers": (0, -1), "backend": ("x?",)}),
        (mf.minimise, {"mode": ("x?", 1), "top": (0, -1), "among": ("x?", 1)}),
        (mf.ground_state, {"top": (0, -1), "among": ("x?", 1), "time_limit": (-1.0,)}),
    )
    for name, values in names.items()
    for value in values
]


@pytest.mark.parametrize(("function", "name", "value"), CALLS)
def test_wrong_arguments_are_told(
    function: Callable[..., object], name: str, value: object
) -> None:
    scene = mf.load_scene("paper/sequence-3")
    is_told(lambda: function(scene, **{name: value}), name, value)


def test_there_are_many() -> None:
    scenes, settings = len(list(keys(mf.Scene))), len(list(keys(TrainSettings)))
    options = sum(len(get_type_hints(kind)) for kind in ENVS.values())
    assert len(CASES) + 3 * scenes + settings + 2 * options + len(CALLS) > 200
