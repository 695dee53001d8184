"""The energy minimiser: full search, and the component-by-component search of the paper."""

from dataclasses import dataclass
from typing import Literal, get_args

from magfold_env.minimiser import energies, states
from magfold_env.minimiser.ground_states import ground_state
from magfold_env.minimiser.lattice import ORDER, all_words, from_words
from magfold_env.minimiser.states import Among, Ranking, State, state_of
from magfold_env.scene import Scene, errors

Mode = Literal["free", "forward", "backward"]

LONGEST = 12
"""Most components of a full search: 118,731 words, 2.7 times more with each component.

The states of longer chains are found by `ground_state`.
"""


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


@dataclass(frozen=True)
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


def minimise(scene: Scene, mode: Mode = "free", top: int = 5, among: Among = "all") -> Minimum:
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

    Raises
    ------
    ValueError
        If an argument is none of these, the scene has an external field, the chain is too long
        for a full search, or a component-by-component search runs into a joint where every letter
        overlaps.
    """
    problems = [
        *errors.unless_one_of("mode", mode, get_args(Mode)),
        *errors.unless_one_of("among", among, get_args(Among)),
        *errors.unless_at_least("top", top, 1),
    ]
    errors.refuse(problems)
    energies.refuse_field(scene)
    if mode != "free":
        return _one_by_one(scene, mode)
    if scene.n > LONGEST:
        found = ground_state(scene, top, among)
        return Minimum("free", found.states, decisions=(), examined=found.nodes)
    lattice = all_words(scene.n)
    if among != "all":
        lattice = lattice[lattice.fully_folded()]
    if among == "stable":
        lattice = lattice[states.conflict_free(lattice, scene.sequence)]
    lowest = states.lowest_states(scene, lattice, top)
    return Minimum("free", lowest, decisions=(), examined=len(lattice))


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
    return Minimum(mode, (state_of(scene, "".join(letters)),), tuple(decisions), examined)
