"""Scenes and strategies that tests of energies share."""

from hypothesis import strategies as st

from magfold_env.scene import Magnets, Scene

MODELS = {
    "points": Magnets(model="points", pole_charge=8.5946),
    "points-5": Magnets(model="points", nodes=5),
    "strips": Magnets(nodes=4),
    "flat": Magnets(nodes=3, height=0.001, width=0.004, thickness=0.001, inset=0.001),
}

# Equal sizes, unequal strengths: not their own mirror image.
STRENGTHS = {
    "points by face": Magnets(model="points", pole_charge=(8.6, 4.0, 12.0, 6.0)),
    "strips by face": Magnets(nodes=4, remanence=(1.2, 0.6, 0.5, 0.9)),
}

faces = st.text("NS-", min_size=4, max_size=4)


def sequences(shortest: int, longest: int) -> st.SearchStrategy[tuple[str, ...]]:
    """Draw sequences of `shortest` to `longest` components."""
    return st.lists(faces, min_size=shortest, max_size=longest).map(tuple)


def scene_of(sequence: tuple[str, ...], model: str) -> Scene:
    """Return a scene with a fixed quadrature, which the reference can repeat."""
    return Scene(sequence=sequence, magnets=(MODELS | STRENGTHS)[model])
