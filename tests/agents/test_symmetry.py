from typing import Any, cast

import numpy as np
import pytest
import torch
from gymnasium import spaces

from agents.training.envs import make_training_envs
from agents.training.models import make_model
from agents.training.symmetry import VIEWS, FromOneSide, SymmetricPolicy, is_symmetric
from magfold_env.envs.spaces.actions import SIGNS
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.tube_feed_goal import TubeFeedGoalEnv
from magfold_env.scene import Scene, load_scene, save_scene
from magfold_env.shapes import mirror
from tests.agents.training import LEARNERS, tiny

TARGET = "LRRL"
PATTERNS = (3, 9, 12, 5, 6)
SPEEDS = (4, 6, 3, 5, 4)


def other_pattern(pattern: int, in_mirror: bool, exchanged: bool) -> int:
    """Return the pattern of a mirror image, with or without exchanged poles, found face by face."""
    bits = [pattern >> 3 & 1, pattern >> 2 & 1, pattern >> 1 & 1, pattern & 1]
    front_left, back_left, back_right, front_right = bits
    if in_mirror:
        bits = [front_right, back_right, back_left, front_left]
    if exchanged:
        bits = [1 - bit for bit in bits]
    return int("".join(map(str, bits)), 2)


def scene_file(folder: Any, direction: str) -> str:
    path = folder / f"{direction}.yaml"
    if not path.exists():
        save_scene(load_scene("tube-feed").replace(feed={"direction": direction}), path)
    return str(path)


def episode(env: Any, in_mirror: bool, exchanged: bool) -> list[Any]:
    """Return the observations of an episode, or of its mirror image with exchanged poles."""
    target = mirror(TARGET) if in_mirror else TARGET
    observation, _ = env.reset(seed=0, options={"target": target})
    seen = [observation]
    for pattern, speed in zip(PATTERNS, SPEEDS, strict=True):
        action = np.array([other_pattern(pattern, in_mirror, exchanged), speed])
        seen.append(env.step(action)[0])
    return seen


def batch(observations: list[Any]) -> Any:
    if isinstance(observations[0], dict):
        names = observations[0]
        return {name: torch.tensor(np.array([o[name] for o in observations])) for name in names}
    return torch.tensor(np.array(observations))


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("kind", [TubeFeedEnv, TubeFeedGoalEnv])
@pytest.mark.parametrize("fidelity", ["dynamics", "quasistatic"])
def test_four_episodes_look_alike(tmp_path: Any, direction: str, kind: Any, fidelity: str) -> None:
    env = kind(
        scene=scene_file(tmp_path, direction), components=5, fidelity=fidelity, randomisation="none"
    )
    features = FromOneSide(env.observation_space, direction == "backward")
    seen = features(batch(episode(env, False, False)))
    assert seen.shape == (6, features.features_dim)
    assert not torch.equal(seen[1], seen[2])
    for in_mirror, exchanged in ((True, False), (False, True), (True, True)):
        other = features(batch(episode(env, in_mirror, exchanged)))
        torch.testing.assert_close(other[:, :-VIEWS], seen[:, :-VIEWS], atol=1e-5, rtol=0.0)
        turned = other[:, -VIEWS:] != seen[:, -VIEWS:]
        assert turned[:, 0].tolist() == [in_mirror] * 6
        # Before the first component is out there are no poles to exchange.
        assert turned[:, 1].tolist() == [False] + [exchanged] * 5


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_choices_are_turned_with_the_chain(tmp_path: Any, direction: str) -> None:
    env = TubeFeedEnv(scene=scene_file(tmp_path, direction), components=5, fidelity="quasistatic")
    policy = SymmetricPolicy(
        env.observation_space, env.action_space, lambda _: 1e-3, net_arch=[16],
        features_extractor_class=FromOneSide,
        features_extractor_kwargs={"backward": direction == "backward"},
    )  # fmt: skip
    with torch.no_grad():
        policy.action_net.layer.weight *= 100.0  # it begins all but even

    def probabilities(observations: list[Any]) -> tuple[Any, Any, Any]:
        shown = batch(observations[1:])
        with torch.no_grad():
            patterns, speeds = cast("Any", policy.get_distribution(shown)).distribution
            return patterns.probs.numpy(), speeds.probs.numpy(), policy.predict_values(shown)

    patterns, speeds, values = probabilities(episode(env, False, False))
    assert np.ptp(patterns) > 0.01
    for in_mirror, exchanged in ((True, False), (False, True), (True, True)):
        order = [other_pattern(k, in_mirror, exchanged) for k in range(len(SIGNS))]
        others = probabilities(episode(env, in_mirror, exchanged))
        assert others[0][:, order] == pytest.approx(patterns, abs=1e-5)
        assert others[1] == pytest.approx(speeds, abs=1e-5)
        torch.testing.assert_close(others[2], values, atol=1e-5, rtol=0.0)


def test_devices_with_a_left_and_a_right_and_other_actions_are_refused(tmp_path: Any) -> None:
    even = load_scene("tube-feed")
    assert is_symmetric(even)
    assert is_symmetric(even.replace(magnets={"width": (0.004, 0.006, 0.006, 0.004)}))
    assert is_symmetric(even.replace(gravity={"in_plane": (0.5, 0.0)}))
    uneven: list[Scene] = [
        even.replace(magnets={"width": (0.004, 0.006, 0.006, 0.006)}),
        even.replace(magnets={"remanence": (0.6, 0.5, 0.6, 0.6)}),
        even.replace(field={"uniform": (0.0, 2e-5)}),
        even.replace(gravity={"in_plane": (0.0, 0.5)}),
    ]
    for scene in uneven:
        assert not is_symmetric(scene)
    save_scene(uneven[0], tmp_path / "s.yaml")
    learner = {"algorithm": "ppo", "features": "symmetric", "hidden": [16], **LEARNERS["ppo"]}
    env = {"components": 3, "fidelity": "quasistatic", "scene": str(tmp_path / "s.yaml")}
    settings = tiny(learner=learner, env=env)
    with pytest.raises(ValueError, match=r"learner\.features: 'symmetric' is not allowed"):
        make_model(settings.learner, make_training_envs(settings, 0), 0)
    seen = spaces.Box(-1.0, 1.0, (81,))
    for actions in (spaces.Discrete(16), spaces.MultiDiscrete([4, 9]), spaces.MultiDiscrete([16])):
        with pytest.raises(ValueError, match=r"action_space: .* is not allowed; must be Multi"):
            SymmetricPolicy(seen, actions, lambda _: 1e-3, features_extractor_class=FromOneSide)


@pytest.mark.medium
@pytest.mark.parametrize("algorithm", ["ppo", "maskable-ppo"])
@pytest.mark.parametrize("env_id", ["MagFold/TubeFeed-v0", "MagFold/TubeFeedGoal-v0"])
def test_a_symmetric_policy_learns(env_id: str, algorithm: str) -> None:
    learner = {"algorithm": algorithm, "features": "symmetric", "hidden": [16]}
    options = {"components": 3, "fidelity": "quasistatic"}
    settings = tiny(learner=learner | LEARNERS[algorithm], env={"id": env_id, **options})
    envs = make_training_envs(settings, 0)
    model: Any = make_model(settings.learner, envs, 0)
    before = [each.clone() for each in model.policy.parameters()]
    model.learn(100)
    assert not any(map(torch.equal, before, model.policy.parameters()))
