"""What of the text can be met at once: ``python -m magfold_bench.paper.search``, in a quarter hour.

Sequences that meet what is said of energies are released, over geometries, friction and speeds of
feed, few times each at first; what meets most is released more often (successive halving). All is
kept in a folder, so that a run that was stopped goes on.

Strength of magnets and friction are one number: a force of the magnets grows with the square of
the remanence, so that with time counted in units that shrink with the remanence only friction over
its square, and speed over it, are left. Everything is released at 1 T.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from itertools import product
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from rich.progress import Progress

from magfold_bench.laws.experiment import ANGLE, MODES, SPREADS
from magfold_bench.paper.candidates import Candidate, Candidates
from magfold_bench.paper.statements import CHAINS, ENERGIES, HOLDS, RELEASES, Released, clear
from magfold_env.designer.suites import load_suite
from magfold_env.ensembles.releases import Ensemble, release, released
from magfold_env.files import write_text
from magfold_env.minimiser import Mode
from magfold_env.parallel import Workers
from magfold_env.reporting.tables import Row, to_csv
from magfold_env.scene import Scene, load_scene

NUMBERS = (1, 2, 3)


class Point(NamedTuple):
    """What a chain is released with."""

    side: float
    """[m]"""
    inset: float
    """[m]"""
    ratio: float
    """Friction over the square of the remanence [1/T²]."""
    speed: float
    """Speed of feed over the remanence [m/(s T)]."""


SHIPPED = Point(0.0125, 0.0005, 0.35 / 0.6**2, 0.05 / 0.6)
"""`paper/sequence-k`, fed as in `laws.experiment`."""
STRONG = Point(0.0125, 0.0005, 0.1 / 1.2**2, 0.05 / 1.2)
"""`paper/sequence-k-strong`, fed as in `laws.experiment`."""
ALTERNATIVE = Point(0.0125, 0.0005, 0.35 / 0.8**2, 0.32 / 0.8)
"""`paper/alternative-k`, with its own speed of feed."""

GEOMETRIES = ((0.0125, 0.0005), (0.015, 0.0005))
RATIOS = (0.05, 0.2, 0.7, 1.3)
SPEEDS = (0.08, 0.25)
AROUND: dict[int, tuple[float, ...]] = {2: (0.6, 1.0, 1.6), 3: (0.8, 1.0, 1.25)}
"""Factors of friction and of speed that are tried around what is best, by round."""


class Round(NamedTuple):
    """How much is released at a time."""

    points: int
    """The best of those before."""
    candidates: int
    """Of each sequence at each point, the best of those before."""
    runs: int
    """Releases in each mode."""


FIRST = Round(0, 200, 2)
ROUNDS = (Round(6, 16, 6), Round(3, 4, 12), Round(2, 4, 16), Round(3, 3, 100))
SEED = 1
"""Of the draws that shipped sequences are judged by; the search has 0."""
CHAIN_WORDS, CHAIN_RUNS = 8, 4
STALLING = (0.3, 1.0, 1.4, 2.0, 3.0, 5.0)
"""Friction over the square of the remanence at which longer chains are looked at [1/T²]."""


class Met(NamedTuple):
    """To which degree a sequence, or what is longer, meets each statement."""

    degrees: Mapping[str, float]
    """By name."""

    @property
    def holding(self) -> int:
        """How many hold."""
        return sum(degree > HOLDS for degree in self.degrees.values())

    @property
    def total(self) -> float:
        """The sum of all degrees, which few releases tell better than how many hold."""
        return sum(self.degrees.values())


Entry = tuple[Point, Candidate]
Tell = Callable[[int, int], object]


def scene_at(point: Point, mode: Mode) -> Scene:
    """Return what is released at a point, with sequence 1, as by hand."""
    scene = load_scene("paper/sequence-1").replace(
        casing={"side": point.side},
        magnets={"inset": point.inset, "remanence": 1.0},
        friction=point.ratio,
        spreads=SPREADS,
        start_angle_spread=ANGLE,
    )
    return release(scene, mode, point.speed)


@cache
def candidates(side: float, inset: float, number: int) -> list[Candidate]:
    """Return the sequences of a geometry that may be one of the paper's, today's first.

    Then come those that meet more of what is said of energies; equal ones are shuffled.
    """
    literal = load_scene("paper/sequence-1-literal")
    changed = literal.replace(casing={"side": side}, magnets={"inset": inset})
    found = Candidates(changed)(number)
    order: list[int] = np.random.default_rng(0).permutation(len(found)).tolist()
    order.sort(key=lambda k: (found[k].sequence != today(number), -sum(found[k].energies.values())))
    return [found[k] for k in order]


def today(number: int, name: str = "sequence") -> tuple[str, ...]:
    """Return a shipped sequence, or it with all poles swapped, so that the first face is N."""
    sequence = load_scene(f"paper/{name}-{number}").sequence
    swap = str.maketrans("NS", "SN")
    return sequence if sequence[0][0] == "N" else tuple(c.translate(swap) for c in sequence)


def judge(
    entries: Sequence[Entry], runs: int, state: Path | None, tell: Tell, seed: int = 0
) -> list[Met]:
    """Release sequences at their points in all modes, and judge them."""
    bases = {(point, mode): scene_at(point, mode) for point, _ in entries for mode in MODES}
    scenes = [
        bases[point, mode].replace(sequence=each.sequence)
        for point, each in entries
        for mode in MODES
    ]
    made = _released(scenes, runs, state, tell, seed)
    found: list[Met] = []
    for k, (_, each) in enumerate(entries):
        ends = dict(zip(MODES, made[len(MODES) * k :], strict=False))
        mine = Released(each.names, each.stable, ends)
        degrees = {name: float(holds) for name, holds in each.energies.items()}
        degrees |= {s.name: s.degree(mine) for s in RELEASES[each.number]}
        found.append(Met(degrees))
    return found


def chains(points: Iterable[Point], state: Path | None, tell: Tell) -> dict[Point, Met]:
    """Release longer chains free, each designed to have one stable fold, and judge them."""
    places = list(dict.fromkeys(point._replace(speed=SHIPPED.speed) for point in points))
    degrees: dict[Point, dict[str, float]] = {place: {} for place in places}
    for n, said in CHAINS.items():
        sequences = designs(n)
        scenes = [scene_at(p, "free").replace(sequence=s) for p in places for s in sequences]
        made = _released(scenes, CHAIN_RUNS, None if state is None else state / f"n{n}", tell)
        for k, place in enumerate(places):
            mine = made[k * len(sequences) : (k + 1) * len(sequences)]
            folded = np.mean([each.probability(status="folded").rate for each in mine])
            degrees[place][said] = clear(1.0 - float(folded))
    return {point: Met(degrees[point._replace(speed=SHIPPED.speed)]) for point in points}


def designs(n: int) -> list[tuple[str, ...]]:
    """Return sequences of n components, each with one stable fold."""
    suite = load_suite(f"n{n}")
    found = (suite.words[word]["unique"].sequence for word in suite.words)
    return [sequence for sequence in found if sequence is not None][:CHAIN_WORDS]


def _released(
    scenes: list[Scene], runs: int, state: Path | None, tell: Tell, seed: int = 0
) -> list[Ensemble]:
    text = json.dumps([scene.model_dump(mode="json") for scene in scenes])
    key = {"kind": "paper search", "scenes": hashlib.sha256(text.encode()).hexdigest()}
    return released(scenes, runs, seed, Workers(1), key, state, tell)


class Found(NamedTuple):
    """What meets most at a point."""

    point: Point
    best: dict[int, tuple[Candidate, Met]]
    """By sequence."""
    longer: Met

    @property
    def parts(self) -> list[Met]:
        """What is judged."""
        return [*(met for _, met in self.best.values()), self.longer]

    @property
    def holding(self) -> int:
        """How many statements hold."""
        return sum(met.holding for met in self.parts)

    @property
    def total(self) -> float:
        """The sum of all degrees."""
        return sum(met.total for met in self.parts)


Scores = dict[tuple[Point, int], list[tuple[Candidate, Met]]]


def best_points(scores: Scores, longer: Mapping[Point, Met]) -> list[Found]:
    """Return what is best at each point."""
    made: list[Found] = []
    for point in dict.fromkeys(point for point, _ in scores):
        best = {number: scores[point, number][0] for number in NUMBERS}
        made.append(Found(point, best, longer[point]))
    return made


def search(state: Path, progress: Progress) -> list[list[Found]]:
    """Return what is best at each point, the best points first, for each round."""
    places = [Point(*size, *ways) for size in GEOMETRIES for ways in product(RATIOS, SPEEDS)]
    entries: list[Entry] = [
        (point, each)
        for point in places
        for number in NUMBERS
        for each in candidates(point.side, point.inset, number)[: FIRST.candidates]
    ]
    found, scores = _round(0, entries, FIRST.runs, state, progress)
    rounds = [found]
    for k, step in enumerate(ROUNDS, start=1):
        entries = []
        for each in found[: step.points]:
            for number in NUMBERS:
                kept = scores[each.point, number][: step.candidates]
                near = product(_near(each.point, AROUND.get(k, (1.0,))), kept)
                entries += [(point, candidate) for point, (candidate, _) in near]
        # Points around different ones may be the same.
        entries = list({(p, c.number, c.sequence): (p, c) for p, c in entries}.values())
        found, scores = _round(k, entries, step.runs, state, progress)
        rounds.append(found)
    return rounds


def _near(point: Point, factors: Sequence[float]) -> list[Point]:
    """Return the points around one, and it."""
    changed = product(factors, factors)
    return [point._replace(ratio=point.ratio * a, speed=point.speed * b) for a, b in changed]


def _round(
    number: int, entries: list[Entry], runs: int, state: Path, progress: Progress
) -> tuple[list[Found], Scores]:
    bar = progress.add_task(f"round {number}", total=None)
    folder = state / f"round-{number}"

    def tell(made: int, total: int) -> None:
        progress.update(bar, completed=made, total=total)

    met = judge(entries, runs, folder, tell)
    longer = chains([point for point, _ in entries], folder, tell)
    scores: Scores = defaultdict(list)
    for (point, candidate), each in zip(entries, met, strict=True):
        scores[point, candidate.number].append((candidate, each))
    last = number == len(ROUNDS)

    def rank(each: Met | Found) -> tuple[float, float]:
        return (each.holding, each.total) if last else (each.total, each.holding)

    for each in scores.values():
        each.sort(key=lambda pair: rank(pair[1]), reverse=True)
    return sorted(best_points(scores, longer), key=rank, reverse=True), scores


def of_shipped(point: Point, name: str = "sequence") -> Found:
    """Judge shipped sequences at a point, as often as in the last round, but by other draws.

    What was chosen for the draws of the search is better with those than with any others.
    """
    mine = [
        next(c for c in candidates(point.side, point.inset, k) if c.sequence == today(k, name))
        for k in NUMBERS
    ]
    met = judge([(point, each) for each in mine], ROUNDS[-1].runs, None, _quiet, SEED)
    best = {each.number: (each, its) for each, its in zip(mine, met, strict=True)}
    return Found(point, best, chains([point], None, _quiet)[point])


def shipped() -> dict[str, Found]:
    """Judge all shipped sequences with what they are shipped with."""
    return {
        "sequence-k": of_shipped(SHIPPED),
        "sequence-k-strong": of_shipped(STRONG),
        "alternative-k": of_shipped(ALTERNATIVE, "alternative"),
    }


def compared() -> list[Row]:
    """Return to which degree the shipped scenes meet each statement."""
    rows = {name: record(found)["degrees"] for name, found in shipped().items()}
    table: list[Row] = [
        {"statement": key, "said": text, **{name: each[key] for name, each in rows.items()}}
        for key, text in said().items()
    ]
    met: Row = {"statement": f"more than {HOLDS:g}", "said": "how many are met"}
    for name, each in rows.items():
        met[name] = sum(degree > HOLDS for degree in each.values())
    return [*table, met]


def _quiet(made: int, total: int) -> None:
    """Tell nothing."""


def said() -> dict[str, str]:
    """Return all statements that are judged, in our words, by name."""
    made: dict[str, str] = {}
    for number in NUMBERS:
        made |= ENERGIES[number]
        made |= {each.name: each.said for each in RELEASES[number]}
    return made | {text: text for text in CHAINS.values()}


def record(found: Found) -> dict[str, Any]:
    """Return what is best at a point as values that JSON can hold."""
    degrees = {name: round(d, 3) for met in found.parts for name, d in met.degrees.items()}
    return {
        "point": found.point._asdict(),
        "sequences": {k: " ".join(each.sequence) for k, (each, _) in found.best.items()},
        "names": {k: each.names for k, (each, _) in found.best.items()},
        "meets": found.holding,
        "of": len(degrees),
        "degrees": degrees,
        "gives": [name for name, d in degrees.items() if d <= HOLDS],
    }


def stalling() -> list[Row]:
    """Return what is folded, released free, over friction: longer chains, and shipped sequences."""
    made: list[Row] = []
    for ratio in STALLING:
        point = SHIPPED._replace(ratio=ratio)
        row: Row = {"µ/B_r² [1/T²]": ratio}
        for n in CHAINS:
            longer = [scene_at(point, "free").replace(sequence=each) for each in designs(n)]
            found = _released(longer, CHAIN_RUNS, None, _quiet)
            folded = np.mean([each.probability(status="folded").rate for each in found])
            row[f"{n} components"] = f"{100 * folded:.0f} %"
        base = scene_at(point, "free")
        shipped = [base.replace(sequence=today(k)) for k in NUMBERS]
        for k, each in zip(NUMBERS, _released(shipped, 32, None, _quiet), strict=True):
            word, share = next(iter(each.words.items()))
            row[f"sequence {k}"] = f"{word} {100 * share.rate:.0f} %"
        made.append(row)
    return made


def counted() -> list[Row]:
    """Return how many sequences meet what is said of energies, with the shipped geometry."""
    made: list[Row] = []
    for number in NUMBERS:
        found = candidates(SHIPPED.side, SHIPPED.inset, number)
        named = ENERGIES[number]
        made.append({"sequence": number, "meets": "table 1 and figure 7", "count": len(found)})
        for name, text in named.items():
            count = sum(each.energies[name] for each in found)
            made.append({"sequence": number, "meets": text, "count": count})
        count = sum(all(each.energies.values()) for each in found)
        made.append({"sequence": number, "meets": "all", "count": count})
    return made


TABLES: dict[str, Callable[[], list[Row]]] = {
    "chains": stalling,
    "candidates": counted,
    "shipped": compared,
}


def main(
    *,
    show: Annotated[
        str | None,
        typer.Option(help=f"Search nothing, show one of {', '.join(TABLES)}."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder; a killed run goes on in it.")] = Path(
        "runs/paper-search"
    ),
) -> None:
    """Search, and write what is best and what today's sequences meet to a file."""
    if show is not None:
        if show not in TABLES:
            raise typer.BadParameter(f"{show!r} is not allowed; must be one of {', '.join(TABLES)}")
        typer.echo(to_csv(TABLES[show]()), nl=False)
        return
    with Progress() as progress:
        rounds = search(out / "state", progress)
        rows = {name: record(found) for name, found in shipped().items()}
    rows |= {f"best {k}": record(each) for k, each in enumerate(rounds[-1], start=1)}
    summary = [[record(each) for each in found] for found in rounds]
    text = json.dumps({"statements": said(), "found": rows, "rounds": summary}, indent=1)
    write_text(out / "search.json", text + "\n")
    for name, row in rows.items():
        typer.echo(f"{name}: {row['meets']} of {row['of']}; gives {', '.join(row['gives'])}")
        typer.echo(f"  {row['point']} {row['sequences']}")


if __name__ == "__main__":
    typer.run(main)
