"""What speaks for a sequence, by energy: exact, for chains of any length the search can handle."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from magfold_env.designer.rivals import Rivals, one_letter_off
from magfold_env.minimiser.energies import TIE, energy_unit, signs
from magfold_env.minimiser.ground_states import ground_state
from magfold_env.minimiser.states import state_of
from magfold_env.scene import Scene

LOWEST = 30
"""States among which the least tolerance is looked for."""


@dataclass(frozen=True)
class Evidence:
    """A target's place among the states of a sequence.

    Attributes
    ----------
    energy : float
        Of the target [J].
    gap : float
        How far the lowest other word lies above the target [J]; negative if it lies below.
    rival : str
        That word.
    tolerance : float
        Error of single magnets at which a rival may overtake: the relative standard deviation of
        all faces' strengths, independent of each other, at which the rival's energy above the
        target varies by as much as it is, to first order. The least among the rivals of lowest
        energy and those one letter off; negative if one lies below the target.
    stable : bool
        Whether the target is fully folded and no equal poles touch.
    only_stable : bool
        Whether no other word is.
    """

    energy: float
    gap: float
    rival: str
    tolerance: float
    stable: bool
    only_stable: bool

    @property
    def ground(self) -> bool:
        """Whether the target is the only ground state."""
        return self.gap > 0.0


def weigh(scene: Scene, target: str, calls: Counter[str]) -> Evidence:
    """Compare a target with the other words of a scene's sequence.

    Parameters
    ----------
    scene
        With the sequence, at least two components.
    target
        A word of its length without overlap.
    calls
        The exact searches are added to its ``ground states``.
    """
    lowest = ground_state(scene, top=LOWEST).states
    stable = ground_state(scene, top=2, among="stable").states
    calls["ground states"] += 2
    own = state_of(scene, target)
    rival = next(state for state in lowest if state.word != target)
    gap = rival.energy - own.energy
    rivals = Rivals(scene, target, [*(state.word for state in lowest), *one_letter_off(target)])
    return Evidence(
        energy=own.energy,
        gap=0.0 if abs(gap) <= TIE * energy_unit(scene) else gap,
        rival=rival.word,
        tolerance=float(rivals.tolerances(np.ravel(signs(scene.sequence))).min()),
        stable=own.stable,
        only_stable=[state.word for state in stable] == [target],
    )
