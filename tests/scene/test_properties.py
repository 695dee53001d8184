"""Tests of properties that hold for every scene."""

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
def magnets(draw: st.DrawFn, n: int) -> dict[str, Any]:
    """Draw magnets with all forms of strengths and sizes, without overlaps."""

    def faces(number: st.SearchStrategy[float]) -> st.SearchStrategy[Any]:
        return number | st.lists(number, min_size=4, max_size=4)

    def strength(number: st.SearchStrategy[float]) -> st.SearchStrategy[Any]:
        row = st.lists(number, min_size=4, max_size=4)
        return faces(number) | st.lists(row, min_size=n, max_size=n)

    ways = {"remanence": strength(_number(1e-9, 2.0)), "pole_charge": strength(_number(1e-9, 1e2))}
    way = draw(st.sampled_from(sorted(ways)))
    lengths = {"width": 0.006, "height": 0.05, "thickness": 0.0025, "inset": 0.0005}
    return {way: draw(ways[way])} | {
        name: draw(faces(_number(1e-4, most))) for name, most in lengths.items()
    }


@st.composite
def fields(draw: st.DrawFn) -> dict[str, Any]:
    tesla, length = _number(-1.0, 1.0), _number(1e-3, 0.1)
    # Beyond the mouth, at any angle.
    fixed = st.fixed_dictionaries(
        {"position": st.tuples(_number(0.2, 1.0), _number(-1.0, 1.0)), "heading": _number(-4, 4)}
        | dict.fromkeys(("width", "height", "thickness"), length)
    )
    return {"uniform": draw(st.tuples(tesla, tesla)), "magnet": draw(st.none() | fixed)}


@st.composite
def scenes(draw: st.DrawFn) -> mf.Scene:
    n = draw(st.integers(1, 5))
    fraction = _number(0.0, 0.9)
    mount = draw(st.sampled_from(["pinned", "free", "tube"]))
    start, most, count = ("start_angles", 1.5, n - 1)
    if mount == "tube":
        start, most, count = "start_offsets", mf.Scene(sequence=("NNNN",)).play, n + 1
    data: dict[str, Any] = dict(
        sequence=draw(st.lists(st.text("NS-", min_size=4, max_size=4), min_size=n, max_size=n)),
        casing={
            "mass": draw(_each(_number(1e-12, 1.0), n)),
            "inertia": draw(st.none() | _each(_number(1e-12, 1.0), n)),
        },
        magnets=draw(st.none() | magnets(n)),
        mount=mount,
        feed={"speed": draw(_each(_number(1e-9, 20.0), n))},
        field=draw(st.none() | fields()),
        friction=draw(_each(_number(0.0, 1.0), n)),
        gravity={"in_plane": draw(st.tuples(_number(-10, 10), _number(-10, 10)))},
        contact=draw(st.booleans()),
        **{start: draw(st.none() | st.lists(_number(-most, most), min_size=count, max_size=count))},
        spreads={name: draw(fraction) for name in ("friction", "mass", "remanence", "tilt")},
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


@given(scenes(), st.integers(0, 2**32))
def test_a_drawn_scene_is_concrete_and_saved_like_any(scene: mf.Scene, seed: int) -> None:
    drawn = scene.draw(np.random.default_rng(seed))
    assert drawn.is_concrete
    assert drawn.draw(np.random.default_rng(seed + 1)) == drawn
    assert drawn.n == scene.n


@st.composite
def _rectangles(draw: st.DrawFn) -> tuple[mf.Magnets, float]:
    def four(low: float, high: float) -> list[float]:
        return draw(st.lists(_number(low, high), min_size=4, max_size=4))

    side = 0.0125
    lengths: dict[str, Any] = {
        "width": four(1e-3, 0.013), "thickness": four(5e-4, 0.006), "inset": four(0, 0.003),
    }  # fmt: skip
    return mf.Magnets(**lengths), side


@given(_rectangles())
def test_magnets_fit_exactly_if_no_two_of_their_rectangles_overlap(drawn):
    magnets, side = drawn
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])  # the next face is a quarter turn further
    boxes = []
    for f in range(4):
        width, thickness, inset = (
            magnets.by_face(name)[f] for name in ("width", "thickness", "inset")
        )
        outer = side / 2 - inset
        corners = np.array([[outer - thickness, -width / 2], [outer, width / 2]])
        corners = corners @ np.linalg.matrix_power(turn, f).T
        boxes.append((corners.min(axis=0), corners.max(axis=0)))
    inside = all(np.abs(box).max() <= side / 2 + 1e-12 for pair in boxes for box in pair)
    apart = all(
        (boxes[f][1] <= boxes[g][0] + 1e-12).any() or (boxes[g][1] <= boxes[f][0] + 1e-12).any()
        for f in range(4)
        for g in range(f)
    )
    assert (not magnets.misfits(side)) == (inside and apart)
