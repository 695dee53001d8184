"""Evidence by energy for a sequence: the target compared with its rivals.

The evidence is exact for chains of any length that the search can handle.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser import energies, ground_state, lattice, states
from magfold_env.scene import Scene
from magfold_env.shapes import overlaps

LOWEST = 30
"""Number of lowest states that the search for the least tolerance includes."""


class Rivals:
    """Words other than the target, with quadratic forms of their energies above the target's.

    The target is a word of the scene's length without overlap; the scene's sequence is ignored.
    """

    def __init__(self, scene: Scene, target: str, words: Iterable[str] = ()) -> None:
        self._scene = scene
        self.target = target
        self._own = energies.quadratic_forms(scene, lattice.from_words([target]))
        self.words: list[str] = []
        self.excess: Array = np.zeros((0, 4 * scene.n, 4 * scene.n))
        """Forms A of the energies above the target's, sᵀ A s [J], shape (rivals, 4n, 4n)."""
        self.add(words)

    def add(self, words: Iterable[str]) -> bool:
        """Add words that are new and not the target; return whether there were any."""
        known = {self.target, *self.words}
        new = [word for word in dict.fromkeys(words) if word not in known]
        if new:
            forms = energies.quadratic_forms(self._scene, lattice.from_words(new)) - self._own
            self.excess = np.concatenate([self.excess, forms])
            self.words += new
        return bool(new)

    def energies(self, signs: Array) -> Array:
        """Return the energy of each rival above the target [J], shape (rivals,)."""
        return np.einsum("a,mab,b->m", signs, self.excess, signs)

    def tolerances(self, signs: Array) -> Array:
        """Return the tolerated error of individual magnets for each rival, shape (rivals,).

        If the strengths of all faces vary independently with this relative standard deviation, the
        standard deviation of the rival's energy above the target equals that energy to first order:
        E / ‖∂E/∂(relative strengths)‖. The tolerance is negative for rivals below the target.
        """
        slopes = 2.0 * signs * (self.excess @ signs)
        size = np.sqrt(np.square(slopes).sum(axis=1))
        # If a rival's energy above the target is 0 for all strengths, its slope is 0 too.
        return self.energies(signs) / np.maximum(size, np.finfo(np.float64).tiny)


def one_letter_off(target: str) -> list[str]:
    """Return the words without overlap that differ from the target in one letter."""
    found = [
        target[:k] + letter + target[k + 1 :]
        for k in range(len(target))
        for letter in lattice.ORDER
        if letter != target[k]
    ]
    return [word for word in found if not overlaps(word)]


@dataclass(frozen=True)
class Evidence:
    """A target's place among the states of a sequence."""

    energy: float
    """Energy of the target [J]."""
    gap: float
    """Energy of `rival` relative to the target's [J]; negative if `rival` is lower."""
    rival: str
    """The lowest-energy word other than the target."""
    tolerance: float
    """Tolerated error of individual magnets: the relative standard deviation of all faces'
    independent strengths at which the standard deviation of a rival's energy above the target
    equals that energy, to first order. The value is the least among the rivals of lowest energy and
    those that differ in one letter; it is negative if a rival is below the target."""
    stable: bool
    """Whether the target is fully folded and no like poles touch."""
    only_stable: bool
    """Whether no other word is stable."""

    @property
    def ground(self) -> bool:
        """Whether the target is the only ground state."""
        return self.gap > 0.0


def weigh(scene: Scene, target: str, calls: Counter[str]) -> Evidence:
    """Compare a target without overlap, of two or more components, with the other words.

    The number of exact searches is added to ``ground states`` in ``calls``.
    """
    lowest = ground_state(scene, top=LOWEST).states
    stable = ground_state(scene, top=2, among="stable").states
    calls["ground states"] += 2
    own = states.state_of(scene, target)
    rival = next(state for state in lowest if state.word != target)
    gap = rival.energy - own.energy
    rivals = Rivals(scene, target, [*(state.word for state in lowest), *one_letter_off(target)])
    return Evidence(
        energy=own.energy,
        gap=0.0 if abs(gap) <= energies.tie(scene) else gap,
        rival=rival.word,
        tolerance=float(rivals.tolerances(np.ravel(energies.signs(scene.sequence))).min()),
        stable=own.stable,
        only_stable=[state.word for state in stable] == [target],
    )
