"""The paper's sequences, its names for their folded states, and pictures of states."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Literal

from magfold_bench.paper.reproduction import Plot
from magfold_bench.tables import Row
from magfold_env.minimiser import State, minimise
from magfold_env.minimiser.states import state_of
from magfold_env.scene import Scene, load_scene

Model = Literal["literal", "device"]

FIVE = 5
"""Number of states per sequence to which the paper gives names: those with the least energy."""

MODELS: dict[Model, str] = {
    "literal": "the paper's point charges",
    "device": "magnets as built",
}


def scene_of(number: int, model: Model) -> Scene:
    """Return one of the paper's sequences, with the paper's model or as the device is built."""
    suffix = "-literal" if model == "literal" else ""
    return load_scene(f"paper/sequence-{number}{suffix}")


@cache
def folded(number: int) -> tuple[State, ...]:
    """Return all full folds of a sequence in the paper's model, the lowest energy first."""
    return minimise(scene_of(number, "literal"), top=26, among="folded").states


@cache
def names(number: int) -> dict[str, str]:
    """Return the paper's names by word: S1A, S1B … by energy, stable states first."""
    five = sorted(folded(number)[:FIVE], key=lambda state: not state.stable)
    letters = zip("ABCDE", five, strict=True)
    return {state.word: f"S{number}{letter}" for letter, state in letters}


def word_of(name: str) -> str:
    """Return the word to which the paper gives a name such as S1A."""
    return {each: word for word, each in names(int(name[1])).items()}[name]


def turned_joints(word: str, other: str) -> list[int]:
    """Return the numbers of the joints, from 1, in which two words differ."""
    return [k for k, (a, b) in enumerate(zip(word, other, strict=True), start=1) if a != b]


def plot(name: str, number: int, rows: list[Row], caption: str) -> Plot:
    """Return a picture of a sequence's states, side by side."""

    def save(path: Path) -> None:
        from magfold_env.render import draw_states  # noqa: PLC0415 - an extra

        scene = scene_of(number, "literal")
        states = [state_of(scene, str(row["word"])) for row in rows]
        # The energies in the paper are scores.
        scored = [replace(state, energy=state.coulomb_score) for state in states]
        draw_states(scene, scored, path)

    return Plot(name, caption, save)
