"""The learning rate over a run of several phases.

The resume state of training runs names this module: it loads only while it is found here.
"""

from dataclasses import dataclass


@dataclass
class LearningRate:
    """A constant rate, or one that falls linearly to zero over every phase.

    Stable-Baselines3 passes the remaining share of all steps up to the end of the phase, including
    the steps of earlier phases; `start` and `end` convert it to a share of the phase.
    """

    rate: float
    """The rate at the start of a phase."""
    anneal: bool
    """Whether it falls."""
    start: int = 0
    """Steps made at the start of the phase."""
    end: int = 1
    """Steps made at its end."""

    def __call__(self, remaining: float) -> float:
        """Return the rate when the share `remaining` of `end` remains."""
        if not self.anneal:
            return self.rate
        # The last rollout may exceed the end.
        return self.rate * max(0.0, remaining * self.end / (self.end - self.start))
