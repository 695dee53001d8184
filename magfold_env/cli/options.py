"""Options, early checks, output and error messages that all commands share."""

import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated, Any, cast

import typer
from rich import progress
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.measure import Measurement
from rich.status import Status
from rich.table import Table
from typer.core import TyperCommand, TyperGroup

from magfold_env.engine.compile import jit
from magfold_env.files import pip_install
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.errors import quoted, shortened

SceneName = Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a YAML file.")]
Mode = Annotated[str, typer.Option(help="free, forward or backward.")]
ReleaseMode = Annotated[
    str | None, typer.Option(help="free, forward or backward, in place of the scene's.")
]
Widths = Annotated[
    list[str] | None,
    typer.Option("--spread", help="NAME=WIDTH: start_angles [rad], or one of the scene's spreads."),
]
Mount = Annotated[str | None, typer.Option(help="pinned, free or tube.")]
Direction = Annotated[str | None, typer.Option(help="Of the feed, forward or backward.")]
Speed = Annotated[float | None, typer.Option(help="Feed speed [m/s].")]
Friction = Annotated[float | None, typer.Option(help="Friction coefficient.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.")]
DrawSeed = Annotated[int, typer.Option(help="Seed of all draws.")]
Png = Annotated[Path | None, typer.Option(help="Draw the result as a picture.")]
Json = Annotated[Path | None, typer.Option(help="Write the result as JSON.")]
WorkerCount = Annotated[int | None, typer.Option(help="Parallel runs; one per core by default.")]
BackendName = Annotated[
    str | None, typer.Option(help="threads, processes or ray; chosen automatically by default.")
]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Folder for JSON, CSV and PNG files; an interrupted command continues there."
    ),
]
Quick = Annotated[bool, typer.Option("--quick", help="Measure less: only to try it.")]
Results = Annotated[
    Path, typer.Option(help="Folder of the results; an interrupted command continues there.")
]

SUFFIXES = {
    "--gif": (".gif",),
    "--png": (".png",),
    "--html": (".html",),
    "--json": (".json",),
    "--sheet": (".pdf", ".png", ".svg", ".dxf"),
}
"""Allowed suffixes of the files that an option may name."""
PICTURES = ("--gif", "--png", "--sheet")

STUBBORN = 3.0  # [s] time allowed for a compiler to stop
FILE_WIDTH = 150  # of wide tables, if stdout is not a terminal
WIDEST = 10_000  # limit for the width of a table
LONGEST = 800  # limit for the characters of a message
DEEPEST = 200  # limit for the folders in a path; Python creates them by recursion


class _InOneLine:
    """A command that reports user errors and Ctrl-C in one line.

    It refuses empty values and paths of too many folders.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        with errors_in_one_line():
            for before, each in pairwise(("", *args)):
                option, equals, value = each.partition("=")
                if not (equals and option.startswith("--")):
                    option, value = before, each
                if not value:  # which Python takes for the path of the current folder
                    raise SceneError([Problem(option, "", "must not be empty")])
                if value.count("/") > DEEPEST:
                    allowed = f"must be at most {DEEPEST} folders deep"
                    raise SceneError([Problem(option, value, allowed)])
            return cast("Any", super()).parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        with errors_in_one_line():
            return cast("Any", super()).invoke(ctx)


class _Command(_InOneLine, TyperCommand): ...


class _Group(_InOneLine, TyperGroup): ...


def application(**settings: Any) -> typer.Typer:
    """Return a command-line application that does not have any commands yet."""
    return typer.Typer(
        cls=_Group, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
        **settings,
    )  # fmt: skip


def application_of(main: Callable[..., None]) -> typer.Typer:
    """Return a command line that consists of one command."""
    made = application()
    made.command(cls=_Command)(main)
    return made


@cache
def end_long_compilations() -> None:
    """End the process if a compiler continues for `STUBBORN` seconds after Ctrl-C.

    Python handles signals only between calls of compiled code, and numba's last call is long.
    """
    ear, mouth = socket.socketpair()
    mouth.setblocking(False)
    signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)

    def listen(_kept: socket.socket) -> None:
        while number := ear.recv(1):
            since = jit.FIRST_USE and jit.FIRST_USE.compiling_since
            if number[0] == signal.SIGINT and since is not None:
                time.sleep(STUBBORN)
                if jit.FIRST_USE.compiling_since == since:
                    typer.echo("interrupted", err=True)
                    os._exit(130)

    threading.Thread(target=listen, args=(mouth,), daemon=True).start()


@contextmanager
def errors_in_one_line(
    kinds: tuple[type[Exception], ...] = (ValueError, OSError, ImportError), code: int = 2
) -> Generator[None]:
    """Print a user error on one line of stderr and exit with ``code``.

    If a scene has several problems, each has its own line. After Ctrl-C, the exit code is 130.
    """
    try:
        yield
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        raise typer.Exit(130) from None
    except kinds as error:
        told = str(error)
        if isinstance(error, OSError) and error.filename is not None and error.strerror:
            told = f"{error.filename}: {error.strerror}"
        lines = told.splitlines()
        several = isinstance(error, SceneError) and len(error.problems) > 1
        for line in lines if several else ("; ".join(lines),):
            typer.echo(f"error: {shortened(line, LONGEST)}", err=True)
        raise typer.Exit(code) from None


def refuse_repeated(option: str, texts: Sequence[str]) -> None:
    """Raise an error if two of an option's texts KEY=VALUE have the same key."""
    keys = [text.partition("=")[0].strip() for text in texts]
    for k, key in enumerate(keys):
        if key in keys[:k]:
            raise SceneError([Problem(option, texts[k], f"must not name {key} a second time")])


def check_outputs(paths: Mapping[str, Path | None]) -> None:
    """Raise an error before long work if a result cannot be drawn or written to its path."""
    for option, path in paths.items():
        if path is None:
            continue
        allowed, suffixes = "", SUFFIXES.get(option)
        if not path.parent.is_dir():
            allowed = "its folder must exist"
        elif path.is_dir():
            allowed = "must not be a folder"
        elif suffixes is not None and path.suffix.lower() not in suffixes:
            allowed = f"must end in {' or '.join(suffixes)}"
        if allowed:
            raise ValueError(f"{option}: {quoted(str(path))} is not allowed; {allowed}")
        if path.is_file() or not path.exists():
            check_folder(option, path.parent)
        if option in PICTURES:
            need_render(path.suffix.lower())


def check_folder(option: str, path: Path | None) -> None:
    """Raise an error before long work if the folder of results cannot be made or written."""
    if path is None:
        return
    existing = next(each for each in (path, *path.parents) if each.exists())
    given = f"{option}: {quoted(str(path))} is not allowed; {existing}"
    if not existing.is_dir():
        raise ValueError(f"{given} is not a folder")
    try:
        TemporaryFile(dir=existing).close()
    except OSError as error:
        raise ValueError(f"{given} cannot be written to: {error.strerror}") from None


def need_render(suffix: str = ".png") -> None:
    """Raise an error before long work if pictures or charts cannot be drawn."""
    for module in ("magfold_env.render", "matplotlib.figure", *["ezdxf"] * (suffix == ".dxf")):
        try:
            import_module(module)
        except ImportError as error:
            need = "DXF needs ezdxf" if module == "ezdxf" else "pictures need Pillow and matplotlib"
            raise ValueError(f"{need}: install the extra, {pip_install('render')}") from error


def need_display() -> None:
    """Raise an error if no display can show a window, unless ``SDL_VIDEODRIVER`` is set."""
    if "SDL_VIDEODRIVER" in os.environ:
        return
    import pygame  # noqa: PLC0415 - an extra

    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
        pygame.display.quit()
    except pygame.error as error:
        raise ValueError(f"display: there is none to open a window on ({error})") from None
    if driver in ("dummy", "offscreen"):
        raise ValueError(
            f"display: there is none to open a window on; SDL_VIDEODRIVER={driver} does without"
        )


def say_written(*paths: Path | None) -> None:
    """Print the paths of the written files."""
    for path in paths:
        if path is not None:
            typer.echo(f"written: {path}")


def save(*files: tuple[Path | None, Callable[[Path], object]]) -> None:
    """Write each requested file, make its folder if necessary, and print the paths."""
    with busy("writing"):
        for path, write in files:
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
                write(path)
    say_written(*(path for path, _ in files))


def drawing(name: str, *what: Any, **options: Any) -> Callable[[Path], object]:
    """Return a function of a path that calls the function ``name`` of `magfold_env.render`."""
    return lambda path: getattr(import_module("magfold_env.render"), name)(*what, path, **options)


def busy(what: str) -> Status:
    """Return a context manager that shows a spinner on stderr if that is a terminal."""
    return Console(stderr=True).status(f"{what} ...")


def progress_bar() -> progress.Progress:
    """Return a progress bar on stderr that disappears when the work is done.

    On a terminal, it shows a description, the completed share, and the elapsed and remaining times.
    """
    console = Console(stderr=True)
    return progress.Progress(
        *progress.Progress.get_default_columns(), progress.TimeElapsedColumn(),
        console=console, transient=True, disable=not console.is_terminal,
    )  # fmt: skip


@contextmanager
def progress_of(total: float) -> Generator[Callable[..., None]]:
    """Yield a function that updates the progress and the description of one task."""
    with progress_bar() as bar:
        task = bar.add_task("", total=total)

        def tell(done: float, what: str = "") -> None:
            bar.update(task, completed=done, description=what)

        yield tell


def show(*what: RenderableType) -> None:
    """Print tables and other objects on stdout; no word in a table is broken."""
    for each in what:
        console = Console()
        if isinstance(each, Table):
            console.width = max(console.width, _least_width(each, console))
        console.print(each)


def _least_width(table: Table, console: Console) -> int:
    """Return the width at which every column has room for its longest word.

    When a table is narrowed, its widest columns shrink first.
    """
    room = console.options.update(width=WIDEST)
    columns = [
        [Measurement.get(console, room, cell) for cell in (column.header, *column.cells)]
        for column in table.columns
    ]
    longest = max(cell.minimum for cells in columns for cell in cells)
    widths = [max(cell.maximum for cell in cells) for cells in columns]
    whole = Measurement.get(console, room, table).maximum
    return whole - sum(max(0, width - longest) for width in widths)


def wide_console() -> Console:
    """Return a console on stdout; if stdout is not a terminal, it has `FILE_WIDTH` columns."""
    console = Console()
    return console if console.is_terminal else Console(width=FILE_WIDTH)


def table(title: str, columns: Mapping[str, bool], caption: str | None = None) -> Table:
    """Return an empty table; ``columns`` maps each heading to whether its column has numbers.

    Numbers are aligned to the right. Text in the column "name" is never broken.
    """
    made = Table(title=title, caption=caption)
    for name, numbers in columns.items():
        made.add_column(name, justify="right" if numbers else "left", no_wrap=name == "name")
    return made


def entries(title: str, rows: Mapping[str, str]) -> Table:
    """Return a table of names and values without headings."""
    made = Table(show_header=False, title=title)
    for name, value in rows.items():
        made.add_row(name, escape(value))
    return made


def millijoules(joules: float) -> str:
    """Return an energy [J] as a table cell in mJ."""
    return f"{1e3 * joules:.4f}"
