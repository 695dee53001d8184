"""A keyboard game: the tube-feed environment in a window."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from magfold_env.envs.tube_feed import TubeFeedEnv

HELP = (
    "Fold the chain into the target, one component at a time.",
    "",
    "1 2 3 4\tturn a magnet of the outlined component",
    "up\tfeed faster",
    "down\tfeed slower",
    "space\tfeed the component out",
    "R\tstart again with the same chain",
    "N\tanother chain, another target if none is given",
    "H\tthis page",
    "Q\tquit",
    "",
    "Any key cuts the motion short.",
)
PATIENCE = 200
"""Longest wait for a key [ms]."""

_OTHER = {"N": "S", "S": "N"}


class Game:
    """A game in which a player folds a chain with keys, in a window.

    `env` must have ``render_mode="human"``. `seed` is the seed of the first chain. `target` is the
    word to fold into; without it, `reset` draws a word.
    """

    def __init__(self, env: TubeFeedEnv, seed: int = 0, target: str | None = None) -> None:
        if env.render_mode != "human":
            raise ValueError(f"render_mode: {env.render_mode!r} is not allowed; must be 'human'")
        self.env = env
        self.faces = "NNNN"
        self.level = env.actions.levels // 2
        self.info: Mapping[str, Any] = {}
        self._seed = seed
        self._options = None if target is None else {"target": target}
        self._is_over = False
        self._has_help = False

    def begin(self) -> None:
        """Load a chain and show it."""
        self._is_over = False
        _, self.info = self.env.reset(seed=self._seed, options=self._options)
        self.draw()

    def run(self) -> None:
        """Handle keys until the player quits the game or closes the window."""
        import pygame  # noqa: PLC0415 - needs the extra, and a window is open by now

        while True:
            # Python handles Ctrl-C between two waits, not during one.
            event = pygame.event.wait(PATIENCE)
            if event.type == pygame.QUIT:
                return
            if event.type == pygame.KEYDOWN:
                name = pygame.key.name(event.key)
                if name in ("q", "escape"):
                    return
                self.press(name)
            elif event.type in (pygame.WINDOWRESIZED, pygame.WINDOWEXPOSED):
                self.draw()

    def press(self, key: str) -> None:
        """Handle a key, given by pygame's name; unknown keys do nothing."""
        if key == "h":
            self._has_help = not self._has_help
        elif key == "r":
            self.begin()
        elif key == "n":
            self._seed += 1
            self.begin()
        elif not self._is_over:
            self._choose(key)
        self.draw()

    def draw(self) -> None:
        """Show the chain and the choice for the next component."""
        snapshot = self.env.snapshot()
        help_line = ("help", "H")
        if self._is_over:
            snapshot = replace(snapshot, rows=(*snapshot.rows, ("again", "R"), help_line))
        else:
            index, scene = self.env.next_component, snapshot.scene
            sequence = [*scene.sequence]
            sequence[index] = self.faces
            speed = f"{1e3 * self.env.actions.speeds[self.level]:.0f} mm/s"
            snapshot = replace(
                snapshot,
                scene=scene.replace(sequence=tuple(sequence)),
                marked=index,
                rows=(*snapshot.rows, ("next", self.faces), ("at speed", speed), help_line),
            )
        self.env.viewer.show(replace(snapshot, overlay=HELP if self._has_help else ()))

    def _choose(self, key: str) -> None:
        """Change the choice for the next component, or feed the component."""
        if key in ("1", "2", "3", "4"):
            face = int(key) - 1
            other = _OTHER[self.faces[face]]
            self.faces = self.faces[:face] + other + self.faces[face + 1 :]
        elif key in ("up", "down"):
            level = self.level + (1 if key == "up" else -1)
            self.level = min(max(level, 0), self.env.actions.levels - 1)
        elif key in ("space", "return"):
            actions = self.env.actions
            action = actions.encode(self.faces, float(actions.speeds[self.level]))
            _, _, self._is_over, _, self.info = self.env.step(action)
