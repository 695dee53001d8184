"""Training settings: typed, checked and read from YAML."""

from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from agents.seeds import MAX_TRAINING_SEED
from magfold_env.envs.randomisation import Randomisation
from magfold_env.errors import problems_of
from magfold_env.files import configs_dir, write_text

Count = Annotated[int, Field(ge=1)]
Unit = Annotated[float, Field(ge=0, le=1)]


class SettingsError(ValueError):
    """Settings that cannot be used: one line per problem, each naming key, value and remedy."""


class _Group(BaseModel, frozen=True):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class EnvSettings(_Group, frozen=True):
    """The environment to train in; see `magfold_env.envs.tube_feed.TubeFeedEnv`."""

    scene: str = "tube-feed"
    """Name of a shipped scene, or a path."""
    targets: tuple[str, ...] | None = None
    """Words to draw from; None takes every fully folded word."""
    randomisation: Randomisation = "nominal"
    """Which physics is drawn at reset."""
    speeds: Annotated[int, Field(ge=2)] = 9
    """Number of speed levels."""
    shaping: bool = False
    """Whether every step is rewarded with its gain in similarity."""


class PPOSettings(_Group, frozen=True):
    """Hyper-parameters of Stable-Baselines3's PPO."""

    learning_rate: Annotated[float, Field(gt=0)] = 3e-4
    """Step size of Adam at the start."""
    anneal: bool = False
    """Whether the learning rate falls linearly to zero over the run."""
    n_steps: Annotated[int, Field(ge=2)] = 512
    """Steps of each environment between two updates."""
    batch_size: Annotated[int, Field(ge=2)] = 256
    """Steps in a minibatch."""
    n_epochs: Count = 10
    """Passes over the steps in an update."""
    gamma: Unit = 1.0
    """Discount, of the agent and of the shaping."""
    gae_lambda: Unit = 0.95
    """Trade-off of bias and variance in the advantages."""
    clip_range: Annotated[float, Field(gt=0)] = 0.2
    """How far an update may change the probability of an action, as a ratio."""
    ent_coef: Annotated[float, Field(ge=0)] = 0.01
    """Weight of the entropy bonus."""
    vf_coef: Annotated[float, Field(ge=0)] = 0.5
    """Weight of the value loss."""
    hidden: tuple[Count, ...] = (64, 64)
    """Widths of the hidden layers of policy and value network."""


class TrainSettings(_Group, frozen=True):
    """One training run."""

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    """Name of the run and of its folder under ``runs/``."""
    env: EnvSettings = EnvSettings()
    """The environment."""
    ppo: PPOSettings = PPOSettings()
    """The learner."""
    timesteps: Count = 200_000
    """Environment steps in all."""
    minutes: Annotated[float, Field(gt=0)] | None = None
    """Time limit; the run ends at whichever limit comes first. None sets none."""
    seed: Annotated[int, Field(ge=0, le=MAX_TRAINING_SEED)] = 0
    """Seed of networks, actions and episodes."""
    device: Literal["cpu", "cuda", "auto"] = "cpu"
    """Where the networks live; small ones are fastest on the processor."""
    processes: Count = 2
    """Environments, each in a process of its own (1: in the trainer's process)."""
    checkpoint_every: Count = 20_000
    """Steps between checkpoints."""
    validate_every: Count = 20_000
    """Steps between validations."""
    validation_episodes: Count = 52
    """Episodes of a validation, spread over the targets."""


def load_settings(path: str | Path, **overrides: Any) -> TrainSettings:
    """Read the settings in the YAML file `path`.

    Parameters
    ----------
    path : str or Path
        A file, or the name of one in ``configs/agents``, with or without its suffix.
    **overrides
        Top-level settings to replace; None leaves the file's value.

    Raises
    ------
    SettingsError
        If there is no such file or something in it is not allowed.
    """
    file = _find(path)
    try:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        raise SettingsError(f"{file}: not YAML: {error}") from None
    if not isinstance(content, dict):
        raise SettingsError(f"{file}: {content!r} is not allowed; must be a mapping of keys")
    content |= {key: value for key, value in overrides.items() if value is not None}
    try:
        return TrainSettings.model_validate(content)
    except ValidationError as error:
        lines = [f"{file}: {problem}" for problem in problems_of(error, TrainSettings)]
        raise SettingsError("\n".join(lines)) from None


def save_settings(settings: TrainSettings, path: Path) -> None:
    """Write `settings` as YAML to `path`, every field spelt out."""
    write_text(path, yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False))


def _find(path: str | Path) -> Path:
    """Return the file that `path` names."""
    folder = configs_dir() / "agents"
    for candidate in (Path(path), folder / path, folder / f"{path}.yaml"):
        if candidate.is_file():
            return candidate
    shipped = ", ".join(sorted(file.stem for file in folder.glob("*.yaml")))
    raise SettingsError(f"{path}: no such file; shipped settings: {shipped}")
