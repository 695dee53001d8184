"""Values, files and outputs of foreign kinds: one short line names each, at once."""

import gzip
import io
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import gymnasium
import numpy as np
import pytest

import magfold_env as mf
from magfold_env.cli import main
from magfold_env.render import save_gif, save_png
from magfold_env.scene.io import MOST_BYTES
from tests.command_line import fails_in_one_line, run
from tests.fuzz.readers import READERS, SCENE
from tests.fuzz.test_wrong_uses import ENVS, USES, fold, get_type_hints, keys, nested

UNSHOWN = type("Unshown", (), {"__repr__": lambda self: 1 / 0})()
HUGE, LONG, ARRAY = 10**5000, "x" * 5000, np.ones(3)
OBJECTS, RECORDS = np.array([1, None], dtype=object), np.zeros(2, dtype=[("a", "f8")])
FEED, FLOOR = "MagFold/TubeFeed-v0", "MagFold/UnknownFloor-v0"
ENV = gymnasium.make(FEED, components=6, baseline=None).unwrapped
OTHER: Any = gymnasium.make(FEED, components=4, baseline=None).unwrapped
MANY: Any = gymnasium.make_vec(FEED, num_envs=2, baseline=None)
QUASI: Any = gymnasium.make(FEED, fidelity="quasistatic").unwrapped
for env in (ENV, MANY, OTHER, QUASI):
    env.reset(seed=0)
STATES = [OTHER.get_state(), QUASI.get_state()]
TASKS: Any = gymnasium.make(FLOOR).unwrapped


def refused(make: Callable[[], object], *parts: str) -> None:
    begun = time.monotonic()
    with pytest.raises((ValueError, TypeError, OSError)) as raised:
        make()
    assert time.monotonic() - begun < 5.0
    assert "\n" not in (told := str(raised.value))
    assert len(told) < 450
    assert all(part in told for part in parts), told


def by_name(call: Callable[..., object], name: str, *given: Any) -> Callable[[Any], object]:
    return lambda each: call(*given, **{name: each})


FOREIGN: list[tuple[Callable[[Any], object], str, tuple[Any, ...]]] = [
    *((by_name(use, name), name, (1j, OBJECTS, RECORDS, UNSHOWN))
      for use, names in USES for name in names if name != "progress"),
    *((by_name(gymnasium.make, key, name), key, (1j, OBJECTS, RECORDS, UNSHOWN))
      for name in (FEED, FLOOR) for key in ("scene", *get_type_hints(ENVS[name]))),
    *((lambda each, key=key: mf.Scene(sequence=("NSNS",), **nested(key, each)), key,
       (1j, UNSHOWN, HUGE, {0.5}))
      for key in keys(mf.Scene) if key != "sequence"),
    *((lambda each, env=env: env.reset(seed=each), "seed", ("0", 0.5, True, -1, [0.5, 1], {1}))
      for env in (ENV, MANY)),
    *((lambda each, env=env: env.reset(options=each), "options", ("LR", 5, [], ARRAY, {1: 2}))
      for env in (ENV, MANY)),
    *((cast("Any", env).set_state, "state", (None, {}, b"x", MANY, OTHER, *STATES))
      for env in (ENV, MANY)),
    (lambda each: ENV.reset(options={"target": each}), "target", (ARRAY, [], 1j, {1}, b"LRLLR")),
    (lambda each: TASKS.reset(options={"task": each}), "task", (ARRAY, True, 1.0, -1, HUGE, "0")),
    (lambda each: MANY.reset(options={"reset_mask": each}), "reset_mask", ([True] * 2, 1, "x")),
    (ENV.step, "action", (None, "0", {}, 1j, [[0], [0, 1]])),
    (MANY.step, "actions", (None, "0", {}, 1j, [], ARRAY, [[0], [0]])),
    *((by_name(make, key, FEED), key, (HUGE, 10**9)) for make, key in (
        (gymnasium.make, "speeds"), (gymnasium.make, "components"),
        (gymnasium.make_vec, "num_envs"), (gymnasium.make_vec, "threads"))),
    (by_name(gymnasium.make, "gamma", FEED), "gamma", (True, "1")),
    (by_name(mf.simulate_batch, "seeds", SCENE), "seeds", (b"01", "01", {0, 1}, {0: 1}, ARRAY[0])),
    (by_name(mf.simulate, "progress", SCENE), "progress", (1, "x", [print])),
    (by_name(mf.design, "scene", "L"), "magnets", (mf.load_scene("pendulum-3"),)),
    (by_name(mf.design, "speeds", "L"), "speeds", (b"1", "1", {0.1}, 0.1, [[0.1]])),
    (by_name(mf.ensemble, "state", SCENE, 1), "state", ("a\0", "\ud800", b"x")),
    (by_name(mf.save_scene, "path", SCENE), "path", ("a\0", "\ud800", b"x")),
    (by_name(mf.save_scene, "comment", SCENE, "x.yaml"), "comment", (5, None, b"x")),
    (lambda each: mf.holding(fold(), directions=each), "directions", (HUGE, [HUGE], [1j], "1")),
    (by_name(mf.field, "points", SCENE, [0.0, 0.0]), "points", (HUGE, [[1j, 0]], [["0", "0"]], 5)),
    (lambda each: save_png(each, "x.png"), "fold", (None, SCENE)),
    (lambda each: save_gif(each, "x.gif"), "fold", (None, SCENE, [SCENE], "a")),
    (lambda each: save_gif(fold(), "x.gif", fps=each), "fps", (0, "20", 1e9, None)),
    (mf.load_scene, "such", ("a\nb", "a\0", "\ud800", "paper/sequnce-3")),
]  # fmt: skip
CASES = [(use, name, value) for use, name, values in FOREIGN for value in values]


@pytest.mark.parametrize("case", range(len(CASES)), ids=lambda case: f"{CASES[case][1]}-{case}")
def test_foreign_values_are_told(case: int) -> None:
    use, name, value = CASES[case]
    refused(lambda: use(value), name.rstrip("s"))
    assert not list(Path().glob("x.*"))


def test_of_many_problems_some_are_told() -> None:
    with pytest.raises(mf.SceneError, match=r"sequence\[19\]: 'X' .*\nand 80 more$"):
        mf.Scene(sequence=("X",) * 100)


YAML = {
    "friction: *a": "alias", "friction: !x 1": "line 1", "? x": "x",
    "friction: 1\nfriction: 2": "given twice", "friction: 0o7": "'0o7'", "friction: 1,5": "'1,5'",
    "friction: yes": "True", "friction: 1\n\tx: 2": "line 2", "friction: [1": "line", "5": "5",
    "friction: 'x": "line", "%x": "line", "friction: 1 kg": "'1 kg'", "--- 1\n--- 2": "line",
    "friction: 2026-01-01": "date", "friction: !!binary aGk=": "b'hi'", "x: !!set {a}": "x",
    "- a\nb: 1": "line 2", "[" * 2000: "recursion", "{a: " * 2000: "recursion", "~: 1": "None",
    "x: " + "1" * 9999: "digits", "\0": "#x0", "a: &a [*a]": "alias", "1: 2": "1", "[1]: 2": "[1]",
    "sequence: {a: 1}": "{'a'", "friction: .inf": "inf", "friction: 1e999": "inf", "": "None",
}  # fmt: skip


@pytest.mark.parametrize("text", YAML, ids=lambda text: repr(text[:20]))
def test_corners_of_yaml_are_told(text: str, tmp_path: Path) -> None:
    path = tmp_path / "given.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(mf.SceneError) as raised:
        mf.load_scene(path)
    told = str(raised.value).split("\n")
    assert any(YAML[text] in line for line in told)
    assert all(line.startswith(str(path)) and len(line) < 450 for line in told)


KINDS: dict[str, Callable[[Path], object]] = {
    "folder": Path.mkdir, "pipe": os.mkfifo, "device": lambda path: path.symlink_to("/dev/zero"),
    "loop": lambda path: path.symlink_to(path), "missing": lambda path: None,
    "large": lambda path: path.touch() or os.truncate(path, MOST_BYTES + 1),
    "empty": Path.touch, "digits": lambda path: path.write_text("9" * 5000),
    "bomb": lambda path: path.write_bytes(gzip.compress(bytes(1 << 20))),
    "utf-16": lambda path: path.write_text("a", "utf-16"),
    "long": lambda path: path.write_text(f'["{LONG}"]'),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("use", [
    *sorted(set(READERS) - {"state", "record", "archive"}),
    *(f"{name} @" for name in ("fold", "minimise", "ensemble", "holding", "lab")),
    "sweep @ --over friction=1:2", "design L --scene @", "play --scene @",
])  # fmt: skip
def test_files_of_other_kinds_are_told(use: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"given{READERS[use].suffix if use in READERS else '.yaml'}"
    KINDS[kind](path)
    if use in READERS:
        refused(lambda: READERS[use].read(path), "given")
    else:
        fails_in_one_line(run(*use.replace("@", str(path)).split()), "given.yaml")


@pytest.mark.parametrize("folder", ["/proc", "/proc/self/fd", LONG[:300]])
@pytest.mark.parametrize("option", ["json", "png", "gif", "html", "sheet"])
def test_outputs_that_cannot_be_written_are_told_before_the_work(option, folder, monkeypatch):
    monkeypatch.setattr("magfold_env.cli.fold.simulate", lambda *_, **__: pytest.fail("worked"))
    path = f"{folder}/x.{'pdf' if option == 'sheet' else option}"
    fails_in_one_line(run("fold", "pendulum-3", f"--{option}", path), folder[:20])


def test_a_terminal_without_a_sign_shows_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, "ascii", write_through=True))
    monkeypatch.setattr(sys, "argv", ["magfold", "scenes", "--keys"])
    with pytest.raises(SystemExit, match="0"):
        main()
    assert b"\\u2265" in shown.getvalue()
