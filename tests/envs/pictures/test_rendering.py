"""Tests of pictures, windows and text of every environment."""

import copy
import pickle
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pygame
import pytest
from gymnasium.wrappers import RecordVideo
from moviepy import VideoFileClip

from magfold_env.envs.pictures import viewer
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.wrappers import record_video
from magfold_env.render import style
from magfold_env.render.snapshot import snapshot_picture
from magfold_env.scoring.track import TRACKS
from tests.envs import contract
from tests.envs.vectors import same

QUICK: dict[str, Any] = {"components": 3, "baseline": None}
VARIANTS = [
    pytest.param(env_id, options, id=f"{env_id[8:-3]}{options.get('fidelity', '')}")
    for env_id, options in (
        ("MagFold/TubeFeed-v0", QUICK),
        ("MagFold/TubeFeed-v0", QUICK | {"fidelity": "quasistatic"}),
        ("MagFold/SequenceDesign-v0", QUICK),
        ("MagFold/TubeFeedGoal-v0", {"components": 3}),
        *((env_id, {}) for env_id in TRACKS),
    )
]
# A track has hundreds of steps, each of which is drawn.
every_variant_slowly = pytest.mark.parametrize(
    ("env_id", "options"),
    VARIANTS[:4]
    + [pytest.param(*each.values, id=each.id, marks=pytest.mark.slow) for each in VARIANTS[4:]],
)


@pytest.fixture(autouse=True)
def no_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(viewer, "SLOWDOWN", 0.01)
    yield
    pygame.display.quit()


def made(env_id: str, mode: str | None, options: dict) -> Any:
    return gymnasium.make(env_id, render_mode=mode, **options).unwrapped


def count(picture: np.ndarray, colour: style.Colour) -> int:
    return int((picture == np.array(colour[:3])).all(axis=-1).sum())


def after(*faces: str) -> TubeFeedEnv:
    """Return an environment with a chain of these components, fed at 0.1 m/s."""
    env = TubeFeedEnv(render_mode="rgb_array", **QUICK, targets=["LL"], randomisation="none")
    env.reset(seed=0)
    for each in faces:
        env.step(env.actions.encode(each, 0.1))
    return env


def test_the_ghost_shows_where_the_chain_differs_from_the_target() -> None:
    snapshot = after("SSNN", "NNNN", "SSSS").snapshot()
    assert dict(snapshot.rows)["word"] == "LL"
    faint = {}
    for target in ("LL", "RR", "LR", "RL"):
        picture = np.asarray(snapshot_picture(replace(snapshot, target=target)))[:, :540].astype(
            int
        )
        light = picture.min(axis=-1) > 180
        faint[target] = int((light & (picture[..., 1] >= picture[..., 0] + 15)).sum())
    # Under a chain that lies as it should, nothing of the ghost is seen but smoothed edges.
    assert faint["LL"] < 300
    assert min(faint["RR"], faint["LR"], faint["RL"]) > 3000


def test_what_touches_is_shown() -> None:
    straight = after().render()[:400, :540]
    folded = after("SSNN", "NNNN", "SSSS").render()[:400, :540]
    assert count(straight, style.GOOD) == 0
    assert count(folded, style.GOOD) > 500
    assert count(folded, style.CONFLICT) == 0
    snapshot = after("SSNN", "NNNN", "SSSS").snapshot()
    equal = replace(snapshot, scene=snapshot.scene.replace(sequence=("NNNN",) * 3))
    repelling = np.asarray(snapshot_picture(equal))[:400, :540]
    assert count(repelling, style.CONFLICT) > 500
    assert count(repelling, style.GOOD) == 0


def test_what_friction_holds_is_shown() -> None:
    # Equal poles drive the joints apart, so that friction alone brings the chain to rest.
    env = after("SSSS", "SSSS", "SSSS")
    snapshot = env.snapshot()
    assert snapshot.title == "misfolded"
    assert snapshot.held.all()
    free = np.asarray(snapshot_picture(replace(snapshot, held=np.zeros(3, dtype=np.bool_))))
    assert count(env.render(), style.HELD) > count(free, style.HELD) + 50
    assert not after("SSSS").snapshot().held[1:].any()


def test_the_prediction_is_the_minimisers() -> None:
    options = QUICK | {"components": 5, "randomisation": "none"}
    dynamic = TubeFeedEnv(**options)
    static = TubeFeedEnv(**options, fidelity="quasistatic")
    target = dynamic.targets[0]
    for env in (dynamic, static):
        env.reset(seed=0, options={"target": target})
    assert dynamic.snapshot().predicted is None
    for action in ([3, 4], [9, 4], [12, 4], [5, 4], [10, 4]):
        info = static.step(action)[4]
        dynamic.step(action)
        assert dynamic.snapshot().predicted == info["word"]
        assert static.snapshot().predicted is None
    assert dict(dynamic.snapshot().rows)["as predicted"] == dict(static.snapshot().rows)["energy"]


@pytest.mark.medium
@every_variant_slowly
def test_a_window_changes_nothing(env_id: str, options: dict) -> None:
    shown, hidden = made(env_id, "human", options), made(env_id, None, options)
    if "Floor" in env_id:
        shown.viewer._fps = 1e6
    assert same(contract.play(shown, 0), contract.play(hidden, 0))
    assert shown.render() is None
    shown.close()
    shown.close()


def test_a_window_shows_the_motion_between_decisions(monkeypatch: pytest.MonkeyPatch) -> None:
    env = TubeFeedEnv(render_mode="human", **QUICK)
    env.reset(seed=0)
    shown: list[Any] = []
    monkeypatch.setattr(env.viewer.window, "show", shown.append)
    monkeypatch.setattr(viewer, "SLOWDOWN", 1e6)
    env.step([0, 8])
    # One component of 18 mm at 0.6 m/s takes 0.03 s.
    assert 6 <= len(shown) - 1 <= 9
    arrays = [np.asarray(image) for image in shown]
    assert all((one != other).any() for one, other in pairwise(arrays))
    env.close()


@pytest.mark.medium
def test_a_film_shows_the_motion_between_decisions() -> None:
    env = TubeFeedEnv(render_mode="rgb_array_list", **QUICK)
    assert env.metadata["render_fps"] == viewer.FILM_FPS
    assert TubeFeedEnv.metadata["render_fps"] < viewer.FILM_FPS
    env.reset(seed=0)
    assert len(env.render()) == 1
    for _ in range(2):
        ended, before, film = False, 0.0, []
        while not ended:
            ended = env.step([5, 3])[2]
            frames, now = env.render(), float(env.episodes.chains.times(np.array([0]))[0])
            assert env.render() == []
            # The last one is the decision's; how it ends stays for a second.
            passing = len(frames) - (viewer.FILM_FPS if ended else 1)
            assert passing == pytest.approx(viewer.FILM_RATE * (now - before), abs=1.0)
            before, film = now, film + frames[: passing + 1]
        assert all(each.shape == (600, 800, 3) and each.dtype == np.uint8 for each in film)
        assert all((one != other).any() for one, other in pairwise(film))
        env.reset(seed=0)
        assert len(env.render()) == 1
    env.step([5, 3])
    env.reset(seed=0)
    assert len(env.render()) == 1


def test_what_is_drawn_back_is_shown_as_it_was() -> None:
    env = made("MagFold/Tray-v0", "rgb_array_list", {})
    env.reset(seed=0)
    for part in range(2):
        env.step([part, 0, 3, 0])
    fed = env.snapshot().scene.sequence
    env.render()
    env.step([0, 0, 3, 1])
    *passing, last = [snapshot.scene.sequence for snapshot, _, _ in env.viewer._film]
    assert len(passing) > 2
    assert set(passing) == {fed}
    assert last != fed


def test_steps_that_are_a_film_by_themselves_are_played_as_they_come() -> None:
    assert made("MagFold/UnknownFloor-v0", "human", {}).viewer.frame_rate is None
    assert made("MagFold/Tray-v0", "human", {}).viewer.frame_rate == viewer.FRAME_RATE


def test_a_window_keeps_the_size_it_is_given() -> None:
    env = TubeFeedEnv(render_mode="human", **QUICK)
    env.reset(seed=0)
    assert env.viewer.window.size == (800, 600)
    pygame.display.set_mode((640, 420), pygame.RESIZABLE)
    env.render()
    screen: Any = pygame.display.get_surface()
    assert env.viewer.window.size == screen.get_size() == (640, 420)
    assert np.ptp(pygame.surfarray.array3d(screen)) > 0
    env.close()


def test_copies_have_windows_of_their_own() -> None:
    env = TubeFeedEnv(render_mode="human", **QUICK)
    env.reset(seed=0)
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        np.testing.assert_equal(twin.step([3, 8]), copy.deepcopy(env).step([3, 8]))
        twin.close()
    env.close()


@pytest.mark.medium
def test_videos_have_the_motion_and_gymnasiums_the_decisions(tmp_path: Path) -> None:
    counts = {}
    for kind in (RecordVideo, record_video.RecordVideo):
        single = TubeFeedEnv(render_mode="rgb_array_list", **QUICK)
        env: Any = kind(single, str(tmp_path / kind.__module__), lambda _: True)
        env.reset(seed=0)
        for _ in range(3):
            env.step([5, 3])
        counts[kind] = len(env.recorded_frames)
        seconds = float(single.episodes.chains.times(np.array([0]))[0])
        env.close()
    assert counts[RecordVideo] == 4
    frames = viewer.FILM_RATE * seconds + 3 + viewer.FILM_FPS
    assert counts[record_video.RecordVideo] == pytest.approx(frames, abs=1.0)
    (path,) = tmp_path.glob("magfold_env*/*.mp4")
    with VideoFileClip(str(path)) as clip:
        assert clip.fps == viewer.FILM_FPS
        assert clip.duration == pytest.approx(frames / viewer.FILM_FPS, abs=0.1)
