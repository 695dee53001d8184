"""A comparison of folds and episodes with those of another commit, bit for bit.

``python tests/same_bits.py`` compares results with ``tests/same_bits.json``, which contains the
first results of the present version of the physics. It takes about five minutes. ``python
tests/same_bits.py --record FILE`` writes such a file. Only public names are used, so that both
commits can run; ``PYTHONPATH`` selects one. The last bits depend on the processor and on the
versions of numba and of the C library.

On another machine, record the old commit there first, and compare by ``--against FILE``.
"""

import argparse
import hashlib
import json
import platform
import sys
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numba import __version__ as numba_version

import magfold_env as mf

RECORD = Path(__file__).with_suffix(".json")
FOLDS = 150
EPISODES = 200
ROWS = 8  # chains of a vector environment
IDS = (
    "TubeFeed", "SequenceDesign", "TubeFeedGoal", "UnknownFloor", "Reprogram", "Lumen", "Tray",
    "Anchor",
)  # fmt: skip

FOLD_VARIANTS: tuple[dict[str, Any], ...] = (
    {},
    {"actions": "discrete"},
    {"actions": "box", "randomisation": "strong"},
    {"actions": "box", "match": "outline", "reward": "score"},
    {"shaping": "similarity", "catalogue": ["NSNS", "NNSS", "SSNN", "NNNN"]},
    {"shaping": "energy", "gamma": 0.9, "components": 4, "baseline": None},
    {"fidelity": "quasistatic", "shaping": True},
    {"fidelity": "quasistatic", "actions": "box", "components": 8, "baseline": None},
    {"components": 8, "targets": "n8", "difficulty": 0.2, "baseline": None},
    {"randomisation": "none", "speeds": 3, "reward": "sparse"},
)
FLOOR_VARIANTS: tuple[dict[str, Any], ...] = (
    {},
    {"actions": "multidiscrete"},
    {"actions": "discrete", "randomisation": "strong"},
    {"match": "outline"},
    {"shaping": "similarity", "scene": "tube-built"},
    {"shaping": "energy", "gamma": 0.9},
    {"reward": "sparse", "scene": "tube-feed", "difficulty": 0.2},
)
FEED_VARIANTS: tuple[dict[str, Any], ...] = (
    {},
    {"actions": "discrete", "randomisation": "strong", "reward": "relative"},
    {"shaping": "similarity", "match": "outline"},
    {"shaping": "energy", "gamma": 0.9, "randomisation": "none", "difficulty": 0.2},
)
TRAY_VARIANTS: tuple[dict[str, Any], ...] = (
    {},
    {"actions": "discrete", "randomisation": "none"},
    {"shaping": "similarity", "match": "outline", "randomisation": "nominal"},
    {"shaping": "energy", "gamma": 0.9, "reward": "relative", "speeds": 3},
)
NOT_OF_GOALS = ("reward", "shaping", "gamma", "baseline")


class Digest:
    """A hash of texts, of exact numbers, and of containers with such values."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def add(self, value: Any) -> None:
        """Add a value and everything that it contains."""
        if isinstance(value, dict):
            for key in sorted(value):
                # The record has an info by its earlier name.
                self.add(str(key).replace("baseline_missing", "baseline_flagged"))
                self.add(value[key])
        elif isinstance(value, (list, tuple)):
            for item in value:
                self.add(item)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            self.add(value.tolist())
        elif isinstance(value, np.ndarray):
            self._hash.update(str((value.dtype.str, value.shape)).encode())
            self._hash.update(np.ascontiguousarray(value).tobytes())
        elif isinstance(value, (float, np.floating)):
            self._hash.update(np.float64(value).tobytes())
        elif isinstance(value, (bool, int, np.integer, np.bool_)):
            self._hash.update(str(int(value)).encode())
        else:
            self._hash.update(str(value).encode())

    def text(self) -> str:
        """Return the shortened hash."""
        return self._hash.hexdigest()[:16]


def digest(*values: Any) -> str:
    """Return the hash of some values."""
    found = Digest()
    found.add(values)
    return found.text()


def scenes() -> Iterator[mf.Scene]:
    """Yield random scenes of every mount, model, field, length, method, friction and loading."""
    rng = np.random.default_rng(20261123)
    fixed = {"position": (0.06, 0.09), "width": 0.02, "height": 0.02, "thickness": 0.02}
    make: Any = mf.Scene  # groups are given as mappings
    while True:
        n = int(rng.choice([1, 2, 3, 4, 5, 6, 6, 6, 8, 10, 14, 24]))
        mount = str(rng.choice(["pinned", "free", "tube", "tube"]))
        letters = "NNSS-" if rng.random() < 0.15 else "NS"
        sequence = tuple("".join(rng.choice(list(letters), 4)) for _ in range(n))
        magnets: dict[str, Any] | None = None
        kind = rng.random()
        if kind < 0.55:
            magnets = {}
        elif kind < 0.65:
            magnets = {"accuracy": float(rng.choice([1e-2, 1e-4, 1e-5]))}
        elif kind < 0.75:
            magnets = {"model": "points", "nodes": int(rng.integers(1, 5))}
        elif kind < 0.85:
            magnets = {"width": (0.004, 0.006, 0.006, 0.004), "remanence": (1.2, 0.6, 0.6, 1.2)}
        elif kind < 0.92:
            magnets = {"remanence": tuple(map(tuple, rng.uniform(0.3, 1.2, (n, 4)).tolist()))}
        field = None
        if rng.random() < 0.25:
            field = {
                "uniform": (0.0, float(rng.choice([0.0, 2e-4]))),
                "magnet": fixed if rng.random() < 0.6 else None,
            }
        method = "paper" if mount == "pinned" and rng.random() < 0.2 else "adaptive"
        yield make(
            sequence=sequence,
            mount=mount,
            magnets=magnets,
            field=field,
            friction=float(rng.choice([0.0, 0.1, 0.35, 0.35, 1.0])),
            contact=bool(rng.random() < 0.93),
            casing={"mass": 0.0037 if rng.random() < 0.8 else rng.uniform(1e-3, 1e-2, n).tolist()},
            feed={
                "direction": str(rng.choice(["forward", "backward"])),
                "speed": float(rng.choice([0.02, 0.1, 0.3])),
                "loading": str(rng.choice(["preloaded", "at_mouth"])),
            },
            gravity={"in_plane": (0.0, 0.5) if rng.random() < 0.15 else (0.0, 0.0)},
            spreads={"friction": 0.1, "remanence": 0.05, "mass": 0.05, "feed_jitter": 0.05}
            if rng.random() < 0.3
            else {},
            solver={"method": method, "max_steps": 20000}
            if method == "paper"
            else {"max_steps": 4000},
            duration=1.0,
        )


def fold_digests() -> Iterator[tuple[str, str]]:
    """Yield the hash of each fold; each third is recorded on its way, each fifth run in a batch."""
    for number, scene in enumerate(islice(scenes(), FOLDS)):
        rate = 200.0 if number % 3 == 0 else None
        fold = mf.simulate(scene, seed=number, frame_rate=rate)
        yield f"fold {number:03d}", digest(without_scene(fold))
        if number % 5 == 0:
            folds = mf.simulate_batch([scene] * 3, seeds=[number, number + 1, number + 2])
            yield f"batch {number:03d}", digest([without_scene(each) for each in folds])


def without_scene(fold: mf.Fold) -> Any:
    """Return all values of a fold, including its recorded motion, without its scene."""
    path = None if fold.trajectory is None else dict(vars(fold.trajectory))
    if path is not None:
        path.pop("side", None)  # it belongs to the scene
    return [
        fold.status.value, fold.message, fold.word, fold.angles, fold.base, fold.energy, fold.time,
        fold.steps, fold.evaluations, path,
    ]  # fmt: skip


def energy_digests() -> Iterator[tuple[str, str]]:
    """Yield hashes of forces, of accelerations, of predictions and of designs."""
    rng = np.random.default_rng(7)
    for name in mf.scene_names():
        scene = mf.load_scene(name)
        angles, rates = rng.uniform(-1.0, 1.0, (2, scene.n)).cumsum(axis=1)
        yield (
            f"smooth {name}",
            digest(
                mf.accelerations(scene, angles, rates),
                mf.forces(scene, angles),
                mf.energy(scene, angles),
            ),
        )
        if scene.magnets is None or (scene.field and scene.field.any) or scene.n > 8:
            continue
        for mode in ("free", "forward", "backward"):
            found = mf.minimise(scene, mode=mode, top=5)
            rows = [[state.word, state.energy] for state in found.states]
            yield f"minimise {name} {mode}", digest(rows)
    scene = mf.load_scene("paper/sequence-1")
    ground = mf.ground_state(scene)
    yield "ground state", digest(ground.best.word, ground.best.energy, ground.best.energy)
    design = mf.design("LRLLL", mode="forward", seed=0)
    yield "design", digest(design.sequence, np.asarray(design.speed), design.probability)
    ensemble = mf.ensemble(scene, runs=24, seed=0)
    yield "ensemble", digest(str(ensemble.words))


def variants(env_id: str) -> tuple[dict[str, Any], ...]:
    """Return the options with which an environment is tested."""
    if "UnknownFloor" in env_id:
        return FLOOR_VARIANTS
    if "Reprogram" in env_id or "Lumen" in env_id:
        return FEED_VARIANTS
    if "Tray" in env_id or "Anchor" in env_id:
        return TRAY_VARIANTS
    if "Goal" in env_id:
        return tuple(
            {key: value for key, value in each.items() if key not in NOT_OF_GOALS}
            for each in FOLD_VARIANTS
        )
    if "Design" in env_id:  # one number for six components and a speed is too many actions
        return tuple(each for each in FOLD_VARIANTS if each.get("actions") != "discrete")
    return FOLD_VARIANTS


def single_episodes(env_id: str, options: dict[str, Any], count: int) -> str:
    """Return the hash of all results of a single environment in a number of random episodes."""
    env: Any = gymnasium.make(env_id, **options)
    env.action_space.seed(1)
    found = Digest()
    for episode in range(count):
        found.add(env.reset(seed=1000 + episode) if episode % 2 == 0 else env.reset())
        over = False
        while not over:
            said = env.step(env.action_space.sample())
            found.add(said)
            over = bool(said[2] or said[3])
        if episode % 10 == 0 and hasattr(env.unwrapped, "to_scene"):
            found.add(env.unwrapped.to_scene().model_dump_json())
    env.close()
    return found.text()


def vector_episodes(env_id: str, options: dict[str, Any], count: int, mode: str) -> str:
    """Return the hash of all results of a vector environment in a number of episodes or more."""
    envs = gymnasium.make_vec(env_id, num_envs=ROWS, autoreset_mode=mode, **options)
    envs.action_space.seed(1)
    found = Digest()
    found.add(envs.reset(seed=1000))
    over = 0
    while over < count:
        said = envs.step(envs.action_space.sample())
        found.add(said)
        ended = said[2] | said[3]
        over += int(ended.sum())
        if mode == "Disabled" and ended.any():
            found.add(envs.reset(options={"reset_mask": ended}))
    envs.close()
    return found.text()


def episode_digests(env_id: str) -> Iterator[tuple[str, str]]:
    """Yield the hash of each variant of an environment, alone and in a vector."""
    each = variants(env_id)
    count = -(-EPISODES // len(each))
    modes = ("NextStep", "SameStep", "Disabled")
    for number, options in enumerate(each):
        yield f"{env_id} {number} single", single_episodes(env_id, options, count)
        mode = modes[number % len(modes)]
        yield f"{env_id} {number} vector", vector_episodes(env_id, options, count, mode)


PARTS: dict[str, Callable[[], Iterator[tuple[str, str]]]] = {
    "folds": fold_digests,
    "energies": energy_digests,
    **{name: partial(episode_digests, f"MagFold/{name}-v0") for name in IDS},
}


def machine() -> dict[str, str]:
    """Return the software and hardware that determine the last bits."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor(),
        "libc": " ".join(platform.libc_ver()),
        "numba": numba_version,
        "numpy": np.__version__,
    }


def say(line: str) -> None:
    """Print a line immediately."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> int:
    """Record or compare."""
    parser = argparse.ArgumentParser(description="Compare folds and episodes with a record.")
    parser.add_argument("--record", type=Path, help="write a record instead")
    parser.add_argument("--against", type=Path, default=RECORD, help="what to compare with")
    parser.add_argument("--only", choices=PARTS, nargs="+", default=list(PARTS))
    args = parser.parse_args()
    known = {} if args.record else json.loads(args.against.read_text(encoding="utf-8"))
    if known and known["machine"] != machine():
        say(f"recorded on {known['machine']}, this is {machine()}")
    found: dict[str, str] = {}
    wrong = 0
    for part in args.only:
        for name, value in PARTS[part]():
            found[name] = value
            if known and known["digests"].get(name) != value:
                wrong += 1
                say(f"differs: {name}")
        say(f"{part}: done, {len(found)} so far, {wrong} differ")
    if args.record:
        text = json.dumps({"machine": machine(), "digests": found}, indent=1)
        args.record.write_text(text + "\n", encoding="utf-8")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
