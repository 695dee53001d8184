"""Tests of scenes that are mirrored, turned or seen from the other end."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import magfold_env as mf
from magfold_bench.stress.symmetries import mirrored, seen_from_other_end, turned
from magfold_env.shapes import centres, headings
from magfold_env.simulation.session import Session
from tests.stress.drawn import scenes

NAMES = ("sequence", "casing", "magnets", "start_angles", "start_offsets")


@given(scenes("mixed"))
def test_a_view_is_undone_by_its_inverse(scene: mf.Scene) -> None:
    assert close(mirrored(mirrored(scene)), scene)
    assert close(turned(turned(scene, 0.7), -0.7), scene)
    if scene.mount != "pinned":
        assert close(seen_from_other_end(seen_from_other_end(scene)), scene)


@settings(max_examples=6)
@given(scenes("mixed"))
def test_magnets_have_the_same_energy_however_they_are_seen(scene: mf.Scene) -> None:
    scene = scene.replace(field=None)
    start = Session(scene).angles
    here = mf.energy(scene, start)
    # Of single pairs; those of the whole chain may cancel.
    unit = 1e-9 * max(abs(here), 1e-7 * (scene.magnets.charge if scene.magnets else 0.0) ** 2)
    assert mf.energy(mirrored(scene), -start) == pytest.approx(here, rel=1e-6, abs=unit)
    if scene.mount != "pinned":
        other = seen_from_other_end(scene)
        assert mf.energy(other, start[::-1] + np.pi) == pytest.approx(here, rel=1e-6, abs=unit)


@given(scenes("fields"))
def test_a_fixed_magnet_stays_where_it_is_seen_from_the_chain(scene: mf.Scene) -> None:
    if scene.mount != "free" or scene.field is None or scene.field.magnet is None:
        return
    other: Any = seen_from_other_end(scene)
    here = distances(scene, scene.field.magnet.position)
    there = distances(other, other.field.magnet.position)
    np.testing.assert_allclose(there[::-1], here, atol=1e-12)


def distances(scene: mf.Scene, point: tuple[float, float]) -> np.ndarray:
    assert scene.start_angles is not None
    return np.hypot(*(centres(headings(scene.start_angles), scene.casing.side) - point).T)


def close(one: mf.Scene, other: mf.Scene) -> bool:
    """Return whether scenes are equal except for rounding."""
    assert {name: getattr(one, name) for name in NAMES} == {
        name: getattr(other, name) for name in NAMES
    }
    assert one.feed == other.feed
    numbers = [
        [*s.gravity.in_plane]
        + ([*s.field.uniform] if s.field else [])
        + (
            [*s.field.magnet.position, np.cos(s.field.magnet.heading)]
            if s.field and s.field.magnet
            else []
        )
        for s in (one, other)
    ]
    np.testing.assert_allclose(*numbers, rtol=0, atol=1e-10)
    return True
