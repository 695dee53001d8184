"""`magfold bench`, `stress` and `paper`: commands of `magfold_bench`, which needs a checkout."""

from importlib import import_module
from importlib.util import find_spec

import typer

from magfold_env.cli import options

COMMANDS = {
    "stress": "Try to break the simulation by random and extreme scenes.",
    "paper": "Reproduce the paper's figures and tables on one page.",
    "bench": "Measure this machine and this version.",
}
HOW_TO_GET = (
    "the wheel does not contain it; clone the repository of magfold_env, install it there with "
    "`pip install -e .` and run `python -m magfold_bench`"
)


def add_to(app: options.Application) -> None:
    """Add the commands; if they are not installed, add commands that print how to install them."""
    if find_spec("magfold_bench") is None:
        for name, does in COMMANDS.items():
            _add_missing(app, name, does)
        return
    found = import_module("magfold_bench.commands")
    app.command()(found.stress)
    app.command()(found.paper)
    app.add_typer(found.bench, name="bench")


def _add_missing(app: options.Application, name: str, does: str) -> None:
    @app.command(
        name,
        help=f"{does} Not installed: {HOW_TO_GET}.",
        context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
    )
    def missing(_: typer.Context) -> None:  # pyright: ignore[reportUnusedFunction] - typer holds it
        typer.echo(f"error: {name}: {HOW_TO_GET}", err=True)
        raise typer.Exit(2)
