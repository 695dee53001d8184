"""Physics of one chain, in compiled kernels that take numbers, arrays and NamedTuples of arrays."""
