"""Releases of a search: given up where a chain rattles, and otherwise what they are anyway."""

import numpy as np

import magfold_env as mf
from magfold_env.designer.trials import hurried
from magfold_env.ensembles.releases import release
from magfold_env.fold import FoldStatus

SCENE = release(mf.load_scene("design"), "forward")


def test_haste_changes_no_fold() -> None:
    design = mf.design("LRR", runs=0)
    assert design.scene is not None
    patient, hasty = mf.simulate(design.scene, 3), mf.simulate(hurried(design.scene), 3)
    assert patient.status is hasty.status is FoldStatus.FOLDED
    np.testing.assert_array_equal(hasty.angles, patient.angles)
    assert hasty.steps == patient.steps


def test_haste_knows_the_length_the_tolerance_and_the_scenes_own_cap() -> None:
    def pace(**changes: object) -> int:
        return hurried(SCENE.replace(**changes)).solver.max_steps_per_second

    usual = pace()
    assert usual < SCENE.solver.max_steps_per_second
    assert abs(pace(sequence=SCENE.sequence * 2) - 2 * usual) <= 1
    assert abs(pace(solver={"tolerance": 1e-9}) - 10 * usual) <= 5
    assert pace(solver={"max_steps_per_second": 7}) == 7
