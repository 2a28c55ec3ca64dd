"""The mechanics: numbers in, numbers out; only numpy and the one door to numba."""
