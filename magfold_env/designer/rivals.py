"""The words a target competes with: how far above it they lie, for any signs of the faces."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser.energies import quadratic_forms
from magfold_env.minimiser.lattice import from_words
from magfold_env.scene import Scene
from magfold_env.shapes import overlaps


class Rivals:
    """Words other than the target, with the energies by which they lie above it as forms.

    Parameters
    ----------
    scene
        Its casing, its magnets and its number of components count; its sequence does not.
    target
        A word of the scene's length without overlap.
    words
        The first rivals.
    """

    def __init__(self, scene: Scene, target: str, words: Iterable[str] = ()) -> None:
        self._scene = scene
        self.target = target
        self._own = quadratic_forms(scene, from_words([target]))
        self.words: list[str] = []
        self.excess: Array = np.zeros((0, 4 * scene.n, 4 * scene.n))
        """Energies above the target's as forms [J], shape (rivals, 4n, 4n): sᵀ A s."""
        self.add(words)

    def add(self, words: Iterable[str]) -> bool:
        """Add the words that are not yet there, nor the target; return whether there were any."""
        known = {self.target, *self.words}
        new = [word for word in dict.fromkeys(words) if word not in known]
        if new:
            forms = quadratic_forms(self._scene, from_words(new)) - self._own
            self.excess = np.concatenate([self.excess, forms])
            self.words += new
        return bool(new)

    def energies(self, signs: Array) -> Array:
        """Return how far each rival lies above the target [J], shape (rivals,)."""
        return np.einsum("a,mab,b->m", signs, self.excess, signs)

    def tolerances(self, signs: Array) -> Array:
        """Return the error of single magnets at which each rival may overtake, shape (rivals,).

        If the strengths of all faces vary independently with this relative standard deviation, the
        rival's energy above the target varies, to first order, by one standard deviation as much
        as it is: E / ‖∂E/∂(relative strengths)‖. It is negative for rivals below the target.
        """
        slopes = 2.0 * signs * (self.excess @ signs)
        size = np.sqrt(np.square(slopes).sum(axis=1))
        # A rival of the same energy whatever the strengths has no slope either.
        return self.energies(signs) / np.maximum(size, np.finfo(np.float64).tiny)


def one_letter_off(target: str) -> list[str]:
    """Return the words without overlap that differ from the target in one letter."""
    found = [
        target[:k] + letter + target[k + 1 :]
        for k in range(len(target))
        for letter in "SLR"
        if letter != target[k]
    ]
    return [word for word in found if not overlaps(word)]
