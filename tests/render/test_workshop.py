"""Tests of workshop drawings: SVG and DXF, true to size in millimetres."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.render import save_sheet
from tests.folds import lying

ANCHOR = mf.load_scene("anchor")
FOLD = lying(ANCHOR, "LRLLL")
_SVG = "{http://www.w3.org/2000/svg}"

Outlines = list[tuple[str, Any]]


def of_svg(path: Path) -> tuple[Outlines, list[str]]:
    """Return the outlines of a file [mm] by layer, and its texts."""
    root = ElementTree.parse(path).getroot()
    width, height = root.attrib["width"], root.attrib["height"]
    assert root.attrib["viewBox"] == f"0 0 {width.removesuffix('mm')} {height.removesuffix('mm')}"
    found: Outlines = []
    for each in root.findall(f"{_SVG}polygon"):
        corners = [point.split(",") for point in each.attrib["points"].split()]
        # y is down in the file.
        found.append((each.attrib["class"], np.array(corners, dtype=float) * [1.0, -1.0]))
    return found, [each.text or "" for each in root.findall(f"{_SVG}text")]


def of_dxf(path: Path) -> tuple[Outlines, list[str]]:
    """Return the outlines of a file [mm] by layer, and its texts."""
    ezdxf: Any = pytest.importorskip("ezdxf")
    document = ezdxf.readfile(path)
    assert document.units == ezdxf.units.MM
    assert not document.audit().errors
    space = document.modelspace()
    lines = [(e.dxf.layer, np.array(list(e.vertices()))) for e in space.query("LWPOLYLINE")]
    assert all(e.closed for e in space.query("LWPOLYLINE"))
    return lines, [e.dxf.text for e in space.query("TEXT")]


@pytest.mark.parametrize("read", [of_svg, of_dxf])
def test_casings_and_magnets_have_their_sizes_and_places(
    read: Callable[[Path], tuple[Outlines, list[str]]], tmp_path: Path
) -> None:
    if read is of_dxf:
        pytest.importorskip("ezdxf")
    path = tmp_path / f"sheet.{read.__name__[3:]}"
    save_sheet(ANCHOR, FOLD, path, "mine & yours")
    outlines, texts = read(path)
    magnets = ANCHOR.magnets
    assert magnets is not None
    shapes = iter(outlines)
    for faces in ANCHOR.sequence:
        layer, casing = next(shapes)
        assert layer == "CASINGS"
        edges = np.linalg.norm(casing - np.roll(casing, 1, axis=0), axis=1)
        np.testing.assert_allclose(edges, 1e3 * ANCHOR.casing.side, atol=1e-3)
        for f, way in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
            if faces[f] == "-":
                continue
            layer, block = next(shapes)
            assert layer == "MAGNETS"
            sides = np.linalg.norm(np.diff(block, axis=0), axis=1)[:2]
            wanted = [1e3 * magnets.by_face(name)[f] for name in ("width", "thickness")]
            np.testing.assert_allclose(sides, wanted, atol=1e-3)
            depth = (block - casing.mean(axis=0)) @ (np.array(way) / np.sqrt(2.0))
            inset = 1e3 * magnets.by_face("inset")[f]
            assert depth.max() == pytest.approx(0.5e3 * ANCHOR.casing.side - inset, abs=1e-3)
    assert next(shapes, None) is None
    assert texts[0] == "mine & yours"
    assert sum(text in ("N A", "N B", "S A", "S B") for text in texts) == 22
    assert {"1", "6"} <= set(texts)


def test_dxf_says_what_it_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(ImportError, match=r"^DXF needs ezdxf: install the extra, pip install"):
        save_sheet(ANCHOR, FOLD, tmp_path / "sheet.dxf")
    assert not list(tmp_path.iterdir())
