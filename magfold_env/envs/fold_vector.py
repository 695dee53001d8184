"""What the vector environments in which magnets are chosen have in common."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from magfold_env.envs.chains.dynamic import DynamicFleet
from magfold_env.envs.chains.goals import GoalBoard
from magfold_env.envs.chains.history import Chronicle
from magfold_env.envs.chains.protocol import Fleet
from magfold_env.envs.chains.quasistatic import QuasistaticFleet
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.pictures.moments import fold_moment
from magfold_env.envs.pictures.rendering import Viewer
from magfold_env.envs.tasks.vector_options import (
    autoreset_mode_of,
    check_count,
    mask_of,
    seeds_of,
    targets_of,
    threads_of,
)
from magfold_env.envs.vector_infos import Infos, last_news, news

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
ObsType = TypeVar("ObsType")


class FoldVectorEnv(VectorEnv[ObsType, Any, NDArray[Any]], Generic[ObsType]):
    """Many chains, each in an episode of its own.

    Parameters
    ----------
    num_envs : int
        How many.
    autoreset_mode : AutoresetMode or str
        When an episode that has ended is followed by another; Gymnasium's three modes.
    threads : int, optional
        How many threads simulate, by default as many as the process may use cores. Results do not
        depend on it.
    **options
        Those of the single environment.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    single: ClassVar[type[FoldEnv[Any]]]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        **options: Any,
    ) -> None:
        check_count(num_envs, options.get("render_mode"))
        self.autoreset_mode = autoreset_mode_of(autoreset_mode)
        threads = threads_of(threads)
        one = self.single(**options)
        self.template = one
        """A single environment with the same options, in which nothing happens."""
        self.task = one.task
        self.num_envs = num_envs
        self.render_mode = one.render_mode
        self.metadata = {**one.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_action_space = one.action_space
        self.single_observation_space = one.observation_space
        self.action_space = batch_space(one.action_space, num_envs)
        self.observation_space = batch_space(one.observation_space, num_envs)
        self.fleet: Fleet = (
            QuasistaticFleet(self.task.rules, num_envs)
            if self.task.fidelity == "quasistatic"
            else DynamicFleet(self.task.template, num_envs, threads)
        )
        self.goals = GoalBoard(self.task.targets, self.task.match, num_envs, self.task.baseline_of)
        self._viewer = Viewer(one.render_mode, one.metadata["render_fps"])
        self._rows = np.arange(num_envs)
        self._rngs: list[Any] = [None] * num_envs
        self._potentials = np.zeros(num_envs)
        self._begun = np.zeros(num_envs, dtype=np.bool_)
        at_once = self.task.actions.components
        self._chronicle = Chronicle.empty(num_envs, self.task.scene.n // at_once, at_once)

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
            The first environment's seed, the others follow on; or one each.
        options : mapping, optional
            ``target``, a word for all or a list of one each; ``reset_mask``, an array of bool,
            says which environments are meant.

        Raises
        ------
        ValueError, TypeError
            For a wrong number of seeds, an unknown option or one that is not allowed.
        """
        options = options or {}
        given = targets_of(options, self.task.targets, self.num_envs)
        mask = mask_of(options, self.num_envs)
        for row, own in enumerate(seeds_of(seed, self.num_envs)):
            if own is not None and mask[row]:
                self._rngs[row], _ = seeding.np_random(own)
        rows = np.flatnonzero(mask)
        self._begin(rows, given)
        return self._observe(), news(self.fleet, self.goals, rows)

    def step(self, actions: Any) -> tuple[ObsType, Floats, Bools, Bools, Infos]:
        """Take a step in every environment.

        Raises
        ------
        ValueError
            If an action lies outside the space.
        gymnasium.error.ResetNeeded
            Before the first reset, and, with the mode DISABLED, where an episode has ended.
        """
        patterns, speeds, scaled = self.task.actions.decode_many(actions, self.num_envs)
        over = self._over()
        if self.autoreset_mode == AutoresetMode.DISABLED and over.any():
            raise gymnasium.error.ResetNeeded(
                f"the episodes of environments {np.flatnonzero(over).tolist()} are over; "
                "call reset(options={'reset_mask': ...}) first"
            )
        rows = self._rows
        if over.any():
            rows = np.flatnonzero(~over)
            patterns, speeds, scaled = patterns[rows], speeds[rows], scaled[rows]
        rewards = np.zeros(self.num_envs)
        self._chronicle.note(rows, patterns, speeds, scaled)
        self._act(rows, patterns, speeds, scaled)
        ended = rows[self.fleet.status[rows] > 0]
        ends = last_news(self.fleet, self.goals, ended)
        rewards[rows] = self._rewards(rows, ended, ends)
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        terminated[ended] = True
        truncated = np.zeros(self.num_envs, dtype=np.bool_)
        infos: Infos = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and len(ended):
            final = np.full(self.num_envs, None, dtype=object)
            for row, observation in zip(ended.tolist(), self._each(ended), strict=True):
                final[row] = observation
            infos = {"final_obs": final, "_final_obs": terminated.copy()}
            told = news(self.fleet, self.goals, ended) | ends
            infos |= {"final_info": told, "_final_info": terminated.copy()}
            ends = {}
            self._begin(ended)
        elif len(rows) < self.num_envs:
            self._begin(np.flatnonzero(over))
        infos |= news(self.fleet, self.goals, self._rows) | ends
        return self._observe(), rewards, terminated, truncated, infos

    def get_state(self) -> Chronicle:
        """Return everything that decides how the environments go on.

        It does not change when the environments do, and may be set as often as wanted.
        """
        self._over()
        return self._chronicle.copy()

    def set_state(self, state: Chronicle) -> ObsType:
        """Go back to a state of these environments, or of others made with the same options.

        The episodes are played again up to it. From there every step gives exactly what it gave
        then. Returns the observations.
        """
        for row, own in enumerate(state.rngs):
            self._rngs[row], _ = seeding.np_random(0)
            self._rngs[row].bit_generator.state = own
        self._begin(self._rows, state.targets.tolist())
        for step in range(int(state.steps.max())):
            rows = np.flatnonzero(state.steps > step)
            chosen = state.patterns[rows, step], state.speeds[rows, step], state.scaled[rows, step]
            self._chronicle.note(rows, *chosen)
            self._act(rows, *chosen)
        self._potentials = self._potential(self._rows)
        return self._observe()

    def render(self) -> tuple[Any, ...]:
        """Return a picture, or a text, of each environment, as `render_mode` says."""
        self._over()
        return tuple(self._viewer.render(partial(self.moment, row)) for row in range(self.num_envs))

    def moment(self, row: int) -> "Snapshot":
        """Return what a picture of an environment shows."""
        goal = self.goals.goal(row)
        baseline = self.task.baseline_of(goal.word)
        return fold_moment(self.task, self.fleet.view(row), goal, baseline)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the masks of all environments, (m, …); `FoldEnv.action_masks`."""
        return np.repeat(self.task.actions.masks()[None], self.num_envs, axis=0)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.fleet.close()
        self.template.close()

    def _over(self) -> Bools:
        """Return which episodes have ended."""
        if not self._begun.all():
            raise gymnasium.error.ResetNeeded("no episode has begun; call reset() first")
        return self.fleet.status > 0

    def _begin(self, rows: Ints, targets: Sequence[int] | None = None) -> None:
        """Begin episodes, with targets given for all environments by number, or drawn."""
        rngs = self._rngs
        count = len(self.task.targets)
        numbers = np.empty(len(rows), dtype=np.int64)
        states: list[Any] = []
        for place, row in enumerate(rows.tolist()):
            rng = rngs[row]
            if rng is None:
                rng = rngs[row] = seeding.np_random()[0]
            states.append(rng.bit_generator.state)
            numbers[place] = rng.integers(count)
        if targets is not None:
            numbers = np.asarray(targets)[rows]
        self._chronicle.begin(rows, states, numbers)
        self.goals.want(rows, numbers)
        self.fleet.begin(rows, rngs)
        self._begun[rows] = True
        self._potentials[rows] = self._potential(rows)

    def _act(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed what actions describe."""
        if self.single.at_a_time == "chain":
            self.fleet.run(rows, patterns, speeds, scaled)
        else:
            self.fleet.feed(rows, patterns[:, 0], speeds, scaled)

    def _potential(self, rows: Ints) -> Floats:
        """Return Φ of the shaping for chains as they are, 0 at their ends."""
        found = np.zeros(len(rows))
        going = self.fleet.status[rows] == 0
        shaping = self.task.rule.shaping
        if shaping is not None and going.any():
            found[going] = self._shaped(rows[going])
        return found

    def _shaped(self, rows: Ints) -> Floats:
        """Return Φ of chains that go on."""
        if self.task.rule.shaping == "similarity":
            return self.goals.judge(rows, self.fleet.board.angles)[0]
        energies = self.fleet.energies(rows)
        wanted = self.task.rules.energies_as(
            rows, self.goals.turns, self.fleet.board.signs, self.fleet.fed
        )
        share = np.divide(energies, wanted, out=np.zeros_like(energies), where=wanted < 0.0)
        return 0.5 * np.clip(share, 0.0, 1.0)

    def _rewards(self, rows: Ints, ended: Ints, ends: Infos) -> Floats:
        """Return the rewards of a step; see `magfold_env.envs.tasks.reward`."""
        rule = self.task.rule
        after = self._potential(rows)
        rewards = rule.gamma * after - self._potentials[rows]
        self._potentials[rows] = after
        if len(ended):
            last = self.fleet.status[rows] > 0
            if rule.kind == "sparse":
                rewards[last] += ends["is_success"][ended].astype(np.float64)
            else:
                score = ends["score"][ended]
                rewards[last] += (
                    score - ends["baseline"][ended] if rule.kind == "relative" else score
                )
        return rewards

    def _observe(self) -> ObsType:
        """Return new observations of all environments."""
        raise NotImplementedError

    def _each(self, rows: Ints) -> list[ObsType]:
        """Return new observations of some environments, one by one."""
        raise NotImplementedError
