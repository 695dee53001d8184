"""Training runs: learners, environments, what is kept on the way and taken up again."""
