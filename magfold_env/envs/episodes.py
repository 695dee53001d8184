"""Batches of episodes, which define what an environment does, for any number of chains.

A single environment is a batch of one episode, so the same code draws, feeds, observes and rewards
one chain or many.
"""

import copy
import pickle
import zlib
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline, unknown_baseline
from magfold_env.envs.chains.arrays import STATUSES, Bools, ChainArrays, Floats, Ints, write_words
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.chains.quasistatic import QuasistaticChains
from magfold_env.envs.tasks.checks import given_for_each, require
from magfold_env.envs.tasks.goals import Goals
from magfold_env.envs.tasks.reward import energy_potential
from magfold_env.envs.tasks.setup import Setup
from magfold_env.scene import Scene
from magfold_env.simulation.view import ChainState

ObsType = TypeVar("ObsType")
Columns = dict[str, Any]
"""Infos of some episodes: one array per key, with one entry per episode."""

Lines = list[tuple[str, str]]
"""Names and values shown beside a picture."""


@dataclass(frozen=True)
class EpisodesState:
    """The complete state of episodes; see `Episodes.get_state`."""

    made_by: str
    """Number, length and kind of the episodes; only episodes of the same kind can take a state."""
    rngs: Sequence[Mapping[str, Any]]
    """States of the random generators from which later episodes are drawn."""
    chains: tuple[Any, ...]
    arrays: Mapping[str, Any]
    """The other arrays of the episodes, by name."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Return a compressed form for pickles; most of the state is unused space of zeros."""
        content = pickle.dumps((self.made_by, self.rngs, self.chains, self.arrays))
        return _unpacked, (zlib.compress(content, level=1),)


def _unpacked(content: bytes) -> EpisodesState:
    return EpisodesState(*pickle.loads(zlib.decompress(content)))


class Episodes(Generic[ObsType]):
    """A batch of chains, each in its own episode.

    Each environment has a subclass, which defines what actions do (`act`) and what an agent
    observes (`observe`). A subclass may also change the arrays that it keeps (`allocate`, `kept`),
    how chains begin (`reset_rows`), the rewards (`step_rewards`, `end_rewards`) and the infos
    (`infos`, `final_infos`).

    `setup` is what the episodes share, `count` is their number, and `threads` is the number of
    threads that simulate. A single chain records `frame_rate` frames per simulated second.
    """

    kept: tuple[str, ...] = ("numbers", "steps", "_potentials")
    """Names of the arrays that are part of the state, with one entry per episode."""

    has_true_strengths: ClassVar[bool] = True
    """Whether the magnets in the scene that `scene` returns have their actual strengths."""

    # Subclasses declare the types of their setups and chains.
    setup: Any
    chains: Any

    def __init__(
        self, setup: Setup, count: int, threads: int = 1, frame_rate: float | None = None
    ) -> None:
        self.setup, self.count, self._threads = setup, count, threads
        self.n = setup.scene.n
        self._frame_rate = frame_rate
        self.rngs: list[Any] = [None] * count
        self.rows: Ints = np.arange(count)
        self._begun: Bools = np.zeros(count, dtype=np.bool_)
        self._all_begun = False
        self._baselines: list[Baseline | None] = [None] * len(setup.words)
        self.chains = self.make_chains(threads, frame_rate)
        self.arrays: ChainArrays = self.chains.arrays
        """The visible state of the chains."""
        kind, simulated = type(self).__name__, type(self.chains).__name__
        self._kind = f"{count} {kind} with {self.n} components in {simulated}"
        self.allocate()

    # --- defined by every environment ------------------------------------------------------

    @abstractmethod
    def act(self, rows: Ints, choice: Any) -> None:
        """Carry out decoded actions, as ``Setup.actions.read`` returns them."""

    @abstractmethod
    def observe(self) -> ObsType:
        """Return new observations of all episodes, as Gymnasium batches them."""

    # --- may be overridden -----------------------------------------------------------------

    def make_chains(
        self, threads: int, frame_rate: float | None
    ) -> DynamicChains | QuasistaticChains:
        """Return the chains that the episodes simulate."""
        return DynamicChains((self.setup.scene,), self.count, threads, frame_rate)

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        self.goals = Goals(self.setup.words, self.setup.match, self.count)
        self.numbers: Ints = np.zeros(self.count, dtype=np.int64)
        """Numbers of the episodes' targets or tasks, (m,)."""
        self.steps: Ints = np.zeros(self.count, dtype=np.int64)
        """Number of steps taken in each episode, (m,)."""
        self.baseline: Floats = np.zeros(self.count)
        """Scores of the baselines, (m,); 0 if the reward uses none."""
        self._missing: Bools = np.zeros(self.count, dtype=np.bool_)
        self._potentials: Floats = np.zeros(self.count)

    def reset_rows(self, rows: Ints) -> None:
        """Draw random chains for the given episodes and put them into their tubes."""
        self.chains.begin(rows, self.rngs)

    def step_rewards(self, rows: Ints) -> Floats:
        """Return the rewards that every step earns; see `magfold_env.envs.tasks.reward`."""
        if self.setup.rule.shaping is None:
            return np.zeros(len(rows))
        after = self.potential(rows)
        rewards = self.setup.rule.step(self._potentials[rows], after)
        self._potentials[rows] = after
        return rewards

    def end_rewards(self, ends: Columns) -> Floats:
        """Return the rewards that the last steps of episodes earn in addition."""
        return self.setup.rule.end(ends["score"], ends["is_success"], ends["baseline"])

    def infos(self, rows: Ints) -> Columns:
        """Return the infos of the given episodes, running or ended."""
        return {"target": self.goals.names[rows], "word": self.words(rows)}

    def final_infos(self, rows: Ints) -> Columns:
        """Return additional infos of episodes that have terminated."""
        status = self.arrays.status
        _, score, success = self.goals.judge(rows, status, self.arrays.angles)
        return {
            "status": _STATUS_NAMES[status[rows]],
            "message": np.array([self.chains.message(k) for k in rows.tolist()], dtype=object),
            "energy": self.chains.energies(rows),
            "score": score,
            "is_success": success == 1.0,
            "baseline": self.baseline[rows],
            "baseline_missing": self._missing[rows],
        }

    def action_masks(self, actions: Any) -> NDArray[np.bool_] | None:
        """Return which actions of the table `actions` are possible, (m, …).

        Returns None if these never change; the table's own ``masks`` then returns them.
        """
        return None

    def find_baseline(self, number: int) -> Baseline:
        """Return the baseline of a target or task by number, flagged if it is missing."""
        return unknown_baseline(self.setup.words[number])

    def acting(self, row: int) -> int:
        """Return how many components, counted in the order of feed, have magnets that act."""
        return int(self.arrays.fed[row])

    def lattice(self, row: int) -> LatticeFeed:
        """Return the rules by which energy minimisation folds a chain."""
        return self.setup.lattice

    def scene(self, row: int) -> Scene:
        """Return the scene drawn for a chain, with the magnets and speeds of fed components."""
        return self.chains.scene(row)

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return the title of an episode's picture, and the text above and below its energies."""
        return f"fed {self.arrays.fed[row]} of {self.n}", [("target", self.goals.names[row])], []

    # --- fixed -----------------------------------------------------------------------------

    @property
    def terminated(self) -> Bools:
        """Which episodes have ended, (m,), including those that ran into a task's time limit."""
        return self.arrays.status > 0

    def parse_reset_options(
        self, options: Mapping[str, Any], others: Sequence[str] = ()
    ) -> Sequence[int] | None:
        """Return the numbers of the targets or tasks that options of `reset` fix, or None.

        `others` are the names of other allowed options.
        """
        key, kind = self.setup.option
        found = given_for_each(options, (key, *others), self.count, kind)
        return None if found is None else [self.setup.number_of(each) for each in found]

    def begin(self, rows: Ints, given: Sequence[int] | None = None) -> None:
        """Begin the given episodes; `given` fixes the targets or tasks of all rows, by number.

        This call draws all random physics. The target or task is drawn first, even if it is given,
        so that a seed gives the same physics for every target.
        """
        for row in rows.tolist():
            if self.rngs[row] is None:
                self.rngs[row] = seeding.np_random()[0]
            self.numbers[row] = self.rngs[row].integers(len(self.setup.words))
        if given is not None:
            self.numbers[rows] = np.asarray(given)[rows]
        self._set_targets(rows)
        self.steps[rows] = 0
        self.reset_rows(rows)
        if not self._all_begun:
            self._begun[rows] = True
            self._all_begun = bool(self._begun.all())
        if self.setup.rule.shaping is not None:
            self._potentials[rows] = self.potential(rows)

    def step(self, rows: Ints, choice: Any) -> tuple[Floats, Columns]:
        """Take a step in the given episodes with the decoded actions `choice`.

        Returns the rewards, (rows,), and `final_infos` of the episodes that have terminated.
        """
        if not len(rows):
            return np.zeros(0), {}
        self.steps[rows] += 1
        self.act(rows, choice)
        rewards = self.step_rewards(rows)
        ended = self.arrays.status[rows]
        if np.count_nonzero(ended) == 0:
            return rewards, {}
        over = ended > 0
        ends = self.final_infos(rows[over])
        rewards[over] += self.end_rewards(ends)
        return rewards, ends

    def play(
        self, seeds: Sequence[int], given: Sequence[int], choose: Callable[[Ints], Any]
    ) -> Columns:
        """Play one episode to its end in each of the first rows; return the `final_infos`.

        Row k has the seed ``seeds[k]``, as for `reset` of a single environment, and the target or
        task number ``given[k]``. `choose` returns decoded actions for given rows.
        """
        self.rngs[: len(seeds)] = [seeding.np_random(seed)[0] for seed in seeds]
        played = rows = self.rows[: len(seeds)]
        self.begin(rows, given)
        while len(rows):
            self.step(rows, choose(rows))
            rows = played[~self.terminated[played]]
        return self.final_infos(played)

    def potential(self, rows: Ints) -> Floats:
        """Return the shaping potential Φ of each chain as it is; 0 for ended episodes."""
        found = np.zeros(len(rows))
        going = ~self.terminated[rows]
        if going.any():
            found[going] = self._shaped(rows[going])
        return found

    def _shaped(self, rows: Ints) -> Floats:
        """Return the shaping potential Φ of each running episode."""
        arrays = self.arrays
        if self.setup.rule.shaping == "similarity":
            return self.goals.judge(rows, arrays.status, arrays.angles)[0]
        wanted = [
            self.lattice(row).energy_as(
                str(self.goals.names[row]), arrays.signs[row], self.acting(row)
            )
            for row in rows.tolist()
        ]
        return energy_potential(self.chains.energies(rows), np.array(wanted))

    def baseline_at(self, row: int) -> Baseline:
        """Return the baseline of an episode."""
        number = int(self.numbers[row])
        found = self._baselines[number]
        if found is None:
            found = self._baselines[number] = self.find_baseline(number)
        return found

    def chosen(self, row: int) -> Bools:
        """Return which components of a chain have been chosen, (n,), component 1 first."""
        found = np.zeros(self.setup.scene.n, dtype=np.bool_)
        found[list(self.arrays.order(row)[: int(self.arrays.fed[row])])] = True
        return found

    def words(self, rows: Ints) -> Any:
        """Return the nearest fold words of the given chains as an array of str."""
        n = self.arrays.angles.shape[1]
        letters = np.empty((len(rows), n - 1), dtype=np.uint32)
        write_words(rows, self.arrays.angles, letters)
        if len(rows) == 1:  # several times as fast as an array of one element
            return np.array([letters.tobytes().decode("utf-32")], dtype=object)
        return letters.view(f"<U{n - 1}")[:, 0].astype(object)

    def state(self, row: int) -> ChainState:
        """Return a copy of a chain's state."""
        arrays = self.arrays
        values = arrays.angles, arrays.rates, arrays.base, arrays.base_velocity
        return ChainState(*(each[row].copy() for each in values))

    def get_state(self) -> EpisodesState:
        """Return the complete state of the episodes, which later steps do not change."""
        self.check_begun()
        rngs: list[Any] = [rng.bit_generator.state for rng in self.rngs]
        kept = {name: copy.deepcopy(getattr(self, name)) for name in self.kept}
        return EpisodesState(self._kind, rngs, self.chains.get_state(), kept)

    def set_state(self, state: EpisodesState) -> None:
        """Restore a state of these episodes, or of others in a setup made with the same options."""
        made_by = getattr(state, "made_by", state)
        right = isinstance(made_by, str) and made_by == self._kind
        require(right, "state", made_by, f"must be get_state() of {self._kind}")
        for row, own in enumerate(state.rngs):
            if self.rngs[row] is None:
                self.rngs[row] = seeding.np_random(0)[0]
            self.rngs[row].bit_generator.state = own
        self.chains.set_state(state.chains)
        for name, value in state.arrays.items():
            kept = getattr(self, name)
            kept[:] = copy.deepcopy(value)
        self._begun[:] = self._all_begun = True
        self._set_targets(self.rows)

    def _set_targets(self, rows: Ints) -> None:
        """Set the targets and baselines of episodes from their `numbers`."""
        self.goals.want(rows, self.numbers[rows])
        for row in rows.tolist():
            found = self.baseline_at(row)
            self.baseline[row], self._missing[row] = found.score, found.flagged

    def check_begun(self) -> None:
        """Raise ``ResetNeeded`` if an episode has not begun."""
        if not self._all_begun:
            raise gymnasium.error.ResetNeeded("no episode has begun; call reset() first")

    def close(self) -> None:
        """Stop the threads."""
        self.chains.close()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for copies and pickles, without compiled code and addresses."""
        going = self.get_state() if self._all_begun else None
        own = self.setup, self.count, self._threads, self._frame_rate
        return {"own": own, "rngs": self.rngs, "state": going}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the state that `__getstate__` returned; recorded motion is lost."""
        self.__init__(*state["own"])
        if state["state"] is not None:
            self.set_state(state["state"])
        self.rngs = state["rngs"]


_STATUS_NAMES: Any = np.array([str(each) for each in STATUSES], dtype=object)
