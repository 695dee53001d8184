"""How the cost of a chain's accelerations grows with its length, beside the peers in the same run.

All contenders find the accelerations of the same pinned chain under gravity and motors in its
hinges. They must agree before they are timed, and they take turns, so that a ratio compares
neighbours in time. Pinocchio is called from Python: what a call costs at n = 1, where there is
next to nothing to compute, is taken off its times at all other lengths; there it has a row of its
own.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from magfold_env.benchmarks.dynamics.chain_contenders import (
    BUILDS,
    LANES,
    LONGEST,
    MUJOCO,
    PINOCCHIO,
    SCALAR,
    Contender,
    missing,
)
from magfold_env.benchmarks.dynamics.chain_problem import random_problem
from magfold_env.engine.state import Array
from magfold_env.reporting.part import Part, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import Spread, Task, spread_of, take_turns

NAME = "scaling"
LENGTHS = (1, 2, 6, 20, 60, 200, 450, 1000, 3000, 10_000)
QUICK_LENGTHS = (1, 6, 60, 450)
# At these lengths: how many times faster than Pinocchio one chain must be.
PINOCCHIO_FACTORS = {6: 6.0, 60: 12.0, 450: 12.0}
LANES_AT, LANES_FACTOR = 6, 8.0
LONG, STEEPEST = 60, 1.1
AGREE = 1e-9  # of the largest acceleration, up to `LONG` components
OVERHEAD = "a call of Pinocchio"


def run(quick: bool, progress: Progress) -> Part:
    """Measure every contender at every length.

    Parameters
    ----------
    quick
        Fewer lengths and rounds.
    progress
        Is told the finished share and what is going on.

    Returns
    -------
    Part
        A row a contender and length; peers that are not installed have none, and a finding says
        that they are absent.

    Raises
    ------
    ArithmeticError
        If two contenders disagree about the accelerations.
    """
    lengths, rounds = (QUICK_LENGTHS, 5) if quick else (LENGTHS, 15)
    absent = missing()
    rows: list[Row] = []
    for k, n in enumerate(lengths):
        tick = begin_case(progress, k, len(lengths), f"n = {n}")
        rows += _measure(n, rounds, absent, tick)
    return Part(NAME, rows, _tables(rows), [*_findings(rows), *(f"{a} is absent" for a in absent)])


def _measure(n: int, rounds: int, absent: list[str], tick: Tick) -> list[Row]:
    """Rows of all contenders that can do n components."""
    names = [name for name in BUILDS if name not in absent and n <= LONGEST.get(name, n)]
    problem = random_problem(n)
    contenders = {name: BUILDS[name](problem) for name in names}
    apart = _differences(n, contenders)
    timed = dict(contenders)
    if PINOCCHIO in names:
        timed[OVERHEAD] = BUILDS[PINOCCHIO](random_problem(1))
    tasks: dict[str, Task] = {name: _task(each) for name, each in timed.items()}
    timings = take_turns(tasks, rounds, tick=tick)
    taken = {name: t.samples / timed[name].evaluations for name, t in timings.items()}
    if PINOCCHIO in names and n > 1:
        taken[PINOCCHIO] = taken[PINOCCHIO] - taken[OVERHEAD]
    shown = {PINOCCHIO: OVERHEAD} if n == 1 else {}
    return [
        _row(shown.get(name, name), n, taken[name], taken[SCALAR], apart[name]) for name in names
    ]


def _task(contender: Contender) -> Task:
    return lambda: contender.work


def _differences(n: int, contenders: Mapping[str, Contender]) -> dict[str, float]:
    """Largest differences from the scalar kernel, as shares of the largest acceleration."""
    expected = contenders[SCALAR].accelerations
    scale = float(np.abs(expected).max())
    # Mass matrices, which some contenders form, grow ill-conditioned with the length.
    bound = AGREE * max(1.0, n / LONG) ** 2
    apart: dict[str, float] = {}
    for name, contender in contenders.items():
        apart[name] = float(np.abs(contender.accelerations - expected).max()) / scale
        if not apart[name] <= bound:
            msg = f"n = {n}: {name} and {SCALAR} differ by {apart[name]:.1e}"
            raise ArithmeticError(msg)
    return apart


def _row(name: str, n: int, samples: Array, ours: Array, apart: float) -> Row:
    spread, ratio = spread_of(1e6 * samples), spread_of(samples / ours)
    return {
        "contender": name,
        "n": n,
        **spread.time_cells("µs"),
        "times one chain's": ratio.median,
        "lower quartile": ratio.low,
        "upper quartile": ratio.high,
        "difference": apart,
    }


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
