"""Tests that the engine in JavaScript and `mf.simulate` give identical folds."""

import struct
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.fold import recording
from magfold_env.replay import page_data
from magfold_env.simulation.pack import joint_tables
from magfold_env.simulation.session import Session
from tests.browser import built
from tests.browser.scenes import LENGTHS, MOUNTS, random_scene, random_sizes, told


def bits(value: Any) -> Any:
    """Return floats as their bits, in hexadecimal."""
    if isinstance(value, float):
        return struct.pack(">d", value).hex()
    return [bits(each) for each in value.tolist()]


def ended(run: Session | mf.Fold) -> dict[str, Any]:
    """Return the end of a run in the form of a page's script."""
    assert run.status is not None
    found = {
        "status": run.status.value, "word": run.word, "steps": run.steps,
        "evaluations": run.evaluations, "time": bits(run.time), "headings": bits(run.angles),
    }  # fmt: skip
    if isinstance(run, mf.Fold):
        released, energy, peak = run.scene.n - run.in_tube, run.energy, run.push_peak
    else:
        released, energy, peak = run.released, run.energy(), run.account.push_peak
        found["rates"] = bits(run.rates)
    return found | {"released": released, "energy": bits(energy), "peak": bits(peak)}


def compare(scenes: list[mf.Scene]) -> None:
    found = built.run({"task": "folds", "scenes": [told(scene) for scene in scenes]})
    for scene, there in zip(scenes, found, strict=True):
        fold = mf.simulate(scene)
        here = ended(fold)
        assert {name: there[name] for name in here} == here, told(scene)
        # Its sines are not those of NumPy.
        assert np.allclose(there["base"], fold.base, rtol=0.0, atol=1e-15)


@pytest.mark.medium
def test_scenes_end_in_the_same_bits() -> None:
    rng = np.random.default_rng(27)
    compare([random_scene(rng, MOUNTS[k % 3]) for k in range(21)])


@pytest.mark.medium
def test_obstacles_are_met_alike_and_may_just_fit_beside_a_tube() -> None:
    rng = np.random.default_rng(9)
    walls: Any = [
        {"position": (0.1, y), "size": (0.3, 0.004), "heading": tilt}
        for y, tilt in ((0.02, 0.05), (-0.02, -0.05))
    ]
    compare([random_scene(rng, mount, obstacles=walls) for mount in ("free", "pinned")])
    block: Any = [{"position": (0.05, 0.0), "size": (0.01, 0.03), "heading": 0.4}]
    compare([random_scene(rng, "tube", obstacles=block)])
    rng = np.random.default_rng(2)
    beside = {"position": (0.0, 0.02), "size": (0.03, 0.0199)}
    beyond = {"position": (0.06, 0.0), "size": (0.0799, 0.01)}
    for obstacle in (beside, beyond):
        compare([random_scene(rng, "tube", obstacles=[obstacle])])


@pytest.mark.medium
@pytest.mark.parametrize("count", [6, pytest.param(150, marks=pytest.mark.slow)])
def test_scenes_of_other_sizes_end_in_the_same_bits(count: int) -> None:
    rng = np.random.default_rng(count)
    scenes = [random_scene(rng, MOUNTS[k % 3], **random_sizes(rng)) for k in range(count)]
    # All scenes use the same memory, and the last one has the first one's sizes again.
    compare([*scenes, scenes[0]])


@pytest.mark.medium
@pytest.mark.parametrize(("lengths", "near", "far"), [
    ((0.006, 0.006, 0.0025, 0.0005), True, True), ((0.0075, 0.006, 0.002, 0.0001), True, False),
    ((0.0124, 0.5, 4e-5, 0.0), False, False),
])  # fmt: skip
def test_magnets_for_which_tables_are_inexact_do_without(
    lengths: Any, near: bool, far: bool
) -> None:
    scene = random_scene(np.random.default_rng(4), "free", n=4, duration=0.02)
    scene = scene.replace(magnets=dict(zip(LENGTHS, lengths, strict=True)))
    tables = joint_tables(scene)
    assert (tables.end > 0.0, tables.far.end > 0.0) == (near, far)
    compare([scene])


@pytest.mark.slow
def test_thousands_of_scenes_end_in_the_same_bits() -> None:
    rng = np.random.default_rng(2700)
    for _ in range(30):
        compare([random_scene(rng, MOUNTS[k % 3]) for k in range(100)])


@pytest.mark.medium
def test_a_feed_that_is_changed_by_hand_goes_as_a_session_does() -> None:
    rng = np.random.default_rng(5)
    scenes = [random_scene(rng, "tube") for _ in range(4)]
    legs = [
        [(float(rng.uniform(-0.2, 0.5)), float(rng.uniform(0.01, 0.2))) for _ in range(8)]
        for _ in scenes
    ]
    job = {"task": "pushes", "scenes": [told(scene) for scene in scenes], "legs": legs}
    for scene, way, there in zip(scenes, legs, built.run(job), strict=True):
        session = Session(scene)
        for speed, seconds in way:
            session.push(speed, seconds)
        session.push(0.0, 0.0)
        session.settle()
        here = ended(session)
        assert {name: there[name] for name in here} == here


@pytest.mark.medium
def test_frames_are_those_of_a_recording() -> None:
    rng = np.random.default_rng(8)
    scenes = [random_scene(rng, mount) for mount in MOUNTS]
    job = {"task": "frames", "scenes": [told(scene) for scene in scenes], "frameRate": 240.0}
    for scene, there in zip(scenes, built.run(job), strict=True):
        here = page_data(recording(mf.simulate(scene, frame_rate=240.0)))
        assert there.keys() == here.keys()
        for name in ("word", "status", "sequence", "order", "pinned", "released", "loaded"):
            assert there[name] == here[name], name
        assert [name for name, _ in there["facts"]] == [name for name, _ in here["facts"]]
        for name, within in (("time", 1e-6), ("angles", 1e-4), ("base", 1e-3), ("kinetic", 1e-3)):
            assert np.allclose(there[name], here[name], rtol=1e-3, atol=within), name
        assert np.allclose(there["magnetic"], here["magnetic"], rtol=1e-3, atol=1e-3)


TUBE: Any = {"mount": "tube", "sequence": ["NSNS", "NNSS", "SSNN"]}
WALL: Any = {"size": [0.01, 0.01]}
REFUSED: list[dict[str, Any]] = [
    {"start_offsets": [0.0, 0.001, 0.0, 0.0]},
    {"start_offsets": [0.0, 0.013, 0.0, 0.0], "feed": {"bore": 0.05}},
    {"obstacles": [{"position": [-0.02, 0.005], **WALL}]},
    {"obstacles": [{"position": [0.02, 0.012], "heading": 0.7, **WALL}]},
    {"obstacles": [{"position": [0.2, 0.0], **WALL}, {"position": [0.015, 0.0], **WALL}]},
    # Wrong units.
    *({"magnets": {"remanence": each}} for each in (1300, 12.5, 12500, 1e9)),
    {"magnets": {"remanence": [1.2, 1.2, 1200, 1.2]}},
    {"magnets": {"width": 0.0066}},
    {"magnets": {"thickness": 0.007}},
    {"magnets": {"inset": 0.5}},
    {"magnets": {"height": 6.0}},
    {"casing": {"side": 12.5}},
    {"casing": {"side": 0.02}, "start_offsets": [0.0, 0.001, 0.0, 0.0]},
    {"feed": {"speed": 1e9}},
    {"feed": {"wall": 5000.0}},
    {"obstacles": [{"position": [0.5, 0.5], "size": [5000.0, 0.01]}]},
    {"feed": {"speed": [0.1, 50, 0.1]}},
]


@pytest.mark.medium
def test_what_cannot_be_is_refused_in_the_words_of_python() -> None:
    scenes = [{**TUBE, **changes} for changes in REFUSED]
    for scene, refused in zip(
        scenes, built.run({"task": "refused", "scenes": scenes}), strict=True
    ):
        with pytest.raises(mf.SceneError) as error:
            mf.Scene(**scene)
        (mine,), (there,) = (each.splitlines() for each in (str(error.value), refused["message"]))
        assert mine.split(":")[0] == there.split(":")[0]
        assert mine.split("allowed;")[1] == there.split("allowed;")[1]


NAMED: list[tuple[dict[str, Any], str]] = [
    ({"friction": -1}, "friction: -1 is not allowed; must be a number of at least 0"),
    ({"mount": "glued"}, 'mount: "glued" is not allowed; must be one of free, pinned, tube'),
    ({"sequence": "NNNN"}, 'sequence: "NNNN" is not allowed; must have 2 to 12 components'),
    ({"sequence": ["NNNX", "NNNN"]}, 'sequence[0]: "NNNX" is not allowed; must be four'),
    ({"feed": {"speed": [0.1]}}, "feed.speed: [0.1] is not allowed; must have 3 numbers"),
    ({"magnets": {"remanence": 0}}, "magnets.remanence: 0 is not allowed; must be a number"),
    ({"friction": [0.1, -1, 0.1]}, "friction[1]: -1 is not allowed; must be a number of at"),
    ({"solver": {"max_steps": 1e19}},
     "solver.max_steps: 10000000000000000000 is not allowed; must"),
    ({"magnets": {"width": [0.006] * 4}}, "magnets.width: [0.006,0.006,0.006,0.006] is not"),
    ({"magnets": {"inset": -1}}, "magnets.inset: -1 is not allowed; must be a number of at"),
    ({"casing": {"side": 0.014}, "feed": {"bore": 0.0197}},
     "feed.bore: 0.0197 is not allowed; must be from the casing's diagonal, 0.019799, to"),
    ({"magnets": {"nodes": 3}}, "magnets.nodes: 3 is not allowed; must be one of remanence, width"),
    ({"feed": {"speed": 0}}, "feed.speed: 0 is not allowed; must be a number above 0"),
    ({"colour": 1}, "colour: 1 is not allowed; must be one of sequence, mount"),
    ({"start_angles": [0.0, 2.0]}, "start_angles[1]: 2 is not allowed; must be numbers from"),
]  # fmt: skip


@pytest.mark.medium
def test_a_scene_that_is_not_allowed_is_told_by_its_key() -> None:
    scenes = [{"sequence": ["NSNS", "NNSS", "SSNN"], **changes} for changes, _ in NAMED]
    found = built.run({"task": "refused", "scenes": scenes})
    for (_, message), refused in zip(NAMED, found, strict=True):
        assert refused["name"] == "SceneError"
        assert refused["message"].startswith(message)
