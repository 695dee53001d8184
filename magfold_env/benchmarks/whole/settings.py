"""What may be set on a run, from the loosest to the tightest, and the default among it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from magfold_env.scene import Magnets, Scene, Solver

STEPS_ALLOWED = 10_000_000  # accuracy must not be cut short by the work cap

Method = Literal["adaptive", "paper"]


@dataclass(frozen=True)
class Setting:
    """One way to run a scene."""

    method: Method
    step: float
    """Tolerance [rad], or the paper's time step [s]."""
    accuracy: float | None
    """Of the magnets; None where the scene has no such choice."""

    def __str__(self) -> str:
        step = f"{self.step:g} rad"
        if self.method == "paper":
            step = f"paper's, {1e3 * self.step:.3g} ms"
        return step if self.accuracy is None else f"{step}, magnets {self.accuracy:g}"

    @property
    def is_default(self) -> bool:
        """Whether a scene that says nothing is run so."""
        default = self.accuracy in (None, Magnets().accuracy)
        return default and (self.method, self.step) == (Solver().method, Solver().tolerance)

    def as_tight(self, other: Setting) -> bool:
        """Whether nothing is looser than in another setting of the same method."""
        finer = (self.accuracy or 0.0) <= (other.accuracy or 0.0)
        return self.method == other.method and self.step <= other.step and finer

    def on(self, scene: Scene) -> Scene:
        """Return a scene that is run so, with no cap on the work that matters."""
        solver: dict[str, object] = {
            "method": self.method,
            "max_steps": STEPS_ALLOWED,
            "max_steps_per_second": STEPS_ALLOWED,
            "tolerance" if self.method == "adaptive" else "time_step": self.step,
        }
        changed = scene.replace(solver=solver)
        return changed if self.accuracy is None else changed.replace(
            magnets={"accuracy": self.accuracy}
        )  # fmt: skip


def has_accuracy(scene: Scene) -> bool:
    """Whether the magnets' accuracy is a choice: points have their nodes, pendula no magnets."""
    return scene.magnets is not None and scene.magnets.model == "strips"


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
