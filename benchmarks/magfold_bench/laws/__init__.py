"""Laws of mechanics as measurements, for tests, stress campaigns and benchmarks."""
