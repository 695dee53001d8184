"""Effects of small deviations from the simulation's idealisations on a chain's final shape.

Random chains, which are not selected for robustness, are compared with successful designs.
"""

from collections.abc import Callable

import numpy as np

from magfold_bench.laws.exact_magnets import magnets_of
from magfold_bench.laws.experiment import COMPONENTS, MODES, SPEED
from magfold_bench.laws.random_scenes import random_sequence
from magfold_bench.tables import Measurement, Progress, Row, Table, each_case
from magfold_env.designer.suites import Witness, load_suite
from magfold_env.ensembles.releases import release
from magfold_env.minimiser import Mode
from magfold_env.reporting.intervals import share
from magfold_env.scene import Scene, Spreads, load_scene
from magfold_env.simulation.simulate import simulate

CHAINS, QUICK_CHAINS = 60, 3
SUITE = "n6"

Change = Callable[[Scene, np.random.Generator], Scene]
"""A function that returns a concrete scene with a small change."""


def run(quick: bool, progress: Progress) -> Measurement:
    """Fold chains unchanged and with each change, and count those that end differently."""
    count = QUICK_CHAINS if quick else CHAINS
    groups = {"random": random_chains(count), "designed": designed_chains(count)}
    ends = {group: [_end(scene) for scene in scenes] for group, scenes in groups.items()}
    rows: list[Row] = []
    shown: list[Row] = []
    for change, _ in each_case(progress, list(CHANGES)):
        shown.append({"change": change})
        for group, scenes in groups.items():
            found = [_end(CHANGES[change](scene, np.random.default_rng((1, k))))
                     for k, scene in enumerate(scenes)]  # fmt: skip
            others = share(sum(a != b for a, b in zip(found, ends[group], strict=True)), count)
            row: Row = {"change": change, "chains": group, "others": others.successes}
            rows.append(row | {"of": count, "low": others.low, "high": others.high})
            shown[-1][group] = f"{others}"
    return Measurement(rows, [Table(f"another word or status, of {count} chains each", shown)])


def random_chains(count: int) -> list[Scene]:
    """Return concrete scenes with random chains: in turn free, fed forward and fed backward."""
    rng = np.random.default_rng(0)
    device = load_scene("paper/sequence-1")
    sequences = [random_sequence(rng, COMPONENTS) for _ in range(count)]
    return [
        release(device.replace(sequence=each), MODES[k % len(MODES)], SPEED).draw(rng)
        for k, each in enumerate(sequences)
    ]


def designed_chains(count: int) -> list[Scene]:
    """Return concrete scenes with designed chains, each released as its suite states."""
    suite, rng = load_suite(SUITE), np.random.default_rng(0)
    found: list[tuple[Witness, Mode]]
    found = [(witnesses[mode], mode) for witnesses in suite.words.values() for mode in MODES]
    return [
        release(suite.scene().replace(sequence=each.sequence), mode, each.speed).draw(rng)
        for each, mode in found[:count]
    ]


def _end(scene: Scene) -> tuple[str, str]:
    fold = simulate(scene)
    return fold.word, fold.status.value


def _tilted(scene: Scene, rng: np.random.Generator) -> Scene:
    normal, along = Spreads(tilt=1.0).tilted(scene.gravity, np.array([1.0, rng.uniform(-1, 1)]))
    return scene.replace(gravity={"normal": normal, "in_plane": along})


def _drawn(**spreads: float) -> Change:
    return lambda scene, rng: scene.replace(spreads=spreads).draw(rng)


CHANGES: dict[str, Change] = {
    "floor tilted by 1°": _tilted,
    "friction 20 % higher": lambda scene, _: scene.replace(friction=1.2 * scene.frictions),
    "friction of each component ±20 %": lambda scene, rng: scene.replace(
        friction=scene.frictions * rng.uniform(0.8, 1.2, scene.n)
    ),
    "each magnet ±5 %": _drawn(magnet=0.05),
    "all magnets together ±5 %": _drawn(remanence=0.05),
    "inset 0.1 mm deeper": lambda scene, _: scene.replace(
        magnets={"inset": np.asarray(magnets_of(scene).inset) + 1e-4}
    ),
    "mass of each component ±5 %": _drawn(mass=0.05),
    "side of all casings ±1 %": _drawn(side=0.01),
    "different initial joint angles, within ±0.03 rad": lambda scene, rng: scene.replace(
        start_angles=None, start_offsets=None
    ).draw(rng),
    "solver tolerance ten times tighter": lambda scene, _: scene.replace(
        solver={"tolerance": 0.1 * scene.solver.tolerance}
    ),
}
