"""What energy minimisation says of a chain, to be shown beside what happens."""

import math
from dataclasses import dataclass

from magfold_env.envs.chains.arrays import ChainArrays
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.chains.quasistatic import predict


@dataclass(frozen=True)
class Forecast:
    """The fold that the minimiser reaches joint by joint, at the scene's nominal strengths.

    Attributes
    ----------
    word : str
        As far as components are fed; straight from there on.
    energy : float
        Magnetic energy of those components [J].
    target_energy : float
        The same if they lay as the target wants them.
    is_stuck : bool
        Whether every letter of a joint overlaps.
    """

    word: str
    energy: float
    target_energy: float
    is_stuck: bool


def forecast(rules: LatticeFeed, arrays: ChainArrays, row: int, target: str) -> Forecast:
    """Return what `rules` make of the components of a chain that are fed so far.

    Parameters
    ----------
    rules : LatticeFeed
        Those of the scene.
    arrays : ChainArrays
        The chains.
    row : int
        Which of them.
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


def energy_lines(energy: float, found: Forecast | None) -> list[tuple[str, str]]:
    """Return what is to be read of energies [J]: the chain's, and what is predicted and wanted."""
    lines = [("energy", or_dash(energy, "mJ"))]
    if found is not None:
        stuck = ", stuck" if found.is_stuck else ""
        lines.append(("as predicted", or_dash(found.energy, "mJ") + stuck))
        lines.append(("as the target", or_dash(found.target_energy, "mJ")))
    return lines


def or_dash(value: float, unit: str) -> str:
    """Return a value in thousandths of its SI unit; a dash for no number."""
    return f"{1e3 * value:.2f} {unit}" if math.isfinite(value) else "–"
