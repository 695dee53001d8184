"""Properties that hold for every scene."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf


def _number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def _each(number: st.SearchStrategy[float], n: int) -> st.SearchStrategy[Any]:
    return number | st.lists(number, min_size=n, max_size=n)


@st.composite
def scenes(draw: st.DrawFn) -> mf.Scene:
    n = draw(st.integers(1, 5))
    fraction = _number(0.0, 0.9)
    strength = st.fixed_dictionaries({"remanence": _number(1e-9, 2.0)}) | st.fixed_dictionaries(
        {"pole_charge": _number(1e-9, 100.0)}
    )
    data: dict[str, Any] = dict(
        sequence=draw(st.lists(st.text("NS", min_size=4, max_size=4), min_size=n, max_size=n)),
        casing={
            "mass": draw(_each(_number(1e-12, 1.0), n)),
            "inertia": draw(st.none() | _each(_number(1e-12, 1.0), n)),
        },
        magnets=draw(st.none() | strength),
        mount=draw(st.sampled_from(["pinned", "free", "tube"])),
        feed={"speed": draw(_each(_number(1e-9, 1e9), n))},
        friction=draw(_number(0.0, 1.0)),
        gravity={"in_plane": draw(st.tuples(_number(-10, 10), _number(-10, 10)))},
        contact=draw(st.booleans()),
        start_angles=draw(st.none() | st.lists(_number(-1.5, 1.5), min_size=n - 1, max_size=n - 1)),
        spreads={"friction": draw(fraction), "mass": draw(fraction)},
        solver={"tolerance": draw(_number(1e-12, 0.1))},
    )
    return mf.Scene(**data)


@given(scenes())
def test_a_saved_scene_loads_equal(scene: mf.Scene) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.yaml"
        mf.save_scene(scene, path)
        assert mf.load_scene(path) == scene


@given(scenes())
def test_replacing_everything_by_itself_changes_nothing(scene: mf.Scene) -> None:
    assert scene.replace() == scene
    assert scene.replace(**scene.model_dump()) == scene
    assert scene.replace(**{name: getattr(scene, name) for name in mf.Scene.model_fields}) == scene


@given(scenes(), _number(0.0, 1.0), _number(1e-6, 1.0))
def test_replacing_and_putting_back_gives_the_scene(
    scene: mf.Scene, friction: float, speed: float
) -> None:
    changed = scene.replace(friction=friction, feed={"speed": speed})
    assert (changed.friction, changed.feed.speed) == (friction, speed)
    assert changed.replace(friction=scene.friction, feed=scene.feed) == scene


@given(scenes(), st.integers(0, 2**32))
def test_a_drawn_scene_is_concrete_and_saved_like_any(scene: mf.Scene, seed: int) -> None:
    drawn = scene.draw(np.random.default_rng(seed))
    assert drawn.is_concrete
    assert drawn.draw(np.random.default_rng(seed + 1)) == drawn
    assert drawn.n == scene.n
