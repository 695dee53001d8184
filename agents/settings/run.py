"""Training settings: typed, checked and read from YAML."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import Field, ValidationError, model_validator

from agents.settings.base import Count, Group, Positive, Unit
from agents.settings.env import GOAL_ENV, TUBE_FEED, CurriculumSettings, EnvOptions, EnvSettings
from agents.settings.files import SettingsError, find_config, parse_assignment, put, read_mapping
from agents.settings.learner import LearnerSettings, PPOSettings, SACSettings
from agents.settings.seeds import MAX_TRAINING_SEED
from magfold_env.files import write_text
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.errors import problems_of

__all__ = [
    "EnvSettings",
    "SettingsError",
    "TrainSettings",
    "changed_settings",
    "load_settings",
    "save_settings",
]


class StopSettings(Group, frozen=True):
    """When a phase ends before its steps are made, as the validations say; None: not for that."""

    success: Unit | None = None
    """Rate of success that is enough."""
    patience: Count | None = None
    """Number of validations in a row without a new best one."""


class PhaseSettings(Group, frozen=True):
    """A phase of training before the main one."""

    timesteps: Count
    """Environment steps in all."""
    env: EnvOptions = EnvOptions()
    """What is different in the environment."""
    stop: StopSettings = StopSettings()
    """When the phase ends early."""


@dataclass(frozen=True)
class Phase:
    """A part of the run, with its own environment and its own end."""

    timesteps: int
    env: EnvSettings
    stop: StopSettings


class TrainSettings(Group, frozen=True):
    """One training run."""

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    """Name of the run and of its folder under ``runs/``."""
    env: EnvSettings = EnvSettings()
    """The environment."""
    curriculum: CurriculumSettings | None = None
    """Easier variants of the environment, each left when enough episodes succeed."""
    pretraining: tuple[PhaseSettings, ...] = ()
    """Phases before the main one, such as one without dynamics."""
    learner: LearnerSettings = PPOSettings()
    """The learner."""
    timesteps: Count = 200_000
    """Environment steps in all, of the main phase."""
    stop: StopSettings = StopSettings()
    """When the main phase ends early."""
    minutes: Positive | None = None
    """Time limit; the run ends at whichever limit comes first. None sets none."""
    seed: Annotated[int, Field(ge=0, le=MAX_TRAINING_SEED)] = 0
    """Seed of networks, actions and episodes."""
    device: Literal["cpu", "cuda", "auto"] = "cpu"
    """Where the networks live; small ones are fastest on the processor."""
    envs: Count = 2
    """Number of environments that are stepped together."""
    stepping: Literal["native", "processes", "serial"] | None = None
    """How they are: by one compiled call, each in a process of its own, or one after another;
    None: the first of these that can be. Results do not depend on it."""
    checkpoint_every: Count = 20_000
    """Steps between checkpoints."""
    validate_every: Count = 20_000
    """Steps between validations."""
    validation_episodes: Count = 52
    """Episodes of a validation, spread over the targets."""

    @property
    def phases(self) -> tuple[Phase, ...]:
        """What is trained on, in this order."""
        before = [Phase(p.timesteps, self.env.changed(p.env), p.stop) for p in self.pretraining]
        return (*before, Phase(self.timesteps, self.env, self.stop))

    @model_validator(mode="after")
    def _fits(self) -> Self:
        """Refuse a learner that cannot take the environment."""
        problems: list[Problem] = []
        learner, env = self.learner, self.env
        if isinstance(learner, SACSettings):
            if env.actions != "box":
                allowed = f"must be 'box' with {learner.algorithm}"
                problems.append(Problem("env.actions", env.actions, allowed))
            if learner.hindsight is not None and env.id != GOAL_ENV:
                problems.append(Problem("env.id", env.id, f"must be {GOAL_ENV!r} with hindsight"))
        elif learner.algorithm == "maskable-ppo" and env.actions in ("box", "dict"):
            allowed = "must be 'multidiscrete' or 'discrete' with maskable-ppo"
            problems.append(Problem("env.actions", env.actions, allowed))
        if learner.features != "chain":
            if env.id not in (TUBE_FEED, GOAL_ENV):
                allowed = (
                    f"must be {TUBE_FEED!r} or {GOAL_ENV!r} with features {learner.features!r}"
                )
                problems.append(Problem("env.id", env.id, allowed))
            if learner.features == "symmetric" and (
                isinstance(learner, SACSettings) or env.actions not in (None, "multidiscrete")
            ):
                allowed = "must be 'chain' or 'mouth' but for PPO with actions 'multidiscrete'"
                problems.append(Problem("learner.features", learner.features, allowed))
            if self.curriculum is not None:
                # Chains of other lengths are filled up, which moves their entries.
                value, allowed = learner.features, "must be 'chain' with a curriculum"
                problems.append(Problem("learner.features", value, allowed))
        if problems:
            raise SceneError(problems)
        return self


def load_settings(
    path: str | Path, assignments: Sequence[str] = (), **overrides: Any
) -> TrainSettings:
    """Read the settings in the YAML file `path`.

    Parameters
    ----------
    path : str or Path
        A file, or the name of one in ``configs/agents``, with or without its suffix.
    assignments : sequence of str
        Settings at any depth to replace, such as ``learner.gamma=0.9``; the values are YAML.
    **overrides
        Top-level settings to replace; None leaves the file's value.

    Raises
    ------
    SettingsError
        If there is no such file or something in it is not allowed.
    """
    file = find_config(path, "agents")
    content = read_mapping(file)
    content |= {key: value for key, value in overrides.items() if value is not None}
    for assignment in assignments:
        put(content, *parse_assignment(assignment))
    return _checked(content, str(file))


def changed_settings(settings: TrainSettings, changes: Mapping[str, Any]) -> TrainSettings:
    """Return `settings` with other values.

    Parameters
    ----------
    settings : TrainSettings
        What is changed.
    changes : mapping
        Values by dotted key, such as ``learner.gamma``.

    Raises
    ------
    SettingsError
        If there is no such key, or the value is not allowed.
    """
    content = settings.model_dump(mode="json")
    for key, value in changes.items():
        put(content, key, value)
    return _checked(content, settings.name)


def save_settings(settings: TrainSettings, path: Path) -> None:
    """Write `settings` as YAML to `path`, every field spelt out."""
    write_text(path, yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False))


def _checked(content: dict[str, Any], source: str) -> TrainSettings:
    """Return the settings that `content` holds, which comes from `source`."""
    try:
        return TrainSettings.model_validate(content)
    except ValidationError as error:
        lines = [f"{source}: {problem}" for problem in problems_of(error, TrainSettings)]
        raise SettingsError("\n".join(lines)) from None
