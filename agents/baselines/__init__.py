"""Baselines that decide before the chain folds: one sequence and its speeds for each target.

`searches` lists them; ``python -m agents.baselines SEARCH`` lets one search with a stated budget of
physics calls and writes what it chose, which `agents.evaluate` then scores on fresh draws.
"""
