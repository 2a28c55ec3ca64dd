"""Work and precision: what each method and tolerance costs, and how far it is from the truth.

A function of stored jobs: a study of a case file that sweeps `solve.method` and `solve.rtol` is run
as any other. The truth is the tightest job by a method other than the one that is judged; how far
the tightest two lie apart says below which error nothing can be known.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from compressor import cases, report, store, sweep
from compressor.cases import Study
from compressor.digits import align_columns
from compressor.report import style
from compressor.studies import frame

ENDING = "-tradeoff"  # of the study's name
REFERENCES = ("DOP853", "RODAS")  # SciPy's explicit one, our implicit one that lands on onsets
# those behind the words of `accuracy`, some between, and that of the truth
TOLERANCES = sorted(
    {tier.rtol for tier in cases.ACCURACY.values()} | {1e-3, 2e-4, 1e-6, 1e-12}, reverse=True
)
# in place of what the file gives, but not of --set; auto steps by TSIT5
SETTINGS = (
    f"solve.method=[{', '.join(method for method in cases.METHODS if method != 'TSIT5')}]",
    f"solve.rtol=[{', '.join(map(repr, TOLERANCES))}]",
    "solve.error_bars=false", "solve.horizon=false", "solve.timeout_s=4", "output.keep=series",
)  # fmt: skip
SETTLED_REV = 3.0  # revolutions after settling
DECADES = tuple(10.0**-k for k in range(1, 10))
WORDS = ("status", "reason")
VARIABLES = {  # of a point -> attributes
    **{name: {} for name in WORDS},
    "seconds": {"units": "s", "long_name": "wall time of the solution"},
    "error_acceleration": {"units": "1", "long_name": "relative error of acceleration, L2"},
    "reference_uncertainty": {"units": "1", "long_name": "relative distance of two references"},
}


def load_methods(
    path: str, overrides: Sequence[str], folder: store.Folder
) -> tuple[Study, list[str]]:
    """Return the study of a case file by methods and tolerances, and what it sets in the file.

    Where the file lets a run find its own length, it is run, and all methods get the longest one.
    Raises StudyError and CaseFileError.
    """
    of_file = frame.without_keys(overrides, ["solve.method", "solve.rtol"])
    (own,) = cases.load_studies(path, overrides=of_file)
    if not all(any(vars(case.clearance_mm).values()) for case in own.cases):
        raise frame.StudyError(
            f"{path}: a job of {own.name} has no joint with clearance, so nothing is integrated: "
            "set joint and clearance_mm"
        )
    settings = [f"name={own.name[: frame.MAX_NAME - len(ENDING)]}{ENDING}", *SETTINGS]
    given = [case.solve.duration_rev for case in own.cases]
    if "auto" in [*given, *(case.solve.settle_rev for case in own.cases)]:
        sweep.sweep([own], folder, 1, overrides=of_file)
        runs = [(case, store.read_job(folder, case.key)) for case in own.cases]
        settle = max(round(run.attrs.get("settle", 0.0) / case.turn, 6) for case, run in runs)
        duration = max(settle + SETTLED_REV, *(one for one in given if isinstance(one, float)), 0.0)
        settings += [f"solve.duration_rev={duration!r}", f"solve.settle_rev={settle!r}"]
        overrides = frame.without_keys(overrides, ["solve.duration_rev", "solve.settle_rev"])
    texts = frame.replace_settings(settings, *overrides)
    (study,) = cases.load_studies(path, overrides=texts)
    return study, texts


def work_precision(folder: store.Folder, study: Study) -> xr.Dataset:
    """Return the errors and times of a stored study's jobs, as `tabulate` has them."""
    stored = store.read_store(folder)
    rows: list[dict[str, Any]] = []
    for key, case, point in zip(study.keys, study.cases, cases.points(study), strict=True):
        scene = " ".join(f"{value}" for name, value in point.items() if "solve." not in name)
        row: dict[str, Any] = {"scene": scene or study.name.removesuffix(ENDING)}
        row |= {"method": case.solve.method, "rtol": case.rtol}
        position = stored.position(key)
        if position is not None:
            run = stored.outcome(position)
            row |= {"status": run.status, "reason": run.reason}
            row["seconds"] = run.numbers["seconds"].item()
            row |= stored.values(key, ["acceleration"]) if run.status == "ok" else {}
        rows.append(row)
    for scene in dict.fromkeys(row["scene"] for row in rows):
        judge([row for row in rows if row["scene"] == scene and "acceleration" in row])
    return tabulate(rows).assign_attrs(study=study.name)


def tabulate(rows: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Return rows of points, a dictionary each, as a Dataset; dims (scene, method, rtol).

    (`Dataset.sel` has an argument `method`: select by `found.sel({"method": "auto"})`.)

    Errors are nan where a job failed, which `status` and `reason` show. `reference_uncertainty`:
    relative distance in acceleration of the tightest jobs of two methods.
    """
    dims = ("scene", "method", "rtol")
    order = {dim: [*dict.fromkeys(row[dim] for row in rows)] for dim in dims}
    order["rtol"].sort(reverse=True)
    last = {tuple(row[dim] for dim in dims): row for row in rows}.values()
    columns: dict[str, tuple] = {dim: ("row", [row[dim] for row in last]) for dim in dims}
    blanks = {name: "" if name in WORDS else math.nan for name in VARIABLES}
    for name, attrs in VARIABLES.items():
        kind = object if name in WORDS else float
        values = np.array([row.get(name, blanks[name]) for row in last], kind)
        columns[name] = "row", values, attrs
    table = xr.Dataset(columns).set_index(row=[*dims])
    found = table.unstack("row", fill_value=blanks).reindex(order)
    found["reference_uncertainty"] = found["reference_uncertainty"].max(dims[1:], keep_attrs=True)
    return found


def judge(rows: Sequence[dict[str, Any]]) -> None:
    """Write into the rows of one scene's jobs how far each is from the tightest one.

    A job is judged by another method's, so that none is judged by itself.
    """
    ranks = {name: number for number, name in enumerate(REFERENCES)}
    tight = sorted(rows, key=lambda row: (row["rtol"], ranks.get(row["method"], len(ranks))))
    other = next((row for row in tight if row["method"] != tight[0]["method"]), None)
    for row in rows:
        truth = other if other and row["method"] == tight[0]["method"] else tight[0]
        a, true_a = row["acceleration"], truth["acceleration"]
        if row is truth or a.size != true_a.size:
            continue
        row["error_acceleration"] = np.linalg.norm(a - true_a) / np.linalg.norm(true_a)
    for row in tight[:1]:
        row["reference_uncertainty"] = row.get("error_acceleration", math.nan)


def fastest(study: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the fastest point below each decade of error, for each scene.

    Decades that no point reaches, or that are below what the references know, have no row.
    """
    for name in study["scene"].values:
        one = study.sel(scene=name)
        for decade in DECADES:
            good = one["seconds"].where(one["error_acceleration"] <= decade)
            if decade < one["reference_uncertainty"] or not good.notnull().any():
                continue
            best = one.isel(good.argmin(dim=["method", "rtol"]))
            yield {
                "scene": str(name),
                "error_below": decade,
                "method": str(best["method"].item()),
                "rtol": best["rtol"].item(),
                "seconds": best["seconds"].item(),
            }


def list_fastest(study: xr.Dataset) -> list[str]:
    """Return the fastest method for each decade of error, as lines of text."""
    rows = [("case", "error below", "method", "rtol", "ms")]
    for row in fastest(study):
        error, rtol = (f"{row[name]:.0e}" for name in ("error_below", "rtol"))
        rows.append((row["scene"], error, row["method"], rtol, f"{1e3 * row['seconds']:.1f}"))
    return align_columns(rows, "<><>>")


# ---- the figure ---------------------------------------------------------------------------------

COLUMNS = 3
WORDS_ROOM = 4.0  # times left of the fastest point, for the words
MID, LIGHT = "#7d7d7d", "#ababab"
# of a `LineStyle`, and a label: compiled methods are solid and coloured, SciPy's grey and dashed
LOOKS: dict[str, tuple[Any, ...]] = {
    "auto": (style.BLUE, (), 1.7, 3.2, "circle", "auto (TSIT5)"),
    "RODAS": (style.GOLD, (), 1.6, 3.0, "diamond", "RODAS"),
    "DOP853": (style.BLACK, (1, 1.2), 1.2, 2.5, "triangle-up", "SciPy DOP853"),
    "RK45": (MID, (4, 1.5), 1.1, 2.4, "triangle-down", "SciPy RK45"),
    "LSODA": (style.BLACK, (6, 1.5), 1.0, 2.3, "triangle-left", "SciPy LSODA"),
    "Radau": (LIGHT, (6, 1.2, 1.2, 1.2), 1.3, 2.2, "triangle-right", "SciPy Radau"),
    "BDF": (MID, (1, 1.2), 1.2, 2.1, "pentagon", "SciPy BDF"),
}
OTHER = (MID, (), 1.0, 2.0, "circle", "")
TIER = style.mark(style.BLUE, "circle", 9.5, 4, is_hollow=True)
DISAGREE = style.fill("#e4e4e4", zorder=0)


def draw_work_precision(study: xr.Dataset) -> report.PlotlyFigure:
    """Return a panel a scene: error of acceleration over wall time, a line a method.

    Rings mark the tolerances behind the words of `accuracy`; in the grey band the references
    themselves disagree.
    """
    count = study.sizes["scene"]
    rows = -(-count // COLUMNS)
    drawing, _ = report.make_grid(rows, min(COLUMNS, count), 4.1 * rows + 0.7, count,
                           share_x="all", share_y="all")  # fmt: skip
    for number, panel in enumerate(drawing.panels):
        one = study.isel(scene=number)
        panel.x.type = panel.y.type = "log"
        draw_scene(panel, one)
        panel.title = str(one["scene"].item()).replace("_", " ")
        panel.x.title = "wall time of the solution (s)"
        panel.y.title = "relative L2 error of acceleration"
    first, ends = drawing.panels[0], limits(study)
    first.span("y", *ends)
    sides = study["seconds"].min().item() / WORDS_ROOM, 1.2 * study["seconds"].max().item()
    first.span("x", *sides)
    for number, panel in enumerate(drawing.panels):
        apart = study["reference_uncertainty"].values[number].item()
        if apart > ends[0]:
            area = report.rectangle(np.array(sides), np.array([ends[0], apart]))
            panel.fill(*area, DISAGREE, "the references disagree")
    return drawing.figure()


def draw_scene(panel: report.Panel, one: xr.Dataset) -> None:
    """Draw a line a method, and a ring and the word where a tolerance of `auto` has one."""
    for name in one["method"].values:
        color, dash, width, zorder, marker, label = LOOKS.get(str(name), OTHER)
        line = style.LineStyle(color, dash, width, zorder, marker, 3.8)
        row = one.sel({"method": name})
        seconds = row["seconds"].where(row["error_acceleration"].notnull()).values
        panel.plot(seconds, row["error_acceleration"].values, line, label or str(name))
    for word, tier in cases.ACCURACY.items():
        if "auto" in one["method"].values and tier.rtol in one["rtol"].values:
            point = one.sel({"method": "auto", "rtol": tier.rtol})
            x, y = point["seconds"].item(), point["error_acceleration"].item()
            panel.plot(x, y, TIER, "a word of solve.accuracy")
            panel.write(word, x, y, style.BLUE, shift=(-11, -2), side="right", level="top")


def limits(study: xr.Dataset) -> tuple[float, float]:
    """Return the errors to be shown, with room for the band below which none is known."""
    found = study["error_acceleration"].values
    found = found[np.isfinite(found) & (found > 0)]
    return (float(found.min()) / 5, float(found.max()) * 3) if found.size else (1e-10, 1.0)
