"""The same chain seen from its other end."""

import numpy as np
import pytest

from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.simulate import simulate
from tests.words import reverse

pytestmark = pytest.mark.laws

OTHER_END = (2, 3, 0, 1)


def scene_of(number, direction) -> Scene:
    scene = load_scene(f"paper/sequence-{number}").replace(mount="tube")
    scene = scene.replace(feed={"direction": direction, "speed": 0.2})
    return scene.draw(np.random.default_rng(number))


def with_faces(scene, order, step=1):
    return tuple("".join(faces[k] for k in order) for faces in scene.sequence[::step])


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_the_view_from_the_other_end_is_the_same_fold_bit_for_bit(number, direction):
    scene = scene_of(number, direction)
    scene = scene.replace(friction=np.linspace(0.1, 0.4, scene.n))
    assert scene.start_offsets is not None
    other = scene.replace(
        sequence=with_faces(scene, OTHER_END, -1),
        start_offsets=scene.start_offsets[::-1],
        friction=scene.frictions[::-1],
        feed={"direction": "backward" if direction == "forward" else "forward"},
    )
    a, b = simulate(scene), simulate(other)
    assert b.word == reverse(a.word)
    assert (b.status, b.time, b.steps) == (a.status, a.time, a.steps)
    # Both run as the one that is indexed from its held end; only the view differs.
    assert b.joint_angles == pytest.approx(-a.joint_angles[::-1], abs=1e-14)
