from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces

from agents.training import policy_files
from agents.training.envs import make_training_envs
from agents.training.features import FromTheMouth
from agents.training.models import make_model
from magfold_env.envs.spaces.observation import chain_layout
from magfold_env.envs.tube_feed_goal import TubeFeedGoalEnv
from magfold_env.envs.wrappers.mouth_order import WIDTHS
from magfold_env.scene import load_scene, save_scene
from tests.agents.training import tiny

N = 5
LAYOUT = chain_layout(N, side=1.0)


def numbered(step: int, backward: bool) -> np.ndarray:
    """Return an observation with numbered entries, except those that mark released components."""
    observation = np.arange(1.0, LAYOUT.size + 1)
    released = np.arange(N) < step
    observation[LAYOUT.slices["released"]] = released[::-1] if backward else released
    return observation


def seen(step: int, backward: bool) -> list[float]:
    space = spaces.Box(-1.0, 1.0, (LAYOUT.size,))
    features = FromTheMouth(space, backward)
    batch = torch.tensor(numbered(step, backward)[None], dtype=torch.float32)
    result = features(batch)
    assert result.shape == (1, features.features_dim)
    return result[0].tolist()


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("step", range(N + 1))
def test_everything_is_counted_from_the_mouth(step: int, backward: bool) -> None:
    observation = numbered(step, backward)

    def entries(group: str, width: int, fed: int) -> list[float]:
        """Return the entries of the component number `fed`, from 0; zeros if there is none."""
        rows = observation[LAYOUT.slices[group]].reshape(-1, width)
        if not 0 <= fed < len(rows):
            return [0.0] * width
        return rows[len(rows) - 1 - fed if backward else fed].tolist()

    wanted: list[float] = []
    for ahead in range(N - 1):
        wanted += entries("target", 3, step - 1 + ahead)
    for group, width in (("target", 3), ("joint", 1)):
        for back in range(1, N):
            wanted += entries(group, width, step - 1 - back)
    for group, width in WIDTHS.items():
        for back in range(N):
            wanted += entries(group, width, step - 1 - back)
    wanted += [float(number == step) for number in range(N + 1)]
    assert seen(step, backward) == wanted


def test_other_observations_are_refused() -> None:
    for size in (0, LAYOUT.size - 1, LAYOUT.size + 1):
        with pytest.raises(ValueError, match="must be that of MagFold/TubeFeed-v0"):
            FromTheMouth(spaces.Box(-1.0, 1.0, (size,)))


@pytest.mark.parametrize("backward", [False, True])
def test_wanted_angles_take_the_place_of_letters(backward: bool) -> None:
    env = TubeFeedGoalEnv(components=N, fidelity="quasistatic")
    features = FromTheMouth(env.observation_space, backward)
    wanted = np.arange(1.0, N)
    chain = np.zeros(env.layout.size)
    released = np.arange(N) < 2
    chain[env.layout.slices["released"]] = released[::-1] if backward else released
    chain[env.layout.slices["joint"]] = 10.0 * wanted
    goal = np.append(wanted, 1.0)
    batch = {"observation": chain, "desired_goal": goal, "achieved_goal": 0.0 * goal}
    seen = features({name: torch.tensor(each[None]).float() for name, each in batch.items()})
    assert seen.shape == (1, features.features_dim)
    order = wanted[::-1] if backward else wanted
    ahead = [*order[1:], 0.0]
    behind = [order[0], 0.0, 0.0, 0.0]
    assert seen[0, : 3 * (N - 1)].tolist() == [*ahead, *behind, *(10 * each for each in behind)]


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_a_policy_file_states_the_direction(tmp_path: Any, direction: str) -> None:
    save_scene(load_scene("tube-feed").replace(feed={"direction": direction}), tmp_path / "s.yaml")
    env: dict[str, Any] = {"components": 3, "fidelity": "quasistatic"}
    settings = tiny(own={"features": "mouth"}, env=env | {"scene": str(tmp_path / "s.yaml")})
    envs = make_training_envs(settings, 0)
    model = make_model(settings.learner, envs, 0)
    policy_files.save(model, tmp_path / "policy.safetensors")
    loaded = policy_files.load(tmp_path / "policy.safetensors").policy
    order: Any = loaded.get_submodule("features_extractor").get_buffer("_order")
    mirrored = FromTheMouth(envs.observation_space, direction == "backward")
    assert torch.equal(order, mirrored.get_buffer("_order"))
