"""Tests of the exact gap design against brute force over all sequences and words."""

import numpy as np
import pytest

from magfold_env.designer import gap_designs
from magfold_env.minimiser.energies import quadratic_forms
from magfold_env.minimiser.lattice import from_words
from magfold_env.scene import Scene
from tests.minimiser import reference
from tests.minimiser.scenes import STRENGTHS, scene_of


def scene_for(n: int, model: str) -> Scene:
    return scene_of(("NNNN",) * n, model)


def brute_force(n: int, model: str) -> dict[str, tuple[float, tuple[str, ...]]]:
    """Return the largest gap of every word, and the first sequence with this gap."""
    words = reference.words(n)
    form = quadratic_forms(scene_for(n, model), from_words(words))
    numbers = np.arange(16**n)
    bits = (numbers[:, None] >> np.arange(4 * n - 1, -1, -1)) & 1
    sign = 1.0 - 2.0 * bits
    energies = np.stack([np.einsum("qa,ab,qb->q", sign, j, sign, optimize=True) for j in form])
    lowest = np.sort(energies, axis=0)[:2]
    found: dict[str, tuple[float, tuple[str, ...]]] = {}
    for word, energy in zip(words, energies, strict=True):
        gap = np.where(energy == lowest[0], lowest[1], lowest[0]) - energy
        first = int(np.argmax(gap >= gap.max() * (1 - 1e-9)))
        letters = "".join("NS"[bit] for bit in bits[first])
        found[word] = gap.max(), tuple(letters[k : k + 4] for k in range(0, 4 * n, 4))
    return found


@pytest.mark.parametrize(
    ("n", "model"),
    [(n, model) for model in ("points", "strips") for n in (2, 3, 4)]
    + [(n, model) for model in STRENGTHS for n in (2, 3)],
)
def test_the_design_is_the_best_of_all_sequences(n: int, model: str) -> None:
    scene = scene_for(n, model)
    expected = brute_force(n, model)
    designs = gap_designs(scene, expected)
    assert list(designs) == list(expected)
    for target, (gap, sequence) in expected.items():
        assert designs[target] == (None if gap <= 1e-12 else sequence)


def test_a_target_that_never_is_the_ground_state_has_no_design() -> None:
    never = gap_designs(scene_for(3, "strips").replace(magnets=None), ["LL", "SS"])
    assert never == {"LL": None, "SS": None}


@pytest.mark.parametrize(("n", "target", "message"), [
    (7, "LRLLLR", r"7 component\(s\) are not allowed; the exhaustive gap search takes 2 to 6"),
    (1, "", "sequence: 1 component"),
    (6, "LRL", "word: 'LRL' is not allowed; must have 5 letters"),
    (6, "LRXLL", "word: 'LRXLL' is not allowed"),
    (6, "LLLLL", "targets: 'LLLLL' is not allowed; its components overlap"),
])  # fmt: skip
def test_wrong_arguments_are_named(n: int, target: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gap_designs(scene_for(n, "points"), [target])
