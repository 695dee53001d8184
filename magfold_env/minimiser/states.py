"""Words with everything that is known of them."""

from __future__ import annotations

from magfold_env.minimiser.contacts import conflicts, touching
from magfold_env.minimiser.landscape import word_energies
from magfold_env.minimiser.lattice import from_words
from magfold_env.minimiser.result import State
from magfold_env.minimiser.score import internal_energy
from magfold_env.scene import Scene
from magfold_env.shapes import is_fully_folded, outline


def state_of(scene: Scene, word: str, tied: tuple[str, ...] = ()) -> State:
    """Return the state that a word without overlap is; ``tied`` are words of equal energy."""
    one = from_words([word])
    energy = float(word_energies(scene, one)[0])
    return State(
        word=word,
        energy=energy,
        coulomb_score=energy + internal_energy(scene),
        fully_folded=is_fully_folded(word),
        contacts=touching(one),
        conflicts=conflicts(one, scene.sequence),
        outline=outline(word),
        tied=tied,
    )
