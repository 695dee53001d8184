"""Vector environments: many chains stepped by one compiled call.

``gymnasium.make_vec(id, num_envs=m)`` makes one. Its results equal those of
`gymnasium.vector.SyncVectorEnv` with single environments and the same seeds, bit for bit.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar, cast

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, iterate
from numpy.typing import NDArray

from magfold_env.envs.chain_env import ChainEnv, Limited
from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.episodes import Columns, Episodes, EpisodesState
from magfold_env.envs.pictures.snapshots import snapshot_of
from magfold_env.envs.pictures.viewer import Viewer
from magfold_env.envs.tasks import checks
from magfold_env.parallel import threads_of
from magfold_env.scene.errors import refuse, unless_a, unless_one_of

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

ObsType = TypeVar("ObsType")
Infos = dict[str, Any]


class ChainVectorEnv(  # pyright: ignore[reportIncompatibleVariableOverride] (as in ChainEnv)
    Limited, VectorEnv[ObsType, Any, NDArray[Any]], Generic[ObsType]
):
    """Vector environment of many chains, each in its own episode.

    Parameters
    ----------
    num_envs : int
        Number of environments.
    autoreset_mode : AutoresetMode or str
        Gymnasium's mode, which sets when a new episode follows one that has ended.
    threads : int, optional
        Number of threads that simulate; by default, one per core that the process may use. Results
        do not depend on it.
    max_episode_steps : int, optional
        Number of steps after which episodes are truncated, as by `gymnasium.wrappers.TimeLimit`; by
        default, and with −1, only the task ends them.
    **options
        Options of the single environment.

    Raises
    ------
    ValueError
        If an argument has a value that is not allowed; the message names it and the allowed values.
    """

    single: ClassVar[Any]
    """The class of a single environment, a `magfold_env.envs.chain_env.ChainEnv`."""

    @classmethod
    def of(cls, single: type[ChainEnv[Any]]) -> type[Self]:
        """Return the vector form of an environment, with a matching name, in the same module."""
        name = f"{single.__name__.removesuffix('Env')}VectorEnv"
        body = {"single": single, "__module__": single.__module__, "__doc__": cls.__doc__}
        return cast("type[Self]", type(name, (cls,), body))

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        max_episode_steps: int | None = None,
        **options: Any,
    ) -> None:
        checks.whole("num_envs", num_envs, 1)
        shown, allowed = options.get("render_mode"), "must be None, 'rgb_array' or 'ansi'"
        alone = str(shown) in ("human", "rgb_array_list")
        checks.require(not alone, "render_mode", shown, f"{allowed} with many environments")
        mode = getattr(autoreset_mode, "value", autoreset_mode)
        checks.one_of("autoreset_mode", mode, [each.value for each in AutoresetMode])
        self.autoreset_mode = AutoresetMode(mode)
        threads = threads_of(threads)
        one = self.single(**options)
        given: Any = max_episode_steps
        own = not unless_one_of("", given, (None, -1))
        limit = None if own else checks.whole("max_episode_steps", given, 1, None)
        self.max_episode_steps = one.max_episode_steps if own else limit
        self.template: Any = one
        """A single environment with the same options, which is never stepped."""
        self.num_envs = num_envs
        self.render_mode = one.render_mode
        self.metadata = {**one.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_action_space = one.action_space
        self.single_observation_space = one.observation_space
        self.action_space = batch_space(one.action_space, num_envs)
        self.observation_space = batch_space(one.observation_space, num_envs)
        self.episodes: Episodes[ObsType] = one.make_episodes(one.setup, num_envs, threads)
        self._viewer = Viewer(one.render_mode, one.metadata["render_fps"])

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[ObsType, Infos]:
        """Begin new episodes.

        Parameters
        ----------
        seed : int or sequence of int, optional
            The first environment's seed, from which the others count up, or one seed per
            environment.
        options : mapping, optional
            Options of the single environment: one value for all, or a list with one value each.
            ``reset_mask``, an array of bool, selects the environments to reset.

        Raises
        ------
        ValueError, TypeError
            If the number of seeds is wrong, or an option is unknown or not allowed.
        """
        refuse(unless_a("options", options, (Mapping, type(None)), "a mapping"))
        options, episodes = options or {}, self.episodes
        given = episodes.parse_reset_options(options, ("reset_mask",))
        mask = checks.mask_of(options, self.num_envs)
        for row, number in enumerate(checks.seeds_of(seed, self.num_envs)):
            if number is not None and mask[row]:
                episodes.rngs[row], _ = seeding.np_random(number)
        rows = np.flatnonzero(mask)
        episodes.begin(rows, given)
        return episodes.observe(), self._spread(rows, episodes.infos(rows))

    def step(self, actions: Any) -> tuple[ObsType, Floats, Bools, Bools, Infos]:
        """Take a step in every environment.

        Raises
        ------
        ValueError
            If an action is not in the space.
        gymnasium.error.ResetNeeded
            Before the first reset or, in the mode DISABLED, if an episode has ended.
        """
        episodes = self.episodes
        choice = self.template.setup.actions.read(actions, self.num_envs)
        episodes.check_begun()
        over = episodes.terminated | self._truncated
        if self.autoreset_mode == AutoresetMode.DISABLED and over.any():
            raise gymnasium.error.ResetNeeded(
                f"the episodes of environments {np.flatnonzero(over).tolist()} are over; "
                "call reset(options={'reset_mask': ...}) first"
            )
        rows = episodes.rows
        if over.any():
            rows = np.flatnonzero(~over)
            choice = tuple(part[rows] for part in choice)
        rewards = np.zeros(self.num_envs)
        rewards[rows], ends = episodes.step(rows, choice)
        terminated, truncated = episodes.terminated & ~over, self._truncated & ~over
        ended = terminated | truncated
        infos: Infos = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and ended.any():
            infos = self._final(ended, terminated, ends)
            ends = {}
            episodes.begin(np.flatnonzero(ended))
        elif over.any():
            episodes.begin(np.flatnonzero(over))
        infos |= self._spread(episodes.rows, episodes.infos(episodes.rows))
        infos |= self._spread(np.flatnonzero(terminated), ends)
        return episodes.observe(), rewards, terminated, truncated, infos

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the masks of all environments, (m, …); see the single form's ``action_masks``."""
        masks = self.episodes.action_masks(self.template.actions)
        if masks is None:
            return np.repeat(self.template.action_masks()[None], self.num_envs, axis=0)
        return masks

    def get_state(self) -> EpisodesState:
        """Return the complete state of the environments.

        Later steps do not change the returned state, and it can be set any number of times.
        """
        return self.episodes.get_state()

    def set_state(self, state: EpisodesState) -> ObsType:
        """Restore a state of these environments, or of others made with the same options.

        Later steps repeat exactly. Returns the observations.
        """
        self.episodes.set_state(state)
        return self.episodes.observe()

    def render(self) -> tuple[Any, ...]:
        """Return a picture or text of each environment, according to `render_mode`."""
        self.episodes.check_begun()
        return tuple(
            self._viewer.render(partial(self.snapshot, row)) for row in range(self.num_envs)
        )

    def snapshot(self, row: int) -> "Snapshot":
        """Return the content of a picture of environment `row`."""
        return snapshot_of(self.episodes, row)

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads."""
        self.episodes.close()
        self.template.close()

    @property
    def _truncated(self) -> Bools:
        """Which episodes have reached `max_episode_steps`, (m,)."""
        return self.episodes.steps >= (self.max_episode_steps or np.inf)

    def _final(self, ended: Bools, terminated: Bools, ends: Columns) -> Infos:
        """Return the last observations and infos of episodes that end in this step."""
        final = np.full(self.num_envs, None, dtype=object)
        observations = list(iterate(cast("Any", self).observation_space, self.episodes.observe()))
        rows = np.flatnonzero(ended)
        for row in rows.tolist():
            final[row] = observations[row]
        infos = self._spread(rows, self.episodes.infos(rows))
        infos |= self._spread(np.flatnonzero(terminated), ends)
        return {
            "final_obs": final,
            "_final_obs": ended.copy(),
            "final_info": infos,
            "_final_info": ended.copy(),
        }

    def _spread(self, rows: Ints, columns: Columns) -> Infos:
        """Return infos of the given environments in Gymnasium's form: full arrays with masks."""
        mask = np.zeros(self.num_envs, dtype=np.bool_)
        mask[rows] = True
        infos: Infos = {}
        for key, values in columns.items():
            infos[key] = np.zeros(self.num_envs, dtype=values.dtype)
            if values.dtype == object:
                infos[key][:] = None
            infos[key][rows] = values
            infos[f"_{key}"] = mask.copy()
        return infos
