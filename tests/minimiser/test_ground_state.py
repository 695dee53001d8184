"""Tests of branch and bound against the full search."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.minimiser import Among, Minimum, arms, ground_state, minimise
from magfold_env.minimiser.search import LONGEST_CUT
from magfold_env.shapes import headings, overlaps, word_to_angles
from tests.minimiser.scenes import scene_of
from tests.words import reverse


def random_scene(seed: int, n: int, model: str = "strips") -> mf.Scene:
    faces = np.random.default_rng(seed).choice(["N", "S"], (n, 4))
    return scene_of(tuple("".join(component) for component in faces), model)


def words_of(found: Minimum) -> list[str]:
    return [state.word for state in found.states]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 7])
@pytest.mark.parametrize("among", ["all", "folded", "stable"])
def test_the_lowest_states_are_those_of_the_full_search(n: int, among: Among) -> None:
    for seed in range(3):
        scene = random_scene(seed, n, "points")
        full = minimise(scene, top=5, among=among).states
        found = ground_state(scene, top=5, among=among)
        assert words_of(found) == [state.word for state in full]
        assert [state.energy for state in found.states] == [state.energy for state in full]


@pytest.mark.parametrize(
    ("count", "longest"), [(20, 9), pytest.param(500, 12, marks=pytest.mark.slow)]
)
def test_random_sequences_agree_with_the_full_search(count: int, longest: int) -> None:
    for seed in range(count):
        scene = random_scene(100 + seed, 2 + seed % (longest - 1))
        found, full = ground_state(scene).best, minimise(scene, top=1).best
        assert found.energy == pytest.approx(full.energy, rel=1e-9, abs=1e-12)
        assert found.word in (full.word, *full.tied)


@pytest.mark.parametrize("n", [16, 19])
def test_a_long_chain_read_from_its_other_end_has_the_same_ground_states(n: int) -> None:
    scene = random_scene(7, n)
    other = tuple("".join(c[k] for k in (2, 3, 0, 1)) for c in scene.sequence[::-1])
    found = ground_state(scene, top=3)
    image = ground_state(scene.replace(sequence=other), top=3)
    assert [reverse(word) for word in words_of(image)] == words_of(found)
    for state in found.states:
        assert not overlaps(state.word)
        assert state.energy == pytest.approx(
            mf.energy(scene, headings(word_to_angles(state.word))), rel=1e-9
        )


def test_ties_are_listed() -> None:
    # Its own mirror image: mirrored words have equal energies.
    found = ground_state(scene_of(("NSSN",) * 6, "strips"), top=2)
    first, second = found.states
    assert first.energy == pytest.approx(second.energy, rel=1e-9)
    assert first.tied == (second.word,)
    assert second.tied == (first.word,)
    alone = ground_state(scene_of(("NSSN",) * 6, "strips"))
    assert alone.best.word in words_of(found)


def test_no_stable_state_is_no_error_until_it_is_asked_for() -> None:
    found = ground_state(scene_of(("NNNN",) * 14, "points"), among="stable")
    assert found.states == ()
    with pytest.raises(ValueError, match="no state"):
        _ = found.best


@pytest.mark.parametrize("among", ["all", "folded", "stable"])
def test_a_chain_that_is_too_long_is_refused_at_once(among, monkeypatch):
    monkeypatch.setattr(arms, "count_entries", lambda *_: pytest.fail("counted all the same"))
    longest = LONGEST_CUT[among]
    message = f"sequence: {longest + 1} components are not allowed; must be {longest} or fewer"
    with pytest.raises(ValueError, match=message):
        ground_state(random_scene(13, longest + 1, "points"), among=among)
