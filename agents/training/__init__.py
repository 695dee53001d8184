"""Training runs: their learners, environments, stored files and resumption."""
