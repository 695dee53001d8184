"""What there is to see of an episode; `magfold_env.render.snapshot` draws it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from magfold_env.envs.tasks.forecast import Forecast

if TYPE_CHECKING:
    from magfold_env.envs.episodes import Episodes
    from magfold_env.render.snapshot import Snapshot

Rows = list[tuple[str, str]]


def chain_moment(
    episodes: Episodes[Any], row: int, target: str, found: Forecast | None, **shown: Any
) -> Snapshot:
    """Return what a picture shows of a chain.

    Parameters
    ----------
    episodes : Episodes
        The episodes.
    row : int
        Which of them.
    target : str
        The wanted word.
    found : Forecast or None
        What energy minimisation says of it.
    **shown
        What else the picture shows, by the names of `magfold_env.render.snapshot.Snapshot`.
    """
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    arrays = episodes.arrays
    return Snapshot(
        scene=episodes.scene(row),
        angles=arrays.angles[row].copy(),
        base=arrays.base[row].copy(),
        released=int(arrays.released[row].sum()),
        target=target,
        held=episodes.chains.held(row),
        predicted=None if found is None else found.word,
        **shown,
    )


def energy_rows(energy: float, found: Forecast | None) -> Rows:
    """Return what is said of energies [J]: the chain's, and what is predicted and wanted."""
    rows: Rows = [("energy", or_dash(energy, "mJ"))]
    if found is not None:
        stuck = ", stuck" if found.is_stuck else ""
        rows.append(("as predicted", or_dash(found.energy, "mJ") + stuck))
        rows.append(("as the target", or_dash(found.target_energy, "mJ")))
    return rows


def or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit; a dash for no number."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"
