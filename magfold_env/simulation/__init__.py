"""From a scene to a fold: arrays, sessions, batches and results."""
