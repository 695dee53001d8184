"""The content of a picture: the chain, its energies and the prediction of the minimiser."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from magfold_env.envs.chains.arrays import ChainArrays
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.chains.quasistatic import predict
from magfold_env.envs.episodes import Episodes, Lines

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot


@dataclass(frozen=True)
class Forecast:
    """The fold that the minimiser reaches joint by joint, at the scene's nominal strengths.

    Attributes
    ----------
    word : str
        The fold word so far, with the joints of unfed components straight.
    energy : float
        Magnetic energy of the fed components [J].
    target_energy : float
        Their energy in the shape of the target.
    is_stuck : bool
        Whether every letter of a joint overlaps.
    """

    word: str
    energy: float
    target_energy: float
    is_stuck: bool


def forecast(rules: LatticeFeed, arrays: ChainArrays, row: int, target: str) -> Forecast:
    """Return the prediction of `rules` for the components of a chain fed so far.

    Parameters
    ----------
    rules : LatticeFeed
        The rules of the scene.
    arrays : ChainArrays
        The chains.
    row : int
        Index of the chain.
    target : str
        The wanted fold word.
    """
    signs, fed = arrays.signs[row], int(arrays.fed[row])
    order = list(arrays.order(row))
    acting = len(order) if rules.packed.built else fed
    found = predict(rules, signs[order[:acting]])
    return Forecast(
        found.word,
        rules.energy_as(found.word, signs, fed),
        rules.energy_as(target, signs, fed),
        found.is_stuck,
    )


def forecast_of(episodes: Episodes[Any], row: int) -> Forecast | None:
    """Return the forecast of an episode's chain.

    None if there is no forecast: before a component has magnets, in an external field, and with
    ``fidelity="quasistatic"``.
    """
    world = episodes.world
    if episodes.arrays.fed[row] == 0 or world.in_field or world.fidelity == "quasistatic":
        return None
    return forecast(episodes.lattice(row), episodes.arrays, row, episodes.goals.names[row])


def snapshot_of(episodes: Episodes[Any], row: int) -> "Snapshot":
    """Return the content of a picture of an episode."""
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    one, arrays = episodes.rows[row : row + 1], episodes.arrays
    found, is_loaded = forecast_of(episodes, row), bool(arrays.fed[row] > 0)
    title, wanted, done = episodes.caption(row)
    lines: Lines = [("word", episodes.words(one)[0]), *wanted]
    if is_loaded:
        lines += energy_lines(float(episodes.chains.energies(one)[0]), found)
    lines += done
    message = ""
    if episodes.terminated[row]:
        ends = {key: column[0] for key, column in episodes.final_infos(one).items()}
        title, message = ends["status"], ends["message"]
        lines.append(("score", f"{ends['score']:.2f}"))
        if not ends.get("baseline_flagged", True):
            lines.append(("baseline", f"{ends['baseline']:.2f}"))
    return Snapshot(
        scene=episodes.scene(row),
        angles=arrays.angles[row].copy(),
        base=arrays.base[row].copy(),
        released=int(arrays.released[row].sum()),
        target=episodes.goals.names[row],
        held=episodes.chains.held(row),
        chosen=episodes.chosen(row),
        title=title,
        message=message,
        rows=tuple(lines),
        predicted=None if found is None else found.word,
        is_loaded=is_loaded,
    )


def energy_lines(energy: float, found: Forecast | None) -> Lines:
    """Return the energies [J] as text: the chain's, the predicted one and the target's."""
    lines = [("energy", or_dash(energy, "mJ"))]
    if found is not None:
        stuck = ", stuck" if found.is_stuck else ""
        lines.append(("as predicted", or_dash(found.energy, "mJ") + stuck))
        lines.append(("as the target", or_dash(found.target_energy, "mJ")))
    return lines


def or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit, or a dash for NaN."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"
