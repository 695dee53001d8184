"""Hyper-parameters of the learners, told apart by ``algorithm``."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Discriminator, Field, Tag

from agents.settings.base import AutoOr, Count, Group, NonNegative, Positive, Unit


class _Learner(Group, frozen=True):
    """What all learners have."""

    learning_rate: Positive = 3e-4
    """Step size of Adam at the start."""
    anneal: bool = False
    """Whether the learning rate falls linearly to zero over each phase of the run."""
    gamma: Unit = 1.0
    """Discount, of the agent and of the shaping."""
    batch_size: Annotated[int, Field(ge=2)] = 256
    """Steps in a minibatch."""
    hidden: tuple[Count, ...] = (64, 64)
    """Widths of the hidden layers of every network."""
    features: Literal["chain", "mouth", "symmetric"] = "chain"
    """Whether networks see the chain from its first component to its last, or from the tube's mouth
    outward, see `agents.features.FromTheMouth`, or so and always from one side, see
    `agents.symmetry`; the latter two for tube feed alone, the last for PPO and MaskablePPO."""


class PPOSettings(_Learner, frozen=True):
    """Hyper-parameters of Stable-Baselines3's PPO."""

    algorithm: Literal["ppo"] = "ppo"
    """Proximal policy optimisation."""
    n_steps: Annotated[int, Field(ge=2)] = 512
    """Steps of each environment between two updates."""
    n_epochs: Count = 10
    """Passes over the steps in an update."""
    gae_lambda: Unit = 0.95
    """Trade-off of bias and variance in the advantages."""
    clip_range: Positive = 0.2
    """How far an update may change the probability of an action, as a ratio."""
    ent_coef: NonNegative = 0.01
    """Weight of the entropy bonus."""
    vf_coef: NonNegative = 0.5
    """Weight of the value loss."""


class MaskablePPOSettings(PPOSettings, frozen=True):
    """Hyper-parameters of sb3-contrib's MaskablePPO."""

    algorithm: Literal["maskable-ppo"] = "maskable-ppo"  # pyright: ignore[reportIncompatibleVariableOverride]
    """PPO that never takes an action that the environment masks."""


class HindsightSettings(Group, frozen=True):
    """Replay with the goals that were achieved in place of those that were wanted."""

    n_sampled_goal: Count = 4
    """Relabelled steps for every true one."""
    goal_selection_strategy: Literal["future", "final", "episode"] = "future"
    """Which moment of the episode gives the goal."""


class SACSettings(_Learner, frozen=True):
    """Hyper-parameters of Stable-Baselines3's SAC."""

    algorithm: Literal["sac"] = "sac"
    """Soft actor-critic."""
    buffer_size: Count = 200_000
    """Steps that the replay buffer holds."""
    learning_starts: Count = 1_000
    """Steps with random actions before learning begins."""
    train_freq: Count = 1
    """Steps of each environment between two updates."""
    gradient_steps: Annotated[int, Field(ge=-1)] = 1
    """Minibatches in an update; −1: as many as steps were made since the last, all environments
    together."""
    tau: Annotated[float, Field(gt=0, le=1)] = 0.005
    """Share of the critics that the target critics take over in an update."""
    ent_coef: AutoOr = "auto"
    """Weight of the entropy."""
    target_entropy: AutoOr = "auto"
    """The entropy that ``ent_coef: auto`` steers to; ``auto`` is minus the number of actions."""
    hindsight: HindsightSettings | None = None
    """Hindsight replay, for the goal environment; None replays what was."""


class TQCSettings(SACSettings, frozen=True):
    """Hyper-parameters of sb3-contrib's TQC."""

    algorithm: Literal["tqc"] = "tqc"  # pyright: ignore[reportIncompatibleVariableOverride]
    """Truncated quantile critics."""
    top_quantiles_to_drop_per_net: Annotated[int, Field(ge=0)] = 2
    """Highest quantiles of each critic, of 25, that the target leaves out."""


ALGORITHMS = ("ppo", "maskable-ppo", "sac", "tqc")


def _branch(value: Any) -> str | None:
    """Return the tag of the learner that `value` describes; None if it names no known one."""
    name = value.algorithm if isinstance(value, BaseModel) else None  # pyright: ignore[reportAttributeAccessIssue]
    if isinstance(value, dict):
        name = value.get("algorithm")
    return f"<{name}>" if name in ALGORITHMS else None


LearnerSettings = Annotated[
    Annotated[PPOSettings, Tag("<ppo>")]
    | Annotated[MaskablePPOSettings, Tag("<maskable-ppo>")]
    | Annotated[SACSettings, Tag("<sac>")]
    | Annotated[TQCSettings, Tag("<tqc>")],
    Discriminator(
        _branch,
        custom_error_type="learner",
        custom_error_message=f"its algorithm must be one of {', '.join(ALGORITHMS)}",
    ),
]
"""The learner and its hyper-parameters."""
