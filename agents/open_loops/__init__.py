"""What can be chosen before an episode of a track begins, and the search for the best of it."""
