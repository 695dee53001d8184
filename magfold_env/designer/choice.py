"""What a design decides: the magnets of every component, and how fast the tube feeds them."""

from __future__ import annotations

from typing import NamedTuple

from magfold_env.scene import Scene


class Choice(NamedTuple):
    """A sequence and a feed speed."""

    sequence: tuple[str, ...]
    speed: float | None
    """Feed speed [m/s]; None where no tube feeds."""

    def applied(self, scene: Scene) -> Scene:
        """Return the scene with this choice."""
        feed = {} if self.speed is None else {"speed": self.speed}
        return scene.replace(sequence=self.sequence, feed=feed)

    def __str__(self) -> str:
        """Return the sequence and the speed."""
        text = " ".join(self.sequence)
        return text if self.speed is None else f"{text} at {self.speed:g} m/s"
