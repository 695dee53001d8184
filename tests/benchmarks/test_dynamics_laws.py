"""Tests of the measures of dynamics: scenes, overlaps, mechanics, projections, tables."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.laws import mechanics, overlap
from magfold_bench.laws import random_scenes as scenes
from magfold_bench.stress import agreement
from magfold_env.minimiser.lattice import from_words
from magfold_env.minimiser.states import conflicts
from magfold_env.scene import Casing, Feed, Scene
from magfold_env.shapes import centres, mirror, overlaps
from tests.killed import records_in

seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds, n=st.integers(3, 12))
def test_designed_neighbours_attract_where_they_turn_to(seed, n):
    rng = np.random.default_rng(seed)
    word = scenes.random_word(rng, n)
    assert len(word) == n - 1
    assert not overlaps(word)
    sequence = scenes.pulled_sequence(rng, word)
    neighbours = {(k, k + 1) for k in range(1, n)}
    assert not neighbours & set(conflicts(from_words([word]), sequence))
    assert neighbours <= set(conflicts(from_words([mirror(word)]), sequence))


@pytest.mark.medium
@given(seed=seeds)
def test_separation_agrees_with_points_along_the_edges(seed):
    rng = np.random.default_rng(seed)
    first = box(np.zeros(2), rng.uniform(0, 7), rng.uniform(0.1, 1.0, 2))
    second = box(rng.uniform(-1.5, 1.5, 2), rng.uniform(0, 7), rng.uniform(0.1, 1.0, 2))
    one, other = first.corners[0], second.corners[0]
    found = separation(first, second)
    assert found == pytest.approx(separation(second, first), abs=1e-12)
    share = np.linspace(0.0, 1.0, 200, endpoint=False)[:, None]
    edges = [np.concatenate([a + share * (b - a) for a, b in pairs(p)]) for p in (one, other)]
    apart = np.hypot(*(edges[0][:, None] - edges[1]).T).min()
    if found > 0.0:
        assert found == pytest.approx(apart, abs=0.01)
    else:
        # Moved by as much as it lies inside, along some direction, it just touches.
        ways = [(np.cos(t), np.sin(t)) for t in np.linspace(0.0, 2 * np.pi, 400)]
        moved = [
            separation(first, second._replace(centre=second.centre - found * np.array([way])))
            for way in ways
        ]
        assert max(moved) == pytest.approx(0.0, abs=1e-3)


def box(centre, turn, half):
    return overlap.Boxes(np.array([centre]), np.array([turn]), np.array([half]))


def separation(one, other):
    return float(overlap.separation(one, other)[0])


def pairs(polygon):
    return zip(polygon, np.roll(polygon, -1, axis=0), strict=True)


@given(seed=seeds)
def test_overlaps_of_sharp_squares_are_those_of_all_pairs(seed):
    rng = np.random.default_rng(seed)
    scene = Scene(sequence=("NNNN",) * 7, casing=Casing(corner_radius=1e-12))
    angles, base = np.cumsum(rng.uniform(-1.7, 1.7, 7)), rng.normal(size=2)
    side = scene.casing.side
    apart = overlap.squares_apart(centres(angles, side, base), angles, side)
    assert overlap.deepest_overlap(scene, angles, base, 7) == pytest.approx(
        max(-apart, 0.0), abs=1e-10
    )


def test_walls_count_for_released_components_only():
    scene = Scene(sequence=("NNNN",) * 2, mount="tube", feed=Feed(direction="forward"))
    side, reach = scene.casing.side, scene.casing.diagonal
    # Component 1 is out of the tube but lies across its wall, component 2 is held.
    angles = np.array([np.pi / 2, np.pi])
    base = np.array([-reach, 0.5 * (scene.bore + scene.feed.wall - reach)])
    assert overlap.deepest_overlap(scene, angles, base, 1) > 0.5 * side
    assert overlap.deepest_overlap(scene, angles, base, 0) < 1e-9 * side


@given(seed=seeds)
def test_mechanics_agree_with_positions(seed):
    rng = np.random.default_rng(seed)
    scene = Scene(
        sequence=("NNNN",) * 5, casing=Casing(mass=tuple(rng.uniform(0.001, 0.01, 5).tolist()))
    )
    angles, rates = rng.uniform(-3, 3, 5), rng.uniform(-9, 9, 5)
    base, velocity = rng.normal(size=2), rng.normal(size=2)
    side, step = scene.casing.side, 1e-5
    at = centres(angles, side, base)
    ends = [centres(angles + h * rates, side, base + h * velocity) for h in (-step, step)]
    moving = (ends[1] - ends[0]) / (2.0 * step)
    energy = 0.5 * (scene.masses @ (moving**2).sum(axis=1) + scene.inertias @ rates**2)
    assert mechanics.kinetic_energy(scene, angles, rates, velocity) == pytest.approx(
        energy, rel=1e-6
    )
    linear, angular = mechanics.momenta(scene, angles, rates, base, velocity)
    assert linear == pytest.approx(scene.masses @ moving, rel=1e-6)
    orbital = scene.masses @ (at[:, 0] * moving[:, 1] - at[:, 1] * moving[:, 0])
    assert angular == pytest.approx(orbital + scene.inertias @ rates, rel=1e-6)


def test_a_comparison_goes_on_where_it_was(tmp_path, capsys):
    agreement.main(scenes=2, first=0, out=tmp_path, workers=1)
    before = records_in(tmp_path)
    agreement.main(scenes=4, first=0, out=tmp_path, workers=1)
    assert records_in(tmp_path).items() > before.items()
    assert list(records_in(tmp_path)) == [0, 1, 2, 3]
    assert "Share that agrees" in capsys.readouterr().out


@pytest.mark.parametrize("seed", [198, 394, 562])
def test_a_corner_that_slides_off_a_face_is_not_caught(seed):
    # These jammed at the default tolerance, and at no tighter one.
    assert agreement.compare(seed)["verdict"] == agreement.AGREES
