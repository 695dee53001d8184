"""Physics of one chain: compiled kernels that see scalars, arrays and NamedTuples of arrays."""
