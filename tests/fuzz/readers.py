"""All kinds of files that users can supply, with their readers and with valid contents.

A reader may succeed or raise a `ValueError` that names the file. Anything else is a defect.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import tempfile
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import stable_baselines3

import magfold_env as mf
from agents.evaluation.policies import ChoiceFile, Chosen, read_choices
from agents.settings import load_settings
from agents.training import policy_files
from agents.training.models import read_archive, write_archive
from magfold_env.checkpoint import FILE
from magfold_env.designer import Design, Evidence
from magfold_env.designer.suites import load_suite
from magfold_env.envs.tasks.feed_tasks import read_tasks
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.files import configs_dir
from magfold_env.scoring import action_file
from magfold_env.scoring.network import Actor
from magfold_env.scoring.results import Results
from tests.killed import records_in

SCENE = mf.Scene(sequence=("NSNS", "SN-N"), duration=0.01)
KEY: dict[str, Any] = {"seed": 1, "settings": {"n": [1, 2]}}


@dataclass(frozen=True)
class Reader:
    """A kind of file."""

    suffix: str
    read: Callable[[Path], object]
    whole: Callable[[], list[bytes]]
    """Contents of files that are read without error."""
    signed: Callable[[bytes], bytes] = lambda content: content
    """Corrects the checksum of a changed file, so that reading continues after its check."""


def outcome(reader: Reader, content: bytes) -> str:
    """Read a file; return the error message, or "" if there was no error.

    Raises every exception that is not a clear error.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"given{reader.suffix}"
        path.write_bytes(content)
        try:
            reader.read(path)
        except ValueError as error:
            if "given" not in str(error):
                raise AssertionError(f"does not name the file: {error!r}") from error
            return str(error)
    return ""


def _shipped(folder: str, most: int) -> list[bytes]:
    found = [path.read_bytes() for path in sorted((configs_dir() / folder).rglob("*.yaml"))]
    return [content for content in found if len(content) < most]


def _scenes() -> list[bytes]:
    saved = _written(lambda path: mf.save_scene(mf.load_scene("anchor"), path))
    return [*_shipped("scenes", 4000), saved]


def _suites() -> list[bytes]:
    text = """scene_name: tube-feed
words:
  LR:
    ground: {sequence: NSNS SNSN NNSS, gap: 1.0e-3}
    forward: {sequence: NSNS SNSN NNSS, speed: 0.1, successes: 3, releases: 4}
  LL:
    unique: {certificate: none of them}
"""
    return [text.encode()]


def _signed(content: bytes) -> bytes:
    """Correct the checksum of a file of choices, which is the hash of its other content."""
    try:
        data = json.loads(content)
        data.pop("checksum", None)
        text = json.dumps(data, sort_keys=True)
        return json.dumps({"checksum": hashlib.sha256(text.encode()).hexdigest(), **data}).encode()
    except (ValueError, AttributeError, TypeError, RecursionError):
        return content


def _read_state(path: Path) -> None:
    """Read a file as the state of an ensemble."""
    state = path.with_name("given")
    state.mkdir()
    path.rename(state / FILE)
    try:
        mf.ensemble(SCENE, 2, state=state, workers=1)
    except OSError as error:  # as a file on another disk would be told
        raise ValueError(str(error)) from None


@cache
def _states() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        mf.ensemble(SCENE, 2, state=folder, workers=1)
        return [(Path(folder) / FILE).read_bytes()]


def _read_record(path: Path) -> None:
    """Read a file as one record of an ensemble's state."""
    content = path.read_bytes()
    path.write_bytes(_states()[0])
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE records SET record = ? WHERE number = 1", [content])
    _read_state(path)


def _records() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        mf.ensemble(SCENE, 2, state=folder, workers=1)
        return [json.dumps(record).encode() for record in records_in(Path(folder)).values()]


def _read_choices(path: Path) -> None:
    read_choices(path)
    ChoiceFile(path, KEY)


def _choices() -> list[bytes]:
    chosen = Chosen(("NSNS",) * 3, (0.1,) * 3, calls=10, successes=3, releases=4)
    return [_written(lambda path: ChoiceFile(path, KEY).add("LR", chosen))]


def _written(write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole"
        write(path)
        return path.read_bytes()


def _designs() -> list[bytes]:
    evidence = asdict(Evidence(-1e-3, 1e-4, "R", 0.1, stable=True, only_stable=False))
    data = {
        "format": "magfold_env design 1", "target": "L", "mode": "forward",
        "objective": "ground", "search": "exhaustive", "scene": SCENE.model_dump(mode="json"),
        "reached": True, "score": 1e-4, "bound": None, "evidence": evidence, "probability": None,
        "releases_seed": 0, "calls": {"energies": 3}, "certificate": "",
    }  # fmt: skip
    return [json.dumps(data).encode()]


def _policies() -> list[bytes]:
    env = TubeFeedEnv(components=3, fidelity="quasistatic")
    model = stable_baselines3.PPO("MlpPolicy", env, policy_kwargs={"net_arch": [4]}, device="cpu")
    return [_written(lambda path: policy_files.save(model, path))]


TASKS = """- {sequence: [NSNS, SNNN, NNSS], direction: forward, target: LR}
- {sequence: [NSNS, SNNS, NNSS], direction: backward, target: RR}
"""
ACTIONS = {
    "format": "magfold_env actions 1", "id": "MagFold/UnknownFloor-v0", "seed": 3,
    "actions": [[0.5, -1, 1.0], [0.25]],
}  # fmt: skip
RUN = {"task": (0, 3), "success": "10", "score": (1.0, 0.25), "energy": (-0.5, None)}
RESULTS = Results.model_validate(
    {
        "view": "score", "id": "MagFold/UnknownFloor-v0", "draws": 2, "seed": 3,
        "physics": "0" * 16,
        "provenance": {"numpy": "2.0", "seconds": 1.5},
        "rows": {
            "mine": {
                "success": (0.5, 0.09453120573423057, 0.9054687942657694), "score": 0.625,
                "kind": "policy", "files": [{"name": "mine", "sha256": "0" * 64}], "runs": [RUN],
            }
        },
    }
)  # fmt: skip


def resigned(content: bytes) -> bytes:
    """Correct the checksum of a policy."""
    try:
        start = 8 + int.from_bytes(content[:8], "little")
        header = json.loads(content[8:start])
        told = json.loads(header["__metadata__"]["policy"])
        told["sha256"] = hashlib.sha256(told["settings"].encode() + content[start:]).hexdigest()
        header["__metadata__"]["policy"] = json.dumps(told)
        head = json.dumps(header).encode()
        return len(head).to_bytes(8, "little") + head + content[start:]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, OverflowError):
        return content


READERS: dict[str, Reader] = {
    "scene": Reader(".yaml", mf.load_scene, _scenes),
    "suite": Reader(".yaml", load_suite, _suites),
    "tasks": Reader(".yaml", read_tasks, lambda: [TASKS.encode()]),
    "settings": Reader(".yaml", load_settings, lambda: _shipped("agents", 4000)),
    "ensemble": Reader(
        ".json", mf.Ensemble.from_json, lambda: [_written(mf.ensemble(SCENE, 2, workers=1).to_json)]
    ),
    "sweep": Reader(
        ".json",
        mf.Sweep.from_json,
        lambda: [_written(mf.sweep(SCENE, {"friction": [0.1, 0.2]}, 2, workers=1).to_json)],
    ),
    "design": Reader(".json", Design.from_json, _designs),
    "state": Reader(".sqlite", _read_state, _states),
    "record": Reader(".json", _read_record, _records),
    "choices": Reader(".json", _read_choices, _choices, _signed),
    "archive": Reader(
        ".zip",
        lambda path: read_archive(path, KEY),
        lambda: [_written(lambda path: write_archive(path, KEY, {"a": b"1", "b": b"22"}))],
    ),
    "policy": Reader(".safetensors", policy_files.load, _policies, resigned),
    "actor": Reader(".safetensors", Actor.read, _policies, resigned),
    "actions": Reader(".json", action_file.read, lambda: [json.dumps(ACTIONS).encode()]),
    "results": Reader(".json", Results.read, lambda: [_written(RESULTS.write)]),
}
