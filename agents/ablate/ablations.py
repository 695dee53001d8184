"""A trained policy for tube feed with a part of it taken away.

================ =================================================================================
seeing           the policy as it is
blind            no motion in what it sees, see `magfold_env.scoring.shown.blind`
frozen           the actions of one episode without randomisation, which starts straight, replayed
a speed          its choice of magnets, every component fed at this one speed [m/s]
random speeds    its choice of magnets, the speed of each step drawn evenly from those on offer,
                 which lie evenly on a log scale
built beforehand the magnets and speeds of ``frozen``, all magnets acting inside the tube too
================ =================================================================================

With other speeds than its own a policy goes on seeing the chain, and the speeds that were taken.
"""

from functools import cache
from typing import Any

import numpy as np

from agents.evaluation import episodes, policies
from agents.settings import EnvSettings
from magfold_env.envs.fold_env import FoldEnv

SEEING, BLIND, FROZEN = "seeing", "blind", "frozen"
RANDOM_SPEEDS, BUILT = "random speeds", "built beforehand"

Ablation = str | float
"""One of the names, or a speed [m/s]."""


def ablations(env: FoldEnv[Any]) -> list[Ablation]:
    """Return all that can be tried in an environment; nothing is built without dynamics."""
    built = [BUILT] if env.task.fidelity == "dynamics" else []
    return [SEEING, BLIND, FROZEN, *env.actions.speeds.tolist(), RANDOM_SPEEDS, *built]


class SpeedPolicy(policies.Policy):
    """Plays the magnets of another policy at one speed [m/s], at random ones for None."""

    def __init__(self, policy: policies.Policy, speed: float | None) -> None:
        self._policy, self._speed = policy, speed

    def begin(self) -> None:
        """Forget all episodes before the next."""
        self._policy.begin()

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the policy's action with another speed."""
        faces, _ = env.actions.decode(self._policy.act(env, observation, rng))
        speed = float(rng.choice(env.actions.speeds)) if self._speed is None else self._speed
        return env.actions.encode(faces, speed)


def ablated(ablation: Ablation, name: str, settings: EnvSettings, target: str) -> policies.Policy:
    """Return what plays a target; `name` is as `agents.evaluation.policies.make_policy` wants it.

    Raises
    ------
    ValueError
        If the simulation of the episode that is to be replayed broke down.
    """
    if ablation == BLIND:
        return episodes.own_policy(policies.BLIND + name)
    if ablation in (FROZEN, BUILT):
        return policies.FrozenPolicy({target: _rehearsed(name, settings, target)})
    policy = episodes.own_policy(name)
    if ablation == SEEING:
        return policy
    return SpeedPolicy(policy, None if isinstance(ablation, str) else ablation)


def play(
    ablation: Ablation, name: str, settings: EnvSettings, target: str, seed: int
) -> tuple[bool, float]:
    """Return success and score of an episode, whose draws follow from `seed`."""
    env = episodes.own_env(settings)
    end = episodes.play(ablated(ablation, name, settings, target), env, target, seed)
    built = episodes.built_beforehand(env, end.scene, target) if ablation == BUILT else None
    return built or (end.success, end.score)


@cache
def _rehearsed(name: str, settings: EnvSettings, target: str) -> policies.OpenLoop:
    """Return what a policy chooses where nothing is drawn."""
    env = episodes.own_env(settings.model_copy(update={"randomisation": "none"}))
    choice = episodes.play(episodes.own_policy(name), env, target, seed=0).choice
    if choice is None:
        raise ValueError(f"{name}: without randomisation the simulation of {target} broke down")
    return choice
