"""Tests of energies of words against sums over charges, for all kinds of magnets."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.minimiser.energies import internal_energy, quadratic_forms, signs, word_energies
from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.shapes import headings, mirror, word_to_angles
from tests.minimiser import reference
from tests.minimiser.scenes import MODELS, STRENGTHS, sequences
from tests.words import reverse

SIDE = 0.0125
SEQUENCE = ("NSNN", "S-SN", "NNSS", "SSNS")
SIZES: dict[str, Any] = {
    "width": (0.005, 0.003, 0.006, 0.004), "height": (0.004, 0.009, 0.002, 0.006),
    "thickness": (0.001, 0.002, 0.0025, 0.001), "inset": (0.0005, 0.0003, 0.0004, 0.001),
}  # fmt: skip
ROWS = [(1.0 + k, 0.6, 0.5, 0.9 + k) for k in range(4)]
KINDS = {
    **MODELS, **STRENGTHS, "unequal strips": mf.Magnets(nodes=5, **SIZES),
    "unequal points": mf.Magnets(model="points", nodes=4, **SIZES),
    "unequal strips by component": mf.Magnets(nodes=5, **SIZES),
    "strips by component": mf.Magnets(nodes=5),
}  # fmt: skip
for _name, _lengths in SIZES.items():
    # One length at a time, and flat enough to fit: which of them goes wrong shows in the name.
    _alone: dict[str, Any] = {"thickness": 0.002, _name: _lengths}
    KINDS[f"{_name} alone"] = mf.Magnets(nodes=5, **_alone)
kinds = pytest.mark.parametrize("kind", KINDS)


def scene_of(sequence: tuple[str, ...], kind: str) -> mf.Scene:
    scene = mf.Scene(sequence=sequence, magnets=KINDS[kind])
    rows = ROWS[: len(sequence)]
    return scene.replace(magnets={"remanence": rows}) if "component" in kind else scene


@kinds
def test_word_energies_are_sums_over_charges(kind: str) -> None:
    scene: Any = scene_of(SEQUENCE, kind)
    lattice = all_words(scene.n)
    words = [lattice.word(row) for row in range(len(lattice))]
    expected = [reference.energy(scene, word) for word in words]
    scale = np.abs(expected).max()
    found = word_energies(scene, lattice)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * scale)
    # They are a quadratic form in the signs, in which faces of one component do not couple.
    form, s = quadratic_forms(scene, lattice), signs(SEQUENCE).ravel()
    summed = np.einsum("a,wab,b->w", s, form, s)
    np.testing.assert_allclose(summed, expected, rtol=0, atol=1e-11 * scale)
    np.testing.assert_array_equal(form, form.transpose(0, 2, 1))
    assert not any(form[:, k : k + 4, k : k + 4].any() for k in range(0, 16, 4))
    for word, energy in list(zip(words, found, strict=True))[::5]:
        angles = headings(word_to_angles(word), first=0.7)
        assert energy == pytest.approx(mf.energy(scene, angles), rel=1e-10, abs=1e-11 * scale)


@kinds
def test_internal_energy_counts_every_pair_of_charges_once(kind: str) -> None:
    scene: Any = scene_of(SEQUENCE, kind)
    expected = reference.own_energy(scene) + reference.internal_energy(scene)
    assert internal_energy(scene) == pytest.approx(expected, rel=1e-10)
    state = mf.minimise(scene).best
    assert state.coulomb_score - state.energy == pytest.approx(expected)


def image_of(scene: mf.Scene, order: list[int], end: int) -> mf.Scene:
    """Return a chain seen from an end (1 or −1), with its casings' faces in another order."""
    assert scene.magnets is not None
    lengths = {name: np.broadcast_to(getattr(scene.magnets, name), 4)[order] for name in SIZES}
    charges = scene.magnets.charges(scene.n)[::end, order]
    faces = ["".join(each[k] for k in order) for each in scene.sequence[::end]]
    return scene.replace(sequence=faces, magnets={**lengths, "pole_charge": charges})


FLIP = str.maketrans("NS", "SN")


@pytest.mark.laws
@given(sequence=sequences(2, 4), kind=st.sampled_from(sorted(KINDS)))
def test_symmetries_and_scales(sequence: tuple[str, ...], kind: str) -> None:
    scene: Any = scene_of(sequence, kind)
    lattice = all_words(scene.n)
    words = [lattice.word(row) for row in range(len(lattice))]
    here = word_energies(scene, lattice)
    larger = {name: 2.0 * np.array(getattr(scene.magnets, name)) for name in SIZES}
    charges = 3.0 * scene.magnets.charges(scene.n)
    images = [
        (image_of(scene, [3, 2, 1, 0], 1), mirror, 1.0),
        (image_of(scene, [2, 3, 0, 1], -1), reverse, 1.0),
        (scene.replace(sequence=[faces.translate(FLIP) for faces in sequence]), str, 1.0),
        (
            scene.replace(casing={"side": 2 * SIDE}, magnets={**larger, "pole_charge": charges}),
            str,
            4.5,  # charge² / length
        ),
    ]
    for other, image, factor in images:
        there = word_energies(other, from_words([image(word) for word in words]))
        atol = 1e-12 * max(np.abs(here).max(), 1e-9)
        np.testing.assert_allclose(there, factor * here, rtol=0, atol=factor * atol)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4])
def test_chosen_nodes_keep_the_accuracy(accuracy: float) -> None:
    lattice = all_words(len(SEQUENCE))
    fine = mf.Scene(sequence=SEQUENCE, magnets=mf.Magnets(nodes=48, **SIZES))
    scene = fine.replace(magnets={"nodes": None, "accuracy": accuracy})
    exact = word_energies(fine, lattice)
    assert np.abs(word_energies(scene, lattice) - exact).max() < accuracy * np.abs(exact).max()
    assert internal_energy(scene) == pytest.approx(internal_energy(fine), rel=1e-4)


def test_empty_faces_have_no_energy_and_are_at_odds_with_none() -> None:
    assert internal_energy(mf.Scene(sequence=SEQUENCE, magnets=None)) == 0.0
    assert not word_energies(mf.Scene(sequence=SEQUENCE, magnets=None), all_words(4)).any()
    states = mf.minimise(mf.Scene(sequence=("----", "NNNN", "----")), top=50, among="folded").states
    assert all(state.stable and state.energy == 0.0 for state in states)


@pytest.mark.parametrize("mode", ["free", "forward", "backward"])
def test_a_field_is_refused(mode: Any) -> None:
    scene = mf.Scene(sequence=("NSNS",) * 3)
    acting = scene.replace(field={"uniform": (0.0, 1e-3)})
    with pytest.raises(ValueError, match=r"^field: .* is not allowed; energy minimisation ign"):
        mf.minimise(acting, mode)
    still = scene.replace(field={"uniform": (0.0, 0.0)})
    assert mf.minimise(still, mode) == mf.minimise(scene, mode)
