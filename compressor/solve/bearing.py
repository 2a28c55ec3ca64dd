"""Reynolds' equation of a journal bearing of finite length, and the film's numbers from it.

    d/dtheta (h^3 dp/dtheta) + (D / B)^2 d/dz (h^3 dp/dz) = 6 w dh/dtheta + 12 eps' cos(theta)

on theta around the bearing from the widest gap, h = 1 + eps cos(theta), and z from -1 to 1, with
pressures that never pull (Reynolds' condition: p and its slope end together). A film that turns
begins at its widest gap, as in Butenschoen's tables (1976; DIN 31652). Finite volumes, even in
Sommerfeld's angle, 1 + eps cos(theta) = (1 - eps^2) / (1 - eps cos(xi)), fine where the film is
thin; which cells bear is found by their pressures and flows, and two grids give a third
(Richardson).
"""

from functools import lru_cache

import numpy as np

from compressor.physics import FILM_TERMS, short_film

GRID = (96, 12)  # cells around and along half the bearing
MAX_LOOKS = 200  # in which the cells that bear are found


Bearing = dict[tuple[float, tuple[int, int]], np.ndarray]  # by squeeze and grid: cells that bear


def reynolds(
    eps: float, ratio: float, turning: float = 1.0, squeeze: float = 0.0,
    grid: tuple[int, int] = GRID, near: Bearing | None = None,
) -> np.ndarray:  # fmt: skip
    """Return the Sommerfeld numbers of a film at an eccentricity, for B / D = ratio, (2,).

    Force over B D eta times a speed over psi^2: along the line of centres, away from the wall, and
    along the rotation. turning: w eps, squeeze: eps', both over that speed; where it turns alone
    the numbers are over eps. near: cells that bore at an eccentricity nearby; it is written.
    """
    near = {} if near is None else near
    coarse = _reynolds(eps, ratio, turning, squeeze, (grid[0] // 2, grid[1] // 2), near)
    return (4.0 * _reynolds(eps, ratio, turning, squeeze, grid, near) - coarse) / 3.0


def _reynolds(
    eps: float, ratio: float, turning: float, squeeze: float, grid: tuple[int, int], near: Bearing
) -> np.ndarray:
    """Return both numbers on one grid, (2,)."""
    from scipy.linalg import solveh_banded

    around, along = grid
    finer = eps if squeeze >= 0 else 0.0  # a film that is pulled apart bears where it is wide
    step, root = 2.0 * np.pi / around, np.sqrt(1.0 - finer * finer)
    xi = step * np.arange(around)
    wall = xi + 0.5 * step  # between a cell and the next
    cosine, at_wall = ((np.cos(a) - finer) / (1.0 - finer * np.cos(a)) for a in (xi, wall))
    width = root / (1.0 - finer * np.cos(xi)) * step  # of a cell in theta
    sine = np.sin(xi) * width / step
    ahead = (1.0 + eps * at_wall) ** 3 * (1.0 - finer * np.cos(wall)) / root / step
    side = (1.0 + eps * cosine) ** 3 * width * (along / ratio) ** 2
    # of the wedge over eps, which stays finite
    source = 12.0 * squeeze * cosine * width + 6.0 * turning * (at_wall - np.roll(at_wall, 1))
    # the first row bears nothing: there a film that turns begins, and where the gap widens fastest
    # none bears
    first = int(source.argmax()) if squeeze else 0
    cosine, width, sine, ahead, side, source = (
        np.roll(one, -first) for one in (cosine, width, sine, ahead, side, source)
    )
    across = np.repeat(side[:, None], along, axis=1)  # to the next cell along the bearing
    own = (ahead + np.roll(ahead, 1))[:, None] + across
    own[:, 1:] += across[:, 1:]
    own[:, -1] += side  # whose end is half a cell away
    across[:, -1] = 0.0
    allowed = np.ones(grid, bool)
    allowed[0] = False
    bears, pressure = near.get((squeeze, grid), allowed), np.zeros(grid)
    band = np.zeros((along + 1, own.size))
    for _ in range(MAX_LOOKS):
        flat = bears.ravel()
        band[0] = np.where(bears, own, 1.0).ravel()
        band[1, :-1] = -across.ravel()[:-1] * (flat[:-1] & flat[1:])
        band[along, :-along] = -np.repeat(ahead[:-1], along) * (flat[:-along] & flat[along:])
        pressure = solveh_banded(
            band, np.where(bears, -source[:, None], 0.0).ravel(), lower=True
        ).reshape(grid)
        flow = -own * pressure - source[:, None]
        flow[:-1] += ahead[:-1, None] * pressure[1:]
        flow[1:] += ahead[:-1, None] * pressure[:-1]
        flow[:, :-1] += across[:, :-1] * pressure[:, 1:]
        flow[:, 1:] += across[:, :-1] * pressure[:, :-1]
        now = np.where(bears, pressure > 0.0, flow > 1e-12 * np.abs(source).max()) & allowed
        if (now == bears).all():
            break
        bears = now
    near[squeeze, grid] = bears
    summed = pressure.sum(axis=1) * width * 2.0 / along
    return np.array([-(summed @ cosine), summed @ sine]) / 4.0


@lru_cache(maxsize=64)
def film_constants(ratio: float, share: float) -> tuple[np.ndarray, float]:
    """Return what a film's numbers are made of, and the squeeze's number at the wall.

    Polynomials through Reynolds' numbers at Chebyshev's points of sqrt(1 - eps). ratio: B / D;
    share: the film's last one, of the clearance.
    """
    thinnest = 0.5 * share
    least = np.sqrt(thinnest)
    nodes = np.cos(np.pi * (np.arange(FILM_TERMS) + 0.5) / FILM_TERMS)
    u = least + 0.5 * (1.0 - least) * (nodes + 1.0)
    near: Bearing = {}
    values = np.array([_over_short(1.0 - one * one, ratio, near) for one in u])
    fits = [np.polynomial.Chebyshev.fit(u, column, FILM_TERMS - 1) for column in values.T]
    constants = np.array([fit.convert(kind=np.polynomial.Polynomial).coef for fit in fits]).T
    short = short_film(1.0 - thinnest, 0.0, 1.0)[0]
    return constants, float(short * thinnest / fits[0](least))


def _over_short(eps: float, ratio: float, near: Bearing) -> tuple[float, ...]:
    """Return short numbers over Reynolds' of a film pressed, pulled apart, turned; the attitude."""
    turned, ocvirk = reynolds(eps, ratio, near=near), short_film(eps, 1.0, 0.0)
    pressed, pulled = (abs(reynolds(eps, ratio, 0.0, way, near=near)[0]) for way in (1, -1))
    return (
        (1.0 - eps) * short_film(eps, 0.0, 1.0)[0] / pressed,
        (1.0 + eps) * -short_film(eps, 0.0, -1.0)[0] / pulled,
        (1.0 - eps) * np.hypot(*ocvirk) / np.hypot(*turned),
        np.tan(0.5 * np.arctan2(turned[1], turned[0]))
        / np.tan(0.5 * np.arctan2(ocvirk[1], ocvirk[0])),
    )
