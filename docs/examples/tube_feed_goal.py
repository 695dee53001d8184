"""An episode of `TubeFeedGoal` with random actions, and its reward for the word that it reached."""

import gymnasium

import magfold_env  # noqa: F401  # registers the environments

env = gymnasium.make("MagFold/TubeFeedGoal-v0", render_mode="rgb_array_list")
observation, info = env.reset(seed=0)
env.action_space.seed(0)
ended = False
while not ended:
    observation, reward, ended, _, info = env.step(env.action_space.sample())
achieved = observation["achieved_goal"]
print("wanted", info["target"], reward, "; achieved", info["word"])
print(env.unwrapped.compute_reward(achieved, achieved, info))  # if that had been the goal
env.unwrapped.to_html("tube_feed_goal.html")
