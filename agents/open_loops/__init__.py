"""Open loops, which are chosen before an episode of a track begins, and the search for them."""
