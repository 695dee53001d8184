"""Searches for the states of least energy: of all words, component by component, of long chains.

Long chains are cut in the middle and searched by branch and bound, which proves what it finds.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser import arms, energies, states
from magfold_env.minimiser.lattice import ORDER, Ints, all_words, from_words
from magfold_env.minimiser.states import Among, State
from magfold_env.scene import Scene, errors, unless_a_scene

Mode = Literal["free", "forward", "backward"]

LONGEST = 12
"""Most components of a full search: 118,731 words, 2.7 times more with each component.

The states of longer chains are found by `ground_state`.
"""

LONGEST_CUT: Final = {"all": 32, "folded": 56, "stable": 56}
"""Most components of a chain whose halves `ground_state` lists, by which words are ranked."""

MOST_STATES: Final = 10_000_000
"""So many may be asked for."""

MOST_ENTRIES: Final = 40_000_000
"""No half of these has more words, shorter ones included: 20 bytes each."""

_FIRST = 100  # words of the near arm that are completed where there is no time to order them
_STRETCH = 20_000  # entries bounded, and
_BATCH = 50  # words completed, between two looks at the clock

MOST_SHOWN = 5  # states of a result in a line

Progress = Callable[[float], None]


class Ranking:
    """What a search found: states, the lowest first."""

    states: tuple[State, ...]

    @property
    def best(self) -> State:
        """The state of least energy that was found.

        Raises
        ------
        ValueError
            If there is none: no word of this length satisfies the condition that was set, or none
            was found within the limits.
        """
        if not self.states:
            raise ValueError("the search found no state that satisfies its condition")
        return self.states[0]

    def __repr__(self) -> str:
        """Return the lowest states, each with its energy."""
        first = ", ".join(f"{s.word} {1e3 * s.energy:.4g} mJ" for s in self.states[:MOST_SHOWN])
        more = ", …" if len(self.states) > MOST_SHOWN else ""
        return f"<{type(self).__name__}: {first or 'no state'}{more}>"


@dataclass(frozen=True)
class Option:
    """One letter a joint could take, and the energy of the chain with it [J]."""

    letter: str
    energy: float


@dataclass(frozen=True)
class Decision:
    """One joint decided by a component-by-component search."""

    joint: int
    """1-based: joint k lies between components k and k+1."""
    options: tuple[Option, ...]
    """Those without overlap, in the order S, L, R."""
    letter: str
    """The one of least energy."""
    tied: str
    """The other letters of the same energy; the order S, L, R decided against them."""


@dataclass(frozen=True, repr=False)
class Minimum(Ranking):
    """The result of `minimise`."""

    mode: Mode
    """How the chain was searched."""
    states: tuple[State, ...]
    """Lowest energy first. The component-by-component modes end in one state."""
    decisions: tuple[Decision, ...]
    """In the order they were taken; empty for the full search."""
    examined: int
    """Number of words whose energies were compared; of words of half the chain for long ones."""


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
        Its sequence, casing and magnets count; mount, friction and contact do not.
    mode
        `free` compares every word without overlap; more than `LONGEST` components by branch and
        bound, which proves the same. `forward` decides one joint at a time from
        joint 1 on, `backward` from the last: the letter of least energy, all components acting,
        joints not yet decided straight, overlaps excluded.
    top
        How many states `free` returns.
    among
        Which words `free` ranks: `all`, only the `folded` ones (no S), or only the
        `stable` ones (folded, and no equal poles touch).
    progress
        Of branch and bound, as for `ground_state`.

    Raises
    ------
    ValueError
        If an argument is none of these, the scene has an external field, the chain is too long
        for a full search, or a component-by-component search runs into a joint where every letter
        overlaps.
    """
    errors.refuse(errors.unless_one_of("mode", mode, get_args(Mode)))
    _refuse(scene, top, among, progress)
    energies.refuse_field(scene)
    if mode != "free":
        return _one_by_one(scene, mode)
    if scene.n > LONGEST:
        found = ground_state(scene, top, among, progress=progress)
        return Minimum("free", found.states, decisions=(), examined=found.nodes)
    lattice = all_words(scene.n)
    if among != "all":
        lattice = lattice[lattice.fully_folded()]
    if among == "stable":
        lattice = lattice[states.conflict_free(lattice, scene.sequence)]
    lowest = states.lowest_states(scene, lattice, top)
    return Minimum("free", lowest, decisions=(), examined=len(lattice))


def _refuse(scene: Scene, top: int, among: Among, progress: Progress | None) -> None:
    """Refuse what no search can be asked for."""
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
        lattice = from_words(words)
        lattice = lattice[~lattice.overlapping()]
        if not len(lattice):
            raise ValueError(
                f"mode: {mode!r} runs into a dead end: every letter of joint {joint + 1} overlaps "
                f"after {''.join(letters)!r}"
            )
        energy = energies.word_energies(scene, lattice)
        options = tuple(
            Option(word[joint], each)
            for word, each in zip(lattice.words, energy.tolist(), strict=True)
        )
        best, *others = states.ranked(scene, energy)[0]
        letters[joint] = options[best].letter
        tied = "".join(options[other].letter for other in others)
        decisions.append(Decision(joint + 1, options, letters[joint], tied))
        examined += len(lattice)
    return Minimum(mode, (states.state_of(scene, "".join(letters)),), tuple(decisions), examined)


@dataclass(frozen=True, repr=False)
class GroundStates(Ranking):
    """The result of `ground_state`."""

    states: tuple[State, ...]
    """Lowest energy first."""
    lower_bound: float
    """No state that is not listed lies lower [J]; infinite if every state is listed."""
    nodes: int
    """Words of half the chain, shorter ones included, that were bounded or completed."""

    @property
    def gap(self) -> float:
        """How far below the best state another could still lie [J]; 0 if none can."""
        return max(0.0, self.best.energy - self.lower_bound)

    @property
    def proved(self) -> bool:
        """Whether the best state is proved to be a ground state."""
        return self.gap == 0.0

    @property
    def complete(self) -> bool:
        """Whether all states listed are proved to be the lowest that there are."""
        highest = self.states[-1].energy if self.states else math.inf
        return highest <= self.lower_bound


def ground_state(
    scene: Scene,
    top: int = 1,
    among: Among = "all",
    *,
    time_limit: float | None = None,
    node_limit: int | None = None,
    progress: Progress | None = None,
) -> GroundStates:
    """Find the states of least energy of a long chain and prove that they are.

    Branch and bound: the chain is cut in the middle, the words of one half are ordered by a lower
    bound on the energy of the states that they belong to, and completed in that order until the
    bound exceeds what was found. Where states tie with the last one listed, some are left out.

    Parameters
    ----------
    scene
        Its sequence, casing and magnets count; mount, friction and contact do not.
    top
        How many states to find.
    among
        Which words to rank: `all` that do not overlap, only the `folded` ones (no S), or only the
        `stable` ones (folded, and no equal poles touch).
    time_limit
        Stop after this time [s], None for never, with what was found and the bound that was
        reached. Listing the words of both halves comes first and is not stopped.
    node_limit
        Stop after so many words of half the chain, bounded or completed: unlike time, they are
        the same on every machine.
    progress
        Called with the share of the work that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If an argument is out of range, or the chain has more components than `LONGEST_CUT`.
    """
    _refuse(scene, top, among, progress)
    for key, limit in (("time_limit", time_limit), ("node_limit", node_limit)):
        if limit is not None and not (errors.is_number(limit) and limit >= 0):
            errors.refuse([errors.Problem(key, limit, "must be None or at least 0")])
    energies.refuse_field(scene)
    if scene.n > LONGEST_CUT[among]:
        raise ValueError(
            f"sequence: {scene.n} components are not allowed; must be {LONGEST_CUT[among]} or "
            f"fewer to rank {among} words"
        )
    if scene.n == 1:
        return GroundStates((states.state_of(scene, ""),), math.inf, nodes=1)
    letters = ORDER if among == "all" else "LR"
    end = math.inf if time_limit is None else time.monotonic() + time_limit
    search = _BranchAndBound(
        scene, letters, stable=among == "stable", top=top,
        end=end, most_nodes=math.inf if node_limit is None else node_limit,
        progress=progress or (lambda done: None),
    )  # fmt: skip
    bound = search.run()
    # Ties in the order S, L, R, as in the full search.
    words = sorted(search.words(), key=lambda word: [ORDER.index(letter) for letter in word])
    lowest: tuple[State, ...] = ()
    if words:
        lowest = states.lowest_states(scene, from_words(words), top)
    bound = min([bound, *(state.energy for state in lowest[top - 1 :])])
    return GroundStates(lowest, bound, search.nodes)


class _BranchAndBound:
    """A chain of at least two components cut in the middle, and the best states found of it.

    Words have some ``letters``; ``stable`` ones no equal poles that touch. It stops at the time
    ``end``, see `time.monotonic`, or after ``most_nodes``. States are sought where they lie lower
    than the worst one found by more than equal energies may differ.
    """

    def __init__(
        self, scene: Scene, letters: str, *,
        stable: bool, top: int, end: float, most_nodes: float, progress: Progress,
    ) -> None:  # fmt: skip
        self._end, self._most_nodes, self._progress = end, most_nodes, progress
        root = scene.n // 2 - 1
        self._near, self._far = arms.near_arm(root, letters), arms.far_arm(root, scene.n, letters)
        near_count, far_count = (
            arms.count_entries(arm, MOST_ENTRIES) for arm in (self._near, self._far)
        )
        table = arms.pair_table(scene, energies.poles(scene), clashes_excluded=stable)
        self._near_words = arms.arm_words(table, self._near, 0, near_count)
        self._far_words = arms.arm_words(table, self._far, 1, far_count)
        self._cross = arms.cross_energies(table, self._near, self._far)
        self._tolerance = energies.tie(scene)
        nothing = np.full(top, -1, dtype=np.int64)
        self._found = arms.BestStates(np.full(top, np.inf), nothing, nothing.copy())
        self.nodes = 0

    def run(self) -> float:
        """Find the best states, and return what all others have at least [J].

        That is infinite if nothing that is better than the worst one found was left out.
        """
        whole = self._near.joints[self._near_words.node] == self._near.joints[-1]
        prefixes: Ints = np.flatnonzero(whole & np.isfinite(self._near_words.least))
        far_least = float(self._far_words.least[0])
        if not prefixes.size or not math.isfinite(far_least):
            return math.inf
        bound = self._bounds()
        if bound is None:
            own = self._near_words.least[prefixes]
            self._complete(prefixes[np.argsort(own, kind="stable")[:_FIRST]])
            crossing = arms.least_cross_energy(self._cross, self._near, self._far)
            return float(own.min()) + far_least + crossing
        bound = bound[prefixes] + far_least
        order = np.argsort(bound, kind="stable")
        return self._best_first(prefixes[order], bound[order])

    def words(self) -> list[str]:
        """Return the words found, lowest energy first."""
        found = self._found
        return [
            _letters(self._near, self._near_words, int(near))[::-1]
            + _letters(self._far, self._far_words, int(far))
            for energy, near, far in zip(*found, strict=True)
            if energy < np.inf
        ]

    def _stopped(self) -> bool:
        return self.nodes >= self._most_nodes or time.monotonic() >= self._end

    def _bounds(self) -> Array | None:
        """Bound every word of the near arm [J], the far arm's own energy left out."""
        bound = np.empty(self._near_words.node.size)
        for begin in range(0, bound.size, _STRETCH):
            if self._stopped():
                return None
            end = min(begin + _STRETCH, bound.size)
            arms.bound_prefixes(
                self._cross, self._near, self._far, self._near_words, begin, end, bound
            )
            self.nodes += end - begin
            self._progress(0.5 * end / bound.size)
        return bound

    def _best_first(self, prefixes: Ints, bound: Array) -> float:
        """Complete words of the near arm, ordered by their bounds, until none can improve."""
        begin = 0
        while True:
            worst = float(self._found.energy[-1]) - self._tolerance
            needed = int(np.searchsorted(bound, worst))
            if begin >= needed:
                self._progress(1.0)
                return math.inf
            if begin > 0 and self._stopped():
                return float(bound[begin])
            end = min(begin + _BATCH, needed)
            self._complete(prefixes[begin:end])
            begin = end
            self._progress(0.5 + 0.5 * begin / needed)

    def _complete(self, prefixes: Ints) -> None:
        self.nodes += arms.search_prefixes(
            self._cross, self._near, self._far, self._near_words, self._far_words,
            prefixes, self._tolerance, self._found,
        )  # fmt: skip


def _letters(arm: arms.Arm, words: arms.ArmWords, entry: int) -> str:
    """Return the letters of an entry, away from the cut."""
    letters: list[str] = []
    while entry > 0:
        above = int(words.parent[entry])
        following = arm.following[words.node[above]]
        letters.append(ORDER[following.tolist().index(int(words.node[entry]))])
        entry = above
    return "".join(reversed(letters))
