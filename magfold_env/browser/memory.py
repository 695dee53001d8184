"""Packed memory: the data of chains of every length, and the data that they share, as bytes.

A *block* holds NamedTuples of arrays in the kernels' form (`engine.compile.by_pointer`): words of
eight bytes for their fields, and the arrays' data. Words that are addresses count from the start of
their block or the shared block; the loader adds the actual start. Only nonzero parts are stored.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.browser.episode import Episode, new_episode
from magfold_env.browser.settings import MOST_OBSTACLES, Numbers, Settings
from magfold_env.browser.states import Couplings, Search, new_couplings, new_search
from magfold_env.browser.view import View
from magfold_env.engine import indices as ix
from magfold_env.engine.compile.by_pointer import pointer_types
from magfold_env.engine.state import Magnets, Model, Record, State, Work
from magfold_env.engine.workspace import new_record, new_state, new_work, zeros
from magfold_env.scene import Scene
from magfold_env.simulation.far_table import FarKit, new_far_kit
from magfold_env.simulation.near_table import NearKit, new_near_kit
from magfold_env.simulation.pack import SIZED, Sizing, new_sizing, pack, quadrature_of
from magfold_env.simulation.quadrature import TABLE_RULE, Rule, choose_rule, single_rule

LENGTHS = range(2, 13)
FRAMES = 2048  # recorded before a page must fetch them
WORD = 8  # bytes
ALIGNED = 64  # bytes: arrays begin at a cache line
NEAR = 32  # bytes: shorter runs of zeros do not split a piece

TYPES = {"float64": "f64", "float32": "f32", "int64": "i64", "bool": "u8"}


def standard(n: int) -> Scene:
    """Return a scene of n components with the casing and magnets of all chains on the web page."""
    return Scene(sequence=("NNNN",) * n, start_angles=(0.0,) * (n - 1))


class Chain(NamedTuple):
    """All data of one chain."""

    model: Model
    state: State
    work: Work
    probe: Work  # separate scratch space, so that measuring does not affect the run
    record: Record
    settings: Settings
    view: View
    search: Search
    episode: Episode


class Shared(NamedTuple):
    """Data that chains of all lengths share, and the data from which the page computes it."""

    magnets: Magnets
    near_magnets: Magnets  # whose sums give the tables of joint angles
    far_magnets: Magnets  # and the table of distant casings
    sizing: Sizing
    near_sizing: Sizing
    far_sizing: Sizing
    near: NearKit
    far: FarKit
    couplings: Couplings


def shared_of(scene: Scene) -> Shared:
    """Return data for all chains with a scene's sizes.

    The largest table is zero, because compression does not reduce its megabyte, and a page computes
    it in 0.2 s. The tables of joint angles are a quarter of that and would take 0.35 s.
    """
    magnets, part = pack(scene).magnets, scene.magnets
    made = magnets.tables
    if part is None or made.end == 0.0 or made.far.end == 0.0:
        raise ValueError("scene: must have magnets that both kinds of tables serve")
    far = made.far._replace(energy=np.zeros_like(made.far.energy))
    magnets = magnets._replace(tables=made._replace(far=far))
    near = quadrature_of(scene.casing, part, TABLE_RULE)
    single = quadrature_of(scene.casing, part, single_rule(1))
    size = np.zeros((5, 4))

    def sizing(rule: Rule, magnets: Magnets) -> Sizing:
        number = _word(magnets, SIZED[0], len(SIZED))
        return new_sizing(rule, True)[0]._replace(size=size, number=number)

    return Shared(
        magnets=magnets,
        near_magnets=near,
        far_magnets=single,
        sizing=sizing(choose_rule(part), magnets),
        near_sizing=sizing(TABLE_RULE, near),
        far_sizing=sizing(single_rule(1), single),
        near=new_near_kit(near)._replace(
            one=made.one,
            two=made.two.reshape(-1, made.one.shape[1]),
            square=made.two,
            number=_word(magnets, "tables.end", 2),
        ),
        far=new_far_kit(single)._replace(
            soften=far.soften, energy=far.energy, number=_word(magnets, "tables.far.end", 4)
        ),
        couplings=new_couplings(magnets, scene.casing.diagonal, LENGTHS[-1]),
    )


def chain_of(scene: Scene, magnets: Magnets, couplings: Couplings) -> Chain:
    """Return the data of chains as long as the scene's, with the scene's fixed properties."""
    n, part = scene.n, scene.magnets
    model = pack(scene)._replace(
        magnets=magnets, obstacles=np.zeros((ix.WALLS + MOST_OBSTACLES, ix.RADIUS + 1))
    )
    assert part is not None
    state, work, probe = new_state(model, np.zeros(n)), new_work(model), new_work(model)
    for array in state:
        cast("NDArray[Any]", array)[:] = 0
    record = new_record(model, 1.0, FRAMES)
    numbers = Numbers(
        **{name: _word(model, name) for name in Numbers._fields[:15]},
        interval=_word(record, "interval"),
        obstacles=_word(model, "obstacles", 3),
        boxes=_word(work, "boxes", 12),
        probe=_word(probe, "boxes", 12),
    )
    face = np.array([part.by_face("width"), part.by_face("height")])
    settings = zeros(Settings, {"n": n, "n + 1": n + 1}, face=face, numbers=numbers)
    view, search = zeros(View, {"n": n}), new_search(couplings, n)
    return Chain(model, state, work, probe, record, settings, view, search, new_episode(n))


def _word(packed: Any, name: str, count: int = 1) -> NDArray[Any]:
    """Return a writable view of ``count`` words of a packed NamedTuple, from a field on."""
    place, inner = place_of(packed, name)
    words = pointer_types.words_of(packed)[place : place + count]
    return words.view(np.float64) if isinstance(inner, float) else words


def place_of(packed: Any, name: str) -> tuple[int, Any]:
    """Return the place of a field's first word, and its value; ``name`` may be a dotted path."""
    place, inner = 0, packed
    for part in name.split("."):
        place += pointer_types.place_of(inner, part)
        inner = getattr(inner, part)
    return place, inner


class Field(NamedTuple):
    """Where an array's data lie in a block."""

    offset: int
    type: str
    shape: tuple[int, ...]


class Image(NamedTuple):
    """A block in its stored form."""

    size: int
    data: bytes
    """The pieces that are not zero, one after another."""
    pieces: list[tuple[int, int]]
    """Where each piece lies in the block, and how long it is."""
    own: list[int]
    """Places of the addresses that count from the beginning of this block."""
    shared: list[int]
    """Places of the addresses that count from the beginning of the shared block."""
    roots: dict[str, int]
    """Where each NamedTuple's words begin."""
    fields: dict[str, Field]
    """Arrays by the names of their fields, such as ``state.q``."""


class Block:
    """Memory that contains packed NamedTuples. They must live as long as the block.

    Arrays that are also in the ``shared`` block are stored only there.
    """

    def __init__(self, packed: tuple[Any, ...], shared: "Block | None" = None) -> None:
        self._data = bytearray()
        self._ranges: dict[int, tuple[int, int]] = {}  # by address: size, and place in this block
        self._own: list[int] = []
        self._others: list[int] = []
        self._fields: dict[str, Field] = {}
        parts: dict[str, Any] = cast("Any", packed)._asdict()
        self._roots = {
            name: self._keep(each.address, bytes(each.words)) for name, each in parts.items()
        }
        for name, each in parts.items():
            for word, field, array in _arrays(each, name, self._roots[name]):
                place = None if shared is None else shared.find(array)
                if array.size == 0:
                    place = 0
                elif place is not None:
                    self._others.append(word)
                else:
                    place = self._put(array)
                    self._own.append(word)
                    self._fields[field] = Field(place, TYPES[array.dtype.name], array.shape)
                self._data[word : word + WORD] = place.to_bytes(WORD, "little")

    def _keep(self, address: int, data: bytes) -> int:
        self._data += bytes(-len(self._data) % ALIGNED)
        place = len(self._data)
        self._ranges[address] = len(data), place
        self._data += data
        return place

    def find(self, array: NDArray[Any]) -> int | None:
        """Return where an array's data lie in this block, or None."""
        address = array.ctypes.data
        for first, (size, place) in self._ranges.items():
            if first <= address < first + size:
                return place + address - first
        return None

    def _put(self, array: NDArray[Any]) -> int:
        """Store an array's data and return where they lie."""
        found = self.find(array)
        if found is not None:
            return found
        owner = array
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        if not owner.flags.c_contiguous:
            raise ValueError("arrays that are packed must be C-contiguous")
        self._keep(owner.ctypes.data, owner.tobytes())
        return self._put(array)

    def image(self) -> Image:
        """Return the block in its stored form."""
        filled = np.flatnonzero(np.frombuffer(self._data, dtype=np.uint8))
        gaps = np.flatnonzero(np.diff(filled) > NEAR)
        first = filled[np.concatenate([[0], gaps + 1])] // WORD * WORD
        last = filled[np.concatenate([gaps, [filled.size - 1]])] // WORD * WORD + WORD
        pieces = [(int(a), int(b - a)) for a, b in zip(first, last, strict=True)]
        data = b"".join(self._data[place : place + size] for place, size in pieces)
        size = -(-len(self._data) // ALIGNED) * ALIGNED
        return Image(size, data, pieces, self._own, self._others, self._roots, self._fields)


def _arrays(packed: Any, name: str, word: int) -> Iterator[tuple[int, str, NDArray[Any]]]:
    """Yield the place of each array's address in a block, the array's name, and the array.

    ``word`` is the place of the first word of ``packed``, a NamedTuple with this ``name``.
    """
    for field, value in zip(packed._fields, packed, strict=True):
        if isinstance(value, np.ndarray):
            yield word, f"{name}.{field}", value
            word += WORD * (1 + value.ndim)
        elif isinstance(value, tuple):
            yield from _arrays(value, f"{name}.{field}", word)
            word += len(cast("Any", value).words)
        else:
            word += WORD


def images() -> tuple[Image, dict[int, Image]]:
    """Return the shared block, and the chains' blocks by length."""
    shared = shared_of(standard(LENGTHS[0]))
    block = Block(shared)
    chains = {
        n: Block(chain_of(standard(n), shared.magnets, shared.couplings), block).image()
        for n in LENGTHS
    }
    return block.image(), chains
