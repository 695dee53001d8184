"""Time stepping: steps and their stages, step lengths, whole runs."""
