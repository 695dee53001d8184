"""The parts of the prediction benchmark in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "experiment": Description(
        "The paper's experiment, simulated",
        "Into which shapes the paper's three sequences fold, released free, fed forward and fed "
        "backward as often as in its experiment.",
        "Friction, magnets and start vary from release to release, as a hand does. The table has "
        "the share of every shape, the minimiser's prediction, and the paper's words.",
        "Where the simulation agrees with what was seen on real chains, and where it does not.",
        "The paper's own device: its drawings are not at hand, so sequences and sizes are "
        "reconstructed from its text.",
    ),
    "predictors": Description(
        "How often a predictor names what happens",
        "How often minimisers of energy, and a few simulated releases, name the shape that many "
        "simulated releases favour.",
        "The paper's sequences and random ones, in three modes of release.",
        "How good a prediction by energy alone is, and what simulating adds.",
        "Real chains: both sides are this package's.",
    ),
    "scaling": Description(
        "Releases a second on more cores",
        "Simulated releases a second with more and more threads and processes.",
        "One ensemble, which must give the same folds each time; wall clock, one after another.",
        "Whether more cores help, and which kind of worker suits.",
        "Clusters; machines with more cores than this one.",
    ),
}
