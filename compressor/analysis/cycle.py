"""One revolution as an analyst reads it: vibration, rod load, its reversals, valve events, impacts.

The vibration is the sensor's record where a case has one, else the acceleration of the crosshead.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.contacts import impacts, joints_with_clearance
from compressor.analysis.runs import case_of, record_of
from compressor.analysis.shaking import NoSeriesError, whole_revolutions
from compressor.physics import segments

if TYPE_CHECKING:
    import xarray as xr

# what begins at a corner of the load, by the phase that it leads to
VALVES = ("discharge closes", "suction opens", "suction closes", "discharge opens")
CAM = ("cam: dwell begins", "cam: dwell ends", "cam: dwell begins", "cam: dwell ends")


@dataclass(frozen=True)
class Cycle:
    """The last settled revolution of a run over crank angle in degrees, 0 to 360.

    `angle`, `vibration` (m/s2): (m,), of the sensor if `is_sensed`; `load_angle`, `rod_load` (N, at
    the crosshead pin, positive in tension): (n,). `reversals`: angles at which the rod load changes
    its side. `events`: angles and names of the load's corners. `struck`: angles of the impacts
    after flight, by joint with clearance.
    """

    angle: np.ndarray
    vibration: np.ndarray
    is_sensed: bool
    load_angle: np.ndarray
    rod_load: np.ndarray
    reversals: tuple[float, ...]
    events: tuple[tuple[float, str], ...]
    struck: dict[str, np.ndarray]

    @property
    def degree_peaks(self) -> np.ndarray:
        """Return the vibration's greatest magnitude in each degree, (360,); nan of an empty one."""
        peaks = np.full(360, -np.inf)
        np.maximum.at(peaks, np.minimum(self.angle.astype(int), 359), np.abs(self.vibration))
        return np.where(np.isinf(peaks), np.nan, peaks)


def read_cycle(run: "xr.Dataset") -> Cycle:
    """Return the `Cycle` of a run with time series.

    Of a record that is shorter than the settled revolutions its own last revolution, with the load
    and the impacts of the same one. Raises NoSeriesError where no revolution is settled.
    """
    settled, count = whole_revolutions(run)
    recorded = read_sensor(run)
    number = min(count, recorded[2]) if recorded else count
    turns = settled["crank_angle"].values / math.tau
    begin = turns[0] + number - 1
    inside = (turns > begin - 1e-9) & (turns < begin + 1 + 1e-9)
    revolution = settled.isel(time=inside)
    degrees = 360.0 * (turns[inside] % 1.0)
    load = revolution["contact_force"].sel(joint="small_end", axis="x").values
    if recorded:
        passed, values, _ = recorded
        its = (passed > begin - 1e-9) & (passed < begin + 1 - 1e-9)
        angle, vibration = sort_by_angle(360.0 * ((passed[its] + 1e-12) % 1.0), values[its])
    else:
        angle, vibration = sort_by_angle(degrees, revolution["acceleration"].values)
    load_angle, sorted_load = sort_by_angle(degrees, load)
    return Cycle(
        angle, vibration, recorded is not None, load_angle, sorted_load,
        find_reversals(turns[inside], load), find_events(run, begin), find_impacts(run, begin),
    )  # fmt: skip


def sort_by_angle(degrees: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values by rising angle."""
    order = np.argsort(degrees, kind="stable")
    return degrees[order], values[order]


def read_sensor(run: "xr.Dataset") -> tuple[np.ndarray, np.ndarray, int] | None:
    """Return the crank's revolutions at the samples of a record, these, and how many are settled.

    Revolutions count from the run's begin. By the tacho, at a steady pace before the first pulse
    and behind the last. None without a record.
    """
    if "sensor_acceleration" not in run or not run.sizes["sensor_time"]:
        return None
    case, time, pulses = case_of(run), run["sensor_time"].values, run["tacho_time"].values
    known = np.concatenate([pulses[:1] - case.turn, pulses, pulses[-1:] + case.turn])
    if not pulses.size:
        known = np.array([0.0, case.turn])
    turns = np.interp(time, known, np.arange(known.size) - (1.0 if pulses.size else 0.0))
    steady = case.body is not None and case.body.start == "steady"
    first = float(run.attrs["settle"]) / case.turn
    passed = turns - turns[0]  # a steady record begins where the settled part does
    spacing = passed[-1] / max(turns.size - 1, 1)
    whole = math.floor(passed[-1] + 2.0 * spacing - (0.0 if steady else first))
    if whole < 1:
        raise NoSeriesError("the sensor's record has no whole settled revolution")
    return passed + (first if steady else 0.0), run["sensor_acceleration"].values, whole


def find_reversals(turns: np.ndarray, load: np.ndarray) -> tuple[float, ...]:
    """Return the crank angles (degrees) at which a force changes its sign, straight between.

    Of a force that is zero for a while, as in flight, it is where it is zero for the last time.
    """
    (loaded,) = np.nonzero(load)
    changes = np.flatnonzero(load[loaded[:-1]] * load[loaded[1:]] < 0.0)
    after = loaded[changes + 1]
    before = after - 1  # on the other side, or without load
    part = load[before] / (load[before] - load[after])
    at = turns[before] + part * (turns[after] - turns[before])
    return tuple(sorted(float(one) for one in 360.0 * (at % 1.0)))


def find_events(run: "xr.Dataset", begin: float) -> tuple[tuple[float, str], ...]:
    """Return the angles (degrees) and names of the load's corners in a revolution.

    They are the same in each: those of the next one are read, which has one before it.

    The phase of a cylinder with two ends is that of its head end plus four times that of its crank
    end: what changes of either is an event.
    """
    case, p = case_of(run), record_of(run)
    begin += 1.0
    edges, phases = segments(p, (begin + 1.5) * case.turn)
    names = CAM if case.load == "spring" else VALVES
    both = (np.asarray(phases) >> 2).any()
    found = set()
    for edge, before, after in zip(edges[1:-1], phases[:-1], phases[1:], strict=True):
        turn = edge / case.turn
        if not begin - 1e-9 < turn < begin + 1 - 1e-9:
            continue
        ends = (("head ", before & 3, after & 3), ("crank ", before >> 2, after >> 2))
        for end, was, now in ends:
            if was != now:
                name = (end if both else "") + names[now]
                found.add((round(360.0 * ((turn + 1e-12) % 1.0), 9), name))
    return tuple(sorted(found))


def find_impacts(run: "xr.Dataset", begin: float) -> dict[str, np.ndarray]:
    """Return the angles (degrees) of the impacts in a revolution by joint with clearance."""
    found = [
        one for one in impacts(run)
        if begin - 1e-9 < one.revolution - 1 + one.crank_angle / 360.0 < begin + 1
    ]  # fmt: skip
    return {
        joint: np.array([one.crank_angle for one in found if one.joint == joint])
        for joint in joints_with_clearance(run)
    }
