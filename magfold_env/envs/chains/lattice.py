"""Compiled energy minimisation, one component at a time; each joint takes about a microsecond.

The rule is that of `magfold_env.minimise` in the modes `forward` and `backward`: of the letters S,
L and R that cause no overlap, a joint takes the one with the least energy, computed with all
components beyond the joint in a straight line. In a preloaded chain, those components already have
their magnets. If magnets are inserted as components leave the tube, they do not.

Rows of arrays are components, in the order in which they leave the tube.
`magfold_env.minimiser.lattice` defines cells and quarter turns; the first row is at the origin.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import allocating_kernel, kernel
from magfold_env.minimiser.couplings import FACES, Couplings, couplings
from magfold_env.minimiser.energies import refuse_field, strengths, tie
from magfold_env.scene import Scene

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

LETTERS = {0: "S", 1: "L", -1: "R"}
"""Letters of joints by their quarter turns."""

TURNS = {letter: turn for turn, letter in LETTERS.items()}
"""Quarter turns of joints by their letters."""

DEAD_END = 2
"""The result for a joint if every letter causes an overlap."""


@by_pointer
class LatticeRules(NamedTuple):
    """The values of a scene that kernels use."""

    preloaded: bool  # all magnets act from the start
    pitch: float  # distance between a component's hinges [m]
    turn: int  # 1 in forward and −1 in backward feed
    tie: float  # energies [J] closer than this count as equal
    table: Floats  # `pose_table`
    strengths: Floats  # charge of every pole face, component 1 first, (n, 4)


class LatticeFeed:
    """The rules by which the minimiser folds chains of a tube scene, for any sequence and speeds.

    A scene with an external field raises an error, because energy minimisation ignores fields.
    """

    def __init__(self, scene: Scene) -> None:
        refuse_field(scene)
        self.scene = scene
        self.n = scene.n
        self.forward = scene.feed.direction == "forward"
        self.packed = LatticeRules(
            preloaded=scene.feed.loading == "preloaded",
            pitch=scene.casing.diagonal,
            turn=1 if self.forward else -1,
            tie=tie(scene),
            table=pose_table(couplings(scene), scene.n),
            strengths=np.ascontiguousarray(strengths(scene)),
        )

    @property
    def turn(self) -> int:
        """Sign of the feed direction: 1 for forward, −1 for backward."""
        return self.packed.turn

    def energy_of(self, turns: Ints, poles: Floats) -> float:
        """Return the energy [J] of the first ``len(turns) + 1`` rows in the shape `turns`."""
        return float(energy_of(turns, self.turn, self.packed.table, poles))

    def energy_as(self, word: str, signs: Floats, count: int) -> float:
        """Return the energy [J] of the first `count` components in the order of feed.

        The whole chain has the shape `word` and the outward poles `signs`, (n, 4), component 1
        first.
        """
        turns = np.array([TURNS[letter] for letter in word], dtype=np.int64)
        poles = signs * self.packed.strengths
        if not self.forward:
            turns, poles = turns[::-1], poles[::-1]
        acting = np.ascontiguousarray(turns[: max(count - 1, 0)])
        return self.energy_of(acting, np.ascontiguousarray(poles))


@lru_cache(maxsize=16)
def pose_table(table: Couplings, n: int) -> Floats:
    """Return the couplings of two components of a chain of `n` in every pose [J].

    The axes of the array, (4 n − 3, 4 n − 3, 4, 4, 4), are the cell of the second component as seen
    from the first (both coordinates shifted by 2 (n − 1)), its quarter turns, the face of the first
    and the face of the second. Entries for poses that no chain reaches are zero.
    """
    reach = 2 * (n - 1)
    span = np.arange(-reach, reach + 1)
    x, y, quarter = (axis.ravel() for axis in np.meshgrid(span, span, np.arange(4), indexing="ij"))
    # Steps from centre to centre have an even |dx| + |dy|, and so do their sums.
    possible = ((x + y) % 2 == 0) & (np.abs(x) + np.abs(y) <= reach) & ((x != 0) | (y != 0))
    out = np.zeros((len(x), FACES, FACES))
    out[possible] = table.at(np.column_stack([x, y, quarter])[possible])
    return out.reshape(len(span), len(span), 4, FACES, FACES)


@kernel
def step_x(quarter: int) -> int:
    """Return the x component of a heading given in quarter turns."""
    return (1 - quarter) if quarter % 2 == 0 else 0


@kernel
def step_y(quarter: int) -> int:
    """Return the y component of a heading given in quarter turns."""
    return (2 - quarter) if quarter % 2 == 1 else 0


@kernel
def pair_energy(i: int, j: int, table: Floats, poles: Floats, cells: Ints, quarters: Ints) -> float:
    """Return the magnetic energy of rows i and j [J]."""
    c, s = step_x(quarters[i]), step_y(quarters[i])
    dx, dy = cells[j, 0] - cells[i, 0], cells[j, 1] - cells[i, 1]
    reach = (table.shape[0] - 1) // 2
    x, y = c * dx + s * dy + reach, c * dy - s * dx + reach
    q = (quarters[j] - quarters[i]) % 4
    total = 0.0
    for a in range(4):
        field = 0.0
        for b in range(4):
            field += table[x, y, q, a, b] * poles[j, b]
        total += poles[i, a] * field
    return total


@kernel
def energy(acting: int, table: Floats, poles: Floats, cells: Ints, quarters: Ints) -> float:
    """Return the magnetic energy of the first ``acting`` rows [J], counting each pair once."""
    total = 0.0
    for j in range(acting):
        for i in range(j):
            total += pair_energy(i, j, table, poles, cells, quarters)
    return total


@kernel
def put(row: int, acting: int, turn: int, letter: int, cells: Ints, quarters: Ints) -> bool:
    """Place a row after a joint of ``letter`` quarter turns, and later rows in line with it.

    Returns True if nothing overlaps. Rows after the first overlap do not change.
    """
    for k in range(row, acting):
        before = quarters[k - 1]
        after = (before + turn * letter) % 4 if k == row else before
        quarters[k] = after
        cells[k, 0] = cells[k - 1, 0] + turn * (step_x(before) + step_x(after))
        cells[k, 1] = cells[k - 1, 1] + turn * (step_y(before) + step_y(after))
        for i in range(row):
            if cells[i, 0] == cells[k, 0] and cells[i, 1] == cells[k, 1]:
                return False
    return True


@kernel
def lay(
    row: int,
    acting: int,
    turn: int,
    tie: float,
    table: Floats,
    poles: Floats,
    cells: Ints,
    quarters: Ints,
) -> int:
    """Decide the joint before a row, place the row, and place the rows beyond it in line.

    Earlier rows do not move. Only the first ``acting`` rows, those with magnets, are placed:
    ``cells`` (n, 2) are in half hinge-to-hinge lengths, and ``quarters`` (n,) are headings in
    quarter turns. ``poles`` (n, 4) are charges in units of the strongest, N positive. Returns the
    joint's quarter turns: 0, 1 or −1 for S, L or R, or `DEAD_END` if every letter overlaps.
    """
    best, least = DEAD_END, np.inf
    for option in range(3):
        letter = option if option < 2 else -1
        if not put(row, acting, turn, letter, cells, quarters):
            continue
        # The energies within the earlier rows and within the rows from here on do not change.
        found = 0.0
        for k in range(row, acting):
            for i in range(row):
                found += pair_energy(i, k, table, poles, cells, quarters)
        if best == DEAD_END or found < least - tie:
            best, least = letter, found
    if best != DEAD_END:
        put(row, acting, turn, best, cells, quarters)
    return best


@kernel
def in_line(
    forward: bool, pitch: float, out: int, turns: Ints, angles: Floats, base: Floats
) -> None:
    """Write the headings (n,) [rad] and outer hinge of component 1 (2,) [m] of a chain in a tube.

    The first ``out`` components in the order of feed are out. The last of these is in line with the
    tube, with its trailing hinge at the mouth. ``turns`` (n − 1,) are the joints' quarter turns,
    and ``pitch`` is the distance between a component's hinges [m].
    """
    n = angles.size
    # Quarter turns are exact; sums of angles are not.
    quarter = 0
    for k in range(n):
        quarter += turns[k - 1] if k > 0 else 0
        angles[k] = quarter
    latest = max(out - 1, 0) if forward else n - max(out, 1)
    level = angles[latest] - (2.0 if forward else 0.0)
    base[0] = 0.0 if forward else -pitch * (n - out)
    base[1] = 0.0
    for k in range(n):
        angles[k] = (angles[k] - level) * 0.5 * np.pi
        if forward and k < out:
            # Released components are between component 1's outer hinge and the mouth.
            base[0] -= pitch * np.cos(angles[k])
            base[1] -= pitch * np.sin(angles[k])


@allocating_kernel
def energy_of(turns: Ints, turn: int, table: Floats, poles: Floats) -> float:
    """Return the energy [J]; see `LatticeFeed.energy_of`."""
    cells = np.zeros((turns.size + 1, 2), dtype=np.int64)
    quarters = np.zeros(turns.size + 1, dtype=np.int64)
    for k in range(turns.size):
        put(k + 1, k + 2, turn, turns[k], cells, quarters)
    return energy(turns.size + 1, table, poles, cells, quarters)


@allocating_kernel
def lay_many(
    row: int,
    before: Ints,
    turn: int,
    tie: float,
    table: Floats,
    poles: Floats,
    taken: Ints,
) -> None:
    """Decide the joint before a row for many chains that have the same shape up to that row.

    ``row`` is the last row with magnets. ``before`` (row − 1,) are the quarter turns of the earlier
    joints, and ``poles`` (m, n, 4) are the pole charges of each chain. The function writes the
    results of `lay` to ``taken`` (m,).
    """
    n = poles.shape[1]
    cells = np.zeros((n, 2), dtype=np.int64)
    quarters = np.zeros(n, dtype=np.int64)
    for k in range(before.size):
        put(k + 1, k + 2, turn, before[k], cells, quarters)
    for chain in range(poles.shape[0]):
        taken[chain] = lay(row, row + 1, turn, tie, table, poles[chain], cells, quarters)
