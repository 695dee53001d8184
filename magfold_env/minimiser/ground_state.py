"""Exact ground states of long chains, with a certificate: `ground_state`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from magfold_env.minimiser.halves import Halves, Limit
from magfold_env.minimiser.landscape import TIE, energy_unit, refuse_field
from magfold_env.minimiser.lattice import ORDER
from magfold_env.minimiser.ranking import ranked
from magfold_env.minimiser.result import Among, State
from magfold_env.minimiser.states import state_of
from magfold_env.scene import Scene


@dataclass(frozen=True)
class GroundStates:
    """The result of `ground_state`.

    Attributes
    ----------
    states : tuple of State
        Lowest energy first.
    lower_bound : float
        No state that is not listed lies lower [J]; infinite if every state is listed.
    nodes : int
        Words of half the chain, shorter ones included, that were bounded or completed.
    """

    states: tuple[State, ...]
    lower_bound: float
    nodes: int

    @property
    def best(self) -> State:
        """The state of least energy that was found.

        Raises
        ------
        ValueError
            If there is none: no word of this length satisfies the condition that was set, or none
            was found within the limits.
        """
        if not self.states:
            raise ValueError("the search found no state that satisfies its condition")
        return self.states[0]

    @property
    def gap(self) -> float:
        """How far below the best state another could still lie [J]; 0 if none can."""
        return max(0.0, self.best.energy - self.lower_bound)

    @property
    def proved(self) -> bool:
        """Whether the best state is proved to be a ground state."""
        return self.gap == 0.0

    @property
    def complete(self) -> bool:
        """Whether all states listed are proved to be the lowest that there are."""
        highest = self.states[-1].energy if self.states else math.inf
        return highest <= self.lower_bound


def ground_state(
    scene: Scene,
    top: int = 1,
    among: Among = "all",
    *,
    time_limit: float | None = None,
    node_limit: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> GroundStates:
    """Find the states of least energy of a long chain and prove that they are.

    Branch and bound: the chain is cut in the middle, the words of one half are ordered by a lower
    bound on the energy of the states that they belong to, and completed in that order until the
    bound exceeds what was found. Where states tie with the last one listed, some are left out.

    Parameters
    ----------
    scene
        Its sequence, casing and magnets count; mount, friction and contact do not.
    top
        How many states to find.
    among
        Which words to rank: `all` that do not overlap, only the `folded` ones (no S), or only the
        `stable` ones (folded, and no equal poles touch).
    time_limit
        Stop after this time [s], None for never, with what was found and the bound that was
        reached. Listing the words of both halves comes first and is not stopped.
    node_limit
        Stop after so many words of half the chain, bounded or completed: unlike time, they are
        the same on every machine.
    progress
        Called with the share of the work that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If an argument is out of range, or half the chain has too many words to list.
    """
    _check(top, among, time_limit, node_limit)
    refuse_field(scene)
    if scene.n == 1:
        return GroundStates((state_of(scene, ""),), math.inf, nodes=1)
    limit = Limit(time_limit, node_limit)
    tolerance = TIE * energy_unit(scene)
    halves = Halves(
        scene,
        ORDER if among == "all" else "LR",
        stable=among == "stable",
        top=top,
        tolerance=tolerance,
    )
    bound = halves.search(limit, progress or _ignore)
    states = _ranked_states(scene, halves.words(), tolerance)
    if len(states) == top:
        bound = min(bound, states[-1].energy)
    return GroundStates(states, bound, halves.nodes)


def _ranked_states(scene: Scene, words: list[str], tolerance: float) -> tuple[State, ...]:
    """Order words as the full search does: ties in the order S, L, R."""
    words = sorted(words, key=lambda word: [ORDER.index(letter) for letter in word])
    states = [state_of(scene, word) for word in words]
    found: list[State] = []
    for group in ranked(np.array([state.energy for state in states]), tolerance):
        rows = [int(row) for row in group]
        for row in rows:
            tied = tuple(words[other] for other in rows if other != row)
            found.append(replace(states[row], tied=tied))
    return tuple(found)


def _check(top: int, among: str, time_limit: float | None, node_limit: int | None) -> None:
    if among not in get_args(Among):
        allowed = ", ".join(get_args(Among))
        raise ValueError(f"among: {among!r} is not allowed; must be one of {allowed}")
    if top < 1:
        raise ValueError(f"top: {top!r} is not allowed; must be at least 1")
    for key, limit in (("time_limit", time_limit), ("node_limit", node_limit)):
        if limit is not None and not limit >= 0:
            raise ValueError(f"{key}: {limit!r} is not allowed; must be None or at least 0")


def _ignore(_: float) -> None:
    pass
