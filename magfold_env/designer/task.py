"""The checked arguments of a design search, its choices and its result."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self, get_args

import numpy as np

from magfold_env.designer.evidence import Evidence
from magfold_env.ensembles.releases import MOST_RUNS, release, varied
from magfold_env.files import reading_json, write_text
from magfold_env.minimiser import LONGEST_OF_ALL, Mode, refuse_field
from magfold_env.reporting.intervals import Share
from magfold_env.reporting.notebook import NotebookDisplay, facts_table
from magfold_env.reporting.page import Block
from magfold_env.scene import Problem, Scene, base, errors, load_scene, unless_a_scene
from magfold_env.shapes import cells, headings, is_fully_folded, parse_word, word_to_angles
from magfold_env.simulation.simulate import numbers

Objective = Literal["probability", "ground", "unique", "gap", "sensitivity"]
Search = Literal["exhaustive", "annealing", "cross-entropy"]

FORMAT = "magfold_env design 1"

SPEEDS: tuple[float, ...] = (0.2, 0.5, 0.08, 0.03)
"""Feed speeds [m/s] from which a design chooses if no others are given."""


class Choice(NamedTuple):
    """The magnets of every component and the feed speed."""

    sequence: tuple[str, ...]
    speed: float | None
    """Feed speed [m/s]; None without a tube."""

    def applied(self, scene: Scene) -> Scene:
        """Return the scene with this choice."""
        feed = {} if self.speed is None else {"speed": self.speed}
        return scene.replace(sequence=self.sequence, feed=feed)


@dataclass(frozen=True)
class Task:
    """A target and everything on which a search for it depends."""

    target: str
    scene: Scene
    """The scene of a release, with placeholders for sequence and speed."""
    mode: Mode
    objective: Objective
    search: Search
    searching_seed: int
    """Seed of the releases that select choices."""
    releases_seed: int
    """Seed of the releases that assess the result."""
    speeds: tuple[float, ...]
    """Available feed speeds [m/s]; empty without a tube or for energy objectives."""
    budget: int
    """Budget of releases for the search."""
    goal: float
    """A probability that suffices."""
    runs: int
    """Number of releases that assess the result."""

    @property
    def enough(self) -> float:
        """Share of successes that ends the search; it exceeds `goal`: later releases do worse."""
        return 0.5 * (1.0 + self.goal)

    @property
    def impossible(self) -> str:
        """Reason why no sequence can meet the objective; empty if one might."""
        places = [tuple(cell) for cell in cells(self.target).tolist()]
        for j, place in enumerate(places):
            if place in places[:j]:
                return f"components {places.index(place) + 1} and {j + 1} would lie in one place"
        if not is_fully_folded(self.target):
            straight = self.target.index("S") + 1
            if self.objective == "probability":
                return f"joint {straight} is straight, and a chain that settles so has misfolded"
            if self.objective == "unique":
                return f"joint {straight} is straight, and a stable word is fully folded"
        return ""


def task_for(  # noqa: PLR0913 - all that a search depends on
    target: str,
    scene: Scene | None,
    mode: Mode,
    objective: Objective,
    *,
    search: Search | None,
    seed: int,
    speeds: Sequence[float] | None,
    budget: int,
    goal: float,
    runs: int,
) -> Task:
    """Check the arguments of `design`, refuse values that are not allowed, and fill in defaults."""
    n = len(parse_word(target, key="target")) + 1
    problems = [
        *errors.unless_one_of("objective", objective, get_args(Objective)),
        *errors.unless_one_of("search", search, (None, *get_args(Search))),
        *errors.unless_one_of("mode", mode, get_args(Mode)),
        *errors.unless_whole("seed", seed, 0),
        *errors.unless_whole("budget", budget, 1, MOST_RUNS),
        *errors.unless_whole("runs", runs, 0, MOST_RUNS),
        *errors.unless_positive("goal", goal, 1.0),
        *([] if scene is None else unless_a_scene(scene)),
    ]
    errors.refuse(problems)
    if scene is not None and scene.magnets is None:
        problems.append(Problem("magnets", None, "a scene must have those to be designed"))
    asked = numbers([1.0] if speeds is None else speeds)
    if asked is None or asked.ndim != 1 or not asked.size:
        problems.append(Problem("speeds", speeds, "must be one or several numbers"))
    if n < 2:
        problems.append(Problem("target", target, "must have at least one letter"))
    if search == "exhaustive" and n > LONGEST_OF_ALL:
        most = f"must be annealing or cross-entropy for more than {LONGEST_OF_ALL} components"
        problems.append(Problem("search", search, most))
    if search == "cross-entropy" and objective != "probability":
        problems.append(
            Problem("search", search, f"must be exhaustive or annealing for objective {objective}")
        )
    if speeds is not None and (mode == "free" or objective != "probability"):
        allowed = "must be left out unless a tube feeds and the objective is probability"
        problems.append(Problem("speeds", speeds, allowed))
    errors.refuse(problems)
    scene = load_scene(default_scene(n)) if scene is None else scene
    # Any sequence of the target's length will do.
    released = release(scene.replace(sequence=("NNNN",) * n, start_angles=None), mode)
    refuse_field(released)
    chosen: tuple[float, ...] = ()
    if mode != "free" and objective == "probability":
        chosen = SPEEDS if speeds is None else tuple(speeds)
    for speed in chosen:
        released.replace(feed={"speed": speed})  # raises an error if the speed is not allowed
    search = search or ("exhaustive" if n <= LONGEST_OF_ALL else "annealing")
    one, other = np.random.SeedSequence(seed).generate_state(2).tolist()
    return Task(target, released, mode, objective, search, one, other, chosen, budget, goal, runs)


def default_scene(n: int) -> str:
    """Return the name of the shipped scene for designs of n components."""
    return "design" if n <= LONGEST_OF_ALL else "design-long"


@dataclass(frozen=True, repr=False)
class Design(NotebookDisplay):
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
    """Whether the objective is met: the target is the only ground state or, for `unique`, the only
    stable word; for `probability`, the share of successes reaches the goal."""
    score: float | None
    """The gap [J], or the tolerance or share of successes, depending on the objective."""
    bound: float | None
    """Proven upper bound of the score; None if unknown."""
    evidence: Evidence | None
    """The evidence by energy."""
    probability: Share | None
    """Share of separate releases that reached the target; None without such releases."""
    releases_seed: int
    """Seed of the separate releases, which ``ensemble(design.scene, runs, design.releases_seed)``
    repeats."""
    calls: dict[str, int]
    """Number of calls of each kind in the search: ``energies`` of one word or flips of one face,
    exact searches for ``ground states``, and simulated ``releases``."""
    certificate: str
    """Proof that no sequence can meet the objective; empty without proof."""

    def __repr__(self) -> str:
        """Return the result, with its success rate, as text."""
        if self.scene is None:
            return f"<Design of {self.target}: none; {self.certificate}>"
        speed = "" if self.speed is None else f" at {self.speed} m/s"
        share = "" if self.probability is None else f": {self.probability}"
        found = " ".join(self.sequence)
        return f"<Design of {self.target}, {self.mode}: {found}{speed}{share}>"

    def facts(self) -> dict[str, str]:
        """Return the design and the evidence for it as texts, keyed by their names."""
        rows = {"sequence": " ".join(self.sequence)}
        if self.speed is not None:
            speeds = self.speed if isinstance(self.speed, tuple) else (self.speed,)
            rows["feed"] = f"{self.mode}, {', '.join(f'{each:g}' for each in speeds)} m/s"
        if self.probability is not None:
            fresh = f"{self.probability} of {self.probability.trials} releases of its own"
            rows[f"folds into {self.target}"] = fresh
            if self.scene is not None:
                rows["drawn anew for each"] = varied(self.scene)
        if (evidence := self.evidence) is not None:
            side = "higher" if evidence.gap >= 0.0 else "lower"
            stable = "yes, as the only word" if evidence.only_stable else "yes"
            rows |= {
                "energy": f"{1e3 * evidence.energy:.3f} mJ",
                "next word": f"{evidence.rival}, {1e3 * abs(evidence.gap):.3f} mJ {side}",
                "tolerates errors in individual magnets": f"{100 * evidence.tolerance:.0f} %",
                "stable": stable if evidence.stable else "no",
            }
        if (short := self.shortfall) is not None:
            gap = self.objective == "gap"
            by = f"by {1e3 * short:.3f} mJ" if gap else f"by {100 * short:.1f} %"
            rows["below the proven optimum"] = by
        rows["asked"] = ", ".join(f"{count} {name}" for name, count in self.calls.items())
        rows["reached"] = "yes" if self.reached else "no"
        return rows

    def _shown(self) -> list[Block]:
        if self.scene is None:
            return [repr(self)[1:-1]]
        title = f"{self.target}, {self.mode}: {self.objective}"
        picture = self.scene.pictured(headings(word_to_angles(self.target)))
        return [*picture, facts_table(title, self.facts())]

    @property
    def sequence(self) -> tuple[str, ...]:
        """The components, component 1 first.

        Raises
        ------
        ValueError
            If there is no sequence.
        """
        return self._found.sequence

    @property
    def speed(self) -> base.Each[base.Speed] | None:
        """Feed speed [m/s], one for all components or one for each; None without a tube.

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
        """Write the design as JSON through a temporary file; `from_json` reads the file."""
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
