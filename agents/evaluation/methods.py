"""Methods that are compared: each one policy, or the policies that several seeds have trained."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.episodes import Outcome
from agents.evaluation.shipped import shipped_files, shipped_names


@dataclass(frozen=True)
class Method:
    """What is compared under one name.

    Attributes
    ----------
    name : str
        As shown.
    policies : tuple of str
        What `agents.evaluation.policies.make_policy` understands, one a seed.
    """

    name: str
    policies: tuple[str, ...]

    @classmethod
    def parse(cls, text: str) -> "Method":
        """Return the method that ``NAME=PATH,PATH,...``, or a policy alone, stands for.

        A file's name without its ending is what it is called then, with its folder's for
        ``policy.zip``, the name that every training gives. The name of a set of shipped policies
        stands for the paths of all its seeds.

        Raises
        ------
        ValueError
            If a name or a policy is empty, or given twice.
        """
        name, separator, listed = text.rpartition("=")
        shipped = shipped_names()
        policies = tuple(
            path
            for each in listed.split(",")
            for path in (map(str, shipped_files(each)) if each in shipped else (each,))
        )
        if not all(policies) or (separator and not name) or len(set(policies)) < len(policies):
            raise ValueError(
                f"{text!r} is not allowed; must be random, minimiser, a path, or NAME=PATH,PATH,… "
                "with a path for each seed"
            )
        return cls(name or (listed if listed in shipped else _short(policies)), policies)


def _short(policies: Sequence[str]) -> str:
    path = Path(policies[0])
    return path.parent.name if path.name == "policy.zip" and path.parent.name else path.stem


def parse_methods(texts: Sequence[str]) -> list[Method]:
    """Return the methods that `texts` stand for.

    Raises
    ------
    ValueError
        If one is not allowed, or two have one name.
    """
    methods = [Method.parse(text) for text in texts]
    names = [method.name for method in methods]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"{twice[0]}: two methods have this name; give others, NAME=PATH")
    return methods


Runs = Sequence[Sequence[Outcome]]
"""The outcomes of each run of a method; all runs have the same targets and draws."""

Results = Mapping[str, Runs]
"""The runs of each method, by its name."""


def targets_of(results: Results) -> list[str]:
    """Return the targets in the order in which they were played."""
    runs = next(iter(results.values()))
    return list(dict.fromkeys(outcome.target for outcome in runs[0]))


def by_target(runs: Runs, values: str = "success") -> NDArray[np.float64]:
    """Return the mean of an attribute of the outcomes, shape (runs, targets)."""
    words = list(dict.fromkeys(outcome.target for outcome in runs[0]))
    table = np.zeros((len(runs), len(words)))
    for k, run in enumerate(runs):
        for m, word in enumerate(words):
            table[k, m] = np.mean([getattr(each, values) for each in run if each.target == word])
    return table


def pooled(runs: Runs, target: str | None = None) -> list[Outcome]:
    """Return the outcomes of all runs, for one target or for all."""
    return [each for run in runs for each in run if target in (None, each.target)]
