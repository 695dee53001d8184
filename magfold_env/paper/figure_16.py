"""Figure 16: computing time against the number of components."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from magfold_env.laws import pinned_chain
from magfold_env.laws.pinned_chain import DENSE, SCALAR, missing
from magfold_env.paper.quoted import LONG_POWER, LONGEST, NEAR_LINEAR, NEAR_LINEAR_UP_TO
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.reporting.page import Picture
from magfold_env.reporting.plotting import save_figure
from magfold_env.reporting.tables import Progress, Row, Table

NEAR = 0.25
"""Powers of n that differ by less than this agree."""
SHORTEST = 6
"""Components of the chain from which growth is judged: below, a call costs more than its work."""
TIME = "time [µs]"


def measure(quick: bool, progress: Progress) -> Measured:
    """Time the accelerations of a pinned chain: `magfold bench dynamics --only scaling`."""
    rows = pinned_chain.measure(quick, progress)
    return {"times": rows, "absent": [{"peer": name} for name in missing()]}


def tables(measured: Measured) -> list[Table]:
    """Return a row a length and a column a contender."""
    rows = measured["times"]
    contenders = list(dict.fromkeys(str(row["contender"]) for row in rows))
    shown: list[Row] = []
    for n in dict.fromkeys(int(row["n"]) for row in rows):
        line: Row = {"n": str(n)}
        for name in contenders:
            found = select(rows, contender=name, n=n)
            line[name] = found[0][TIME] if found else ""
        shown.append(line)
    title = "Accelerations of one chain [µs], as many ms for 1000 time steps"
    return [Table(title, shown)]


def claims(measured: Measured) -> list[Claim]:
    """Compare how the times grow, and the dense method with the recursion."""
    rows = measured["times"]
    up_to, beyond = (NEAR_LINEAR_UP_TO, LONGEST)
    short, long = power(rows, DENSE, SHORTEST, up_to), power(rows, DENSE, up_to, beyond)
    whole, ours = power(rows, DENSE, SHORTEST, beyond), power(rows, SCALAR, up_to, beyond)
    times = {
        n: float(row["times one chain's"])
        for n in (SHORTEST, up_to, beyond)
        for row in select(rows, contender=DENSE, n=n)
    }
    listed = ", ".join(f"{ratio:.0f} times at n = {n}" for n, ratio in times.items())
    return [
        Claim(
            f"up to about {up_to} components the time grows nearly linearly.",
            f"the same method's grows like n to the {short:.2f} from {SHORTEST} to {up_to}.",
            abs(short - NEAR_LINEAR) < NEAR,
            "So few numbers cost less than the calls that work on them.",
        ),
        Claim(
            f"up to {beyond} components it grows about like n to the {LONG_POWER:g}.",
            f"fitted to all lengths from {SHORTEST} to {beyond} it grows like n to the "
            f"{whole:.2f}, fitted from {up_to} on like n to the {long:.2f}.",
            abs(whole - LONG_POWER) < NEAR,
            "To fill a dense matrix takes n² operations and to solve with it n³, so the power "
            "grows with the length, and a fit depends on where it begins; the paper does not say "
            "where.",
        ),
        Claim(
            "the vectorised equation speeds the computation up; recursion, component by "
            "component, is the known efficient way.",
            f"the recursion in compiled code grows like n to the {ours:.2f} from {up_to} to "
            f"{beyond}, and the dense equation in NumPy takes {listed} its time.",
            None,
            "The paper gives no times of other methods.",
        ),
    ]


def power(rows: list[Row], name: str, low: int, high: int) -> float:
    """Return with which power of n a contender's time grows between two lengths."""
    mine = [row for row in select(rows, contender=name) if low <= int(row["n"]) <= high]
    n, time = (np.log([float(row[key]) for row in mine]) for key in ("n", TIME))
    return float(np.polyfit(n, time, 1)[0])


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw the times as the benchmark does."""
    path = folder / "figure-16.png"
    save_figure(pinned_chain.draw(measured["times"]), path)
    absent = ", ".join(str(row["peer"]) for row in measured["absent"])
    return [
        Picture(
            path,
            "Time of one chain's accelerations; 1 µs is 1 ms for the 1000 time steps that the "
            "paper times." + (f" Not installed, so not measured: {absent}." if absent else ""),
        )
    ]


REPRODUCTION = Reproduction(
    "figure-16",
    "Figure 16: computing time against the number of components",
    shows="The time of 1000 time steps of a pendulum of n components, by equation 39 in NumPy, up "
    f"to {NEAR_LINEAR_UP_TO} and up to {LONGEST} components, on a processor of twelve cores. "
    f"Stated: nearly linear, then about n to the {LONG_POWER:g}.",
    computed="The accelerations of one pinned chain, which is what a time step consists of: "
    "equation 39 as a dense system in NumPy, this project's recursion for one chain and for many, "
    "and two engines of others (Pinocchio, MuJoCo) where they are installed. All must agree before "
    "they are timed; they take turns.",
    missing="The paper's own code and processor: only how times grow is compared, not how long "
    "they are.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
