"""Descent over joint angles: where it goes, where it stays, and that casings stay apart."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.minimiser import Landscape, descend
from magfold_env.minimiser.descent import overlaps
from magfold_env.scene import Scene
from magfold_env.shapes import headings, word_to_angles
from tests.minimiser.scenes import scene_of

SIDE = 0.0125


def random_scene(seed: int, n: int) -> tuple[Scene, np.ndarray]:
    rng = np.random.default_rng(seed)
    faces = rng.choice(["N", "S"], (n, 4))
    scene = scene_of(tuple("".join(component) for component in faces), "strips")
    return scene, headings(rng.uniform(-1.0, 1.0, n - 1), first=0.2)


def test_it_goes_downhill_to_where_no_free_joint_is_turned() -> None:
    for seed in range(6):
        scene, start = random_scene(seed, 5)
        found = descend(scene, start)
        assert found.converged
        assert found.energy < mf.energy(scene, start)
        assert found.energy == pytest.approx(mf.energy(scene, found.angles))
        joints = np.diff(found.angles)
        assert found.angles[0] == start[0]
        assert (np.abs(joints) <= np.pi / 2 + 1e-12).all()
        if found.overlap == 0.0:
            free = np.abs(joints) < np.pi / 2 - 1e-9
            pressed = np.sign(joints) * found.torques > 0.0
            scale = np.abs(found.torques).max()
            assert (pressed | free).all()
            assert np.abs(found.torques[free]).max(initial=0.0) < 1e-5 * scale


def test_stable_words_stay_and_others_leave() -> None:
    scene = mf.load_scene("paper/sequence-1")
    landscape = Landscape(scene, "folded")
    for word, stays in zip(landscape.words, landscape.mechanically_stable(), strict=True):
        found = descend(scene, headings(0.999 * word_to_angles(word)))
        there = np.abs(np.diff(found.angles) - word_to_angles(word)).max() < 1e-9
        assert there == stays, word


def test_torques_are_slopes_of_the_energy() -> None:
    scene, start = random_scene(3, 4)
    found = descend(scene, start, max_steps=1)
    assert found.steps == 1
    joints = np.diff(found.angles)
    for joint, aside in enumerate(1e-6 * np.eye(3)):
        rise = mf.energy(scene, headings(joints + aside)) - mf.energy(
            scene, headings(joints - aside)
        )
        assert found.torques[joint] == pytest.approx(-rise / 2e-6, rel=1e-5, abs=1e-9)


@pytest.mark.medium
def test_casings_stay_apart() -> None:
    for seed in range(20, 26):
        scene, start = random_scene(seed, 9)
        assert descend(scene, start).overlap < 1e-3 * SIDE


def test_without_contact_there_are_no_stops() -> None:
    scene = scene_of(("NNNN", "SSSS"), "strips").replace(contact=False)
    found = descend(scene, [0.0, 0.3])
    assert abs(np.diff(found.angles)[0]) > np.pi / 2 + 0.1


def test_overlap_of_two_squares() -> None:
    headings_ = np.full(5, 0.25 * np.pi) - 0.5 * np.pi  # faces along x and y
    places = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [0.9, 0.3]])
    corners = overlaps(places, headings_, 1.0)
    assert [(c.first, c.second) for c in corners] == [(0, 4), (0, 4)]
    assert [c.depth for c in corners] == pytest.approx([0.1, 0.1])
    np.testing.assert_allclose(corners[0].normal, [1.0, 0.0], atol=1e-12)
    assert overlaps(places + 0.2 * np.eye(5)[:, 4:], headings_, 1.0) == []
    assert overlaps(places[::-1], headings_[::-1], 1.0)[0].depth == pytest.approx(0.1)
