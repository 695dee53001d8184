"""The paper's sequences, and its names for their folded states."""

from __future__ import annotations

from functools import cache
from typing import Literal

from magfold_env.minimiser import State, minimise
from magfold_env.scene import Scene, load_scene

Model = Literal["literal", "device"]

FIVE = 5
"""So many states of each sequence have names, those of least energy."""

MODELS: dict[Model, str] = {
    "literal": "the paper's point charges",
    "device": "magnets as built",
}


def scene_of(number: int, model: Model) -> Scene:
    """Return one of the paper's sequences, in its own model or as the device is built."""
    suffix = "-literal" if model == "literal" else ""
    return load_scene(f"paper/sequence-{number}{suffix}")


@cache
def folded(number: int) -> tuple[State, ...]:
    """Return all full folds of a sequence in the paper's model, lowest energy first."""
    return minimise(scene_of(number, "literal"), top=26, among="folded").states


@cache
def names(number: int) -> dict[str, str]:
    """Return the paper's names by word: S1A, S1B ...: stable ones first, each by energy."""
    five = sorted(folded(number)[:FIVE], key=lambda state: not state.stable)
    letters = zip("ABCDE", five, strict=True)
    return {state.word: f"S{number}{letter}" for letter, state in letters}


def word_of(name: str) -> str:
    """Return the word that the paper calls S1A, S2B or the like.

    Raises
    ------
    KeyError
        If there is no state of this name.
    """
    return {each: word for word, each in names(int(name[1])).items()}[name]
