"""One case of a campaign: its name gives a scene, and the scene a verdict."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from magfold_env.scene import Scene, save_scene
from magfold_env.stress.kinds import KINDS
from magfold_env.stress.laws import check
from magfold_env.stress.source import RandomSource
from magfold_env.stress.verdict import Verdict


@dataclass(frozen=True)
class Case:
    """A scene's kind and its number among those of its kind, of one seed."""

    seed: int
    kind: str
    number: int

    @property
    def name(self) -> str:
        """Also the name of its file."""
        return f"{self.kind}-{self.seed}-{self.number}"

    def scene(self) -> Scene:
        """Draw the scene: the same whenever and wherever that is done."""
        letters = map(ord, self.kind)
        return KINDS[self.kind].make(RandomSource(self.seed, self.number, *letters))

    def verdict(self) -> Verdict:
        """Judge the scene; an error that is raised breaks a law like any other."""
        try:
            return check(self.scene())
        except Exception as error:
            found = Verdict(status="raised", message=f"{type(error).__name__}: {error}")
            found.demand("no exception", False, found.message)
            return found

    def save(self, broken: Iterable[str], folder: Path) -> Path:
        """Write the scene, with what it breaks as comments."""
        path = folder / f"{self.name}.yaml"
        lines = [f"case {self.name} of magfold stress breaks", *broken]
        again = f"magfold stress --rerun {path.name}"
        save_scene(self.scene(), path, "\n".join([*lines, f"again: {again}"]))
        return path
