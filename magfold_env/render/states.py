"""Sheets of ranked shapes from the energy minimiser."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from magfold_env.minimiser import State
from magfold_env.render import style
from magfold_env.render.canvas import Canvas, View, save_image, tiled
from magfold_env.render.chain import draw_chain, draw_conflicts
from magfold_env.reporting.tables import joined_pairs
from magfold_env.scene import Scene
from magfold_env.shapes import centres, headings, word_to_angles

_PANEL = 260  # px
_TEXT = 15.0  # px
_COLUMNS = 5


def draw_states(scene: Scene, states: Sequence[State], path: str | Path) -> None:
    """Draw shapes with their ranks, words, energies, stability and conflicts as a PNG.

    Parameters
    ----------
    scene
        The scene that contains the sizes and the sequence.
    states
        States to draw, in rank order.
    path
        Path of the file, which is first written under a temporary name.

    Raises
    ------
    ValueError
        If there is no state.
    """
    if not states:
        raise ValueError("states: [] is not allowed; must hold at least one state")
    reach = max(_reach(scene, state.word) for state in states)  # one scale for all shapes
    panels = [_panel(scene, state, k, reach) for k, state in enumerate(states, start=1)]
    save_image(tiled(panels, min(len(states), _COLUMNS)), path)


def _reach(scene: Scene, word: str) -> float:
    middles = centres(headings(word_to_angles(word)), side=scene.casing.side)
    return float(np.ptp(middles, axis=0).max()) + 1.2 * scene.casing.diagonal


def _panel(scene: Scene, state: State, rank: int, reach: float) -> Image.Image:
    side = scene.casing.side
    angles = headings(word_to_angles(state.word))
    middles = centres(angles, side=side)
    x, y = (middles.min(axis=0) + middles.max(axis=0)) / 2
    room = 2.0 * 1.6 * _TEXT / (_PANEL - 2.0 * 1.6 * _TEXT) * reach / 2  # for the two lines of text
    view = View(x - reach / 2, x + reach / 2, y - reach / 2 - room, y + reach / 2 + room)
    canvas = Canvas(view, (_PANEL, _PANEL))
    draw_chain(canvas, scene, angles, np.zeros(2), np.ones(scene.n, dtype=np.bool_))
    draw_conflicts(canvas, middles, side, state.conflicts)
    canvas.note(f"{rank}.  {state.word}", (10, 8), 1.2 * _TEXT, style.INK)
    canvas.note(f"{1e3 * state.energy:.3f} mJ", (10, _PANEL - 8), _TEXT, style.INK, "ld")
    verdict, colour = "not fully folded", style.FAINT
    if state.stable:
        verdict, colour = "stable", style.GOOD
    elif state.conflicts:
        verdict, colour = f"conflict {joined_pairs(state.conflicts)}", style.WARNING
    canvas.note(verdict, (_PANEL - 10, _PANEL - 8), _TEXT, colour, "rd")
    return canvas.image()
