"""An episode of `Anchor`, played by a shipped policy: it tests its fold before it leaves it."""

import gymnasium

from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player

env = gymnasium.make("MagFold/Anchor-v0", render_mode="rgb_array_list")
policy = Actor.read("configs/policies/ppo-anchor-0.safetensors")
player = Player(policy, policy.settings, env.unwrapped)
observation, info = env.reset(seed=2)
ended = False
while not ended:
    (action,) = player.act(observation[None])
    observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
env.unwrapped.to_html("anchor_track.html")
