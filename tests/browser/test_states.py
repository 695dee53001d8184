"""Tests that a page ranks the same states as the minimiser."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.browser import states
from magfold_env.engine.compile import by_pointer
from tests.browser import built
from tests.browser.scenes import chain_of, couplings_of, random_scene, told
from tests.browser.test_engine import bits

pytestmark = pytest.mark.skipif(
    not by_pointer.POINTERS, reason="needs kernels that take tuples by pointer"
)
GIVEN = MAGNETS, COUPLINGS = couplings_of()
LETTERS = {1: "L", 0: "S", -1: "R"}


def ranked(scene: mf.Scene, at_once: int = 10**9) -> list[tuple[str, float, bool]]:
    """Return words, their energies [J] and whether they are stable, as computed by the kernels."""
    chain = chain_of(scene, GIVEN)
    search = chain.search
    while not states.couple(COUPLINGS, MAGNETS, scene.n, at_once):
        pass
    states.begin_search(chain.settings, COUPLINGS, search)
    while not states.visit(search, at_once):
        pass
    return [
        (
            "".join(LETTERS[int(letter)] for letter in search.letter[k, :-1]),
            float(search.best[k]),
            bool(search.stable[k]),
        )
        for k in range(search.progress[states.FOUND])
    ]


def compare(scene: mf.Scene) -> None:
    found, expected = ranked(scene), mf.minimise(scene, top=states.MOST).states
    assert [(word, stable) for word, _, stable in found] == [
        (state.word, state.stable) for state in expected
    ]
    energies = np.array([state.energy for state in expected])
    assert np.allclose(
        [energy for _, energy, _ in found], energies, rtol=1e-12, atol=1e-12 * abs(energies).max()
    )


def test_states_are_those_of_the_minimiser_in_parts_or_at_once() -> None:
    rng = np.random.default_rng(3)
    for n in (2, 3, 5, 6, 7, 8):
        compare(random_scene(rng, n=n))
    # Not a word of a chain without magnets lies lower than another.
    compare(mf.Scene(sequence=("----",) * 5).draw(rng))
    scene = random_scene(np.random.default_rng(1), n=5)
    assert ranked(scene, 1) == ranked(scene, 7) == ranked(scene)


@pytest.mark.medium
def test_a_page_finds_the_same_bits() -> None:
    rng = np.random.default_rng(6)
    scenes = [random_scene(rng, n=n) for n in (2, 4, 6, 9)]
    found: Any = built.run({"task": "states", "scenes": [told(scene) for scene in scenes]})
    for scene, there in zip(scenes, found, strict=True):
        here = [
            {"word": word, "energy": bits(energy), "stable": stable}
            for word, energy, stable in ranked(scene)
        ]
        assert there == here
