"""From a scene to a fold: arrays, sessions, batches, and what comes back."""
