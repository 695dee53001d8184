"""The parts of the design benchmark in plain words."""

from __future__ import annotations

from magfold_env.benchmarks.runner import Description

ABOUT = {
    "targets": Description(
        "Designing magnets for every shape",
        "How often a designed sequence folds into the shape that was asked for, for all shapes "
        "and modes of release, beside the design that energy alone suggests.",
        "Designs are judged on releases that the search has not seen, randomised as a careful "
        "workshop would vary.",
        "Whether mf.design can be relied upon, and for which shapes it cannot.",
        "Devices and floors other than the default one.",
    ),
    "searches": Description(
        "Searches side by side",
        "What each search method reaches, and how much it costs, on the same targets.",
        "One core; results by energy stand beside proved optima, others are judged by releases.",
        "Which method mf.design should choose by itself.",
        "Chains longer than six components.",
    ),
    "lengths": Description(
        "Designing longer chains",
        "How many targets of the suites of 8 to 16 components are solved, and in what time.",
        "One core a target, modes of release in turn; success on releases of their own.",
        "How far design carries beyond the paper's six components.",
        "Times compare only within this machine; the pace below says how steady it was.",
    ),
    "friction": Description(
        "How much friction longer chains bear",
        "The share of releases that fold into their target, by length and friction of the floor.",
        "Sequences designed without a floor are fed over floors of different friction.",
        "Why the suites of longer chains come with less friction.",
        "Static friction above kinetic, and floors that are not even.",
    ),
}
