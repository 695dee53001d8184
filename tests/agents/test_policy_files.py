"""Tests of policy files: reading restores the networks and never runs code."""

import base64
import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stable_baselines3
import torch
from safetensors.numpy import load, save

from agents.evaluation.policies import make_policy
from agents.training import policy_files
from agents.training.envs import make_training_envs
from agents.training.models import make_model
from magfold_env.envs.tube_feed import TubeFeedEnv
from tests.agents.training import LEARNERS, call, tiny
from tests.command_line import python
from tests.fuzz.readers import resigned

GOAL = "MagFold/TubeFeedGoal-v0"
CASES = [
    *[(algorithm, features, "MagFold/TubeFeed-v0") for algorithm in LEARNERS
      for features in ("chain", "mouth")],
    *[(algorithm, "symmetric", "MagFold/TubeFeed-v0") for algorithm in ("ppo", "maskable-ppo")],
    ("ppo", "symmetric", GOAL), ("sac", "mouth", GOAL), ("tqc", "chain", GOAL),
]  # fmt: skip


@pytest.fixture(scope="module")
def model() -> stable_baselines3.PPO:
    env = TubeFeedEnv(components=3, fidelity="quasistatic")
    options = {"net_arch": {"pi": [6, 5], "vf": [4]}, "activation_fn": torch.nn.ReLU}
    return stable_baselines3.PPO("MlpPolicy", env, policy_kwargs=options, device="cpu", seed=0)


@pytest.fixture
def file(model: stable_baselines3.PPO, tmp_path: Path) -> Path:
    policy_files.save(model, tmp_path / "policy.safetensors")
    return tmp_path / "policy.safetensors"


@pytest.mark.medium
@pytest.mark.parametrize(("algorithm", "features", "env_id"), CASES)
def test_every_algorithm_acts_as_before(algorithm, features, env_id, tmp_path):
    learner = {"algorithm": algorithm, "features": features, "hidden": [16], **LEARNERS[algorithm]}
    actions = {"actions": "box"} if algorithm in ("sac", "tqc") else {}
    env = {"id": env_id, "components": 3, "fidelity": "quasistatic", **actions}
    settings = tiny(learner=learner, env=env)
    envs = make_training_envs(settings, 0)
    policy: Any = make_model(settings.learner, envs, 0)
    policy_files.save(policy, tmp_path / "policy.safetensors")
    saved: Any = policy_files.load(tmp_path / "policy.safetensors")
    assert type(saved.policy) is type(policy.policy)
    own, others = policy.policy.state_dict(), saved.policy.state_dict()
    assert own.keys() == others.keys()
    assert all(torch.equal(own[name], others[name]) for name in own)
    observations: Any = envs.reset()
    for _ in range(20):
        torch.manual_seed(1)
        drawn, _ = policy.predict(observations)
        torch.manual_seed(1)
        assert np.array_equal(drawn, saved.policy.predict(observations)[0])
        best, _ = policy.predict(observations, deterministic=True)
        assert np.array_equal(best, saved.policy.predict(observations, deterministic=True)[0])
        observations, *_ = envs.step(drawn)
    envs.close()


@pytest.mark.parametrize("critic", ["own", "shared", "none"])
def test_every_memory_comes_back(critic: str, tmp_path: Path) -> None:
    lstm = {"hidden": 8, "layers": 2, "critic": critic}
    settings = tiny("recurrent-ppo", own={"lstm": lstm, "frames": 2})
    model = make_model(settings.learner, make_training_envs(settings, 0), 0)
    policy_files.save(model, tmp_path / "policy.safetensors", settings.learner)
    saved = policy_files.load(tmp_path / "policy.safetensors")
    own, others = model.policy.state_dict(), saved.policy.state_dict()
    assert own.keys() == others.keys()
    assert all(torch.equal(own[name], others[name]) for name in own)
    assert (saved.shown.frames, saved.shown.blind) == (2, False)


class Evil:
    """An object that writes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.path,)


@pytest.fixture
def evil(model: Any, tmp_path: Path) -> tuple[Path, Path]:
    """Return a model of Stable-Baselines3 that writes a file when it is read, and this file."""
    sound, path, written = (tmp_path / name for name in ("sound.zip", "evil.zip", "written"))
    model.save(sound)
    with zipfile.ZipFile(sound) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "data":
                data = json.loads(content)
                code = base64.b64encode(pickle.dumps(Evil(written))).decode()
                data["lr_schedule"] = {":type:": "<class 'function'>", ":serialized:": code}
                content = json.dumps(data).encode()
            target.writestr(name, content)
    return path, written


def test_what_is_not_trusted_runs_no_code(evil: tuple[Path, Path], tmp_path: Path) -> None:
    path, written = evil
    renamed = tmp_path / "evil.safetensors"
    renamed.write_bytes(path.read_bytes())
    for each in (path, renamed):
        with pytest.raises(ValueError, match=r"evil\..*: is a zip file.*policy_files\.save"):
            make_policy(str(each))
    refused = call("evaluate", path, "--output", tmp_path / "out", code=2)
    assert "policy_files.save" in refused.stderr
    assert not written.exists()
    stable_baselines3.PPO.load(path)
    assert written.exists()


def changed(file: Path, settings: dict[str, Any], **weights: Any) -> None:
    """Change settings or entries of weights in the header of a file; the checksum fits again."""
    content = file.read_bytes()
    start = 8 + int.from_bytes(content[:8], "little")
    header = json.loads(content[8:start])
    told = json.loads(header["__metadata__"]["policy"])
    told["settings"] = json.dumps(json.loads(told["settings"]) | settings)
    header["__metadata__"]["policy"] = json.dumps(told)
    head = json.dumps(header | weights).encode()
    file.write_bytes(resigned(len(head).to_bytes(8, "little") + head + content[start:]))


@pytest.mark.parametrize(("settings", "message"), [
    ({"algorithm": "os.system"}, "algorithm: 'os.system' is not allowed; must be 'ppo'"),
    ({"features": "os.path"}, "features: 'os.path' is not allowed; must be 'chain'"),
    ({"policy": "os.system"}, "policy: 'os.system' is not allowed; unknown key"),
    ({"actor": [10**9]}, "actor, critic: .* is not allowed; must be those of the weights"),
    ({"actor": [6]}, r"weights: mlp_extractor\.\S+: is not a weight of the networks"),
    ({"actor": [6, 6]}, r"weights: mlp_extractor\.\S+2\.weight: .* F32 numbers, \[6, 6"),
    ({"observations": {"low": [0]}}, "observations.high: None is not allowed; must be given"),
    ({"actions": {"boxes": {}}}, "actions: .* is not allowed; must be a box"),
    ({"actions": {"n": 10**8}}, "actor, critic: .* must be those of the weights"),
    ({"features": "symmetric", "actions": {"n": 3}}, "its networks cannot be made: action_sp"),
    ({"frames": 64}, "actor, critic: .* must be those of the weights"),
    ({"lstm": {"hidden": 8}}, "lstm: .* must not be given with ppo"),
    ({"algorithm": "recurrent-ppo"}, "lstm: None is not allowed; must be given with recurr"),
    ({"algorithm": "recurrent-ppo", "lstm": {"hidden": 10**9}},
     "actor, critic: .* must be those of the weights"),
])  # fmt: skip
def test_wrong_settings_name_file_and_key(file: Path, settings: Any, message: str) -> None:
    changed(file, settings)
    with pytest.raises(ValueError, match=rf"policy\.safetensors: {message}") as caught:
        policy_files.load(file)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "weight", [np.zeros(5, np.float32), np.zeros((1, 4), np.float32), np.zeros(4), None]
)
def test_weights_of_another_kind_are_named(file: Path, weight: Any) -> None:
    name, content = "mlp_extractor.value_net.0.bias", file.read_bytes()
    start = 8 + int.from_bytes(content[:8], "little")
    weights = {key: each for key, each in load(content).items() if key != name}
    weights |= {} if weight is None else {name: weight}
    file.write_bytes(resigned(save(weights, json.loads(content[8:start])["__metadata__"])))
    with pytest.raises(ValueError, match=rf"policy\.safetensors: weights: {name}: .* F32 numbers"):
        policy_files.load(file)


def test_what_is_written_is_always_alike(model: Any, file: Path, tmp_path: Path) -> None:
    code = (
        "import sys; from magfold_env.scoring.policy_file import read, write; file = "
        "read(sys.argv[1]); shapes = {name: each['shape'] for name, each in file.tensors.items()};"
        "write(sys.argv[2], file.settings, file.weights(shapes))"
    )
    again = tmp_path / "again.safetensors"
    python("-c", code, file, again)
    assert again.read_bytes() == file.read_bytes()


def test_an_older_file_is_read(file: Path) -> None:
    content = file.read_bytes()
    start = 8 + int.from_bytes(content[:8], "little")
    metadata = json.loads(json.loads(content[8:start])["__metadata__"]["policy"])
    own = policy_files.load(file).policy.state_dict()
    file.write_bytes(save(load(content), metadata))
    others = policy_files.load(file).policy.state_dict()
    assert all(torch.equal(own[name], others[name]) for name in own)


def test_damage_is_told(file: Path) -> None:
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(ValueError, match=r"policy\.safetensors: is not a policy.*: sha256: the we"):
        policy_files.load(file)
    file.write_bytes(resigned(whole[:-4] + np.float32(np.nan).tobytes()))
    with pytest.raises(ValueError, match=r"weights: \S+: has numbers that are not finite"):
        policy_files.load(file)


def test_a_policy_that_would_not_come_back_is_not_written(tmp_path: Path) -> None:
    env = TubeFeedEnv(components=3, fidelity="quasistatic", actions="box")
    model = stable_baselines3.PPO("MlpPolicy", env, use_sde=True, device="cpu")
    with pytest.raises(ValueError, match=r"policy: ActorCriticPolicy .* cannot be written"):
        policy_files.save(model, tmp_path / "policy.safetensors")
    assert not list(tmp_path.iterdir())
