"""Training runs: learners, environments, stored files and resumption."""
