"""One machine followed along a parameter: its regimes, Poincaré points, second attractors."""
