"""Baselines: the scores that energy minimisation achieves. Rewards may subtract them.

For a target word, the energy minimiser designs the sequence with the largest gap between the
target's energy and its best competitor's. That design is fed out of the tube at the best of five
speeds, and the baseline b is its mean score over `SCORING_DRAWS` draws of the physics. The speed
is chosen on other draws, so that chance does not inflate b. Some baselines come with the package;
the others are computed once and cached on disk.
"""

import hashlib
import json
import logging
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any
from zlib import crc32

import numpy as np
from platformdirs import user_cache_path
from pydantic import Field, TypeAdapter

from magfold_env.designer import gap_designs
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST
from magfold_env.envs.tasks.goals import Match, judged
from magfold_env.files import configs_dir, write_text
from magfold_env.minimiser import LONGEST_OF_ALL
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words
from magfold_env.simulation.simulate import simulate

CANDIDATE_SPEEDS: tuple[float, ...] = tuple(np.geomspace(SLOWEST, FASTEST, 5).tolist())
"""Candidate feed speeds of a design [m/s]; each applies to the whole chain."""

SELECTION_DRAWS = 16
SCORING_DRAWS = 64


_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Speed = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
_Faces = Annotated[str, Field(pattern=r"^[NS-]{4}$")]


@dataclass(frozen=True)
class Baseline:
    """The energy minimiser's result for a target, or the best constant speed of a given chain."""

    target: str
    """The target word, or several words joined by hyphens, in order."""
    sequence: tuple[_Faces, ...] | None
    """The design or the given chain; None if there is no design."""
    speed: _Speed | None
    """Feed speed at which the chain scores best [m/s]."""
    score: _Share
    """The mean score b; 0 without a design."""
    success: _Share
    """Share of the draws that ended in success; 0 without a design."""
    direction: str | None = None
    """Feed direction; None unless the task gives the chain or the tray."""
    later: tuple[_Speed, ...] = ()
    """Speeds of the pull and of the second push, if the chain folds twice [m/s]."""
    tray: tuple[_Faces, ...] = ()
    """The components on the tray from which `sequence` is taken, if there is a tray."""

    @property
    def name(self) -> str:
        """Key in the cache: the target, and the chain or tray if one is given."""
        parts = self.tray or self.sequence
        if self.direction is None or parts is None:
            return self.target
        return chain_name(parts, self.direction, self.target)

    @property
    def flagged(self) -> bool:
        """Whether b is 0 because there is no design."""
        return self.sequence is None


_STORED = TypeAdapter(Baseline)


def chain_name(sequence: Iterable[str], direction: str, target: str) -> str:
    """Return the cache key of the baseline of a given chain."""
    return f"{direction}-{'-'.join(sequence)}-{target}"


def unknown_baseline(target: str) -> Baseline:
    """Return the flagged baseline of a target without a design."""
    return Baseline(target, sequence=None, speed=None, score=0.0, success=0.0)


def designs(scene: Scene) -> dict[str, tuple[str, ...] | None]:
    """Return the minimiser's design for every fully folded word, or None for words without one.

    A single search finds all designs; it takes some seconds for six components. Longer chains have
    no designs, because the exhaustive search does not cover them.
    """
    words = folded_words(scene.n)
    if scene.n > LONGEST_OF_ALL:
        return dict.fromkeys(words)
    return gap_designs(scene, words)


def evaluate_design(
    scene: Scene, target: str, sequence: tuple[str, ...] | None, match: Match = "word"
) -> Baseline:
    """Return the baseline that a design achieves for `target`; a flagged one without a design.

    The design replaces the sequence and feed speeds of `scene`, whose spreads set the draws.
    """
    if sequence is None:
        return unknown_baseline(target)
    designed = scene.replace(sequence=sequence)

    def trial(speed: float, stream: str, draws: int) -> tuple[float, float]:
        """Return the mean score and the share of successes over fixed draws of a named stream."""
        at_speed = designed.replace(feed={"speed": speed})
        folds = [
            simulate(at_speed.draw(draw_generator(stream, index)))
            for index in range(draws if _draws_anything(designed) else 1)
        ]
        _, score, success = judged(target, match, folds)
        return float(score.mean()), float(success.mean())

    trials = [trial(speed, "selection", SELECTION_DRAWS) for speed in CANDIDATE_SPEEDS]
    # argmax returns the first, and so the slowest, of equally good speeds.
    speed = CANDIDATE_SPEEDS[int(np.argmax([mean for mean, _ in trials]))]
    mean, success = trial(speed, "scoring", SCORING_DRAWS)
    return Baseline(target, sequence, speed, mean, success)


def draw_generator(stream: str, index: int) -> np.random.Generator:
    """Return the random generator for draw `index` of a named stream; streams never overlap."""
    key = (crc32(stream.encode()), index)
    return np.random.default_rng(np.random.SeedSequence(0, spawn_key=key))


def _draws_anything(scene: Scene) -> bool:
    """Return whether two draws of `scene` differ; if they do not, one run is enough."""
    return scene.draw(draw_generator("probe", 0)) != scene.draw(draw_generator("probe", 1))


LATER_SPREADS = (
    "friction_decades", "feed_jitter", "magnet", "side", "inset", "obstacle_width",
    "obstacle_offset", "tilt",
)  # fmt: skip
PHYSICS_VERSION = "12"
"""A version that changes when the same scene may fold differently; older baselines are not used."""

_log = logging.getLogger(__name__)


class Store:
    """Looks up baselines; computes and caches those that are missing.

    `key` is a hash of everything that the baselines depend on besides their names.
    """

    def __init__(self, key: str) -> None:
        self.key = key
        self._known: dict[str, Baseline] = dict(_shipped().get(key, {}))

    def get(self, name: str) -> Baseline:
        """Return the baseline of a target or task; the first call may take some seconds."""
        if name not in self._known:
            self._known[name] = self._cached(name)
        return self._known[name]

    @abstractmethod
    def compute(self, name: str) -> Baseline:
        """Compute the baseline of a target or task without the cache."""

    def _cached(self, name: str) -> Baseline:
        """Return the baseline from the user's cache; compute and store a missing one."""
        path = cache_folder() / self.key / f"{name}.json"
        with suppress(OSError, ValueError):  # a damaged file is replaced
            found = _STORED.validate_json(path.read_bytes(), strict=True)
            if found.name == name:
                return found
        _log.info("computing the baseline of %s", name)
        baseline = self.compute(name)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_text(path, json.dumps(asdict(baseline)) + "\n")
        except OSError as error:
            _warn_once(f"{path.parent}: cannot store baselines: {error.strerror}")
        return baseline


class BaselineStore(Store):
    """Baselines of target words in a scene, whose spreads set the draws."""

    def __init__(self, scene: Scene, match: Match = "word") -> None:
        super().__init__(baseline_key(scene, match))
        self._scene = scene
        self._match: Match = match

    @cached_property
    def _designs(self) -> dict[str, tuple[str, ...] | None]:
        """The designs for all targets, found by a single search."""
        return designs(self._scene)

    def compute(self, name: str) -> Baseline:
        """Compute the baseline of a target without the cache."""
        return evaluate_design(self._scene, name, self._designs[name], self._match)


DESIGN_PROTOCOL = (CANDIDATE_SPEEDS, SELECTION_DRAWS, SCORING_DRAWS)


def baseline_key(
    scene: Scene, match: Match = "word", protocol: Sequence[Any] = DESIGN_PROTOCOL
) -> str:
    """Return a hash of a scene, the rule for success and the method that computes baselines."""
    content = scene.model_dump(mode="json")
    if match != "word":
        content["match"] = match
    # The agent chooses these and the design replaces them.
    del content["sequence"], content["feed"]["speed"]
    if not (scene.field and scene.field.any):
        del content["field"]  # a field of zero counts as none
    # Unused keys that older scenes lacked are omitted, so that hashes stay the same.
    for group, names in ((content, ("obstacles", "bumps")), (content["spreads"], LATER_SPREADS)):
        for name in names:
            if not group[name]:
                del group[name]
    content |= {
        "components": scene.n,
        "physics": PHYSICS_VERSION,
        "protocol": protocol,
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def cache_folder() -> Path:
    """Return the folder in which computed baselines are cached."""
    return user_cache_path("magfold_env") / "baselines"


def shipped_folder() -> Path:
    """Return the folder of the baselines that come with the package."""
    return configs_dir() / "baselines"


@cache
def _shipped() -> dict[str, dict[str, Baseline]]:
    """Return the baselines that come with the package, by the key of their store and by name."""
    found: dict[str, dict[str, Baseline]] = {}
    for path in sorted(shipped_folder().glob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        rows = [_STORED.validate_python(row) for row in content["baselines"]]
        found[content["key"]] = {baseline.name: baseline for baseline in rows}
    return found


@cache
def _warn_once(message: str) -> None:
    _log.warning(message)
