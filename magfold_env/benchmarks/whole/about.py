"""The parts of the benchmark of whole runs in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "work-precision": Description(
        "Whole folds: which settings are worth their time",
        "How far whole folds are off, on their way and at the end, and how long they take, for "
        "every combination of the solver's tolerance and the accuracy of the magnets, and for "
        "the paper's solver at several time steps, on ten named scenes.",
        "Each scene is run from several starts and compared, at common times, with itself at a "
        "tight tolerance and with accurate magnets; the error is the largest of any joint's "
        "angle, the median of all starts. Starts that a nudge of 1e-6 rad sends elsewhere are "
        "set aside and counted, and so are those whose reference is not known to 0.02 rad. "
        "Settings take turns; times are of the run alone, a scene's preparation left out. The "
        "Pareto front is made of the settings that no other beats in both error and time; a star "
        "marks the default.",
        "A default on the front, or close behind it, is one that a user need not change: nothing "
        "else is as exact in much less time. A fold whose joints all reach their stops ends "
        "exactly there at any setting, so at its end the loosest setting that finds the right "
        "shape wins; how sure it finds it, one scene cannot tell.",
        "What the model itself leaves out: the reference is the same model. How reliable a "
        "setting is over many scenes: python -m magfold_env.laws.agreement "
        "counts that. The paper's solver stops joints by snapping them, so it does not converge "
        "to this reference.",
    ),
    "skipping": Description(
        "What a scene does not need",
        "The time of a run as its features are switched off, one at a time and all together, and "
        "of a bare pendulum in a loop that knows of nothing else.",
        "A chain of six is pushed out of a tube over a sloping floor, beside a fixed magnet, and "
        "recorded. Each scene moves otherwise, so the time is divided by the number of times "
        "that the accelerations were evaluated, and by the same for the pendulum's loop. That "
        "loop takes the engine's own steps; it ends at the same angles after the same "
        "evaluations. All take turns. Without contact, magnets run into each other, and that row "
        "ends after a thousand steps, unsettled.",
        "A feature that is off should cost nothing. The scene that lacks everything should take "
        "as long as the bare loop; what it takes more is paid by every simulation.",
        "Preparing a scene, which is not timed; longer chains, where what is paid once weighs "
        "less.",
    ),
}
