"""The parts of the dynamics benchmark in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "scaling": Description(
        "How the cost of a chain grows with its length",
        "The time that it takes to find the accelerations of a pinned chain of 1 to 10,000 "
        "components from its angles and their rates: the equations of motion, without magnets.",
        "This engine for one chain, and for many chains at a time, beside Pinocchio and MuJoCo "
        "if they are installed, and beside the paper's equation 39 as a dense system in NumPy. "
        "All must agree on the accelerations before they are timed, and take turns while they "
        "are.",
        "A method whose time grows in proportion to the length simulates long chains; a dense "
        "one is left behind quickly. The power that is fitted to the times says which it is.",
        "Magnets, contact and friction, which later parts look at. Pinocchio is called from "
        "Python; what a call costs is taken off. MuJoCo's step does more than find "
        "accelerations.",
    ),
    "smooth": Description(
        "Motion without contact: error against run time",
        "How far integrators are off, and how long they take, on three motions in which nothing "
        "touches: pendula of three and six links, and a magnetic chain until just before it "
        "does.",
        "The engine at tolerances from 1e-2 to 1e-10 rad, and six other integrators on the same "
        "forces, the paper's double Euler among them. The error is the largest of any angle at "
        "six times, against a solution of far higher order at 1e-13, which a second method "
        "confirms.",
        "Whether the tolerance that a user asks for is the error that comes out, and what the "
        "paper's scheme would cost for the same error.",
        "Impacts and friction, where the choice of an integrator is decided: see the next parts.",
    ),
    "restarts": Description(
        "What starting afresh costs an integrator",
        "The evaluations of the accelerations that integrators need for a given error if the "
        "motion is cut into 1, 4 and 16 arcs, each begun without knowledge of the one before.",
        "The magnetic chain of the part before. Evaluations are counted, nothing is timed.",
        "Every impact ends the smooth motion and a fold has dozens. Methods that win on one long "
        "arc lose on many short ones: why the engine uses a pair of order five.",
        "How well the methods find the impact itself.",
    ),
    "contact": Description(
        "Folds with contact: error against run time",
        "How far whole folds of the paper's sequences are off at several tolerances, on their "
        "way and at the end, and how long they take.",
        "The engine, which locates impacts and stops there, beside time steps that pass over "
        "them (Moreau's scheme alone). Errors are against the engine at a tolerance 30 times "
        "tighter than any of these. Scenes that a nudge of 1e-6 rad sends elsewhere are set "
        "aside, and counted.",
        "What locating impacts is worth.",
        "Whether the reference is right: it shares the engine's model of impacts and friction. A "
        "second simulator in the tests (pytest -m slow tests/laws) shares nothing with it.",
    ),
    "folds": Description(
        "What a whole fold costs",
        "The time and the evaluations of a fold of six components from release to rest, free "
        "with and without friction and fed out of a tube, at several tolerances.",
        "Random sequences that are designed to fold and do. A tolerance is good enough only if "
        "every one of them ends within 0.02 rad of its reference. Tolerances take turns.",
        "The price of one fold on one core, at the default and at the loosest tolerance that does.",
        "Chains that misfold, and longer ones; preparing a scene, which is not timed.",
    ),
    "features": Description(
        "What each feature of a scene costs",
        "Time a run and time an evaluation as features are switched on, from a bare chain to a "
        "chain with magnets, contact and friction that is fed from a tube.",
        "The time of a run is split by measured prices of its evaluations: chain, forces, and "
        "the rest, which is contact, friction at rest, stepping and calls from Python.",
        "Where the time of a simulation goes.",
        "Features switched off, beside a bare pendulum: see the part skipping.",
    ),
    "first-use": Description(
        "What the first use costs",
        "Processor time until a first fold is done in a new process: with nothing compiled, and "
        "with the kernels on disk.",
        "Processes of their own that import the package and fold a chain out of a tube.",
        "The wait of somebody who has just installed the package, and of every later start.",
        "The downloads of an installation; the tables of other scenes' magnets.",
    ),
}
