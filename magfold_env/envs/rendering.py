"""Pictures and lines of text of an episode."""

from typing import Any

from magfold_env.envs.episode import Episode

RENDER_MODES = ("rgb_array", "ansi")


def check_render_mode(mode: str | None) -> str | None:
    """Return `mode` if there is such a render mode, or None for none.

    Raises
    ------
    ValueError
        If there is not.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise ValueError(
            f"render_mode: {mode!r} is not allowed; "
            f"must be None or one of {', '.join(RENDER_MODES)}"
        )
    return mode


def render_episode(mode: str | None, episode: Episode, target: str) -> Any:
    """Return the chain as an image or as text, as `mode` says; None without one."""
    if mode is None:
        return None
    scene = episode.scene_so_far
    caption = f"fed {episode.fed} of {scene.n}, {episode.word}"
    if mode == "ansi":
        return f"target {target}, {caption}\n"
    # Drawing needs the `render` extra, simulating does not.
    from magfold_env.render import frame  # noqa: PLC0415

    released = int(episode.progress.released.sum())
    return frame(scene, episode.state.angles, episode.state.base, released, target, caption)
