"""The magnets' tables, made by the kernels that make them elsewhere.

They are a megabyte that no compression makes smaller, and take a fraction of a second to make. What
takes none to keep, such as knots and matrices, is found by `simulation.pair_tables` and
`simulation.far_table` when memory is packed; tests compare every bit of the tables.
"""

from typing import NamedTuple

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.lookup import PAIRS
from magfold_env.engine.state import Array, IntArray, Magnets, Nodes, Tables
from magfold_env.simulation.banded import solve_banded
from magfold_env.simulation.far_table import fill, filter_rows
from magfold_env.simulation.pair_tables import face_energies


@by_pointer
class JointKit(NamedTuple):
    """What the tables of joints' angles are made of."""

    magnets: Magnets  # whose nodes energies are summed over
    nodes: Nodes
    pitch: float  # distance of a casing's hinges [m]
    one: Array  # joint angles of the sites, (m, 1) [rad]
    two: Array  # (k·k, 2)
    one_band: Array  # matrices of the splines, (m, 7), used up
    two_band: Array  # (k, 7)
    band: Array  # scratch, as long
    values: Array  # scratch, (k·k, PAIRS)
    row: Array  # the same numbers, (k, k·PAIRS)


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
def make_joint_tables(kit: JointKit, tables: Tables) -> None:
    """Fill in the tables of neighbours and of components two apart, see `build_tables`."""
    face_energies(kit.magnets, kit.pitch, kit.one, kit.nodes, tables.one)
    solve_banded(kit.one_band, tables.one)
    face_energies(kit.magnets, kit.pitch, kit.two, kit.nodes, kit.values)
    for i in range(kit.two_band.shape[0]):
        for j in range(kit.two_band.shape[1]):
            kit.band[i, j] = kit.two_band[i, j]
    solve_banded(kit.band, kit.row)
    swap(kit.row, tables.two)
    solve_banded(kit.two_band, tables.two)
    swap(tables.two, kit.row)
    for i in range(kit.row.shape[0]):
        for j in range(kit.row.shape[1]):
            tables.two[i, j] = kit.row[i, j]


@kernel
def swap(values: Array, out: Array) -> None:
    """Exchange the first two axes of values (k, k·PAIRS)."""
    k = values.shape[0]
    for i in range(k):
        for j in range(k):
            for p in range(PAIRS):
                out[j, PAIRS * i + p] = values[i, PAIRS * j + p]


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
