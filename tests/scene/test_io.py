"""Tests of scene files, and of the shipped scenes."""

import time
from pathlib import Path

import pytest

import magfold_env as mf
from magfold_env.scene.io import parse_yaml

PAPER = {
    1: "NSNN NSSN SNSS NNNN SSNN SNSN",
    2: "SSSS NNSS NNNN SSSS NNNS SSSN",
    3: "SNNS NNSN SSSN NNNS SSSS NNSN",
}


def _write(folder: Path, text: str) -> Path:
    path = folder / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_shipped_scene_loads() -> None:
    names = mf.scene_names()
    assert {"pendulum-3", "tube-feed"} <= set(names)
    assert all(mf.load_scene(name).n >= 3 for name in names)


@pytest.mark.parametrize("number", PAPER)
def test_paper_scenes(number: int) -> None:
    built = mf.load_scene(f"paper/sequence-{number}")
    literal = mf.load_scene(f"paper/sequence-{number}-literal")
    assert built.sequence == literal.sequence == tuple(PAPER[number].split())
    assert built.mount == "free"
    assert built.magnets == mf.Magnets(model="strips", remanence=0.6)
    assert built.solver == mf.Solver()
    assert literal.mount == "pinned"
    assert literal.magnets == mf.Magnets(model="points", nodes=3, pole_charge=8.5946)
    assert literal.solver.method == "paper"
    assert built.friction == literal.friction == 0.35
    strong = mf.load_scene(f"paper/sequence-{number}-strong")
    assert strong == built.replace(magnets={"remanence": 1.2}, friction=0.1)


def test_paths_are_read_as_text_and_as_paths(tmp_path: Path) -> None:
    path = _write(tmp_path, "sequence: [NSNS]\nsolver: {tolerance: 1e-4}\n")
    assert mf.load_scene(path) == mf.load_scene(str(path))
    assert mf.load_scene(path).solver.tolerance == 1e-4  # YAML 1.1 takes this for a string


@pytest.mark.parametrize("name", ["paper/sequnce-3", "Paper/Sequence-3"])
def test_a_similar_name_is_told(name: str) -> None:
    with pytest.raises(mf.SceneError, match=r"; did you mean paper/sequence-3\?$"):
        mf.load_scene(name)
    with pytest.raises(mf.SceneError, match=r"no such scene; `magfold scenes` lists them$"):
        mf.load_scene("x")


@pytest.mark.parametrize("kind", [str, Path])
def test_a_missing_file_is_named(tmp_path: Path, kind: type) -> None:
    with pytest.raises(mf.SceneError, match=r"nowhere\.yaml: no such file"):
        mf.load_scene(kind(tmp_path / "nowhere.yaml"))


@pytest.mark.parametrize(("text", "message"), [
    ("sequence: [NSNS]\ncasing: {mass: -1}\n", r"casing\.mass: -1 is not allowed; must be gr"),
    ("sequence: [NSNS]\nfriction: .nan\n", r"friction: nan is not allowed; must be a finite"),
    ("sequence: [NSNS]\nfrictoin: 0.3\n", r"frictoin: 0\.3 is not allowed; unknown key"),
    ("sequence: [NSNS\nfriction: 0.3\n", r"line 2, column \d+: "),
    ("sequence: [NSNS]\nsequence: [SSSS]\n", r"line 2, column 1: the key 'sequence' is given"),
    ("sequence: [NSNS]\ncasing: {1: 2}\n", r"line 2, column 10: the key 1 is not text"),
    ("sequence: [NSNS]\n? {a: b}\n: 1\n", r"line 2, column 3: the key {.a.: .b.} is not text"),
    ("sequence: !!python/object:os.system {}\n", r"line 1, column 11: could not determine a"),
    ("sequence: &a [NSNS]\nstart_angles: *a\n", r"line 2, column 15: the alias \*a is not al"),
    ("sequence: [NSNS]\nfriction: 1:30\n", r"friction: '1:30' is not allowed; must be a number$"),
    ("sequence: [NSNS]\nfriction: 0x1\n", r"friction: '0x1' is not allowed; must be a number$"),
    ("- NSNS\n", r"\['NSNS'\] is not a scene; must be a mapping"),
    ("", r"None is not a scene; must be a mapping"),
])  # fmt: skip
def test_a_wrong_file_is_named_with_the_place(tmp_path: Path, text: str, message: str) -> None:
    path = _write(tmp_path, text)
    with pytest.raises(mf.SceneError, match=message) as caught:
        mf.load_scene(path)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())


@pytest.mark.parametrize(
    ("text", "number"),
    [("010", 10), ("1e-3", 1e-3), (".5", 0.5), ("5.", 5.0), ("-12.5E+1", -125.0), ("1_000", 1000)],
)
def test_numbers_are_decimal(text: str, number: float) -> None:
    assert parse_yaml(text) == number


@pytest.mark.parametrize(
    "text",
    [
        "sequence: [NSNS]\nfriction: " + "1:" * 100_000 + "1",
        "sequence: [NSNS]\n? " + "k" * 10_000 + "\n: 1",
        "sequence: [NSNS]\nfriction: *" + "a" * 10_000,
        "[" + "NSNS, " * 1_000 + "]",
        "? [" + "NSNS, " * 1_000 + "]\n: 1",
    ],
)
def test_long_values_are_not_quoted_in_full(text: str, tmp_path: Path) -> None:
    begun = time.perf_counter()
    with pytest.raises(mf.SceneError) as caught:
        mf.load_scene(_write(tmp_path, text))
    assert len(str(caught.value)) < 1_000
    assert time.perf_counter() - begun < 5.0


def test_saving_leaves_no_temporary_file_and_needs_the_folder(tmp_path: Path) -> None:
    scene = mf.load_scene("tube-feed")
    mf.save_scene(scene, tmp_path / "scene.yaml")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.yaml"]
    with pytest.raises(FileNotFoundError, match="does not exist"):
        mf.save_scene(scene, tmp_path / "nowhere" / "scene.yaml")
