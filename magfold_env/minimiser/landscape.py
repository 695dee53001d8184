"""Energies of all words of a chain, for one sequence, many, or every one."""

from collections.abc import Sequence
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser import couplings, energies
from magfold_env.minimiser.every_sequence import EverySequence, best_words, every_energy
from magfold_env.minimiser.lattice import all_words
from magfold_env.minimiser.search import LONGEST
from magfold_env.scene import Scene, errors, unless_a_scene
from magfold_env.shapes import parse_word

Words = Literal["all", "folded"]
Components = Sequence[str]


class Landscape:
    """All words of a chain without overlap, with their energies and torques.

    Energies are those of `mf.energy`: each pair of components counts once, without pairs inside a
    component. All values come from tables of face pairs on the lattice.

    Parameters
    ----------
    scene
        The scene; its casing and magnets are used, and its sequence unless another is given. Mount,
        friction and contact are ignored.
    among
        `all` words, or only the `folded` ones (no S).

    Attributes
    ----------
    words : tuple of str
        In the order S, L, R.

    Raises
    ------
    ValueError
        If the chain is too long to list its words, or `among` is not one of these.

    Examples
    --------
    >>> landscape = mf.Landscape(mf.load_scene("paper/sequence-3"), among="folded")
    >>> landscape.words[landscape.energies().argmin()]
    'LRLLL'
    """

    def __init__(self, scene: Scene, among: Words = "all") -> None:
        problems = unless_a_scene(scene) + errors.unless_one_of("among", among, get_args(Words))
        errors.refuse(problems)
        if scene.n > LONGEST:
            raise ValueError(
                f"sequence: {scene.n} components are not allowed; a landscape takes at most "
                f"{LONGEST}, ground_state more"
            )
        energies.refuse_field(scene)
        lattice = all_words(scene.n)
        self._lattice = lattice[lattice.fully_folded()] if among == "folded" else lattice
        self.scene = scene
        """The scene of the landscape."""
        self.words = self._lattice.words

    def energies(self, sequences: Sequence[Components] | Array | None = None) -> Array:
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
        couplings.sum_over_pairs(self._couplings, self._poses, strength, out)
        return out[0] if sequences is None else out

    def coulomb_scores(self) -> Array:
        """Return the paper's score of each word [J]: energy plus the pairs inside components."""
        return self.energies() + energies.internal_energy(self.scene)

    def every_energy(self, word: str) -> Array:
        """Return a word's energy with every sequence whose first face is N [J].

        Returns
        -------
        (2^(4n-1),) array
            By number, see `sequence_of`.

        Raises
        ------
        ValueError
            If the word is not in `words`, or there are too many sequences.
        """
        if parse_word(word, self.scene.n) not in self.words:
            raise ValueError(f"word: {word!r} is not allowed; must be one of the landscape's words")
        return every_energy(self._forms[self.words.index(word)])

    def every_sequence(self) -> EverySequence:
        """Find the ground state of every sequence.

        Raises
        ------
        ValueError
            If there are too many sequences.
        """
        return best_words(self._forms, self.words, energies.tie(self.scene))

    @cached_property
    def _poses(self) -> couplings.PairPoses:
        return couplings.pair_poses(self._lattice)

    @cached_property
    def _couplings(self) -> Array:
        return couplings.couplings(self.scene).at(self._poses.pose)

    @cached_property
    def _forms(self) -> Array:
        return energies.quadratic_forms(self.scene, self._lattice)

    def _strengths(self, sequences: Sequence[Components] | Array | None) -> Array:
        n = self.scene.n
        if sequences is None:
            return energies.poles(self.scene)[None]
        if isinstance(sequences, np.ndarray):
            if not np.isin(sequences, (-1.0, 0.0, 1.0)).all():
                allowed = "must consist of +1, -1 and 0"
                raise errors.SceneError([errors.Problem("sequences", sequences, allowed)])
            given = np.ascontiguousarray(sequences, dtype=np.float64)
        else:
            allowed = "a list of sequences, or an array of signs"
            errors.refuse(errors.unless_a("sequences", sequences, Sequence, allowed))
            scenes = [self.scene.replace(sequence=each) for each in sequences]
            given = np.array([energies.signs(each.sequence) for each in scenes])
        if given.shape[1:] != (n, 4):
            raise ValueError(f"sequences: shape {given.shape} is not allowed; must be (k, {n}, 4)")
        return given * energies.strengths(self.scene)
