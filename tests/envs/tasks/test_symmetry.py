"""Images of a chain are equivalent, and all of them are on one side of a split."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.feed_tasks import FeedTask, read_tasks
from magfold_env.envs.tasks.symmetry import (
    TEST_SHARE,
    mirrored,
    orbit,
    refuse_uneven,
    side_of,
    swapped,
    turned,
)
from magfold_env.scene import SceneError, load_scene

CHAINS = st.lists(st.sampled_from(PATTERNS), min_size=2, max_size=6).map(tuple)
SPLIT_LISTS = {"two-folds-6-v1": (1000, 200)}
"""Numbers of chains for training and for tests."""


@given(CHAINS, st.integers(0, 2**32 - 1))
def test_images_have_the_energy_of_the_chain(sequence: Any, seed: int) -> None:
    scene = load_scene("unknown-floor").replace(sequence=sequence)
    turns = np.random.default_rng(seed).uniform(-1.5, 1.5, len(sequence))
    angles = np.cumsum(turns)
    energy = mf.energy(scene, angles)
    images = {
        swapped(sequence): angles,
        mirrored(sequence): -angles,
        turned(sequence): angles[::-1] + np.pi,
    }
    for image, seen in images.items():
        assert mf.energy(scene.replace(sequence=image), seen) == pytest.approx(energy, rel=1e-9)


@given(CHAINS)
def test_all_images_have_one_orbit_and_one_side(sequence: Any) -> None:
    images = orbit(sequence)
    assert sequence in images
    assert 8 % len(images) == 0
    for image in images:
        assert orbit(image) == images
        assert side_of(image) == side_of(sequence)


def test_one_orbit_in_six_is_for_tests() -> None:
    rng = np.random.default_rng(0)
    chains = [tuple(np.array(PATTERNS)[rng.integers(16, size=6)]) for _ in range(3000)]
    share = np.mean([side_of(chain) == "test" for chain in chains])
    assert share == pytest.approx(1.0 / TEST_SHARE, abs=0.03)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"magnets": {"inset": [4e-4, 4e-4, 4e-4, 5e-4]}}, "magnets.inset"),
        ({"magnets": {"remanence": [0.6, 0.6, 0.6, 0.5]}}, "magnets.remanence"),
        ({"casing": {"mass": [1e-3] * 5 + [2e-3]}}, "casing.mass"),
        ({"field": {"uniform": [0.0, 0.01]}}, "field"),
        ({"gravity": {"in_plane": [0.0, 0.1]}}, "gravity.in_plane"),
        ({"obstacles": [{"position": [0.1, 0.03], "size": [0.01, 0.01]}]}, "obstacles"),
    ],
)
def test_uneven_scenes_are_refused(changes: Any, key: str) -> None:
    with pytest.raises(SceneError, match=key):
        refuse_uneven(load_scene("unknown-floor").replace(**changes))


@pytest.mark.parametrize("name", ["unknown-floor", "lumen", "reprogram"])
def test_scenes_of_tracks_are_even(name: str) -> None:
    refuse_uneven(load_scene(name))


@pytest.mark.parametrize(("name", "sizes"), SPLIT_LISTS.items())
def test_no_chain_for_tests_is_an_image_of_one_for_training(
    name: str, sizes: tuple[int, int]
) -> None:
    sides = {side: read_tasks(name, FeedTask, side) for side in ("train", "test")}
    chains = {side: {task.sequence for task in tasks} for side, tasks in sides.items()}
    assert tuple(map(len, chains.values())) == sizes
    for side, sequences in chains.items():
        assert all(side_of(sequence) == side for sequence in sequences)
    orbits = [orbit(sequence) for sequences in chains.values() for sequence in sequences]
    assert len(set(orbits)) == len(orbits)
    assert read_tasks(name, FeedTask, "all") == sides["train"] + sides["test"]
    assert read_tasks(name) == sides["train"]


def test_only_lists_with_sides_have_a_split() -> None:
    with pytest.raises(ValueError, match="split: 'test' is not allowed; must be left out"):
        read_tasks("two-folds-6", FeedTask, "test")
    with pytest.raises(ValueError, match="split: 'tests' is not allowed; must be"):
        read_tasks("two-folds-6-v1", FeedTask, "tests")  # pyright: ignore[reportArgumentType]
