"""How kernels are compiled and cached, and all code that uses numba's internals."""
