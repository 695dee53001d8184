"""Tests that batched draws equal the results of `Scene.draw` and `pack` for each chain."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.chains.dynamic import REFERENCE_SPEED, DynamicChains
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session

EVERY = {
    "friction": 0.2, "friction_decades": 0.5, "mass": 0.3, "remanence": 0.1, "feed_speed": 0.1,
    "feed_jitter": 0.05, "magnet": 0.1, "obstacle_width": 0.2, "obstacle_offset": 0.003,
    "tilt": 5.0,
}  # fmt: skip
WALLS = mf.chamber((0.02, -0.03), (0.1, 0.06), opening=0.05)
CASES: dict[str, dict[str, Any]] = {
    "nothing": {"spreads": {}, "start_angles": (0.0, 0.01, 0.0, -0.02, 0.0)},
    "angles": {"spreads": {}},
    "every": {"spreads": EVERY},
    "every-backward": {"spreads": EVERY, "feed": {"direction": "backward"}},
    "floor": {"spreads": EVERY, "friction": (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)},
    "inertia": {"spreads": EVERY, "casing": {"inertia": 1e-7, "mass": (1e-3,) * 6}},
    "faces": {
        "spreads": {"magnet": 0.1},
        "magnets": {"remanence": (1.2, 0.6, 0.6, 1.1), "width": (0.004, 0.006, 0.006, 0.005)},
    },
    "charges": {"spreads": {"remanence": 0.3}, "magnets": {"pole_charge": 2.0}},
    "built": {"spreads": EVERY, "feed": {"loading": "preloaded"}},
    "walls": {"spreads": EVERY, "obstacles": WALLS},
    "walls alone": {"spreads": {"obstacle_offset": 0.002}, "obstacles": WALLS},
    "tilt alone": {"spreads": {"tilt": 5.0}},
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_draws_are_those_of_the_scene(case: dict[str, Any]) -> None:
    drawn = DynamicChains([mf.load_scene("tube-feed").replace(**case)], 3)
    (template,) = drawn.templates
    rngs, others = ([np.random.default_rng(seed) for seed in range(3)] for _ in range(2))
    for rows in (np.array([0, 1, 2]), np.array([2, 0])):
        drawn.begin(rows, rngs)
        for row in rows.tolist():
            scene: Any = template.draw(others[row])
            assert drawn.drawn(row) == scene
            model, chains = pack(scene), drawn.engine
            np.testing.assert_array_equal(chains.mass[row], model.bodies.mass)
            np.testing.assert_array_equal(chains.inertia[row], model.bodies.inertia)
            np.testing.assert_array_equal(chains.friction_limit[row], model.friction_limit)
            np.testing.assert_array_equal(chains.obstacles[row], model.obstacles)
            assert [each[row] for each in chains.gravity] == [model.gravity_x, model.gravity_y]
            assert chains.typical_rate[row] == model.typical_rate
            assert chains.fastest_rate[row] == model.fastest_rate
            np.testing.assert_array_equal(drawn.strengths[row], scene.magnets.charges(6))
            np.testing.assert_array_equal(drawn.factors[row], scene.speeds / REFERENCE_SPEED)
            state = Session(scene)._state
            np.testing.assert_array_equal(chains.q[row], state.q)
            np.testing.assert_array_equal(chains.clocks[row], state.clock)
            assert rngs[row].bit_generator.state == others[row].bit_generator.state


def test_what_chains_share_is_what_packing_a_drawn_scene_gives() -> None:
    """Only arrays and numbers that are separate for each chain depend on the draws."""
    drawn = DynamicChains([mf.load_scene("tube-feed").replace(spreads=EVERY, obstacles=WALLS)], 1)
    (template,), (model,) = drawn.templates, drawn.engine.models
    other = pack(template.draw(np.random.default_rng(5)))
    own = {"bodies", "charge", "friction_limit", "obstacles", "typical_rate", "fastest_rate"}
    own |= {"gravity_x", "gravity_y"}
    for name in set(model._fields) - own:
        np.testing.assert_equal(getattr(model, name), getattr(other, name), err_msg=name)
    for name in ("reach", "length"):
        np.testing.assert_array_equal(getattr(model.bodies, name), getattr(other.bodies, name))
