"""Hours between an alarm and the end of a machine that wears, by the clearances it is seen at."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import interpolate_hours
from compressor.cases import Case, Wear
from compressor.metrics import JOINTS
from compressor.store import StoreError, read_dataset
from compressor.studies.alarms.detection import First
from compressor.studies.alarms.windows import AlarmsError

REMEDY = "compsim wear the machine's case file, and name the file, or its folder of results"
# groups of a case in which a worn machine and those of the study should agree
SAME = ("machine", "load", "gas", "spring", "contact", "friction", "lubricant", "guide", "drive",
        "rod")  # fmt: skip
MAX_NAMED = 4  # keys that are named of those that differ


@dataclass(frozen=True)
class WearHistory:
    """How a machine has worn: the greatest clearance of each joint over hours.

    clearances: mm, (stages, joints); limit: mm, at which a joint is worn out; factor: by which the
    coefficient of wear, and so all hours, may be greater or smaller; span: hours to judge, beyond
    which a run goes on by the factor, for the greatest coefficient alone.
    """

    name: str
    hours: np.ndarray
    clearances: np.ndarray
    limit: float
    factor: float
    span: float
    values: dict[str, Any]

    def hours_at(self, joint: str, clearance: float) -> float:
        """Return the hours at which a joint has a clearance; inf of one that it does not reach."""
        opened = self.clearances[:, JOINTS.index(joint)]
        return interpolate_hours(self.hours, opened, clearance)

    @property
    def end(self) -> float:
        """Return the hours at which the first joint is worn out; inf where none is within `span`.

        As `compsim wear`, which says "not worn out" of a life beyond `wear.hours`.
        """
        found = min(self.hours_at(joint, self.limit) for joint in JOINTS)
        return found if found <= self.span else math.inf


class Lead(NamedTuple):
    """Hours from an alarm to the end of the wear run, with their interval; 0: it does not lead."""

    hours: float
    low: float
    high: float


def open_run(place: str | Path) -> WearHistory:
    """Return the wear run of a file of `compsim wear`, or of the only one of a folder of results.

    Raises AlarmsError where there is none, or several, and StoreError for a foreign file.
    """
    path = Path(place)
    if path.is_dir():
        files = sorted({*path.glob("*.nc"), *path.glob("wear/*.nc")})
        if len(files) != 1:
            listed = ", ".join(map(str, files[:MAX_NAMED])) or "none"
            raise AlarmsError(f"{path} has {len(files)} wear runs ({listed}): {REMEDY}")
        path = files[0]
    try:
        found = read_dataset(path, REMEDY)
    except OSError as error:
        raise AlarmsError(f"{path}: {error.strerror}: {REMEDY}") from error
    if not {"hours", "clearance"} <= {*found.variables} or "case" not in found.attrs:
        raise StoreError(path, "holds no wear run", REMEDY)
    case = Case.from_attribute(found.attrs["case"])
    wear = case.wear or Wear()
    clearances = 1e3 * found["clearance"].transpose("stage", "joint").values
    return WearHistory(
        path.stem, found["hours"].values, clearances, wear.limit_mm or math.inf,
        wear.coefficient_factor, wear.hours, case.values(),
    )  # fmt: skip


def compute_lead(run: WearHistory, joint: str, first: First) -> Lead:
    """Return the hours from an alarm, which sees a joint at a clearance, to the run's limit.

    That is where the first joint, which may be the other one, is worn out. The interval carries the
    clearance's, and the factor of the coefficient of wear, by which all hours grow or shrink
    together. nan where no joint is worn out within the run's hours.
    """
    end = run.end
    if math.isinf(end):
        return Lead(math.nan, math.nan, math.nan)
    mid, low, high = (max(end - run.hours_at(joint, one), 0.0) for one in first)
    # `low` is by the low end of the clearance, which is seen the earliest
    return Lead(mid, high / run.factor, low * run.factor)


def add_lead_times(found: xr.Dataset, run: WearHistory) -> xr.Dataset:
    """Return a result of `judge_alarms` with `lead_hours` and its interval, by a wear run."""
    shape = found["first_clearance"].shape
    hours = np.full((len(Lead._fields), *shape), math.nan)
    ends = [found[f"first_clearance{end}"].values for end in ("", "_low", "_high")]
    for place in np.ndindex(shape):
        joint = str(found["joint"].values[place[-1]])
        if joint in JOINTS:
            hours[(slice(None), *place)] = compute_lead(
                run, joint, First(*(float(one[place]) for one in ends))
            )
    mine, swept = (json.loads(found.attrs[name]) for name in ("machine", "swept"))
    words = ("", "lower end of the interval of the ", "upper end of the interval of the ")
    return found.assign({
        f"lead_hours{end}": (
            ("alarm", "noise", "joint"), one,
            {"units": "h", "long_name": f"{word}hours from the alarm to a worn-out joint"},
        )
        for end, one, word in zip(("", "_low", "_high"), hours, words, strict=True)
    }).assign_attrs(
        wear_run=run.name, wear_limit=run.limit, wear_factor=run.factor,
        wear_differs=json.dumps([*differences(mine, swept, run.values)]),
    )  # fmt: skip


def differences(mine: dict[str, Any], swept: list[str], worn: dict[str, Any]) -> Iterator[str]:
    """Yield the keys in which a machine and the one that has worn differ, without swept ones."""
    for name in SAME:
        one, other = mine.get(name), worn.get(name)
        if not (isinstance(one, dict) and isinstance(other, dict)):
            if one != other:
                yield name
            continue
        for key in sorted({*one} | {*other}):
            if one.get(key) != other.get(key) and f"{name}.{key}" not in swept:
                yield f"{name}.{key}"
