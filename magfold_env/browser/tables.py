"""The largest table of magnetic interactions, which a web page computes with the engine's kernels.

The table takes a megabyte, which compression does not reduce, and a page computes it in 0.2 s. The
tables of joint angles are a quarter of that size and would take 0.35 s, so they are stored, like
small data such as the knots and matrices of `simulation.far_table`. Tests compare every bit.
"""

from typing import NamedTuple

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, IntArray, Magnets, Tables
from magfold_env.simulation.banded import solve_banded
from magfold_env.simulation.far_table import fill, filter_rows


@by_pointer
class FarKit(NamedTuple):
    """The data from which the table of interactions of distant casings is computed."""

    magnets: Magnets
    far: Array  # distances at which few nodes suffice [m]
    near: Array  # the other distances [m]
    few: Array  # offsets and weights of the nodes of a face, (2, count)
    many: Array
    far_values: Array  # energies at far distances, (distances, turns, turns)
    near_values: Array
    values: Array  # energies at all distances, (radial·turns, turns)
    turned: Array  # scratch of the same size
    band: Array  # matrix of the radial splines, overwritten, (radial + 2, 9)
    right: Array  # scratch, (radial + 2, turns·turns); its first and last rows are zero
    heading: IntArray  # directions of the table's columns, (turns + 12,)


@kernel
def make_far_table(kit: FarKit, tables: Tables) -> None:
    """Fill in the table of interactions of distant casings; see `build_far_table`."""
    soft, soften = tables.far.soft, tables.far.soften
    fill(kit.magnets, kit.far, soft, soften, kit.few[0], kit.few[1], kit.far_values)
    fill(kit.magnets, kit.near, soft, soften, kit.many[0], kit.many[1], kit.near_values)
    turns = kit.values.shape[1]
    radial = kit.values.shape[0] // turns
    turn(kit.values, kit.turned)
    filter_rows(kit.turned)
    turn(kit.turned, kit.values)
    filter_rows(kit.values)
    for d in range(radial):
        for b in range(turns):
            for e in range(turns):
                kit.right[d + 1, turns * b + e] = kit.values[turns * d + b, e]
    solve_banded(kit.band, kit.right)
    out = tables.far.energy
    for d in range(radial + 2):
        for b in range(turns + 3):
            before = (b + turns - 1) % turns
            for e in range(kit.heading.size):
                out[d, b, e] = kit.right[d, turns * before + kit.heading[e]]


@kernel
def turn(values: Array, out: Array) -> None:
    """Swap the last two axes of ``values``, whose shape is (radial·turns, turns), into ``out``."""
    turns = values.shape[1]
    for d in range(values.shape[0] // turns):
        for b in range(turns):
            for e in range(turns):
                out[turns * d + e, b] = values[turns * d + b, e]
