"""The exact gap design against brute force over all sequences and words."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.designer import GapDesign, gap_designs
from magfold_env.minimiser import minimise
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words, mirror
from tests.minimiser import reference
from tests.minimiser.scenes import MODELS, STRENGTHS, scene_of


def scene_for(n: int, model: str) -> Scene:
    return scene_of(("NNNN",) * n, model)


def brute_force(n: int, model: str) -> dict[str, tuple[float, tuple[str, ...]]]:
    """Return the largest gap and the first sequence that has it for every word."""
    words = reference.words(n)
    form = reference.forms(words, 0.0125, (MODELS | STRENGTHS)[model])
    numbers = np.arange(16**n)
    bits = (numbers[:, None] >> np.arange(4 * n - 1, -1, -1)) & 1
    sign = 1.0 - 2.0 * bits
    energies = np.stack([np.einsum("qa,ab,qb->q", sign, j, sign, optimize=True) for j in form])
    lowest = np.sort(energies, axis=0)[:2]
    found: dict[str, tuple[float, tuple[str, ...]]] = {}
    for word, energy in zip(words, energies, strict=True):
        gap = np.where(energy == lowest[0], lowest[1], lowest[0]) - energy
        first = int(np.argmax(gap >= gap.max() * (1 - 1e-9)))
        letters = "".join("NS"[bit] for bit in bits[first])
        found[word] = gap.max(), tuple(letters[k : k + 4] for k in range(0, 4 * n, 4))
    return found


@pytest.mark.parametrize(
    ("n", "model"),
    [(n, model) for model in ("points", "strips") for n in (2, 3, 4)]
    + [(n, model) for model in STRENGTHS for n in (2, 3)],
)
def test_the_design_is_the_best_of_all_sequences(n: int, model: str) -> None:
    scene = scene_for(n, model)
    expected = brute_force(n, model)
    designs = gap_designs(scene, expected)
    assert list(designs) == list(expected)
    for target, (gap, sequence) in expected.items():
        design = designs[target]
        if gap <= 1e-12:
            assert design is None
            continue
        assert design is not None
        assert design.gap == pytest.approx(gap, rel=1e-9)
        assert design.sequence == sequence


@pytest.fixture(scope="module")
def designs() -> dict[str, GapDesign | None]:
    return gap_designs(mf.load_scene("paper/sequence-1"), folded_words(6))


@pytest.mark.medium
def test_the_designs_of_the_26_words_are_ground_states(
    designs: dict[str, GapDesign | None],
) -> None:
    scene = mf.load_scene("paper/sequence-1")
    assert len(designs) == 26
    for target, design in designs.items():
        assert design is not None
        best, second = minimise(scene.replace(sequence=design.sequence), top=2).states
        assert best.word == target
        assert best.stable
        assert best.energy == pytest.approx(design.energy)
        assert second.word == design.competitor
        assert second.energy - best.energy == pytest.approx(design.gap)


@pytest.mark.medium
@pytest.mark.laws
def test_mirrored_targets_have_mirrored_designs(designs: dict[str, GapDesign | None]) -> None:
    for target, design in designs.items():
        image = designs[mirror(target)]
        assert design is not None
        assert image is not None
        assert image.gap == pytest.approx(design.gap, rel=1e-9)


@pytest.mark.medium
def test_no_random_sequence_beats_the_design(designs: dict[str, GapDesign | None]) -> None:
    rng = np.random.default_rng(5)
    scene = mf.load_scene("paper/sequence-1")
    for _ in range(50):
        sequence = tuple("".join(rng.choice(["N", "S"], 4)) for _ in range(6))
        best, second = minimise(scene.replace(sequence=sequence), top=2).states
        design = designs.get(best.word)
        if design is not None:
            assert second.energy - best.energy <= design.gap * (1 + 1e-9)


def test_a_target_that_never_is_the_ground_state_has_no_design() -> None:
    never = gap_designs(scene_for(3, "strips").replace(magnets=None), ["LL", "SS"])
    assert never == {"LL": None, "SS": None}


def test_components_of_unequal_strength_have_their_own_designs() -> None:
    rows = 0.6 * np.array([[1, 1, 1, 1], [2, 1, 1, 2], [1, 3, 1, 1]])
    scene = Scene(sequence=("NNNN",) * 3).replace(magnets={"nodes": 4, "remanence": rows})
    for target, design in gap_designs(scene, folded_words(3)).items():
        assert design is not None
        best, second = minimise(scene.replace(sequence=design.sequence), top=2).states
        assert best.word == target
        assert second.energy - best.energy == pytest.approx(design.gap)
        for row in range(3):
            for face in range(4):
                # No single flip makes it better.
                word = [list(faces) for faces in design.sequence]
                word[row][face] = "S" if word[row][face] == "N" else "N"
                other = scene.replace(sequence=["".join(faces) for faces in word])
                first, next_one = minimise(other, top=2).states
                if first.word == target:
                    assert next_one.energy - first.energy <= design.gap * (1 + 1e-9)


def test_a_field_is_refused() -> None:
    scene = scene_for(3, "points").replace(field={"uniform": (1e-3, 0.0)})
    with pytest.raises(ValueError, match=r"^field: .* is not allowed; energy minimisation does"):
        gap_designs(scene, ["LR"])


def test_progress_runs_from_above_0_to_1() -> None:
    seen: list[float] = []
    gap_designs(scene_for(3, "points"), ["LR"], seen.append)
    assert seen == sorted(seen)
    assert 0 < seen[0] < seen[-1] == 1.0


@pytest.mark.parametrize(
    ("n", "target", "message"),
    [
        (7, "LRLLLR", r"7 component\(s\) are not allowed; the exhaustive gap search takes 2 to 6"),
        (1, "", "sequence: 1 component"),
        (6, "LRL", "word: 'LRL' is not allowed; must have 5 letters"),
        (6, "LRXLL", "word: 'LRXLL' is not allowed"),
        (6, "LLLLL", "targets: 'LLLLL' is not allowed; its components overlap"),
    ],
)
def test_wrong_arguments_are_named(n: int, target: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gap_designs(scene_for(n, "points"), [target])
