"""Tests of magnets, fixed magnets and fields of a scene."""

import math
from typing import Any

import numpy as np
import pytest

import magfold_env as mf


def test_charges_by_face_and_component_carry_the_letters_signs() -> None:
    magnets = mf.Magnets(pole_charge=(1, 2, 3, 4))
    scene = mf.Scene(sequence=("NS-N", "----", "SSNN"), magnets=magnets)
    np.testing.assert_array_equal(scene.charges, [[1, -2, 0, 4], [0, 0, 0, 0], [-1, -2, 3, 4]])
    rows = np.arange(1.0, 13.0).reshape(3, 4)
    each: Any = scene.replace(magnets={"pole_charge": rows})
    np.testing.assert_array_equal(each.charges, rows * [[1, -1, 0, 1], [0] * 4, [-1, -1, 1, 1]])
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


SCENE = mf.Scene(sequence=("NSNN", "NSSN", "SNSS"))
FIXED: dict[str, Any] = {"position": (0.05, 0.05), "width": 0.02, "height": 0.02, "thickness": 0.01}


def test_fields_are_merged_replaced_and_dropped() -> None:
    given = SCENE.replace(field={"magnet": FIXED})
    assert given.field == mf.Field(magnet=mf.FixedMagnet(**FIXED))
    both: Any = given.replace(field={"uniform": (0.0, 1e-3)})
    assert both.field.magnet == mf.FixedMagnet(**FIXED)
    turned = both.replace(field={"magnet": {"heading": 0.5}})
    assert turned.field == mf.Field(
        uniform=(0.0, 1e-3), magnet=mf.FixedMagnet(**{**FIXED, "heading": 0.5})
    )
    alone = turned.replace(field={"magnet": None})
    assert alone.field == mf.Field(uniform=(0.0, 1e-3))
    assert mf.Field(uniform=(0.0, 1e-3)).any
    assert not mf.Field().any
    assert turned.replace(field=None).field is None
    assert SCENE.replace(field=mf.Field()).field == mf.Field()


def test_the_geometry_of_a_fixed_magnet() -> None:
    magnet = mf.FixedMagnet(
        position=(1.0, 2.0), heading=math.pi / 2, width=0.4, height=0.1, thickness=0.2
    )
    np.testing.assert_allclose(magnet.poles, [[1.0, 2.1], [1.0, 1.9]])
    expected = [[1.2, 2.1], [0.8, 2.1], [0.8, 1.9], [1.2, 1.9]]
    np.testing.assert_allclose(magnet.outline.corners, expected)
    # 1.2 T over 400 cm².
    assert magnet.charge == pytest.approx(1.2 * 0.04 / (4e-7 * math.pi))


def test_a_fixed_magnet_may_stand_before_or_beside_the_bore() -> None:
    tube = SCENE.replace(mount="tube")
    beside, before = 0.005 + tube.bore / 2 + 1e-9, 0.010 + tube.casing.diagonal + 1e-9
    for position in ((before, 0.0), (-0.05, beside), (-0.05, -beside), (0.0, 0.05)):
        size = {"width": 0.01, "height": 0.01, "thickness": 0.02}
        tube.replace(field={"magnet": {"position": position, **size}})
    # Without a tube there is none to keep clear of, but the chain itself.
    inside = {"magnet": {**FIXED, "position": (-0.05, 0.0)}}
    assert SCENE.replace(mount="pinned", field=inside).field is not None
    with pytest.raises(mf.SceneError, match=r"field.magnet.position.*component 3 begins there"):
        SCENE.replace(field={"magnet": {**FIXED, "position": (0.05, 0.0)}})
