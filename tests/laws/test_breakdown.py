"""What cannot go well ends with a status that says so: no endless loop, no silent NaN."""

import pytest

from magfold_env.benchmarks.dynamics_laws.breakdown import ending, hopeless_scenes

pytestmark = pytest.mark.laws

SCENES = hopeless_scenes(max_steps=1000)

NOT_YET = {
    "charges beyond squaring": "overflows while the scene is packed",
    "squares in one another": "a start with overlapping squares counts as at rest",
    "squares in one another, friction 10": "a start with overlapping squares counts as at rest",
}


def cases():
    for name, scene in SCENES.items():
        marks = [pytest.mark.xfail(reason=NOT_YET[name])] if name in NOT_YET else []
        yield pytest.param(scene, id=name.replace(" ", "-"), marks=marks)


@pytest.mark.parametrize("scene", list(cases()))
def test_a_hopeless_scene_ends_and_says_how(scene):
    found = ending(scene)
    assert found.wrong == ""
    assert found.outcome is not None
    if found.outcome.steps == scene.solver.max_steps:
        assert found.outcome.status == "unsettled"
        assert "steps are the limit" in found.outcome.message
