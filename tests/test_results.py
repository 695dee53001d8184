"""Tests that numbers on pages agree with the results file or with files of commands."""

import re
from typing import Any

import pytest

from magfold_env.scene.io import parse_yaml
from tests.snippets import ROOT

RESULTS: Any = parse_yaml((ROOT / "docs/results.yaml").read_text(encoding="utf-8"))


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


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
