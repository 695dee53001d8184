"""What friction holds, and what it must let go."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.engine.contact import constraints
from magfold_env.engine.friction import held
from magfold_env.scene import load_scene
from magfold_env.simulation.session import Session
from tests.stress.test_scenes import FOUND

STRETCHED = next(path for path in FOUND if path.stem == "stretched-between-held")
TIME = 5e-4  # [s] before anything is met


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5, 1e-6])
def test_links_stretched_between_held_ends_move_across(tolerance: float) -> None:
    # Components 1 and 2 lie straight between the pin and what friction holds: to first order they
    # may turn against each other, and their hinge begins to move as if nothing held them.
    scene = load_scene(STRETCHED).replace(solver={"tolerance": tolerance})
    session = Session(scene)
    model, state, work = session._model, session._state, session._work
    start = np.zeros(scene.n + 2)
    assert constraints.begin_step(model, state, work) == constraints.OK
    assert held.first_accelerations(model, state, work, start)
    assert state.stuck[2] == 1
    assert start[0] == pytest.approx(-start[1], rel=1e-6)
    turned = np.diff(mf.simulate(scene.replace(duration=TIME)).angles)[0]
    assert abs(turned) == pytest.approx(abs(start[1] - start[0]) * TIME**2 / 2, rel=0.1)
