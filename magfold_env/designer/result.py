"""The result of a design: the magnets and the speed for a target, and the evidence for them."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, Self

from magfold_env.designer.evidence import Evidence
from magfold_env.files import reading_json, write_text
from magfold_env.minimiser import Mode
from magfold_env.reporting.intervals import Share
from magfold_env.scene import Scene, base

Objective = Literal["probability", "ground", "unique", "gap", "sensitivity"]
Search = Literal["exhaustive", "annealing", "cross-entropy"]

FORMAT = "magfold_env design 1"


@dataclass(frozen=True, repr=False)
class Design:
    """The result of `design`."""

    target: str
    """The target word."""
    mode: Mode
    """How the chain is released."""
    objective: Objective
    """The objective; see `design`."""
    search: Search
    """The search method."""
    scene: Scene | None
    """The chain with the resulting sequence and speed, ready for `simulate`; None if there is no
    sequence."""
    reached: bool
    """Whether the objective is met. By energy, the target must be the only ground state, and for
    `unique` the only stable word; for `probability`, the share of successes must reach the goal."""
    score: float | None
    """The gap [J], or the tolerance or share of successes if that was the objective."""
    bound: float | None
    """Proven upper bound of the score; None if unknown."""
    evidence: Evidence | None
    """The evidence by energy."""
    probability: Share | None
    """Share of separate releases that settled as the target; None if none were requested."""
    releases_seed: int
    """Seed of these releases; ``ensemble(design.scene, runs, design.releases_seed)`` repeats
    them."""
    calls: dict[str, int]
    """Number of calls of each kind in the search: ``energies`` of one word or flips of one face,
    exact searches for ``ground states``, and simulated ``releases``."""
    certificate: str
    """Why no sequence can meet the objective; empty if that is not proved."""

    def __repr__(self) -> str:
        """Return the result and its success rate as text."""
        if self.scene is None:
            return f"<Design of {self.target}: none; {self.certificate}>"
        speed = "" if self.speed is None else f" at {self.speed} m/s"
        share = "" if self.probability is None else f": {self.probability}"
        found = " ".join(self.sequence)
        return f"<Design of {self.target}, {self.mode}: {found}{speed}{share}>"

    @property
    def sequence(self) -> tuple[str, ...]:
        """The components, component 1 first.

        Raises
        ------
        ValueError
            If there is none.
        """
        return self._found.sequence

    @property
    def speed(self) -> base.Each[base.Speed] | None:
        """Feed speed [m/s], one or one per component; None without a tube.

        Raises
        ------
        ValueError
            If there is no sequence.
        """
        return None if self.mode == "free" else self._found.feed.speed

    @property
    def shortfall(self) -> float | None:
        """Difference between the proven bound and the score; None if the bound is unknown."""
        if self.bound is None or self.score is None:
            return None
        return max(0.0, self.bound - self.score)

    @property
    def _found(self) -> Scene:
        if self.scene is None:
            raise ValueError(f"{self.target}: {self.certificate}")
        return self.scene

    def to_dict(self) -> dict[str, Any]:
        """Return the design as values that JSON can hold."""
        scene = None if self.scene is None else self.scene.model_dump(mode="json")
        return {"format": FORMAT, **asdict(self), "scene": scene}

    def to_json(self, path: str | Path) -> None:
        """Write the design as JSON, under a temporary name first; `from_json` reads it."""
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    @classmethod
    def from_json(cls, path: str | Path) -> Self:
        """Read a design that `to_json` wrote; the result equals the original.

        Raises
        ------
        ValueError
            If the file is not such a design.
        """
        with reading_json(path, "a design", FORMAT) as data:
            kinds = {"scene": Scene, "evidence": Evidence, "probability": Share}
            for key, kind in kinds.items():
                data[key] = None if data[key] is None else kind(**data[key])
            del data["format"]
            return cls(**data)
