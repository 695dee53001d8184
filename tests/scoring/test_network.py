"""Tests that networks without torch act like those of Stable-Baselines3."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces

from agents.training import policy_files
from magfold_env.files import configs_dir
from magfold_env.scoring import policy_file
from magfold_env.scoring.network import Actor
from magfold_env.scoring.policy_file import PolicySettings

MEMORY = {"hidden": 5, "layers": 2}
BOX = {"low": [-1.0, -0.2], "high": [1.0, 3.0]}
CASES = [
    ("ppo", "tanh", [8, 6], 1, BOX), ("ppo", "relu", [], 3, {"n": 11}),
    ("ppo", "tanh", [8], 2, {"nvec": [16, 5]}), ("maskable-ppo", "relu", [6], 1, {"n": 4}),
    ("sac", "relu", [8, 8], 3, BOX), ("tqc", "tanh", [5], 1, BOX),
    ("recurrent-ppo", "tanh", [6], 1, BOX), ("recurrent-ppo", "relu", [], 2, {"n": 9}),
]  # fmt: skip


def untrained(path: Path, **changes: Any) -> PolicySettings:
    """Write a policy with random weights."""
    settings = PolicySettings.model_validate(
        {
            "algorithm": "ppo", "features": "chain", "actor": [8], "critic": [4],
            "activation": "tanh", "observations": {"low": [-1.0] * 7, "high": [1.0] * 7},
            "actions": {"n": 3}, "steps": 0,
        }
        | changes
    )  # fmt: skip
    torch.manual_seed(0)
    made = policy_files.make(settings).state_dict()
    # As wide as to reach the bounds of actions.
    weights = {name: 3.0 * each.numpy() for name, each in made.items()}
    policy_file.write(path, settings, weights)
    return settings


def same(path: Path, space: Any) -> None:
    """Assert that both policies choose the same actions for random observations."""
    rng = np.random.default_rng(0)
    actor, policy = Actor.read(path), policy_files.load(path).policy
    assert actor.observation_space == space
    state: Any = None
    remembered: Any = None
    for _ in range(3):
        seen = rng.uniform(-1.0, 1.0, (200, *space.shape)).astype(np.float32)
        begun = rng.random(200) < 0.2
        chosen, state = actor.predict(seen, state, begun)
        expected, remembered = policy.predict(seen, remembered, begun, deterministic=True)
        assert chosen.shape == expected.shape
        if isinstance(actor.action_space, spaces.Box):
            assert all(each in actor.action_space for each in chosen)
            np.testing.assert_allclose(chosen, expected, atol=1e-5)
        else:
            np.testing.assert_array_equal(chosen, expected)
        assert len(np.unique(chosen, axis=0)) > 2


@pytest.mark.parametrize(("algorithm", "activation", "actor", "frames", "actions"), CASES)
def test_every_kind_of_network_chooses_what_torch_does(
    algorithm: str, activation: str, actor: list[int], frames: int, actions: Any, tmp_path: Path
) -> None:
    path = tmp_path / "policy.safetensors"
    untrained(
        path, algorithm=algorithm, activation=activation, actor=actor, frames=frames,
        actions=actions, lstm=MEMORY if algorithm == "recurrent-ppo" else None,
    )  # fmt: skip
    same(path, policy_files.load(path).policy.observation_space)


def test_shipped_policies_choose_what_torch_does_or_are_refused() -> None:
    for path in sorted((configs_dir() / "policies").glob("*.safetensors")):
        settings = policy_file.read(path).settings
        if settings.features == "chain":
            same(path, policy_files.load(path).policy.observation_space)
        else:
            with pytest.raises(ValueError, match=f"{path.name}: features: '{settings.features}'"):
                Actor.read(path)


@pytest.mark.parametrize(("changes", "message"), [
    ({"features": "mouth"}, "features: 'mouth' is not allowed; must be 'chain'"),
    ({"boxes": True}, r"observations.boxes: \['a'\] is not allowed; must be a box"),
])  # fmt: skip
def test_other_networks_are_refused(changes: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "policy.safetensors"
    seen = {"low": [-1.0] * 47, "high": [1.0] * 47}  # of three components on tube feed
    boxes = {"boxes": {"a": seen}} if changes.pop("boxes", False) else seen
    untrained(path, observations=boxes, **changes)
    with pytest.raises(ValueError, match=rf"policy\.safetensors: {message}"):
        Actor.read(path)


def test_weights_that_do_not_fit_are_named(tmp_path: Path) -> None:
    path = tmp_path / "policy.safetensors"
    settings = untrained(path)
    file = policy_file.read(path)
    shapes = {name: each["shape"] for name, each in file.tensors.items()}
    weights = file.weights(shapes)
    policy_file.write(path, settings, weights | {"action_net.bias": np.zeros(4, np.float32)})
    with pytest.raises(ValueError, match=r"weights: action_net\.bias: .* F32 numbers, \[3"):
        Actor.read(path)
    large = {name: np.full_like(each, 1e38) for name, each in weights.items()}
    policy_file.write(path, settings, large)
    with pytest.raises(ValueError, match="weights: are too large"):
        Actor.read(path).predict(np.ones((1, 7), np.float32))
