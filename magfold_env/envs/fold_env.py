"""What the environments in which magnets are chosen have in common."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.quasistatic import QuasistaticChains
from magfold_env.envs.episodes import Columns, Episodes, status_names
from magfold_env.envs.pictures.moments import Rows, chain_moment, energy_rows
from magfold_env.envs.spaces.action_table import ActionTable, Choice
from magfold_env.envs.spaces.actions import speed_at
from magfold_env.envs.tasks.checks import given_for_each
from magfold_env.envs.tasks.fold_task import FoldTask
from magfold_env.envs.tasks.forecast import Forecast, forecast
from magfold_env.envs.tasks.goals import Goals
from magfold_env.envs.tasks.options import FoldOptions
from magfold_env.envs.tasks.reward import energy_potential
from magfold_env.envs.tasks.targets import pick_target
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import Scene

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

ObsType = TypeVar("ObsType")


class FoldEpisodes(Episodes[ObsType]):
    """Episodes in which magnets and feed speeds are chosen so that chains fold into targets."""

    world: FoldTask
    chains: DynamicChains | QuasistaticChains

    def __init__(
        self, world: FoldTask, count: int, threads: int = 1, frame_rate: float | None = None
    ) -> None:
        super().__init__(world, count, threads, frame_rate)
        self.goals = Goals(world.targets, world.match, count)
        self._baselines: list[Baseline | None] = [None] * len(world.targets)
        self.baseline: Floats = np.zeros(count)
        """Scores of the targets' baselines, (m,)."""
        self._flagged = np.zeros(count, dtype=np.bool_)

    def _make_chains(
        self, threads: int, frame_rate: float | None
    ) -> DynamicChains | QuasistaticChains:
        if self.world.fidelity == "quasistatic":
            return QuasistaticChains(self.world.rules, self.count)
        return DynamicChains((self.world.scene,), self.count, threads, frame_rate)

    @property
    def choices(self) -> int:
        """How many targets there are to be drawn."""
        return len(self.world.targets)

    def given(self, options: Mapping[str, Any], others: Sequence[str] = ()) -> Sequence[int] | None:
        """Return the targets of all episodes that options of `reset` ask for, by number."""
        words = given_for_each(options, ("target", *others), self.count, str)
        if words is None:
            return None
        targets = self.world.targets
        return [targets.index(pick_target(word, targets)) for word in words]

    def baseline_at(self, row: int) -> Baseline:
        """Return the energy minimiser's result for the target of an episode."""
        number = int(self.numbers[row])
        found = self._baselines[number]
        if found is None:
            found = self._baselines[number] = self.world.baseline_of(self.world.targets[number])
        return found

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain, with the magnets and speeds of components fed."""
        return self.chains.scene(row)

    def told(self, rows: Ints) -> Columns:
        """Return the info of some episodes: the little there is on their way."""
        return {
            "target": self.goals.names[rows],
            "word": self.words(rows),
            "step": self.arrays.fed[rows],
        }

    def told_at_end(self, rows: Ints) -> Columns:
        """Return what is told besides of episodes that have terminated."""
        status = self.arrays.status
        _, score, success = self.goals.judge(rows, status, self.arrays.angles)
        return {
            "status": status_names(status[rows]),
            "message": self.messages(rows),
            "energy": self.chains.energies(rows),
            "score": score,
            "baseline": self.baseline[rows],
            "baseline_flagged": self._flagged[rows],
            "is_success": success == 1.0,
        }

    def forecast(self, row: int) -> Forecast | None:
        """Return what energy minimisation says of the components fed so far.

        None where it has nothing to say: before the first, in an external field, and where it is
        itself what happens.
        """
        world = self.world
        if self.arrays.fed[row] == 0 or world.in_field or world.fidelity == "quasistatic":
            return None
        return forecast(world.rules, self.arrays, row, self.goals.names[row])

    def moment(self, row: int) -> "Snapshot":
        """Return what a picture of an episode shows."""
        arrays, found, n = self.arrays, self.forecast(row), self.world.scene.n
        fed, over, target = int(arrays.fed[row]), self.is_over(row), self.goals.names[row]
        rows: Rows = [("word", self.words(self.rows[row : row + 1])[0]), ("target", target)]
        if fed:
            rows += energy_rows(float(self.chains.energies(self.rows[row : row + 1])[0]), found)
            speed = speed_at(float(arrays.speeds[row, arrays.order(row)[fed - 1]]))
            rows.append(("last speed", f"{1e3 * speed:.0f} mm/s"))
        if over:
            ends = self.told_at_end(self.rows[row : row + 1])
            rows.append(("score", f"{ends['score'][0]:.2f}"))
            if not self._flagged[row]:
                rows.append(("baseline", f"{self.baseline[row]:.2f}"))
        status = status_names(arrays.status[row : row + 1])[0]
        return chain_moment(
            self,
            row,
            target,
            found,
            is_loaded=fed > 0,
            title=status if over else f"fed {fed} of {n}",
            message=self.chains.message(row) if over else "",
            rows=tuple(rows),
        )

    def _load(self, rows: Ints) -> None:
        self._want(rows)
        self.chains.begin(rows, self.rngs)

    def _want(self, rows: Ints) -> None:
        self.goals.want(rows, self.numbers[rows])
        for row in rows.tolist():
            found = self.baseline_at(row)
            self.baseline[row], self._flagged[row] = found.score, found.flagged

    def _act(self, rows: Ints, choice: Choice) -> None:
        patterns, speeds, scaled = choice
        if self.world.at_a_time == "chain":
            self.chains.run(rows, patterns, speeds, scaled)
        else:
            self.chains.feed(rows, patterns[:, 0], speeds, scaled)

    def _shaped(self, rows: Ints) -> Floats:
        arrays = self.arrays
        if self.world.rule.shaping == "similarity":
            return self.goals.judge(rows, arrays.status, arrays.angles)[0]
        names = self.goals.names
        wanted = [
            self.world.rules.energy_as(str(names[row]), arrays.signs[row], int(arrays.fed[row]))
            for row in rows.tolist()
        ]
        return energy_potential(self.chains.energies(rows), np.array(wanted))


class FlatFoldEpisodes(FoldEpisodes[NDArray[np.float32]]):
    """Those whose observations are arrays."""

    def observe(self) -> NDArray[np.float32]:
        """Return new observations, (m, size)."""
        layout = self.world.layout
        out = np.empty((self.count, layout.size), dtype=np.float32)
        layout.fill(self.arrays, self.goals.one_hot, out)
        return out


class FoldEnv(ChainEnv[ObsType]):
    """A chain whose magnets and feed speeds are chosen so that it folds into a target.

    Parameters
    ----------
    scene : str, Path or Scene, optional
        A tube scene: a shipped name, a path or the scene. Its sequence and feed speeds are the
        agent's to choose and so are ignored: every face gets a magnet. By default the scene that
        the target suite is meant for, or the environment's own.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.
    **options
        See `magfold_env.envs.tasks.options.FoldOptions`.

    Raises
    ------
    ValueError
        For any option that is not allowed; the message names it and what is.
    """

    at_a_time: ClassVar[Literal["component", "chain"]] = "component"
    default_scene: ClassVar[str] = "tube-feed"

    world: FoldTask

    def __init__(
        self,
        scene: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **options: Unpack[FoldOptions],
    ) -> None:
        self.task = FoldTask(scene, self.default_scene, self.at_a_time, **options)
        super().__init__(self.task, render_mode)

    @property
    def targets(self) -> tuple[str, ...]:
        """The words that `reset` draws from."""
        return self.task.targets

    @property
    def actions(self) -> ActionTable:
        """How actions are read."""
        return self.task.actions

    @property
    def target(self) -> str:
        """The word that this episode wants."""
        return self._running().goals.names[0]

    @property
    def baseline(self) -> Baseline:
        """The energy minimiser's result for the target of this episode."""
        return self._running().baseline_at(0)

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`.

        May take some seconds where neither the package nor the disk cache has it.
        """
        return self.task.baseline_of(target)

    @property
    def next_component(self) -> int:
        """Index of the component that the next step feeds (component number − 1).

        Raises
        ------
        RuntimeError
            If all have been fed.
        """
        arrays = self._running().arrays
        if arrays.fed[0] == self.scene.n:
            raise RuntimeError("every component has been fed")
        return arrays.order(0)[int(arrays.fed[0])]

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions ask for nothing but components of the catalogue.

        In the form that sb3-contrib's ``MaskablePPO`` looks for; `ActionTable.masks`.
        """
        return self.actions.masks()

    def to_scene(self) -> Scene:
        """Return the finished episode as a concrete scene.

        `magfold_env.simulate` replays it bit for bit; if the fidelity is quasistatic,
        `magfold_env.envs.chains.quasistatic.fold` does.

        Raises
        ------
        RuntimeError
            While components remain to be fed: half a chain is not a scene.
        """
        episodes = self._running()
        fed = int(episodes.arrays.fed[0])
        if fed < self.scene.n:
            raise RuntimeError(
                f"{fed} of {self.scene.n} components are set; a scene needs all of them"
            )
        return episodes.scene(0)


class FoldVectorEnv(ChainVectorEnv[ObsType]):
    """Many of `FoldEnv`."""

    single: ClassVar[type[FoldEnv[Any]]]

    @property
    def task(self) -> FoldTask:
        """What all episodes share."""
        return self.template.task

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the masks of all environments, (m, …); `FoldEnv.action_masks`."""
        return np.repeat(self.template.action_masks()[None], self.num_envs, axis=0)
