"""Pictures for the site: `python docs/pictures.py` draws the picture that explains words.

`python docs/pictures.py laboratory` takes a screenshot of the laboratory, which needs Chromium.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import magfold_env as mf
from magfold_env.files import replacing
from magfold_env.render.assembly import draw_card, draw_fold, text
from magfold_env.reporting.plotting import figure_class
from magfold_env.shapes import headings, word_to_angles

HERE = Path(__file__).parent
WORD = "LRLLL"
WIDTH, HEIGHT = 176.0, 66.0  # [mm]


def component_and_word(path: Path) -> None:
    """Draw a component with its faces next to a fold with its joints."""
    scene = mf.load_scene("paper/sequence-3")
    figure = figure_class()(figsize=(WIDTH / 25.4, HEIGHT / 25.4))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set_xlim(0.0, WIDTH)
    axis.set_ylim(0.0, HEIGHT)
    axis.set_axis_off()
    draw_card(axis, (1.0, HEIGHT - 3.0), scene, 2, [""] * 4)
    left, bottom, width, height = 66.0, 5.0, 48.0, 57.0
    angles = headings(word_to_angles(WORD), np.deg2rad(45.0))
    draw_fold(axis, (left, bottom, width, height), scene, angles)
    text(axis, left + width + 2.0, HEIGHT - 6.0, f"the word {WORD}", 13.0, fontweight="bold")
    for k, letter in enumerate(WORD):
        told = f"joint {k + 1}, between {k + 1} and {k + 2}:  {letter}"
        text(axis, left + width + 2.0, HEIGHT - 16.0 - 6.5 * k, told, 10.0)
    text(axis, left + width + 2.0, 13.0, "L turns left, R right;\nS would stay straight", 10.0)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=120, facecolor="white")


def laboratory(path: Path) -> None:
    """Take a screenshot of the laboratory at the end of its first fold."""
    from magfold_env.browser import build  # noqa: PLC0415 - slow to import
    from tests.replay import chromium  # noqa: PLC0415 - POSIX only

    with tempfile.TemporaryDirectory() as profile, chromium.page(Path(profile)) as page:
        page.resize(1200, 800)
        page.open(build.page())
        page.until("window.laboratory !== undefined && byId('states').ariaBusy === 'false'")
        page.value("laboratory.player.pause()")
        page.value("laboratory.player.seek(laboratory.player.motion.end)")
        path.write_bytes(page.screenshot())


if __name__ == "__main__":
    if "laboratory" in sys.argv:
        laboratory(HERE / "laboratory.png")
    else:
        component_and_word(HERE / "component.png")
