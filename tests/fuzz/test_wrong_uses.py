"""Tests of wrong values of all options, keys and arguments: one line names the allowed ones."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, cast, get_type_hints

import gymnasium
import numpy as np
import pytest
import typer
from pydantic import BaseModel

import magfold_env as mf
from agents.settings import TrainSettings, checked
from magfold_env.cli import app
from magfold_env.envs.tasks.setup import ChainOptions, FeedOptions, FoldOptions
from magfold_env.scoring.track import TRACKS
from tests.command_line import run

NO_NUMBERS = ("x?", "nan", "")
"""Texts that are not numbers, words, modes or names of files."""

ARGUMENTS: Mapping[str, list[str]] = {
    **{name: ["paper/sequence-3"] for name in ("fold", "holding", "minimise", "ensemble")},
    "sweep": ["paper/sequence-3", "--over", "friction=0.1:0.2:2"],
    "design": ["LR"],
    "score": ["actions.json", "--env", "MagFold/UnknownFloor-v0"],
}
"""Required arguments of commands."""

FREE = {"out", "help", "env", "minutes", "goal", "target"}
"""Options for which a value above is allowed, or with which another option causes the error."""


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
def test_wrong_options_of_commands_are_told(command, option, value, folder, monkeypatch):
    monkeypatch.chdir(folder)
    result = run(command, *ARGUMENTS.get(command, []), option, value)
    assert (result.exit_code, result.stdout) == (2, "")
    # Numbers of a scene are named by its keys, "feed.speed".
    assert option.removeprefix("--").rstrip("s") in result.stderr
    assert re.search("must|allowed|no such|should be", result.stderr)
    assert "Traceback" not in result.stderr
    assert {path.name for path in folder.iterdir()} == {"actions.json"}


def keys(model: type[BaseModel], outer: str = "") -> Iterator[str]:
    """Yield the dotted keys of a model and of the models that it contains."""
    for name, field in model.model_fields.items():
        inner = field.annotation
        yield outer + name
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from keys(inner, f"{outer}{name}.")


def nested(key: str, value: object) -> dict[str, Any]:
    """Return nested mappings in which a dotted key has a value."""
    outer, _, inner = key.partition(".")
    return {outer: nested(inner, value) if inner else value}


def is_told(make: Callable[[], object], key: str, value: object) -> None:
    """Check that an error of one line names key and value, and what is allowed."""
    with pytest.raises(ValueError) as raised:  # noqa: PT011 - what it says is looked at
        make()
    said = str(raised.value)
    assert said.count("\n") == 0
    assert key in said
    named = re.sub(r"\n\s*", " ", repr(value))
    # The middle of what is long is left out.
    assert named[:60] in said
    assert named[-60:] in said
    assert "must" in said


@pytest.mark.parametrize("value", [{"no": 1}, b"\xff", "x?"], ids=str)
@pytest.mark.parametrize("key", [*keys(mf.Scene)])
def test_wrong_values_of_scenes_are_told(key: str, value: object) -> None:
    content: dict[str, Any] = {"sequence": ("NSNS",) * 3, **nested(key, value)}
    with pytest.raises(mf.SceneError) as raised:
        mf.Scene(**content)
    assert all(key in line and "must" in line for line in str(raised.value).split("\n"))


FREE_SETTINGS = {"name", "env.scene", "env.targets", "env.tasks", "start"}
"""Keys that accept any text, or whose errors are worded differently."""


@pytest.mark.parametrize("key", [key for key in keys(TrainSettings) if key not in FREE_SETTINGS])
def test_wrong_settings_of_training_are_told(key: str) -> None:
    content = {"name": "a", **nested(key, "x?")}
    is_told(lambda: checked(TrainSettings, content, "settings"), key, "x?")


ENVS = {
    **dict.fromkeys(("MagFold/TubeFeed-v0", "MagFold/SequenceDesign-v0"), FoldOptions),
    "MagFold/TubeFeedGoal-v0": ChainOptions,
    **dict.fromkeys(TRACKS, FeedOptions),
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


SCENE = mf.load_scene("paper/sequence-3")
NO_WHOLE = ("x?", 1.5, math.nan, math.inf, -(10**6), True, None, [1])
NO_COUNT = tuple(each for each in NO_WHOLE if each is not None)
"""Wrong values for optional arguments, which may be None."""
NO_POSITIVE = ("x?", 0.0, -1.0, math.nan, math.inf, True, [1.0])
NO_CHOICE = ("x?", 1, 1.5, ["free"], np.ones(3))
NO_SCENE = ("paper/sequence-3", None, 5, {"sequence": "NSNS"})
NO_PATH = (5, 1.5, ["a"])
NO_FUNCTION = ("x?", 5, [1])
NO_ANGLES = ("x?", [math.nan] * SCENE.n, [1e300] * SCENE.n, {}, ["0.5", "a"])
NO_SHAPE = (5.0, [0.0], [[0.0] * (SCENE.n + 1)], None)
"""Values about whose shape the error reports."""
NO_POINT = ("x?", 5.0, (1.0,), (0.0, math.nan), (True, 0.0), None)
FILE = "fold.json"


@cache
def fold() -> mf.Fold:
    return mf.simulate(SCENE)


@cache
def few() -> mf.Ensemble:
    return mf.ensemble(SCENE, 2)


RUNS = {
    "runs": (*NO_COUNT, 0, 10**9), "seed": NO_COUNT, "workers": (*NO_COUNT, 0, 10**9),
    "backend": NO_CHOICE, "progress": NO_FUNCTION, "state": NO_PATH, "scene": NO_SCENE,
}  # fmt: skip
SEARCHED = {
    "scene": NO_SCENE, "top": (*NO_WHOLE, 0), "among": NO_CHOICE, "progress": NO_FUNCTION
}  # fmt: skip
USES: list[tuple[Callable[..., object], Mapping[str, tuple[object, ...]]]] = [
    (partial(mf.simulate, scene=SCENE),
     {"scene": NO_SCENE, "frame_rate": (*NO_POSITIVE, 1e12), "seed": (*NO_WHOLE, 10.0)}),
    (partial(mf.simulate_batch, scenes=SCENE, seeds=[0, 1]),
     {"scenes": (5, None), "seeds": (5, None), "threads": (*NO_COUNT, 0, 10**9)}),
    (partial(mf.ensemble, scene=SCENE, runs=1), RUNS),
    (partial(mf.sweep, scene=SCENE, over={"friction": [0.1, 0.2]}, runs=1),
     {**RUNS, "over": (5, "friction")}),
    (lambda friction: mf.sweep(SCENE, {"friction": friction}, 1),
     {"friction": (5, "x?", [1.0], [2, 1])}),
    (
        partial(mf.design, target="LR", runs=1),
        {
            **RUNS, "runs": NO_COUNT, "scene": tuple(each for each in NO_SCENE if each is not None),
            "target": ("lr", "LX", 5, None, ["L"], ""), "mode": NO_CHOICE, "objective": NO_CHOICE,
            "search": NO_CHOICE, "budget": (*NO_COUNT, 0), "goal": (*NO_POSITIVE, 1.5),
            "speeds": (5, [], ()),
        },
    ),
    (partial(mf.minimise, scene=SCENE), {**SEARCHED, "mode": NO_CHOICE}),
    (partial(mf.ground_state, scene=SCENE), SEARCHED),
    (partial(mf.sequence_of, number=0, n=3), {
        "number": (*NO_WHOLE, 1 << 12), "n": (*NO_WHOLE, 0, 10**9),
    }),
    (partial(mf.energy, scene=SCENE, angles=[0.0]), {"scene": NO_SCENE, "angles": NO_ANGLES}),
    (partial(mf.forces, scene=SCENE), {"angles": NO_ANGLES}),
    (partial(mf.accelerations, scene=SCENE, rates=[0.0] * SCENE.n), {"angles": NO_ANGLES}),
    (lambda **changes: few().probability(**changes),
     {"word": ("x?", 5, "LL", ["L"]), "status": NO_CHOICE}),
    (lambda index: few().generator(index), {"index": (*NO_WHOLE, 2, -3)}),
    (lambda frame_rate: few().replay(0, frame_rate=frame_rate), {"frame_rate": NO_POSITIVE}),
    (mf.holding, {"fold": (None, 5, "x?", SCENE)}),
    (
        lambda **changes: mf.holding(fold(), **changes),
        {
            "directions": ("x?", 5.0, [], [math.nan], [[0.0]], [1, "a"]),
            "pulled": (*NO_COUNT, 0, 7), "held": (*NO_COUNT, -1, 7, 1),
        },
    ),
    (partial(mf.channel, start=(0, 0), end=(1, 0), width=0.1, wall=0.1),
     {"start": NO_POINT, "end": NO_POINT, "width": NO_POSITIVE, "wall": NO_POSITIVE}),
    (partial(mf.chamber, corner=(0, -1), size=(2, 2), opening=0.1, wall=0.1),
     {"corner": NO_POINT, "size": NO_POINT, "opening": NO_POSITIVE, "wall": NO_POSITIVE}),
    (
        partial(mf.funnel, bore=0.1, length=0.1),
        {
            "bore": NO_POSITIVE, "length": NO_POSITIVE, "wall": NO_POSITIVE,
            "angle": (*NO_POSITIVE, 1.6),
        },
    ),
    (lambda scene: mf.load_scene(scene), {"scene": (5, None, ["a"])}),  # noqa: PLW0108 - its name
    (partial(mf.save_scene, scene=SCENE, path=FILE), {"scene": NO_SCENE, "path": NO_PATH}),
    (lambda path: fold().to_json(path), {"path": NO_PATH}),
    (lambda path: few().to_csv(path), {"path": NO_PATH}),
    (mf.Ensemble.from_json, {"path": NO_PATH}),
    (mf.Sweep.from_json, {"path": NO_PATH}),
]  # fmt: skip
CALLS = [
    (function, name, value)
    for function, names in USES
    for name, values in names.items()
    for value in values
]


@pytest.mark.parametrize(("function", "name", "value"), CALLS)
def test_wrong_arguments_are_told(function, name, value):
    is_told(lambda: function(**{name: value}), name, value)
    assert not Path(FILE).exists()


@pytest.mark.parametrize("angles", NO_SHAPE, ids=str)
@pytest.mark.parametrize("function", [mf.energy, mf.forces])
def test_wrong_shapes_are_told(function: Callable[..., object], angles: object) -> None:
    is_told(lambda: function(SCENE, angles=angles), "angles", np.shape(cast("Any", angles)))
    with pytest.raises(mf.SceneError, match=r"^rates: .* must have shape"):
        mf.accelerations(SCENE, [0.0] * SCENE.n, cast("Any", angles))
