"""``MagFold/TubeFeed-v0``: choose each component's magnets and feed speed as it leaves the tube."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.actions import ActionTable
from magfold_env.envs.baseline import Baseline, unknown_baseline
from magfold_env.envs.baseline_store import BaselineStore
from magfold_env.envs.episode import Episode, feedable
from magfold_env.envs.observation import ChainState, ObservationLayout
from magfold_env.envs.randomisation import Randomisation, randomised
from magfold_env.envs.reward import is_success, potential, score
from magfold_env.envs.targets import pick_target, resolve_targets
from magfold_env.scene import Scene
from magfold_env.scene_io import load_scene

DEFAULT_SCENE = "tube-feed"
RENDER_MODES = ("rgb_array", "ansi")


class TubeFeedEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.int64]]):
    """Feed a chain of ``n`` components out of a tube so that it folds into a target word.

    Step ``k`` sets the four magnets and the feed speed of the ``k``-th component to leave the
    tube (component ``k`` in forward feed, ``n + 1 − k`` in backward feed), and feeds it out. In
    the step of the last component the chain also settles and the episode terminates: the
    horizon is ``n``, and there is no time limit. A simulation that breaks down ends it early.

    **Action**: ``MultiDiscrete([16, speeds])``. First the magnet pattern, four bits in the order
    front-left, back-left, back-right, front-right, the first the most significant, N = 0 and
    S = 1 (0 is NNNN, 8 is SNNN, 15 is SSSS). Then the speed level, log-spaced from 0.01 to
    0.6 m/s, both included.

    **Observation**: a flat ``Box(−1, 1)`` of ``17 n − 4`` entries, component 1 first.

    ======== ========= ========================================================= =============
    group    entries   meaning and unit                                          range
    ======== ========= ========================================================= =============
    target   3 (n − 1) the wanted letter of each joint, one-hot over L, S, R     0, 1
    released n         1 once a component is out; their sum is the step index    0, 1
    magnets  4 n       front-left, back-left, back-right, front-right:           −1, 0, 1
                       1 N, −1 S, 0 not set yet
    speed    n         feed speed asked for, log scale: −1 is 0.01 m/s,          [−1, 1]
                       1 is 0.6 m/s; 0 where not set yet
    joint    n − 1     relative angle, in units of π rad                         [−1, 1]
    heading  2 n       sine and cosine of the heading                            [−1, 1]
    rate     n         angular rate of the heading, x / (100 rad/s)              (−1, 1) *
    position 2 n       centre, mouth of the tube at 0, x / chain length          (−1, 1) *
    velocity 2 n       velocity of the centre, x / (1 m/s)                       (−1, 1) *
    ======== ========= ========================================================= =============

    Entries marked * are squashed by ``x / (1 + |x|)``, so nothing is clipped away. With the
    scene known, these entries and the action fix the next state: the task is a Markov decision
    process as long as nothing is drawn. With ``randomisation`` it is partially observed, because
    the drawn friction, remanence, masses and speed error are not shown.

    **Reward**: at the end ``score − b(target)``. The score is 1 if the chain settles with every
    joint within 0.05 rad of the target word, else half the similarity of the shapes, and 0 if
    the simulation fails. ``b`` is what the energy minimiser's own design scores on average
    (`magfold_env.envs.baseline`). With ``shaping``, every step adds ``γ Φ(next) − Φ(now)``, where
    Φ is half the similarity of the chain as it is now, and 0 at the end.

    **Info**: ``target``, ``word``, ``step``; at the end also ``status``, ``message``, ``energy``
    [J] (no number if the simulation failed), ``score``, ``baseline``, ``baseline_flagged`` (no
    design is known and b is 0) and ``is_success``.

    Parameters
    ----------
    scene : str, Path or Scene
        A tube scene with ``feed.loading`` ``at_mouth``: a shipped name, a path or the scene.
        Its sequence and feed speeds are the agent's to choose and so are ignored: every face
        gets a magnet. A scene in an external field has no baseline and so needs ``baseline=None``.
    targets : sequence of str, optional
        Words to draw from at reset; every fully folded word of the chain by default.
    randomisation : {"none", "nominal", "scene"}
        Physics drawn at reset. ``none``: nothing, released straight. ``nominal``: friction
        ±10 %, remanence ±5 %, feed speeds ±5 %, release angles ±0.03 rad. ``scene``: the
        spreads that the scene gives.
    speeds : int
        Number of speed levels. The default of 9 has the baseline's five speeds among them.
    shaping : bool
        Whether to add the potential-based shaping.
    gamma : float
        Discount of the shaping; must be the agent's own.
    baseline : {"auto"} or None
        ``auto``: take b from the package data or the disk cache, compute it where neither has
        it. None: b is 0.
    render_mode : {"rgb_array", "ansi"}, optional
        What `render` returns.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 4}  # noqa: RUF012

    def __init__(
        self,
        scene: str | Path | Scene = DEFAULT_SCENE,
        *,
        targets: Sequence[str] | None = None,
        randomisation: Randomisation = "nominal",
        speeds: int = 9,
        shaping: bool = False,
        gamma: float = 1.0,
        baseline: Literal["auto"] | None = "auto",
        render_mode: str | None = None,
    ) -> None:
        if not 0.0 <= gamma <= 1.0:
            raise ValueError(f"gamma: {gamma} is not allowed; must be between 0 and 1")
        if baseline not in ("auto", None):
            raise ValueError(f"baseline: {baseline!r} is not allowed; must be 'auto' or None")
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ValueError(
                f"render_mode: {render_mode!r} is not allowed; "
                f"must be None or one of {', '.join(RENDER_MODES)}"
            )
        given = scene if isinstance(scene, Scene) else load_scene(scene)
        self._scene = randomised(feedable(given), randomisation)
        if baseline == "auto" and self._scene.field is not None and self._scene.field.any:
            raise ValueError(
                "baseline: 'auto' is not allowed with scene.field; energy minimisation does not "
                "know of external fields, must be None"
            )
        self._targets = resolve_targets(targets, self._scene.n)
        self._actions = ActionTable(speeds)
        self._layout = ObservationLayout(self._scene.n, self._scene.casing.side)
        self._baselines = BaselineStore(self._scene) if baseline == "auto" else None
        self._shaping = shaping
        self._gamma = gamma
        self._episode: Episode | None = None
        self._target = self._targets[0]
        self._baseline = unknown_baseline(self._target)
        self.render_mode = render_mode
        self.action_space = self._actions.space
        self.observation_space = self._layout.space

    @property
    def scene(self) -> Scene:
        """The scene that episodes are drawn from, randomisation included."""
        return self._scene

    @property
    def targets(self) -> tuple[str, ...]:
        """The words that `reset` draws from."""
        return self._targets

    @property
    def actions(self) -> ActionTable:
        """How actions are read."""
        return self._actions

    @property
    def layout(self) -> ObservationLayout:
        """Where each group of entries lies in an observation."""
        return self._layout

    @property
    def state(self) -> ChainState:
        """The chain as it is, beyond what an observation tells of it."""
        return self._running().state

    @property
    def target(self) -> str:
        """The word that this episode wants."""
        return self._target

    @property
    def baseline(self) -> Baseline:
        """The energy minimiser's result for the target of this episode."""
        return self._baseline

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`.

        May take some seconds where neither the package nor the disk cache has it.
        """
        if self._baselines is None:
            return unknown_baseline(target)
        return self._baselines.get(target)

    @property
    def next_component(self) -> int:
        """Index of the component that the next step feeds (component number − 1)."""
        return self._running().next_component

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Load a new chain; ``options={"target": word}`` fixes the target.

        Everything random is drawn here, the target first and whether or not it is fixed, so one
        seed gives one physics whatever the target.

        Raises
        ------
        ValueError
            For an unknown option or a target that is not among the env's.
        """
        super().reset(seed=seed)
        options = options or {}
        unknown = sorted(set(options) - {"target"})
        if unknown:
            raise ValueError(f"options: {unknown[0]!r} is not allowed; must be 'target'")
        drawn = self._targets[int(self.np_random.integers(len(self._targets)))]
        self._target = pick_target(options.get("target", drawn), self._targets)
        self._episode = Episode(self._scene, self.np_random)
        self._baseline = self.baseline_of(self._target)
        return self._observation(self._episode), self._info(self._episode)

    def step(
        self, action: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the next component's magnets and feed speed and feed it out.

        Raises
        ------
        ValueError
            If the action lies outside the space.
        gymnasium.error.ResetNeeded
            Before the first reset and after the end of an episode.
        """
        episode = self._running()
        if episode.finished:
            raise gymnasium.error.ResetNeeded("the episode is over; call reset() first")
        before = self._potential(episode)
        episode.feed(self._actions.decode(action))
        reward = self._gamma * self._potential(episode) - before
        if episode.finished:
            reward += score(episode.status, episode.joint_angles, self._target)
            reward -= self._baseline.score
        info = self._info(episode)
        return self._observation(episode), reward, episode.finished, False, info

    def render(self) -> Any:
        """Return the chain as an image or as text, as `render_mode` says; None without one."""
        if self.render_mode is None:
            return None
        episode = self._running()
        caption = f"fed {len(episode.choices)} of {self._scene.n}, {episode.word}"
        if self.render_mode == "ansi":
            return f"target {self._target}, {caption}\n"
        # Drawing needs the `render` extra, simulating does not.
        from magfold_env.render import frame  # noqa: PLC0415

        state = episode.state
        released = int(episode.released.sum())
        return frame(
            episode.scene_so_far, state.angles, state.base, released, self._target, caption
        )

    def to_scene(self) -> Scene:
        """Return the finished episode as a concrete scene: `simulate` replays it bit for bit."""
        return self._running().to_scene()

    def _running(self) -> Episode:
        """Return the current episode."""
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("no episode has begun; call reset() first")
        return self._episode

    def _potential(self, episode: Episode) -> float:
        """Return Φ of the present state, 0 at the end and without shaping."""
        if not self._shaping or episode.finished:
            return 0.0
        return potential(episode.joint_angles, self._target)

    def _observation(self, episode: Episode) -> NDArray[np.float32]:
        return self._layout.observe(episode.state, episode.released, episode.choices, self._target)

    def _info(self, episode: Episode) -> dict[str, Any]:
        info: dict[str, Any] = {
            "target": self._target,
            "word": episode.word,
            "step": len(episode.choices),
        }
        if episode.finished:
            joints = episode.joint_angles
            info |= {
                "status": str(episode.status),
                "message": episode.message,
                "energy": episode.energy,
                "score": score(episode.status, joints, self._target),
                "baseline": self._baseline.score,
                "baseline_flagged": self._baseline.flagged,
                "is_success": is_success(episode.status, joints, self._target),
            }
        return info
