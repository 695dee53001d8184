"""Tests of errors: one line names the option and the allowed values before any work begins."""

import shlex
import sys

import pytest

from magfold_env.cli import fold
from tests.command_line import fails_in_one_line, run

BASE = "paper/sequence-3"
REFUSED = [
    (f"fold {BASE} --mount glued", "mount: 'glued' is not allowed; must be 'pinned', 'free' or "),
    (f"fold {BASE} --speed 0.1", "--speed: 0.1 is not allowed for mount 'free'; must be left out"),
    (f"fold {BASE} --gif /nowhere/x.gif", "--gif: '/nowhere/x.gif' is not allowed; its folder mu"),
    (f"fold {BASE} --html /", "--html: '/' is not allowed; must not be a folder"),
    (f"fold {BASE} --gif x.mp4", "--gif: 'x.mp4' is not allowed; must end in .gif"),
    (
        f"fold {BASE} --sheet x.gif",
        "--sheet: 'x.gif' is not allowed; must end in .pdf or .png or .svg or .dxf",
    ),
    (f"minimise {BASE} --top 0", "top: 0 is not allowed; must be from 1 to 10000000"),
    (f"minimise {BASE} --png /nowhere/x.png", "--png: '/nowhere/x.png' is not allowed; its "),
    ("design LR --scene nowhere", "nowhere: no such scene"),
    ("design LR --scene pendulum-3", "magnets: None is not allowed; a scene must"),
    ("design LR --out pyproject.toml/x", "pyproject.toml is not a folder"),
    (f"ensemble {BASE} --spread speed=0.1", "--spread: 'speed=0.1' is not allowed; must be NAME="),
    (f"ensemble {BASE} --spread mass=much", "--spread: 'mass=much' is not allowed; must be NAME="),
    (f"ensemble {BASE} --spread mass=2", "spreads.mass: 2.0 is not allowed; must be less than 1"),
    (f"ensemble {BASE} --spread mass=0.1 --spread mass=0.2", "'mass=0.2' is not allowed; must not"),
    (f"ensemble {BASE} --out pyproject.toml/x", "--out: 'pyproject.toml/x' is not allowed; pypro"),
    (f"sweep {BASE} --over friktion=0:1", "at friktion=0: friktion: 0 is not allowed; unknown key"),
    (f"sweep {BASE} --over friction", "--over: 'friction' is not allowed; must be KEY=LOW:HIGH, "),
    (f"sweep {BASE} --over friction=1:1", "LOW must be less than HIGH"),
    (f"sweep {BASE} --over friction=0:inf", "LOW must be less than HIGH"),
    (f"sweep {BASE} --over friction=0:1:1", "COUNT must be 2 to 100"),
    (f"sweep {BASE} --over friction=0:1:9:log", "LOW must be greater than 0 for log"),
    (f"sweep {BASE} --over friction=0:1:9:even", "nothing but 'log' may follow COUNT"),
    (f"sweep {BASE} --over friction=-1:1", "at friction=-1: friction: -1 is not allowed; must be"),
    (f"sweep {BASE} --over friction=0:1 --over friction=0:1", "is not allowed; must not name"),
    (f"sweep {BASE} --over friction=0:1 --outcome LR", "outcome: 'LR' is not allowed; must be a"),
    ("holding nowhere.json", "error: nowhere.json: No such file or directory"),
    *(
        (f"{command} {empty}", "error: --out: '' is not allowed; must not be empty")
        for command in (f"ensemble {BASE}", "design LR", "lab", "bench whole", "bench", "stress")
        for empty in ("--out ''", "--out=")
    ),
    *(
        (f"{command} {'a/' * 1500}", f"{option}: 'a/a/")
        for command, option in (
            (f"ensemble {BASE} --out", "--out"),
            ("paper --out", "--out"),
            ("lab", "lab"),
        )
    ),
    (f"fold {BASE} --png ''", "error: --png: '' is not allowed; must not be empty"),
    ("fold ''", "error: fold: '' is not allowed; must not be empty"),
    (
        "play --target LSL",
        "targets: 'LSL' is not allowed; must be a fully folded word of ",
    ),
    ("play --target lrl", "; did you mean LRL?"),
    ("play --target LRL --components 5", "--components: 5 is not allowed; must be 4"),
    ("score no.safetensors", "env: None is not allowed; must be one of MagFold/UnknownFloor-v0"),
    ("paper --only figure-99", "--only: 'figure-99' is not allowed"),
    ("bench dynamics --only rest", "'rest' is not allowed; must be one of scaling, folds, "),
]


@pytest.mark.parametrize(("command", "message"), REFUSED)
def test_what_is_wrong_is_refused_in_one_line(command, message, monkeypatch):
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: pytest.fail("simulated all the same"))
    fails_in_one_line(run(*shlex.split(command)), message)


@pytest.mark.parametrize(("module", "command", "message"), [
    ("PIL", f"fold {BASE} --png x.png", "pictures need Pillow and matplotlib"),
    ("PIL", f"fold {BASE} --sheet x.pdf", "pip install -e '.[render]'"),
    ("matplotlib.figure", f"fold {BASE} --sheet x.pdf", "pip install -e '.[render]'"),
    ("matplotlib.figure", f"ensemble {BASE} --png x.png", "pip install -e '.[render]'"),
    ("ezdxf", f"fold {BASE} --sheet x.dxf", "DXF needs ezdxf: install the extra, pip install"),
    ("ray", f"ensemble {BASE} --backend ray", "pip install -e '.[ray]'"),
])  # fmt: skip
def test_a_missing_extra_is_told_before_the_work(module, command, message, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("magfold_env.render")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: pytest.fail("simulated all the same"))
    fails_in_one_line(run(*shlex.split(command)), message)
