"""An episode of `TubeFeed`, in which the minimiser's design is fed component by component."""

import gymnasium

import magfold_env  # noqa: F401  # registers the environments

env = gymnasium.make("MagFold/TubeFeed-v0", render_mode="rgb_array_list")
observation, info = env.reset(seed=0, options={"target": "LRLLL"})
design = env.unwrapped.baseline
ended = False
while not ended:
    faces = design.sequence[env.unwrapped.next_component]
    action = env.unwrapped.actions.encode(faces, design.speed)
    observation, reward, ended, _, info = env.step(action)
print(info["status"], info["score"])
env.unwrapped.to_html("tube_feed.html")
