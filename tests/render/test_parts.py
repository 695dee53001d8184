"""The list of parts of a chain."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.render.parts import casing_texts, kind_text, kinds, release_text

ANCHOR = mf.load_scene("anchor")


def test_every_magnet_is_counted_once_and_where_it_is() -> None:
    found, where = kinds(ANCHOR)
    empty = np.array([[pole == "-" for pole in faces] for faces in ANCHOR.sequence])
    np.testing.assert_array_equal(where == -1, empty)
    assert [kind.name for kind in found] == ["A", "B"]
    for index, kind in enumerate(found):
        assert kind.pieces == (where == index).sum()
    assert sum(kind.pieces for kind in found) == "".join(ANCHOR.sequence).count("N") + "".join(
        ANCHOR.sequence
    ).count("S")
    # Front faces have the small strong blocks.
    assert (where[:, [0, 3]] == 0).all()
    assert found[0].width == found[0].height == 0.004
    assert kind_text(found[0]) == (
        "12 pieces, 4 × 4 × 2 mm, inset 0.5 mm: remanence 1.2 T (NdFeB N35, 1.17–1.22 T)"
    )


def test_equal_magnets_are_one_kind_unless_their_strengths_differ() -> None:
    scene = mf.Scene(sequence=("NSNS", "SNSN"))
    assert [kind.pieces for kind in kinds(scene)[0]] == [8]
    rows = ((1.0, 1.0, 1.0, 1.0), (2.0, 1.0, 1.0, 1.0))
    found, where = kinds(scene.replace(magnets={"pole_charge": rows}))
    assert [kind.pieces for kind in found] == [7, 1]
    assert where[1, 0] == 1
    assert kind_text(found[1]).endswith("pole charge 2 A·m")


def test_kinds_are_named_after_the_alphabet_and_on() -> None:
    rows = tuple(tuple(1.0 + 0.01 * (4 * k + f) for f in range(4)) for k in range(7))
    scene = mf.Scene(sequence=("NNNN",) * 7).replace(magnets={"remanence": rows})
    names = [kind.name for kind in kinds(scene)[0]]
    assert names[:3] + names[-2:] == ["A", "B", "C", "AA", "AB"]


def test_a_chain_without_magnets_needs_none() -> None:
    found, where = kinds(mf.load_scene("pendulum-3"))
    assert found == []
    assert (where == -1).all()


def test_casings_and_release_are_told_in_workshop_units() -> None:
    scene = mf.Scene(sequence=("NSNS",) * 2).replace(casing={"mass": (0.003, 0.004)})
    assert "side 12.5 mm, 3 to 4 g each" in casing_texts(scene)[0]
    assert casing_texts(scene)[1].startswith("Joints stop at ±90°")
    assert casing_texts(scene.replace(contact=False))[1].startswith("No joint stops")


@pytest.mark.parametrize(("direction", "first"), [("forward", 1), ("backward", 6)])
def test_who_leaves_the_tube_first_is_told(direction: str, first: int) -> None:
    scene = mf.load_scene("tube-feed").replace(feed={"direction": direction, "speed": 0.08})
    text = release_text(scene)
    assert f"component {first} leaves first, at 80 mm/s" in text
    assert "magnets are set at the mouth" in text
    assert release_text(scene.replace(mount="free")) == "Free release."
    assert "pinned" in release_text(scene.replace(mount="pinned"))
