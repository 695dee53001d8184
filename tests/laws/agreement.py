"""Do default settings end where a reference ends? Over many random scenes.

Run as ``python -m tests.laws.agreement --scenes 1000 --out runs/agreement``. A killed run goes on
where it was. Every scene that disagrees is saved as YAML: ``magfold fold FILE`` runs it again.

A scene that ends otherwise with a tolerance 20 times tighter belongs to one of three classes:

- *reference not converged*: with a tolerance 400 times tighter it ends in a third way, or as usual;
- *decided within tolerance*: a reference whose start is moved by the scene's own tolerance ends
  otherwise, too;
- *firm*: neither, so the default settings are wrong.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from rich.console import Console
from rich.progress import track

from magfold_bench.laws.outcomes import SAME_WITHIN, moved_starts
from magfold_bench.laws.random_scenes import random_scene
from magfold_bench.stress.kinds import KINDS, Source
from magfold_bench.tables import Table, rich_table
from magfold_env.checkpoint import Checkpoint
from magfold_env.files import physics_digest
from magfold_env.fold import FoldStatus
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
}  # share of those that are not set aside
MUCH_TIGHTER = 400
PAIRS = 8  # of moved starts
KINDS_DRAWN = ("plain", "retraction", "obstacles", "tilted")
"""Kinds of scenes, drawn in turn: `random_scene`'s, and some of the stress test's."""

TIGHTER = 20  # a reference's tolerance is the scene's over this
LEAST_TOLERANCE = 1e-12


class Outcome(NamedTuple):
    """The end of one simulation."""

    status: str
    message: str
    word: str
    joints: tuple[float, ...]  # joint angles [rad]
    time: float  # simulated [s]
    steps: int
    evaluations: int
    seconds: float  # of computing

    @classmethod
    def of(cls, scene: Scene) -> Outcome:
        """Simulate a scene in which nothing is left to draw."""
        begun = time.perf_counter()
        fold = simulate(scene)
        return cls(
            status=fold.status.value,
            message=fold.message,
            word=fold.word,
            joints=tuple(fold.joint_angles.tolist()),
            time=fold.time,
            steps=fold.steps,
            evaluations=fold.evaluations,
            seconds=time.perf_counter() - begun,
        )

    @property
    def failed(self) -> bool:
        """Whether the simulation broke down."""
        return self.status == FoldStatus.FAILED

    def angle_from(self, other: Outcome) -> float:
        """Return the largest difference of a joint angle [rad]."""
        return float(np.abs(np.subtract(self.joints, other.joints)).max(initial=0.0))

    def difference(self, other: Outcome) -> str:
        """Return `word`, `status` or `angles` for the first thing that differs, else nothing."""
        if self.word != other.word:
            return "word"
        if self.status != other.status:
            return "status"
        # Not "<=": an angle that is no number differs.
        return "" if self.angle_from(other) <= SAME_WITHIN else "angles"


def reference_of(scene: Scene, tighter: int = TIGHTER) -> Scene:
    """Return the scene with tighter settings, and as much more work allowed."""
    solver = scene.solver
    changes = {
        "tolerance": max(solver.tolerance / tighter, LEAST_TOLERANCE),
        "max_steps": solver.max_steps * tighter,
        "max_steps_per_second": solver.max_steps_per_second * tighter,
    }
    return scene.replace(solver=changes)


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


def table_of(rows: Sequence[Row]) -> Table:
    """Return how many scenes agree, in all and by group."""
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
    return Table(f"Share of those that agree or are firm that agree; wanted: {wanted}", found)


def main(
    scenes: Annotated[int, typer.Option(min=1, help="Random scenes.")] = 1000,
    first: Annotated[int, typer.Option(min=0, help="Seed of the first.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("runs/agreement"),
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
) -> None:
    """Compare, go on where an earlier run ended, and print what was found."""
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
            ends = [f"{row[k]['word']} {row[k]['status']}" for k in ("default", "reference")]
            console.print(f"{path}: {row['difference']}, {' / '.join(ends)}")


if __name__ == "__main__":
    typer.run(main)
