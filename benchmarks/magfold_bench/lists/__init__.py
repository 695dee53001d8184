"""Makers of shipped lists: tasks, suites of targets, baselines."""
