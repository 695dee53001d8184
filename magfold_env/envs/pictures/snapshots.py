"""The content of a picture: the chain, its energies and the prediction of the minimiser."""

import math
from typing import TYPE_CHECKING, Any

from magfold_env.envs.chains.quasistatic import predict
from magfold_env.envs.episodes import Episodes, Lines

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot


def snapshot_of(episodes: Episodes[Any], row: int) -> "Snapshot":
    """Return the content of a picture of an episode.

    The prediction is the fold that the minimiser reaches joint by joint, at the scene's nominal
    strengths. There is none before a component has magnets, in an external field, and with
    ``fidelity="quasistatic"``.
    """
    from magfold_env.render.snapshot import Snapshot  # noqa: PLC0415 - needs the extra

    one, arrays = episodes.rows[row : row + 1], episodes.arrays
    world, signs, fed = episodes.world, arrays.signs[row], int(arrays.fed[row])
    title, wanted, done = episodes.caption(row)
    lines: Lines = [("word", episodes.words(one)[0]), *wanted]
    if fed:
        lines.append(("energy", or_dash(float(episodes.chains.energies(one)[0]), "mJ")))
    found = None
    if fed and not world.in_field and world.fidelity != "quasistatic":
        rules, order = episodes.lattice(row), list(arrays.order(row))
        found = predict(rules, signs[order[: len(order) if rules.packed.preloaded else fed]])
        energy, wanted = (
            rules.energy_as(word, signs, fed) for word in (found.word, episodes.goals.names[row])
        )
        stuck = ", stuck" if found.is_stuck else ""
        lines.append(("as predicted", or_dash(energy, "mJ") + stuck))
        lines.append(("as the target", or_dash(wanted, "mJ")))
    lines += done
    message = ""
    if episodes.terminated[row]:
        ends = {key: column[0] for key, column in episodes.final_infos(one).items()}
        title, message = ends["status"], ends["message"]
        lines.append(("score", f"{ends['score']:.2f}"))
        if not ends.get("baseline_missing", True):
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
        is_loaded=fed > 0,
    )


def or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit, or a dash for NaN."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"
