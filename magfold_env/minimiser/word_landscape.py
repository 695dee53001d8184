"""Energies and hinge torques of all words of a chain, for one sequence, many, or every one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from magfold_env.minimiser.contacts import conflict_free
from magfold_env.minimiser.couplings import couplings
from magfold_env.minimiser.hinge_torques import hinge_torques, pressed
from magfold_env.minimiser.landscape import (
    TIE,
    Floats,
    energy_unit,
    poles,
    quadratic_forms,
    refuse_field,
    signs,
    strengths,
)
from magfold_env.minimiser.lattice import all_words
from magfold_env.minimiser.pair_poses import PairPoses, pair_poses, sum_over_pairs
from magfold_env.minimiser.score import internal_energy
from magfold_env.minimiser.search import LONGEST
from magfold_env.minimiser.sequence_space import (
    EverySequence,
    best_words,
    energies_of_every_sequence,
)
from magfold_env.minimiser.wrenches import wrenches
from magfold_env.scene import Scene

Words = Literal["all", "folded"]
Components = Sequence[str]


class Landscape:
    """All words of a chain without overlap, and what the magnets make of them.

    Energies are those of `mf.energy`: each pair of components once, pairs inside a component left
    out. Everything is evaluated from tables of face pairs on the lattice.

    Parameters
    ----------
    scene
        Its casing and magnets count, and its sequence where no other is given; mount, friction
        and contact do not.
    among
        `all` words, or only the `folded` ones (no S).

    Attributes
    ----------
    words : tuple of str
        In the order S, L, R.

    Raises
    ------
    ValueError
        If the chain is too long to list its words, or `among` is neither of the two.

    Examples
    --------
    >>> landscape = mf.Landscape(mf.load_scene("paper/sequence-3"), among="folded")
    >>> landscape.words[landscape.energies().argmin()]
    'LRLLL'
    """

    def __init__(self, scene: Scene, among: Words = "all") -> None:
        if among not in get_args(Words):
            allowed = ", ".join(get_args(Words))
            raise ValueError(f"among: {among!r} is not allowed; must be one of {allowed}")
        if scene.n > LONGEST:
            raise ValueError(
                f"sequence: {scene.n} components are not allowed; a landscape takes at most "
                f"{LONGEST}, ground_state more"
            )
        refuse_field(scene)
        lattice = all_words(scene.n)
        self._lattice = lattice[lattice.fully_folded()] if among == "folded" else lattice
        self._scene = scene
        self.words = tuple(self._lattice.word(row) for row in range(len(self._lattice)))

    @property
    def scene(self) -> Scene:
        """The scene it was made of."""
        return self._scene

    def energies(self, sequences: Sequence[Components] | Floats | None = None) -> Floats:
        """Return the energies of all words [J].

        Parameters
        ----------
        sequences
            Sequences of components, or an array (k, n, 4) of signs, +1 for N, -1 for S and 0 for a
            face without magnet; None takes the scene's own.

        Returns
        -------
        (words,) array, or (k, words) if sequences are given

        Raises
        ------
        ValueError
            If a sequence does not fit.
        """
        strength = self._strengths(sequences)
        out = np.empty((len(strength), len(self.words)))
        sum_over_pairs(self._couplings, self._poses, strength, out)
        return out[0] if sequences is None else out

    def coulomb_scores(self) -> Floats:
        """Return the paper's score of each word [J]: its energy and the pairs inside components."""
        return self.energies() + internal_energy(self._scene)

    def torques(self) -> Floats:
        """Return the torques on the joints of each word, shape (words, n - 1) [N·m].

        Positive ones turn left: they are -∂U/∂θ of the joint angles θ.
        """
        half_length = 0.5 * self._scene.casing.diagonal
        strength = self._strengths(None)[0]
        return hinge_torques(self._lattice, self._poses, self._wrenches, strength, half_length)

    def mechanically_stable(self) -> npt.NDArray[np.bool_]:
        """Whether the magnets press every joint of each word against its stop, shape (words,).

        Such a word stays when it is let go: it is a local minimum of the energy. A word that is
        not may still be held by friction, or by casings that touch.
        """
        return pressed(self._lattice, self.torques())

    def conflict_free(self) -> npt.NDArray[np.bool_]:
        """Whether no two touching faces of each word have equal poles, shape (words,)."""
        return conflict_free(self._lattice, self._scene.sequence)

    def every_energy(self, word: str) -> Floats:
        """Return a word's energy with every sequence whose first face is N [J].

        Returns
        -------
        (2^(4n-1),) array
            By number, see `sequence_of`.

        Raises
        ------
        ValueError
            If the word is none of `words`, or there are too many sequences.
        """
        if word not in self.words:
            raise ValueError(f"word: {word!r} is not allowed; must be one of the landscape's words")
        return energies_of_every_sequence(self._forms[self.words.index(word)])

    def every_sequence(self, progress: Callable[[float], None] | None = None) -> EverySequence:
        """Find the ground state of every sequence.

        Parameters
        ----------
        progress
            Called with the share of the work that is done, from 0 to 1.

        Raises
        ------
        ValueError
            If there are too many sequences.
        """
        return best_words(self._forms, self.words, TIE * energy_unit(self._scene), progress)

    @cached_property
    def _poses(self) -> PairPoses:
        return pair_poses(self._lattice)

    @cached_property
    def _couplings(self) -> Floats:
        return couplings(self._scene).at(self._poses.pose)

    @cached_property
    def _wrenches(self) -> Floats:
        return wrenches(self._scene, self._poses.pose)

    @cached_property
    def _forms(self) -> Floats:
        return quadratic_forms(self._scene, self._lattice)

    def _strengths(self, sequences: Sequence[Components] | Floats | None) -> Floats:
        n = self._scene.n
        if sequences is None:
            return poles(self._scene)[None]
        if isinstance(sequences, np.ndarray):
            given = np.ascontiguousarray(sequences, dtype=np.float64)
        else:
            given = np.array(
                [signs(self._scene.replace(sequence=each).sequence) for each in sequences]
            )
        if given.shape[1:] != (n, 4):
            raise ValueError(f"sequences: shape {given.shape} is not allowed; must be (k, {n}, 4)")
        return given * strengths(self._scene)
