"""Build the laboratory, a web page: kernels, packed memory with its layout, scripts and HTML."""

import base64
import hashlib
import json
import os
import re
import shutil
import tempfile
import time
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from string import Template
from typing import Any

from filelock import FileLock

from magfold_env import replay
from magfold_env.browser import episode as episodes
from magfold_env.browser import (
    games,
    memory,
    settings,
    states,
    view,
    wasm,
)
from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.compile import by_pointer
from magfold_env.engine.compile.kernel_cache import cache_root
from magfold_env.engine.stepping import runs
from magfold_env.engine.stepping.integrator import LONGEST_STEP
from magfold_env.envs.chains.arrays import STATUSES
from magfold_env.files import sources_digest, write_text
from magfold_env.fold import FoldStatus
from magfold_env.replay.data import WORDS
from magfold_env.scene import Scene
from magfold_env.scene.base import LENGTH, PLACE, REMANENCE, SPEED
from magfold_env.scene.magnets import ROUNDING
from magfold_env.scene.scene import BORE
from magfold_env.scene.sections import MOST_STEPS
from magfold_env.simulation import far_table, near_table, pack
from magfold_env.simulation.endings import BREAKDOWNS
from magfold_env.simulation.frames import APART

FORMAT = "magfold_env browser 1"
KERNELS, MEMORY, LAYOUT, GAMES = "engine.wasm", "memory.bin", "layout.json", "games.json"
PAGE = "index.html"
PACKED = Path(__file__).with_name("laboratory.html")
"""The page as shipped in a wheel, which needs no linker."""

KEPT = 7.0 * 24.0 * 3600.0
"""Time after which an unused folder is removed [s]."""

# The page's scripts, each after the scripts that it depends on.
SCRIPTS = ("scene.js", "engine.js", "networks.js", "games.js")
_LAB = (
    "editor.js", "ghost.js", "share.js", "states.js", "sheet.js", "play.js", "laboratory.js"
)  # fmt: skip
_SOURCES = '<meta name="sources" content="{}">'
_POLICY = (
    "default-src 'none'; script-src 'wasm-unsafe-eval' {script}; style-src {style}; "
    "img-src data:; base-uri 'none'; form-action 'none'"
)
_ROOMS = ("browser", "engine", "envs", "minimiser", "scene", "simulation")
INTERNAL = ("work", "probe")  # fields that pages do not use


def page() -> Path:
    """Return the laboratory's page: the wheel's, or one built from a checkout at first use.

    Raises
    ------
    RuntimeError
        If the page must be built, but the linker or a part of numba is missing.
    """
    return PACKED if PACKED.is_file() and is_of(PACKED, _sources()) else kept() / PAGE


def kept() -> Path:
    """Return a folder of files built from the current sources; build them if necessary."""
    root = cache_root() or Path(tempfile.gettempdir())
    found = root / f"browser-{_sources()}"
    with FileLock(root / "browser.lock"):
        if not found.is_dir():
            made = found.with_suffix(f".{os.getpid()}")
            build(made)
            made.rename(found)
        found.touch()
        # Keep folders in recent use, since other checkouts may need them.
        for other in root.glob("browser-" + "[0-9a-f]" * 16):
            if time.time() - other.stat().st_mtime > KEPT:
                shutil.rmtree(other, ignore_errors=True)
        # Files that need no compiler may have changed since the folder was built.
        write_page(found)
    return found


def build(folder: Path) -> dict[str, int]:
    """Write all that a page needs into a folder; return the files' sizes [bytes].

    The same sources always give the same bytes.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in {KERNELS: module(), **packed_memory()}.items():
        folder.joinpath(name).write_bytes(content)
    write_page(folder)
    return {each.name: each.stat().st_size for each in sorted(folder.iterdir())}


def write_page(folder: Path) -> None:
    """Write the scripts and the self-contained page into a folder that holds the compiled files."""
    for name in SCRIPTS:
        write_text(folder / name, _source(name))
    played = {"games": games.games(), "networks": games.networks()}
    write_text(folder / GAMES, json.dumps(played, separators=(",", ":"), allow_nan=False))
    engine = {
        "wasm": base64.b64encode(folder.joinpath(KERNELS).read_bytes()).decode(),
        "memory": base64.b64encode(folder.joinpath(MEMORY).read_bytes()).decode(),
        "layout": json.loads(folder.joinpath(LAYOUT).read_bytes()),
        **played,
    }
    write_text(folder / PAGE, html(_sources(), engine))


def html(sources: str, engine: dict[str, Any]) -> str:
    """Return the page that contains ``engine`` and names the hash of its ``sources``.

    It is the replay's page with the engine added. It loads nothing from elsewhere, and its security
    policy allows only its own script to run.
    """
    script = "\n".join(
        [
            *(replay.source(name) for name in replay.SCRIPTS),
            _as_function(SCRIPTS, ("Engine", "GAMES", "Network", "SceneError", "readScene")),
            *(_source("lab", name) for name in _LAB),
        ]
    )
    style = replay.source("page.css") + _source("lab", "page.css")
    return Template(_source("lab", "page.html")).substitute(
        sources=_SOURCES.format(sources),
        controls=replay.source("controls.html"),
        policy=_POLICY.format(script=_hash(script), style=_hash(style)),
        style=style,
        words=WORDS,
        engine=json.dumps(engine, separators=(",", ":")).replace("<", "\\u003c"),
        script=script,
    )


def is_of(path: Path, sources: str) -> bool:
    """Return whether the page in a file contains the engine built from these sources."""
    with path.open(encoding="utf-8") as file:
        return _SOURCES.format(sources) in file.read(1000)


def _as_function(modules: tuple[str, ...], names: tuple[str, ...]) -> str:
    """Return scripts as one function, so that their names do not clash with other names."""
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


def _sources() -> str:
    """Return a hash of everything from which kernels and packed memory are built."""
    return sources_digest(*(f"{name}/**/*.py" for name in _ROOMS), "*.py")


def module() -> bytes:
    """Return the kernels as a WebAssembly module."""
    if not by_pointer.POINTERS:
        raise RuntimeError("needs kernels that take tuples by pointer, see engine.compile")
    shared = memory.shared_of(memory.standard(2))
    magnets, single = shared.magnets, shared.far_magnets
    chain = memory.chain_of(memory.standard(2), magnets, shared.couplings)
    model, state, work, _, record, choice, seen, search, episode = chain
    moving = model, state, work
    return wasm.module(
        {
            "size_magnets": (pack.size_magnets, (shared.sizing, magnets)),
            "fill_near_table": (
                near_table.fill_near_table, (shared.near, shared.near_magnets, 0.0)
            ),
            "fill_far_table": (far_table.fill_far_table, (shared.far, single, 0.0)),
            "far_error": (far_table.far_error, (shared.far, single, magnets.tables.far, 0.0)),
            "resize": (settings.resize, (shared.sizing, magnets, 0.0, choice, model)),
            "set_up": (settings.set_up, (choice, model, state, seen)),
            "draw": (settings.draw, (choice, model, 0.0)),
            "overlap": (settings.overlap, (choice, *moving)),
            "choose": (settings.choose, (choice, state, 0)),
            "run": (runs.run, (*moving, record, 0.0)),
            "energy": (runs.energy, (*moving, 0.0)),
            "look": (view.look, (0, *moving, record, seen, 0)),
            "ending": (view.ending, (0, state, seen)),
            "couple": (states.couple, (shared.couplings, magnets, 0, 0)),
            "begin_search": (states.begin_search, (choice, shared.couplings, search)),
            "visit": (states.visit, (search, 0)),
            "take_in": (episodes.take_in, (0, seen, episode)),
            "observe": (episodes.observe, (model, episode)),
            "film": (episodes.film, (model, episode)),
            "judge": (episodes.judge, (episode,)),
        }
    )  # fmt: skip


def packed_memory() -> dict[str, bytes]:
    """Return the packed memory for chains of all lengths, and its layout."""
    shared, chains = memory.images()
    data, model = bytearray(), pack.pack(memory.standard(2))
    far, _ = memory.place_of(model.magnets, "tables.far")
    begin, magnets = memory.place_of(model, "magnets")
    words = {"far": far, "magnets": begin, "count": len(magnets.words) // memory.WORD}
    blocks: dict[str, Any] = {"shared": _told(shared, data)}
    blocks["chains"] = {str(n): _told(image, data) for n, image in chains.items()}
    layout = {"format": FORMAT, "version": version("magfold_env"), "words": words}
    layout |= constants() | blocks
    text = json.dumps(layout, separators=(",", ":"), allow_nan=False)
    return {MEMORY: bytes(data), LAYOUT: text.encode()}


def _told(image: memory.Image, data: bytearray) -> dict[str, Any]:
    """Append a block's pieces to ``data``; return the layout with which a page loads it."""
    first = len(data)
    data += image.data
    found = {name: value for name, value in image._asdict().items() if name != "data"}
    # Differences take less space than places.
    for name in ("own", "shared"):
        places = [0, *found[name]]
        found[name] = [b - a for a, b in pairwise(places)]
    fields = {
        name: list(field)
        for name, field in image.fields.items()
        if name.split(".")[0] not in INTERNAL
    }
    return found | {"first": first, "fields": fields}


def constants() -> dict[str, Any]:
    """Return a scene's defaults and the numbers that kernels and a page must share."""
    scene = Scene(sequence=("NNNN",))
    assert scene.magnets is not None
    accuracy = scene.magnets.accuracy
    limits = {"place": PLACE, "remanence": REMANENCE, "speed": SPEED, "length": LENGTH}
    return {
        "choice": _numbers(settings, "MOUNT FORWARD AT_MOUTH OBSTACLES"),
        "number": _numbers(
            settings, "NORMAL DURATION FORCE_LIMIT BORE WALL INTERVAL TOLERANCE MAX_STEPS"
        ),
        "counter": _numbers(ix, "N_HELD STEPS EVALUATIONS FRAMES KEEP"),
        "clock": _numbers(ix, "TIME FRAME_TIME"),
        "account": _numbers(ix, "PEAK IMPULSE"),
        "view": _numbers(view, "MAGNETIC KINETIC TIME ADVANCE PUSH RELEASED LOADED"),
        "progress": _numbers(states, "FOUND"),
        "outcome": _numbers(outcomes, "REACHED RESTED PAUSED TIMED_OUT"),
        "mounts": list(settings.MOUNTS),
        "statuses": [status.value for status in view.STATUSES],
        "breakdowns": {
            str(outcome): [status.value, reason] for outcome, (status, reason) in BREAKDOWNS.items()
        },
        "failed": FoldStatus.FAILED.value,
        "apart": APART,
        "fastestFrames": (memory.FRAMES - 8) / LONGEST_STEP,
        "mostObstacles": settings.MOST_OBSTACLES,
        "ends": [str(each) for each in STATUSES],
        "scene": scene.model_dump(mode="json"),
        "bore": BORE,
        "rounding": ROUNDING,
        "tableErrors": [pack.TABLE_SHARE * accuracy, pack.FAR_SHARE * accuracy],
        "most": {name: each._asdict() for name, each in limits.items()} | {"steps": MOST_STEPS},
        "shortest": memory.LENGTHS[0],
        "longest": memory.LENGTHS[-1],
    }


def _numbers(module: Any, names: str) -> dict[str, int]:
    return {name: getattr(module, name) for name in names.split()}
