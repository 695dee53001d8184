"""Compare the shipped sequences with the paper's text: ``python -m magfold_bench.paper.judge``.

Magnetic forces grow with the square of the remanence. In units of time proportional to 1/remanence,
two parameters therefore remain: friction divided by the remanence squared, and speed divided by the
remanence. All chains are released with a remanence of 1 T.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
import typer

from magfold_bench.laws.experiment import MODES, SEQUENCES, by_hand
from magfold_bench.paper.figure_18 import NEARLY, movement
from magfold_bench.paper.statements import CHAINS, ENERGIES, HOLDS, RELEASES, Released, clear
from magfold_bench.tables import Row
from magfold_env.cli import options
from magfold_env.designer.suites import load_suite
from magfold_env.ensembles.releases import Ensemble, ensemble
from magfold_env.minimiser import Mode, minimise
from magfold_env.reporting.tables import to_csv
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import mirror

LINE = "LRLRL"
"""The word of the paper's fold S2B, a straight line, or of its mirror image."""
GAP = 0.01
RUNS, SEED = 100, 1
CHAIN_WORDS, CHAIN_RUNS = 8, 4
STALLING = (0.3, 1.0, 1.4, 2.0, 3.0, 5.0)
"""Values of friction over remanence squared [1/T²] at which longer chains are released."""


class Point(NamedTuple):
    """The parameters of a release."""

    ratio: float
    """Friction divided by the square of the remanence [1/T²]."""
    speed: float
    """Feed speed divided by the remanence [m/(s T)]."""


SHIPPED = Point(0.35 / 0.6**2, 0.05 / 0.6)
POINTS = {
    "sequence-k": ("sequence", SHIPPED),
    "sequence-k-strong": ("sequence", Point(0.1 / 1.2**2, 0.05 / 1.2)),
    "alternative-k": ("alternative", Point(0.35 / 0.8**2, 0.32 / 0.8)),
}
"""Shipped sequences with their parameters; the first two are fed as in `experiment`."""


def scene_at(point: Point, mode: Mode) -> Scene:
    """Return the scene in which sequence 1 is released by hand with a point's parameters."""
    scene = load_scene("paper/sequence-1")
    scene = scene.replace(magnets={"remanence": 1.0}, friction=point.ratio)
    return by_hand(scene, mode, point.speed)


def sequence(name: str, number: int) -> tuple[str, ...]:
    """Return a shipped sequence, with all poles swapped if its first face is not N."""
    found = load_scene(f"paper/{name}-{number}").sequence
    swap = str.maketrans("NS", "SN")
    return found if found[0][0] == "N" else tuple(faces.translate(swap) for faces in found)


def energies(number: int, faces: tuple[str, ...]) -> tuple[dict[str, str], frozenset[str], Row]:
    """Return a sequence's named states, its stable words, and which statements on energies hold."""
    scene = load_scene("paper/sequence-1-literal").replace(sequence=faces)
    states = minimise(scene, top=26, among="folded").states
    stable = [state for state in states if state.stable]
    words = [state.word for state in stable]
    names = {f"S{number}{letter}": word for letter, word in zip("ABC", words, strict=False)}
    scores = [state.coulomb_score for state in stable[:3]]
    holds: Row = {}
    if number == 1:
        conflict = next(state for state in states if not state.stable)
        names["S1E"] = conflict.word
        moved = {word: movement(word) for word in words}
        held = (
            scores[1] < (1.0 - GAP) * scores[0],
            states[4].stable,
            conflict.conflicts == ((4, 5),),
            moved[names["S1C"]] <= NEARLY * min(moved.values()),
            LINE not in words and mirror(LINE) not in words,
        )
        holds = {name: float(each) for name, each in zip(ENERGIES[1], held, strict=True)}
    elif number == 2:
        holds = {"2 positive": float(min(scores) > 0.0)}
    return names, frozenset(words), holds


def degrees(name: str, point: Point) -> Row:
    """Return the degree to which sequences with a point's parameters meet each statement, by name.

    The draws differ from those with which the alternative sequences were selected.
    """
    found: Row = {}
    for number in SEQUENCES:
        faces = sequence(name, number)
        names, stable, holds = energies(number, faces)
        ends: dict[Mode, Ensemble] = {
            mode: ensemble(scene_at(point, mode).replace(sequence=faces), RUNS, SEED, workers=1)
            for mode in MODES
        }
        mine = Released(names, stable, ends)
        found |= holds | {each.name: each.degree(mine) for each in RELEASES[number]}
    return found | {said: clear(1.0 - folded(point, n)) for n, said in CHAINS.items()}


def folded(point: Point, n: int) -> float:
    """Return how often longer free chains fold on average; each has only one stable fold."""
    suite = load_suite(f"n{n}")
    found = [suite.words[word]["unique"].sequence for word in suite.words]
    scene = scene_at(Point(point.ratio, SHIPPED.speed), "free")
    chains = [scene.replace(sequence=each) for each in found if each is not None]
    made = [ensemble(chain, CHAIN_RUNS, workers=1) for chain in chains[:CHAIN_WORDS]]
    return float(np.mean([each.probability(status="folded").rate for each in made]))


def shipped() -> list[Row]:
    """Return the degree to which the shipped scenes meet each statement."""
    met = {name: degrees(*each) for name, each in POINTS.items()}
    said: dict[str, str] = {}
    for number in SEQUENCES:
        said |= ENERGIES[number] | {each.name: each.said for each in RELEASES[number]}
    said |= {text: text for text in CHAINS.values()}
    table: list[Row] = [
        {
            "statement": key,
            "said": text,
            **{name: round(float(each[key]), 3) for name, each in met.items()},
        }
        for key, text in said.items()
    ]
    last: Row = {"statement": f"more than {HOLDS:g}", "said": "number of statements met"}
    for name, each in met.items():
        last[name] = sum(float(degree) > HOLDS for degree in each.values())
    return [*table, last]


def chains() -> list[Row]:
    """Return how often longer chains and the shipped ones fold in free releases, by friction."""
    made: list[Row] = []
    for ratio in STALLING:
        point = Point(ratio, SHIPPED.speed)
        row: Row = {"µ/B_r² [1/T²]": ratio}
        row |= {f"{n} components": f"{100 * folded(point, n):.0f} %" for n in CHAINS}
        for k in SEQUENCES:
            scene = scene_at(point, "free").replace(sequence=sequence("sequence", k))
            word, share = next(iter(ensemble(scene, 32, workers=1).words.items()))
            row[f"sequence {k}"] = f"{word} {100 * share.rate:.0f} %"
        made.append(row)
    return made


def main(show: Annotated[Literal["shipped", "chains"], typer.Argument()] = "shipped") -> None:
    """Print how well shipped sequences meet the paper's text, or how longer chains fold, as CSV."""
    typer.echo(to_csv({"shipped": shipped, "chains": chains}[show]()), nl=False)


if __name__ == "__main__":
    options.application_of(main)()
