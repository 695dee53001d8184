"""The content of a picture: the chain, its energies and the prediction of the minimiser."""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from magfold_env.envs.chains.quasistatic import predict
from magfold_env.envs.episodes import Episodes, Lines

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot


class Forecast(NamedTuple):
    """The fold that the minimiser reaches joint by joint, at the scene's nominal strengths."""

    word: str  # as far as components are fed; straight from there on
    energy: float  # magnetic energy of those components [J]
    target_energy: float  # the same if they lay as the target wants them
    is_stuck: bool  # whether every letter of a joint overlaps


def forecast_of(episodes: Episodes[Any], row: int) -> Forecast | None:
    """Return the forecast of an episode's chain.

    None if there is no forecast: before a component has magnets, in an external field, and with
    ``fidelity="quasistatic"``.
    """
    world, arrays = episodes.world, episodes.arrays
    signs, fed = arrays.signs[row], int(arrays.fed[row])
    if fed == 0 or world.in_field or world.fidelity == "quasistatic":
        return None
    rules, order = episodes.lattice(row), list(arrays.order(row))
    found = predict(rules, signs[order[: len(order) if rules.packed.preloaded else fed]])
    energy = rules.energy_as(found.word, signs, fed)
    wanted = rules.energy_as(episodes.goals.names[row], signs, fed)
    return Forecast(found.word, energy, wanted, found.is_stuck)


def snapshot_of(episodes: Episodes[Any], row: int) -> "Snapshot":
    """Return the content of a picture of an episode."""
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    one, arrays = episodes.rows[row : row + 1], episodes.arrays
    found, is_loaded = forecast_of(episodes, row), bool(arrays.fed[row] > 0)
    title, wanted, done = episodes.caption(row)
    lines: Lines = [("word", episodes.words(one)[0]), *wanted]
    if is_loaded:
        lines.append(("energy", or_dash(float(episodes.chains.energies(one)[0]), "mJ")))
    if found is not None:
        stuck = ", stuck" if found.is_stuck else ""
        lines.append(("as predicted", or_dash(found.energy, "mJ") + stuck))
        lines.append(("as the target", or_dash(found.target_energy, "mJ")))
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


def or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit, or a dash for NaN."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"
