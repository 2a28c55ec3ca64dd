"""Generated blocks of the README pages: `make pages` writes them, tests/test_pages.py compares."""

import json
import math
import re
from collections import Counter
from functools import partial
from pathlib import Path
from statistics import median

import findings

from compressor.cases.parameter import parameter_table
from compressor.cases.table import table
from compressor.reasons import Reason

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "tests" / "results"


def kept(name):
    """A kept measurement of tests/results."""
    return json.loads((RESULTS / name).read_text(encoding="utf-8"))


def markdown(head, rows):
    """A table of text."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines).replace(" --- ", "---")


def markdown_columns(head, columns):
    """Return a table of text of its columns, where these are few and long."""
    first, *rows = zip(head, *columns, strict=True)
    return markdown(list(first), rows)


def accuracy_table():
    measured = kept("accuracy.json")
    head = ["accuracy level", "promised error", "first rtol", "runs reported as accurate",
            "of these, error above the promise", "chaotic", "failed", "error: median",
            "error: 95 %", "error: largest", "estimated error / error: median",
            "accurate without the check", "time with check / without: mean",
            "time with check / without: median", "paper's nine cases: largest error",
            "paper's nine cases: time with check / without"]  # fmt: skip
    rows = [
        [word, f"{row['promise']:g}", f"{row['rtol']:g}", f"{row['kept']:,}", f"{row['broken']}",
         f"{row['regimes'].get('chaotic', 0)}", f"{sum(row['refused'].values())}"]
        + [f"{row['error'][k]:.1e}" for k in (0, 2, 3)]
        + [f"{row['told_over_error']:.1f}", f"{row['bare_kept']:.1%}",
           f"{row['cost']['mean']:.2f}", f"{row['cost']['median']:.2f}",
           f"{row['nine']['error']:.1e}", f"{row['nine']['cost']:.2f}"]
        for word, row in measured["words"].items()
    ]  # fmt: skip
    return markdown_columns(head, rows)


def calibration_table():
    measured = kept("calibration.json")
    head = ["tolerance of the second run", "pairs of runs", "error / distance: median",
            *(f"{share:g} %" for share in measured["cases"]["percentiles"][1:]),
            "factor in the program"]  # fmt: skip
    rows = [
        [f"{row['ratio']:g} times", f"{row['pairs']:,}"]
        + [f"{value:.2g}" for value in row["error_over_distance"]]
        + [f"{row['share']:.2g}"]
        for row in measured["series"]
    ]
    return markdown(head, rows)


def trade_table():
    measured = kept("accuracy.json")["trade"]
    head = ["rtol", "error of acceleration: median", "95 %", "error of its peak: median", "95 %",
            "largest energy residual / bound"]  # fmt: skip
    rows = [
        [f"{row['rtol']:g}"]
        + [f"{row[what][k]:.1e}" for what in ("acceleration", "peak") for k in (0, 2)]
        + [f"{row['residual']:.2g}"]
        for row in measured
    ]
    return markdown(head, rows)


def bars_table():
    measured = kept("accuracy.json")["bars"]
    names = list(next(iter(measured.values())))
    rows = [
        [f"`{name}`"]
        + [
            f"{row['within']:.1%}" + (f", {row['tightness']:.1f}" if row["tightness"] else "")
            for row in (metrics[name] for metrics in measured.values())
        ]
        for name in names
    ]
    shares = []
    for metrics in measured.values():
        within = sum(row["within"] * row["of"] for row in metrics.values())
        shares.append(f"{within / sum(row['of'] for row in metrics.values()):.1%}")
    rows.append(["all", *shares])
    return markdown(["metric", *measured], rows)


def broken_table():
    head = ["accuracy level", "clearance, mm", "joint", "load", "rpm", "rod mass, kg",
            "reciprocating mass, kg", "error", "estimated error"]  # fmt: skip
    rows = [
        [word, f"{row['clearance_mm']:g}", row["joint"], row["load"], f"{row['speed_rpm']:g}",
         f"{row['rod_mass_kg']:g}", f"{row['reciprocating_mass_kg']:g}", f"{row['error']:.1e}",
         f"{row['told']:.1e}"]
        for word, found in kept("accuracy.json")["broken"].items()
        for row in found
    ]  # fmt: skip
    return markdown(head, rows)


def claims_table():
    measured = kept("claims.json")
    default, plane, drawn = measured["default"], measured["map"], measured["assumptions"]
    head = ["claim", "at the default masses", "map: machines where it holds",
            "neighbours with different verdicts", "margin between them",
            "random assumptions: machines where it holds",
            "parameter with the largest total effect"]  # fmt: skip
    rows = []
    for place, statement in enumerate(measured["statements"]):
        claim = str(place + 1)
        value, error = default["margin"][place], default["error"][place]
        one, inside = measured["flips"][claim], measured["between"][claim]
        closed = f"{inside['closed']} of {inside['pairs']} fall to zero within the error"
        rows.append([
            f"{claim}. {statement}",
            f"{'holds' if value >= 0 else 'does not hold'}, "
            f"{100 * value:+.3g} % ± {100 * error:.2g} %",
            f"{plane['each'][claim]} of {plane['judged']}",
            f"{one['flips']} of {one['pairs']}", closed if inside["pairs"] else "–",
            f"{drawn['each'][claim]} of {drawn['judged']}", deciding(drawn, place),
        ])  # fmt: skip
    return markdown(head, rows)


def deciding(drawn, place):
    """The parameter with the largest total effect on a claim, with its interval."""
    total = [value if value == value else -1.0 for value in drawn["total_order"][place]]
    if max(total) < 0.0:
        return "–"
    best = total.index(max(total))
    value, low, high = (drawn[f"total_order{end}"][place][best] for end in ("", "_low", "_high"))
    return f"{drawn['names'][best].replace('_', ' ')}, {value:.2f} [{low:.2f}, {high:.2f}]"


def claims_words():
    measured = kept("claims.json")
    plane, drawn, best = (measured[name] for name in ("map", "assumptions", "consistent"))
    pairs = zip(measured["agreeing"]["margin"], measured["agreeing"]["error"], strict=True)
    margins = [f"{n} {100 * m:+.3g} % ± {100 * e:.2g} %" for n, (m, e) in enumerate(pairs, 1)]

    def counts(row):
        return (
            f"{row['judged']} machines judged, {row['failed']} without a verdict, "
            f"{row['chaotic']} with chaotic cases; all eight claims hold in {row['all']}, all but "
            f"claim 7 in {row['but_7']}."
        )

    return (
        f"- **Map** ({plane['seconds']:.0f} s): {counts(plane)} Most consistent: rod mass "
        f"{best['rod_mass']:.3g} kg, reciprocating mass {best['reciprocating_mass']:.3g} kg, where "
        f"and at all neighbours, claims {', '.join(map(str, best['claims']))} hold by "
        f"{100 * best['least']:.2g} % or more.\n"
        f"- **All assumptions:** {counts(drawn)}\n"
        f"- **The machine of `agreeing.yaml`**, in {measured['agreeing']['revolutions']:.0f} "
        f"revolutions: {', '.join(margins)}.\n"
    )


def store_table():
    found = kept("store.json")
    lines = ["| time series | file, kB | writing, ms | reading, ms | rounding of acceleration |",
             "|---|---|---|---|---|"]  # fmt: skip
    for row in found["series"]:
        words = row["precision"] + (", shuffle and gzip" if row["compress"] else "")
        lines.append(
            f"| {words} | {row['bytes'] / 1000:.0f} | {row['write_ms']:.0f} | {row['read_ms']:.0f} "
            f"| {row['acceleration_rounding']:g} |"
        )
    rows = found["rows"]
    lines += [
        "",
        f"{rows['jobs']:,} jobs without time series: {rows['jobs_per_s']:,} written a second, each "
        f"on disk within {rows['greatest_wait_s']:.1f} s; {rows['bytes_a_job']} bytes a job in "
        f"{rows['segments']} files; `open_study` takes {rows['open_study_s']:.1f} s.",
    ]
    return "\n".join(lines) + "\n"


def of_scenes(rows, key, digits):
    """One quantity of a tool in the three scenes; a dash where it has none."""
    numbers = (f"{float(f'{row[key]:.{digits}g}'):g}" if key in row else "–" for row in rows)
    return " / ".join(numbers)


def validation_table():
    head = ["subject", "quantity", "unit", "published", "computed", "tolerance", "source"]
    rows = []
    for one in kept("validation.json")["rows"]:
        digits = max(4, 2 + len(f"{abs(one['expected']) / one['within']:.0f}"))
        expected, found = (f"{one[name]:.{digits}g}" for name in ("expected", "found"))
        if one["expected"] == 0:
            expected, found = "0", f"{one['found']:.1e}"
        rows.append([one["subject"], one["what"], one["unit"], expected, found,
                     f"{one['within']:.2g}", one["source"]])  # fmt: skip
    return markdown(head, rows)


def wear_table():
    found = kept("wear.json")
    one, machines = found["convergence"], found["machines"]
    cells = [[f"{1e3 * row['step_mm']:g}", f"{row['hours']:.3%}"] for row in one["rows"]]
    good = [row["error"] for row in machines if not row["reason"]]
    return (
        f"Errors against {1e3 * one['finest']:g} µm, of the default machine with both joints from "
        f"0.2 mm to 0.3 mm at the first of them:\n\n"
        f"{markdown(['step, µm', 'error of the hours'], cells)}\n"
        f"Of {len(machines)} machines drawn at random, {len(good)} were followed to one and a half "
        f"clearances. Between the default ({1e3 * found['step_mm']:g} µm) and a quarter of the "
        f"step, hours differ by {median(good):.2%} (median) and {max(good):.1%} at most.\n"
    )


def peers_table():
    kept_rows = kept("peers.json")["rows"]
    lines = [
        "| tool | settings | its CPU s | its error | our CPU s | our rtol | its CPU time / ours "
        "| its wall time / our solver's |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for tool in dict.fromkeys(row["tool"] for row in kept_rows):
        rows = [row for row in kept_rows if row["tool"] == tool]
        if not any("seconds" in row for row in rows):
            lines.append(f"| {tool} | {rows[0]['reason']} | | | | | | |")
            continue
        cells = [tool, rows[0]["settings"]]
        for key, digits in (
            ("seconds", 2), ("error", 1), ("our_seconds", 2), ("our_rtol", 2),
            ("ratio", 2), ("kernel_wall_ratio", 2),
        ):  # fmt: skip
            cells.append(of_scenes(rows, key, digits))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def sweeps_table():
    """The lines are there once `make peers` has measured them."""
    head = ["program", "total time, s", "ms per further job", "CPU ms per further job",
            "error of peak acceleration: median", "largest", "of peak force: median", "largest",
            "script's total time / ours", "time of a further job / ours",
            "CPU time of a further job / ours"]  # fmt: skip
    keys = ["seconds", "ms_a_job", "cpu_ms_a_job", "peak_acceleration_error",
            "worst_peak_acceleration_error", "peak_contact_force_error",
            "worst_peak_contact_force_error", "ratio", "ratio_a_job",
            "cpu_ratio_a_job"]  # fmt: skip
    rows = [
        [row["way"], row.get("reason") or cell(row["seconds"])]
        + [cell(row.get(key)) for key in keys[1:]]
        for row in kept("peers.json").get("sweeps", [])
    ]
    return markdown(head, rows)


def cell(value, form="{:.2g}"):
    """A number of a kept measurement; a dash where there is none."""
    return "—" if value is None else form.format(value)


def change(value):
    """A relative change in per cent."""
    return cell(value and 100 * value, "{:+z.1f} %")


def milliseconds(seconds):
    """A time, to three digits below a second."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 0.9995 else f"{1e3 * seconds:.0f} ms"


def spoken(scene):
    """A label of a case as the README says it."""
    return scene.replace("_", " ") + " mm"


def by_scene(rows, scenes, key, make):
    """A table row a value of `key`, a column a scene, each cell made from its row."""
    for value in dict.fromkeys(row[key] for row in rows):
        found = {row["scene"]: make(row) for row in rows if row[key] == value}
        yield value, " | ".join(found.get(scene, "—") for scene in scenes)


def fastest_table():
    measured = kept("tradeoff.json")
    scenes = [*dict.fromkeys(row["scene"] for row in measured["points"])]
    head = " | ".join(spoken(scene) for scene in scenes)
    lines = [f"| error of acceleration below | {head} |", "|---" * (len(scenes) + 1) + "|"]
    rows = sorted(measured["fastest"], key=lambda row: -row["error_below"])
    for decade, cells in by_scene(
        rows, scenes, "error_below",
        lambda row: f"{row['method']}, {milliseconds(row['seconds'])} (rtol {row['rtol']:g})",
    ):  # fmt: skip
        lines.append(f"| {decade:.0e} | {cells} |")
    return "\n".join(lines) + "\n"


def modelling_table():
    measured = kept("tradeoff.json")
    scenes = [*dict.fromkeys(row["scene"] for row in measured["points"])]
    head = " | ".join(spoken(scene) for scene in scenes)
    lines = [f"| change of the model | {head} |", "|---" * (len(scenes) + 1) + "|"]

    def effect(row):
        if row["note"].startswith("failed"):
            return row["note"].partition(": ")[2]
        ratio = cell(row["time_ratio"], "×{:.2g}")
        return (
            f"{change(row['change_peak_acceleration'])}, "
            f"{change(row['change_peak_contact_force'])}, {ratio}"
        )

    for name, cells in by_scene(measured["changes"], scenes, "change", effect):
        lines.append(f"| {name} | {cells} |")
    return "\n".join(lines) + "\n"


def throughput_table():
    found = kept("throughput.json")
    start, sweep = found["start"], found["sweep"]
    lines = ["| whole process, code compiled before | seconds |", "|---|---|"]
    lines += [f"| {name} | {seconds:.2g} |" for name, seconds in start.items()]
    lines += [
        "",
        f"{sweep['jobs']:,} big-end jobs without time series or error bars on "
        f"{sweep['workers']} workers: {sweep['wall_s']:.0f} s, {sweep['jobs_per_s']:.0f} jobs a "
        f"second. Of the cores' time {100 * sweep['kernel_share']:.0f} % is inside the kernel, "
        f"{100 * sweep['other_share']:.0f} % elsewhere in the program, and "
        f"{100 * sweep['idle_share']:.0f} % idle; the kernel by itself would do "
        f"{sweep['alone_jobs_per_s']:.0f} jobs a second on as many cores. "
        f"The same command again takes {sweep['again_s']:.1f} s.",
        "",
        f"| quantity | now | commit {found['before']} | then / now |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {one['now']:.3g} | {one['before']:.3g} | {one['times as fast']:.2f} |"
        for name, one in found["compared"].items()
    ]
    return "\n".join(lines) + "\n"


def scale_table():
    found = kept("scale.json")
    lines = ["| whole process | seconds | peak memory, MB |", "|---|---|---|"]
    lines += [
        f"| {name} | {one['seconds']:.2g} | {one['peak_MB']} |"
        for name, one in found["processes"].items()
    ]
    sizes = " and ".join(f"{size / 1e6:.0f} MB" for size in found["bytes"].values())
    lines += ["", f"{found['jobs']:,} jobs; their metrics are {sizes} of CSV and netCDF."]
    return "\n".join(lines) + "\n"


def page_table():
    found = kept("page.json")
    lines = [
        "| report of | written in, s | written again, s | page, MB | data of figures, MB | CSV, MB "
        "| PNG and SVG, MB | opens in, s | first figure live after, s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, one in found["stores"].items():
        sizes = (one[f"{kind}_bytes"] / 1e6 for kind in ("page", "data", "csv", "picture"))
        opens = ("–" if one[of] is None else f"{one[of]:.2f}"
                 for of in ("open_seconds", "first_figure_seconds"))  # fmt: skip
        cells = (f"{one['write_seconds']:.1f}", f"{one['rewrite_seconds']:.1f}",
                 *(f"{size:.2f}" for size in sizes), *opens)  # fmt: skip
        lines.append(f"| {name}, {one['figures']} figures | {' | '.join(cells)} |")
    library = {one["library_bytes"] for one in found["stores"].values()}
    (size,) = library
    lines += ["", f"Beside each page lies plotly.js, {size / 1e6:.1f} MB, loaded with the figures."]
    return "\n".join(lines) + "\n"


MILLION = 10**6


def million_table():
    """What a million jobs take, from the measured costs of one."""
    sweep, stored = kept("throughput.json")["sweep"], kept("store.json")
    rows = stored["rows"]
    core_s = sweep["workers"] / sweep["jobs_per_s"]
    segments = rows["segments"] * MILLION // rows["jobs"]
    lines = [
        "| stored per job | GB | files | hours on 2 cores | minutes on 8 nodes of 32 cores |",
        "|---|---|---|---|---|",
    ]
    none = {"bytes": 0, "write_ms": 0.0}
    for series in (None, *stored["series"]):
        size, wait = (series or none)["bytes"], (series or none)["write_ms"] / 1e3
        words = "metrics"
        if series:
            words = f"series, {series['precision']}" + (", gzip" if series["compress"] else "")
        total = (size + rows["bytes_a_job"]) * MILLION / 1e9
        files = segments + (MILLION if series else 0)
        hours = MILLION * (core_s + wait) / 3600
        lines.append(
            f"| {words} | {total:.3g} | {files:,} | {hours / 2:.2g} | {60 * hours / 256:.2g} |"
        )
    scale = kept("scale.json")
    expanding = scale["processes"]["run, nothing missing"]["seconds"] * MILLION / scale["jobs"]
    lines += [
        "",
        f"Behind it: {1e3 * core_s:.1f} ms of a core a job (big end, no error bars), the time to "
        f"write its file, {rows['bytes_a_job']} bytes a row. Reading a case file of a million jobs "
        f"and looking up which are stored takes each run some {expanding:.0f} s more.",
    ]
    return "\n".join(lines) + "\n"


def sweep_table():
    found = kept("sweep.json")
    lines = [
        "| killed after | SIGKILL of | jobs reported as done | jobs stored |",
        "|---|---|---|---|",
    ]
    for kill in found["kills"]:
        of = "parent and workers" if kill["of"] == "all" else "parent"
        lines.append(f"| {kill['after_s']:.0f} s | {of} | {kill['told']:,} | {kill['stored']:,} |")
    peaks = found["peak_MB"]
    lines += [
        "",
        f"{found['jobs']:,} big-end jobs without time series or error bars on {found['workers']} "
        f"workers: {found['wall_s']:.0f} s undisturbed, {found['jobs_per_s']:.0f} jobs a second; "
        f"{found['last_run_s']:.0f} s for what was left after the last kill. The resumed store is "
        f"complete and equals the undisturbed one to the bit, timings apart: "
        f"{found['bytes'] / found['jobs']:.0f} bytes a job, {found['bytes'] / 1e6:.1f} MB in "
        f"{found['files']} files; `open_study` takes {found['open_study_s']:.2g} s. Resident "
        f"memory peaks at {peaks['parent']} MB in the parent, {peaks['worker']} MB in a worker.",
    ]
    return "\n".join(lines) + "\n"


def ladders_table():
    rows = kept("ladders.json")["ladder"]
    scenes = [*dict.fromkeys(row["scene"] for row in rows)]
    names = [scene.replace("_", " ") for scene in scenes]
    head = ["rtol", *(f"{what}, {name}" for what in ("error", "energy residual") for name in names)]
    lines = []
    for rtol in dict.fromkeys(row["rtol"] for row in rows):
        rung = {row["scene"]: row for row in rows if row["rtol"] == rtol}
        lines.append([f"{rtol:.0e}"] + [
            f"{rung[scene][name]:.1e}"
            for name in ("error_acceleration", "energy_residual") for scene in scenes
        ])  # fmt: skip
    return markdown(head, lines)


def limit_table():
    measured = kept("ladders.json")
    head = ["joint", "slope", "slopes of single decades", "deviation / c at 1 mm", "at 1 nm",
            "largest energy residual / bound"]  # fmt: skip
    lines = []
    for scene, slope in measured["slopes"].items():
        rows = [row for row in measured["limit"] if row["scene"] == scene]
        ends = [f"{row['deviation'] / row['clearance']:.3g}" for row in (rows[0], rows[-1])]
        decades = f"{slope['least']:.3f} to {slope['greatest']:.3f}"
        worst = f"{max(row['residual'] for row in rows):.2g}"
        name = scene.replace("_", " ")
        lines.append([name, f"{slope['fitted']:.3f}", decades, *ends, worst])
    return markdown(head, lines)


def chaotic_table():
    head = ["case", "horizon", "distance before the horizon", "after it", "statistic",
            "means by the two methods", "difference"]  # fmt: skip
    lines = []
    for scene, row in kept("chaotic.json")["scenes"].items():
        (other,) = row["others"]
        first = [scene, f"{row['horizon_rev']:.2g} rev", f"{other['within']:.1e}",
                 f"{other['beyond']:.2g}"]  # fmt: skip
        for name, apart in other["standard_errors"].items():
            means = (row["means"][method][name] for method in (row["against"], other["method"]))
            text = ", ".join(f"{mean:.3g} ± {error:.1g}" for mean, error in means)
            lines.append([*first, name.replace("_", " "), text, f"{apart:.1f} s.e."])
            first = [""] * len(first)
        lines.append([*first, "distribution of peaks", "",
                      f"{other['peaks_distance']:.2f} (Kolmogorov-Smirnov)"])  # fmt: skip
    return markdown(head, lines)


def chaotic_cases_table():
    row = kept("chaotic.json")["random"]
    others = [f"{name} {number}" for name, number in row["regimes"].items() if name != "chaotic"]
    lines = [
        ["random cases", f"{row['drawn']}"],
        ["reported as chaotic", f"{row['regimes']['chaotic']}"],
        ["reported otherwise", ", ".join(others)],
        [f"chaotic cases solved again by {row['method']}", f"{row['judged']}"],
        *([f"their rms differs by at most {k} standard errors", f"{n}"]
          for k, n in row["within"].items()),
        ["standard error of the rms: median, 90 %, largest",
         ", ".join(f"{value:.2%}" for value in row["known"])],
        ["difference of the rms: median, 90 %, largest",
         ", ".join(f"{value:.2%}" for value in row["relative"])],
        ["horizon in revolutions: median, 90 %, largest",
         ", ".join(f"{value:.2g}" for value in row["horizon_rev"])],
        ["revolutions needed for an rms within 1 %: median, 90 %, largest",
         ", ".join(f"{value:.0f}" for value in row["more"])],
        [f"the first {len(row['scipy']['apart'])} against SciPy's {row['scipy']['method']}: "
         "difference in standard errors",
         ", ".join(f"{value:.1f}" for value in row["scipy"]["apart"])],
    ]  # fmt: skip
    return markdown(["quantity", "value"], lines)


def joint_name(joint):
    """A joint as a sentence has it."""
    return joint.replace("_", " ")


def diagnosis_table():
    found = kept("diagnosis.json")
    joints = found["joints"]
    head = ["added noise, m/s²", "accuracy", "balanced accuracy",
            *(f"recall: {joint_name(joint)}" for joint in joints), "missed faults", "false alarms",
            "accuracy without the level feature",
            "accuracy if trained without noise"]  # fmt: skip
    rows = []
    for level in found["levels"]:
        row = level["classifier"]
        shares = [row["balanced_accuracy"], *row["recall"].values()]
        shares += [row[n] for n in ("missed", "false_alarms", "without_level")]
        rows.append([
            f"{level['noise']:g}", f"{row['accuracy']:.1%} ± {row['standard_error']:.1%}",
            *(f"{share:.1%}" for share in [*shares, row["trained_without_noise"]]),
        ])  # fmt: skip
    return markdown(head, rows) + "\n" + " ".join(diagnosis_sentences(found)) + "\n"


def confused_pairs(pairs):
    """Which joint is taken for which, in words."""
    words = [f"{joint_name(p['joint'])} as {joint_name(p['told'])} {p['share']:.0%}" for p in pairs]
    return ", ".join(words) or "none"


def diagnosis_sentences(found):
    """What follows from the scores, with the numbers that it follows from."""
    first, last = found["levels"][0], found["levels"][-1]
    machines, left = found["machines"], sum(found["left_out"].values())
    dummy = first["classifier"]["most_frequent"]
    yield (
        f"{found['jobs'] - left:,} machines, {left or 'none'} left out: {machines['train']:,} to "
        f"train on, {machines['test']:,} to test on, with {found['windows']['test']:,} windows. "
        f"Always naming the most frequent joint would be right in {dummy:.1%}."
    )
    told = [confused_pairs(level["classifier"]["confused"]) for level in (first, last)]
    yield (
        f"Confused in more than {found['confused_from']:.0%} of the windows without added noise: "
        f"{told[0]}; with {last['noise']:g} m/s² of it: {told[1]}."
    )
    second = found["levels"][1]
    yield (
        f"A forest that saw no noise in training falls from "
        f"{first['classifier']['trained_without_noise']:.1%} to "
        f"{second['classifier']['trained_without_noise']:.1%} at {second['noise']:g} m/s²: train "
        "with noise."
        if second["classifier"]["trained_without_noise"] < second["classifier"]["accuracy"] - 0.1
        else "Training without noise costs less than 10 points at the first level of it."
    )
    rms = ", ".join(f"{joint_name(j)} {row[1]:.2g} m/s²" for j, row in found["rms"].items())
    yield f"The median rms of the windows is: {rms}."


def confusion_table():
    found = kept("diagnosis.json")
    joints, levels = found["joints"], found["levels"]
    head = ["added noise, m/s²", "true joint",
            *(f"predicted: {joint_name(joint)}" for joint in joints)]  # fmt: skip
    rows = []
    for level in (levels[0], levels[len(levels) // 2], levels[-1]):
        first = f"{level['noise']:g}"
        for joint, counts in zip(joints, level["classifier"]["confusion"], strict=True):
            rows.append([first, joint_name(joint), *map(str, counts)])
            first = ""
    return markdown(head, rows)


def clearance_bins_table():
    found = kept("diagnosis.json")
    bins = found["levels"][0]["classifier"]["bins"]
    names = ["{:g} to {:g} mm".format(*one["clearance_mm"]) for one in bins]
    head = ["added noise, m/s²", *(f"{name}: correct joint, missed" for name in names)]
    rows = [
        [f"{level['noise']:g}"]
        + [f"{one['accuracy']:.1%}, {one['missed']:.1%}" for one in level["classifier"]["bins"]]
        for level in found["levels"]
    ]
    text = ", ".join(f"{one['windows']}" for one in bins)
    return markdown(head, rows) + f"\nWindows of test machines: {text}.\n"


def clearance_table():
    found = kept("diagnosis.json")
    ends = [(end, joint) for end, row in found["levels"][0]["regressor"].items() for joint in row]
    names = [
        f"{joint_name(end)}{' alone' if joint == end else ', both worn'}" for end, joint in ends
    ]
    rows = []
    for level in found["levels"]:
        scores = [level["regressor"][end][joint] for end, joint in ends]
        rows.append([f"{level['noise']:g}"] + [
            f"{one['median_error']:.0%}, {one['error_90']:.0%}, {one['r2_log']:.2f}"
            for one in scores
        ])  # fmt: skip
    dummy = [found["levels"][0]["regressor"][e][j]["median_error_of_the_median"] for e, j in ends]
    rows.append(["always predicting the median", *(f"{value:.0%}" for value in dummy)])
    return markdown(["added noise, m/s²", *names], rows)


def share_cell(found):
    """A share with its 95 % interval."""
    if not found["of"]:
        return "–"
    return f"{found['share']:.1%} [{found['low']:.0%}, {found['high']:.0%}]"


def identify_table():
    head = ["friction law of the records", "correct joint", "correct joint, worn machines",
            "clearance inside its 90 % interval, joint correct",
            "clearance inside its 90 % interval, all worn machines",
            "upper / lower end of the interval", "false alarms", "missed faults",
            "reported as unlike the study",
            "reported as unlike the study, worn machines"]  # fmt: skip
    names = ("right", "right_where_worn", "covered", "covered_all", "factor", "false_alarms",
             "missed", "nothing_fits", "nothing_fits_where_worn")  # fmt: skip
    rows = []
    for model, row in kept("identify.json")["models"].items():
        cells = [
            f"{row[name][1]:.1f}" if name == "factor" else share_cell(row[name]) for name in names
        ]
        rows.append([model, *cells])
    return markdown_columns(head, rows)


def calibrate_table():
    measured = kept("calibrate.json")
    head = ["machine differs from the model by", "key", "true value inside its 95 % interval",
            "error of the best value, % of the range", "width of the interval, % of the range",
            "reported as not fitting"]  # fmt: skip
    rows = []
    for other, row in measured["others"].items():
        for key, one in row["keys"].items():
            low, high = one["inside_95"]
            rows.append([
                other, f"`{key}`",
                f"{one['inside']} of {row['machines']} [{low:.0%}, {high:.0%}]",
                f"{one['off']:.1%}", f"{one['width']:.0%}", f"{row['said_not_to_fit']}",
            ])  # fmt: skip
    return markdown(head, rows)


def alarms_table():
    found = kept("alarms.json")
    head = ["worn joint", "alarm, with its best filter", "false alarms",
            "trips in, by clearance in mm", "detects from, mm",
            f"limits for {found['looser']:.0%}",
            *(f"with noise of {noise:g} m/s²" for noise in alarm_noise(found)[1:]),
            "hours before the limit"]  # fmt: skip
    rows = []
    for row in found["rows"]:
        if row["noise"]:
            continue
        trips = ", ".join(
            f"{share:.0%} at {clearance:g}"
            for clearance, share in zip(row["clearances"], row["detection"], strict=True)
        )
        is_body = row["alarm"] == "velocity of the body"  # a stored metric, without the noise
        others = [
            "–" if is_body and other.get("noise") else f"{alarm_first(other)}, {other['filter']}"
            for other in found["at_looser"] + [one for one in found["rows"] if one["noise"]]
            if all(other[n] == row[n] for n in ("joint", "alarm"))
        ]
        hours = "–"
        if row["lead_hours"] is not None:
            hours = "{lead_hours:g} [{lead_hours_low:g}, {lead_hours_high:g}]".format_map(row)
        rows.append([
            joint_name(row["joint"]), f"{row['alarm']}, {row['filter']}",
            alarm_false(row), trips, alarm_first(row), *others, hours,
        ])  # fmt: skip
    return markdown(head, rows) + "\n" + " ".join(alarm_sentences(found)) + "\n"


def alarm_noise(found):
    """The levels of added noise, m/s2."""
    return sorted({row["noise"] for row in found["rows"]})


def alarm_first(row):
    """The clearance from which on an alarm detects, with its interval."""
    if row["first_low"] is None:
        return "never"
    most = row["clearances"][-1]
    ends = [f"> {most:g}" if end is None else f"{end:g}" for end in (row["first_low"],
                                                                  row["first_high"])]  # fmt: skip
    first = "never" if row["first"] is None else f"{row['first']:g}"
    return f"{first} [{', '.join(ends)}]"


def alarm_false(row):
    """The rate of false alarms that was counted, with its interval."""
    shares = [f"{100 * row[f'false_alarms{end}']:.2g}" for end in ("", "_low", "_high")]
    return "{} % [{}, {}]".format(*shares)


def alarm_sentences(found):
    """What follows from the rates, with the numbers that it follows from."""
    for joint in ("small_end", "big_end"):
        rows = [r for r in found["rows"] if r["joint"] == joint and not r["noise"]]
        best, name = rows[0], joint_name(joint)
        alike = [row for row in rows if row["first"] is not None and row["first"] == best["first"]]
        never = [row["alarm"] for row in rows if row["first"] is None]
        if best["first"] is None:
            yield f"No alarm detects wear of the {name} within {best['clearances'][-1]:g} mm."
            continue
        if len(alike) > 1:
            kinds = ", ".join(row["alarm"] for row in alike)
            yield (f"{len(alike)} of {len(rows)} kinds of alarm detect wear of the {name} from "
                   f"{best['first']:g} mm on: {kinds}.")  # fmt: skip
        else:
            yield (f"Wear of the {name} is seen first by {best['alarm']} ({best['filter']}), from "
                   f"{alarm_first(best)} mm on.")  # fmt: skip
        place = best["clearances"].index(best["first"]) - 1
        if place >= 0:
            yield alarm_below(alike, place, name)
        yield f"Never within {best['clearances'][-1]:g} mm: {', '.join(never) or 'none'}."
    most = max(row["false_alarms"] for row in found["rows"])
    sure = max(row["false_alarms_high"] for row in found["rows"])
    draws = found["sound_draws"]
    yield (f"Of false alarms, {found['attainable']:.0%} was asked for and at most {most:.1%} were "
           f"counted, which of {draws} draws says no more than below {sure:.1%}.")  # fmt: skip
    peaks = found["peaks"]
    small = peaks["clearances"]["small_end"], peaks["worn"]["small_end"]
    worn = ", ".join(f"{peak:g} at {one:g} mm" for one, peak in zip(*small, strict=True))
    yield (f"The median peak of the record is {peaks['sound']:g} m/s² of a sound machine, and of a "
           f"worn small end {worn}.")  # fmt: skip
    first, second = peaks["greatest"]
    yield (f"The two loudest sound draws peak at {first:g} and {second:g} times that of a sound "
           "machine. Worn draws are judged by the limit that all sound draws set. Intervals are "
           "for limits as they were set, without their scatter.")  # fmt: skip
    loose = [
        next(r for r in found["at_looser"] if r["joint"] == joint)
        for joint in ("small_end", "big_end")
    ]
    parts = [f"the {joint_name(r['joint'])} is seen first by {r['alarm']} ({r['filter']}), from "
             f"{alarm_first(r)} mm on" for r in loose]  # fmt: skip
    strict = [next(r for r in found["rows"] if r["joint"] == one["joint"]) for one in loose]
    names = [r["alarm"] for r in loose], [r["alarm"] for r in strict]
    verdict = "which alarm is first depends on that rate" if names[0] != names[1] else "the same"
    yield f"With limits for {found['looser']:.0%}, {', and '.join(parts)}: {verdict}."
    wear = found["wear"]
    worn_out = max(wear["clearances"], key=wear["clearances"].get)
    other = next(joint for joint in wear["clearances"] if joint != worn_out)
    leads = [r for r in found["rows"] if not r["noise"] and r["lead_hours"]]
    said = "; ".join(
        "{}, {}, by {lead_hours:g} h [{lead_hours_low:g}, {lead_hours_high:g}]".format(
            joint_name(r["joint"]), r["alarm"], **r
        )
        for r in leads
    )
    yield (f"In the wear run the {joint_name(worn_out)} reaches {wear['limit_mm']:g} mm after "
           f"{wear['end']:g} h, when the {joint_name(other)} has {wear['clearances'][other]:g} mm. "
           f"Alarms that trip before: {said or 'none'}.")  # fmt: skip


def alarm_below(alike, place, name):
    """How often the first alarms trip one clearance earlier, and whether that tells them apart."""
    shares = [row["detection"][place] for row in alike]
    ends = (
        max(r["detection_low"][place] for r in alike),
        min(r["detection_high"][place] for r in alike),
    )
    clearance = alike[0]["clearances"][place]
    if len(alike) == 1:
        low, high = alike[0]["detection_low"][place], alike[0]["detection_high"][place]
        return (f"At {clearance:g} mm it trips in {shares[0]:.0%} [{low:.0%}, {high:.0%}] of "
                "windows.")  # fmt: skip
    apart = (
        "no farther apart than their intervals: which of them is first is not known"
        if ends[0] <= ends[1]
        else "farther apart than their intervals"
    )
    return (f"At {clearance:g} mm they trip in {min(shares):.0%} to {max(shares):.0%} of windows, "
            f"{apart}.")  # fmt: skip


def stress_table():
    found = kept("stress.json")
    ends = found["ends"]
    names = sorted(
        set(ends["supported"]) | set(ends["whole"]), key=lambda name: (name != "ok", name)
    )
    if "silent_wrong" not in names:
        names.insert(1, "silent_wrong")
    rows = [[f"`{name}`", *(str(ends[kind].get(name, 0)) for kind in ends)] for name in names]
    totals = {kind: sum(ends[kind].values()) for kind in ends}
    shares = [f"{ends[kind].get('ok', 0) / totals[kind]:.1%}" for kind in ends]
    text = markdown(
        ["outcome", "supported range", "whole range"], [*rows, ["share of `ok`", *shares]]
    )
    return text + (
        f"\n{found['scenes']:,} cases took {found['work_s'] / 60:.0f} minutes of workers' time, "
        f"{found['workers']} at a time. Results that were wrong without a warning: "
        f"{found['silent_wrong']}"
        + ("" if found["silent_wrong"] else f" (at most {found['at_most']:.2%}, 95 % confidence)")
        + f". Of the confirmed ones, {found['unforeseeable']} cannot be foretold to their end.\n"
        + "".join(map(fresh_scenes, found["fresh"]))
    )


DRAWN = {"": "other cases", "laws": "cases with other laws", "features": "cases with features"}


def fresh_scenes(one):
    """What became of scenes of a kind: how many were wrong in silence, and how all ended."""
    ends = Counter()
    for name, count in one["ends"].items():  # of an earlier program by range
        ends.update(count if isinstance(count, dict) else {name: count})
    wrong = ", ".join(f"{row['worst_metric']} {amiss(row)}" for row in one["silent_wrong"])
    named = ", ".join(f"`{name}` {count}" for name, count in ends.most_common())
    return (
        f"\n**Of {one['scenes']:,} {DRAWN[one['drawn']]}**, {len(one['silent_wrong']) or 'none'} "
        f"wrong without a warning{f': {wrong}' if wrong else ''}. {named}.\n"
    )


def amiss(row):
    """How far a number that is wrong in silence is off; beyond the horizon, of statistics."""
    if row["error"] is None:
        return f"statistics, {row['excess_beyond']:.2g} times the allowed difference"
    return f"error {row['error']:.1e}, error bar {row['bar']:.1e}"


def silent(found):
    """How many fresh scenes were wrong in silence."""
    return sum(len(one["silent_wrong"]) for one in found)


def worst_table():
    rows = [
        [row["verdict"], row["worst_metric"], cell(row["excess"])]
        + [cell(row[key], "{:.1e}") for key in ("error", "bar")]
        + [row["judges"] if isinstance(row["judges"], str) else " ".join(row["judges"])]
        for row in kept("stress.json")["worst"]
    ]
    head = ["verdict", "metric", "error / allowed error", "error", "error bar", "judges"]
    return markdown(head, rows)


def chaos_table():
    """What was tried, how often, and what did not survive; 0 of N has its 95 % bound, 3/N."""
    head = ["fault", "trials", "failed", "failure rate with 95 % confidence below"]
    rows = []
    for found in kept("chaos.json")["campaigns"].values():
        if "skipped" in found:
            continue
        bound = "" if found["failed"] else f"{300 / found['trials']:.2g} %"
        rows.append([found["what"], f"{found['trials']:,}", str(found["failed"]), bound])
    return markdown(head, rows)


def mutants_table():
    rows = kept("mutants.json")["mutants"]
    lines = ["| kind of bug | bugs | change no result | caught "
             "| of these with the compiler off | not caught |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    for name, group in [*((kind, {kind}) for kind in kinds), ("all drawn", {*kinds[1:]})]:
        some = [row for row in rows if row["kind"] in group]
        same = sum("equivalent" in row for row in some)
        caught = [row for row in some if row["caught_by"]]
        quick = sum(not row["jit"] for row in caught)
        lines.append(
            f"| {name} | {len(some)} | {same} | {len(caught)} | {quick} "
            f"| {len(some) - same - len(caught)} |"
        )
    lines.append("")
    for row in rows:
        if not row["caught_by"]:
            lines.append(f"- `{row['mutant']}`: {row.get('equivalent', '**not caught**')}")
    return "\n".join(lines) + "\n"


def span(values, digits=2):
    """The least and the greatest of some numbers, such as "19 to 24"."""
    texts = [f"{float(f'{value:.{digits}g}'):g}" for value in (min(values), max(values))]
    return texts[0] if texts[0] == texts[1] else " to ".join(texts)


def numbers_list():
    """The five lines of README.md: accuracy, error bars, speed, extremes, diagnosis."""
    accuracy, stress = kept("accuracy.json"), kept("stress.json")
    word, fresh = accuracy["words"]["standard"], stress["fresh"]
    broken = f"all but {word['broken']}" if word["broken"] else "all"
    ratio, cpu = peer_ratios()
    models = kept("identify.json")["models"]
    own, *others = (row["right_where_worn"]["share"] for row in models.values())
    lines = [
        f"**Accuracy.** The default promises an error of the acceleration below "
        f"{word['promise']:.1%} (rms), and each run checks it. In {word['kept']:,} of "
        f"{accuracy['random']['cases']:,} random cases the check passed, and {broken} of these "
        f"were as exact as that.",
        f"**Error bars.** {within_bars():.1%} of the true errors of metrics were within their "
        "bars.",
        f"**Speed.** A run of four revolutions without error bars takes {cpu} ms of CPU time. "
        f"Exudyn takes {ratio['Exudyn DOPRI5, symbolic functions']} times as long, with "
        "no smaller error.",
        f"**Extremes.** {stress['scenes']:,} extreme cases gave {stress['silent_wrong'] or 'no'} "
        f"wrong number without a warning; {sum(one['scenes'] for one in fresh):,} fresh ones gave "
        f"{silent(fresh) or 'none'}.",
        f"**Diagnosis.** By a simulated sensor, the worn joint is named right in {own:.0%} of the "
        f"records. If friction follows another law than the study assumes, in {min(others):.0%} to "
        f"{max(others):.0%}.",
    ]
    return "".join(f"- {line}\n" for line in lines)


def peer_ratios():
    """Of each other tool how many times our CPU time it takes; and our CPU time, ms."""
    rows = kept("peers.json")["rows"]
    exudyn = [row for row in rows if row["tool"] == "Exudyn DOPRI5, symbolic functions"]
    ratio = {
        row["tool"]: span([one["ratio"] for one in rows if one["tool"] == row["tool"]])
        for row in rows
    }
    return ratio, span([1e3 * row["our_seconds"] for row in exudyn])


def within_bars():
    """The share of the true errors of random cases at `standard` that are within their bars."""
    bars = kept("accuracy.json")["bars"]["standard"].values()
    return sum(bar["within"] * bar["of"] for bar in bars) / sum(bar["of"] for bar in bars)


def extremes_words():
    """How often extreme cases end with a result, and how often with a wrong one."""
    stress = kept("stress.json")
    range_, fresh = stress["ends"]["supported"], stress["fresh"]
    unjudged = sum(ends.get("unjudged", 0) for ends in stress["ends"].values())
    wrong = stress["silent_wrong"]
    return (
        f"Of {stress['scenes']:,} extreme cases half lie inside the supported range; "
        f"{range_['ok'] / sum(range_.values()):.1%} of that half ran to a result, and the others "
        f"failed with a named reason. {wrong or 'None'} of the {stress['scenes']:,} gave a wrong "
        f"number without a warning; of {unjudged} no other integrator could say. Of "
        f"{sum(one['scenes'] for one in fresh):,} fresh cases, drawn afterwards, some of them with "
        f"other laws, oil or an elastic rod, {silent(fresh) or 'none'} did.\n"
    )


def paper_words():
    """How many of the paper's claims hold, at which machines."""
    plane = kept("claims.json")["map"]
    return (
        f"At our default masses {held_by_default()} of the eight hold. Of {plane['judged']:,} "
        f"machines with other masses, all eight hold in {plane['all'] or 'none'}, and all but "
        f"claim 7 in {plane['but_7']}. In the machine of `compsim init agreeing` all eight hold, "
        f"each by more than its error.\n"
    )


def choose_table():
    """Six rows: what for, what to choose, and what it gives and costs."""
    words = kept("accuracy.json")["words"]
    draft, bare = words["draft"], words["draft"]["cost"]["median"]

    def row(what, choose, word, seconds=None):
        return [
            what,
            choose,
            f"{word['error'][0]:.0e}",
            milliseconds(seconds or word["seconds"][0]),
        ]

    rows = [
        row("a first look, a map of many jobs", "`accuracy: draft`", draft),
        row("a number to report", "nothing: `standard` is the default", words["standard"]),
        row("a small difference between two machines", "`accuracy: fine`", words["fine"]),
        row("to judge another program, or this one", "`accuracy: reference`", words["reference"]),
        row("the fastest sweep, if a few wrong jobs do no harm",
            "`accuracy: draft, error_bars: false`, with `output: {keep: metrics}`", draft,
            draft["seconds"][0] / bare),
        ["one metric to a given error", "`accuracy: {peak_contact_force: 0.01}`", "as asked",
         "as it takes"],
    ]  # fmt: skip
    return markdown(["you want", "choose, in `solve`", "error", "time of a run"], rows)


def parameter_tables():
    """The table of parameters in parts, a heading each: the keys of a case, then its groups."""
    rows = {}
    for row in table().values():
        group, dot, _ = row.key.partition(".")
        alone = not dot or group in ("clearance_mm", "healthy_clearance_mm", "initial_offset_mm")
        rows.setdefault("Load and joints" if alone else group, []).append(row)
    return "\n".join(f"### {group}\n\n{parameter_table(of)}\n" for group, of in rows.items())


def identify_words():
    """How often a worn joint is named right, by a record of the study's law and of others."""
    models = kept("identify.json")["models"]
    own, *others = ({k: v["share"] for k, v in row.items() if isinstance(v, dict) and "share" in v}
                    for row in models.values())  # fmt: skip
    right, warned = (
        [other[name] for other in others]
        for name in ("right_where_worn", "nothing_fits_where_worn")
    )
    plain = kept("diagnosis.json")["levels"][0]["classifier"]["accuracy"]
    return (
        f"- `compsim identify` names the worn joint in {own['right_where_worn']:.0%} of the "
        f"records of simulated machines like those of its study, and {own['covered']:.0%} of the "
        f"clearances lie in their 90% interval.\n"
        f"- If the machine has another friction law, it names the worn joint in {min(right):.0%} "
        f"to {max(right):.0%} of the records, and warns that nothing fits in {min(warned):.0%} to "
        f"{max(warned):.0%} of them.\n"
        f"- A plain classifier that was trained on other machines of the same model is right in "
        f"{plain:.0%} of the windows, without added noise.\n"
    )


def nameplate_films():
    """Rows of the file of `compsim init machine` by the share in which the film gets no thinner."""
    found = kept("nameplate.json")
    return {0.02: found["rows"]} | {one["last_share"]: one["rows"] for one in found["films"]}


def nameplate_table():
    """What the case file of `compsim init machine` gives over the small end's clearance."""
    films = nameplate_films()
    rows = []
    for each in zip(*films.values(), strict=True):
        row = each[0]
        assert len({one["clearance_mm"] for one in each}) == 1
        rows.append([
            f"{row['clearance_mm']:g}",
            " / ".join(peak_or_none(one["peak_contact_force"], 1e3) for one in each),
            " / ".join(f"{one['impacts_per_rev']:.3g}" for one in each),
            " / ".join(f"{one['sensor_rms']:.2g}" for one in each),
            f"{math.degrees(row['rod_load_reversal_angle']):.0f}",
            f"{1e3 * row['body_velocity_rms']:.2f}",
        ])  # fmt: skip
    shares = " / ".join(f"{share:g}" for share in films)
    head = ["small end, mm", f"peak force on it, kN, at `last_share` {shares}",
            "dry contacts a revolution", "sensor, m/s² rms", "rod load reversal, °",
            "body along x, mm/s rms"]  # fmt: skip
    return markdown(head, rows)


def peak_or_none(value, unit):
    """A peak to three digits, – where the motion has none that means anything."""
    return f"{value / unit:.3g}" if value is not None and math.isfinite(value) else "–"


def film_words():
    """How far the assumed share moves the answer: the spread of forces and of the sensor."""
    every = [*zip(*nameplate_films().values(), strict=True)]

    def spread(name):
        ratios = [max(one[name] for one in each) / min(one[name] for one in each) for each in every]
        return max(ratios), every[ratios.index(max(ratios))][0]["clearance_mm"]

    (force, at), (sensor, loudest) = spread("peak_contact_force"), spread("sensor_rms")
    return (
        f"Between the three shares the peak force differs by {100 * (force - 1):.2g} % at most (at "
        f"{at:g} mm), and the sensor's rms by a factor of {sensor:.2g} (at {loudest:g} mm).\n"
    )


def deciding_table():
    """What numbers that a plant can only guess make of the machine, a row each."""
    rows = {}
    for one in kept("nameplate.json")["decides"]:
        rows.setdefault(one["number"], []).append(one)

    def cell(each, size, metric, unit):
        return " / ".join(f"{one[size][metric] / unit:.3g}" for one in each)

    plain = rows[""][0]["0.24"]

    def moved(each):
        return max(abs(one["0.24"][name] / plain[name] - 1.0) for one in each for name in plain)

    ranked = sorted(rows.items(), key=lambda item: -moved(item[1]) if item[0] else -math.inf)
    listed = [
        [f"`{number}`" if number else "as in the file", " / ".join(one["value"] for one in each),
         *(cell(each, size, "peak_contact_force", 1e3) for size in ("0.24", "0.4")),
         cell(each, "0.24", "sensor_rms", 1.0), cell(each, "0.24", "body_velocity_rms", 1e-3)]
        for number, each in ranked
    ]  # fmt: skip
    head = ["number", "it may be", "force on the pin at 0.24 mm, kN", "at 0.4 mm",
            "sensor at 0.24 mm, m/s² rms", "body along x, mm/s rms"]  # fmt: skip
    return markdown(head, listed)


def oil_words():
    """What the film of oil makes of the force on a worn pin."""
    oils = kept("nameplate.json")["oils"]
    forces = {
        name: f"the peak force on it is {row['force'] / 1e3:.3g} kN" if row["force"] else
        "the motion is chaotic, and its peaks mean nothing"
        for name, row in oils.items()
    }  # fmt: skip
    return (
        f"With a clearance of 0.2 mm at the small end {forces['file']}. "
        f"Without oil {forces['dry']}.\n"
    )


def held_by_default():
    return sum(margin >= 0.0 for margin in kept("claims.json")["default"]["margin"])


def regimes_table():
    """One line for each run of values with the same regime and period, in each direction."""
    found = kept("regimes.json")
    runs = []
    for row in found["rows"]:
        period = f"period {row['period']:g}" if row["period"] else ""
        words = period if row["regime"] == "periodic" else row["regime"]
        if runs and (runs[-1]["direction"], runs[-1]["words"]) == (row["direction"], words):
            runs[-1]["rows"].append(row)
        else:
            runs.append({"direction": row["direction"], "words": words, "rows": [row]})
    lines = [
        [one["direction"], f"{one['rows'][0]['value']:.4g} to {one['rows'][-1]['value']:.4g}",
         str(len(one["rows"])), one["words"], span_of([r["points"] for r in one["rows"]], "g"),
         span_of([r["exponent"] for r in one["rows"]], ".2f"),
         span_of([r["error"] for r in one["rows"]], ".2g")]
        for one in runs
    ]  # fmt: skip
    head = ["direction", "clearance, mm", "values", "motion", "Poincaré points",
            "Lyapunov exponent, 1/rev", "its error"]  # fmt: skip
    apart = [f"{row['value']:.4g}" for row in found["differ"]]
    sure = [f"{row['value']:.4g}" for row in found["differ"] if row["confirmed"]]
    words = ("Up and down differ at (mm)", apart), ("Two motions are confirmed at (mm)", sure)
    ends = [f"{text}: {', '.join(values) or 'no value'}." for text, values in words]
    return markdown(head, lines) + "\n" + " ".join(ends) + "\n"


def span_of(values, form):
    known = [value for value in values if value is not None]
    if not known:
        return "–"
    low, high = (format(edge(known), form) for edge in (min, max))
    return low if low == high else f"{low} to {high}"


def runs_of(name):
    """Return when, how and of what each part of a campaign was measured, the newest first."""
    found = kept(f"{name}.json")
    parts = [found, *found.get("campaigns", {}).values(), *found.get("fresh", [])]
    return sorted((one for one in parts if "date" in one), key=lambda one: one["date"])[::-1]


def spans(runs):
    """Return the command, dates, commits and machines of a campaign as texts."""
    dates = sorted({one["date"] for one in runs})
    commits = dict.fromkeys(one.get("commit", "not recorded") for one in runs)
    machines = dict.fromkeys(one["machine"] for one in runs)
    command = runs[0]["command"].partition(",")[0]
    dates = " to ".join(dict.fromkeys((dates[0], dates[-1])))
    return command, dates, ", ".join(commits), "; ".join(machines)


def measured_words(name):
    """Return the result of a campaign, and what it was measured with."""
    runs = runs_of(name)
    command, dates, commit, machine = spans(runs)
    versions = ", ".join(f"{library} {number}" for library, number in runs[0]["versions"].items())
    return findings.result_words(name, kept) + (
        f"Measured by `{command}`, {dates}; commit: {commit}; {machine}, {versions}. "
        f"Numbers: [{name}.json]({name}.json).\n"
    )


def campaigns_table():
    rows = []
    for name, (question, _) in CAMPAIGNS.items():
        title = (RESULTS / f"{name}.md").read_text(encoding="utf-8").split("\n")[0].strip("# ")
        command, *others = spans(runs_of(name))
        rows.append([f"[{title}]({name}.md)", question, f"`{command}`", *others])
    return markdown(["campaign", "question", "command", "date", "commit", "machine"], rows)


def validation_summary():
    rows = kept("validation.json")["rows"]
    cells = []
    for subject in dict.fromkeys(row["subject"] for row in rows):
        some = [row for row in rows if row["subject"] == subject]
        worst = max(abs(row["found"] - row["expected"]) / row["within"] for row in some)
        sources = "; ".join(dict.fromkeys(row["source"] for row in some))
        cells.append([subject, str(len(some)), f"{worst:.2g}", sources])
    return markdown(["subject", "numbers", "largest difference / tolerance", "sources"], cells)


# a campaign, which has the page and the file of its name in tests/results: its question and its
# generated blocks; findings.FINDINGS are taken from them
CAMPAIGNS = {
    "validation": ("Are published numbers reproduced?",
                   {"validation-summary": validation_summary, "validation": validation_table}),
    "peers": ("How does it compare with other programs?",
              {"peers": peers_table, "sweeps": sweeps_table}),
    "accuracy": ("Are results as accurate as promised?",
                 {"accuracy": accuracy_table, "broken": broken_table, "bars": bars_table,
                  "trade": trade_table}),
    "calibration": ("How is the error estimated?", {"calibration": calibration_table}),
    "ladders": ("Does the error fall with the tolerance, and the motion become ideal?",
                {"ladders": ladders_table, "limit": limit_table}),
    "tradeoff": ("Which method is fastest, and what does a feature of the model change?",
                 {"fastest": fastest_table, "modelling": modelling_table}),
    "stress": ("What happens in extreme cases?",
               {"stress": stress_table, "worst": worst_table}),
    "chaotic": ("Can averages of chaotic motion be trusted?",
                {"chaotic-cases": chaotic_cases_table, "chaotic": chaotic_table}),
    "claims": ("Which of the paper's claims hold?",
               {"claims": claims_table, "machines": claims_words}),
    "regimes": ("How does the motion change with the clearance?",
                {"regimes": regimes_table}),
    "wear": ("How accurate are hours until a limit?", {"wear": wear_table}),
    "diagnosis": ("Does a classifier find the worn joint?",
                  {"diagnosis": diagnosis_table, "confusion": confusion_table,
                   "clearance-bins": clearance_bins_table, "clearances": clearance_table}),
    "alarms": ("Which alarm sees wear first?", {"alarms": alarms_table}),
    "identify": ("Does `compsim identify` find the worn joint?", {"identify": identify_table}),
    "calibrate": ("Does `compsim calibrate` find a machine's parameters?",
                  {"calibrate": calibrate_table}),
    "chaos": ("Do results survive kills, power cuts and damage?", {"chaos": chaos_table}),
    "mutants": ("Would the tests notice a bug?", {"mutants": mutants_table}),
    "sweep": ("Does an interrupted sweep lose a job?", {"sweep": sweep_table}),
    "throughput": ("How many jobs a second?", {"throughput": throughput_table}),
    "scale": ("What does a sweep of 100,000 or a million jobs take?",
              {"scale": scale_table, "million": million_table}),
    "store": ("How large and fast is the store?", {"store": store_table}),
    "page": ("How fast is the report?", {"page": page_table}),
    "nameplate": ("What does the case file of `compsim init machine` give?", {"oils": oil_words}),
}  # fmt: skip


# page -> its generated blocks by name
def reason_table():
    """The reasons of failures, what they mean and what to do."""
    lines = ["| reason | what it means | what to do |", "|---|---|---|"]
    lines += [f"| `{one}` | {one.meaning} | {one.remedy} |" for one in Reason]
    return "\n".join(lines) + "\n"


PAGES = {
    "README.md": {"numbers": numbers_list},
    "configs/README.md": {"parameters": parameter_tables},
    "compressor/docs/extremes.md": {"reasons": reason_table, "stress-words": extremes_words},
    "compressor/docs/diagnosis.md": {"identify-words": identify_words},
    "compressor/docs/my-machine.md": {
        "nameplate": nameplate_table,
        "films": film_words,
        "decides": deciding_table,
    },
    "compressor/docs/speed-or-accuracy.md": {"choose": choose_table},
    "compressor/docs/the-paper.md": {"paper": paper_words},
    "tests/results/README.md": {
        "findings": lambda: findings.findings_table(kept),
        "campaigns": campaigns_table,
    },
    **{
        f"tests/results/{name}.md": {"measured": partial(measured_words, name)} | blocks
        for name, (_, blocks) in CAMPAIGNS.items()
    },
}


def block(name):
    """Pattern of a generated block: its opening comment, the table, its closing comment."""
    return re.compile(rf"(<!-- {name}: [^>]*-->\n)(.*?)(<!-- end of {name} -->)", re.DOTALL)


def main():
    for page, blocks in PAGES.items():
        path = ROOT / page
        text = path.read_text(encoding="utf-8")
        for name, make in blocks.items():
            text, count = block(name).subn(lambda m, make=make: m[1] + make() + m[3], text)
            assert count == 1, f"{page} has no block for {name}"
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
