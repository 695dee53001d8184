"""The largest of the magnets' tables, made by the kernels that make it elsewhere.

It is a megabyte that no compression makes smaller, and takes a page 0.2 s to make. The tables of
joints' angles are a quarter of that, take 0.35 s, and are kept as they are. So is what takes no
room, such as knots and matrices, as `simulation.far_table` has them; tests compare every bit.
"""

from typing import NamedTuple

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, IntArray, Magnets, Tables
from magfold_env.simulation.banded import solve_banded
from magfold_env.simulation.far_table import fill, filter_rows


@by_pointer
class FarKit(NamedTuple):
    """What the table of casings farther apart is made of."""

    magnets: Magnets
    far: Array  # distances at which few nodes do [m]
    near: Array  # and others
    few: Array  # offsets and weights of the nodes of a face, (2, count)
    many: Array
    far_values: Array  # energies there, (distances, turns, turns)
    near_values: Array
    values: Array  # both, (radial·turns, turns)
    turned: Array  # scratch, as long
    band: Array  # matrix of the radial splines, used up, (radial + 2, 9)
    right: Array  # scratch, (radial + 2, turns·turns); its first and last row are zeros
    heading: IntArray  # which directions the table's columns are, (turns + 12,)


@kernel
def make_far_table(kit: FarKit, tables: Tables) -> None:
    """Fill in the table of casings farther apart, see `build_far_table`."""
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
    """Exchange the last two axes of values (…·turns, turns)."""
    turns = values.shape[1]
    for d in range(values.shape[0] // turns):
        for b in range(turns):
            for e in range(turns):
                out[turns * d + e, b] = values[turns * d + b, e]
