"""A choice made beforehand: the magnets of every component and the speed it is fed at."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from magfold_env.envs.fold_env import FoldEnv


class OpenLoop(NamedTuple):
    """What an open loop decides.

    Attributes
    ----------
    sequence : tuple of str
        The components, component 1 first.
    speeds : tuple of float
        Feed speed of each component [m/s], component 1 first.
    """

    sequence: tuple[str, ...]
    speeds: tuple[float, ...]

    @classmethod
    def at_one_speed(cls, sequence: tuple[str, ...], speed: float) -> "OpenLoop":
        """Return the choice that feeds a whole chain at one speed [m/s]."""
        return cls(sequence, (speed,) * len(sequence))

    def as_played(self, env: FoldEnv[Any]) -> "OpenLoop":
        """Return the choice as the actions of `env` can express it.

        Speeds go to the nearest level, components to the nearest of the catalogue. Where a chain
        is chosen as a whole it has one speed, that of component 1.
        """
        table = env.actions
        if table.components > 1:
            sequence, speed = table.decode(table.encode(self.sequence, self.speeds[0]))
            return OpenLoop.at_one_speed(sequence, float(speed))
        read = [table.decode(table.encode(*each)) for each in zip(*self, strict=True)]
        return OpenLoop(
            tuple(faces for (faces,), _ in read), tuple(float(speed) for _, speed in read)
        )

    def action(self, env: FoldEnv[Any]) -> Any:
        """Return the action with which the present episode of `env` goes on as chosen."""
        if env.actions.components > 1:
            return env.actions.encode(self.sequence, self.speeds[0])
        index = env.next_component
        return env.actions.encode(self.sequence[index], self.speeds[index])


class FrozenPolicy:
    """Plays a choice for each target, whatever the chain does.

    Parameters
    ----------
    choices : mapping of str to OpenLoop
        By target.
    """

    def __init__(self, choices: Mapping[str, OpenLoop]) -> None:
        self._choices = choices

    def act(self, env: FoldEnv[Any], observation: Any, rng: object) -> Any:
        """Return the next action of what was chosen for the target of `env`.

        Raises
        ------
        ValueError
            If nothing was chosen for the target.
        """
        if env.target not in self._choices:
            raise ValueError(
                f"target: {env.target!r} has no choice; must be one of {', '.join(self._choices)}"
            )
        return self._choices[env.target].action(env)
