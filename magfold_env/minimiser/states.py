"""States: words with their energies and other properties, and the ranking of states."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.state import Array
from magfold_env.minimiser import energies
from magfold_env.minimiser.lattice import Ints, Lattice, from_words
from magfold_env.scene import Scene
from magfold_env.shapes import Outline, is_fully_folded, outline

Among = Literal["all", "folded", "stable"]
Pairs = tuple[tuple[int, int], ...]

# The cell next to each face, in the frame of the component: front-left, back-left, ...
_BESIDE = ((1, 1), (-1, 1), (-1, -1), (1, -1))


@dataclass(frozen=True, repr=False)
class State:
    """A word of the lattice with its energy."""

    word: str
    """One letter per joint, component 1 first."""
    energy: float
    """Magnetic energy [J], the same as from `mf.energy`; each pair of components counts once."""
    coulomb_score: float
    """The paper's score [J]: `energy` plus the energy of pairs inside each component, which is the
    same for all words."""
    fully_folded: bool
    """Whether every joint is L or R."""
    contacts: Pairs
    """Pairs of components, numbered from 1, that touch along a face, including neighbours."""
    conflicts: Pairs
    """Pairs of `contacts` whose touching faces have equal poles."""
    outline: Outline
    """The cells that the casings cover, up to rotation and translation."""
    tied: tuple[str, ...] = ()
    """Other words of the same energy that the search ranked with this word."""

    def __repr__(self) -> str:
        """Return the word, its energy and its conflicts."""
        pairs = ", ".join(f"{i} and {j}" for i, j in self.conflicts)
        ties = f", tied with {len(self.tied)}" if self.tied else ""
        state = (
            "stable" if self.stable else f"like poles of {pairs} touch" if pairs else "not folded"
        )
        return f"<State {self.word}: {1e3 * self.energy:.4g} mJ, {state}{ties}>"

    @property
    def stable(self) -> bool:
        """Whether the word is fully folded and no equal poles touch."""
        return self.fully_folded and not self.conflicts


def state_of(scene: Scene, word: str, tied: tuple[str, ...] = ()) -> State:
    """Return the state of a word without overlap; ``tied`` contains words of equal energy."""
    one = from_words([word])
    energy = float(energies.word_energies(scene, one)[0])
    return State(
        word=word,
        energy=energy,
        coulomb_score=energy + energies.internal_energy(scene),
        fully_folded=is_fully_folded(word),
        contacts=tuple((a // 4 + 1, b // 4 + 1) for a, b in touching_faces(one)),
        conflicts=conflicts(one, scene.sequence),
        outline=outline(word),
        tied=tied,
    )


def lowest_states(scene: Scene, lattice: Lattice, top: int) -> tuple[State, ...]:
    """Return the ``top`` states of least energy, lowest first; tied words keep the given order."""
    found: list[State] = []
    if len(lattice):
        for group in ranked(scene, energies.word_energies(scene, lattice)):
            for row in group[: top - len(found)]:
                tied = tuple(lattice.word(other) for other in group if other != row)
                found.append(state_of(scene, lattice.word(row), tied))
            if len(found) == top:
                break
    return tuple(found)


def ranked(scene: Scene, energy: Array) -> list[list[int]]:
    """Return indices by ascending energy [J], in groups of tied energies.

    The indices of each group are in ascending order.
    """
    order = np.argsort(energy, kind="stable")
    steps = np.diff(energy[order]) > energies.tie(scene)
    return [np.sort(group).tolist() for group in np.split(order, np.flatnonzero(steps) + 1)]


def touching_faces(one: Lattice) -> Pairs:
    """Return the pairs of flush faces in one word; face f of component i (0-based) is 4i + f."""
    found: list[tuple[int, int]] = []
    for i, j, poses in one.pairs():
        mine, theirs = int(_face(poses)[0]), int(_face(one.poses(j, i))[0])
        if mine >= 0:
            found.append((4 * i + mine, 4 * j + theirs))
    return tuple(found)


def conflicts(one: Lattice, sequence: Sequence[str]) -> Pairs:
    """Return the pairs of components (i, j) of one word that touch with faces of equal poles."""
    sign = np.ravel(energies.signs(sequence))
    pairs = touching_faces(one)
    return tuple((a // 4 + 1, b // 4 + 1) for a, b in pairs if sign[a] * sign[b] > 0.0)


def conflict_free(lattice: Lattice, sequence: Sequence[str]) -> NDArray[np.bool_]:
    """Return, for each word, whether no faces of equal poles touch, shape (m,)."""
    sign = energies.signs(sequence)
    free = np.ones(len(lattice), dtype=np.bool_)
    for i, j, poses in lattice.pairs():
        mine, theirs = _face(poses), _face(lattice.poses(j, i))
        # An empty face has sign 0 and never conflicts.
        free &= (mine < 0) | (sign[i, mine] * sign[j, theirs] <= 0.0)
    return free


def _face(poses: Ints) -> Ints:
    """Return the face with which a component touches another one at each pose, or -1, (m,)."""
    face = np.full(len(poses), -1, dtype=np.int64)
    for index, cell in enumerate(_BESIDE):
        face[(poses[:, :2] == cell).all(axis=1)] = index
    return face
