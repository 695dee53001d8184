"""Design: the magnets and the speed that were found for a target, and what speaks for them."""

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
    """The word that was wanted."""
    mode: Mode
    """How the chain is released."""
    objective: Objective
    """What was sought, see `design`."""
    search: Search
    """How."""
    scene: Scene | None
    """The chain with the sequence and the speed that were found, ready for `simulate`; None if no
    sequence is left to give."""
    reached: bool
    """Whether the objective is met: by energy the target is the only ground state, and for `unique`
    the only stable word; for `probability` the share of successes reaches the goal."""
    score: float | None
    """The gap [J], or, where those were sought, the tolerance or the share of successes."""
    bound: float | None
    """What no sequence exceeds, proved; None if unknown."""
    evidence: Evidence | None
    """By energy."""
    probability: Share | None
    """Of settling as the target, on releases of their own; None if none were asked for."""
    releases_seed: int
    """Their seed: ``ensemble(design.scene, runs, design.releases_seed)`` repeats them."""
    calls: dict[str, int]
    """What was asked of each oracle: ``energies`` of one word, or flips of one face judged, exact
    searches for ``ground states``, and ``releases`` simulated in the search."""
    certificate: str
    """Why no sequence can do what was sought; empty if that is not proved."""

    def __repr__(self) -> str:
        """Return what was found, and how often it folds as wanted."""
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
            If there are none.
        """
        return self._found.sequence

    @property
    def speed(self) -> base.Each[base.Speed] | None:
        """Feed speed [m/s], one or one a component; None if no tube feeds.

        Raises
        ------
        ValueError
            If there is no sequence.
        """
        return None if self.mode == "free" else self._found.feed.speed

    @property
    def shortfall(self) -> float | None:
        """How far the score lies below what is proved to be the most; None if that is unknown."""
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
        """Read a design that `to_json` wrote; equal to it.

        Raises
        ------
        ValueError
            If the file is no such design.
        """
        with reading_json(path, "a design", FORMAT) as data:
            kinds = {"scene": Scene, "evidence": Evidence, "probability": Share}
            for key, kind in kinds.items():
                data[key] = None if data[key] is None else kind(**data[key])
            del data["format"]
            return cls(**data)
