"""How kernels are compiled and cached, and all that touches numba's insides."""
