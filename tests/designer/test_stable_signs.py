"""Sequences under which a target holds: no other word is stable, whatever is still free."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.designer import annealing
from magfold_env.designer.annealing import sequence_of_signs, stable_groups
from magfold_env.shapes import folded_words

SCENE = mf.load_scene("design")


def stable_words(sequence: tuple[str, ...]) -> list[str]:
    scene = SCENE.replace(sequence=sequence)
    return [state.word for state in mf.minimise(scene, among="stable", top=100).states]


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_the_target_is_the_only_stable_word_whatever_is_flipped(n: int) -> None:
    rng = np.random.default_rng(n)
    for target in folded_words(n):
        signs, groups = stable_groups(target)
        assert sorted(np.concatenate(groups).tolist()) == list(range(4 * n))
        for group in groups:
            signs[group] *= rng.choice([-1.0, 1.0])
        assert stable_words(sequence_of_signs(signs)) == [target]


@pytest.mark.parametrize("n", [7, 8, 9])
def test_every_longer_word_can_be_held(n: int) -> None:
    for target in folded_words(n):
        stable_groups(target)


@pytest.mark.slow
@pytest.mark.parametrize("n", [10, 11, 12, 13, 14, 15, 16])
def test_every_word_can_be_held(n: int) -> None:
    for target in folded_words(n):
        stable_groups(target)


def test_contradictions_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    # No word is known whose contacts contradict each other: the equations are bent instead.
    monkeypatch.setattr(annealing.states, "touching_faces", lambda _: ((0, 5), (3, 6)))
    with pytest.raises(ValueError, match="contradict"):
        stable_groups("L")
