"""The decisions of an agent and their encodings as actions.

Every environment decodes its actions here. An action sets the magnet patterns of one component or
of the whole chain, and a feed speed (`ActionTable`); only a feed speed (`SpeedTable`); or a
component of a tray, its orientation and a feed speed (`TrayTable`).
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import Any, ClassVar, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.tasks.checks import one_of, require, whole
from magfold_env.scene import SIGNS as SIGN_OF

SLOWEST = 0.01
"""Lowest available feed speed [m/s]."""

FASTEST = 0.6
"""Highest available feed speed [m/s]."""

DEAD_BAND = 0.025
"""Feed speed below which a two-way drive stands still [m/s]."""

SLOWEST_LEVEL = 0.03
"""Lowest feed speed other than zero in a two-way table [m/s]."""

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


def speeds_at(scaled: Any) -> Any:
    """Return the speeds [m/s] at positions on the log scale: `SLOWEST` at −1, `FASTEST` at 1.

    Speeds are rounded to 1e-12 m/s, because exponentials differ slightly between machines.
    """
    exponents: Floats = np.asarray(_HALF_RANGE * scaled, dtype=np.float64)
    return np.clip(np.round(_MIDDLE * np.exp(exponents), 12), SLOWEST, FASTEST)


def scaled_speeds(speeds: Any) -> Any:
    """Return the positions of speeds [m/s] on the log scale from −1 to 1."""
    return np.log(speeds / _MIDDLE) / _HALF_RANGE


def read_catalogue(catalogue: Sequence[str] | None) -> tuple[int, ...]:
    """Return the numbers of the patterns in `catalogue`, ascending; None means all 16."""
    if catalogue is None:
        return tuple(range(len(PATTERNS)))
    given: Any = catalogue
    is_list = isinstance(given, Sequence) and not isinstance(given, str)
    wrong = [faces for faces in catalogue if faces not in PATTERNS] if is_list else []
    allowed = "must be a list of components of four letters N or S, such as ['NSNS', 'NNSS']"
    right = is_list and not wrong and bool(catalogue)
    require(right, "catalogue", wrong[0] if wrong else catalogue, allowed)
    return tuple(sorted({PATTERNS.index(faces) for faces in catalogue}))


FACES: NDArray[np.int64] = np.array(
    [np.roll(faces, turn) for faces in ([0, 1, 2, 3], [3, 2, 1, 0]) for turn in range(4)]
)
"""Index of the face at each position, (8, 4), for every orientation: 0 to 3 quarter turns to the
left, then the same turns of a component that is turned over about its long axis."""

LYING: NDArray[np.int64] = np.array(
    [
        [_INDEX["".join(faces[place] for place in places)] for places in FACES.tolist()]
        for faces in PATTERNS
    ]
)
"""Number of the pattern that each pattern becomes in every orientation, (16, 8)."""

AHEAD, BACK, PULL = range(3)
"""Kinds of steps: feed a component, draw one back, or pull the chain."""

ActionKind = Literal["multidiscrete", "discrete", "box"]
TrayKind = Literal["multidiscrete", "discrete"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Choice = tuple[Ints, Floats, Floats]
"""Patterns, (m, components); feed speeds [m/s] and the same on the log scale, (m,)."""

TrayChoice = tuple[Ints, Ints, Floats, Ints]
"""Components, orientations, feed speeds [m/s] and kinds of steps, (m,)."""

MOST_DISCRETE = 1_000_000
"""Largest number of actions in a `discrete` space."""

ROUNDING = 1e-6
"""Amount by which numbers may exceed the bounds of a ``box``; they are then clipped. For example,
`gymnasium.wrappers.RescaleAction` returns 1.0000001."""


class Actions:
    """The encoding of actions, and the decoding of arrays of actions.

    There are three kinds. ``multidiscrete``: whole numbers. ``discrete``: one number whose digits
    are those numbers. ``box``: numbers from −1 to 1.
    """

    kind: ActionKind
    levels: int
    kinds: ClassVar[Any] = ActionKind
    """The allowed kinds."""

    def __post_init__(self) -> None:
        whole("speeds", self.levels, 2)
        one_of("actions", self.kind, self.kinds)

    @property
    def width(self) -> int:
        """Length of a ``box`` action."""
        return 0

    @property
    @abstractmethod
    def sizes(self) -> tuple[int, ...]:
        """Number of values of each entry of a ``multidiscrete`` action."""

    @property
    @abstractmethod
    def _allowed(self) -> str:
        """Description of the allowed ``multidiscrete`` actions."""

    @abstractmethod
    def read(self, actions: Any, count: int) -> Any:
        """Decode `count` actions."""

    @cached_property
    def count(self) -> int:
        """Number of ``discrete`` actions."""
        return prod(self.sizes)

    @cached_property
    def space(self) -> spaces.Space[Any]:
        """The Gymnasium space of the actions."""
        if self.kind == "multidiscrete":
            return spaces.MultiDiscrete(list(self.sizes))
        if self.kind == "discrete":
            return spaces.Discrete(self.count)
        return spaces.Box(-1.0, 1.0, shape=(self.width,), dtype=np.float32)

    def read_one(self, action: Any) -> Any:
        """Return the result of `read` for a single action."""
        try:
            # NumPy converts plain lists, so that [3, 2] works as an action.
            return self.read(np.asarray(action)[None], 1)
        except ValueError:
            raise self._refused("action", action) from None

    def _digits(self, actions: Any, count: int) -> Ints:
        """Return the whole numbers of actions other than ``box``, (count, sizes)."""
        found = np.asarray(actions)
        one = self.kind == "discrete"
        sizes = (self.count,) if one else self.sizes
        shape = (count,) if one else (count, len(sizes))
        if found.shape != shape or found.dtype.kind not in "iu":
            raise self._refused_shape(found, shape)
        # For one action, this is several times as fast as arrays of one element.
        if count > 1 or not all(map(_is_within, found.ravel().tolist(), sizes)):
            wrong = (found < 0) | (found >= (self.count if one else sizes))
            if wrong.any():
                row = int(np.argwhere(wrong)[0, 0])
                raise self._refused(f"actions[{row}]", found[row])
        return np.stack(np.unravel_index(found, self.sizes), axis=-1) if one else found

    def _numbers(self, actions: Any, count: int) -> Floats:
        """Return the numbers of ``box`` actions, (count, width)."""
        found = np.asarray(actions)
        if found.shape != (count, self.width) or found.dtype.kind not in "fiu":
            raise self._refused_shape(found, (count, self.width))
        found = found.astype(np.float64)
        right = np.abs(found) <= 1.0 + ROUNDING
        if not right.all():
            row = int(np.argwhere(~right)[0, 0])
            raise self._refused(f"actions[{row}]", found[row])
        return np.clip(found, -1.0, 1.0)

    def _written(self, digits: Ints) -> Any:
        """Return ``discrete`` or ``multidiscrete`` actions from whole numbers, (…, sizes)."""
        if self.kind == "multidiscrete":
            return digits
        return np.int64(np.ravel_multi_index(tuple(digits.T), self.sizes))

    def _refused(self, key: str, action: Any) -> ValueError:
        return ValueError(f"{key}: {action!r} is not allowed; must be {self._must_be}")

    def _refused_shape(self, found: NDArray[Any], shape: tuple[int, ...]) -> ValueError:
        return ValueError(
            f"actions: an array of {found.dtype} of shape {found.shape} is not allowed; must have "
            f"shape {shape}, a row (a number if discrete) for each environment: {self._must_be}"
        )

    @property
    def _must_be(self) -> str:
        if self.kind == "discrete":
            return f"an integer, 0..{self.count - 1}"
        if self.kind == "box":
            return f"{'one number' if self.width == 1 else f'{self.width} numbers'} from -1 to 1"
        return self._allowed


def _is_within(value: int, size: int) -> bool:
    return 0 <= value < size


@dataclass(frozen=True)
class ActionTable(Actions):
    """Actions that choose magnets and a speed.

    ``multidiscrete``: the patterns, then the speed level. ``discrete``: the same as one number; its
    last digit is the speed level. ``box``: four numbers from −1 to 1 per component, above 0 for N,
    then the speed on a log scale from −1 to 1.

    If a component cannot be built, the one that can be built and differs in the fewest faces
    replaces it. `masks` returns the actions that need no replacement.
    """

    levels: int
    """Number of speed levels, log-spaced from 0.01 to 0.6 m/s, both included."""
    components: int = 1
    """Number of components that one action sets."""
    kind: ActionKind = "multidiscrete"
    catalogue: tuple[int, ...] = tuple(range(len(PATTERNS)))
    """The patterns that can be built, ascending; all 16 by default."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind == "discrete" and self.count > MOST_DISCRETE:
            raise ValueError(
                f"actions: 'discrete' is not allowed for {self.components} components at a time; "
                f"{self.count} actions are more than {MOST_DISCRETE}, must be multidiscrete or box"
            )

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of patterns of each component, then number of speed levels."""
        return (*[len(PATTERNS)] * self.components, self.levels)

    @property
    def width(self) -> int:
        """Length of a ``box`` action."""
        return 4 * self.components + 1

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """Feed speed of each level [m/s], shape (levels,), ascending."""
        return speeds_at(np.linspace(-1.0, 1.0, self.levels))

    def decode(self, action: Any) -> tuple[tuple[str, ...], float]:
        """Return the faces of each component, and the speed [m/s]."""
        patterns, speeds, _ = self.read_one(action)
        numbers: list[int] = patterns[0].tolist()
        return tuple(PATTERNS[number] for number in numbers), float(speeds[0])

    def read(self, actions: Any, count: int) -> Choice:
        """Decode `count` actions in Gymnasium's batched form."""
        if self.kind != "box":
            digits = self._digits(actions, count)
            levels = digits[:, -1]
            return self._built[digits[:, :-1]], self.speeds[levels], self._scaled[levels]
        numbers = self._numbers(actions, count)
        south = (numbers[:, :-1] <= 0.0).reshape(count, self.components, 4)
        patterns = np.packbits(south, axis=2)[:, :, 0] >> 4
        speeds = speeds_at(numbers[:, -1])
        return self._built[patterns], speeds, scaled_speeds(speeds)

    def encode(self, faces: str | Sequence[str], speed: float) -> Any:
        """Return the action for the faces of one component or of each, and for a speed [m/s].

        Forms other than ``box`` use the speed level that is nearest on the log scale.
        """
        each = [faces] if isinstance(faces, str) else faces
        patterns = np.array([PATTERNS.index(letters) for letters in each], dtype=np.int64)
        if self.kind != "box":
            return self._written(np.append(patterns, _level(self.speeds, speed)))
        scaled = np.array([np.clip(scaled_speeds(speed), -1.0, 1.0)], dtype=np.float32)
        return np.append(SIGNS[patterns].astype(np.float32).ravel(), scaled)

    def masks(self) -> NDArray[np.bool_]:
        """Return which actions request only components that can be built.

        The form is that of sb3-contrib's ``MaskablePPO``: an entry per action for ``discrete``, the
        concatenated masks of the dimensions for ``multidiscrete``. ``box`` has no masks.
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
    def _built(self) -> Ints:
        """For each pattern, the nearest one that can be built; the first of equally near ones."""
        built = np.array(self.catalogue, dtype=np.int64)
        shared = SIGNS @ SIGNS[built].T
        return built[np.argmax(shared, axis=1)]

    @cached_property
    def _scaled(self) -> Floats:
        """The speed levels on the log scale from −1 to 1."""
        return np.array([scaled_speeds(speed) for speed in self.speeds.tolist()])

    @property
    def _allowed(self) -> str:
        patterns, most = f"pattern 0..{len(PATTERNS) - 1}", self.levels - 1
        if self.components == 1:
            return f"two integers, {patterns} and speed level 0..{most}"
        patterns += f" of each of {self.components} components"
        return f"{self.components + 1} integers, {patterns} and speed level 0..{most}"


def _level(speeds: Floats, speed: float) -> int:
    """Return the level nearest to a speed [m/s], on the log scale."""
    return int(np.argmin(np.abs(np.log(speeds / speed))))


@dataclass(frozen=True)
class SpeedTable(Actions):
    """Actions that choose the speed of a two-way feed, including standstill.

    ``box``: one number x from −1 to 1, for the speed ``0.6 x |x|`` m/s, or standstill if that is
    slower than `DEAD_BAND`, 0.025 m/s. ``discrete``: the index of a speed in the table, ascending
    from −0.6 m/s; index ``levels`` is standstill. ``multidiscrete``: a list of this index.

    `encode` returns the action for a speed v. A ``box`` action is ``x = ±√(|v| / 0.6 m/s)``, such
    as 0.447 for 0.12 m/s; 0.2 means standstill.
    """

    levels: int
    """Number of speed levels in each direction, log-spaced from `SLOWEST_LEVEL` to `FASTEST`."""
    kind: ActionKind = "box"

    per_level: ClassVar[int] = 2
    """Number of ``discrete`` actions per speed level."""

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of speeds in the table."""
        return (2 * self.levels + 1,)

    @property
    def width(self) -> int:
        """Length of a ``box`` action."""
        return 1

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """Backward levels, standstill and forward levels [m/s], (2 levels + 1,), ascending."""
        ahead = np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, self.levels), 12)
        return np.concatenate([-ahead[::-1], [0.0], ahead])

    def encode(self, speed: float) -> Any:
        """Return the action for a speed [m/s], or for the nearest speed that can be requested."""
        return self.write((np.array([speed]),))[0]

    def write(self, choice: tuple[Floats]) -> Any:
        """Return the actions nearest to speeds [m/s], in Gymnasium's batched form."""
        (speeds,) = choice
        if self.kind != "box":
            levels = np.abs(self.speeds - speeds[:, None]).argmin(axis=1)
            return levels if self.kind == "discrete" else levels[:, None]
        shares = np.clip(speeds / FASTEST, -1.0, 1.0)
        return (np.sign(shares) * np.sqrt(np.abs(shares))).astype(np.float32)[:, None]

    def read(self, actions: Any, count: int) -> tuple[Floats]:
        """Return the speeds [m/s] that `count` actions in Gymnasium's batched form request."""
        if self.kind != "box":
            return (self.speeds[self._digits(actions, count)[:, 0]],)
        shares = self._numbers(actions, count)[:, 0]
        speeds = FASTEST * shares * np.abs(shares)
        return (np.where(np.abs(speeds) < DEAD_BAND, 0.0, speeds),)

    @property
    def _allowed(self) -> str:
        return f"a list of an integer, 0..{2 * self.levels}"


@dataclass(frozen=True)
class TrayTable(Actions):
    """Actions that choose a component of a tray, its orientation and a speed.

    ``multidiscrete``: the component, the orientation, the speed level, and 0 to feed or 1 to draw
    back. ``discrete``: the same as one number, whose last digit is 0 to feed or 1 to draw back.
    """

    parts: int
    """Initial number of components on the tray."""
    levels: int
    """Number of speed levels, log-spaced from 0.03 to 0.6 m/s, both included."""
    kind: ActionKind = "multidiscrete"
    ways: int = 2
    """Number of kinds of steps: 2 (feed, draw back), or 3, if the last number or digit may also be
    2, to pull the chain."""
    kinds = TrayKind

    @cached_property
    def speeds(self) -> Floats:
        """The speed levels [m/s], ascending."""
        return np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, self.levels), 12)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Numbers of components, orientations, speed levels and kinds of steps."""
        return self.parts, len(FACES), self.levels, self.ways

    @property
    def per_level(self) -> int:
        """Number of ``discrete`` actions per speed level."""
        return self.count // self.levels

    def read(self, actions: Any, count: int) -> TrayChoice:
        """Decode `count` actions in Gymnasium's batched form."""
        part, lie, level, way = self._digits(actions, count).T
        return part, lie, self.speeds[level], way

    def encode(self, part: int, lie: int, speed: float, *, back: bool = False) -> Any:
        """Return the action for a component, an orientation and the level nearest a speed [m/s]."""
        way = BACK if back else AHEAD
        return self._written(np.array([part, lie, _level(self.speeds, speed), way]))

    @property
    def pull(self) -> Any:
        """The action that pulls the chain, if there is one."""
        return self._written(np.array([0, 0, 0, PULL]))

    def write(self, choice: TrayChoice) -> Any:
        """Return the actions for components, orientations, speeds and kinds of steps."""
        part, lie, speeds, way = choice
        level = np.abs(np.log(self.speeds / speeds[:, None])).argmin(axis=1)
        return self._written(np.stack([part, lie, level, way], axis=1))

    def masks(self, there: NDArray[np.bool_], back: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which actions are possible, (m, …), in the form of `ActionTable.masks`.

        `there` is true for components on the trays, (m, parts), and `back` if a component can be
        drawn back, (m,).
        """
        count = len(back)
        go = np.ones((count, self.ways), dtype=np.bool_)
        go[:, BACK] = back
        if self.kind == "multidiscrete":
            others = np.ones((count, len(FACES) + self.levels), dtype=np.bool_)
            return np.concatenate([there, others, go], axis=1)
        mask = np.ones((count, *self.sizes), dtype=np.bool_)
        mask[..., AHEAD] = there[:, :, None, None]
        mask[..., BACK] = back[:, None, None, None]
        return mask.reshape(count, -1)

    @property
    def _allowed(self) -> str:
        most = [size - 1 for size in self.sizes]
        ways = "0 or 1, to draw back" if self.ways == PULL else "0, 1, to draw back, or 2, to pull"
        return (
            f"four integers, component 0..{most[0]}, orientation 0..{most[1]}, speed level "
            f"0..{most[2]} and {ways}"
        )
