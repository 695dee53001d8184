"""The parts of the environments' benchmark in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "episodes": Description(
        "Whole episodes a second",
        "Episodes of the tube-feed environment that are simulated to their end in a second, for "
        "chains of several lengths.",
        "Random magnets and speeds; single environments and vectors of them play the same "
        "episodes in turns, on one thread and on more.",
        "How much experience an agent can collect: training is made of such episodes.",
        "The agent itself; trained agents feed otherwise than at random.",
    ),
    "quasistatic": Description(
        "Steps a second without dynamics",
        "Steps of the environment's fidelity by energy alone, on one core.",
        "Random actions, alone and in a vector, with and without a reward for similarity on the "
        "way, in turns.",
        "How fast a policy can be pretrained before dynamics are switched on.",
        "How much such pretraining helps: see docs/training.md.",
    ),
    "overhead": Description(
        "What Python adds",
        "The time of a step of a vector environment that is not physics, by the number of "
        "environments.",
        "First steps, in which nothing can fold, and the time outside the compiled kernels in "
        "all others.",
        "Whether the wrapping, rather than the physics, would be worth more work.",
        "What a learning library adds around it.",
    ),
    "peers": Description(
        "Beside other Gymnasium tasks",
        "Steps and episodes a second of this package's tasks and of well-known ones.",
        "One core, random actions, in turns. A step is not the same thing everywhere: it moves a "
        "whole component here, and 40 or 50 ms there.",
        "What to expect from training times beside tasks that one knows.",
        "How hard the tasks are. MuJoCo's are left out if it is not installed.",
    ),
}
