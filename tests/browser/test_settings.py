"""Tests that kernels in a page and `pack` make identical arrays from the same settings."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.browser import memory, settings
from magfold_env.engine.compile import by_pointer, pointer_types
from magfold_env.simulation.far_table import fill_far_table
from magfold_env.simulation.near_table import fill_near_table
from magfold_env.simulation.pack import pack, size_magnets
from magfold_env.simulation.session import Session
from tests.browser.scenes import LENGTHS, chain_of, random_scene

pytestmark = pytest.mark.skipif(
    not by_pointer.POINTERS, reason="needs kernels that take tuples by pointer"
)

WALLED = {"obstacles": [{"position": (0.02, 0.05), "size": (0.01, 0.03), "heading": 0.4}]}


def same(made: Any, packed: Any, *, but: tuple[str, ...] = ()) -> None:
    """Check that two NamedTuples contain the same bytes."""
    for name, mine, theirs in zip(made._fields, made, packed, strict=True):
        if name in but:
            continue
        if isinstance(mine, tuple):
            same(mine, theirs)
        elif isinstance(mine, np.ndarray):
            assert mine.tobytes() == theirs.tobytes(), name
        else:
            assert (mine, type(mine)) == (theirs, type(theirs)), name


def check(scene: mf.Scene) -> None:
    chain, session = chain_of(scene), Session(scene)
    model, state = session._model, session._state
    numbers = chain.settings.numbers
    changed = settings.Numbers._fields[:15]
    for name in changed:
        (value,) = getattr(numbers, name)
        expected = getattr(model, name)
        assert value == expected, name
        assert math.copysign(1.0, value) == math.copysign(1.0, expected), name
    count = len(model.obstacles)
    assert numbers.obstacles[1] == count
    for words in (numbers.boxes, numbers.probe):
        assert words[1::2].tolist() == [scene.n + count] * 6
    assert chain.model.obstacles[:count].tobytes() == model.obstacles.tobytes()
    same(chain.model, model, but=("obstacles", *changed))
    same(chain.state, state)


@pytest.mark.medium
@given(st.integers(0, 2**32 - 1))
def test_a_chain_of_settings_is_a_packed_scene(seed: int) -> None:
    check(random_scene(np.random.default_rng(seed)))


@pytest.mark.parametrize("mount", ["free", "tube"])
def test_obstacles_and_a_drawn_start_are_those_of_a_scene(mount: str) -> None:
    check(random_scene(np.random.default_rng(3), mount, **WALLED))
    scene = random_scene(np.random.default_rng(0), mount)
    chance = scene.replace(start_angles=None, start_offsets=None)
    name = "start_offsets" if mount == "tube" else "start_angles"
    drawn = getattr(chance.draw(np.random.default_rng(5)), name)
    chain = chain_of(scene)
    unit = 2.0 * np.random.default_rng(5).random(2 * scene.n + 4) - 1.0
    unit = unit[scene.n + 3 :]
    chain.settings.start[:] = 0.0
    chain.settings.start[0, : len(drawn)] = unit[: len(drawn)]
    settings.draw(chain.settings, chain.model, scene.start_angle_spread)
    assert tuple(chain.settings.start[0, : len(drawn)]) == drawn


def test_stored_data_give_the_tables_of_a_scene() -> None:
    scene = memory.standard(3)
    shared = memory.shared_of(scene)
    assert not shared.far.energy.any()
    assert scene.magnets is not None
    shared.sizing.size[:] = scene.casing.side
    shared.sizing.size[1:] = [scene.magnets.by_face(name) for name in LENGTHS]
    magnets, pitch, side = shared.magnets, scene.casing.diagonal, scene.casing.side
    before = pointer_types.words_of(magnets).tolist()
    size_magnets(shared.sizing, magnets)
    fill_near_table(shared.near, shared.near_magnets, pitch)
    fill_far_table(shared.far, shared.far_magnets, side)
    same(magnets, pack(scene).magnets)
    assert pointer_types.words_of(magnets).tolist() == before
