"""A result in words and rows: the table on stdout, and the CSV of everything."""

import json
import math
from collections.abc import Iterator

import xarray as xr

from compressor.digits import align_columns
from compressor.studies.alarms.alarms import best_of_each
from compressor.studies.alarms.detection import draws_to_be_sure
from compressor.studies.alarms.readings import BODY_VELOCITY

ENDS = ("", "_low", "_high")  # of a number, and of its interval
# of the CSV: head -> variable
COLUMNS = {"alarm": "title", "filter": "filter", "noise_m_per_s2": "noise", "joint": "worn_joint"}
COLUMNS |= {f"clearance{end}_mm": f"clearance{end}" for end in ENDS} | {"draws": "draws"}
COLUMNS |= {
    f"{name}{end}": f"{name}{end}" for name in ("detection", "false_alarms") for end in ENDS
}
COLUMNS |= {f"limit_over_usual{end}": f"limit{end}" for end in ENDS[1:]}
OF_JOINT = {f"first_clearance{end}_mm": f"first_clearance{end}" for end in ENDS}
LEADS = [f"lead_hours{end}" for end in ENDS]
SCATTER = 2.0  # ours: from so many times on between the least and the greatest, limits are named


def limit_words(found: xr.Dataset) -> str:
    """Return how limits were set."""
    attrs = found.attrs
    if not math.isnan(attrs["factor"]):
        return f"{attrs['factor']:g} times what is usual of a sound machine"
    wanted, rate = attrs["false_alarms"], attrs["attainable"]
    text = f"for {100 * rate:.2g} % of false alarms"
    if rate <= wanted * (1 + 1e-9):
        return text
    return f"{text} (the sound draws allow no lower rate: {100 * wanted:.2g} % needs more of them)"


def first_words(one: xr.Dataset, joint: str) -> str:
    """Return the clearance from which on an alarm detects, with its interval.

    An end beyond the greatest clearance of the study is said so.
    """
    first = one.sel(joint=joint)
    value, low, high = (first[name].item() for name in OF_JOINT.values())
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
    value, low, high = (100 * one[f"false_alarms{end}"].item() for end in ENDS)
    return f"{value:.2g} % [{low:.2g}, {high:.2g}]"


def limits_words(one: xr.Dataset) -> str:
    """Return the limits of the folds and of all sound draws, as their ends where they differ."""
    low, high = (f"{one[f'limit_{end}'].item():.3g}" for end in ("low", "high"))
    return low if low == high else f"{low}-{high}"


def lead_words(first: xr.Dataset) -> str:
    """Return the hours from an alarm to the end of the wear run, with their interval."""
    value, low, high = (first[name].item() for name in LEADS)
    return "-" if math.isnan(value) else f"{value:.4g} [{low:.4g}, {high:.4g}]"


def list_alarms(found: xr.Dataset) -> list[str]:
    """Return the best filter of each alarm by joint, the first to see wear first."""
    head, rows = table_rows(found)
    return [*heading(found), *align_columns([head, *rows])]


def heading(found: xr.Dataset) -> Iterator[str]:
    """Yield what was judged, and how."""
    attrs, windows = found.attrs, f"windows of {found.attrs['revolutions']} revolutions"
    jobs = f"{attrs['sound_jobs']} sound jobs of {attrs['sound_draws']} draws"
    yield f"study {attrs['study']}: {jobs}, {attrs['worn_jobs']} worn ones; {windows}"
    detects = f"detects: trips in {attrs['detected']:.0%} of windows"
    brackets = "in brackets 95 % intervals by draws, for limits as they were set"
    yield f"limits {limit_words(found)}; {detects}; {brackets}"
    yield (
        "a sound machine is quieter here than a real one, since valves and gas make no noise in "
        "this model: an alarm of a plant trips later"
    )


def table_rows(found: xr.Dataset) -> tuple[list[str], list[list[str]]]:
    """Return the head and the rows of the table, as text."""
    noise, has_lead = found["noise"].values, LEADS[0] in found
    head = ["joint", "alarm", "limits", "false alarms", "detects from"]
    head += ["hours before the limit"] * has_lead
    head += [f"with noise of {one:g} m/s2" for one in noise[1:]]
    rows = []
    for joint in found["joint"].values.tolist():
        best, *others = [best_of_each(found, joint, level) for level in range(noise.size)]
        for place in best:
            plain = found.isel(alarm=place, noise=0)
            row = [joint, plain["alarm"].item(), limits_words(plain), rate_words(plain)]
            row += [first_words(plain, joint)]
            row += [lead_words(plain.sel(joint=joint))] if has_lead else []
            kind = plain["kind"].item()
            for level, places in enumerate(others, 1):
                if kind == BODY_VELOCITY:  # of the body, without the noise
                    row.append("-")
                    continue
                same = next(one for one in places if found["kind"].values[one] == kind)
                noisy = found.isel(alarm=same, noise=level)
                moved = "" if noisy["filter"] == plain["filter"] else f", {noisy['filter'].item()}"
                row.append(first_words(noisy, joint) + moved)
            rows.append(row)
    return head, rows


def list_remarks(found: xr.Dataset) -> Iterator[str]:
    """Yield what a result does without, or rests on."""
    attrs = found.attrs
    for reason, count in json.loads(attrs["left_out"]).items():
        yield f"left out: {count} {reason}"
    if attrs["clipped"]:
        record = "whose levels are those of the clipped record; raise sensor.range_m_per_s2"
        yield f"clipped: {attrs['clipped']} jobs, {record}"
    if missing := json.loads(attrs.get("not_judged", "[]")):
        yield f"not judged, since not all sound records have it: {', '.join(missing)}"
    scattered = int((found["limit_high"] > SCATTER * found["limit_low"]).any("noise").sum())
    if scattered:
        yield (
            f"limits of {scattered} alarms differ by more than {SCATTER:g} times as one draw or "
            "another is left out, and intervals are without that: more sound draws are needed"
        )
    few, needed = int(found["draws"].values.min()), draws_to_be_sure(attrs["detected"])
    if few < needed:
        share = f"{attrs['detected']:.3g} of windows"
        sure = f"to be sure of {share} takes {needed:g} that are all detected"
        sure = f"no number of them makes sure of {share}" if math.isinf(needed) else sure
        yield f"a clearance has {few} draws, and {sure}: ends of intervals lie beyond the study"
    best = f"the best of its filters, of {found.sizes['alarm']} in all, which flatters it"
    yield f"each alarm is shown with {best}; the files hold all"
    if differs := json.loads(attrs.get("wear_differs", "[]")):
        yield f"the machine of the wear run differs from the study's in {', '.join(differs)}"


def csv_text(found: xr.Dataset) -> str:
    """Return all rates as CSV: a row an alarm with its filter, noise and state."""
    of_joint = OF_JOINT | {name: name for name in LEADS if name in found}
    joints = found["joint"].values.tolist()
    worn = [joints.index(one) for one in found["worn_joint"].values.tolist()]
    of_state = found[[*of_joint.values()]].isel(joint=("state", worn)).drop_vars("joint")
    whole = found[[*COLUMNS.values()]].merge(of_state)
    frame = whole.to_dataframe(["alarm", "noise", "state"]).reset_index()
    columns = COLUMNS | of_joint
    frame = frame[[*columns.values()]].set_axis([*columns], axis=1)
    return frame.to_csv(index=False, float_format="%.6g", na_rep="nan", lineterminator="\n")
