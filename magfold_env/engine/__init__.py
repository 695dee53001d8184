"""Physics of one chain: compiled kernels on scalars, arrays and NamedTuples of arrays."""
