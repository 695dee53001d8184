"""Tests of folding by keyboard, with keys from a script."""

import signal
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pygame
import pytest

from magfold_env.envs.pictures import viewer
from magfold_env.envs.pictures.play import HELP, Game
from magfold_env.envs.tube_feed import TubeFeedEnv

OPTIONS: dict[str, Any] = {"components": 3, "baseline": None, "randomisation": "none"}


@pytest.fixture
def game(monkeypatch: pytest.MonkeyPatch) -> Iterator[Game]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(viewer, "SLOWDOWN", 0.01)
    env = TubeFeedEnv(render_mode="human", **OPTIONS)
    game = Game(env, seed=3, target="LL")
    game.begin()
    yield game
    env.close()


def _post(*keys: str) -> None:
    for key in keys:
        code = pygame.key.key_code(key)
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=code))


def _screen() -> np.ndarray:
    screen: Any = pygame.display.get_surface()
    return pygame.surfarray.array3d(screen)


def test_keys_fold_a_chain_as_actions_do(game: Game) -> None:
    # NNNN to begin with; turned to SSNN, back to NNNN, to SSSS, and a level faster for the last.
    _post("1", "2", "space", "1", "2", "space", "1", "2", "3", "4", "up", "space", "q")
    game.run()
    other = TubeFeedEnv(**OPTIONS)
    other.reset(seed=3, options={"target": "LL"})
    info: Any = None
    for action in ([12, 4], [0, 4], [15, 5]):
        info = other.step(action)[4]
    assert game.info == info
    assert game.info["status"] == "folded"


def test_another_game_begins_on_request_and_closing_the_window_ends_it(game: Game) -> None:
    first = _screen()
    _post("space", "space", "space", "space", "r", "q")
    game.run()
    assert game.env.next_component == 0
    np.testing.assert_array_equal(_screen(), first)
    _post("space", "n", "escape")
    game.run()
    assert game.env.next_component == 0
    assert game.env.target == "LL"
    pygame.event.post(pygame.event.Event(pygame.WINDOWRESIZED))
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    game.run()
    assert game.env.next_component == 0


def test_help_comes_and_goes_and_a_choice_is_seen_before_it_is_made(game: Game) -> None:
    without = _screen()
    game.press("h")
    assert (_screen() != without).mean() > 0.01
    game.press("h")
    np.testing.assert_array_equal(_screen(), without)
    assert all(any(key in line for line in HELP) for key in ("1 2 3 4", "up", "space", "R", "Q"))
    seen = _screen()
    game.press("3")
    assert game.faces == "NNSN"
    assert (_screen()[:540] != seen[:540]).any()


@pytest.mark.medium
def test_speeds_end_where_their_levels_do(game: Game) -> None:
    for _ in range(12):
        game.press("up")
    assert game.level == game.env.actions.levels - 1
    for _ in range(12):
        game.press("down")
    assert game.level == 0


def test_a_game_needs_a_window() -> None:
    with pytest.raises(ValueError, match="render_mode: None is not allowed; must be 'human'"):
        Game(TubeFeedEnv(**OPTIONS))


def test_ctrl_c_ends_the_game(game: Game) -> None:
    # Jobs in the background are begun without it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    pygame.event.clear()
    interrupt = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    rescue = threading.Timer(10.0, pygame.event.post, [pygame.event.Event(pygame.QUIT)])
    interrupt.start()
    rescue.start()
    with pytest.raises(KeyboardInterrupt):
        game.run()
    signal.signal(signal.SIGINT, before)
    assert rescue.is_alive()
    rescue.cancel()
