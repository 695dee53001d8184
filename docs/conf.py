"""Settings of the site: run `sphinx-build -W docs runs/site`, then open runs/site/index.html."""

import shutil
import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike
from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation

sys.path += [str(Path(__file__).parent), str(Path(__file__).parent / "extensions")]
from environment_tables import written
from models import is_model
from moving_pictures import RUNS, package_digest

from magfold_env.browser import build as laboratory
from magfold_env.cli.scenes import scene_keys

project = "magfold_env"
author = "the magfold_env developers"
copyright = author
version = release = installed("magfold_env")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "models",
    "moving_pictures",
]
html_theme = "furo"
html_title = "magfold_env"
html_static_path = ["_static"]
html_css_files = ["site.css"]

# A name in single backticks links to the object that it names, if there is one; else it is code.
default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_preprocess_types = True
napoleon_type_aliases = {"sequence": "~collections.abc.Sequence"}
napoleon_custom_sections = [("Returns", "params_style")]
python_maximum_signature_line_length = 88
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
nb_execution_mode = "cache"
nb_execution_cache_path = str(RUNS / f"notebooks-{package_digest()}")
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True

_INCLUDED = {
    "agents/README.md": "agents.md",
    "agents/SCOREBOARD.md": "scoreboard.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
_FOR_READERS = {
    'class="caption" role="heading"': 'class="caption" role="heading" aria-level="2"',
    # Lists of parameters, one per line, are not definition lists.
    "<dl>\n<dd><em class": '<dl role="presentation">\n<dd><em class',
    '<dd><em class="sig-param"': '<dd role="presentation"><em class="sig-param"',
}
_ARRAYS = stringify_annotation(ArrayLike, "smart"), stringify_annotation(ArrayLike)


def _short(_app: Sphinx, _kind: str, _name: str, found: Any, _options: Any, *told: str) -> Any:
    """Shorten the type of array-like arguments to ``ArrayLike``, and models' signatures to keys."""
    if is_model(found):
        return "(**keys)", ""
    signature, returned = (text or "" for text in told)
    for long in _ARRAYS:
        signature = signature.replace(long, "ArrayLike")
    return signature or None, returned or None


def _linked(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Replace links to files of the repository with links to the pages that include them."""
    for path, page in _INCLUDED.items():
        for up in ("", "../"):
            source[0] = source[0].replace(f"]({up}../{path}", f"]({up}{page}")


def _keys(_app: Sphinx, page: str, source: list[str]) -> None:
    """Add the table of `magfold scenes --keys`, with units beside the limits, to its page."""
    if page == "keys":
        rows = [("key", "allowed", "default", "meaning"), ("---",) * 4]
        for key in scene_keys():
            unit = f" [{key.unit}]" if key.unit else ""
            rows.append((f"`{key.key}`", key.allowed + unit, key.default, key.meaning))
        lines = ("| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in rows)
        source[0] += "\n" + "\n".join(lines) + "\n"


def _tables(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Fill in the tables on the environments' pages."""
    source[0] = written(source[0])


def _open_to_all(_app: Sphinx, _page: str, _template: str, context: Any, _tree: object) -> None:
    """Add attributes for screen readers to the HTML of Sphinx and the theme."""
    for part in ("body", "furo_navigation_tree"):
        if written := context.get(part):
            for old, new in _FOR_READERS.items():
                written = written.replace(old, new)
            context[part] = written


def _laboratory(app: Sphinx, error: Exception | None) -> None:
    """Copy the laboratory page into the site."""
    if error is None and app.builder.format == "html":
        folder = Path(app.outdir) / "laboratory"
        folder.mkdir(exist_ok=True)
        shutil.copy(laboratory.page(), folder / "index.html")


def _forget(_app: Sphinx, error: Exception | None) -> None:
    """Remove the notebook output of other versions of the package."""
    for other in RUNS.glob("notebooks-*"):
        if error is None and str(other) != nb_execution_cache_path:
            shutil.rmtree(other)


def setup(app: Sphinx) -> None:
    """Connect the handlers for signatures, links and pages."""
    app.connect("autodoc-process-signature", _short)
    app.connect("source-read", _linked)
    app.connect("source-read", _keys)
    app.connect("source-read", _tables)
    app.connect("build-finished", _laboratory)
    app.connect("build-finished", _forget)
    app.connect("html-page-context", _open_to_all, priority=900)  # the theme has been there
