"""Judge the paper's eight claims on many machines: how far each is off, and what decides it.

A machine is eleven ordinary jobs of a study: both ideal loads and the paper's nine worn cases, by
blocks, as the examples `claims` and `assumptions` have them; whatever else is swept makes machines.
Margins are taken from the stored jobs by the rules of the report, 0 at a claim's threshold.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from compressor import analysis, cases, program, report, store
from compressor.cases import Case
from compressor.report import style
from compressor.store import StoredStudy
from compressor.studies import frame

CLAIMS = tuple(range(1, len(analysis.RULES) + 1))
SHORT = (
    "same ideal motion", "spring load differs", "acceleration alone changes",
    "peaks grow with clearance", "horizontal force dominates", "acceleration follows force",
    "big end hits steadily", "two clearances are worse",
)  # fmt: skip
ROLES = ("load", "joint", "clearance_mm")  # keys that make the paper's cases of a machine
LABELS = tuple(analysis.paper_cases())
ROD, RECIPROCATING = "rod_mass_kg", "reciprocating_mass_kg"
CUT = 1.0  # margins beyond this are cut: how far beyond decides no claim
ORDERS = ("first_order", "total_order")
INTERVALS = tuple(f"{order}{end}" for order in ORDERS for end in ("", "_low", "_high"))
NUMBERS = {  # name -> dims, unit, long name
    "margin": (("claim",), "1", "how far a claim is from its threshold, relative to it"),
    "error": (("claim",), "1", "how far the margin may be off"),
    "chaotic": ((), "1", "how many of the cases are chaotic"),
}
TEXTS = {"failed": "cases there are not, and why"}
REMEDY = "compsim init claims writes a case file with all eleven cases of each machine"

Key = tuple[tuple[str, Any], ...]  # swept values of a machine


def machines(source: StoredStudy) -> dict[Key, dict[str, str]]:
    """Return the keys of the jobs of each machine, by the labels of the paper's cases.

    Jobs that are none of these are left aside. Raises StudyError without a machine that has all.
    """
    ideal = {load: name for name, load in analysis.LOADS.items()}
    found: dict[Key, dict[str, str]] = {}
    for key, point in zip(source.keys, cases.points(source), strict=True):
        load, joint, clearance = (point.get(role) for role in ROLES)
        name = ideal.get(str(load), "") if joint == "none" else ""
        if load == analysis.LOADS["design"] and isinstance(clearance, float):
            name = analysis.label(str(joint), clearance)
        machine = tuple(one for one in point.items() if one[0] not in ROLES)
        if name in LABELS:
            found.setdefault(machine, {})[name] = key
    if not any(len(jobs) == len(LABELS) for jobs in found.values()):
        raise frame.StudyError(
            f"study {source.name} has no machine with the paper's cases: {REMEDY}"
        )
    return found


def judge_machines(
    folder: store.Folder, source: StoredStudy, progress: program.Progress = program.no_progress
) -> xr.Dataset:
    """Return the margins of each machine of a stored study, with the dimension machine.

    `margin`, `error` over claim; swept keys are coordinates, in the case file's unit. Raises
    StudyError and StoreError.
    """
    found = machines(source)
    stored = store.read_store(folder, warn=True)
    rows = []
    for jobs in program.report_progress([*found.values()], progress):
        runs, problems = {}, [f"{name}: missing" for name in LABELS if name not in jobs]
        for name, key in jobs.items():
            status = stored.status(key)
            why = status.reason if status else "missing"
            if status and not status.samples:
                why = why or "without time series"
            if why:
                problems.append(f"{name}: {why}")
                continue
            try:
                runs[name] = stored.job(key)
            except store.DamagedFile:
                problems.append(f"{name}: damaged")
        rows.append(measure(runs, "; ".join(problems)))
    columns = zip(*(dict(machine).values() for machine in found), strict=True)
    names = store.coordinate_names([key for key, _ in next(iter(found))])
    coords: dict[str, tuple] = {
        name: ("machine", *store.swept_column(key, column))
        for (key, name), column in zip(names.items(), columns, strict=True)
    }
    coords["claim"] = "claim", np.array(CLAIMS), {"long_name": "claim of the paper"}
    thresholds = "; ".join(
        f"{n}. {rule.threshold}" for n, rule in zip(CLAIMS, analysis.RULES, strict=True)
    )
    judged = frame.rows_dataset(rows, "machine", TEXTS, NUMBERS).assign_coords(coords)
    return judged.assign_attrs(thresholds=thresholds, study=source.name)


def measure(runs: Mapping[str, xr.Dataset], failed: str = "") -> frame.Row:
    """Return the `NUMBERS` and `TEXTS` of one machine's runs by label.

    failed: which cases there are not, and why; margins are nan then, and of runs that are too
    short.
    """
    margins = np.full((len(CLAIMS), 2), math.nan)
    try:
        margins[:] = margins if failed else analysis.claim_margins(runs)
    except analysis.NoSeriesError as error:
        failed = str(error)
    return {
        "margin": margins[:, 0].tolist(), "error": margins[:, 1].tolist(),
        "chaotic": sum(run.attrs.get("regime") == "chaotic" for run in runs.values()),
        "failed": failed,
    }  # fmt: skip


def assumptions(found: xr.Dataset) -> list[str]:
    """Return the names of the swept keys of machines."""
    return [str(name) for name, one in found.coords.items() if "case_key" in one.attrs]


def list_failed(found: xr.Dataset) -> Iterator[str]:
    """Yield what each machine without a verdict lacks, behind its swept values."""
    for number in np.flatnonzero(found["failed"].values != ""):
        one = found.isel(machine=number)
        machine = ", ".join(f"{name} {one[name].item()}" for name in assumptions(found))
        yield f"{machine}: {one['failed'].item()}".removeprefix(": ")


def sensitivity(found: xr.Dataset) -> xr.Dataset | None:
    """Return Sobol's indices of each claim's margin over the swept keys; None without the design.

    `first_order` and `total_order` over (claim, assumption), with `_low` and `_high`, the ends of
    the 95 % bootstrap interval; nan where a margin is the same at all machines. Margins are cut at
    ± 1. A machine without margins counts as the median one.
    """
    names = assumptions(found)
    columns = [found[name].values for name in names]
    is_numeric = bool(columns) and all(column.dtype != object for column in columns)
    design = analysis.saltelli_design(np.stack(columns, axis=1)) if is_numeric else None
    if design is None:
        return None
    margin = np.clip(found["margin"].transpose("claim", "machine").values, -CUT, CUT)
    margin = np.where(np.isnan(margin), np.nanmedian(margin, axis=1, keepdims=True), margin)
    values = {name: np.full((len(CLAIMS), len(names)), np.nan) for name in INTERVALS}
    for claim in np.flatnonzero(np.ptp(margin, axis=1) > 0.0):
        for name, row in design.indices(margin[claim]).items():
            values[name][claim] = row
    coords = {"claim": found["claim"].values, "assumption": np.array(names, object)}
    return xr.Dataset({n: (("claim", "assumption"), one) for n, one in values.items()}, coords)


def mass_plane(found: xr.Dataset) -> xr.Dataset | None:
    """Return machines that are a grid over both masses with these as dimensions, else None."""
    if {*assumptions(found)} != {ROD, RECIPROCATING}:
        return None
    sizes = [np.unique(found[name]).size for name in (ROD, RECIPROCATING)]
    if found.sizes["machine"] != math.prod(sizes) or min(sizes) < 3:
        return None
    return found.set_index(machine=[RECIPROCATING, ROD]).unstack("machine")


HEAD = ("claim", "", "holds in", "least", "median", "greatest", "most by, total effect")


def table(found: xr.Dataset, effects: xr.Dataset | None) -> Iterator[tuple[str, ...]]:
    """Yield a row for each claim below a head: machines where it holds, its margins in percent.

    effects: of `sensitivity`.
    """
    yield HEAD
    for claim, short in zip(CLAIMS, SHORT, strict=True):
        by = most_by(effects.sel(claim=claim)) if effects is not None else ""
        yield f"{claim}", short, *cells(found["margin"].sel(claim=claim)), by


def cells(margin: xr.DataArray) -> list[str]:
    """Return how often a margin is not negative, and its least, median and greatest, in percent."""
    known = margin.values[~np.isnan(margin.values)]
    if not known.size:
        return ["-"] * 4
    spread = (np.min(known), np.median(known), np.max(known))
    return [f"{(known >= 0.0).sum()}", *(f"{100 * value:+.3g} %" for value in spread)]


def most_by(one: xr.Dataset) -> str:
    """Return the assumption with the greatest total effect on a claim, with its interval."""
    total = one["total_order"].values
    if np.isnan(total).all():
        return "-"
    best = one.isel(assumption=int(np.nanargmax(total)))
    value, low, high = (best[f"total_order{end}"].item() for end in ("", "_low", "_high"))
    return f"{best['assumption'].item()} {value:.2f} [{low:.2f}, {high:.2f}]"


def numbers(found: xr.Dataset) -> list[tuple[str, str]]:
    """Return labelled numbers of machines."""
    known = found["failed"].values == ""
    held = found["margin"].values >= 0.0
    others = [claim != 7 for claim in CLAIMS]
    return [
        ("machines judged", f"{known.sum()}"),
        ("without a verdict", f"{(~known).sum()}"),
        ("with chaotic cases", f"{(found['chaotic'].values > 0).sum()}"),
        ("all eight claims hold in", f"{held.all(axis=1).sum()}"),
        ("all but claim 7 hold in", f"{held[:, others].all(axis=1).sum()}"),
    ]


REACH = 0.5  # of the threshold: margins beyond it have the same colour
OF_MASSES = (3, 4, 5, 6, 7, 8)  # claims that masses can decide
EFFECTS = (("first_order", style.GREY, 0.19, "main effect"),
           ("total_order", style.BLUE, -0.19, "total"))  # fmt: skip
MAP = "blue: the claim holds, red: it does not, by its margin; ring: the default masses"
BARS = "shares of the variance of a claim's margin by an assumption, with 95 % intervals"


def draw(found: xr.Dataset, effects: xr.Dataset | None) -> tuple[report.PlotlyFigure, str] | None:
    """Return the figure of machines and a sentence on it: a map over both masses, or what decides.

    None where they are neither kind, or nothing is known of them.
    """
    plane = mass_plane(found)
    if found["margin"].isnull().all():
        return None
    if plane is not None:
        return draw_map(plane), MAP
    if effects is None or effects["total_order"].isnull().all():
        return None
    return draw_sensitivity(effects), BARS


def draw_map(plane: xr.Dataset) -> report.PlotlyFigure:
    """Return each claim's margin over rod and reciprocating mass, and how many claims hold."""
    drawing, panels = report.make_grid(2, 4, 5.6, len(OF_MASSES) + 1, share_x="all", share_y="all")
    x, y = plane[ROD].values, plane[RECIPROCATING].values
    *shown, number = drawing.panels
    for claim, panel in zip(OF_MASSES, shown, strict=True):
        margin = plane["margin"].sel(claim=claim).transpose(RECIPROCATING, ROD).values
        panel.map(x, y, margin, style.palette("RdBu", 8), (-REACH, REACH), "margin",
                  has_scale=panel is panels[0, 3])  # fmt: skip
        panel.title = f"claim {claim}"
    count = (plane["margin"] >= 0.0).transpose("claim", RECIPROCATING, ROD).sum("claim").values
    number.map(x, y, count.astype(float), style.palette("cividis", 7), (1.5, 8.5))
    number.title = "how many of eight hold"
    default = Case.from_values({}).machine
    for panel in drawing.panels:
        ring = style.mark(style.RED, "circle", 6, is_hollow=True, edge_width=1.8)
        panel.plot(default.rod_mass_kg, default.reciprocating_mass_kg, ring)
        panel.x.showgrid = panel.y.showgrid = False
        panel.x.title, panel.y.title = "rod mass (kg)", "reciprocating mass (kg)"
    return drawing.figure()


def draw_sensitivity(effects: xr.Dataset) -> report.PlotlyFigure:
    """Return main and total effect of each assumption on each claim's margin, with intervals."""
    names = [str(name).replace("_", " ") for name in effects["assumption"].values]
    claims = [claim for claim in CLAIMS if effects["total_order"].sel(claim=claim).notnull().any()]
    rows = -(-len(claims) // 4)
    height = 0.8 + rows * (0.9 + 0.21 * len(names))
    drawing, _ = report.make_grid(rows, 4, height, len(claims), share_y="all")
    place = np.arange(len(names), dtype=float)
    for panel, claim in zip(drawing.panels, claims, strict=True):
        for variable, color, shift, name in EFFECTS:
            one = effects.sel(claim=claim)
            value, at = one[variable].values, place - shift
            low, high = (one[f"{variable}_{end}"].values for end in ("low", "high"))
            ends = np.nan_to_num([value - low, high - value]).clip(min=0.0)
            panel.bars(np.maximum(value, 0.0), at, style.fill(color), name, 0.36, errors=ends)
        panel.title = f"claim {claim}"
        panel.x.title = "share of the variance"
        panel.span("x", 0.0, 1.25)
    first = drawing.panels[0]
    first.name_ticks("y", names)
    first.span("y", len(names) - 0.5, -0.5)
    return drawing.figure()
