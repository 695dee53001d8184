"""Reference mechanics and checks of runs, for tests, stress campaigns and benchmarks."""
