"""Programs that generate the lists shipped with the package: tasks, suites and baselines."""
