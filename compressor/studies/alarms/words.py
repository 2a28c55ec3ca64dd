"""A result in words and rows: the table on stdout, and the CSV of everything."""

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from compressor.studies.alarms.alarms import best_of_each
from compressor.studies.alarms.detection import draws_to_be_sure
from compressor.studies.alarms.readings import BODY_VELOCITY

COLUMNS = (  # of the CSV: head, and the variable
    ("alarm", "title"), ("filter", "filter"), ("noise_m_per_s2", "noise"), ("joint", "worn_joint"),
    ("clearance_mm", "clearance"), ("clearance_low_mm", "clearance_low"),
    ("clearance_high_mm", "clearance_high"), ("draws", "draws"), ("detection", "detection"),
    ("detection_low", "detection_low"), ("detection_high", "detection_high"),
    ("false_alarms", "false_alarms"), ("false_alarms_low", "false_alarms_low"),
    ("false_alarms_high", "false_alarms_high"), ("limit_over_usual_low", "limit_low"),
    ("limit_over_usual_high", "limit_high"),
)  # fmt: skip
OF_JOINT = (
    ("first_clearance_mm", "first_clearance"), ("first_clearance_low_mm", "first_clearance_low"),
    ("first_clearance_high_mm", "first_clearance_high"),
)  # fmt: skip
SCATTER = 2.0  # ours: from so many times on between the least and the greatest, limits are named
LEADS = ("lead_hours", "lead_hours_low", "lead_hours_high")


def limit_words(found: xr.Dataset) -> str:
    """Return how limits were set."""
    attrs = found.attrs
    if not math.isnan(attrs["factor"]):
        return f"{attrs['factor']:g} times what is usual of a sound machine"
    rate = attrs["attainable"]
    text = f"for {100 * rate:.2g} % of false alarms"
    if rate > attrs["false_alarms"] * (1 + 1e-9):
        text += (f" (the sound draws allow no lower rate: {100 * attrs['false_alarms']:.2g} % "
                 "needs more of them)")  # fmt: skip
    return text


def first_words(one: xr.Dataset, joint: str) -> str:
    """Return the clearance from which on an alarm detects, with its interval.

    An end beyond the greatest clearance of the study is said so.
    """
    first = one.sel(joint=joint)
    value, low, high = (first[f"first_clearance{end}"].item() for end in ("", "_low", "_high"))
    if math.isinf(low):
        return "never"
    most = float(one["clearance"].values[one["worn_joint"].values == joint].max())
    last = f"> {most:.3g} mm" if math.isinf(high) else f"{high:.3g} mm"
    return f"{'never' if math.isinf(value) else f'{value:.3g} mm'} [{low:.3g} mm, {last}]"


def detects_words(one: xr.Dataset, joint: str) -> str:
    """Return whether, and from which clearance on, an alarm detects, in a sentence's words."""
    first = first_words(one, joint)
    if first.startswith("never"):
        return f"never detects{first.removeprefix('never')}"
    return f"detects from {first} on"


def rate_words(one: xr.Dataset) -> str:
    """Return the rate of false alarms with its interval."""
    value, low, high = (100 * one[f"false_alarms{end}"].item() for end in ("", "_low", "_high"))
    return f"{value:.2g} % [{low:.2g}, {high:.2g}]"


def limits_words(one: xr.Dataset) -> str:
    """Return the limits of the folds and of all sound draws, as their ends where they differ."""
    low, high = (f"{one[f'limit_{end}'].item():.3g}" for end in ("low", "high"))
    return low if low == high else f"{low}-{high}"


def lead_words(first: xr.Dataset) -> str:
    """Return the hours from an alarm to the end of the wear run, with their interval."""
    value, low, high = (first[name].item() for name in LEADS)
    if math.isnan(value):
        return "-"
    return f"{value:.4g} [{low:.4g}, {high:.4g}]"


def list_lines(found: xr.Dataset) -> Iterator[str]:
    """Yield the best filter of each alarm by joint, the first to see wear first."""
    yield from heading(found)
    head, rows = table_rows(found)
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = zip(row, widths, strict=True)
        yield "  ".join(f"{text:<{width}}" for text, width in cells).rstrip()


def heading(found: xr.Dataset) -> Iterator[str]:
    """Yield what was judged, and how."""
    attrs, windows = found.attrs, f"windows of {found.attrs['revolutions']} revolutions"
    jobs = f"{attrs['sound_jobs']} sound jobs of {attrs['sound_draws']} draws"
    yield f"study {attrs['study']}: {jobs}, {attrs['worn_jobs']} worn ones; {windows}"
    yield (f"limits {limit_words(found)}; detects: trips in {attrs['detected']:.0%} of windows; "
           "in brackets 95 % intervals by draws, for limits as they were set")  # fmt: skip
    yield ("a sound machine is quieter here than a real one, since valves and gas make no noise in "
           "this model: an alarm of a plant trips later")  # fmt: skip


def table_rows(found: xr.Dataset) -> tuple[list[str], list[list[str]]]:
    """Return the head and the rows of the table, as text."""
    noise, has_lead = found["noise"].values, LEADS[0] in found
    head = ["joint", "alarm", "limits", "false alarms", "detects from"]
    head += ["hours before the limit"] * has_lead
    head += [f"with noise of {one:g} m/s2" for one in noise[1:]]
    rows = []
    for joint in found["joint"].values.tolist():
        best = [best_of_each(found, joint, level) for level in range(noise.size)]
        for place in best[0]:
            plain = found.isel(alarm=place, noise=0)
            row = [joint, plain["alarm"].item(), limits_words(plain), rate_words(plain),
                   first_words(plain, joint)]  # fmt: skip
            if has_lead:
                row.append(lead_words(plain.sel(joint=joint)))
            for level, places in enumerate(best[1:], 1):
                if plain["kind"].item() == BODY_VELOCITY:  # of the body, without the noise
                    row.append("-")
                    continue
                other = found.isel(alarm=same_kind(found, place, places), noise=level)
                moved = "" if other["filter"] == plain["filter"] else f", {other['filter'].item()}"
                row.append(first_words(other, joint) + moved)
            rows.append(row)
    return head, rows


def same_kind(found: xr.Dataset, place: int, places: Sequence[int]) -> int:
    """Return which of some alarms is of the kind of another one."""
    kinds = found["kind"].values
    return next(other for other in places if kinds[other] == kinds[place])


def list_remarks(found: xr.Dataset) -> Iterator[str]:
    """Yield what a result does without, or rests on."""
    for reason, count in json.loads(found.attrs["left_out"]).items():
        yield f"left out: {count} {reason}"
    if found.attrs["clipped"]:
        yield (f"clipped: {found.attrs['clipped']} jobs, whose levels are those of the clipped "
               "record; raise sensor.range_m_per_s2")  # fmt: skip
    missing = json.loads(found.attrs.get("not_judged", "[]"))
    if missing:
        yield f"not judged, since not all sound records have it: {', '.join(missing)}"
    scattered = int((found["limit_high"] > SCATTER * found["limit_low"]).any("noise").sum())
    if scattered:
        yield (f"limits of {scattered} alarms differ by more than {SCATTER:g} times as one draw or "
               "another is left out, and intervals are without that: more sound draws are "
               "needed")  # fmt: skip
    few, needed = int(found["draws"].values.min()), draws_to_be_sure(found.attrs["detected"])
    if few < needed:
        share = f"{found.attrs['detected']:.3g} of windows"
        sure = f"to be sure of {share} takes {needed:g} that are all detected"
        sure = f"no number of them makes sure of {share}" if math.isinf(needed) else sure
        yield f"a clearance has {few} draws, and {sure}: ends of intervals lie beyond the study"
    yield (f"each alarm is shown with the best of its filters, of {found.sizes['alarm']} in all, "
           "which flatters it; the files hold all")  # fmt: skip
    differs = json.loads(found.attrs.get("wear_differs", "[]"))
    if differs:
        yield f"the machine of the wear run differs from the study's in {', '.join(differs)}"


def as_rows(found: xr.Dataset) -> str:
    """Return all rates as CSV: a row an alarm with its filter, noise and state."""
    wanted = [*OF_JOINT, *((name, name) for name in LEADS if name in found)]
    flat = found.drop_dims("factor")
    joints = flat["joint"].values.tolist()
    at = [joints.index(one) for one in flat["worn_joint"].values.tolist()]
    of_state = flat[[name for _, name in wanted]].isel(joint=("state", np.array(at, int)))
    dims = ("alarm", "noise", "state")
    sizes = tuple(flat.sizes[dim] for dim in dims)
    columns = []
    for source, names in ((flat, COLUMNS), (of_state, wanted)):
        for _, name in names:
            whole, _ = xr.broadcast(source[name], flat["detection"])
            columns.append(whole.transpose(*dims).values.reshape(-1))
    assert {column.size for column in columns} == {math.prod(sizes)}
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([head for head, _ in (*COLUMNS, *wanted)])
    for row in zip(*columns, strict=True):
        writer.writerow([f"{one:.6g}" if isinstance(one, float) else one for one in row])
    return file.getvalue()
