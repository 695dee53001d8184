"""What all episodes of an environment share, and the options that set it."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Literal, TypedDict

from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.spaces.actions import ActionKind
from magfold_env.envs.tasks.checks import one_of
from magfold_env.envs.tasks.draws import Randomisation, randomised
from magfold_env.envs.tasks.goals import Match
from magfold_env.envs.tasks.reward import RewardKind, RewardRule, Shaping
from magfold_env.envs.tasks.targets import pick_target
from magfold_env.scene import Scene

Fidelity = Literal["dynamics", "quasistatic"]


class World:
    """Scene, targets, actions, observations and rewards, without a chain.

    Parameters
    ----------
    scene : Scene
        A tube scene.
    options : mapping
        Options of the environment. Of these, ``fidelity``, ``match``, ``randomisation``,
        ``reward``, ``shaping`` and ``gamma`` are read here; see `FoldOptions`.
    randomisation, reward : str
        Defaults of these two options.

    Attributes
    ----------
    scene : Scene
        The template of episodes, including the randomisation.
    words : tuple of str
        The words that `reset` draws from, or those of its tasks.
    match : {"word", "outline"}
        What counts as reaching a word.
    randomisation : {"none", "nominal", "strong", "scene"}
        Extent of the random draws.
    fidelity : {"dynamics", "quasistatic"}
        Whether chains are simulated.
    actions : ActionTable or SpeedTable
        Encoding and decoding of actions.
    layout : ObservationLayout or CameraLayout
        The slice of each group of entries in an observation.
    rule : RewardRule
        How episodes are rewarded.
    """

    option: ClassVar[tuple[str, type]] = ("target", str)
    """The option of `reset` that fixes what is drawn, and the type of its value."""

    words: tuple[str, ...]
    actions: Any
    layout: Any

    def __init__(
        self,
        scene: Scene,
        options: Mapping[str, Any],
        randomisation: Randomisation = "nominal",
        reward: RewardKind = "score",
    ) -> None:
        self.fidelity: Fidelity = one_of("fidelity", options.get("fidelity", "dynamics"), Fidelity)
        self.match: Match = one_of("match", options.get("match", "word"), Match)
        self.randomisation: Randomisation = options.get("randomisation", randomisation)
        self.scene = randomised(scene, self.randomisation)
        self.rule = RewardRule.of(
            options.get("reward", reward), options.get("shaping", False), options.get("gamma", 1.0)
        )

    @property
    def in_field(self) -> bool:
        """Whether an external field acts, which energy minimisation does not include."""
        return self.scene.field is not None and self.scene.field.any

    @cached_property
    def lattice(self) -> LatticeFeed:
        """The rules by which energy minimisation folds the chain."""
        return LatticeFeed(self.scene)

    def number_of(self, value: Any) -> int:
        """Return the number of the target or task that `value` of the option names.

        Raises
        ------
        ValueError
            If there is none.
        """
        return self.words.index(pick_target(value, self.words))


class ChainOptions(TypedDict, total=False):
    """Options for the fold and the choices; all are optional."""

    components: int | None
    """Chain length; by default that of the suite or the scene."""
    targets: Sequence[str] | str | None
    """Words to draw from at reset, or the name or path of a target suite
    (`magfold_env.designer.suites`), which also sets the chain length; by default every fully
    folded word of the chain."""
    match: Match
    """``word``: the fold must be the target. ``outline``: it must cover the same cells, in
    any order (`magfold_env.shapes.outline`)."""
    difficulty: float
    """Share of the targets to draw from, the easiest first (`magfold_env.envs.tasks.targets`);
    above 0, and 1 by default."""
    fidelity: Fidelity
    """``dynamics``: the chain is simulated. ``quasistatic``: energy alone decides one joint after
    another, without speed, friction, randomisation or baseline."""
    randomisation: Randomisation
    """Physics drawn at reset. ``none``: no draws, a straight chain. ``nominal`` (default):
    friction ±10 %, remanence ±5 %, speed of each component ±5 %, release angles ±0.03 rad.
    ``strong``: ±30 %, ±10 %, ±20 %, and ±0.1 rad or the tube's clearance. ``scene``: the scene's
    own spreads."""
    speeds: int
    """Number of speed levels. The default, 9, includes the baseline's five speeds."""
    actions: ActionKind
    """How actions are written. ``multidiscrete`` (default): the patterns of magnets, then the speed
    level. ``discrete``: these as one number, up to a million. ``box``: four numbers from −1 to 1 a
    component, above 0 is N, then the speed on a log scale from −1 to 1."""
    catalogue: Sequence[str] | None
    """Components that can be built, such as ``["NSNS", "NNSS"]``; all 16 by default. The nearest
    of them replaces any other, and `action_masks` excludes the others."""


class RewardOptions(TypedDict, total=False):
    """How episodes are rewarded."""

    reward: RewardKind
    """``relative``, ``score`` or ``sparse``; see `magfold_env.envs.tasks.reward`. By default
    ``relative`` where magnets are chosen, and ``score`` where tasks are given."""
    shaping: bool | Shaping
    """Potential-based shaping: False (default), ``similarity`` (or True) or ``energy``."""
    gamma: float
    """Discount of the shaping, 1 by default; must be the agent's own."""


class FoldOptions(ChainOptions, RewardOptions, total=False):
    """What is folded, how it is chosen, and how it is rewarded."""

    baseline: Literal["auto"] | None
    """``auto`` (default): take b from the package data or the disk cache, or compute it. None: b is
    0."""
