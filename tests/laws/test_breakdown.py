"""What cannot go well ends with a status that says so: no endless loop, no silent NaN."""

import pytest

from magfold_env.laws.outcomes import ending, hopeless_scenes

pytestmark = pytest.mark.laws

SCENES = hopeless_scenes(max_steps=1000)


@pytest.mark.parametrize("scene", SCENES.values(), ids=[name.replace(" ", "-") for name in SCENES])
def test_a_hopeless_scene_ends_and_says_how(scene):
    found = ending(scene)
    assert found.wrong == ""
    assert found.outcome is not None
    if found.outcome.steps == scene.solver.max_steps:
        assert found.outcome.status == "unsettled"
        assert "steps are the limit" in found.outcome.message
