"""`magfold fold`: simulate one fold, print its result and write its files."""

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from magfold_env.cli import options
from magfold_env.cli.ensemble import changed_scene
from magfold_env.fold import Fold, FoldStatus
from magfold_env.replay.data import feed_text
from magfold_env.scene import load_scene
from magfold_env.simulation.simulate import energy, simulate

FRAME_RATE = 240.0  # the paper's camera [1/s]


def fold(  # noqa: PLR0913 - one parameter per option
    scene: options.SceneName,
    *,
    mount: options.Mount = None,
    direction: options.Direction = None,
    speed: options.Speed = None,
    friction: options.Friction = None,
    seed: options.Seed = 0,
    gif: Annotated[Path | None, typer.Option(help="Write the motion as an animated GIF.")] = None,
    png: options.Png = None,
    html: Annotated[
        Path | None, typer.Option(help="Write a page that plays the motion in any browser.")
    ] = None,
    sheet: Annotated[
        Path | None,
        typer.Option(help="Write an assembly sheet: PDF or PNG to print, SVG or DXF to cut."),
    ] = None,
    json: options.Json = None,
) -> None:
    """Simulate one fold and print how it ended; exit code 1 if the simulation failed."""
    files = {"--gif": gif, "--png": png, "--html": html, "--sheet": sheet, "--json": json}
    with options.busy("simulating") as shown:
        options.check_outputs(files)
        changed = changed_scene(
            load_scene(scene), mount=mount, direction=direction, speed=speed, friction=friction
        )
        rate = FRAME_RATE if gif or html else None

        def show(moment: float, released: int) -> None:
            shown.update(f"simulating: {moment:.2f} s, {released} of {changed.n} out ...")

        begun = time.perf_counter()
        result = simulate(changed, seed=seed, frame_rate=rate, progress=show)
        taken = time.perf_counter() - begun
    options.show(options.entries("Fold", fold_rows(result, taken)))
    file = Path(scene)
    title = file.stem if file.suffix else scene
    options.save(
        (gif, options.drawing("save_gif", result)),
        (png, options.drawing("save_png", result)),
        (html, result.to_html),
        (sheet, options.drawing("save_sheet", changed, result, title=title)),
        (json, result.to_json),
    )
    if result.status is FoldStatus.FAILED:
        raise typer.Exit(1)


def fold_rows(fold: Fold, taken: float) -> dict[str, str]:
    """Return the result of a fold as names and texts; ``taken`` is the computing time [s]."""
    scene = fold.scene
    mount = scene.mount
    if mount == "tube":
        mount += f", {feed_text(scene)}"
    straight = energy(scene, np.zeros(scene.n))
    pushed = {"push at most": f"{fold.push_peak:.3g} N"} if scene.mount == "tube" else {}
    return {
        "sequence": " ".join(scene.sequence),
        "mount": mount,
        "word": fold.word or "(one component)",
        "status": f"{fold.status} ({fold.message})",
        "joint angles": " ".join(f"{angle:.1f}°" for angle in np.rad2deg(fold.joint_angles)),
        "energy, straight": options.millijoules(straight) + " mJ",
        "energy, at the end": options.millijoules(fold.energy) + " mJ",
        **pushed,
        "simulated time": f"{fold.time:.4f} s",
        "steps, evaluations": f"{fold.steps}, {fold.evaluations}",
        "computing time": f"{taken:.3f} s",
    }
