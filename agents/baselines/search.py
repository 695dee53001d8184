"""What all searches have in common: one choice a target, frozen within a budget."""

from contextlib import suppress
from typing import Any, Protocol
from zlib import crc32

import numpy as np

from agents.baselines.calls import Calls, SpentError
from agents.baselines.store import Chosen
from agents.evaluation.open_loop import OpenLoop
from magfold_env.envs.fold_env import FoldEnv

USUAL_SPEED = 0.2
"""Feed speed [m/s] to begin with: the one at which most designs do well."""


class Tries(Protocol):
    """A way to choose a sequence and speeds by trying."""

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Try choices, until one is good enough or the budget is spent (`SpentError`)."""
        ...


class Search(Tries, Protocol):
    """The same, with a choice that needs no trial."""

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> OpenLoop:
        """Return what is chosen without a single physics call."""
        ...


def freeze(search: Tries, env: FoldEnv[Any], target: str, budget: int, seed: int) -> Chosen:
    """Return what a search chooses for a target within a budget of physics calls.

    Of the choices that were tried it is the one with the best record (`Standing.expected`).

    Parameters
    ----------
    search : Tries
        How to choose.
    env : FoldEnv
        Where choices are tried, and with which randomisation.
    target : str
        The word that is wanted.
    budget : int
        Most physics calls, at least one.
    seed : int
        Of the search and of its physics calls.
    """
    calls = Calls(env, target, budget, seed)
    with suppress(SpentError):
        search.run(calls, _generator(target, seed))
    best = calls.standings()[0]
    return Chosen(*best.choice, calls.count, best.successes, len(best.scores))


def freeze_unseen(search: Search, env: FoldEnv[Any], target: str, seed: int) -> Chosen:
    """Return what a search chooses for a target without a physics call."""
    first = search.first(env, target, _generator(target, seed)).as_played(env)
    return Chosen(*first, calls=0, successes=0, releases=0)


def _generator(target: str, seed: int) -> np.random.Generator:
    """Return the random numbers of a search for a target."""
    return np.random.default_rng([seed, crc32(target.encode())])


def speeds_to_try(env: FoldEnv[Any]) -> list[float]:
    """Return the feed speeds that actions offer [m/s], the usual ones first."""
    return sorted(env.actions.speeds.tolist(), key=lambda v: abs(np.log(v / USUAL_SPEED)))


def random_choice(env: FoldEnv[Any], rng: np.random.Generator) -> OpenLoop:
    """Return a choice of which every one is equally likely."""
    n = env.scene.n
    poles = rng.choice(["N", "S"], (n, 4))
    speeds = rng.choice(env.actions.speeds, n)
    return OpenLoop(tuple("".join(faces) for faces in poles), tuple(speeds.tolist()))
