"""Packed memory: what is loaded again is what was packed."""

from typing import Any

import numpy as np
import pytest

from magfold_env.browser import memory
from magfold_env.engine.compile import by_pointer

pytestmark = pytest.mark.skipif(
    not by_pointer.POINTERS, reason="needs kernels that take tuples by pointer"
)


def loaded(image: memory.Image) -> bytearray:
    """Return a block as a page loads it, addresses still from its beginning."""
    block, first = bytearray(image.size), 0
    for offset, length in image.pieces:
        block[offset : offset + length] = image.data[first : first + length]
        first += length
    assert first == len(image.data)
    return block


@pytest.fixture(scope="module")
def images() -> tuple[memory.Image, dict[int, memory.Image]]:
    return memory.images()


def test_fields_hold_what_was_packed(images: tuple[Any, dict[int, Any]]) -> None:
    shared, chains = images
    for n, image in chains.items():
        block = loaded(image)
        offset, kind, shape = image.fields["settings.face"]
        face = np.frombuffer(block, "f8", int(np.prod(shape)), offset)
        assert kind == "f64"
        assert (face == 0.006).all()
        assert image.fields["state.q"].shape == (n + 2,)
    offset, _, shape = shared.fields["far.band"]
    band = np.frombuffer(loaded(shared), "f8", int(np.prod(shape)), offset).reshape(shape)
    assert np.allclose(band[1:-1].sum(axis=1), 1.0)


def test_addresses_lie_in_their_block(images: tuple[Any, dict[int, Any]]) -> None:
    shared, chains = images
    for image in (shared, *chains.values()):
        block = loaded(image)
        for places, end in ((image.own, image.size), (image.shared, shared.size)):
            for place in places:
                (address,) = np.frombuffer(block, "i8", 1, place)
                assert 0 <= address < end
        assert len({*image.own, *image.shared}) == len(image.own) + len(image.shared)
