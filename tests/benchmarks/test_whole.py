"""Tests of `magfold bench whole`: scenes, settings, floor, and a small run of both parts."""

from __future__ import annotations

import numpy as np
import pytest

from magfold_bench import bare_pendulum, runs, work_precision
from magfold_bench.runs import Setting, difference, recorded
from magfold_env.scene import Magnets, Scene, Solver
from magfold_env.simulation.session import Session


def swinging(n: int = 3, duration: float = 0.5) -> Scene:
    pendulum = work_precision.named_scenes()[work_precision.PENDULUM]
    start = tuple(0.1 * (-1) ** k for k in range(n - 1))
    return pendulum.replace(sequence=("NNNN",) * n, start_angles=start, duration=duration)


def drawn(scene: Scene, seed: int) -> Scene:
    return scene.draw(np.random.default_rng(seed))


def test_a_setting_changes_only_what_it_sets() -> None:
    scene = work_precision.named_scenes()["sequence 3, pinned"]
    changed = Setting("paper", 1e-3, 1e-2).on(scene)
    assert (changed.solver.method, changed.solver.time_step) == ("paper", 1e-3)
    assert changed.magnets is not None
    assert changed.magnets.accuracy == 1e-2
    back = changed.replace(solver=Solver(), magnets={"accuracy": Magnets().accuracy})
    assert back == scene
    loose, tight = Setting("adaptive", 1e-3, 1e-2), Setting("adaptive", 1e-4, 1e-2)
    assert tight.as_tight(loose)
    assert not loose.as_tight(tight)
    assert not Setting("adaptive", 1e-4, 1e-1).as_tight(loose)


@pytest.mark.parametrize("n", [1, 3])
def test_the_floor_takes_the_engines_steps(n: int) -> None:
    scene = swinging(n)
    session = Session(scene)
    session.settle()
    bare = bare_pendulum.pendulum(scene)
    assert bare_pendulum.swing(bare, scene.duration) == session.evaluations
    assert np.abs(bare.q - session.angles).max() < 1e-9
    assert np.abs(bare.v - session.rates).max() < 1e-6


def test_the_floor_refuses_what_it_cannot_do() -> None:
    for changes in ({"magnets": {}}, {"friction": 0.1}, {"contact": True}, {"mount": "free"}):
        with pytest.raises(ValueError, match="must be a drawn, pinned chain"):
            bare_pendulum.pendulum(swinging().replace(**changes))


def test_a_run_is_compared_at_common_times() -> None:
    scene = drawn(work_precision.named_scenes()[work_precision.PENDULUM], 0)
    exact = work_precision.reference(scene, 1e-8, 1e-6)
    assert 0.0 < exact.known < runs.NUDGE < exact.sensitivity < runs.CLOSE
    assert exact.error_on_the_way(exact.fold) == runs.NUDGE
    errors = [
        exact.error_on_the_way(recorded(Setting("adaptive", t, None).on(scene)))
        for t in (1e-2, 1e-3, 1e-4)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-3
    # Its frames lie at the ends of its own steps, here longer than a frame's time.
    coarse = recorded(Setting("paper", 2e-3, None).on(swinging(1, 0.2)))
    fine = recorded(Setting("paper", 1e-5, None).on(swinging(1, 0.2)))
    assert difference(coarse, fine) == 0.0  # one component has no joint
    two = [recorded(Setting("paper", h, None).on(swinging(2, 0.03))) for h in (2e-3, 1e-3)]
    best = recorded(Setting("paper", 1e-6, None).on(swinging(2, 0.03)))
    off = [difference(each, best) for each in two]
    assert 1.5 < off[0] / off[1] < 2.5  # of first order, frames included
