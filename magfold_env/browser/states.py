"""The words of least magnetic energy for a web page, ranked as by `mf.minimise`.

The search visits words depth first, in the order S, L, R, and adds a component's pair energies when
it places the component. Nothing is allocated here, and a search can run in parts, because its
arrays record its progress.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from magfold_env.browser.settings import Settings, face_charge
from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets import pairs
from magfold_env.engine.state import (
    Array,
    IntArray,
    IntPerBody,
    Magnets,
    Nodes,
    PerBody,
    Pose,
)
from magfold_env.engine.workspace import new_nodes, zeros
from magfold_env.minimiser.arms import PairTable, pair_energy
from magfold_env.minimiser.couplings import FACES
from magfold_env.minimiser.energies import TIE
from magfold_env.minimiser.lattice import HEADINGS, TURNS

MOST = 8
"""Largest number of states kept."""

# `Search.progress`: number of laid components after the first, −1 at the end; states found.
DEPTH, FOUND = range(2)

_TURNS = tuple(int(turn) for turn in TURNS)
_HEADINGS = tuple((int(x), int(y)) for x, y in HEADINGS)


@by_pointer
class Couplings(NamedTuple):
    """Energies of two components on the lattice; see `minimiser.arms.PairTable`."""

    half: Array  # half a casing's diagonal, (1,) [m]
    energy: Annotated[Array, "cells", "cells", 4, FACES, FACES]
    """Energies of faces with unit charge, by cell and quarter turns [J/(A·m)²]."""
    known: Annotated[IntArray, "cells", "cells", 4]  # 1 where the energy is filled in
    charge: Annotated[Array, 2, FACES]  # scratch: charges of two components
    pose: Pose  # scratch: their poses, (2,) each
    nodes: Nodes


@by_pointer
class Search(NamedTuple):
    """A search through all words of n components, component 1 first, and the best ones so far."""

    coupling: Array  # `Couplings.energy`
    charge: Annotated[Array, "n", FACES]  # of the faces [A·m]
    unit: Annotated[Array, 1]  # energies this close count as equal [J]
    x: IntPerBody  # cells and headings of the laid components
    y: IntPerBody
    quarter: IntPerBody
    component: IntPerBody
    tried: IntPerBody  # number of letters tried at the joint behind each component
    energy: PerBody  # energy of the components up to each [J]
    best: Annotated[Array, MOST]  # energies of the states found, lowest first [J]
    letter: Annotated[IntArray, MOST, "n"]  # 1 L, 0 S, −1 R
    stable: Annotated[IntArray, MOST]  # whether a state is folded and no equal poles touch
    progress: Annotated[IntArray, 2]


def new_couplings(magnets: Magnets, length: float, longest: int) -> Couplings:
    """Allocate the couplings of chains of up to ``longest`` components.

    ``length`` is a component's length from hinge to hinge [m].
    """
    sizes, half = {"cells": 4 * (longest - 1) + 1, "n": 2}, np.array([0.5 * length])
    return zeros(Couplings, sizes, half=half, nodes=new_nodes(magnets, 2))


def new_search(couplings: Couplings, n: int) -> Search:
    """Allocate a search for chains of n components."""
    return zeros(Search, {"n": n}, coupling=couplings.energy)


@kernel
def couple(couplings: Couplings, magnets: Magnets, n: int, most: int) -> int:
    """Fill in up to ``most`` couplings for chains of n components; return 1 if none are missing."""
    reach, middle, filled = 2 * (n - 1), couplings.energy.shape[0] // 2, 0
    for x in range(-reach, reach + 1):
        rest = reach - abs(x)
        for y in range(-rest, rest + 1, 2):
            if x == 0 and y == 0:
                continue
            # Each turn changes the parities of the cell's x, its y and the heading together.
            for quarter in range(x % 2, 4, 2):
                if couplings.known[x + middle, y + middle, quarter] == 0:
                    if filled == most:
                        return 0
                    couplings.known[x + middle, y + middle, quarter] = 1
                    put_pose(couplings, x, y, quarter)
                    put_energies(
                        couplings, magnets, couplings.energy[x + middle, y + middle, quarter]
                    )
                    filled += 1
    return 1


@kernel
def put_pose(couplings: Couplings, x: int, y: int, quarter: int) -> None:
    """Place the second component in a cell; the first one is at the origin and heads along +x."""
    pose, half = couplings.pose, couplings.half[0]
    pose.cos[0], pose.sin[0], pose.x[0], pose.y[0] = 1.0, 0.0, 0.0, 0.0
    c, s = _HEADINGS[quarter]
    pose.cos[1], pose.sin[1] = float(c), float(s)
    pose.x[1], pose.y[1] = half * x, half * y


@kernel
def put_energies(couplings: Couplings, magnets: Magnets, out: Array) -> None:
    """Fill in the energies (4, 4) of all pairs of faces of two components in their poses."""
    charge = couplings.charge
    for a in range(FACES):
        for b in range(FACES):
            for f in range(FACES):
                charge[0, f] = 1.0 if f == a else 0.0
                charge[1, f] = 1.0 if f == b else 0.0
            out[a, b] = pairs.energy(0, magnets, charge, couplings.pose, couplings.nodes)


@kernel
def begin_search(settings: Settings, couplings: Couplings, search: Search) -> None:
    """Begin the search through a chain's words; no state is known yet."""
    largest = 0.0
    for i in range(search.x.size):
        search.component[i] = i
        for f in range(FACES):
            strength = face_charge(settings, i, f)
            largest = max(largest, strength)
            search.charge[i, f] = float(settings.pole[i, f]) * strength
    # `minimiser.energies.tie`
    side = couplings.half[0] * math.sqrt(2.0)
    search.unit[0] = TIE * 1e-7 * largest * largest / side
    search.x[0], search.y[0], search.quarter[0], search.tried[0] = 0, 0, 0, 0
    search.energy[0] = 0.0
    search.progress[DEPTH], search.progress[FOUND] = 0, 0


@kernel
def visit(search: Search, most: int) -> int:
    """Continue the search for up to ``most`` steps; return 1 once all words have been visited."""
    table = PairTable(search.coupling, search.coupling.shape[0] // 2, search.charge, False)
    last, depth = search.x.size - 1, search.progress[DEPTH]
    for _ in range(most):
        if depth < 0:
            break
        if depth == last:
            keep(search)
            depth -= 1
        elif search.tried[depth] == len(_TURNS):
            depth -= 1
        else:
            search.tried[depth] += 1
            lay(search, depth)
            total = search.energy[depth]
            for k in range(depth + 1):
                total += pair_energy(table, search, k, search, depth + 1)
            if total < math.inf:
                depth += 1
                search.tried[depth] = 0
                search.energy[depth] = total
    search.progress[DEPTH] = depth
    return int(depth < 0)


@kernel
def lay(search: Search, depth: int) -> None:
    """Place the component behind the joint whose letter was tried last."""
    before, letter = int(search.quarter[depth]), int(search.tried[depth]) - 1
    after = (before + _TURNS[letter]) % 4
    x, y = _HEADINGS[before]
    dx, dy = _HEADINGS[after]
    search.x[depth + 1] = search.x[depth] + x + dx
    search.y[depth + 1] = search.y[depth] + y + dy
    search.quarter[depth + 1] = after


@kernel
def keep(search: Search) -> None:
    """Insert the current word among the best, after words of equal energy, or discard it."""
    last, count = search.x.size - 1, search.progress[FOUND]
    energy = search.energy[last]
    place = count
    while place > 0 and energy < search.best[place - 1] - search.unit[0]:
        place -= 1
    if place == MOST:
        return
    for k in range(min(count, MOST - 1), place, -1):
        search.best[k] = search.best[k - 1]
        search.stable[k] = search.stable[k - 1]
        for joint in range(last):
            search.letter[k, joint] = search.letter[k - 1, joint]
    search.best[place] = energy
    for k in range(last):
        search.letter[place, k] = _TURNS[search.tried[k] - 1]
    search.stable[place] = is_stable(search)
    search.progress[FOUND] = min(count + 1, MOST)


@kernel
def is_stable(search: Search) -> int:
    """Return whether the current word is folded and no like poles touch."""
    table = PairTable(search.coupling, search.coupling.shape[0] // 2, search.charge, True)
    for k in range(1, search.x.size):
        if _TURNS[search.tried[k - 1] - 1] == 0:
            return 0
        for i in range(k):
            if not pair_energy(table, search, i, search, k) < math.inf:
                return 0
    return 1
