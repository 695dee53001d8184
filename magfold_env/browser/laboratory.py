"""The laboratory: one HTML file in which chains are set by hand and fold, wherever it is opened.

It is the replay's page with the engine in it. Nothing in it is loaded from elsewhere, and its
security policy lets nothing run but its one script.
"""

import base64
import hashlib
import json
import re
from pathlib import Path
from string import Template

from magfold_env.replay import SCRIPTS
from magfold_env.replay import source as replay_source
from magfold_env.replay.data import WORDS

# In the order in which they build on each other.
_ENGINE = ("scene.js", "engine.js", "networks.js", "games.js")
_SCRIPTS = (
    "editor.js",
    "ghost.js",
    "share.js",
    "states.js",
    "sheet.js",
    "play.js",
    "laboratory.js",
)
_SOURCES = '<meta name="sources" content="{}">'
_POLICY = (
    "default-src 'none'; script-src 'wasm-unsafe-eval' {script}; style-src {style}; "
    "img-src data:; base-uri 'none'; form-action 'none'"
)


def page(sources: str, wasm: bytes, memory: bytes, layout: bytes, games: bytes) -> str:
    """Return the page, with what `magfold_env.browser.build` made of the engine in it.

    It names the hash of the ``sources`` of that.
    """
    script = "\n".join(
        [
            *(replay_source(name) for name in SCRIPTS),
            _as_function(_ENGINE, ("Engine", "GAMES", "Network", "SceneError", "readScene")),
            *(_source("lab", name) for name in _SCRIPTS),
        ]
    )
    style = replay_source("page.css") + _source("lab", "page.css")
    engine = {
        "wasm": base64.b64encode(wasm).decode(),
        "memory": base64.b64encode(memory).decode(),
        "layout": json.loads(layout),
        **json.loads(games),
    }
    return Template(_source("lab", "page.html")).substitute(
        sources=_SOURCES.format(sources),
        controls=replay_source("controls.html"),
        policy=_POLICY.format(script=_hash(script), style=_hash(style)),
        style=style,
        words=WORDS,
        engine=json.dumps(engine, separators=(",", ":")).replace("<", "\\u003c"),
        script=script,
    )


def is_of(path: Path, sources: str) -> bool:
    """Return whether a page in a file has the engine of such sources in it."""
    with path.open(encoding="utf-8") as file:
        return _SOURCES.format(sources) in file.read(1000)


def _as_function(modules: tuple[str, ...], names: tuple[str, ...]) -> str:
    """Return modules as one function whose names do not meet those of others."""
    text = "\n".join(_source(name) for name in modules)
    text = re.sub(r"^(import|export) \{.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^export ", "", text, flags=re.MULTILINE)
    told = ", ".join(names)
    return f"const {{ {told} }} = (() => {{\n{text}\nreturn {{ {told} }};\n}})();"


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def _source(*path: str) -> str:
    return Path(__file__).parent.joinpath(*path).read_text(encoding="utf-8")
