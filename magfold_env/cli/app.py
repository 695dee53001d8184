"""The command `magfold` and its subcommands."""

from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from typing import Annotated, Any, cast

import typer

from magfold_env.cli import options
from magfold_env.cli.design import design
from magfold_env.cli.ensemble import ensemble
from magfold_env.cli.fold import fold
from magfold_env.cli.holding import holding
from magfold_env.cli.lab import lab
from magfold_env.cli.minimise import minimise
from magfold_env.cli.scenes import scenes
from magfold_env.cli.score import score
from magfold_env.cli.sweep import sweep
from magfold_env.cli.warmup import warmup

app = options.application(no_args_is_help=True)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"magfold_env {version('magfold_env')}")
        raise typer.Exit


@app.callback()
def main(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Self-folding chains of magnets."""
    options.end_long_compilations()


def play(
    *,
    target: Annotated[
        str | None, typer.Option(help="Word to fold, one letter per joint; random by default.")
    ] = None,
    scene: Annotated[str | None, typer.Option(help="Tube scene, by name or path.")] = None,
    components: Annotated[int | None, typer.Option(help="Chain length.")] = None,
    fidelity: Annotated[str, typer.Option(help="dynamics or quasistatic.")] = "dynamics",
    randomisation: Annotated[str, typer.Option(help="none, nominal, strong or scene.")] = "none",
    seed: options.Seed = 0,
) -> None:
    """Fold a chain by keyboard, in a window; H shows the keys."""
    options.need_render()
    # Only this command needs these imports.
    from magfold_env.envs.pictures.play import Game  # noqa: PLC0415
    from magfold_env.envs.tube_feed import TubeFeedEnv  # noqa: PLC0415

    length = len(target) + 1 if target else components
    if components not in (None, length):
        raise ValueError(
            f"--components: {components} is not allowed; must be {length} for {target!r}"
        )
    env = TubeFeedEnv(
        scene, render_mode="human", components=length, baseline=None,
        targets=None if target is None else [target], fidelity=cast("Any", fidelity),
        randomisation=cast("Any", randomisation),
    )  # fmt: skip
    options.need_display()
    game = Game(env, seed, target)
    try:
        game.begin()
        game.run()
    finally:
        env.close()


for _command in (
    fold, holding, minimise, ensemble, sweep, design, play, score, warmup, lab, scenes
):  # fmt: skip
    app.command()(_command)
# The former name of `holding`, for one release.
app.command("hold", hidden=True, deprecated=True)(holding)

HOW_TO_GET = (
    "the wheel does not contain it; clone the repository of magfold_env, install it there with "
    "`pip install -e .` and run `python -m magfold_bench`"
)


def add_measurement(app: typer.Typer) -> None:
    """Add the commands bench, stress and paper; without a checkout, they print how to get one."""
    if find_spec("magfold_bench") is not None:
        found = import_module("magfold_bench.commands")
        app.command()(found.stress)
        app.command()(found.paper)
        app.add_typer(found.bench, name="bench")
        return

    def missing(context: typer.Context) -> None:
        """Measure the package; this needs a checkout of its repository."""
        typer.echo(f"error: {context.info_name}: {HOW_TO_GET}", err=True)
        raise typer.Exit(2)

    settings = {"ignore_unknown_options": True, "allow_extra_args": True}
    for name in ("bench", "stress", "paper"):
        app.command(name, context_settings=settings)(missing)


add_measurement(app)
