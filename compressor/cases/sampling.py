"""Sampling designs: points in the unit cube, for keys that are sampled together."""

import warnings

KINDS = ("random", "lhs", "sobol")


def design(kind: str, count: int, keys: int, seed: int) -> list[list[float]]:
    """`count` points of `keys` coordinates in [0, 1); the same seed gives the same points.

    `random` is uniform, `lhs` a Latin hypercube, `sobol` Sobol's sequence, scrambled, whose balance
    is best where `count` is a power of two.
    """
    import numpy as np

    generator = np.random.default_rng(seed)
    if kind == "random":
        return generator.random((count, keys)).tolist()
    from scipy.stats import qmc  # takes half a second

    sampler = {"lhs": qmc.LatinHypercube, "sobol": qmc.Sobol}[kind](keys, seed=generator)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="The balance properties of Sobol")
        return sampler.random(count).tolist()
