"""Time stepping: the step and its stages, limits, whole runs."""
