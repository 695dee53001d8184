"""Settings of an environment: which one, and the options that differ from its defaults."""

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag

from agents.settings.base import Count, Group, Unit, word_or_other
from magfold_env.envs.spaces.action_table import ActionKind
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.options import Fidelity
from magfold_env.envs.tasks.randomisation import Randomisation
from magfold_env.envs.tasks.reward import RewardKind, Shaping

EnvId = Literal[
    "MagFold/TubeFeed-v0",
    "MagFold/SequenceDesign-v0",
    "MagFold/TubeFeedGoal-v0",
    "MagFold/FeedControl-v0",
]
TUBE_FEED: EnvId = "MagFold/TubeFeed-v0"
GOAL_ENV: EnvId = "MagFold/TubeFeedGoal-v0"
CONTROL_ENV: EnvId = "MagFold/FeedControl-v0"

Targets = Annotated[
    Annotated[str, Tag("<word>")] | Annotated[tuple[str, ...], Tag("<other>")],
    Discriminator(word_or_other),
]
ShapingOption = Annotated[
    Annotated[Shaping, Tag("<word>")] | Annotated[bool, Tag("<other>")],
    Discriminator(word_or_other),
]


class EnvOptions(Group, frozen=True):
    """Options of an environment, `magfold_env.envs.tasks.options`; None is what holds without.

    Which environment takes which option is for the environment to say.
    """

    scene: str | None = None
    """Name of a shipped scene, or a path."""
    components: Annotated[int, Field(ge=2)] | None = None
    """Chain length."""
    targets: Targets | None = None
    """Words to draw from, or the name or path of a target suite."""
    match: Match | None = None
    """Whether a fold must be the target, or cover its cells."""
    difficulty: Annotated[float, Field(gt=0, le=1)] | None = None
    """Share of the targets to draw from, the easiest ones first."""
    fidelity: Fidelity | None = None
    """Whether the chain is simulated or folds by energy alone."""
    randomisation: Randomisation | None = None
    """Which physics is drawn at reset."""
    speeds: Annotated[int, Field(ge=2)] | None = None
    """Number of speed levels."""
    actions: ActionKind | None = None
    """How actions are written."""
    catalogue: tuple[str, ...] | None = None
    """Components that can be built."""
    reward: RewardKind | None = None
    """How an episode is rewarded at its end."""
    shaping: ShapingOption | None = None
    """Whether every step is rewarded with its gain in similarity, or in energy."""
    baseline: bool | None = None
    """False: nothing is subtracted from the score."""
    tasks: str | None = None
    """Name of a list of feed control's tasks."""


class EnvSettings(EnvOptions, frozen=True):
    """The environment to train in."""

    id: EnvId = TUBE_FEED
    """Its name with Gymnasium."""

    def options(self) -> dict[str, Any]:
        """Return the keyword arguments that the environment is made with."""
        given = self.model_dump(exclude={"id"}, exclude_none=True)
        if given.pop("baseline", True) is False:
            given["baseline"] = None
        return given

    def changed(self, options: EnvOptions) -> Self:
        """Return these settings with the `options` that are not None."""
        return self.model_copy(update=options.model_dump(exclude_none=True))

    def unshaped(self) -> Self:
        """Return these settings without shaping, which changes rewards and no fold."""
        return self.model_copy(update={"shaping": None})


class CurriculumSettings(Group, frozen=True):
    """Easier variants to begin with; see `magfold_env.envs.wrappers.curriculum.Curriculum`."""

    stages: Annotated[tuple[EnvOptions, ...], Field(min_length=1)]
    """What is different in each stage before the environment itself, the easiest first."""
    threshold: Unit = 0.8
    """Share of successes that leads to the next stage."""
    window: Count = 100
    """Number of episodes that the share is taken over."""
