"""Programs that make the shipped lists: tasks, suites of targets and baselines."""
