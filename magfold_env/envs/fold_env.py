"""Base classes of the environments in which the agent chooses magnets."""

from pathlib import Path
from typing import Any, ClassVar, Literal, TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.quasistatic import QuasistaticChains
from magfold_env.envs.episodes import Columns, Episodes, Lines
from magfold_env.envs.spaces.actions import Choice, speeds_at
from magfold_env.envs.spaces.observation import Singles, fill
from magfold_env.envs.tasks.setup import FoldOptions, FoldTask
from magfold_env.scene import Scene

ObsType = TypeVar("ObsType")


class FoldEpisodes(Episodes[Any]):
    """Episodes in which an agent chooses magnets and feed speeds to fold chains into targets."""

    setup: FoldTask

    def make_chains(
        self, threads: int, frame_rate: float | None
    ) -> DynamicChains | QuasistaticChains:
        """Return dynamic or quasistatic chains, according to the fidelity."""
        if self.setup.fidelity == "quasistatic":
            return QuasistaticChains(self.setup.lattice, self.count)
        return super().make_chains(threads, frame_rate)

    def find_baseline(self, number: int) -> Baseline:
        """Return the energy minimiser's result for a target."""
        return self.setup.baseline_of(self.setup.words[number])

    def act(self, rows: Ints, choice: Choice) -> None:
        """Feed the next component of each chain, or all components."""
        self.chains.feed(rows, *choice)

    def observe(self) -> Any:
        """Return new observations, (m, size)."""
        return self.observed(self.goals.one_hot)

    def observed(self, words: Singles) -> Singles:
        """Return the observations of all chains; the entries `words`, (m, words), come first."""
        layout = self.setup.layout
        out = np.empty((self.count, layout.size), dtype=np.float32)
        fill(layout.side, self.chains.seen, words, out)
        return out

    def infos(self, rows: Ints) -> Columns:
        """Return the infos of the given episodes, running or ended."""
        return super().infos(rows) | {"step": self.arrays.fed[rows]}

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return the title of an episode's picture, and the text above and below its energies."""
        arrays, fed = self.arrays, int(self.arrays.fed[row])
        done: Lines = []
        if fed:
            speed = speeds_at(arrays.speeds[row, arrays.order(row)[fed - 1]])
            done.append(("last speed", f"{1e3 * speed:.0f} mm/s"))
        title, wanted, _ = super().caption(row)
        return title, wanted, done


class FoldEnv(ChainEnv[ObsType]):
    """Base class of environments in which the agent chooses magnets and feed speeds.

    Parameters
    ----------
    scene : str, Path or Scene, optional
        A tube scene: a shipped name, a path or the scene itself. Its sequence and feed speeds are
        ignored, because the agent chooses them; every face gets a magnet. The default is the scene
        of the target suite or, without a suite, the environment's own.
    render_mode : {"human", "rgb_array", "rgb_array_list", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window automatically.
    **options
        See `magfold_env.envs.tasks.setup.FoldOptions`.

    Raises
    ------
    ValueError
        If an option is not allowed; the message names it and the allowed values.
    """

    make_episodes = FoldEpisodes
    action_scope: ClassVar[Literal["component", "chain"]] = "component"
    """Whether an action sets one component or the whole chain."""
    default_scene: ClassVar[str] = "tube-feed"

    setup: FoldTask

    def __init__(
        self,
        scene: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **options: Unpack[FoldOptions],
    ) -> None:
        self.task = FoldTask(scene, self.default_scene, self.action_scope, **options)
        super().__init__(self.task, render_mode)

    @property
    def horizon(self) -> int:
        """Number of steps in an episode."""
        return self.scene.n // self.actions.components

    @property
    def targets(self) -> tuple[str, ...]:
        """The words that `reset` draws from."""
        return self.task.words

    @property
    def target(self) -> str:
        """The target word of this episode."""
        return self._running().goals.names[0]

    @property
    def baseline(self) -> Baseline:
        """The energy minimiser's result for the target of this episode."""
        return self._running().baseline_at(0)

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`.

        This may take some seconds if neither the package nor the disk cache contains it.
        """
        return self.task.baseline_of(target)

    @property
    def next_component(self) -> int:
        """Index of the component that the next step feeds (component number − 1).

        Raises
        ------
        RuntimeError
            If all components have been fed.
        """
        arrays = self._running().arrays
        if arrays.fed[0] == self.scene.n:
            raise RuntimeError("every component has been fed")
        return arrays.order(0)[int(arrays.fed[0])]

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions request only components of the catalogue.

        The form is that of sb3-contrib's ``MaskablePPO``; see `ActionTable.masks`.
        """
        return self.actions.masks()

    def to_scene(self) -> Scene:
        """Return the finished episode as a concrete scene.

        `magfold_env.simulate` replays it bit for bit; if the fidelity is quasistatic,
        `magfold_env.envs.chains.quasistatic.fold` does.

        Raises
        ------
        RuntimeError
            If components remain to be fed, because a scene needs the whole chain.
        """
        episodes = self._running()
        fed = int(episodes.arrays.fed[0])
        if fed < self.scene.n:
            raise RuntimeError(
                f"{fed} of {self.scene.n} components are set; a scene needs all of them"
            )
        return episodes.scene(0)
