"""Target suites: fixed lists of words, each with a witness or a reason why there is none."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from magfold_env.reporting.intervals import Share, share
from magfold_env.scene import Problem, Scene, base, errors, io, load_scene
from magfold_env.shapes import overlaps, parse_word

Kind = Literal["ground", "unique", "forward", "backward", "free"]
"""Kinds of witnesses. The target is the sequence's only ground state or its only stable word, or a
chain with the sequence settles as the target when it is released in one of the three modes."""


class Witness(base.FrozenModel):
    """A sequence for a target, or a proof that there is none."""

    sequence: tuple[str, ...] | None = None
    """The components, component 1 first; None if no sequence was found."""
    speed: float | None = None
    """Feed speed [m/s]."""
    gap: float | None = None
    """For `ground`: energy gap to the next word [J]."""
    successes: Annotated[int, Field(ge=0)] | None = None
    """For the modes of release: number of `releases` in which the chain settled as the target."""
    releases: Annotated[int, Field(ge=1)] | None = None
    """Number of releases, none of which the search used."""
    certificate: str = ""
    """Proof that there is no such sequence; empty without proof."""

    @field_validator("sequence", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        return tuple(value.split()) if isinstance(value, str) else value

    @property
    def probability(self) -> Share | None:
        """Share of releases in which the chain settled as the target; None without releases."""
        if self.successes is None or self.releases is None:
            return None
        return share(self.successes, self.releases)


class Suite(base.FrozenModel):
    """Target words of one length for one scene."""

    scene_name: str
    """Name of a shipped scene, or a path."""
    words: dict[str, dict[Kind, Witness]]
    """The targets in order, with their witnesses."""

    @model_validator(mode="after")
    def _check_words(self) -> Self:
        problems: list[Problem] = []
        for word, witnesses in self.words.items():
            if overlaps(parse_word(word)):
                problems.append(Problem(f"words.{word}", word, "must not overlap"))
            allowed = f"must have {len(word) + 1} components"
            for kind, witness in witnesses.items():
                if witness.sequence is not None and len(witness.sequence) != len(word) + 1:
                    problems.append(Problem(f"words.{word}.{kind}", witness.sequence, allowed))
        lengths = sorted({len(word) for word in self.words})
        if len(lengths) != 1:
            problems.append(Problem("words", lengths, "must be one or more words of equal length"))
        errors.refuse(problems)
        return self

    @property
    def n(self) -> int:
        """Number of components."""
        return len(next(iter(self.words))) + 1

    @property
    def targets(self) -> tuple[str, ...]:
        """The target words in order."""
        return tuple(self.words)

    def scene(self) -> Scene:
        """Return the scene, with a placeholder as its sequence."""
        return load_scene(self.scene_name).replace(sequence=("NNNN",) * self.n)


def suite_names() -> list[str]:
    """Return the names of the shipped suites, the shortest chains first."""
    return sorted(io.shipped_names("suites"), key=len)


def load_suite(name_or_path: str | Path) -> Suite:
    """Read a target suite.

    Parameters
    ----------
    name_or_path
        The name of a shipped suite, such as "n6", or the path of a YAML file.

    Raises
    ------
    SceneError
        If there is no such suite or file, or if it is not valid.
    """
    return io.read_named(name_or_path, "suites", suite_names(), Suite)
