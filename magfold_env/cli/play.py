"""What `magfold play` does: open a window in which a chain is folded by keyboard."""

from __future__ import annotations

from typing import cast

from magfold_env.envs.pictures.play import Game
from magfold_env.envs.tasks.options import FoldOptions
from magfold_env.envs.tube_feed import TubeFeedEnv


def play(
    scene: str | None,
    target: str | None,
    components: int | None,
    fidelity: str,
    randomisation: str,
    seed: int,
) -> None:
    """Play until the window is closed; the options are those of `magfold play`.

    Raises
    ------
    ValueError
        For an option that is not allowed.
    """
    given = {
        "components": components if target is None else len(target) + 1,
        "targets": None if target is None else [target],
        "fidelity": fidelity,
        "randomisation": randomisation,
        "baseline": None,
    }
    if target is not None and components not in (None, len(target) + 1):
        raise ValueError(
            f"--components: {components} is not allowed; must be {len(target) + 1} for {target!r}"
        )
    env = TubeFeedEnv(scene, render_mode="human", **cast("FoldOptions", given))
    game = Game(env, seed, target)
    try:
        game.begin()
        game.run()
    finally:
        env.close()
