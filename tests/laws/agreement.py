"""Do default settings end where a reference ends? Over many random scenes.

Run as ``python -m tests.laws.agreement --scenes 1000 --out
runs/agreement``. A killed run goes on where it was. Every scene that disagrees is saved as YAML:
``magfold fold FILE`` runs it again.
"""

import json
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from magfold_env.files import physics_digest
from magfold_env.laws.outcomes import moved_starts
from magfold_env.laws.random_scenes import is_designed, random_scene
from magfold_env.parallel import Workers, finished
from magfold_env.reporting.intervals import share
from magfold_env.scene import save_scene
from tests.laws.outcomes import Outcome, reference_of

Row = dict[str, Any]

AGREES, DIFFERS, SET_ASIDE = "agrees", "differs", "set aside"
WANTED = 0.99  # share of the scenes that are not set aside


def compare(seed: int) -> Row:
    """Simulate one random scene at default settings and as a reference, and judge.

    Only if they differ is the reference's start moved, until a moved one ends elsewhere too. Two
    failures do not agree, and are never set aside.
    """
    scene = random_scene(seed)
    default, reference = Outcome.of(scene), Outcome.of(reference_of(scene))
    difference, verdict, moves = default.difference(reference), AGREES, 0
    if default.failed or reference.failed:
        difference, verdict = "failed", DIFFERS
    elif difference:
        verdict = DIFFERS
        for moved in moved_starts(scene, np.random.default_rng(seed)):
            moves += 1
            if Outcome.of(reference_of(moved)).difference(reference):
                verdict = SET_ASIDE
                break
    return {
        "seed": seed,
        "engine": physics_digest(),
        "n": scene.n,
        "mount": scene.mount,
        "speed": float(scene.speeds[0]) if scene.mount == "tube" else None,
        "friction": scene.friction,
        "designed": is_designed(seed),
        "verdict": verdict,
        "difference": difference,
        "angle": default.angle_from(reference),
        "moves": moves,
        "default": default._asdict(),
        "reference": reference._asdict(),
    }


def read_rows(path: Path) -> list[Row]:
    """Return the rows that were written, by the present engine only.

    A line that a kill cut short is left out.
    """
    if not path.is_file():
        return []
    engine, rows = physics_digest(), list[Row]()
    for line in path.read_text(encoding="utf-8").splitlines():
        with suppress(json.JSONDecodeError):
            row = json.loads(line)
            if row["engine"] == engine:
                rows.append(row)
    return rows


def summary(rows: Sequence[Row]) -> Table:
    """Return how many scenes agree, in all and by group."""
    table = Table(
        title="Default settings against the reference",
        caption=f"Share of the scenes that are not set aside; wanted: {WANTED:.0%}.",
    )
    for column in ("scenes", "in all", AGREES, DIFFERS, SET_ASIDE, "share", "95 % interval"):
        table.add_column(column, justify="left" if column == "scenes" else "right")
    groups = {
        "all": rows,
        "designed to fold": [row for row in rows if row["designed"]],
        "random": [row for row in rows if not row["designed"]],
        **{mount: [r for r in rows if r["mount"] == mount] for mount in ("pinned", "free", "tube")},
        "frictionless": [row for row in rows if row["friction"] == 0.0],
        "folded in the reference": [r for r in rows if r["reference"]["status"] == "folded"],
    }
    for name, group in groups.items():
        count = Counter(row["verdict"] for row in group)
        judged = count[AGREES] + count[DIFFERS]
        counts = [str(count[verdict]) for verdict in (AGREES, DIFFERS, SET_ASIDE)]
        shown = ("--", "--")
        if judged:
            found = share(count[AGREES], judged)
            shown = (f"{found.rate:.2%}", f"{found.low:.2%} to {found.high:.2%}")
        table.add_row(name, str(len(group)), *counts, *shown)
    return table


def disagreements(rows: Sequence[Row]) -> Table:
    """Return the scenes that differ although their references are firm."""
    table = Table(title="Scenes that differ")
    for column in ("seed", "n", "mount", "friction", "differs in", "angle", "default", "reference"):
        table.add_column(column)
    for row in sorted(rows, key=lambda row: (row["difference"], row["seed"])):
        if row["verdict"] == DIFFERS:
            ends = [f"{row[k]['word']} {row[k]['status']}" for k in ("default", "reference")]
            cells = (row["seed"], row["n"], row["mount"], f"{row['friction']:.3f}")
            angle = f"{row['angle']:.3f}"
            table.add_row(*map(str, cells), row["difference"], angle, *ends)
    return table


def main(
    scenes: Annotated[int, typer.Option(min=1, help="Random scenes.")] = 1000,
    first: Annotated[int, typer.Option(min=0, help="Seed of the first.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("runs/agreement"),
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
) -> None:
    """Compare, go on where an earlier run ended, and print what was found."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / "rows.jsonl"
    wanted = range(first, first + scenes)
    rows = [row for row in read_rows(path) if row["seed"] in wanted]
    done = {row["seed"] for row in rows}
    left = [seed for seed in wanted if seed not in done]
    with path.open("a", encoding="utf-8") as file:
        # Ends a line that a kill cut short; empty lines do not count.
        file.write("\n")
        results = finished(compare, left, Workers(workers, "processes"))
        for _, row in track(results, "comparing", total=len(left)):
            if row["verdict"] != AGREES:
                kind = row["verdict"].replace(" ", "-")
                save_scene(random_scene(row["seed"]), out / f"{kind}-{row['seed']}.yaml")
            file.write(json.dumps(row) + "\n")
            file.flush()
            rows.append(row)
    console = Console()
    for table in (summary(rows), disagreements(rows)):
        console.print(table)


if __name__ == "__main__":
    typer.run(main)
