"""Searches for the states of least energy: among all words, and component by component.

Long chains are cut in the middle and searched by branch and bound, which proves its results.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser import arms, energies, states
from magfold_env.minimiser.lattice import ORDER, Ints, all_words, from_words
from magfold_env.minimiser.states import Among, State
from magfold_env.reporting.notebook import NotebookDisplay, chain_svg, short_table
from magfold_env.reporting.page import Block
from magfold_env.reporting.tables import Row, joined_pairs
from magfold_env.scene import Scene, errors, unless_a_scene
from magfold_env.shapes import headings, overlaps, word_to_angles

Mode = Literal["free", "forward", "backward"]

LONGEST = 12
"""Largest number of components for a full search: 118,731 words. Each further component multiplies
the number of words by 2.7.

`ground_state` finds the states of longer chains.
"""

LONGEST_CUT: Final = {"all": 32, "folded": 56, "stable": 56}
"""Largest number of components for which `ground_state` can list the words of each half, by the
argument ``among``."""

MOST_STATES: Final = 10_000_000
"""Largest number of states that can be requested."""

MOST_ENTRIES: Final = 40_000_000
"""Largest number of words of half a chain, including shorter words; each needs 20 bytes."""

_STRETCH = 20_000  # number of entries bounded between two reports of progress
_BATCH = 50  # number of words completed between two reports of progress

MOST_SHOWN = 5  # states shown in one line

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Option:
    """One possible letter of a joint, and the energy of the chain with it [J]."""

    letter: str
    energy: float


@dataclass(frozen=True)
class Decision:
    """The decision of a component-by-component search on one joint."""

    joint: int
    """Number of the joint from 1; joint k is between components k and k+1."""
    options: tuple[Option, ...]
    """The letters without overlap, in the order S, L, R."""
    letter: str
    """The letter of least energy."""
    tied: str
    """Other letters of the same energy, which come later in the order S, L, R."""


@dataclass(frozen=True, repr=False)
class Minimum(NotebookDisplay):
    """The result of `minimise` or `ground_state`."""

    mode: Mode
    """Mode of the search."""
    states: tuple[State, ...]
    """The states, lowest energy first. The component-by-component modes return one state."""
    decisions: tuple[Decision, ...]
    """Decisions in the order in which they were made; empty for the mode `free`."""
    examined: int
    """Number of words whose energies were compared, or of words of half the chain if it is long."""

    @property
    def best(self) -> State:
        """The state of least energy.

        Raises
        ------
        ValueError
            If no word of this length satisfies the condition.
        """
        if not self.states:
            raise ValueError("no state satisfies the condition of the search")
        return self.states[0]

    def __repr__(self) -> str:
        """Return the lowest states, each with its energy."""
        first = ", ".join(f"{s.word} {1e3 * s.energy:.4g} mJ" for s in self.states[:MOST_SHOWN])
        more = ", …" if len(self.states) > MOST_SHOWN else ""
        return f"<{type(self).__name__}: {first or 'no state'}{more}>"

    def _shown(self) -> list[Block]:
        rows: Iterator[Row] = (
            {
                "shape": chain_svg(headings(word_to_angles(each.word))),
                "word": each.word,
                "energy [mJ]": 1e3 * each.energy,
                "stable": "yes" if each.stable else "no",
                "like poles touch": joined_pairs(each.conflicts) or "none",
                "tied": " ".join(each.tied) or "none",
            }
            for each in self.states
        )
        return [short_table(f"{self.mode}, {self.examined} words", rows, len(self.states))]


def minimise(
    scene: Scene,
    mode: Mode = "free",
    top: int = 5,
    among: Among = "all",
    *,
    progress: Progress | None = None,
) -> Minimum:
    """Predict a fold by the energy of the magnets alone.

    Parameters
    ----------
    scene
        The scene; its sequence, casing and magnets are used. Mount, friction and contact are
        ignored.
    mode
        `free` compares all words without overlap; for more than `LONGEST` components it calls
        `ground_state`. `forward` decides one joint at a time from joint 1, and `backward` does so
        from the last joint. Each joint takes the letter of least energy without overlap. The energy
        is that of all components, with the undecided joints straight.
    top
        Number of states that `free` returns.
    among
        The words that `free` ranks: `all`, only the `folded` words (no S), or only the
        `stable` words (folded, and no equal poles touch).
    progress
        Called during branch and bound; see `ground_state`.

    Raises
    ------
    ValueError
        If an argument is not allowed, the scene has an external field, the chain is too long for
        `ground_state`, or a component-by-component search reaches a joint where every letter
        overlaps.
    """
    errors.refuse(errors.unless_one_of("mode", mode, get_args(Mode)))
    _refuse(scene, top, among, progress)
    energies.refuse_field(scene)
    if mode != "free":
        return _one_by_one(scene, mode)
    if scene.n > LONGEST:
        return ground_state(scene, top, among, progress=progress)
    lattice = all_words(scene.n)
    if among != "all":
        lattice = lattice[lattice.fully_folded()]
    if among == "stable":
        lattice = lattice[states.conflict_free(lattice, scene.sequence)]
    lowest = states.lowest_states(scene, lattice, top)
    return Minimum("free", lowest, decisions=(), examined=len(lattice))


def _refuse(scene: Scene, top: int, among: Among, progress: Progress | None) -> None:
    """Raise a `SceneError` for arguments that no search accepts."""
    problems = [
        *unless_a_scene(scene),
        *errors.unless_whole("top", top, 1, MOST_STATES),
        *errors.unless_one_of("among", among, get_args(Among)),
        *errors.unless_function("progress", progress),
    ]
    errors.refuse(problems)


def _one_by_one(scene: Scene, mode: Mode) -> Minimum:
    joints = range(scene.n - 1)
    letters = ["S"] * (scene.n - 1)
    decisions: list[Decision] = []
    examined = 0
    for joint in joints if mode == "forward" else reversed(joints):
        words = ["".join([*letters[:joint], x, *letters[joint + 1 :]]) for x in ORDER]
        words = [word for word in words if not overlaps(word)]
        if not words:
            raise ValueError(
                f"mode: {mode!r} runs into a dead end: every letter of joint {joint + 1} overlaps "
                f"after {''.join(letters)!r}"
            )
        energy = energies.word_energies(scene, from_words(words))
        options = tuple(
            Option(word[joint], each) for word, each in zip(words, energy.tolist(), strict=True)
        )
        best, *others = states.ranked(scene, energy)[0]
        letters[joint] = options[best].letter
        tied = "".join(options[other].letter for other in others)
        decisions.append(Decision(joint + 1, options, letters[joint], tied))
        examined += len(words)
    return Minimum(mode, (states.state_of(scene, "".join(letters)),), tuple(decisions), examined)


def ground_state(
    scene: Scene, top: int = 1, among: Among = "all", *, progress: Progress | None = None
) -> Minimum:
    """Return the states of least energy of a long chain, and prove that no other is lower.

    The method is branch and bound. The chain is cut in the middle. The words of one half are
    ordered by a lower bound of the energy of their states, and completed in that order until the
    bound exceeds the energies found. States that tie with the last listed state may be missing.

    Parameters
    ----------
    scene
        The scene; its sequence, casing and magnets are used. Mount, friction and contact are
        ignored.
    top
        Number of states to find.
    among
        The words to rank: `all` words without overlap, only the `folded` words (no S), or only the
        `stable` words (folded, and no equal poles touch).
    progress
        Called with the completed share of the work, from 0 to 1.

    Raises
    ------
    ValueError
        If an argument is not allowed, the scene has an external field, or the chain has more
        components than `LONGEST_CUT`.
    """
    _refuse(scene, top, among, progress)
    energies.refuse_field(scene)
    if scene.n > LONGEST_CUT[among]:
        raise ValueError(
            f"sequence: {scene.n} components are not allowed; must be {LONGEST_CUT[among]} or "
            f"fewer to rank {among} words"
        )
    if scene.n == 1:
        return Minimum("free", (states.state_of(scene, ""),), decisions=(), examined=1)
    search = _BranchAndBound(scene, among, top, progress or (lambda done: None))
    # Tied words are in the order S, L, R, as in the full search.
    words = sorted(search.words(), key=lambda word: [ORDER.index(letter) for letter in word])
    lowest = states.lowest_states(scene, from_words(words), top) if words else ()
    return Minimum("free", lowest, decisions=(), examined=search.examined)


class _BranchAndBound:
    """A chain of at least two components, cut in the middle, and its best states so far.

    A new state counts as better only if its energy is below that of the worst state found by more
    than the tolerance of equal energies.
    """

    def __init__(self, scene: Scene, among: Among, top: int, progress: Progress) -> None:
        self._progress = progress
        root, letters = scene.n // 2 - 1, ORDER if among == "all" else "LR"
        self._near = arms.grown(root, root, -1, letters)
        self._far = arms.grown(root, scene.n - 1 - root, 1, letters)
        near_count, far_count = (
            arms.count_entries(arm, MOST_ENTRIES) for arm in (self._near, self._far)
        )
        table = arms.pair_table(scene, energies.poles(scene), clashes_excluded=among == "stable")
        self._near_words = arms.arm_words(table, self._near, 0, near_count)
        self._far_words = arms.arm_words(table, self._far, 1, far_count)
        self._cross = arms.cross_energies(table, self._near, self._far)
        self._tolerance = energies.tie(scene)
        nothing = np.full(top, -1, dtype=np.int64)
        self._found = arms.BestStates(np.full(top, np.inf), nothing, nothing.copy())
        self.examined = 0
        """Number of words of half a chain, including shorter words, bounded or completed so far."""

    def words(self) -> list[str]:
        """Find the best states and return their words, lowest energy first."""
        whole = self._near.joints[self._near_words.node] == self._near.joints[-1]
        prefixes: Ints = np.flatnonzero(whole & np.isfinite(self._near_words.least))
        bound = self._bounds()[prefixes] + float(self._far_words.least[0])
        order = np.argsort(bound, kind="stable")
        self._best_first(prefixes[order], bound[order])
        return [
            _letters(self._near, self._near_words, int(near))[::-1]
            + _letters(self._far, self._far_words, int(far))
            for energy, near, far in zip(*self._found, strict=True)
            if energy < np.inf
        ]

    def _bounds(self) -> Array:
        """Return a lower bound for each word of the near arm [J], without the far arm's energy."""
        bound = np.empty(self._near_words.node.size)
        for begin in range(0, bound.size, _STRETCH):
            end = min(begin + _STRETCH, bound.size)
            arms.bound_prefixes(
                self._cross, self._near, self._far, self._near_words, begin, end, bound
            )
            self.examined += end - begin
            self._progress(0.5 * end / bound.size)
        return bound

    def _best_first(self, prefixes: Ints, bound: Array) -> None:
        """Complete words of the near arm, ordered by their bounds, until none can improve."""
        begin = 0
        while True:
            worst = float(self._found.energy[-1]) - self._tolerance
            needed = int(np.searchsorted(bound, worst))
            if begin >= needed:
                break
            end = min(begin + _BATCH, needed)
            self.examined += arms.search_prefixes(
                self._cross, self._near, self._far, self._near_words, self._far_words,
                prefixes[begin:end], self._tolerance, self._found,
            )  # fmt: skip
            begin = end
            self._progress(0.5 + 0.5 * begin / needed)
        self._progress(1.0)


def _letters(arm: arms.Arm, words: arms.ArmWords, entry: int) -> str:
    """Return the letters of an entry, in the order away from the cut."""
    letters: list[str] = []
    while entry > 0:
        above = int(words.parent[entry])
        following = arm.following[words.node[above]]
        letters.append(ORDER[following.tolist().index(int(words.node[entry]))])
        entry = above
    return "".join(reversed(letters))
