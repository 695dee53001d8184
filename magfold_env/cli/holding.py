"""`magfold holding`: the loads that a fold withstands before it opens or gives way to a pull."""

import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from magfold_env import holding_loads
from magfold_env.cli import options
from magfold_env.cli.ensemble import changed_scene
from magfold_env.fold import Fold
from magfold_env.scene import Problem, SceneError, load_scene
from magfold_env.simulation.simulate import simulate


def holding(  # noqa: PLR0913 - one parameter per option
    scene: Annotated[
        str, typer.Argument(help="Shipped scene, YAML file, or JSON file of a fold, at rest.")
    ],
    *,
    angle: Annotated[
        list[float] | None,
        typer.Option(help="Direction of the pull [degrees], 0 along +x; 24 if left out."),
    ] = None,
    pulled: Annotated[
        int | None, typer.Option(help="Component that is pulled; the free end if left out.")
    ] = None,
    held: Annotated[
        int | None,
        typer.Option(help="Component that is held, 0 for none; the other end if left out."),
    ] = None,
    mount: options.Mount = None,
    direction: options.Direction = None,
    speed: options.Speed = None,
    friction: options.Friction = None,
    seed: options.Seed = 0,
    png: options.Png = None,
    json: options.Json = None,
) -> None:
    """Find the moments that open a fold's joints, and the pull at which it gives way."""
    with options.busy("simulating"):
        options.check_outputs({"--png": png, "--json": json})
        if angle is not None and not np.isfinite(angle).all():
            raise ValueError(f"--angle: {angle} is not allowed; must be finite numbers")
        changes: dict[str, Any] = {
            "mount": mount, "direction": direction, "speed": speed, "friction": friction
        }  # fmt: skip
        if Path(scene).suffix.lower() != ".json":
            fold = simulate(changed_scene(load_scene(scene), **changes), seed)
        elif any(change is not None for change in changes.values()):
            allowed = "a fold from a file is what it is; leave out --mount, --direction, --speed "
            raise SceneError([Problem("SCENE", scene, f"{allowed}and --friction")])
        else:
            fold = Fold.from_json(scene)
        directions = None if angle is None else np.radians(angle)
        found = holding_loads.holding(fold, directions=directions, pulled=pulled, held=held)
    show(found)
    options.save((png, options.drawing("draw_holding", found)), (json, found.to_json))


def show(found: holding_loads.Holding) -> None:
    """Print the moments that open each joint, and the pull in each direction."""
    columns = {"joint": True, "letter": False, "left, mN·m": True, "right, mN·m": True}
    joints = options.table(
        f"Moments that open the joints of {found.fold.word or '(one component)'}",
        columns | {"stiffness, mN·m/rad": True},
    )
    for joint, letter in enumerate(found.fold.word):
        values = (*found.opening[joint], found.stiffness[joint])
        joints.add_row(str(joint + 1), letter, *(_cell(1e3 * value) for value in values))
    by = f"component {found.held} held" if found.held else "the mount and the floor hold"
    pulls = options.table(
        f"Pull on component {found.pulled}, {by}",
        {"towards": True, "left of its front": True, "N": True},
    )
    ways = zip(np.degrees(found.directions), np.degrees(found.from_front), found.pull, strict=True)
    for towards, turned, force in ways:
        pulls.add_row(f"{towards:.4g}°", f"{turned:.0f}°", _cell(force))
    options.show(joints, pulls)
    typer.echo(f"{found}.")


def _cell(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "none"
