"""The four ways to write an action down, and how each is read.

Every environment in which magnets are chosen reads its actions here: ``components`` patterns (one
a step, or the whole sequence at once) and one feed speed. Components that cannot be built are
replaced by the nearest that can, the one with the fewest other faces; `ActionTable.masks` says
beforehand which patterns stand for themselves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.spaces.action_reading import as_integers, as_numbers
from magfold_env.envs.spaces.actions import (
    PATTERNS,
    SIGNS,
    scaled_speed,
    scaled_speeds,
    speed_at,
    speed_levels,
    speeds_at,
)
from magfold_env.envs.tasks.checks import one_of

ActionKind = Literal["multidiscrete", "discrete", "box", "dict"]

_Read = tuple[NDArray[np.integer], float]
"""Numbers of patterns, and a speed [m/s]."""

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

MOST_DISCRETE = 1_000_000
"""Most single actions that a `discrete` space may have."""


@dataclass(frozen=True)
class ActionTable:
    """How actions are written.

    Attributes
    ----------
    levels : int
        Number of speed levels, log-spaced from 0.01 to 0.6 m/s, both included.
    components : int
        Number of components that one action describes.
    kind : {"multidiscrete", "discrete", "box", "dict"}
        ``multidiscrete``: the patterns, then the speed level. ``discrete``: the same as one
        number, the speed level the last digit. ``box``: four numbers from −1 to 1 a component,
        above 0 is N, and the speed on a log scale from −1 to 1. ``dict``: ``patterns`` and
        ``speed``, the patterns as numbers and the speed as in ``box``.
    catalogue : tuple of int
        The patterns that can be built, ascending; all 16 by default.
    """

    levels: int
    components: int = 1
    kind: ActionKind = "multidiscrete"
    catalogue: tuple[int, ...] = tuple(range(len(PATTERNS)))

    def __post_init__(self) -> None:
        speed_levels(self.levels)
        one_of("actions", self.kind, ActionKind)
        if self.kind == "discrete" and self._count > MOST_DISCRETE:
            raise ValueError(
                f"actions: 'discrete' is not allowed for {self.components} components at a time; "
                f"{self._count} actions are more than {MOST_DISCRETE}, "
                "must be one of multidiscrete, box, dict"
            )

    @property
    def _count(self) -> int:
        return len(PATTERNS) ** self.components * self.levels

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """Feed speed of each level [m/s], shape (levels,), ascending."""
        return speed_levels(self.levels)

    @cached_property
    def space(self) -> spaces.Space[Any]:
        """Gymnasium's description of the actions."""
        patterns = [len(PATTERNS)] * self.components
        if self.kind == "multidiscrete":
            return spaces.MultiDiscrete([*patterns, self.levels])
        if self.kind == "discrete":
            return spaces.Discrete(self._count)
        if self.kind == "box":
            return spaces.Box(-1.0, 1.0, shape=(4 * self.components + 1,), dtype=np.float32)
        return spaces.Dict(
            patterns=spaces.MultiDiscrete(patterns),
            speed=spaces.Box(-1.0, 1.0, shape=(1,), dtype=np.float32),
        )

    def decode(self, action: Any) -> tuple[tuple[str, ...], float]:
        """Return the faces of each component, and the speed [m/s].

        Raises
        ------
        ValueError
            If `action` is not in the space.
        """
        read: _Read | None = getattr(self, f"_read_{self.kind}")(action)
        if read is None:
            raise ValueError(f"action: {action!r} is not allowed; must be {self._allowed}")
        patterns, speed = read
        return tuple(PATTERNS[self._buildable[int(p)]] for p in patterns), speed

    def decode_many(self, actions: Any, count: int) -> tuple[Ints, Floats, Floats]:
        """Return what `decode` does for each of `count` actions, as Gymnasium batches them.

        Returns
        -------
        patterns : array of int, shape (count, components)
            Of components that can be built.
        speeds, scaled : array, shape (count,)
            Feed speeds [m/s], and the same on the log scale from −1 to 1.

        Raises
        ------
        ValueError
            If one of `actions` is not in the space, or there are not `count`.
        """
        if self.kind == "dict":
            given = cast("Mapping[str, Any]", actions if isinstance(actions, Mapping) else {})
            if set(given) != {"patterns", "speed"}:
                raise self._refused("actions", actions)
            patterns = self._digits(given["patterns"], self.sizes[:-1], count)
            scaled = self._numbers(given["speed"], 1, count)[:, 0]
        elif self.kind == "box":
            numbers = self._numbers(actions, 4 * self.components + 1, count)
            south = (numbers[:, :-1] <= 0.0).reshape(count, self.components, 4)
            patterns, scaled = np.packbits(south, axis=2)[:, :, 0] >> 4, numbers[:, -1]
        else:
            if self.kind == "discrete":
                number = self._digits(actions, (self._count,), count)
                digits = np.stack(np.unravel_index(number, self.sizes), axis=-1)
            else:
                digits = self._digits(actions, self.sizes, count)
            levels = digits[:, -1]
            return self._built[digits[:, :-1]], self.speeds[levels], self._scaled[levels]
        speeds = speeds_at(scaled)
        return self._built[patterns], speeds, scaled_speeds(speeds)

    def encode(self, faces: str | Sequence[str], speed: float) -> Any:
        """Return the action nearest to the faces of each component and a speed [m/s].

        Parameters
        ----------
        faces : str or sequence of str
            Four letters for each component; a single component's may stand alone.
        speed : float
            The nearest level, on the log scale, is taken.
        """
        each = [faces] if isinstance(faces, str) else faces
        patterns = np.array([PATTERNS.index(letters) for letters in each], dtype=np.int64)
        level = int(np.argmin(np.abs(np.log(self.speeds / speed))))
        if self.kind == "multidiscrete":
            return np.append(patterns, level)
        if self.kind == "discrete":
            return np.int64(np.ravel_multi_index((*patterns, level), self.sizes))
        scaled = np.array([np.clip(scaled_speed(speed), -1.0, 1.0)], dtype=np.float32)
        if self.kind == "box":
            return np.append(SIGNS[patterns].astype(np.float32).ravel(), scaled)
        return {"patterns": patterns, "speed": scaled}

    def masks(self) -> NDArray[np.bool_]:
        """Return which actions ask for nothing but components that can be built.

        Returns
        -------
        array of bool
            As sb3-contrib's ``MaskablePPO`` wants it: one entry an action for ``discrete``, for
            ``multidiscrete`` the masks of its dimensions one after another.

        Raises
        ------
        ValueError
            For the kinds of actions that masks do not exist for.
        """
        patterns = np.zeros(len(PATTERNS), dtype=np.bool_)
        patterns[list(self.catalogue)] = True
        levels = np.ones(self.levels, dtype=np.bool_)
        if self.kind == "multidiscrete":
            return np.concatenate([*[patterns] * self.components, levels])
        if self.kind == "discrete":
            mask = levels
            for _ in range(self.components):
                mask = np.logical_and.outer(patterns, mask)
            return mask.ravel()
        raise ValueError(
            f"actions: {self.kind!r} is not allowed with masks; must be multidiscrete or discrete"
        )

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of patterns of each component, then number of speed levels."""
        return (*[len(PATTERNS)] * self.components, self.levels)

    @cached_property
    def _buildable(self) -> list[int]:
        """For each pattern the nearest that can be built; the first of equally near ones."""
        built = np.array(self.catalogue)
        shared = SIGNS @ SIGNS[built].T
        return built[np.argmax(shared, axis=1)].tolist()

    @cached_property
    def _built(self) -> Ints:
        """The same as an array."""
        return np.array(self._buildable, dtype=np.int64)

    @cached_property
    def _scaled(self) -> Floats:
        """The levels on the log scale from −1 to 1."""
        return np.array([scaled_speed(speed) for speed in self.speeds.tolist()])

    def _digits(self, values: Any, sizes: tuple[int, ...], count: int) -> Ints:
        """Return rows of integers from 0 to below `sizes`; a single size makes for no rows."""
        found = np.asarray(values)
        shape = (count,) if self.kind == "discrete" else (count, len(sizes))
        if found.shape != shape or found.dtype.kind not in "iu":
            raise self._refused_shape(found, shape)
        wrong = (found < 0) | (found >= (sizes[0] if self.kind == "discrete" else sizes))
        if wrong.any():
            row = int(np.argwhere(wrong)[0, 0])
            raise self._refused(f"actions[{row}]", found[row])
        return found

    def _numbers(self, values: Any, size: int, count: int) -> Floats:
        """Return rows of `size` numbers from −1 to 1."""
        found = np.asarray(values)
        if found.shape != (count, size) or found.dtype.kind not in "fiu":
            raise self._refused_shape(found, (count, size))
        found = found.astype(np.float64)
        right = np.abs(found) <= 1.0
        if not right.all():
            row = int(np.argwhere(~right)[0, 0])
            raise self._refused(f"actions[{row}]", found[row])
        return found

    def _refused(self, key: str, action: Any) -> ValueError:
        return ValueError(f"{key}: {action!r} is not allowed; must be {self._allowed}")

    def _refused_shape(self, found: NDArray[Any], shape: tuple[int, ...]) -> ValueError:
        return ValueError(
            f"actions: an array of {found.dtype} of shape {found.shape} is not allowed; must have "
            f"shape {shape}, a row (a number if discrete) for each environment: {self._allowed}"
        )

    @property
    def _allowed(self) -> str:
        """What an action must be, in words."""
        last, most = len(PATTERNS) - 1, self.levels - 1
        whole = f"pattern 0..{last} of each of {self.components} components"
        one = f"pattern 0..{last}"
        patterns = one if self.components == 1 else whole
        if self.kind == "multidiscrete":
            size = "two" if self.components == 1 else str(self.components + 1)
            return f"{size} integers, {patterns} and speed level 0..{most}"
        if self.kind == "discrete":
            return f"an integer, 0..{self._count - 1}"
        if self.kind == "box":
            return f"{4 * self.components + 1} numbers from -1 to 1"
        return f"a mapping of patterns ({patterns}) and speed (one number from -1 to 1)"

    def _read_multidiscrete(self, action: Any) -> _Read | None:
        # A plain list is promoted as NumPy would, so that [3, 2] works as an action.
        digits = as_integers(action, self.sizes)
        return None if digits is None else (digits[:-1], float(self.speeds[digits[-1]]))

    def _read_discrete(self, action: Any) -> _Read | None:
        number = as_integers([action], (self._count,))
        if number is None:
            return None
        digits = np.array(np.unravel_index(number[0], self.sizes), dtype=np.int64)
        return digits[:-1], float(self.speeds[digits[-1]])

    def _read_box(self, action: Any) -> _Read | None:
        numbers = as_numbers(action, 4 * self.components + 1)
        if numbers is None:
            return None
        south = (numbers[:-1] <= 0.0).reshape(self.components, 4)
        return np.packbits(south, axis=1)[:, 0] >> 4, speed_at(numbers[-1])

    def _read_dict(self, action: Any) -> _Read | None:
        if not isinstance(action, Mapping):
            return None
        given = cast("Mapping[str, Any]", action)
        if set(given) != {"patterns", "speed"}:
            return None
        patterns = as_integers(given["patterns"], self.sizes[:-1])
        speed = as_numbers(given["speed"], 1)
        if patterns is None or speed is None:
            return None
        return patterns, speed_at(speed[0])
