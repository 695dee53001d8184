"""Where the paper's three sequences fold, by mode of release: simulation beside prediction.

Run as ``python -m magfold_env.benchmarks.distributions [--seeds 20] [--speed 0.05]``.
"""

from __future__ import annotations

from collections import Counter
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from magfold_env.energy import minimise
from magfold_env.energy.result import Mode
from magfold_env.scene import Scene
from magfold_env.scene_io import load_scene
from magfold_env.simulate import simulate

MODES: tuple[Mode, ...] = ("free", "forward", "backward")

# What the paper says of its experiments, in words and in its names for the shapes.
PAPER = {
    (1, "free"): "least lateral movement, not the global minimum",
    (1, "forward"): "least lateral movement, not the global minimum",
    (1, "backward"): "S1A and S1C about equally often",
    (2, "free"): "S2B (LRLRL), not the global minimum",
    (2, "forward"): "S2B (LRLRL), not the global minimum",
    (2, "backward"): "several shapes about equally often",
    (3, "free"): "S3A (LRLLL) or a misfold",
    (3, "forward"): "S3A (LRLLL) or a misfold",
    (3, "backward"): "S3A (LRLLL) or a misfold",
}


def released(sequence: int, mode: Mode, speed: float) -> Scene:
    """Return the scene of a paper sequence in a mode of release at a feed speed [m/s]."""
    scene = load_scene(f"paper/sequence-{sequence}")
    if mode == "free":
        return scene
    return scene.replace(mount="tube", feed={"direction": mode, "speed": speed})


def distribution(scene: Scene, seeds: int) -> Counter[tuple[str, str]]:
    """Count (word, status) over seeds 0 to ``seeds − 1``."""
    folds = (simulate(scene, seed) for seed in range(seeds))
    return Counter((fold.word, fold.status.value) for fold in folds)


def main(
    seeds: Annotated[int, typer.Option(min=1, help="Releases of each sequence and mode.")] = 20,
    speed: Annotated[float, typer.Option(min=1e-4, help="Feed speed [m/s].")] = 0.05,
) -> None:
    """Print the words that each sequence folds into, by mode."""
    table = Table(title=f"{seeds} releases each; tube feed at {speed} m/s")
    for column in ("sequence", "mode", "simulated", "energy minimiser", "the paper's experiment"):
        table.add_column(column)
    cases: list[tuple[int, Mode]] = [(k, mode) for k in (1, 2, 3) for mode in MODES]
    for sequence, mode in track(cases, description="folding"):
        counts = distribution(released(sequence, mode, speed), seeds)
        words = "\n".join(f"{n} × {word} {status}" for (word, status), n in counts.most_common())
        best = minimise(load_scene(f"paper/sequence-{sequence}"), mode=mode, top=1).best
        table.add_row(str(sequence), mode, words, best.word, PAPER[sequence, mode])
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
