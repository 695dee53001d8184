"""Measurements of laws of mechanics, for tests, stress campaigns and benchmarks."""
