"""Allocate the kernels' data."""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, TypeVar, get_args, get_type_hints

import numpy as np

from magfold_env.engine import indices as ix
from magfold_env.engine import state as arrays
from magfold_env.engine.chain import recursion
from magfold_env.engine.magnets import multipole_tree, multipoles, near_table
from magfold_env.engine.state import Array
from magfold_env.engine.stepping import bumps
from magfold_env.engine.stepping.stages import STAGES

# Constraints use dense matrices; longer chains cannot have contact or friction.
MOST_CONSTRAINED = 500
# One base-3 integer stores the stops between the ends of a rigid part.
MOST_SPANS = 39
# Number of pairs of casings with stored table cells; pairs of longer chains share slots.
MOST_STENCILS = 144

T = TypeVar("T", bound=tuple[Any, ...])


def zeros(kind: type[T], sizes: Mapping[str, int], **given: Any) -> T:
    """Return a NamedTuple of zeroed arrays with the shapes in its fields' annotations.

    Parameters
    ----------
    kind
        Class of the NamedTuple; inner NamedTuples are created too.
    sizes
        Sizes of the named dimensions.
    given
        Values of fields that are not zeroed.
    """
    values: list[Any] = []
    for name, field, shape in _layout(kind):
        if name in given:
            values.append(given[name])
        elif isinstance(field, type):
            values.append(zeros(field, sizes))
        else:
            size = [each if isinstance(each, int) else sizes[each] for each in shape]
            values.append(np.zeros(size, dtype=field))
    return kind(*values)


@lru_cache(maxsize=64)
def _layout(kind: type[Any]) -> list[tuple[str, Any, tuple[str | int, ...]]]:
    """Return each field's name, number type or NamedTuple class, and shape."""
    found: list[tuple[str, Any, tuple[str | int, ...]]] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        shape = getattr(hint, "__metadata__", ())
        dtype = np.dtype(get_args(get_args(hint.__origin__)[1])[0]) if shape else hint
        found.append((name, dtype, shape))
    return found


def new_state(model: arrays.Model, angles: Array) -> arrays.State:
    """Return a chain at rest with the given headings (n,) and its inner end at the origin.

    If there is a tube, the whole chain is inside it, and its outer tip is at the mouth.
    """
    n = model.n
    state = zeros(arrays.State, {"n": n, "n + 2": n + 2})
    state.q[:n] = angles
    state.clock[ix.BRAKE] = math.inf
    state.clock[ix.STEP] = 0.1 / model.fastest_rate
    state.clock[ix.END] = math.inf if model.tube else model.duration
    state.counter[ix.KEEP] = -1
    state.counter[ix.N_HELD] = n if model.tube else 0
    state.counter[ix.FRESH] = 1
    state.waiting[:] = model.charge
    bumps.begin(model, state)
    return state


def new_work(model: arrays.Model) -> arrays.Work:
    """Return the scratch space for one chain."""
    n = model.n
    rows = 1
    if model.contact or model.frictional:
        if n > MOST_CONSTRAINED:
            msg = (
                f"sequence: {n} components are too many with contact or friction; "
                f"at most {MOST_CONSTRAINED} (without both: any number)"
            )
            raise ValueError(msg)
        rows = 6 * n + 16
    sizes = {
        "n": n,
        "n + 2": n + 2,
        "boxes": n + len(model.obstacles),
        "rows": rows,
        "stages": STAGES,
        "sweep": recursion.ROWS,
    }
    newton = zeros(arrays.Newton, sizes) if rows > 1 else NO_NEWTON
    return zeros(
        arrays.Work,
        sizes,
        nodes=new_nodes(model.magnets, n) if model.magnetic else NO_NODES,
        rigid=new_rigid(model.magnets, n) if model.magnetic else NO_RIGID,
        friction=zeros(arrays.Friction, sizes, newton=newton),
    )


def new_nodes(magnets: arrays.Magnets | None, n: int) -> arrays.Nodes:
    """Return the scratch space for the sums over n casings."""
    ranks = most = lanes = 1
    if magnets is not None:
        ranks, most = magnets.rank_count.size, 8 * int(magnets.rank_count.max())
        # Sums over levels need space too.
        lanes = max(most, magnets.level_node.shape[1])
    levels = 1 + (n - 1).bit_length() if n >= multipole_tree.LONG else 1
    rows = [-(-n // 2**level) for level in range(levels)]
    sizes = {
        "n": n,
        "ranks": ranks,
        "nodes a casing": most,
        "lanes": lanes,
        "spline": near_table.SPLINES,
        "slots": min(n * n, MOST_STENCILS),
        "rows": sum(rows),
        "terms": multipoles.MOST,
        "depth": 4 * levels,
        "batch": multipole_tree.BATCH if levels > 1 else max(n * (n - 1) // 2, 1),
    }
    start = np.cumsum([0, *rows[:-1]], dtype=np.int64)
    return zeros(arrays.Nodes, sizes, segments=zeros(arrays.Segments, sizes, start=start))


def new_rigid(magnets: arrays.Magnets | None, n: int) -> arrays.Rigid:
    """Return the scratch space for the forces of rigidly joined pairs, with nothing stored yet."""
    sizes = {"n": n, "spans": max(min(n - 1, MOST_SPANS), 1)}
    pose = zeros(arrays.Pose, {"n": 2})
    return zeros(arrays.Rigid, sizes, pose=pose, nodes=new_nodes(magnets, 2))


# Placeholders for chains without magnets, or without contact and friction.
NO_NODES = new_nodes(None, 1)
NO_RIGID = new_rigid(None, 1)
NO_NEWTON = zeros(arrays.Newton, {"n + 2": 3, "rows": 1})


def new_record(model: arrays.Model, interval: float, capacity: int) -> arrays.Record:
    """Allocate ``capacity`` frames, one every ``interval`` seconds; 0 records nothing."""
    sizes = {"n + 2": model.n + 2, "capacity": capacity}
    return zeros(arrays.Record, sizes, interval=interval)
