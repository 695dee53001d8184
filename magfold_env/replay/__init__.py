"""The replay page: one HTML file that plays a recorded fold in any browser.

The page needs neither a network nor an extra. It consists of `page.html`, into which `page.css`,
the scripts and the fold as JSON are inserted.
"""

import html
import json
from pathlib import Path
from string import Template
from typing import Any

from magfold_env.files import write_text
from magfold_env.replay.data import WORDS, Recording, page_data

__all__ = ["SCRIPTS", "Recording", "page", "page_data", "source", "write_html"]

SCRIPTS = (
    "dom.js",
    "motion.js",
    "chain.js",
    "surroundings.js",
    "camera.js",
    "plot.js",
    "player.js",
)
"""Scripts that play motions, each after those that it needs; `source` returns their texts."""


def write_html(fold: Recording, path: str | Path) -> None:
    """Write a page that plays a recorded fold and contains everything it needs.

    Parameters
    ----------
    fold
        The recording of the fold.
    path
        Path of the page, which is written under a temporary name first.
    """
    write_text(path, page(page_data(fold)))


def page(data: dict[str, Any]) -> str:
    """Return the page for a fold described by `page_data`."""
    title = f"Fold {data['word'] or '(one component)'}, {data['status']}"
    return Template(source("page.html")).substitute(
        title=html.escape(title),
        words=WORDS,
        style=source("page.css"),
        controls=source("controls.html"),
        script="\n".join(source(name) for name in (*SCRIPTS, "start.js")),
        data=_inline_json(data),
    )


def _inline_json(data: dict[str, Any]) -> str:
    """Return JSON in which `</script>` and `<!--` are escaped."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def source(name: str) -> str:
    """Return the text of one of the page's source files."""
    return (Path(__file__).parent / name).read_text(encoding="utf-8")
