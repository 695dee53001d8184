"""Magnets of a scene: which fit, and their charges face by face."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf

SCENE = mf.Scene(sequence=("NSNN", "NSSN", "SNSS"))


def test_magnets_that_just_touch_at_their_corners_fit() -> None:
    tight = SCENE.replace(magnets={"width": 0.0065})
    assert tight.magnets is not None
    assert tight.magnets.width == 0.0065


def test_remanence_gives_the_charge_of_a_block() -> None:
    # FACTS: B_r A / mu0 = 17.1887 A m for 0.6 T and 36 mm².
    assert mf.Magnets().charge == pytest.approx(17.1887, abs=5e-5)
    assert mf.Magnets(pole_charge=8.5946).charge == 8.5946
    assert mf.Magnets(pole_charge=8.5946).remanence is None


def test_charges_by_face_and_component_carry_the_letters_signs() -> None:
    magnets = mf.Magnets(pole_charge=(1, 2, 3, 4))
    scene = mf.Scene(sequence=("NS-N", "----", "SSNN"), magnets=magnets)
    np.testing.assert_array_equal(scene.charges, [[1, -2, 0, 4], [0, 0, 0, 0], [-1, -2, 3, 4]])
    rows = np.arange(1.0, 13.0).reshape(3, 4)
    each = scene.replace(magnets={"pole_charge": rows})
    np.testing.assert_array_equal(each.charges, rows * [[1, -1, 0, 1], [0] * 4, [-1, -1, 1, 1]])
    assert each.magnets is not None
    assert each.magnets.charge == 12.0
    np.testing.assert_array_equal(each.magnets.charges(3), rows)
    with pytest.raises(ValueError, match="n: 2 is not allowed; pole_charge has 3 rows"):
        each.magnets.charges(2)
    assert not scene.replace(magnets=None).charges.any()


def test_remanence_times_each_faces_area_gives_its_charge() -> None:
    magnets = mf.Magnets(
        remanence=(0.6, 1.2, 0.6, 0.6), width=(0.006, 0.006, 0.003, 0.006), height=0.006
    )
    unit = mf.Magnets().charge
    np.testing.assert_allclose(magnets.charges(2), [[unit, 2 * unit, unit / 2, unit]] * 2)
    assert magnets.charge == pytest.approx(2 * unit)


def test_even_magnets_may_differ_in_strength_only() -> None:
    assert mf.Magnets(width=(0.005,) * 4, remanence=(0.1, 0.2, 0.3, 0.4)).even
    for name in ("width", "height", "thickness", "inset"):
        lengths: dict[str, Any] = {name: (0.002, 0.001, 0.001, 0.001)}
        assert not mf.Magnets(**lengths).even
    insets = (0.001, 0.002, 0.003, 0.004)
    np.testing.assert_array_equal(mf.Magnets(inset=insets).by_face("inset"), insets)
    np.testing.assert_array_equal(mf.Magnets().by_face("width"), [0.006] * 4)


def test_a_wide_magnet_fits_beside_narrow_ones() -> None:
    changed = SCENE.replace(magnets={"width": (0.008, 0.004, 0.008, 0.004)})
    assert changed.magnets is not None
    assert not changed.magnets.even
    with pytest.raises(mf.SceneError, match="of back-left and back-right overlap"):
        SCENE.replace(magnets={"width": (0.008, 0.007, 0.008, 0.004)})


def test_naming_one_strength_drops_the_other() -> None:
    charged = SCENE.replace(magnets={"pole_charge": 2.0})
    assert charged.magnets == mf.Magnets(pole_charge=2.0)
    assert charged.replace(magnets={"remanence": 0.6}).magnets == mf.Magnets()
