"""The files that `magfold fold` writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from magfold_env.fold import Fold
from magfold_env.reporting.plotting import figure_class
from magfold_env.scene import Scene

FRAME_RATE = 240.0  # the paper's camera [1/s]


class Files(NamedTuple):
    """Where to write what; None for what is not asked for."""

    gif: Path | None = None
    png: Path | None = None
    html: Path | None = None
    sheet: Path | None = None
    json: Path | None = None

    @property
    def options(self) -> dict[str, Path | None]:
        """The command line's options with what was given for them."""
        return {f"--{name}": path for name, path in self._asdict().items()}

    @property
    def frame_rate(self) -> float | None:
        """Frames a simulated second that these files need [1/s]; None for none."""
        return None if self.gif is None and self.html is None else FRAME_RATE

    @property
    def drawn(self) -> Sequence[Path]:
        """Those that need the extra `render`."""
        return [path for path in (self.gif, self.png, self.sheet) if path is not None]

    def check_sheet(self) -> None:
        """Fail before the long work if the sheet could not be drawn.

        Raises
        ------
        ValueError
            If its name does not say in which format.
        ImportError
            If matplotlib is not installed.
        """
        if self.sheet is None:
            return
        from magfold_env.render.sheets import check_suffix  # noqa: PLC0415 - an extra

        figure_class()
        try:
            check_suffix(self.sheet)
        except ValueError as error:
            raise ValueError(f"--sheet: {error}") from None


def write(files: Files, scene: Scene, name: str, fold: Fold) -> None:
    """Write the files that are asked for.

    Parameters
    ----------
    files
        Where to.
    scene
        That was simulated, before its draws.
    name
        What the user calls it: a shipped scene's name, or a file's path.
    fold
        Its fold, with a trajectory if `files.frame_rate` is not None.
    """
    if files.drawn:
        from magfold_env.render import save_gif, save_png, save_sheet  # noqa: PLC0415 - an extra

        if files.png is not None:
            save_png(fold, files.png)
        if files.gif is not None:
            save_gif(fold, files.gif)
        if files.sheet is not None:
            save_sheet(scene, fold, files.sheet, _title(name))
    if files.html is not None:
        fold.to_html(files.html)
    if files.json is not None:
        fold.to_json(files.json)


def _title(name: str) -> str:
    path = Path(name)
    return path.stem if path.suffix else name
