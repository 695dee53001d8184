"""Baselines on disk: shipped with the package, or computed once and cached for the user."""

import hashlib
import json
import logging
from collections.abc import Iterable
from dataclasses import asdict
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from magfold_env.envs.baselines.baseline import (
    CANDIDATE_SPEEDS,
    SCORING_DRAWS,
    SELECTION_DRAWS,
    Baseline,
    designs,
    evaluate_design,
)
from magfold_env.envs.tasks.goals import Match
from magfold_env.files import configs_dir, write_text
from magfold_env.scene import Scene

PHYSICS_VERSION = "5"
"""Changes whenever the same scene may fold differently, which makes older baselines void."""

_log = logging.getLogger(__name__)


class BaselineStore:
    """Looks up the baselines of one scene; computes and caches those that are missing.

    Parameters
    ----------
    scene : Scene
        Tube scene with its spreads.
    match : {"word", "outline"}
        What counts as a success.
    """

    def __init__(self, scene: Scene, match: Match = "word") -> None:
        self._scene = scene
        self._match: Match = match
        self._key = baseline_key(scene, match)
        self._known: dict[str, Baseline] = dict(_shipped().get(self._key, {}))

    def get(self, target: str) -> Baseline:
        """Return the baseline of `target`; may take some seconds the first time."""
        if target not in self._known:
            self._known[target] = self._cached(target)
        return self._known[target]

    @cached_property
    def _designs(self) -> dict[str, tuple[str, ...] | None]:
        """The design for every target; one search finds them all."""
        return designs(self._scene)

    def _cached(self, target: str) -> Baseline:
        """Return the baseline from the user's cache, computed and put there if need be."""
        path = cache_folder() / self._key / f"{target}.json"
        if path.is_file():
            return _from_dict(json.loads(path.read_text(encoding="utf-8")))
        _log.info("computing the baseline of %s", target)
        baseline = evaluate_design(self._scene, target, self._designs[target], self._match)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(asdict(baseline)) + "\n")
        return baseline


def baseline_key(scene: Scene, match: Match = "word") -> str:
    """Return a hash of everything that a baseline depends on besides its target."""
    content = scene.model_dump(mode="json")
    if match != "word":
        content["match"] = match
    # The agent chooses these, the design replaces them.
    del content["sequence"], content["feed"]["speed"]
    if not (scene.field and scene.field.any):
        del content["field"]  # one that does not act is none
    for name in ("feed_jitter", "magnet"):
        if not content["spreads"][name]:
            del content["spreads"][name]  # so that older baselines stay known
    content |= {
        "components": scene.n,
        "physics": PHYSICS_VERSION,
        "protocol": [CANDIDATE_SPEEDS, SELECTION_DRAWS, SCORING_DRAWS],
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def cache_folder() -> Path:
    """Return the folder of computed baselines."""
    return user_cache_path("magfold_env") / "baselines"


def shipped_folder() -> Path:
    """Return the folder of the baselines that come with the package."""
    return configs_dir() / "baselines"


def save_shipped(name: str, scene: Scene, baselines: Iterable[Baseline]) -> Path:
    """Write the baselines of `scene` to the shipped file `name` and return its path."""
    path = shipped_folder() / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = ",\n  ".join(json.dumps(asdict(baseline)) for baseline in baselines)
    text = f'{{\n "key": "{baseline_key(scene)}",\n "baselines": [\n  {rows}\n ]\n}}\n'
    write_text(path, text)
    _shipped.cache_clear()
    return path


@cache
def _shipped() -> dict[str, dict[str, Baseline]]:
    """Return the baselines that come with the package: by key, then by target."""
    found: dict[str, dict[str, Baseline]] = {}
    for path in sorted(shipped_folder().glob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        rows = [_from_dict(row) for row in content["baselines"]]
        found[content["key"]] = {baseline.target: baseline for baseline in rows}
    return found


def _from_dict(content: dict[str, Any]) -> Baseline:
    """Return the baseline that was written as `content`."""
    sequence: list[str] | None = content.pop("sequence")
    return Baseline(sequence=None if sequence is None else tuple(sequence), **content)
