"""How many steps a fold may take: components that creep or stop together must not hold time up."""

from functools import partial

import pytest

from magfold_bench.laws.random_scenes import random_scene
from magfold_env.fold import FoldStatus
from magfold_env.simulation.simulate import simulate

thoroughly = partial(pytest.param, marks=pytest.mark.slow)

SETTLED = {FoldStatus.FOLDED, FoldStatus.MISFOLDED}


# In each of these components once stopped and crept on in turns, a tenth of a microsecond at a
# time: pushed by hardly more than friction holds, or joined to one that friction cannot hold.
@pytest.mark.parametrize("seed", [39, 80, 229, *map(thoroughly, (246, 277))])
def test_creeping_chains_come_to_rest_in_few_steps(seed):
    fold = simulate(random_scene(seed))
    assert fold.status in SETTLED
    assert fold.steps < 2000 * (1.0 + fold.time), fold.message


@pytest.mark.parametrize("seed", [246, thoroughly(277)])
def test_finer_steps_are_not_many_more(seed):
    scene = random_scene(seed)
    tolerance = scene.solver.tolerance / 20.0
    coarse, fine = simulate(scene), simulate(scene.replace(solver={"tolerance": tolerance}))
    assert fine.word == coarse.word
    # Steps of second order grow √20-fold, 4.5, and steps of first order twentyfold.
    assert fine.steps < 8 * coarse.steps
