import numpy as np
import pytest

from magfold_env.envs.tasks.reward import RewardRule, energy_potential


def test_the_three_kinds_of_reward() -> None:
    score, success, baseline = np.array([0.4, 1.0]), np.array([False, True]), np.array([0.9, 0.9])
    assert RewardRule("relative").end(score, success, baseline) == pytest.approx([-0.5, 0.1])
    assert RewardRule("score").end(score, success, baseline).tolist() == [0.4, 1.0]
    assert RewardRule("sparse").end(score, success, baseline).tolist() == [0.0, 1.0]


def test_shaping_telescopes() -> None:
    rule = RewardRule(gamma=0.9)
    potentials = np.array([0.1, 0.5, 0.3, 0.0])
    steps = rule.step(potentials[:-1], potentials[1:])
    discounted = sum(0.9**k * reward for k, reward in enumerate(steps))
    assert discounted == pytest.approx(0.9**3 * potentials[-1] - potentials[0])


def test_energy_is_a_share_of_what_the_target_would_release() -> None:
    energies = np.array([-1.0, -2.0, -3.0, 1.0, -1.0, -1.0, 1.0])
    wanted = np.array([-2.0] * 4 + [0.0, 2.0, 2.0])
    shares = [0.25, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0]
    assert energy_potential(energies, wanted).tolist() == shares


def test_shaping_may_be_switched_on_without_a_name() -> None:
    assert RewardRule.of("score", True, 1.0).shaping == "similarity"
    assert RewardRule.of("score", False, 1.0).shaping is None
    assert RewardRule.of("score", "energy", 1.0).shaping == "energy"
