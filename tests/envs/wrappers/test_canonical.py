"""The canonical view is the same for all images of a chain."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from magfold_env.envs.tasks.feed_tasks import FeedTask, read_tasks
from magfold_env.envs.tasks.symmetry import mirrored, swapped, turned
from magfold_env.envs.wrappers import vector
from magfold_env.envs.wrappers.canonical import CanonicalObservation, CanonicalView
from magfold_env.scene import SceneError

ENV = "MagFold/UnknownFloor-v1"
OTHER_SIDE = str.maketrans("LR", "RL")


def with_swapped_poles(task: FeedTask) -> FeedTask:
    return task.model_copy(update={"sequence": swapped(task.sequence)})


def in_a_mirror(task: FeedTask) -> FeedTask:
    return task.model_copy(
        update={
            "sequence": mirrored(task.sequence),
            "target": task.target.translate(OTHER_SIDE),
        }
    )


def from_the_other_end(task: FeedTask) -> FeedTask:
    return task.model_copy(
        update={
            "sequence": turned(task.sequence),
            "target": task.target[::-1].translate(OTHER_SIDE),
            "direction": "backward" if task.direction == "forward" else "forward",
        }
    )


def episode(task: FeedTask, view: bool, steps: int = 60) -> Any:
    env: Any = gymnasium.make(ENV, tasks=[task], disable_env_checker=True)
    env = CanonicalObservation(env) if view else env
    observation, _ = env.reset(seed=3)
    found, rng = [observation], np.random.default_rng(5)
    for _ in range(steps):
        observation, *_, terminated, _, _ = env.step(rng.uniform(0.2, 1.0, 1).astype(np.float32))
        found.append(observation)
        if terminated:
            break
    return np.array(found)


TASKS = read_tasks("two-folds-6")[:4]


@pytest.mark.parametrize("task", TASKS)
def test_swapped_poles_give_the_same_bits(task: FeedTask) -> None:
    assert np.array_equal(episode(task, True), episode(with_swapped_poles(task), True))


def image_of(seen: Any, layout: Any, image: Any) -> Any:
    """Return what the camera would show of an image of the chain, entry by entry."""
    n, out = layout.n, seen.copy()
    groups = {name: out[:, span] for name, span in layout.slices.items()}
    old = {name: seen[:, span] for name, span in layout.slices.items()}
    backward = image is from_the_other_end
    for k in range(n):
        j = n - 1 - k if backward else k
        groups["seen"][:, k] = old["seen"][:, j]
        for part in range(2):
            turn = -1.0 if backward or (image is in_a_mirror and part == 0) else 1.0
            side = -1.0 if image is in_a_mirror and part == 1 else 1.0
            groups["heading"][:, 2 * k + part] = turn * old["heading"][:, 2 * j + part]
            groups["position"][:, 2 * k + part] = side * old["position"][:, 2 * j + part]
        for face in range(4):
            other = (face + 2) % 4 if backward else 3 - face
            groups["magnets"][:, 4 * k + face] = old["magnets"][:, 4 * j + other]
    for k in range(n - 1):
        j = n - 2 - k if backward else k
        for letter in range(3):
            groups["target"][:, 3 * k + letter] = old["target"][:, 3 * j + 2 - letter]
    if backward:
        groups["direction"][:] = -old["direction"]
    return out


@pytest.mark.parametrize("image", [in_a_mirror, from_the_other_end])
@pytest.mark.parametrize("task", TASKS)
def test_images_look_alike(task: FeedTask, image: Any) -> None:
    env: Any = gymnasium.make(ENV).unwrapped
    seen, view = episode(task, False), CanonicalView(env.layout, env.scene)
    other = image_of(seen, env.layout, image)
    assert not np.array_equal(other, seen)
    # The image in the test is that of the environment, as far as the task decides it.
    known = [span for name, span in env.layout.slices.items() if name in ("target", "magnets")]
    begun = episode(image(task), False, 0)[0]
    assert all(np.array_equal(other[0, span], begun[span]) for span in known)
    np.testing.assert_allclose(view(other), view(seen), atol=1e-6)


def test_a_chain_in_its_target_fold_does_not_deviate() -> None:
    env: Any = gymnasium.make(ENV, tasks=[TASKS[1]]).unwrapped
    seen, _ = env.reset(seed=0)
    spans, target = env.layout.slices, TASKS[1].target
    turns = [{"L": 0.5, "S": 0.0, "R": -0.5}[letter] * np.pi for letter in target]
    headings = np.cumsum([0.3, *turns])
    seen[spans["seen"]] = 1.0
    seen[spans["heading"]] = np.stack([np.sin(headings), np.cos(headings)], axis=-1).ravel()
    shown = CanonicalView(env.layout, env.scene)(seen)[spans["heading"]].reshape(-1, 2)
    np.testing.assert_allclose(shown[:-1], np.tile([0.0, 1.0], (5, 1)), atol=1e-6)
    # An unseen component shows nothing, and the joint before it turns towards the tube.
    seen[spans["seen"]][2] = 0.0
    seen[spans["heading"]][4:6] = 0.0
    shown = CanonicalView(env.layout, env.scene)(seen)[spans["heading"]].reshape(-1, 2)
    assert not shown[2].any()
    side = 1.0 if target[0] == "L" else -1.0
    off = side * (np.pi - headings[1]) - side * turns[1]
    np.testing.assert_allclose(shown[1], [np.sin(off), np.cos(off)], atol=1e-6)


def test_the_vector_form_shows_the_same() -> None:
    envs = vector.CanonicalObservation(
        gymnasium.make_vec(ENV, num_envs=3, autoreset_mode=AutoresetMode.SAME_STEP)
    )
    raw = gymnasium.make_vec(ENV, num_envs=3, autoreset_mode=AutoresetMode.SAME_STEP)
    single: Any = CanonicalObservation(gymnasium.make(ENV))
    view = single._view
    seen, plain = envs.reset(seed=4)[0], raw.reset(seed=4)[0]
    assert np.array_equal(seen[0], single.reset(seed=4)[0])
    ended = 0
    for _ in range(60):
        actions = np.ones((3, 1), dtype=np.float32)
        seen, _, over, _, infos = envs.step(actions)
        plain, _, _, _, told = raw.step(actions)
        assert np.array_equal(seen, view(plain))
        for row in np.flatnonzero(over):
            ended += 1
            assert np.array_equal(infos["final_obs"][row], view(told["final_obs"][row]))
    assert ended
    assert single.observation_space == envs.single_observation_space


def test_other_environments_and_uneven_scenes_are_refused() -> None:
    for env_id in ("MagFold/TubeFeed-v0", "MagFold/Tray-v0"):
        with pytest.raises(ValueError, match=r"env: observations of .* are not allowed"):
            CanonicalObservation(gymnasium.make(env_id))
    env = gymnasium.make(ENV)
    scene: Any = env.get_wrapper_attr("scene").replace(gravity={"in_plane": [0.0, 0.1]})
    with pytest.raises(SceneError, match=r"gravity\.in_plane"):
        CanonicalView(env.get_wrapper_attr("layout"), scene)
