"""The magnets and the speed that were found for a target, and what speaks for them.

What is said of a sequence by energy, its target among the words it competes with, is exact, for
chains of any length that the search can handle.
"""

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.files import reading_json, write_text
from magfold_env.minimiser import Mode, energies, ground_state, lattice, states
from magfold_env.reporting.intervals import Share
from magfold_env.scene import Scene, base
from magfold_env.shapes import overlaps

LOWEST = 30
"""States among which the least tolerance is looked for."""


class Rivals:
    """Words other than the target, with the energies by which they lie above it as forms.

    The target is a word of the scene's length without overlap; the scene's sequence does not count.
    """

    def __init__(self, scene: Scene, target: str, words: Iterable[str] = ()) -> None:
        self._scene = scene
        self.target = target
        self._own = energies.quadratic_forms(scene, lattice.from_words([target]))
        self.words: list[str] = []
        self.excess: Array = np.zeros((0, 4 * scene.n, 4 * scene.n))
        """Energies above the target's as forms [J], shape (rivals, 4n, 4n): sᵀ A s."""
        self.add(words)

    def add(self, words: Iterable[str]) -> bool:
        """Add the words that are not yet there, nor the target; return whether there were any."""
        known = {self.target, *self.words}
        new = [word for word in dict.fromkeys(words) if word not in known]
        if new:
            forms = energies.quadratic_forms(self._scene, lattice.from_words(new)) - self._own
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
        for letter in lattice.ORDER
        if letter != target[k]
    ]
    return [word for word in found if not overlaps(word)]


@dataclass(frozen=True)
class Evidence:
    """A target's place among the states of a sequence."""

    energy: float
    """Of the target [J]."""
    gap: float
    """How far the lowest other word lies above the target [J]; negative if it lies below."""
    rival: str
    """That word."""
    tolerance: float
    """Error of single magnets at which a rival may overtake: the relative standard deviation of all
    faces' strengths, independent of each other, at which the rival's energy above the target varies
    by as much as it is, to first order. The least among the rivals of lowest energy and those one
    letter off; negative if one lies below the target."""
    stable: bool
    """Whether the target is fully folded and no equal poles touch."""
    only_stable: bool
    """Whether no other word is."""

    @property
    def ground(self) -> bool:
        """Whether the target is the only ground state."""
        return self.gap > 0.0


def weigh(scene: Scene, target: str, calls: Counter[str]) -> Evidence:
    """Compare a target without overlap with the other words of a sequence, two components at least.

    The exact searches are added to the ``ground states`` of ``calls``.
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


Objective = Literal["probability", "ground", "unique", "gap", "sensitivity"]
Search = Literal["exhaustive", "annealing", "cross-entropy"]

FORMAT = "magfold_env design 1"


@dataclass(frozen=True)
class Design:
    """The result of `design`."""

    target: str
    """The word that was wanted."""
    mode: Mode
    """How the chain is released."""
    objective: Objective
    """What was sought, see `design`."""
    search: Search
    """How."""
    scene: Scene | None
    """The chain with the sequence and the speed that were found, ready for `simulate`; None if no
    sequence is left to give."""
    reached: bool
    """Whether the objective is met: by energy the target is the only ground state, and for `unique`
    the only stable word; for `probability` the share of successes reaches the goal."""
    score: float | None
    """The gap [J], or, where those were sought, the tolerance or the share of successes."""
    bound: float | None
    """What no sequence exceeds, proved; None if unknown."""
    evidence: Evidence | None
    """By energy."""
    probability: Share | None
    """Of settling as the target, on releases of their own; None if none were asked for."""
    releases_seed: int
    """Their seed: ``ensemble(design.scene, runs, design.releases_seed)`` repeats them."""
    calls: dict[str, int]
    """What was asked of each oracle: ``energies`` of one word, or flips of one face judged, exact
    searches for ``ground states``, and ``releases`` simulated in the search."""
    certificate: str
    """Why no sequence can do what was sought; empty if that is not proved."""

    @property
    def sequence(self) -> tuple[str, ...]:
        """The components, component 1 first.

        Raises
        ------
        ValueError
            If there are none.
        """
        return self._found.sequence

    @property
    def speed(self) -> base.PositiveEach | None:
        """Feed speed [m/s], one or one a component; None if no tube feeds.

        Raises
        ------
        ValueError
            If there is no sequence.
        """
        return None if self.mode == "free" else self._found.feed.speed

    @property
    def shortfall(self) -> float | None:
        """How far the score lies below what is proved to be the most; None if that is unknown."""
        if self.bound is None or self.score is None:
            return None
        return max(0.0, self.bound - self.score)

    @property
    def _found(self) -> Scene:
        if self.scene is None:
            raise ValueError(f"{self.target}: {self.certificate}")
        return self.scene

    def to_dict(self) -> dict[str, Any]:
        """Return the design as values that JSON can hold."""
        scene = None if self.scene is None else self.scene.model_dump(mode="json")
        return {"format": FORMAT, **asdict(self), "scene": scene}

    def to_json(self, path: str | Path) -> None:
        """Write the design as JSON, under a temporary name first; `from_json` reads it."""
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    @classmethod
    def from_json(cls, path: str | Path) -> Self:
        """Read a design that `to_json` wrote; equal to it.

        Raises
        ------
        ValueError
            If the file is no such design.
        """
        with reading_json(path, "a design", FORMAT) as data:
            kinds = {"scene": Scene, "evidence": Evidence, "probability": Share}
            for key, kind in kinds.items():
                data[key] = None if data[key] is None else kind(**data[key])
            del data["format"]
            return cls(**data)
