"""Do default settings end where a reference ends? Over many random scenes.

Run as ``python -m tests.laws.agreement --scenes 1000 --out runs/agreement``. A killed run goes on
where it was. Every scene that disagrees is saved as YAML: ``magfold fold FILE`` runs it again.

A scene that ends otherwise with a tolerance 20 times tighter belongs to one of three classes:

- *reference not converged*: with a tolerance 400 times tighter it ends in a third way, or as usual;
- *decided within tolerance*: a reference whose start is moved by the scene's own tolerance ends
  otherwise, too;
- *firm*: neither, so the default settings are wrong.
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

from magfold_bench.laws.outcomes import moved_starts
from magfold_bench.laws.random_scenes import random_scene
from magfold_bench.stress.kinds import KINDS, Source
from magfold_env.files import physics_digest
from magfold_env.parallel import Workers, finished
from magfold_env.reporting.intervals import share
from magfold_env.scene import Scene, save_scene
from tests.laws.outcomes import Outcome, reference_of

Row = dict[str, Any]

AGREES, UNCONVERGED, WITHIN, FIRM = VERDICTS = (
    "agree", "reference not converged", "decided within tolerance", "firm",
)  # fmt: skip
WANTED = {
    "without obstacles": 0.99,
    "with obstacles": 0.97,
}  # share of those that are not set aside
MUCH_TIGHTER = 400
PAIRS = 8  # of moved starts
KINDS_DRAWN = ("plain", "retraction", "obstacles", "tilted")
"""Kinds of scenes, drawn in turn: `random_scene`'s, and some of the stress test's."""


def scene_of(seed: int) -> Scene:
    """Return the scene of a number, with nothing left to draw."""
    number, kind = divmod(seed, len(KINDS_DRAWN))
    if kind == 0:
        return random_scene(number)
    rng = np.random.default_rng([number, kind])
    return KINDS[KINDS_DRAWN[kind]].make(Source(number, kind)).draw(rng)


def compare(seed: int) -> Row:
    """Simulate one random scene at default settings and as a reference, and judge.

    Two failures do not agree, and are never set aside.
    """
    scene = scene_of(seed)
    default, reference = Outcome.of(scene), Outcome.of(reference_of(scene))
    difference = default.difference(reference)
    if default.failed or reference.failed:
        # A start that is refused is no run.
        refused = default.steps == reference.steps == 0
        difference, verdict = ("", AGREES) if refused else ("failed", FIRM)
    else:
        verdict = verdict_on(scene, reference, seed) if difference else AGREES
    return {
        "seed": seed,
        "engine": physics_digest(),
        "kind": KINDS_DRAWN[seed % len(KINDS_DRAWN)],
        "n": scene.n,
        "mount": scene.mount,
        "friction": np.mean(scene.friction),
        "obstacles": len(scene.obstacles),
        "verdict": verdict,
        "difference": difference,
        "angle": default.angle_from(reference),
        "default": default._asdict(),
        "reference": reference._asdict(),
    }


def verdict_on(scene: Scene, reference: Outcome, seed: int) -> str:
    """Return the class of a scene that does not end as its reference."""
    if Outcome.of(reference_of(scene, MUCH_TIGHTER)).difference(reference):
        return UNCONVERGED
    rng, by = np.random.default_rng(seed), scene.solver.tolerance
    moved = moved_starts(scene, rng, by, PAIRS)
    if any(Outcome.of(reference_of(each)).difference(reference) for each in moved):
        return WITHIN
    return FIRM


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
    wanted = ", ".join(f"{share:.0%} {group}" for group, share in WANTED.items())
    table = Table(
        title="Default settings against the reference",
        caption=f"Share of those that agree or are firm that agree; wanted: {wanted}.",
    )
    for column in ("scenes", "in all", *VERDICTS, "share", "95 % interval"):
        table.add_column(column, justify="left" if column == "scenes" else "right")
    groups = {
        "all": rows,
        "without obstacles": [row for row in rows if not row["obstacles"]],
        "with obstacles": [row for row in rows if row["obstacles"]],
        **{kind: [row for row in rows if row["kind"] == kind] for kind in KINDS_DRAWN},
        "frictionless": [row for row in rows if row["friction"] == 0.0],
    }
    for name, group in groups.items():
        count = Counter(row["verdict"] for row in group)
        judged = count[AGREES] + count[FIRM]
        shown = ("--", "--")
        if judged:
            found = share(count[AGREES], judged)
            shown = (f"{found.rate:.2%}", f"{found.low:.2%} to {found.high:.2%}")
        table.add_row(name, str(len(group)), *(str(count[each]) for each in VERDICTS), *shown)
    return table


def disagreements(rows: Sequence[Row]) -> Table:
    """Return the scenes that do not end as their references."""
    table = Table(title="Scenes that differ")
    for column in ("seed", "class", "kind", "n", "mount", "differs in", "default", "reference"):
        table.add_column(column)
    for row in sorted(rows, key=lambda row: (row["verdict"], row["seed"])):
        if row["verdict"] != AGREES:
            ends = [f"{row[k]['word']} {row[k]['status']}" for k in ("default", "reference")]
            cells = (row[k] for k in ("seed", "verdict", "kind", "n", "mount", "difference"))
            table.add_row(*map(str, cells), *ends)
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
                save_scene(scene_of(row["seed"]), out / f"{kind}-{row['seed']}.yaml")
            file.write(json.dumps(row) + "\n")
            file.flush()
            rows.append(row)
    console = Console()
    for table in (summary(rows), disagreements(rows)):
        console.print(table)


if __name__ == "__main__":
    typer.run(main)
