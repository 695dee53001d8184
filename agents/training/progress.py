"""How far a training run has come."""

from dataclasses import dataclass

from agents.settings.run import StopSettings


@dataclass
class Progress:
    """What decides, beside the model, how a run goes on.

    Attributes
    ----------
    phase : int
        Number of the phase under way, from 0.
    phase_start : int
        Environment steps made before it.
    seconds : float
        Training time [s], that of earlier processes included.
    validated_at, saved_at : int
        Steps at the last validation and at the last checkpoint.
    last, best : dict or None
        Results of the last validation of the phase, and of its best.
    validations : int
        Validations of the phase.
    stale : int
        Validations since the best one.
    stopping : bool
        Whether the phase ends with the next step.
    """

    phase: int = 0
    phase_start: int = 0
    seconds: float = 0.0
    validated_at: int = 0
    saved_at: int = 0
    last: dict[str, float] | None = None
    best: dict[str, float] | None = None
    validations: int = 0
    stale: int = 0
    stopping: bool = False

    def note(self, result: dict[str, float], stop: StopSettings) -> bool:
        """Take in the result of a validation; return whether it is the best of the phase.

        More successes are better; among equally many the higher score is.
        """
        self.last = result
        self.validations += 1
        best = self.best is None or _rank(result) > _rank(self.best)
        if best:
            self.best, self.stale = result, 0
        else:
            self.stale += 1
        enough = stop.success is not None and result["success_rate"] >= stop.success
        tired = stop.patience is not None and self.stale >= stop.patience
        self.stopping = enough or tired
        return best

    def next_phase(self, steps: int) -> None:
        """Begin the next phase, with `steps` made so far."""
        self.phase += 1
        self.phase_start = steps
        self.validations = 0
        self.best, self.stale, self.stopping = None, 0, False


def due(steps: int, last: int, every: int) -> bool:
    """Return whether a multiple of `every` was passed since `last` steps."""
    return steps // every > last // every


def _rank(result: dict[str, float]) -> tuple[float, float]:
    return result["success_rate"], result["score"]
