"""Where a joint is expected to lose contact, from the forces of the machine with ideal joints.

Earles and Wu (1973 and later) expect it where the joint force of the machine without clearance
turns fast while it is small, by the empirical ratio

    |d alpha / dt| / |F|              rad s^-1 N^-1

with the direction alpha of the joint force F. It is given as `earles_wu`. Their papers were not at
hand: that there is such a formula is said in Proc. IMechE 199 (1985), doi
10.1243/PIME_PROC_1985_199_106_02 (abstract), and that it is gamma over R in the abstract of "Design
Guidelines for Predicting Contact Loss in Revolute Joints of Planar Linkage Mechanisms"; that gamma
is the rate of turn and R the force is our reading. It has a unit, so that a limit to it belongs to
one machine; none is set here.

Ours is a measure over a scale of the machine, without a unit:

    index = |d alpha / dt| / sqrt(|F| / (m c))

A journal that F presses against its bore swings on the wall at sqrt(F / (m c)), a pendulum of
length c, the radial clearance; m is what the rod's end weighs across the rod, the other end being
held (`compressor.solve.joint_scales`, there with the penetration added to c). Above 1 the force
turns faster than the journal can follow. So contact is expected to be lost where the index exceeds
a level of 1. That is an order of magnitude: along the rod, the mass is another one, and how the
journal moved before does not count.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis.contact_modes import FLIGHT, MODES, contact_modes, mode_map
from compressor.analysis.runs import case_of
from compressor.cases import Case, with_ideal_joints
from compressor.metrics import JOINTS
from compressor.solve import joint_scales, record, simulate

STEP_DEG = 0.1  # of crank angle at which the ideal machine is looked at
WIDTH_DEG = 1.0  # of the bins of crank angle in which prediction and run are compared
INDICES = {  # over angle and joint: unit, long name
    "force": ("N", "size of the ideal machine's joint force"),
    "direction": ("rad", "direction of the ideal machine's joint force on the rod, unwrapped"),
    "turn_rate": ("rad/s", "rate of turn of the direction"),
    "earles_wu": ("rad s-1 N-1", "rate of turn over the force"),
    "index": ("1", "rate of turn over the journal's swing rate in its bore"),
}

Interval = tuple[float, float]  # begin and end, deg; the end may exceed 360


def loss_indices(case: Case) -> xr.Dataset:
    """Return `INDICES` of the case's joints with clearance, over a revolution of its ideal machine.

    Dims `angle` (deg, 0 to 360, `STEP_DEG` apart) and `joint`. The rate is (F_x F_y' - F_y F_x') /
    F^2 by central differences, so that a jump of the load counts as a fast turn. Where the force is
    zero, the indices are infinite. Raises ValueError where no joint has clearance.
    """
    p = record(case)
    joints = [joint for joint, c in zip(JOINTS, p["clearance"], strict=True) if c > 0]
    if not joints:
        raise ValueError("no joint of the case has clearance")
    run = ideal_revolution(case)
    time = run["time"].values
    columns = [
        indices_of(time, run["contact_force"].sel(joint=joint).values, swing_mass(p, joint))
        for joint in joints
    ]
    found = {
        name: (
            ("angle", "joint"),
            np.stack([column[name][:-1] for column in columns], axis=1),
            {"units": unit, "long_name": phrase},
        )
        for name, (unit, phrase) in INDICES.items()
    }
    angle = {"units": "deg", "long_name": "crank angle from top dead centre"}
    return xr.Dataset(
        found,
        {"angle": ("angle", STEP_DEG * np.arange(time.size - 1), angle), "joint": joints},
    )


def ideal_revolution(case: Case) -> xr.Dataset:
    """Return a revolution of the case's machine with ideal joints, as a run with time series."""
    values = with_ideal_joints(case).values()
    values["solve"] = {"duration_rev": 1, "settle_rev": 0, "output_step_deg": STEP_DEG}
    values["output"] = {"keep": "series"}
    return simulate(Case.resolve(values))


def swing_mass(p: np.record, joint: str) -> float:
    """Return the mass times radial clearance (kg m) of the journal's swing in its bore."""
    scales = joint_scales(p, joint, 1.0)
    length = scales.clearance + scales.penetration
    mass = scales.force / (length * (2.0 * np.pi * scales.swing_frequency) ** 2)
    return float(mass * scales.clearance)


def indices_of(time: np.ndarray, force: np.ndarray, inertia: float) -> dict[str, np.ndarray]:
    """Return `INDICES` of a periodic joint force (N), (m, 2), over a period with both ends;
    inertia: m c.

    `time`: (m,), s, evenly spaced.
    """
    size = np.hypot(force[:, 0], force[:, 1])
    around = np.concatenate((force[-2:-1], force, force[1:2]))
    rate = (around[2:] - around[:-2]) / (2.0 * (time[1] - time[0]))
    across = force[:, 0] * rate[:, 1] - force[:, 1] * rate[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.where(size > 0, across / size**2, np.inf)
        rate = np.where(size > 0, np.abs(turn), np.inf)
        swing = np.sqrt(size / inertia)
    return {
        "force": size,
        "direction": np.unwrap(np.arctan2(force[:, 1], force[:, 0])),
        "turn_rate": turn,
        "earles_wu": rate / size,
        "index": rate / swing,
    }


@dataclass(frozen=True)
class Lookout:
    """How prediction and run are compared.

    `level`: of the index, above which loss is expected; `slack`: degrees by which flight may come
    after the interval that predicts it; `least_share`: of the revolutions that must be in flight
    at an angle for contact to count as lost there.
    """

    level: float = 1.0
    slack: float = 10.0
    least_share: float = 0.5


def compare_losses(run: xr.Dataset, lookout: Lookout | None = None) -> xr.Dataset:
    """Return predicted losses of contact beside those of a run with time series, after settling.

    Over the dim `interval`: `joint_of`, `outcome` and `begin`, `end` (deg; the end may exceed 360,
    and what holds all round is 0 to 360). A predicted interval is a `hit` where it, or `slack`
    after it, overlaps flight, and else a `false_alarm`; flight that no prediction overlaps is a
    `miss`. Over `joint`: `predicted_share` and `lost_share` of the revolution and `both_share`,
    where both hold without slack. All to `WIDTH_DEG`. Raises ValueError for a run without time
    series or clearance.
    """
    lookout = lookout or Lookout()
    flight = mode_map(contact_modes(run), WIDTH_DEG)["share"].sel(mode=MODES[FLIGHT])
    indices = loss_indices(case_of(run))
    rows: list[tuple[str, str, float, float]] = []
    shares = []
    for joint in flight["joint"].values.tolist():
        high = np.asarray(indices["index"].sel(joint=joint).values > lookout.level).reshape(
            flight["angle"].size, -1
        )
        expected = np.asarray(high.any(axis=1))
        lost = np.nan_to_num(flight.sel(joint=joint).values) >= lookout.least_share
        flown = joined(arcs(lost), lookout.slack)
        table = outcomes(arcs(expected), flown, lookout.slack)
        rows += [(joint, outcome, *arc) for outcome, arc in table]
        shares.append((expected.mean(), lost.mean(), (expected & lost).mean()))
    return comparison(rows, flight["joint"].values, np.array(shares))


def comparison(
    rows: list[tuple[str, str, float, float]], joints: np.ndarray, shares: np.ndarray
) -> xr.Dataset:
    """Return the Dataset of `compare_losses`."""
    degrees = {"units": "deg"}
    kinds: dict[str, tuple[type | str, dict[str, str]]] = {
        "joint_of": ("U9", {"long_name": "joint of the interval"}),
        "outcome": ("U11", {"long_name": "hit, false_alarm or miss"}),
        "begin": (float, degrees | {"long_name": "crank angle at which it begins"}),
        "end": (float, degrees | {"long_name": "crank angle at which it ends"}),
    }
    found = xr.Dataset(coords={"joint": joints})
    for number, (name, (kind, attrs)) in enumerate(kinds.items()):
        found[name] = ("interval", np.array([row[number] for row in rows], dtype=kind), attrs)
    phrases = {"predicted_share": "share of the revolution with contact loss predicted",
               "lost_share": "share of the revolution with contact lost in the run",
               "both_share": "share of the revolution with both"}  # fmt: skip
    for number, (name, phrase) in enumerate(phrases.items()):
        found[name] = ("joint", shares[:, number], {"units": "1", "long_name": phrase})
    return found


def arcs(mask: np.ndarray) -> list[Interval]:
    """Return where a mask over equal bins of a revolution holds: arcs in degrees, each begins in
    it.
    """
    width = 360.0 / mask.size
    if mask.all():
        return [(0.0, 360.0)]
    begins = np.flatnonzero(mask & ~np.roll(mask, 1))
    ends = np.flatnonzero(mask & ~np.roll(mask, -1)) + 1
    found = []
    for begin in begins.tolist():
        later = ends[ends > begin]
        end = later[0] if later.size else ends[0] + mask.size
        found.append((begin * width, float(end) * width))
    return found


def joined(lost: list[Interval], slack: float) -> list[Interval]:
    """Return the arcs of the circle (deg) in order, those less than `slack` apart put together."""
    found: list[Interval] = []
    for begin, end in lost:
        if found and begin - found[-1][1] < slack:
            found[-1] = found[-1][0], end
        else:
            found.append((begin, end))
    if len(found) > 1 and found[0][0] + 360.0 - found[-1][1] < slack:
        begin = found.pop()[0]
        found = [*found[1:], (begin, found[0][1] + 360.0)]
    return found


def outcomes(
    predicted: list[Interval], lost: list[Interval], slack: float
) -> list[tuple[str, Interval]]:
    """Return each predicted arc as hit or false alarm, and each lost arc that none overlaps as a
    miss.
    """
    late = [(begin, end + slack) for begin, end in predicted]
    hits = [any(overlap(one, other) for other in lost) for one in late]
    found = [
        ("hit" if hit else "false_alarm", arc) for hit, arc in zip(hits, predicted, strict=True)
    ]
    found += [("miss", arc) for arc in lost if not any(overlap(arc, one) for one in late)]
    return found


def overlap(one: Interval, other: Interval) -> bool:
    """Return whether two arcs of the circle (deg) share more than an end."""
    shifts = (-360.0, 0.0, 360.0)
    return any(one[0] < other[1] + s and other[0] + s < one[1] for s in shifts)
