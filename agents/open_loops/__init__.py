"""Open loops, which are chosen before an episode of a track begins, and their search."""
