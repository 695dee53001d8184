"""Tests that pages of episodes play the motion in the environment."""

import copy
import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from magfold_env.envs.anchor import AnchorEnv
from magfold_env.envs.pictures.snapshots import EMPTY
from magfold_env.envs.spaces.actions import BACK, LYING, SIGNS, letters_of
from magfold_env.envs.tube_feed import TubeFeedEnv
from tests.envs.pictures.test_rendering import QUICK, VARIANTS

MOVING = [each for each in VARIANTS if "quasistatic" not in str(each.id)]


def page_of(env: Any, folder: Path) -> dict[str, Any]:
    """Return the data of an episode's page."""
    env.to_html(folder / "episode.html")
    text = (folder / "episode.html").read_text(encoding="utf-8")
    return json.loads(text.split('id="fold">')[1].split("</script>")[0])


def seconds(env: Any) -> float:
    return float(env.episodes.chains.times(np.array([0]))[0])


@pytest.mark.parametrize(("env_id", "options"), MOVING)
def test_a_page_ends_where_the_episode_is(env_id: str, options: dict, tmp_path: Path) -> None:
    env: Any = gymnasium.make(env_id, **options).unwrapped
    env.reset(seed=3)
    env.action_space.seed(3)
    said: Any = None
    for _ in range(8):
        # Agents may write all of their actions into one array.
        action = env.action_space.sample()
        said = env.step(action)
        if isinstance(action, np.ndarray):
            action[:] = env.action_space.sample()
        if said[2]:
            break
    twin, data = copy.deepcopy(env), page_of(env, tmp_path)
    assert data["time"][-1] == pytest.approx(seconds(env), abs=1e-6)
    np.testing.assert_allclose(data["angles"][-1], env.state.angles, atol=1e-4)
    np.testing.assert_allclose(np.array(data["base"][-1]) / 1e3, env.state.base, atol=1e-7)
    assert np.all(np.diff(data["time"]) > 0.0)
    assert data["word"] == said[4]["word"]
    assert data["status"] == said[4].get("status", "under way")
    if data["magnetic"]:
        energy = env.episodes.chains.energies(np.array([0]))[0]
        assert data["magnetic"][-1] == pytest.approx(1e3 * energy, abs=1e-3)
    assert (data["magnetic"] is None) == (env_id in ("MagFold/Tray-v0", "MagFold/Anchor-v0"))
    np.testing.assert_equal(page_of(twin, tmp_path), data)
    if not said[2]:
        action = env.action_space.sample()
        np.testing.assert_equal(env.step(action), twin.step(action))


def test_components_that_are_not_chosen_are_empty(tmp_path: Path) -> None:
    env = TubeFeedEnv(**QUICK)
    env.reset(seed=0)
    env.step([5, 3])
    data = page_of(env, tmp_path)
    assert sorted(data["sequence"]) == sorted([EMPTY, EMPTY, letters_of(SIGNS[5])])
    assert data["earlier"] == []


def test_what_was_chosen_before_is_shown_as_it_was(tmp_path: Path) -> None:
    env: Any = AnchorEnv()
    env.reset(seed=0)

    def faces(part: int, lie: int) -> str:
        return letters_of(SIGNS[LYING[env.setup.patterns[env.episodes.numbers[0], part], lie]])

    one, other = next(
        (first, second)
        for first in range(8)
        for second in range(8)
        if faces(1, first) != faces(1, second)
    )
    ends = []
    for action in ([0, 0, 3, 0], [1, one, 3, 0], [0, 0, 3, BACK], [1, other, 3, 0]):
        env.step(action)
        ends.append(seconds(env))
    data = page_of(env, tmp_path)
    second = int(env.episodes.arrays.order(0)[1])
    assert data["sequence"][second] == faces(1, other)
    ((frame, earlier),) = data["earlier"]
    assert earlier[second] == faces(1, one)
    assert data["time"][frame - 1] <= ends[2] < data["time"][frame]


def test_an_episode_that_cannot_be_played_is_refused(tmp_path: Path) -> None:
    env = TubeFeedEnv(**QUICK)
    page = tmp_path / "episode.html"
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.to_html(page)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="needs a step"):
        env.to_html(page)
    env.step([5, 3])
    env.set_state(env.get_state())
    env.step([5, 3])
    with pytest.raises(ValueError, match="no set_state"):
        env.to_html(page)
    still = TubeFeedEnv(**QUICK, fidelity="quasistatic")
    still.reset(seed=0)
    still.step([5, 3])
    with pytest.raises(ValueError, match="fidelity: 'quasistatic' is not allowed"):
        still.to_html(page)
    assert not list(tmp_path.iterdir())
