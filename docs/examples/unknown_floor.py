"""An episode of `UnknownFloor`, played by a shipped policy."""

import gymnasium

from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player

env = gymnasium.make("MagFold/UnknownFloor-v0", render_mode="rgb_array_list", actions="discrete")
policy = Actor.read("configs/policies/ppo-unknown-floor-0.safetensors")
player = Player(policy, policy.settings, env.unwrapped)
observation, info = env.reset(seed=2)
ended = False
while not ended:
    (action,) = player.act(observation[None])
    observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
env.unwrapped.to_html("unknown_floor.html")
