"""Touches that lead nowhere: what parts again to keep other squares in touch."""

import numpy as np

import magfold_env as mf
from magfold_env.designer.annealing import sequence_of_signs, stable_signs
from magfold_env.ensembles.releases import generator, release

WORD = "LLLRLLRLRLR"


def test_a_chain_whose_loops_push_each_other_open_comes_to_rest():
    # Step after step one joint touched its stop and was moved off it to close a loop of squares:
    # 50,000 steps in a simulated second, the scene's work cap.
    sequence = sequence_of_signs(stable_signs(WORD, np.random.default_rng(7))[0])
    scene = mf.load_scene("design-long").replace(sequence=sequence)
    fold = mf.simulate(release(scene, "forward", 0.2), generator(3, 0))
    assert fold.status in {"folded", "misfolded"}
    assert fold.steps < 5000
