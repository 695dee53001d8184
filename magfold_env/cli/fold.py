"""`magfold fold`: simulate one fold, show how it ended, and write its files."""

import time
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from magfold_env.cli import options
from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.simulate import energy, simulate

FRAME_RATE = 240.0  # the paper's camera [1/s]


class Files(NamedTuple):
    """Where to write what; None for what is not asked for."""

    gif: Path | None = None
    png: Path | None = None
    html: Path | None = None
    sheet: Path | None = None
    json: Path | None = None

    @property
    def frame_rate(self) -> float | None:
        """Frames a simulated second that these files need [1/s]; None for none."""
        return None if self.gif is None and self.html is None else FRAME_RATE

    @property
    def drawn(self) -> list[Path]:
        """Those that need the extra `render`."""
        return [path for path in (self.gif, self.png, self.sheet) if path is not None]

    def check(self) -> None:
        """Fail before the long work if one of them could not be drawn.

        Raises
        ------
        ValueError
            If Pillow is not installed, or the sheet's name does not say in which format.
        ImportError
            If matplotlib is not installed.
        """
        if self.drawn:
            options.need_render(charts=self.sheet is not None)
        if self.sheet is not None:
            from magfold_env.render.sheets import check_suffix  # noqa: PLC0415 - an extra

            try:
                check_suffix(self.sheet)
            except ValueError as error:
                raise ValueError(f"--sheet: {error}") from None

    def write(self, scene: Scene, name: str, fold: Fold) -> None:
        """Write what is asked for.

        Parameters
        ----------
        scene
            That was simulated, before its draws.
        name
            What the user calls it: a shipped scene's name, or a file's path.
        fold
            Its fold, with a trajectory if `frame_rate` is not None.
        """
        if self.drawn:
            from magfold_env import render  # noqa: PLC0415 - an extra

            if self.png is not None:
                render.save_png(fold, self.png)
            if self.gif is not None:
                render.save_gif(fold, self.gif)
            if self.sheet is not None:
                path = Path(name)
                render.save_sheet(scene, fold, self.sheet, path.stem if path.suffix else name)
        if self.html is not None:
            fold.to_html(self.html)
        if self.json is not None:
            fold.to_json(self.json)


def fold(  # noqa: PLR0913 - one parameter an option
    scene: options.SceneName,
    *,
    mount: Annotated[str | None, typer.Option(help="pinned, free or tube.")] = None,
    direction: Annotated[str | None, typer.Option(help="forward or backward.")] = None,
    speed: options.Speed = None,
    friction: options.Friction = None,
    seed: options.Seed = 0,
    gif: Annotated[Path | None, typer.Option(help="Write the motion as an animated GIF.")] = None,
    png: options.Png = None,
    html: Annotated[
        Path | None, typer.Option(help="Write a page that plays the motion in any browser.")
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="Write a printable assembly sheet, PDF or PNG.")
    ] = None,
    json: options.Json = None,
) -> None:
    """Simulate one fold and print how it ended; exit code 1 if the simulation failed."""
    files = Files(gif, png, html, sheet, json)
    with options.errors_in_one_line(), options.busy("simulating"):
        options.check_outputs({f"--{name}": path for name, path in files._asdict().items()})
        feed = {"direction": direction, "speed": speed}
        changes = {
            "mount": mount,
            "friction": friction,
            "feed": {key: value for key, value in feed.items() if value is not None} or None,
        }
        given = {key: value for key, value in changes.items() if value is not None}
        changed = load_scene(scene).replace(**given)
        files.check()
        begun = time.perf_counter()
        result = simulate(changed, seed=seed, frame_rate=files.frame_rate)
        taken = time.perf_counter() - begun
    Console().print(fold_table(result, taken))
    with options.errors_in_one_line(), options.busy("drawing"):
        files.write(changed, scene, result)
    options.say_written(*files)
    if result.status is FoldStatus.FAILED:
        raise typer.Exit(1)


def fold_table(fold: Fold, taken: float) -> Table:
    """Return how a fold ended; `taken` is the time the computer needed [s]."""
    scene = fold.scene
    mount = scene.mount
    if mount == "tube":
        slow, fast = float(scene.speeds.min()), float(scene.speeds.max())
        speed = f"{slow:.4g}" if slow == fast else f"{slow:.4g} to {fast:.4g}"
        mount += f", {scene.feed.direction}, {speed} m/s, {scene.feed.loading}"
    straight = energy(scene, np.zeros(scene.n))
    rows = {
        "sequence": " ".join(scene.sequence),
        "mount": mount,
        "word": fold.word or "(one component)",
        "status": f"{fold.status} ({fold.message})",
        "joint angles": " ".join(f"{angle:.1f}°" for angle in np.rad2deg(fold.joint_angles)),
        "energy, straight": options.millijoules(straight) + " mJ",
        "energy, at the end": options.millijoules(fold.energy) + " mJ",
        "simulated time": f"{fold.time:.4f} s",
        "steps, evaluations": f"{fold.steps}, {fold.evaluations}",
        "computing time": f"{taken:.3f} s",
    }
    table = Table(show_header=False, title="Fold")
    for name, value in rows.items():
        table.add_row(name, escape(value))
    return table
