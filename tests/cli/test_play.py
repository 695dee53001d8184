"""Tests of `magfold play`: what it opens, and which arguments it rejects."""

import pytest

from magfold_env.envs.pictures.play import Game
from tests.command_line import fails_in_one_line, run


def test_it_plays_the_given_target(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    played: list[Game] = []

    def note(game: Game) -> None:
        played.append(game)

    monkeypatch.setattr(Game, "run", note)
    run("play", "--target", "LRL", "--fidelity", "quasistatic", "--seed", "4", code=0)
    (game,) = played
    assert game.env.target == "LRL"
    assert game.env.scene.n == 4
    assert game.env.task.fidelity == "quasistatic"


def test_a_window_that_nobody_would_see_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pygame.display.get_driver", lambda: "offscreen")
    fails_in_one_line(run("play", "--target", "LRL"), "display: there is none to open a window on")
