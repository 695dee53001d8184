"""Physics of one chain: compiled kernels that see only scalars, arrays and NamedTuples of arrays."""
