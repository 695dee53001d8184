"""Compare how random scenes end with the default settings and with those of a reference.

Run as ``python -m magfold_bench.stress.agreement --scenes 1000 --out runs/agreement``. An
interrupted run continues if it is started again. Every scene that disagrees is saved as YAML;
``magfold fold FILE`` runs it again.

A scene that ends differently with a 20 times tighter tolerance belongs to one of three classes:

- *reference not converged*: with a 400 times tighter tolerance, it ends differently again;
- *decided within tolerance*: a reference whose start is moved by the scene's tolerance also ends
differently;
- *firm*: neither applies, so the default settings give a wrong end.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import track

from magfold_bench.laws.outcomes import difference, moved_starts, reference_of
from magfold_bench.laws.random_scenes import random_scene
from magfold_bench.stress.kinds import KINDS, Source
from magfold_bench.tables import Table, rich_table
from magfold_env.checkpoint import Checkpoint
from magfold_env.cli import options
from magfold_env.files import physics_digest
from magfold_env.fold import Fold, FoldStatus
from magfold_env.parallel import Workers, finished
from magfold_env.reporting.intervals import share
from magfold_env.scene import Scene, save_scene
from magfold_env.simulation.simulate import simulate

Row = dict[str, Any]

AGREES, UNCONVERGED, WITHIN, FIRM = VERDICTS = (
    "agree", "reference not converged", "decided within tolerance", "firm",
)  # fmt: skip
WANTED = {
    "without obstacles": 0.99,
    "with obstacles": 0.97,
}  # required share of agreement among scenes that are not set aside
MUCH_TIGHTER = 400
PAIRS = 8  # of moved starts
KINDS_DRAWN = ("plain", "retraction", "obstacles", "tilted")
"""Kinds of scenes, drawn in turn: `random_scene`'s, and some kinds of the stress test."""


def scene_of(seed: int) -> Scene:
    """Return the concrete scene for a seed."""
    number, kind = divmod(seed, len(KINDS_DRAWN))
    if kind == 0:
        return random_scene(number)
    rng = np.random.default_rng([number, kind])
    return KINDS[KINDS_DRAWN[kind]].make(Source(number, kind)).draw(rng)


def compare(seed: int) -> Row:
    """Simulate one random scene with default settings and as a reference, and judge the ends.

    Failed runs count as firm, unless the start is refused, which counts as agreement.
    """
    scene = scene_of(seed)
    default, reference = simulate(scene), simulate(reference_of(scene))
    differs = difference(default, reference)
    if FoldStatus.FAILED in (default.status, reference.status):
        # A refused start does not count as a run.
        refused = default.steps == reference.steps == 0
        differs, verdict = ("", AGREES) if refused else ("failed", FIRM)
    else:
        verdict = verdict_on(scene, reference, seed) if differs else AGREES
    return {
        "seed": seed,
        "kind": KINDS_DRAWN[seed % len(KINDS_DRAWN)],
        "friction": float(np.mean(scene.friction)),
        "obstacles": len(scene.obstacles),
        "verdict": verdict,
        "difference": differs,
        "ends": [f"{fold.word} {fold.status}" for fold in (default, reference)],
    }


def verdict_on(scene: Scene, reference: Fold, seed: int) -> str:
    """Return the class of a scene that ends differently from its reference."""
    if difference(simulate(reference_of(scene, MUCH_TIGHTER)), reference):
        return UNCONVERGED
    rng, by = np.random.default_rng(seed), scene.solver.tolerance
    moved = moved_starts(scene, rng, by, PAIRS)
    if any(difference(simulate(reference_of(each)), reference) for each in moved):
        return WITHIN
    return FIRM


def table_of(rows: Sequence[Row]) -> Table:
    """Return the numbers of scenes by verdict, for all scenes and by group."""
    groups = {
        "all": rows,
        "without obstacles": [row for row in rows if not row["obstacles"]],
        "with obstacles": [row for row in rows if row["obstacles"]],
        **{kind: [row for row in rows if row["kind"] == kind] for kind in KINDS_DRAWN},
        "frictionless": [row for row in rows if row["friction"] == 0.0],
    }
    found: list[dict[str, Any]] = []
    for name, group in groups.items():
        count = Counter(row["verdict"] for row in group)
        judged = count[AGREES] + count[FIRM]
        shown = "--"
        if judged:
            of_these = share(count[AGREES], judged)
            shown = f"{of_these.rate:.1%} ({of_these.low:.1%}–{of_these.high:.1%})"
        counts = {verdict: count[verdict] for verdict in VERDICTS}
        found.append({"scenes": name, "in all": len(group), **counts, "share": shown})
    wanted = ", ".join(f"{share:.0%} {group}" for group, share in WANTED.items())
    return Table(f"Share that agrees, of scenes that agree or are firm; required: {wanted}", found)


def main(
    scenes: Annotated[int, typer.Option(min=1, help="Number of random scenes.")] = 1000,
    first: Annotated[int, typer.Option(min=0, help="Seed of the first scene.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("runs/agreement"),
    workers: Annotated[int, typer.Option(min=1, help="Number of processes.")] = 1,
) -> None:
    """Compare scenes, continue an earlier run if there is one, and print the results."""
    wanted = range(first, first + scenes)
    with Checkpoint(out, {"physics": physics_digest()}) as kept:
        rows = {row["seed"]: row for row in kept.load()}
        left = [seed for seed in wanted if seed not in rows]
        results = finished(compare, left, Workers(workers, "processes"))
        for _, row in track(results, "comparing", total=len(left)):
            kept.add(row, row["seed"])
            rows[row["seed"]] = row
    chosen = [rows[seed] for seed in wanted]
    console = Console()
    console.print(rich_table(table_of(chosen)))
    for row in chosen:
        if row["verdict"] != AGREES:
            path = out / f"{row['verdict'].replace(' ', '-')}-{row['seed']}.yaml"
            save_scene(scene_of(row["seed"]), path)
            console.print(f"{path}: {row['difference']}, {' / '.join(row['ends'])}")


if __name__ == "__main__":
    options.application_of(main)()
