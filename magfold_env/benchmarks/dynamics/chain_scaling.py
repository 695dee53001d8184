"""How the cost of a chain's accelerations grows with its length beside the peers."""

from __future__ import annotations

import numpy as np

from magfold_env.laws.pinned_chain import LANES, LONG, MUJOCO, PINOCCHIO, SCALAR, measure, missing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Spread

NAME = "scaling"
# At these lengths: how many times faster than Pinocchio one chain must be.
PINOCCHIO_FACTORS = {6: 6.0, 60: 12.0, 450: 12.0}
LANES_AT, LANES_FACTOR = 6, 8.0
STEEPEST = 1.1


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender at every length, as `pinned_chain.measure` does.

    Peers that are not installed have no rows, and a finding says that they are absent.
    """
    rows = measure(quick, progress)
    absent = [f"{name} is absent" for name in missing()]
    return Measurement(NAME, rows, _tables(rows), [*_findings(rows), *absent])


def slope(rows: list[Row], name: str) -> float:
    """Log-log slope of the time against n from `LONG` on, by least squares; nan if too few."""
    chosen = [r for r in rows if r["contender"] == name and float(r["n"]) >= LONG]
    if len(chosen) < 2:
        return float("nan")
    n, time = (np.log([float(r[key]) for r in chosen]) for key in ("n", "time [µs]"))
    return float(np.polyfit(n, time, 1)[0])


def _tables(rows: list[Row]) -> list[Table]:
    """Return the times, a row a length and a column a contender."""
    names = list(dict.fromkeys(str(row["contender"]) for row in rows))
    lengths = list(dict.fromkeys(int(row["n"]) for row in rows))
    cells = {(row["contender"], row["n"]): row for row in rows}
    times: list[Row] = []
    for n in lengths:
        line: Row = {"n": n}
        for name in names:
            found = cells.get((name, n))
            line[name] = "" if found is None else f"{float(found['time [µs]']):.3g}"
        times.append(line)
    return [Table("Accelerations of a pinned chain: µs an evaluation and chain", times)]


def _findings(rows: list[Row]) -> list[str]:
    """Say what must hold and what was found."""
    found: list[str] = []
    for n, factor in PINOCCHIO_FACTORS.items():
        found += [
            f"n = {n}: {_ratio(row)} times faster than Pinocchio; at least {factor} is asked for: "
            f"{_verdict(_ratio(row).median >= factor)}"
            for row in _at(rows, PINOCCHIO, n)
        ]
    for row in _at(rows, LANES, LANES_AT):
        inverse = Spread(*(1.0 / float(row[key]) for key in _QUARTILES))
        found.append(
            f"n = {LANES_AT}: in lanes {inverse} times faster than one chain after the other; at "
            f"least {LANES_FACTOR} is asked for: {_verdict(inverse.median >= LANES_FACTOR)}"
        )
    steps = [float(r["times one chain's"]) for r in rows if r["contender"] == MUJOCO]
    if steps:
        found.append(f"at least {min(steps):.3g} times faster than a MuJoCo step at all lengths")
    # The rows of many long chains outgrow the processor's cache: nothing is asked of their slope.
    for name in (SCALAR, LANES):
        steepness = slope(rows, name)
        if np.isfinite(steepness):
            said = f"{name}: the time grows like n to the {steepness:.3f} from n = {LONG} on"
            if name == SCALAR:
                held = _verdict(steepness <= STEEPEST)
                said += f"; at most {STEEPEST} is asked for: {held}"
            found.append(said)
    return found


def _verdict(held: bool) -> str:
    return "holds" if held else "FAILS"


def _at(rows: list[Row], name: str, n: int) -> list[Row]:
    return [row for row in rows if row["contender"] == name and row["n"] == n]


# A reciprocal turns the quartiles around.
_QUARTILES = ("times one chain's", "upper quartile", "lower quartile")


def _ratio(row: Row) -> Spread:
    return Spread(
        float(row["times one chain's"]), float(row["lower quartile"]), float(row["upper quartile"])
    )
