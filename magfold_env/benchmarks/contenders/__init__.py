"""What the benchmarks run against, beside the engine itself."""
