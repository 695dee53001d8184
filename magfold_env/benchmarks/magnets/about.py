"""The parts of the magnets benchmark in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "accuracy": Description(
        "Magnetic forces: error against run time",
        "The worst error of forces and torques on random pairs of casings, on chains of six and "
        "on chains of sixty, against the time that they take.",
        "Point charges (the paper's model), charged rectangles with a fixed number of nodes, and "
        "rectangles under an error bound, all against closed formulas that share no code with "
        "the engine. Errors are relative to the force between two magnets that lie flush.",
        "Whether the bound that a scene sets, magnets.accuracy, is kept, and what it costs.",
        "Whether a real magnet is an evenly charged rectangle: near its edges it is not quite.",
    ),
    "points": Description(
        "What point charges get wrong",
        "The force between two magnets over their distance, for the paper's rows of point "
        "charges, and how often they name another shape of lowest energy.",
        "Against the exact force between the rectangles; random sequences of six components.",
        "How far results computed with the paper's model can be trusted near contact.",
        "Dynamics with point charges, which the part work-precision has.",
    ),
    "far": Description(
        "Far magnets summed in groups",
        "What is saved, and what error is made, when far parts of the chain act on each other by "
        "multipoles instead of magnet by magnet.",
        "All orders and distances, on unfolded and folded chains; errors beside the full sums.",
        "Whether the engine's choice is near the best for each error bound.",
        "Neighbours, which are looked up and not summed.",
    ),
    "scaling": Description(
        "Magnetic forces of long chains",
        "The time that all magnetic forces take, for chains of 2 to 10,000 components.",
        "Unfolded chains, blocks with every joint a little off its stop, and blocks at their "
        "stops, where forces within rigid parts are kept; then the price of a pair of nodes.",
        "Whether magnets keep long chains from being simulated.",
        "Contact and friction of long chains, which are solved densely.",
    ),
    "devices": Description(
        "What features of real devices cost",
        "The time of magnetic forces with unequal magnets, empty faces, fields from outside and "
        "fixed magnets, over the time of the default chain.",
        "In turns with the default chain, which takes part twice to show the noise.",
        "What a device does not have must not cost anything; what it has is priced here.",
        "Whole folds of such devices: the scene anchor in work-precision is one.",
    ),
    "fold": Description(
        "Magnets over a real fold",
        "The average time of the magnets' forces over the states that a fold passes through, and "
        "their worst error, at three accuracies.",
        "Folds are recorded and their states evaluated again, in order, in one compiled loop.",
        "What a user pays for accuracy where it counts, in folds rather than in random states.",
        "Chains of other lengths than six.",
    ),
    "peers": Description(
        "Beside magpylib",
        "How much longer the library magpylib takes for the forces of the same chains, at an "
        "error no smaller.",
        "magpylib with magnets cut into cells, this engine under several error bounds, in turns. "
        "Without magpylib (pip install 'magfold_env[peers]') nothing is measured.",
        "What a solver made for one kind of chain gains over a general one.",
        "What magpylib is made for: magnets of other shapes, in any position in space.",
    ),
}
