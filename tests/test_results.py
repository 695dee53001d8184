"""Figures that pages tell are those of one file of results, or of the files that commands wrote."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from magfold_env.scene.io import parse_yaml
from tests.snippets import ROOT

RESULTS: Any = parse_yaml((ROOT / "docs/results.yaml").read_text(encoding="utf-8"))
PAGES = sorted({page for result in RESULTS for page in result["pages"]})


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def rows(page: str) -> list[list[str]]:
    """Return the cells of all tables' rows but the heads."""
    found: list[list[str]] = []
    for table in re.findall(r"(?:^\|.*\n)+", text_of(page), re.MULTILINE):
        _, _, *body = table.splitlines()
        found += [[cell.strip() for cell in row.strip("|").split("|")] for row in body]
    return found


def told(page: str) -> str:
    """Return all that is listed of a page."""
    return "\n".join(
        figure
        for result in RESULTS
        if page in result["pages"]
        for figure in [*result["figures"], result["command"]]
    )


@pytest.mark.parametrize("result", RESULTS, ids=lambda result: result["figures"][0])
def test_figures_stand_on_their_pages_beside_their_command(result: Any) -> None:
    assert result.keys() == {"command", "pages", "figures"}
    for page in result["pages"]:
        text = text_of(page)
        for figure in result["figures"]:
            assert figure in text, page
        # Of a longer command a page may name the part that a reader has not seen yet.
        last = re.search(r"(--only \S+)?$", result["command"])
        assert result["command"] in text or (last and last[0] and last[0] in text), page


@pytest.mark.parametrize("page", PAGES)
def test_no_number_of_a_table_is_left_out(page: str) -> None:
    listed = set(re.findall(r"\d[\d.,]*\d|\d", told(page)))
    for _, *cells in rows(page):
        for cell in cells:
            bare = re.sub(r"`[^`]*`|\[[^]]*\]\([^)]*\)", "", cell)
            numbers = re.findall(r"\d[\d.,]*\d|\d", bare)
            assert {*numbers} <= listed, cell


def test_readme_tells_of_anchor_what_the_admission_found() -> None:
    path = Path("agents/scores/admission-Anchor-v0.json")
    found: Any = json.loads((ROOT / path).read_text(encoding="utf-8"))["rows"]
    names = "trained", "trained blind", "open loop", "oracle"
    shares = ", ".join(f"{100 * found[name]['success'][0]:.1f}" for name in names)
    assert f"| {shares} % |" in text_of("README.md")


@pytest.mark.parametrize("path", sorted((ROOT / "agents/scores").glob("admission-*.json")))
def test_tables_of_all_environments_tell_what_the_admissions_found(path: Path) -> None:
    found: Any = json.loads(path.read_text(encoding="utf-8"))
    name = found["id"].removeprefix("MagFold/").removesuffix("-v0")

    def told(page: str, *contestants: str) -> None:
        (row,) = (cells for cells in rows(page) if cells[0] == f"`{name}`")
        for contestant in contestants:
            rate, low, high = (100 * each for each in found["rows"][contestant]["success"])
            share = f"{rate:.1f} % ({low:.1f}–{high:.1f})".replace("100.0", "100")
            assert share in " ".join(row), contestant

    told("docs/environments/index.md", "trained", "open loop")
    told("agents/README.md", "trained", "open loop", "oracle")
