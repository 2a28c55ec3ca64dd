"""Numerical stability at the extremes: scenes drawn at random, each run and judged."""
