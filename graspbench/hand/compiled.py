"""How this package's numerical kernels are compiled.

Both kinds go without checks for division by zero (the kernels guard their divisions). What only other
kernels call, ``inner``, has no entry from Python: that halves the compilation time.
"""

from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy")
inner = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
