"""Machines followed along a parameter: regimes, Poincaré points, exponents, two motions."""
