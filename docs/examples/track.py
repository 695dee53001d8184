"""An episode of a track, played by a shipped policy."""

import gymnasium

from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player

TRACK = "lumen"

policy = Actor.read(f"configs/policies/ppo-{TRACK}-0.safetensors")
env_id = f"MagFold/{TRACK.title().replace('-', '')}-v0"
# Policies of feed tracks need discrete actions; the policy of `Anchor` needs the default ones.
options = {} if TRACK == "anchor" else {"actions": "discrete"}
env = gymnasium.make(env_id, render_mode="rgb_array_list", **options)
player = Player(policy, policy.settings, env.unwrapped)
observation, info = env.reset(seed=2)
ended = False
while not ended:
    (action,) = player.act(observation[None])
    observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
env.unwrapped.to_html(f"{TRACK}.html")
