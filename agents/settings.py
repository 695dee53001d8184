"""Settings of training: typed, checked and read from YAML."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self, TypeVar, get_args

import pydantic
import yaml
from pydantic import Discriminator, Field, Tag, model_validator

from magfold_env.envs.spaces.actions import ActionKind
from magfold_env.envs.tasks.draws import Randomisation
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.reward import RewardKind, Shaping
from magfold_env.envs.tasks.setup import Fidelity, Reveal, Sight
from magfold_env.envs.tasks.symmetry import Split
from magfold_env.files import configs_dir, write_text
from magfold_env.scene import Problem, SceneError, errors, io
from magfold_env.scene.base import FrozenModel
from magfold_env.scoring.policy_file import (
    Algorithm,
    Count,
    Features,
    LSTMSettings,
    ObservationForm,
    Widths,
)
from magfold_env.scoring.track import FEED_TRACKS, TRACKS

MAX_TRAINING_SEED = 2**31 - 1
"""Largest training seed. Users choose training seeds, which are small numbers;
`magfold_env.envs.tasks.draws` makes the seeds for other purposes."""

Unit = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]

ALGORITHMS = get_args(Algorithm)


def word_or_other(value: Any) -> str:
    """Return the tag of the branch of a union to which a value belongs: text, or the other kind."""
    return "<word>" if isinstance(value, str) else "<other>"


AutoOr = Annotated[
    Annotated[Literal["auto"], Tag("<word>")] | Annotated[float, Tag("<other>")],
    Discriminator(word_or_other),
]
"""A number, or ``auto`` to let the learner adapt it."""


SettingsError = SceneError
"""Settings that cannot be used, with one line per problem that names key, value and remedy."""


class Group(FrozenModel, frozen=True):  # pyright: ignore[reportGeneralTypeIssues] (it is frozen too)
    """Settings that belong together; unknown keys are errors."""


GROUP = "group of settings"
"""Name of a settings file's content in error messages."""

Settings = TypeVar("Settings", bound=pydantic.BaseModel)

EnvId = Literal[
    "MagFold/TubeFeed-v0",
    "MagFold/SequenceDesign-v0",
    "MagFold/TubeFeedGoal-v0",
    "MagFold/UnknownFloor-v0",
    "MagFold/UnknownFloor-v1",
    "MagFold/Reprogram-v0",
    "MagFold/Lumen-v0",
    "MagFold/Tray-v0",
    "MagFold/Anchor-v0",
]
TUBE_FEED: EnvId = "MagFold/TubeFeed-v0"
DESIGN_ENV: EnvId = "MagFold/SequenceDesign-v0"
GOAL_ENV: EnvId = "MagFold/TubeFeedGoal-v0"
ANCHOR_ENV = "MagFold/Anchor-v0"

Targets = Annotated[
    Annotated[str, Tag("<word>")] | Annotated[tuple[str, ...], Tag("<other>")],
    Discriminator(word_or_other),
]
ShapingOption = Annotated[
    Annotated[Shaping, Tag("<word>")] | Annotated[bool, Tag("<other>")],
    Discriminator(word_or_other),
]


class EnvOptions(Group, frozen=True):
    """Options of an environment; None means the default.

    `magfold_env.envs.tasks.setup` describes the options that have no description here. The
    environment decides which options it accepts.
    """

    scene: str | None = None
    """Name of a shipped scene, or a path."""
    components: Annotated[int, Field(ge=2)] | None = None
    targets: Targets | None = None
    match: Match | None = None
    difficulty: Annotated[float, Field(gt=0, le=1)] | None = None
    fidelity: Fidelity | None = None
    randomisation: Randomisation | None = None
    speeds: Annotated[int, Field(ge=2)] | None = None
    actions: ActionKind | None = None
    catalogue: tuple[str, ...] | None = None
    reward: RewardKind | None = None
    shaping: ShapingOption | None = None
    baseline: bool | None = None
    """Whether a baseline is subtracted from the score."""
    tasks: str | None = None
    """Name or path of a list of given chains and the folds that they must reach."""
    split: Split | None = None
    sight: Sight | None = None
    reveal: Reveal | None = None


class EnvSettings(EnvOptions, frozen=True):
    """The environment to train in."""

    id: EnvId = TUBE_FEED
    """The environment's Gymnasium id."""

    def options(self, gamma: float | None = None) -> dict[str, Any]:
        """Return the keyword arguments for making the environment.

        `gamma` is the discount of the shaping; the goal environment has no shaping.
        """
        given = self.model_dump(exclude={"id"}, exclude_none=True)
        if given.pop("baseline", True) is False:
            given["baseline"] = None
        if gamma is not None and self.id != GOAL_ENV:
            given["gamma"] = gamma
        return given

    def changed(self, options: EnvOptions) -> Self:
        """Return these settings with the `options` that are not None."""
        return self.model_copy(update=options.model_dump(exclude_none=True))

    def unshaped(self) -> Self:
        """Return these settings without shaping, which changes rewards but not folds."""
        return self.model_copy(update={"shaping": None})


class _Learner(ObservationForm):
    """Settings that all learners share."""

    learning_rate: Positive = 3e-4
    """Initial step size of Adam."""
    anneal: bool = False
    """Whether the learning rate falls linearly to zero over each phase of the run."""
    gamma: Unit = 1.0
    """Discount factor of the agent and of the shaping."""
    batch_size: Annotated[int, Field(ge=2)] = 256
    """Steps in a minibatch."""
    hidden: Widths = (64, 64)
    """Widths of the hidden layers of every network."""
    features: Features = "chain"
    """Order in which networks see the chain: from its first component to its last; from the tube's
    mouth outward (see `agents.training.features.FromTheMouth`); or from the mouth and always from
    one side (see `agents.training.symmetry`). The latter two are for tube feed only, and the last
    only for PPO and MaskablePPO."""


class PPOSettings(_Learner):
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
    """Largest change of an action's probability in an update, as a ratio."""
    ent_coef: NonNegative = 0.01
    """Weight of the entropy bonus."""
    anneal_entropy: bool = False
    """Whether `ent_coef` falls linearly to zero over each phase, so that in the end the most
    probable action is as good as a sampled one."""
    vf_coef: NonNegative = 0.5
    """Weight of the value loss."""
    shared_layers: bool = False
    """Whether actor and critic have the same hidden layers, which halves the time of an update."""


class MaskablePPOSettings(PPOSettings):
    """Hyper-parameters of sb3-contrib's MaskablePPO."""

    algorithm: Literal["maskable-ppo"] = "maskable-ppo"  # pyright: ignore[reportIncompatibleVariableOverride]
    """PPO that never takes an action that the environment masks."""


class RecurrentPPOSettings(PPOSettings):
    """Hyper-parameters of sb3-contrib's RecurrentPPO."""

    algorithm: Literal["recurrent-ppo"] = "recurrent-ppo"  # pyright: ignore[reportIncompatibleVariableOverride]
    """PPO with recurrent networks."""
    lstm: LSTMSettings = LSTMSettings()
    """Memory of the networks."""


class HindsightSettings(Group, frozen=True):
    """Replay in which achieved goals take the place of the desired ones."""

    n_sampled_goal: Count = 4
    """Number of relabelled steps per true step."""
    goal_selection_strategy: Literal["future", "final", "episode"] = "future"
    """Which of the episode's achieved goals replaces the desired one."""


class SACSettings(_Learner):
    """Hyper-parameters of Stable-Baselines3's SAC."""

    algorithm: Literal["sac"] = "sac"
    """Soft actor-critic."""
    buffer_size: Count = 200_000
    """Number of steps in the replay buffer."""
    learning_starts: Count = 1_000
    """Steps with random actions before learning begins."""
    train_freq: Count = 1
    """Steps of each environment between two updates."""
    gradient_steps: Annotated[int, Field(ge=-1)] = 1
    """Minibatches per update; −1 means one per step since the last update, in all environments."""
    tau: Annotated[float, Field(gt=0, le=1)] = 0.005
    """Weight of the critics in the moving average that updates the target critics."""
    ent_coef: AutoOr = "auto"
    """Weight of the entropy."""
    target_entropy: AutoOr = "auto"
    """Target entropy for ``ent_coef: auto``; ``auto`` is minus the number of actions."""
    hindsight: HindsightSettings | None = None
    """Hindsight replay for the goal environment; None replays steps unchanged."""


class TQCSettings(SACSettings):
    """Hyper-parameters of sb3-contrib's TQC."""

    algorithm: Literal["tqc"] = "tqc"  # pyright: ignore[reportIncompatibleVariableOverride]
    """Truncated quantile critics."""
    top_quantiles_to_drop_per_net: Annotated[int, Field(ge=0)] = 2
    """Number of highest quantiles that the target omits, of the 25 of each critic."""


def _branch(value: Any) -> str | None:
    """Return the tag of the learner that `value` describes, or None if it is unknown."""
    given = value.get("algorithm") if isinstance(value, dict) else None
    name = getattr(value, "algorithm", given)
    return f"<{name}>" if name in ALGORITHMS else None


LearnerSettings = Annotated[
    Annotated[PPOSettings, Tag("<ppo>")]
    | Annotated[MaskablePPOSettings, Tag("<maskable-ppo>")]
    | Annotated[RecurrentPPOSettings, Tag("<recurrent-ppo>")]
    | Annotated[SACSettings, Tag("<sac>")]
    | Annotated[TQCSettings, Tag("<tqc>")],
    Discriminator(
        _branch,
        custom_error_type="learner",
        custom_error_message=f"its algorithm must be one of {', '.join(ALGORITHMS)}",
    ),
]
"""The learner and its hyper-parameters."""


class StopSettings(Group, frozen=True):
    """Validation results that end a phase early; None means no such condition."""

    success: Unit | None = None
    """Success rate at which the phase ends."""
    patience: Count | None = None
    """Number of consecutive validations without a new best result."""


class PhaseSettings(Group, frozen=True):
    """A phase of training before the main one."""

    timesteps: Count
    """Total environment steps."""
    env: EnvOptions = EnvOptions()
    """Environment options that differ from those of the main phase."""
    stop: StopSettings = StopSettings()
    """When the phase ends early."""


class Phase(NamedTuple):
    """A part of the run with its own environment and its own end."""

    timesteps: int
    env: EnvSettings
    stop: StopSettings


class ImitationSettings(Group, frozen=True):
    """Imitation before training."""

    plan: Literal["baseline", "drawing back", "mending"] = "baseline"
    """The imitated player: the tasks' baseline schedules; with given chains, the player in
    `agents.training.drawing_back`; with an anchor, the player in `agents.training.mending`."""
    tried: Count = 1000
    """Number of open loops tried per task."""
    trials: Count = 6000
    """Number of episodes in which open loops are tried."""
    episodes: Count = 1024
    """Number of imitated episodes, in which tasks take turns."""
    epochs: Count = 8
    """Number of passes over the steps of these episodes."""
    batch_size: Count = 512
    """Steps in a minibatch of imitation."""
    learning_rate: Positive = 1e-3
    """Learning rate of the first pass; it falls towards zero in equal steps from pass to pass."""
    random: Annotated[float, Field(ge=0, lt=1)] = 0.1
    """Fraction of the episodes' actions in which one random entry gets a random value; this value
    is not imitated."""


class TrainSettings(Group, frozen=True):
    """One training run."""

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    """Name of the run and of its folder under ``runs/``."""
    env: EnvSettings = EnvSettings()
    """The environment."""
    pretraining: tuple[PhaseSettings, ...] = ()
    """Phases before the main one, such as one without dynamics or with easier targets."""
    learner: LearnerSettings = PPOSettings()
    """The learner."""
    start: str | None = None
    """Policy file with the networks' initial weights; None means random weights."""
    imitate: ImitationSettings | None = None
    """Imitation before training; None means no imitation."""
    timesteps: Count = 200_000
    """Total environment steps of the main phase."""
    stop: StopSettings = StopSettings()
    """When the main phase ends early."""
    minutes: Positive | None = None
    """Time limit; the run ends when this limit or `timesteps` is reached. None means no limit."""
    seed: Annotated[int, Field(ge=0, le=MAX_TRAINING_SEED)] = 0
    """Seed of networks, actions and episodes."""
    device: Literal["cpu", "cuda", "auto"] = "cpu"
    """Device of the networks; small networks are fastest on the CPU."""
    envs: Count = 2
    """Number of environments that are stepped together."""
    checkpoint_every: Count = 20_000
    """Steps between checkpoints."""
    validate_every: Count = 20_000
    """Steps between validations."""
    validation_episodes: Count = 52
    """Number of episodes in a validation, spread over the targets."""

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The phases in order."""
        before = [Phase(p.timesteps, self.env.changed(p.env), p.stop) for p in self.pretraining]
        return (*before, Phase(self.timesteps, self.env, self.stop))

    @model_validator(mode="after")
    def _fits(self) -> Self:
        """Refuse a learner that does not support the environment."""
        found = (*self._of_learner(), *self._of_imitation())
        if found:
            raise SceneError([Problem(key, at, f"must be {allowed}") for key, at, allowed in found])
        return self

    def _of_learner(self) -> Iterator[tuple[str, object, str]]:
        """Yield key, value and allowed values of each setting that the learner does not support."""
        learner, env, features = self.learner, self.env, self.learner.features
        off_policy = isinstance(learner, SACSettings)
        hindsight = off_policy and learner.hindsight is not None
        if off_policy and env.actions != "box":
            yield "env.actions", env.actions, f"'box' with {learner.algorithm}"
        if hindsight and env.id != GOAL_ENV:
            yield "env.id", env.id, f"{GOAL_ENV!r} with hindsight"
        if learner.algorithm == "maskable-ppo" and env.actions == "box":
            yield "env.actions", env.actions, "'multidiscrete' or 'discrete' with maskable-ppo"
        if learner.algorithm == "maskable-ppo" and env.id in FEED_TRACKS:
            yield "env.id", env.id, "one in which magnets are chosen, with maskable-ppo"
        if features != "chain" and env.id not in (TUBE_FEED, GOAL_ENV):
            yield "env.id", env.id, f"{TUBE_FEED!r} or {GOAL_ENV!r} with features {features!r}"
        masked = learner.algorithm in ("ppo", "maskable-ppo")
        if features == "symmetric" and not (masked and env.actions in (None, "multidiscrete")):
            allowed = "'chain' or 'mouth', unless PPO or MaskablePPO has actions 'multidiscrete'"
            yield "learner.features", features, allowed
        shared = isinstance(learner, PPOSettings) and learner.shared_layers
        if shared and not (masked and features != "symmetric" and env.id != GOAL_ENV):
            allowed = f"false with {GOAL_ENV}, recurrent-ppo and features 'symmetric'"
            yield "learner.shared_layers", True, allowed
        if learner.frames > 1 and (features != "chain" or env.id == GOAL_ENV):
            allowed = f"1 with {GOAL_ENV} and with features other than 'chain'"
            yield "learner.frames", learner.frames, allowed
        if learner.view == "canonical" and env.id not in FEED_TRACKS:
            yield "learner.view", "canonical", f"'own', except with {', '.join(FEED_TRACKS)}"
        if learner.view == "canonical" and env.reveal is not None:
            yield "env.reveal", env.reveal, "left out with the canonical view"
        # Achieved goals show motion; if a chain is chosen as a whole, there is no motion to hide.
        if learner.blind and (hindsight or env.id == DESIGN_ENV):
            yield "learner.blind", True, f"false with {DESIGN_ENV} and with hindsight"

    def _of_imitation(self) -> Iterator[tuple[str, object, str]]:
        """Yield key, value and allowed values of each setting that imitation does not support."""
        if self.imitate is None:
            return
        plan, env_id = self.imitate.plan, self.env.id
        if self.learner.algorithm not in {"ppo", "recurrent-ppo"}:
            yield "learner.algorithm", self.learner.algorithm, "ppo or recurrent-ppo to imitate"
        if self.pretraining or env_id not in TRACKS:
            yield "env.id", env_id, f"one of {', '.join(TRACKS)}, without pretraining, to imitate"
        if plan == "drawing back" and env_id not in FEED_TRACKS:
            yield "imitate.plan", plan, "another one, except where a given chain folds"
        if plan == "mending" and env_id != ANCHOR_ENV:
            yield "imitate.plan", plan, f"another one, except with {ANCHOR_ENV}"


def load_settings(
    path: str | Path, assignments: Sequence[str] = (), **overrides: Any
) -> TrainSettings:
    """Read settings from a YAML file, or from the file of that name in ``configs/agents``.

    `assignments` such as ``learner.gamma=0.9`` replace settings at any depth; their values are
    YAML. `overrides` replace top-level settings; None leaves the file's value.

    Raises
    ------
    SettingsError
        If there is no such file, or something in it is not allowed.
    """
    content = io.read_mapping(find_config(path, "agents"), GROUP)
    content |= {key: value for key, value in overrides.items() if value is not None}
    for assignment in assignments:
        put(content, *parse_assignment(assignment))
    return checked(TrainSettings, content, path)


def env_settings(config: str, changes: Sequence[str]) -> EnvSettings:
    """Return the environment of training settings, changed by ``KEY=VALUE`` items in YAML.

    Rewards are not those of training but the environment's defaults, which measure a policy's gain
    over the minimiser.

    Raises
    ------
    ValueError
        If there are no such settings, a change is not allowed, or the agent does not choose
        magnets.
    """
    own = ["reward=null", "shaping=null"]
    settings = load_settings(config, [f"env.{change}" for change in own + list(changes)]).env
    if settings.id in TRACKS:
        raise ValueError(
            f"env.id: {settings.id!r} is not allowed; must be one in which magnets are chosen; "
            "magfold score plays the policies of this one"
        )
    return settings


def changed_settings(settings: TrainSettings, changes: Mapping[str, Any]) -> TrainSettings:
    """Return `settings` with changes, given by dotted key such as ``learner.gamma``.

    Raises
    ------
    SettingsError
        If there is no such key, or the value is not allowed.
    """
    content = settings.model_dump(mode="json")
    for key, value in changes.items():
        put(content, key, value)
    return checked(TrainSettings, content, settings.name)


def save_settings(settings: TrainSettings, path: Path) -> None:
    """Write `settings` with all fields as YAML to `path`."""
    write_text(path, yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False))


def checked(kind: type[Settings], content: Mapping[str, Any], source: str | Path) -> Settings:
    """Return the settings in `content`; errors name its `source`."""
    try:
        return kind.model_validate(content)
    except pydantic.ValidationError as error:
        raise SettingsError(errors.problems_of(error, kind), str(source)) from None


def find_config(path: str | Path, kind: str) -> Path:
    """Return the file at `path`, or the shipped file of that name in the folder `kind`."""
    folder = configs_dir() / kind
    for candidate in (Path(path), folder / path, folder / f"{path}.yaml"):
        if candidate.is_file():
            return candidate
    meant = errors.nearest(str(path), [file.stem for file in folder.glob("*.yaml")])
    raise SettingsError(f"{path}: no such file; must be one, or a name in configs/{kind}{meant}")


def parse_assignment(assignment: str) -> tuple[str, Any]:
    """Return the key and the value of ``key.key=value``; the value is YAML."""
    key, separator, text = assignment.partition("=")
    if not separator:
        raise SettingsError(f"{assignment!r} is not allowed; must be a key and a value, key=value")
    try:
        return key.strip(), io.parse_yaml(text)
    except SceneError as error:
        raise SettingsError(f"{assignment!r} is not allowed; its value: {error}") from None


def put(content: dict[str, Any], key: str, value: Any) -> None:
    """Set the dotted `key` in `content` to `value`."""
    *groups, last = key.split(".")
    for depth, group in enumerate(groups):
        content = content.setdefault(group, {})
        if not isinstance(content, dict):
            outer = ".".join(groups[: depth + 1])
            raise SettingsError(f"{key}={value} is not allowed; {outer} is not a group of settings")
    content[last] = value
