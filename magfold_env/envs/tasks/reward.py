"""Rewards of episodes and of their steps.

The **score** of an episode is 1 if the chain settled in the target, 0 if the simulation failed or
the task's time limit was reached, and else half the chain's similarity to the target
(`magfold_env.envs.tasks.goals`). The last step's reward is

- ``relative``: the score minus b. b is the mean score of the energy minimiser's design for the same
  target and randomisation (`magfold_env.envs.baselines.baseline`). If the agent sets only the
  speed, b is the score of the best constant speed (`magfold_env.envs.baselines.constant_speed`).
  Targets differ in difficulty; this reward measures how far an agent exceeds b.
- ``score``: the score itself.
- ``sparse``: 1 for a success, else 0.

**Shaping** adds γ Φ(next) − Φ(now) to every step, with Φ = 0 at the end. It does not change
which policies are best (Ng, Harada and Russell 1999). Φ is half of one of these:

- ``similarity``: the similarity of the present chain to the target, 0 to 1;
- ``energy``: the magnetic energy of the present chain divided by that of the same components in the
  target's shape, clipped to [0, 1]. This is the share of the target's energy that the chain has
  released. If the target's energy is not negative, Φ is 0.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from magfold_env.envs.chains.arrays import Bools, Floats
from magfold_env.envs.tasks.checks import one_of, require
from magfold_env.scene.errors import is_number

RewardKind = Literal["relative", "score", "sparse"]
Shaping = Literal["similarity", "energy"]


@dataclass(frozen=True)
class RewardRule:
    """How an episode is rewarded."""

    kind: RewardKind = "relative"
    """What the last step earns."""
    shaping: Shaping | None = None
    """The additional reward of every step."""
    gamma: float = 1.0
    """Discount of the shaping."""

    @classmethod
    def of(cls, kind: RewardKind, shaping: bool | Shaping, gamma: float) -> "RewardRule":
        """Return the rule for the options of an environment."""
        one_of("reward", kind, RewardKind)
        one_of("shaping", shaping, (True, False, *get_args(Shaping)))
        right = is_number(gamma) and 0.0 <= gamma <= 1.0
        require(right, "gamma", gamma, "must be between 0 and 1")
        if isinstance(shaping, bool):
            return cls(kind, "similarity" if shaping else None, gamma)
        return cls(kind, shaping, gamma)

    def step(self, before: Floats, after: Floats) -> Floats:
        """Return the shaping reward of each step from the potentials before and after it."""
        return self.gamma * after - before

    def end(self, score: Floats, success: Bools, baseline: Floats) -> Floats:
        """Return the rewards that the last steps of episodes earn in addition."""
        if self.kind == "relative":
            return score - baseline
        return score if self.kind == "score" else np.asarray(success, dtype=np.float64)


def energy_potential(energy: Floats, wanted: Floats) -> Floats:
    """Return the potential Φ for energy-based shaping from present and target energies [J]."""
    share = np.divide(energy, wanted, out=np.zeros_like(energy), where=wanted < 0.0)
    return 0.5 * np.clip(share, 0.0, 1.0)
