"""Laws of the energy: what the mirror, the other end and a flip of all poles do to a word."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magfold_env.minimiser.energies import word_energies
from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.shapes import mirror
from tests.minimiser.scenes import MODELS, scene_of, sequences
from tests.words import reverse

pytestmark = pytest.mark.laws

FLIP = str.maketrans("NS", "SN")


def compare(
    sequence: tuple[str, ...], model: str, other: tuple[str, ...], image: Callable[[str], str]
) -> None:
    """Check that every word of `sequence` has the energy of its image with `other`."""
    lattice = all_words(len(sequence))
    images = from_words([image(lattice.word(row)) for row in range(len(lattice))])
    here = word_energies(scene_of(sequence, model), lattice)
    there = word_energies(scene_of(other, model), images)
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-12 * np.abs(here).max())


chains = given(sequence=sequences(2, 6), model=st.sampled_from(sorted(MODELS)))


@chains
@settings(max_examples=20)
def test_mirror(sequence: tuple[str, ...], model: str) -> None:
    compare(sequence, model, tuple(faces[::-1] for faces in sequence), mirror)


@chains
@settings(max_examples=20)
def test_seen_from_the_other_end(sequence: tuple[str, ...], model: str) -> None:
    turned = tuple(faces[2:] + faces[:2] for faces in reversed(sequence))
    compare(sequence, model, turned, reverse)


@chains
@settings(max_examples=20)
def test_all_poles_flipped(sequence: tuple[str, ...], model: str) -> None:
    compare(sequence, model, tuple(faces.translate(FLIP) for faces in sequence), str)


@chains
@settings(max_examples=10)
def test_energy_scales_with_charge_squared_and_inverse_size(
    sequence: tuple[str, ...], model: str
) -> None:
    scene = scene_of(sequence, model)
    assert scene.magnets is not None
    lengths = {
        key: 2 * getattr(scene.magnets, key) for key in ("width", "height", "thickness", "inset")
    }
    larger = scene.replace(
        casing={"side": 2 * scene.casing.side},
        magnets={**lengths, "pole_charge": 3 * scene.magnets.charge},
    )
    lattice = all_words(scene.n)
    here, there = word_energies(scene, lattice), word_energies(larger, lattice)
    np.testing.assert_allclose(there, 4.5 * here, rtol=0, atol=1e-12 * np.abs(there).max())
