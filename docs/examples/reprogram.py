"""An episode of `Reprogram`, played by a shipped policy: one word, in again, another."""

import gymnasium

from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player

env = gymnasium.make("MagFold/Reprogram-v0", render_mode="rgb_array_list", actions="discrete")
policy = Actor.read("configs/policies/ppo-reprogram-0.safetensors")
player = Player(policy, policy.settings, env.unwrapped)
observation, info = env.reset(seed=2)
ended = False
while not ended:
    (action,) = player.act(observation[None])
    observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
env.unwrapped.to_html("reprogram.html")
