"""How the cost of a chain's accelerations grows with its length, beside the peers."""

from __future__ import annotations

import math

from magfold_env.laws.pinned_chain import LANES, LONG, MUJOCO, PINOCCHIO, SCALAR, measure, missing
from magfold_env.reporting import tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table

# At these lengths: how many times faster than Pinocchio one chain must be.
PINOCCHIO_FACTORS = {6: 6.0, 60: 12.0, 450: 12.0}
LANES_AT, LANES_FACTOR = 6, 8.0
STEEPEST = 1.1
QUARTILES = ("times one chain's", "lower quartile", "upper quartile")


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender at every length, as `pinned_chain.measure` does.

    Peers that are not installed have no rows, and a finding says that they are absent.
    """
    rows = measure(quick, progress)
    absent = [f"{name} is absent" for name in missing()]
    return Measurement(rows, [_table(rows)], [*_findings(rows), *absent])


def _table(rows: list[Row]) -> Table:
    """Return the times, a row a length and a column a contender."""
    times: list[Row] = []
    for n in tables.distinct(rows, "n"):
        line: Row = {"n": n}
        for name in tables.distinct(rows, "contender"):
            found = tables.select(rows, contender=name, n=n)
            line[name] = f"{float(found[0]['time [µs]']):.3g}" if found else ""
        times.append(line)
    return Table("Accelerations of a pinned chain: µs an evaluation and chain", times)


def _findings(rows: list[Row]) -> list[str]:
    """Say what must hold and what was found."""
    found: list[str] = []
    for n, factor in PINOCCHIO_FACTORS.items():
        for row in tables.select(rows, contender=PINOCCHIO, n=n):
            times = timing.Spread(*(float(row[key]) for key in QUARTILES))
            found.append(
                f"n = {n}: {times} times faster than Pinocchio; at least {factor} is asked for: "
                f"{tables.verdict(times.median >= factor)}"
            )
    for row in tables.select(rows, contender=LANES, n=LANES_AT):
        middle, low, high = (1.0 / float(row[key]) for key in QUARTILES)
        times = timing.Spread(middle, high, low)  # a reciprocal turns the quartiles around
        found.append(
            f"n = {LANES_AT}: in lanes {times} times faster than one chain after the other; at "
            f"least {LANES_FACTOR} is asked for: {tables.verdict(times.median >= LANES_FACTOR)}"
        )
    steps = tables.numbers(tables.select(rows, contender=MUJOCO), "times one chain's")
    if steps.size:
        found.append(f"at least {steps.min():.3g} times faster than a MuJoCo step at all lengths")
    # The rows of many long chains outgrow the processor's cache: nothing is asked of their slope.
    for name in (SCALAR, LANES):
        slope = tables.growth(tables.select(rows, contender=name), LONG)
        if math.isfinite(slope):
            said = f"{name}: the time grows like n to the {slope:.3f} from n = {LONG} on"
            if name == SCALAR:
                said += f"; at most {STEEPEST} is asked for: {tables.verdict(slope <= STEEPEST)}"
            found.append(said)
    return found
