"""Tests that sharing hidden layers changes which weights are trained, and nothing else."""

from typing import Any

import pytest
import torch

from agents.training import policy_files
from agents.training.envs import make_training_envs
from agents.training.models import make_model
from tests.agents.training import tiny

CASES = [("ppo", "chain"), ("ppo", "mouth"), ("maskable-ppo", "mouth")]


@pytest.mark.medium
@pytest.mark.parametrize(("algorithm", "features"), CASES)
def test_a_file_holds_the_layers_for_the_actor_and_for_the_critic(algorithm, features, tmp_path):
    settings = tiny(algorithm, own={"features": features, "shared_layers": True}, envs=3)
    envs = make_training_envs(settings, 0)
    model: Any = make_model(settings.learner, envs, 0)
    policy_files.save(model, tmp_path / "policy.safetensors")
    separate: Any = policy_files.load(tmp_path / "policy.safetensors").policy
    seen = torch.as_tensor(envs.reset())
    actions = torch.as_tensor(model.policy(seen)[0])
    own, others = (each.evaluate_actions(seen, actions) for each in (model.policy, separate))
    assert all(torch.equal(a, b) for a, b in zip(own, others, strict=True))
    assert torch.equal(model.policy.predict_values(seen), separate.predict_values(seen))
    hidden = sum(each.numel() for each in model.policy.mlp_extractor.parameters())
    assert 2 * hidden == sum(each.numel() for each in separate.mlp_extractor.parameters())
    envs.close()


def test_both_losses_train_the_layers() -> None:
    settings = tiny(own={"shared_layers": True})
    envs = make_training_envs(settings, 0)
    policy: Any = make_model(settings.learner, envs, 0).policy
    seen = torch.as_tensor(envs.reset())
    parameters = list(policy.mlp_extractor.parameters())
    for k in range(2):
        policy.zero_grad()
        policy.evaluate_actions(seen, policy(seen)[0])[k].sum().backward()
        assert all(bool(each.grad.any()) for each in parameters)
    envs.close()
