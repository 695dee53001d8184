"""What an agent decides, the pattern of magnets and a feed speed, and how it is written down.

Every environment reads its actions here: patterns of magnets (of one component, or of the whole
sequence at once) and a feed speed, or a feed speed alone. Components that cannot be built are
replaced by the nearest that can, the one with the fewest other faces; `ActionTable.masks` says
beforehand which patterns stand for themselves.
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, ClassVar, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.tasks.checks import one_of, whole
from magfold_env.scene import SIGNS as SIGN_OF

SLOWEST = 0.01
"""Lowest feed speed on offer [m/s]."""

FASTEST = 0.6
"""Highest feed speed on offer [m/s]."""

DEAD_BAND = 0.025
"""Feed speed below which a drive that goes both ways stands still [m/s]."""

SLOWEST_LEVEL = 0.03
"""Lowest feed speed in a table of both ways [m/s]."""

PATTERNS: tuple[str, ...] = tuple("".join(faces) for faces in product("NS", repeat=4))
"""The 16 magnet patterns. Read an index as four bits, front-left first, front-right last, N = 0
and S = 1: 0 is NNNN, 1 is NNNS, 8 is SNNN, 15 is SSSS."""

SIGNS: NDArray[np.float64] = np.array(
    [[1.0 if face == "N" else -1.0 for face in faces] for faces in PATTERNS]
)
"""The patterns as numbers, N = 1 and S = −1, shape (16, 4)."""

_LETTERS = {sign: letter for letter, sign in SIGN_OF.items()}
_INDEX = {faces: index for index, faces in enumerate(PATTERNS)}

_MIDDLE = float(np.sqrt(SLOWEST * FASTEST))
_HALF_RANGE = float(np.log(FASTEST / _MIDDLE))


def signs_of(faces: str) -> NDArray[np.float64]:
    """Return the outward poles of a component, N = 1, S = −1, - = 0, shape (4,)."""
    if faces in _INDEX:
        return SIGNS[_INDEX[faces]]
    return np.array([SIGN_OF[face] for face in faces])


def letters_of(signs: NDArray[np.float64]) -> str:
    """Return the faces of a component, from its outward poles (4,)."""
    return "".join(_LETTERS[sign] for sign in signs.tolist())


def speed_levels(levels: int) -> NDArray[np.float64]:
    """Return feed speeds [m/s], log-spaced from `SLOWEST` to `FASTEST`, shape (levels,).

    Raises
    ------
    ValueError
        If that is not a whole number, 2 or more.
    """
    return speeds_at(np.linspace(-1.0, 1.0, whole("speeds", levels, 2)))


def speed_at(scaled: float) -> float:
    """Return the speed [m/s] at a place on the log scale: `SLOWEST` at −1, `FASTEST` at 1."""
    return float(speeds_at(scaled))


def scaled_speed(speed: float) -> float:
    """Return where a speed [m/s] lies on the log scale from −1 to 1."""
    return float(scaled_speeds(speed))


def speeds_at(scaled: Any) -> Any:
    """Return what `speed_at` does, of a number or of each in an array.

    Machines whose exponentials differ in the last bit agree on speeds to 1e-12 m/s.
    """
    exponents: Floats = np.asarray(_HALF_RANGE * scaled, dtype=np.float64)
    return np.clip(np.round(_MIDDLE * np.exp(exponents), 12), SLOWEST, FASTEST)


def scaled_speeds(speeds: Any) -> Any:
    """Return what `scaled_speed` does, of a number or of each in an array."""
    return np.log(speeds / _MIDDLE) / _HALF_RANGE


def read_catalogue(catalogue: Sequence[str] | None) -> tuple[int, ...]:
    """Return the numbers of the patterns in `catalogue`, ascending; None stands for all 16.

    Raises
    ------
    ValueError
        If it is empty or holds anything but such patterns.
    """
    if catalogue is None:
        return tuple(range(len(PATTERNS)))
    given: Any = catalogue
    is_list = isinstance(given, Sequence) and not isinstance(given, str)
    wrong = [faces for faces in catalogue if faces not in PATTERNS] if is_list else []
    if not is_list or wrong or not catalogue:
        raise ValueError(
            f"catalogue: {(wrong[0] if wrong else catalogue)!r} is not allowed; must be a list "
            "of components of four letters N or S, such as ['NSNS', 'NNSS']"
        )
    return tuple(sorted({PATTERNS.index(faces) for faces in catalogue}))


ActionKind = Literal["multidiscrete", "discrete", "box"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Choice = tuple[Ints, Floats, Floats]
"""Patterns, (m, components); feed speeds [m/s] and the same on the log scale, (m,)."""

MOST_DISCRETE = 1_000_000
"""Most single actions that a `discrete` space may have."""

ROUNDING = 1e-6
"""By how much a number of a ``Box`` may miss its bounds: `gymnasium.wrappers.RescaleAction` returns
1.0000001. It counts as the bound."""


class Actions:
    """What is common to all actions: reading arrays of them, and refusing what is none."""

    kind: ActionKind

    @property
    @abstractmethod
    def _allowed(self) -> str:
        """What an action must be, in words."""

    @abstractmethod
    def read(self, actions: Any, count: int) -> Any:
        """Return what so many actions ask for."""

    def read_one(self, action: Any) -> Any:
        """Return what `read` does for a single action.

        Raises
        ------
        ValueError
            If `action` is not in the space.
        """
        try:
            # A plain list is promoted as NumPy would, so that [3, 2] works as an action.
            return self.read(np.asarray(action)[None], 1)
        except ValueError:
            raise self._refused("action", action) from None

    def _digits(self, values: Any, sizes: tuple[int, ...], count: int) -> Ints:
        """Return rows of integers from 0 to below `sizes`; if discrete, a number for each row."""
        found = np.asarray(values)
        shape = (count,) if self.kind == "discrete" else (count, len(sizes))
        if found.shape != shape or found.dtype.kind not in "iu":
            raise self._refused_shape(found, shape)
        if count == 1 and all(map(_is_within, found.ravel().tolist(), sizes)):
            return found  # several times as fast as arrays of one
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
        right = np.abs(found) <= 1.0 + ROUNDING
        if not right.all():
            row = int(np.argwhere(~right)[0, 0])
            raise self._refused(f"actions[{row}]", found[row])
        return np.clip(found, -1.0, 1.0)

    def _refused(self, key: str, action: Any) -> ValueError:
        return ValueError(f"{key}: {action!r} is not allowed; must be {self._allowed}")

    def _refused_shape(self, found: NDArray[Any], shape: tuple[int, ...]) -> ValueError:
        return ValueError(
            f"actions: an array of {found.dtype} of shape {found.shape} is not allowed; must have "
            f"shape {shape}, a row (a number if discrete) for each environment: {self._allowed}"
        )


def _is_within(value: int, size: int) -> bool:
    return 0 <= value < size


@dataclass(frozen=True)
class ActionTable(Actions):
    """How magnets and a speed are written.

    Attributes
    ----------
    levels : int
        Number of speed levels, log-spaced from 0.01 to 0.6 m/s, both included.
    components : int
        Number of components that one action describes.
    kind : {"multidiscrete", "discrete", "box"}
        ``multidiscrete``: the patterns, then the speed level. ``discrete``: the same as one
        number, the speed level the last digit. ``box``: four numbers from −1 to 1 a component,
        above 0 is N, and the speed on a log scale from −1 to 1.
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
                "must be multidiscrete or box"
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
        return spaces.Box(-1.0, 1.0, shape=(4 * self.components + 1,), dtype=np.float32)

    def decode(self, action: Any) -> tuple[tuple[str, ...], float]:
        """Return the faces of each component, and the speed [m/s].

        Raises
        ------
        ValueError
            If `action` is not in the space.
        """
        patterns, speeds, _ = self.read_one(action)
        numbers: list[int] = patterns[0].tolist()
        return tuple(PATTERNS[number] for number in numbers), float(speeds[0])

    def read(self, actions: Any, count: int) -> Choice:
        """Return what each of `count` actions asks for, as Gymnasium batches them.

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
        if self.kind in ("multidiscrete", "discrete"):
            if self.kind == "discrete":
                number = self._digits(actions, (self._count,), count)
                digits = np.stack(np.unravel_index(number, self.sizes), axis=-1)
            else:
                digits = self._digits(actions, self.sizes, count)
            levels = digits[:, -1]
            return self._built[digits[:, :-1]], self.speeds[levels], self._scaled[levels]
        numbers = self._numbers(actions, 4 * self.components + 1, count)
        south = (numbers[:, :-1] <= 0.0).reshape(count, self.components, 4)
        patterns = np.packbits(south, axis=2)[:, :, 0] >> 4
        speeds = speeds_at(numbers[:, -1])
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
        return np.append(SIGNS[patterns].astype(np.float32).ravel(), scaled)

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

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Number of patterns of each component, then number of speed levels."""
        return (*[len(PATTERNS)] * self.components, self.levels)

    @cached_property
    def _built(self) -> Ints:
        """For each pattern the nearest that can be built; the first of equally near ones."""
        built = np.array(self.catalogue, dtype=np.int64)
        shared = SIGNS @ SIGNS[built].T
        return built[np.argmax(shared, axis=1)]

    @cached_property
    def _scaled(self) -> Floats:
        """The levels on the log scale from −1 to 1."""
        return np.array([scaled_speed(speed) for speed in self.speeds.tolist()])

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
        return f"{4 * self.components + 1} numbers from -1 to 1"


@dataclass(frozen=True)
class SpeedTable(Actions):
    """How the speed of a feed that goes both ways is written, standstill included.

    Attributes
    ----------
    levels : int
        Number of speed levels each way, log-spaced from `SLOWEST_LEVEL` to `FASTEST`.
    kind : {"box", "discrete", "multidiscrete"}
        ``box``: one number x from −1 to 1, for the speed 0.6 m/s · x |x|, or standstill where that
        is slower than `DEAD_BAND`. ``discrete``: a number among the speeds of the table, ascending
        from −0.6 m/s; ``levels`` is standstill. ``multidiscrete``: the same as a list of one.
    """

    levels: int
    kind: ActionKind = "box"

    per_level: ClassVar[int] = 2
    """How many of the ``discrete`` actions a speed level makes."""

    def __post_init__(self) -> None:
        whole("speeds", self.levels, 2)
        one_of("actions", self.kind, ActionKind)

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """The levels back, standstill and the levels ahead [m/s], (2 levels + 1,), ascending."""
        ahead = np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, self.levels), 12)
        return np.concatenate([-ahead[::-1], [0.0], ahead])

    @cached_property
    def space(self) -> spaces.Space[Any]:
        """Gymnasium's description of the actions."""
        if self.kind == "discrete":
            return spaces.Discrete(2 * self.levels + 1)
        if self.kind == "multidiscrete":
            return spaces.MultiDiscrete([2 * self.levels + 1])
        return spaces.Box(-1.0, 1.0, shape=(1,), dtype=np.float32)

    def decode(self, action: Any) -> float:
        """Return the speed [m/s] that `action` asks for.

        Raises
        ------
        ValueError
            If `action` is not in the space.
        """
        return float(self.read_one(action)[0][0])

    def encode(self, speed: float) -> Any:
        """Return the action nearest to a speed [m/s]."""
        return self.write((np.array([speed]),))[0]

    def write(self, choice: tuple[Floats]) -> Any:
        """Return the actions nearest to speeds [m/s], as Gymnasium batches them."""
        (speeds,) = choice
        if self.kind in ("discrete", "multidiscrete"):
            levels = np.abs(self.speeds - speeds[:, None]).argmin(axis=1)
            return levels if self.kind == "discrete" else levels[:, None]
        shares = np.clip(speeds / FASTEST, -1.0, 1.0)
        return (np.sign(shares) * np.sqrt(np.abs(shares))).astype(np.float32)[:, None]

    def read(self, actions: Any, count: int) -> tuple[Floats]:
        """Return the speeds [m/s] that `count` actions ask for, as Gymnasium batches them.

        Raises
        ------
        ValueError
            If one of `actions` is not in the space, or there are not `count`.
        """
        if self.kind in ("discrete", "multidiscrete"):
            levels = self._digits(actions, (2 * self.levels + 1,), count).reshape(count)
            return (self.speeds[levels],)
        shares = self._numbers(actions, 1, count)[:, 0]
        speeds = FASTEST * shares * np.abs(shares)
        return (np.where(np.abs(speeds) < DEAD_BAND, 0.0, speeds),)

    @property
    def _allowed(self) -> str:
        """What an action must be, in words."""
        level = f"an integer, 0..{2 * self.levels}"
        if self.kind == "box":
            return "one number from -1 to 1"
        return level if self.kind == "discrete" else f"a list of {level}"
