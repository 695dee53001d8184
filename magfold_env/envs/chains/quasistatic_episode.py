"""An episode in which the chain folds by energy minimisation, joint by joint, without dynamics.

There is no time, so speeds change nothing, and no friction; nothing is drawn. A joint is decided
when the component behind it has come out, and then stays as it is.
"""

import copy
from typing import Self

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.lattice import DEAD_END, LatticeFeed, in_line
from magfold_env.envs.chains.progress import Progress
from magfold_env.fold import FoldStatus
from magfold_env.minimiser.energies import strengths
from magfold_env.scene import Scene
from magfold_env.simulation.chain_state import ChainState

_LETTERS = {0: "S", 1: "L", -1: "R"}
_TURNS = {letter: turn for turn, letter in _LETTERS.items()}


class QuasistaticRules:
    """What all episodes of one scene share.

    Parameters
    ----------
    scene : Scene
        A tube scene; its sequence and speeds are ignored.

    Raises
    ------
    ValueError
        If it is in an external field, of which energy minimisation knows nothing.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.n = scene.n
        self.forward = scene.feed.direction == "forward"
        self.pitch = scene.casing.diagonal
        self.built = scene.feed.loading == "preloaded"
        self.lattice = LatticeFeed(scene)
        self.strengths = strengths(scene)

    def energy_as(self, word: str, progress: Progress, count: int) -> float:
        """Return the energy [J] of the first `count` components in the order of feed, in a shape.

        Parameters
        ----------
        word : str
            The shape of the whole chain.
        progress : Progress
            Their magnets.
        count : int
            How many of them have magnets.
        """
        order = list(progress.order)
        turns = [_TURNS[letter] for letter in (word if self.forward else word[::-1])]
        poles = progress.signs[order] * self.strengths[order]
        return self.lattice.energy_of(np.array(turns[: max(count - 1, 0)], dtype=np.int64), poles)

    def energies_as(
        self,
        rows: NDArray[np.int64],
        joints: NDArray[np.float64],
        signs: NDArray[np.float64],
        counts: NDArray[np.int64],
    ) -> NDArray[np.float64]:
        """Return `energy_as` for some of many chains.

        Parameters
        ----------
        rows : array of int
            Which.
        joints : array, shape (m, n − 1)
            The shapes of all chains as joint angles [rad].
        signs : array, shape (m, n, 4)
            Their outward poles.
        counts : array of int, shape (m,)
            How many components of each have magnets.
        """
        turns = np.rint(joints[rows] / (0.5 * np.pi)).astype(np.int64)
        poles = signs[rows] * self.strengths
        if not self.forward:
            turns, poles = turns[:, ::-1], poles[:, ::-1]
        found = np.empty(len(rows))
        for k, count in enumerate(counts[rows].tolist()):
            found[k] = self.lattice.energy_of(
                np.ascontiguousarray(turns[k, : max(count - 1, 0)]), np.ascontiguousarray(poles[k])
            )
        return found


class QuasistaticEpisode:
    """A chain in the tube; see `magfold_env.envs.chains.episode.Episode`.

    Parameters
    ----------
    rules : QuasistaticRules
        The scene's.
    """

    def __init__(self, rules: QuasistaticRules) -> None:
        self._rules = rules
        n = rules.n
        self._row = 0
        self._poles = np.zeros((n, 4))
        self._cells = np.zeros((n, 2), dtype=np.int64)
        self._quarters = np.zeros(n, dtype=np.int64)
        self._turns = np.zeros(n - 1, dtype=np.int64)
        self.fed = 0
        self._asked: list[float] = [0.0] * n
        self._faces: list[str] = list(rules.scene.sequence)
        self.progress = Progress.begin(n, rules.scene.feed.direction)
        self.status: FoldStatus | None = None
        self.message = ""
        self.state = self._place()

    @property
    def word(self) -> str:
        """The fold word as far as it is decided, straight from there on."""
        return _word(self._turns)

    @property
    def energy(self) -> float:
        """Magnetic energy of the components that are out [J]."""
        return self._rules.lattice.energy(self._row, self._poles, self._cells, self._quarters)

    @property
    def held(self) -> NDArray[np.bool_]:
        """No component: there is no friction."""
        return np.zeros(self._rules.n, dtype=np.bool_)

    @property
    def motion(self) -> None:
        """None: there is no motion."""
        return

    @property
    def next_component(self) -> int:
        """Index of the component to be fed next (its number − 1)."""
        if self.fed == self._rules.n:
            raise RuntimeError("every component has been fed")
        return self.progress.order[self.fed]

    def feed(self, faces: str, speed: float) -> None:
        """Set the next component's faces and speed [m/s], feed it out and decide a joint."""
        self._choose(self.next_component, faces, speed)
        self._come_out()
        self.state = self._place()

    def run(self, sequence: tuple[str, ...], speed: float) -> None:
        """Feed a whole chain out and decide its joints one after another."""
        rules = self._rules
        if rules.built:
            for index in self.progress.order:
                self._choose(index, sequence[index], speed)
            while self.status is None:
                self._come_out()
        else:
            while self.status is None:
                index = self.next_component
                self._choose(index, sequence[index], speed)
                self._come_out()
            for index in self.progress.order[self.fed :]:
                self._choose(index, sequence[index], speed)
        self.state = self._place()

    @property
    def scene_so_far(self) -> Scene:
        """The scene, with the magnets and speeds of the components fed so far."""
        sequence, speed = tuple(self._faces), self._rules.scene.speeds
        asked = [own or given for own, given in zip(self._asked, speed.tolist(), strict=True)]
        return self._rules.scene.replace(sequence=sequence, feed={"speed": tuple(asked)})

    def to_scene(self) -> Scene:
        """Return the scene, which `fold` replays."""
        if self.fed < self._rules.n:
            raise RuntimeError(
                f"{self.fed} of {self._rules.n} components are set; a scene needs all of them"
            )
        return self.scene_so_far

    def copy(self) -> Self:
        """Return an episode in the same state that goes its own way from here."""
        twin = copy.copy(self)
        for name in ("_poles", "_cells", "_quarters", "_turns", "_asked", "_faces", "progress"):
            setattr(twin, name, getattr(self, name).copy())
        return twin

    def _choose(self, index: int, faces: str, speed: float) -> None:
        """Note the settings of the next component in the order of feed."""
        self.progress.choose(index, faces, speed)
        self._poles[self.fed] = self.progress.signs[index] * self._rules.strengths[index]
        self._faces[index] = faces
        self._asked[index] = speed
        self.fed += 1

    def _come_out(self) -> None:
        """Release the next component and decide the joint between it and the one before."""
        rules, row = self._rules, self._row
        self.progress.released[self.progress.order[row]] = True
        if row > 0:
            turn = rules.lattice.lay(row, self.fed, self._poles, self._cells, self._quarters)
            joint = row - 1 if rules.forward else rules.n - 1 - row
            if turn == DEAD_END:
                self._end(FoldStatus.MISFOLDED, stuck(rules, row, self._turns))
                return
            self._turns[joint] = turn
        self._row = row + 1
        if self._row == rules.n:
            self._end(*ended(self._turns))

    def _end(self, status: FoldStatus, message: str) -> None:
        self.status = status
        self.message = message

    def _place(self) -> ChainState:
        """Return the chain with the component released last in line with the tube."""
        rules = self._rules
        angles, base = np.empty(rules.n), np.zeros(2)
        in_line(rules.forward, rules.pitch, self._row, self._turns, angles, base)
        return ChainState(angles, np.zeros(rules.n), base, np.zeros(2))


def ended(turns: NDArray[np.int64]) -> tuple[FoldStatus, str]:
    """Return how a chain has ended that is all out, from its joints' quarter turns (n − 1,)."""
    straight = [str(number) for number, turn in enumerate(turns.tolist(), 1) if turn == 0]
    if not straight:
        return FoldStatus.FOLDED, "folded"
    names = ", ".join(straight)
    return FoldStatus.MISFOLDED, f"at rest with joint {names} open"


def stuck(rules: QuasistaticRules, out: int, turns: NDArray[np.int64]) -> str:
    """Return what keeps a chain from coming out, of which `out` components are, in words."""
    joint = out if rules.forward else rules.n - out
    return f"stuck: every letter of joint {joint} overlaps after {_word(turns)!r}"


def _word(turns: NDArray[np.int64]) -> str:
    return "".join(_LETTERS[turn] for turn in turns.tolist())


def fold(scene: Scene) -> QuasistaticEpisode:
    """Return the episode of a chain that is fed out as `scene` says, at its end."""
    episode = QuasistaticEpisode(QuasistaticRules(scene))
    episode.run(scene.sequence, float(scene.speeds[0]))
    return episode
