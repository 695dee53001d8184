"""Workshop drawings in millimetres and true to size: SVG, and DXF, which needs ezdxf."""

import importlib
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from magfold_env.files import pip_install
from magfold_env.render.chain import FACE_NORMALS, magnet_block, square
from magfold_env.render.sheet_parts import kinds
from magfold_env.scene import Scene
from magfold_env.shapes import FloatArray

_GAP, _COLUMNS = 12.0, 4  # gap between casings, and casings per row
_TEXT, _LINE, _MARGIN = 3.0, 5.0, 10.0
COLOURS = {"CASINGS": ("#26292e", 7), "MAGNETS": ("#ce3830", 1), "TEXT": ("#5f656d", 8)}
"""Colours of the layers in SVG and in DXF."""


class Drawing(NamedTuple):
    """A drawing in millimetres, with y upwards and the origin in the lower left corner.

    Outlines are closed and have a layer. Texts have a place, at which they are centred or begin.
    """

    size: tuple[float, float]
    outlines: list[tuple[str, FloatArray]]
    texts: list[tuple[str, FloatArray, bool]]


def magnet_lines(scene: Scene) -> list[str]:
    """Return the magnets to buy, one kind per line."""
    found = kinds(scene)[0]
    total = sum(kind.pieces for kind in found)
    head = f"{total} magnets, width × height × thickness:" if total else "No magnets."
    return [head, *(f"    {kind.name}   {kind.pieces} pieces, {kind.text}" for kind in found)]


def drawing(scene: Scene, lines: Sequence[str]) -> Drawing:
    """Return a drawing of all components, true to size and heading right, below lines of text.

    The text beside a face contains the pole that faces out and the kind of the magnet.
    """
    found, where = kinds(scene)
    side = 1e3 * scene.casing.side
    cell = 1e3 * scene.casing.diagonal + _GAP
    rows = -(-scene.n // _COLUMNS)
    shown = [line for line in (*lines, f"Sequence: {' '.join(scene.sequence)}") if line]
    width = max(_COLUMNS * cell, 0.6 * _TEXT * max(map(len, shown))) + 2.0 * _MARGIN
    top = _MARGIN + rows * cell + _LINE * len(shown)
    outlines: list[tuple[str, FloatArray]] = []
    left = [np.array([_MARGIN, top - _LINE * k]) for k in range(len(shown))]
    texts = [(line, place, False) for line, place in zip(shown, left, strict=True)]
    for k, faces in enumerate(scene.sequence):
        row, column = divmod(k, _COLUMNS)
        middle = np.array([_MARGIN, _MARGIN]) + cell * np.array([column + 0.5, rows - row - 0.5])
        outlines.append(("CASINGS", square(middle, 0.0, side)))
        texts.append((f"{k + 1}", middle, True))
        for f, pole in enumerate(faces):
            if where[k, f] >= 0:
                _, block = magnet_block(scene, f, 0.0, np.zeros(2))
                outlines.append(("MAGNETS", middle + 1e3 * block))
                normal = np.array([np.cos(FACE_NORMALS[f]), np.sin(FACE_NORMALS[f])])
                beside = middle + (0.5 * side + 1.5 * _TEXT) * normal
                texts.append((f"{pole} {found[int(where[k, f])].name}", beside, True))
    return Drawing((width, top + _MARGIN), outlines, texts)


def write_svg(drawn: Drawing, path: Path) -> None:
    """Write a drawing as SVG in millimetres."""
    width, height = drawn.size
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.4f}mm" height="{height:.4f}mm" '
        f'viewBox="0 0 {width:.4f} {height:.4f}" font-family="sans-serif" font-size="{_TEXT}">'
    ]
    for layer, corners in drawn.outlines:
        points = " ".join(f"{x:.4f},{height - y:.4f}" for x, y in corners)
        look = f'fill="none" stroke="{COLOURS[layer][0]}" stroke-width="0.1"'
        lines.append(f'<polygon class="{layer}" points="{points}" {look}/>')
    for words, (x, y), centred in drawn.texts:
        look = f'text-anchor="{"middle" if centred else "start"}" dominant-baseline="central"'
        place = f'x="{x:.4f}" y="{height - y:.4f}" fill="{COLOURS["TEXT"][0]}"'
        lines.append(f'<text {place} {look} xml:space="preserve">{escape(words)}</text>')
    path.write_text("\n".join([*lines, "</svg>\n"]), encoding="utf-8")


def write_dxf(drawn: Drawing, path: Path) -> None:
    """Write a drawing as DXF R2010, in millimetres.

    Raises
    ------
    ImportError
        If ezdxf is not installed.
    """
    try:
        ezdxf: Any = importlib.import_module("ezdxf")
    except ImportError as error:
        raise ImportError(f"DXF needs ezdxf: install the extra, {pip_install('render')}") from error
    document = ezdxf.new("R2010", units=4)  # millimetres
    for layer, (_, colour) in COLOURS.items():
        document.layers.add(layer, color=colour)
    space, align = document.modelspace(), ezdxf.enums.TextEntityAlignment
    for layer, corners in drawn.outlines:
        space.add_lwpolyline(corners.tolist(), close=True, dxfattribs={"layer": layer})
    for words, place, centred in drawn.texts:
        text = space.add_text(words, height=_TEXT, dxfattribs={"layer": "TEXT"})
        how = align.MIDDLE_CENTER if centred else align.MIDDLE_LEFT
        text.set_placement(place.tolist(), align=how)
    document.saveas(path)


WRITERS: dict[str, Callable[[Drawing, Path], None]] = {".svg": write_svg, ".dxf": write_dxf}
"""Functions that write a drawing, by file suffix."""
