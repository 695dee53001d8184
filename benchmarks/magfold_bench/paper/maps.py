"""Shares of what the paper's sequences end in, over friction and speed of feed.

How strong magnets are and how much friction there is are one number. A force of the magnets grows
with the square of the remanence B_r, friction with µ. Time counted in units that shrink with B_r
leaves of the equation of motion µ/B_r² alone, and of a feed its speed over B_r: what a chain ends
in depends on both and on neither of the three by itself. Everything here is released at 1 T.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from magfold_bench.laws.experiment import paper_scene
from magfold_bench.paper import states
from magfold_bench.paper.quoted import SEQUENCES
from magfold_bench.paper.reproduction import Plot
from magfold_env.ensembles.sweeps import Sweep, sweep
from magfold_env.fold import FoldStatus
from magfold_env.minimiser import Mode
from magfold_env.reporting.tables import Progress, Row, Table, distinct, each_case, select
from magfold_env.shapes import FloatArray

RATIO, SPEED = "µ/B_r² [1/T²]", "v/B_r [m/(s T)]"
FED: tuple[Mode, ...] = ("forward", "backward")
MISFOLDED, OTHER = "no full fold", "other folds"

RATIOS = (0.03, 0.07, 0.15, 0.3, 0.6, 1.0, 2.0)
SPEEDS = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
RUNS = 24
QUICK_RATIOS, QUICK_SPEEDS, QUICK_RUNS = (0.07, 1.0), (0.08, 0.32), 4

NAMED = {1: ("S1A", "S1B", "S1C"), 2: ("S2A", "S2B", "S2C"), 3: ("S3A",)}


@cache
def swept(number: int, mode: Mode, quick: bool) -> Sweep:
    """Release a sequence at every point; a chain that is not fed, over friction alone."""
    scene = paper_scene(number, mode).replace(magnets={"remanence": 1.0})
    over: dict[str, Sequence[float]] = {"friction": QUICK_RATIOS if quick else RATIOS}
    if mode != "free":
        over["feed.speed"] = QUICK_SPEEDS if quick else SPEEDS
    return sweep(scene, over, QUICK_RUNS if quick else RUNS)


def rows(number: int, mode: Mode, quick: bool) -> list[Row]:
    """Return the share of each named state, of other folds and of none, at every point."""
    made = swept(number, mode, quick)
    folded = np.array([share.rate for share in made.probability(status=FoldStatus.FOLDED)])
    shares: dict[str, FloatArray] = {}
    for name in NAMED[number]:
        found = made.probability(states.word_of(name), FoldStatus.FOLDED)
        shares[name] = np.array([share.rate for share in found])
    shares[OTHER] = np.maximum(folded - sum(shares.values()), 0.0)  # not -0.0 by rounding
    shares[MISFOLDED] = 1.0 - folded
    return [
        {
            "sequence": number,
            "mode": mode,
            RATIO: point["friction"],
            SPEED: point.get("feed.speed", 0.0),
            "ends in": name,
            "share": round(float(share[k]), 6),
        }
        for k, point in enumerate(made.points)
        for name, share in shares.items()
    ]


def measure(quick: bool, progress: Progress) -> list[Row]:
    """Return the rows of all sequences in all modes."""
    modes: tuple[Mode, ...] = ("free", *FED)
    cases: list[tuple[int, Mode]] = [(number, mode) for number in SEQUENCES for mode in modes]
    found: list[Row] = []
    for (number, mode), _ in each_case(progress, cases, _named):
        found += rows(number, mode, quick)
    return found


def _named(case: tuple[int, Mode]) -> str:
    return f"map of sequence {case[0]}, {case[1]}"


def best_table(found: list[Row]) -> Table:
    """Return where on its map each named state is most frequent."""
    shown: list[Row] = []
    for number in distinct(found, "sequence"):
        for mode in distinct(select(found, sequence=number), "mode"):
            mine = select(found, sequence=number, mode=mode)
            for name in distinct(mine, "ends in"):
                here = select(mine, **{"ends in": name})
                best = max(here, key=lambda row: float(row["share"]))
                line: Row = {"sequence": str(number), "mode": str(mode), "ends in": str(name)}
                line["least"] = _per_cent(min(float(row["share"]) for row in here))
                line["most"] = _per_cent(float(best["share"]))
                occurs = float(best["share"]) > 0.0
                line[f"at {RATIO}"] = f"{best[RATIO]:g}" if occurs else "none"
                line[f"and {SPEED}"] = f"{best[SPEED]:g}" if occurs and mode != "free" else "none"
                shown.append(line)
    return Table("The maps in short: least and largest share, and where the largest is", shown)


def _per_cent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def plots(found: list[Row], name: str) -> list[Plot]:
    """Draw a picture of maps a sequence, and one of releases without a tube."""
    made: list[Plot] = []
    for number in distinct(found, "sequence"):
        mine = select(found, sequence=number)
        fed = [row for row in mine if row["mode"] in FED]
        if fed:
            caption = (
                f"Sequence {number} fed out of a tube: shares in per cent over speed and friction. "
                f"The device as given is near {0.35 / 0.36:.2f} and {0.05 / 0.6:.2f}, that with "
                f"strong magnets near {0.1 / 1.44:.2f} and {0.05 / 1.2:.2f}."
            )
            made.append(Plot.of(f"{name}-maps-{number}", _maps(fed), caption))
    if free := select(found, mode="free"):
        made.append(Plot.of(f"{name}-free", _lines(free), "Released without a tube."))
    return made


def _maps(fed: list[Row]) -> object:
    from magfold_env.render.sweeps import map_chart  # noqa: PLC0415 - an extra

    x, y = ([float(value) for value in distinct(fed, key)] for key in (SPEED, RATIO))
    rates: dict[str, FloatArray] = {}
    ends = distinct(fed, "ends in")
    for mode in FED:
        for end in ends:
            mine = select(fed, {"ends in": end}, mode=mode)
            share = np.array([float(row["share"]) for row in mine])
            rates[f"{mode}: {end}"] = share.reshape(len(y), len(x))
    title = f"sequence {fed[0]['sequence']}"
    return map_chart(rates, (SPEED, x), (RATIO, y), title, columns=len(ends))


def _lines(free: list[Row]) -> object:
    from magfold_env.reporting.plotting import INK, curve, legend_below, panels  # noqa: PLC0415

    shown = distinct(free, "sequence")
    figure, axes = panels(len(shown), "free", width=4.2, height=3.4)
    for axis, number in zip(axes, shown, strict=True):
        mine = select(free, sequence=number)
        for k, end in enumerate(distinct(mine, "ends in")):
            style = {OTHER: 3, MISFOLDED: 4}.get(end, k)
            curve(axis, select(mine, {"ends in": end}), RATIO, "share", style, label=str(end))
        axis.set_yscale("linear")
        axis.set_title(f"sequence {number}", fontsize=10, color=INK)
        axis.set_xlabel(RATIO, color=INK)
        axis.set_ylabel("share", color=INK)
    legend_below(figure, *axes)
    return figure
