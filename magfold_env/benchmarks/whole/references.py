"""Ten named scenes, and what they do: known as well as a tight setting tells.

The reference is the same scene at a tight tolerance with accurate magnets. How well it is converged
is told by a second run with both `LOOSER`; how much the scene itself amplifies, by a third whose
start is moved by `NUDGE`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks import runs
from magfold_env.benchmarks.runs import CLOSE, NUDGE, Setting, has_accuracy
from magfold_env.fold import Fold
from magfold_env.scene import Magnets, Scene, Solver, load_scene

LONGEST = 1.0  # [s] simulated after the last release; most folds rest before that
SWING = 0.3  # [s] of the pendulum, seven times √(d/g): longer swings are chaotic
SPREAD = 0.03  # [rad] of the start angles
LONG = 12  # components of the longest chain
PENDULUM = "pendulum of three"
LOOSER = 10.0


def named_scenes() -> dict[str, Scene]:
    """Return what a user folds, in every mount there is, with the solver's own settings.

    The scenes' start angles are yet to be drawn.
    """
    one, two, three = (load_scene(f"paper/sequence-{k}") for k in (1, 2, 3))
    scenes = {
        "sequence 1, free": one,
        "sequence 2, frictionless": two.replace(friction=0.0),
        "sequence 3, free": three,
        "sequence 3, fed backward": three.replace(mount="tube", feed={"direction": "backward"}),
        "tube-feed": load_scene("tube-feed"),
        "anchor": load_scene("anchor"),
        f"{LONG} components": one.replace(
            sequence=one.sequence * (LONG // one.n),
            mount="tube",
            feed={"speed": 0.2},
            friction=0.1,
        ),
        "sequence 3, pinned": three.replace(mount="pinned"),
        "sequence 3, literal": load_scene("paper/sequence-3-literal"),
        PENDULUM: load_scene("pendulum-3"),
    }
    plain = {name: _plain(scene) for name, scene in scenes.items()}
    plain[PENDULUM] = plain[PENDULUM].replace(duration=SWING)
    return plain


def _plain(scene: Scene) -> Scene:
    """Return a scene with the default solver and accuracy of the magnets."""
    scene = scene.replace(duration=LONGEST, solver=Solver(), start_angle_spread=SPREAD)
    if has_accuracy(scene):
        scene = scene.replace(magnets={"accuracy": Magnets().accuracy})
    return scene


def drawn(scene: Scene, seed: int) -> Scene:
    """Return a scene with the start angles of a seed."""
    return scene.draw(np.random.default_rng(seed))


def settings_of(
    scene: Scene,
    tolerances: Sequence[float],
    accuracies: Sequence[float],
    time_steps: Sequence[float],
) -> list[Setting]:
    """Return every combination that a scene allows; the paper's solver needs it pinned."""
    chosen = accuracies if has_accuracy(scene) else (None,)
    found = [Setting("adaptive", t, accuracy) for accuracy in chosen for t in tolerances]
    if scene.mount == "pinned":
        found += [Setting("paper", step, accuracy) for accuracy in chosen for step in time_steps]
    return found


@dataclass(frozen=True, eq=False)
class Reference:
    """What a drawn scene does, and how well that is known."""

    scene: Scene
    fold: Fold
    known: float
    """What ten times looser settings change on the way [rad]."""
    sensitivity: float
    """What a start moved by `NUDGE` changes on the way [rad]."""

    @property
    def sensitive(self) -> bool:
        """Whether the scene, rather than a setting, decides what comes out."""
        return self.sensitivity > CLOSE

    @property
    def unsure(self) -> bool:
        """Whether it is not known well enough to compare with."""
        return self.known > CLOSE

    def error_on_the_way(self, run: Fold) -> float:
        """Largest difference of a joint's angle at any time [rad], as far as it is known."""
        return max(runs.difference(run, self.fold), self.known, NUDGE)

    def final_error(self, run: Fold) -> float:
        """Largest difference of a joint's angle at the end [rad]."""
        return max(runs.final_difference(run, self.fold), NUDGE)


def reference(scene: Scene, tolerance: float, accuracy: float) -> Reference:
    """Run a drawn scene as exactly as asked for, and twice more to see how much that is worth."""
    tight, looser = (
        Setting("adaptive", k * tolerance, k * accuracy if has_accuracy(scene) else None)
        for k in (1.0, LOOSER)
    )
    exact, second = runs.recorded(tight.on(scene)), runs.recorded(looser.on(scene))
    moved = runs.recorded(looser.on(runs.nudged(scene)))
    return Reference(scene, exact, runs.difference(second, exact), runs.difference(moved, second))
