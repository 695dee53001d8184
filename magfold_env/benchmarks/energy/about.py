"""The parts of the energy benchmark in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "scan": Description(
        "Exact energies of all folds",
        "The time to find the energies of all folded words of six components, for many sequences "
        "of magnets and for every one of the 2²³.",
        "All scans take turns on one core; sequences are random, with a fixed seed.",
        "Whether an exhaustive search is a practical answer for six components.",
        "The energies themselves: tests compare them with sums over all pairs.",
    ),
    "ground-states": Description(
        "Proofs of lowest energy",
        "The time to find the fold of lowest energy of a random sequence and to prove that there "
        "is none below it, for chains of 12 and more components.",
        "One core, a new random sequence each time: medians over sequences, and the slowest.",
        "How long a chain may be so that its prediction by energy is certain.",
        "Sequences designed to be hard; folds that are not fully folded.",
    ),
    "predictors": Description(
        "How often quicker predictors agree with the proof",
        "The share of random sequences for which a search component by component, or a descent "
        "over joint angles, ends in the proved fold of lowest energy.",
        "Counted over random sequences of 6, 10 and 14 components.",
        "What is lost by not searching everything.",
        "Whether real folds end in the lowest energy: often they do not, see predict.",
    ),
}
