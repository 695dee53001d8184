"""The `magfold` command: simulate folds, rank their energies, design sequences, measure."""

from importlib.metadata import version
from typing import Annotated, Any, cast

import typer

from magfold_env.cli import (
    design,
    ensemble,
    fold,
    hold,
    lab,
    measurement,
    minimise,
    options,
    scenes,
    score,
    sweep,
    warmup,
)

app = options.Application(no_args_is_help=True)


def _tell_version(asked: bool) -> None:
    if asked:
        typer.echo(f"magfold_env {version('magfold_env')}")
        raise typer.Exit


@app.callback()
def main(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_tell_version, is_eager=True, help="Tell the version."),
    ] = False,
) -> None:
    """Self-folding chains of magnets."""
    options.end_long_compilations()


for _command in (
    fold.fold,
    hold.hold,
    minimise.minimise,
    ensemble.ensemble,
    sweep.sweep,
    design.design,
):
    app.command()(_command)


@app.command()
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
    with options.errors_in_one_line():
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
            scene,
            render_mode="human",
            components=length,
            targets=None if target is None else [target],
            fidelity=cast("Any", fidelity),
            randomisation=cast("Any", randomisation),
            baseline=None,
        )
        options.need_display()
        game = Game(env, seed, target)
        try:
            game.begin()
            game.run()
        finally:
            env.close()


app.command()(score.score)
app.command()(warmup.warmup)
app.command()(lab.lab)
app.command()(scenes.scenes)

measurement.add_to(app)
