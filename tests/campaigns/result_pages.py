"""What campaigns keep: a JSON file, and the tables of the page beside it, written when it measures.

`keep` writes both and the lists of tests/results/README.md; `make pages` writes the pages again.
"""

import json
import platform
import subprocess
from collections import Counter
from datetime import date
from importlib import metadata
from itertools import groupby
from pathlib import Path
from statistics import median

from page_tables import (
    RESULTS,
    kept,
    markdown,
    milliseconds,
    silent,
    within_bars,
    write_blocks,
)


def read_commit():
    """Return the commit of the program that is measured, "" without git; whether files differ."""
    git = ["git", "-C", str(Path(__file__).parent)]
    try:
        asked = {"check": True, "capture_output": True, "text": True}
        head = subprocess.run([*git, "rev-parse", "--short=10", "HEAD"], **asked).stdout.strip()
        # of the program and its campaigns: what earlier campaigns wrote does not count
        folders = [":/compressor/**.py", ":/cmd/**.py", ":/tests/**.py"]
        changed = subprocess.run([*git, "status", "--porcelain", "--", *folders], **asked).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f"{head} with changes" if changed else head


def provenance(command):
    """Return command, date, commit, machine and versions of a measurement, which its file keeps."""
    names = ("compsim", "numpy", "scipy", "numba")
    commit = read_commit()
    return {
        "command": command,
        "date": date.today().isoformat(),
        **({"commit": commit} if commit else {}),
        "machine": f"{platform.machine()}, Python {platform.python_version()}",
        "versions": {name: metadata.version(name) for name in names},
    }


def keep(target, found):
    """Write what a campaign found, and its page if the file lies beside one."""
    target = Path(target)
    target.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if target.resolve().parent == RESULTS and target.stem in CAMPAIGNS:
        write_page(target.stem)
        write_lists()


# ---- tables


def pick(row, path):
    """The value at a path of keys and places, such as error.0; None where there is none."""
    for step in path.split("."):
        if row is None:
            return None
        row = row[int(step)] if isinstance(row, list) else row.get(step)
    return row


def cell(row, column):
    """A cell: a function of the row, or `path:format`; a dash where there is nothing."""
    if callable(column):
        return str(column(row))
    path, _, form = column.partition(":")
    value = pick(row, path)
    return "–" if value is None else value if isinstance(value, str) else format(value, form)


def table(rows, columns):
    """A table with a line a row."""
    lines = [[cell(row, column) for column in columns.values()] for row in rows]
    return markdown([*columns], lines)


def flipped(rows, columns, head):
    """A table with a column a row, by its name."""
    lines = [
        [name, *(cell(row, column) for row in rows.values())] for name, column in columns.items()
    ]
    return markdown([head, *rows], lines)


def listed(found):
    """A table of numbers by name."""
    rows = [[name.replace("_", " "), number(value)] for name, value in found.items()]
    return markdown(["quantity", "value"], rows)


def number(value, digits=3):
    """A number to some digits, a count whole."""
    return f"{value:,}" if isinstance(value, int) else f"{float(f'{value:.{digits}g}'):g}"


def accuracy(found):
    columns = {
        "promised error": "promise:g", "first rtol": "rtol:g",
        "runs reported as accurate": "kept:,", "of these, error above the promise": "broken",
        "chaotic": lambda row: row["regimes"].get("chaotic", 0),
        "failed": lambda row: sum(row["refused"].values()), "error: median": "error.0:.1e",
        "error: 95 %": "error.2:.1e", "error: largest": "error.3:.1e",
        "estimated error / error: median": "told_over_error:.1f",
        "accurate without the check": "bare_kept:.1%",
        "time with check / without: mean": "cost.mean:.2f",
        "time with check / without: median": "cost.median:.2f",
        "paper's nine cases: largest error": "nine.error:.1e",
        "paper's nine cases: time with check / without": "nine.cost:.2f",
    }  # fmt: skip
    broken = [{"word": word, **row} for word, rows in found["broken"].items() for row in rows]
    bars = found["bars"]
    shares = [
        [name, *(bar(of[name]) for of in bars.values())] for name in next(iter(bars.values()))
    ]
    shares = [[f"`{name}`", *cells] for name, *cells in shares]
    shares.append(["all", *(f"{within_bars(of):.1%}" for of in bars.values())])
    return {
        "accuracy": flipped(found["words"], columns, "accuracy level"),
        "broken": table(broken, {
            "accuracy level": "word", "clearance, mm": "clearance_mm:g", "joint": "joint",
            "load": "load", "rpm": "speed_rpm:g", "rod mass, kg": "rod_mass_kg:g",
            "reciprocating mass, kg": "reciprocating_mass_kg:g", "error": "error:.1e",
            "estimated error": "told:.1e",
        }),
        "bars": markdown(["metric", *bars], shares),
        "trade": table(found["trade"], {
            "rtol": "rtol:g", "error of acceleration: median": "acceleration.0:.1e",
            "95 %": "acceleration.2:.1e", "error of its peak: median": "peak.0:.1e",
            "95 % of the peak": "peak.2:.1e", "largest energy residual / bound": "residual:.2g",
        }),
    }  # fmt: skip


def bar(row):
    """How often an error bar holds, and how long it is."""
    return f"{row['within']:.1%}" + (f", {row['tightness']:.1f}" if row["tightness"] else "")


def calibration(found):
    percentiles = enumerate(found["cases"]["percentiles"][1:], 1)
    columns = {"tolerance of the second run": "ratio:g", "pairs of runs": "pairs:,",
               "error / distance: median": "error_over_distance.0:.2g"}  # fmt: skip
    columns |= {f"{share:g} %": f"error_over_distance.{k}:.2g" for k, share in percentiles}
    return {"calibration": table(found["series"], columns | {"factor in the program": "share:.2g"})}


def claims(found):
    default, plane, drawn = found["default"], found["map"], found["assumptions"]
    rows = []
    for place, statement in enumerate(found["statements"]):
        claim, margin = str(place + 1), default["margin"][place]
        rows.append({
            "claim": f"{claim}. {statement}",
            "at the default masses": f"{'holds' if margin >= 0 else 'does not hold'}, "
            f"{100 * margin:+.3g} % ± {100 * default['error'][place]:.2g} %",
            "map: machines where it holds": f"{plane['each'][claim]} of {plane['judged']}",
            "random assumptions: machines where it holds":
            f"{drawn['each'][claim]} of {drawn['judged']}",
            "parameter with the largest total effect": deciding(drawn, place),
        })  # fmt: skip
    counts = [{"of": name, **found[of]} for name, of in (
        ("the map", "map"), ("random assumptions", "assumptions"))]  # fmt: skip
    best = {f"claim {n}": f"{100 * m:+.3g} % ± {100 * e:.2g} %" for n, (m, e) in enumerate(
        zip(found["agreeing"]["margin"], found["agreeing"]["error"], strict=True), 1)}  # fmt: skip
    return {
        "claims": markdown([*rows[0]], [[*row.values()] for row in rows]),
        "machines": table(counts, {
            "machines of": "of", "judged": "judged", "without a verdict": "failed",
            "with chaotic cases": "chaotic", "all eight claims hold": "all",
            "all but claim 7": "but_7",
        }),
        "agreeing": markdown([*best], [[*best.values()]]),
    }  # fmt: skip


def deciding(drawn, place):
    """The parameter with the largest total effect on a claim, with its interval."""
    total = [value if value == value else -1.0 for value in drawn["total_order"][place]]
    best = total.index(max(total))
    if total[best] < 0.0:
        return "–"
    value, low, high = (drawn[f"total_order{end}"][place][best] for end in ("", "_low", "_high"))
    return f"{drawn['names'][best].replace('_', ' ')}, {value:.2f} [{low:.2f}, {high:.2f}]"


def store(found):
    columns = {"precision": "precision", "shuffle and gzip": lambda row: "yes" * row["compress"],
               "file, kB": lambda row: f"{row['bytes'] / 1000:.0f}", "writing, ms": "write_ms:.0f",
               "reading, ms": "read_ms:.0f",
               "rounding of acceleration": "acceleration_rounding:g"}  # fmt: skip
    numbers = found["rows"] | {
        f"{name}, with series": value for name, value in found.get("selection", {}).items()
    }
    return {"store": table(found["series"], columns) + "\n" + listed(numbers)}


def validation(found):
    def digits(row):
        return max(4, 2 + len(f"{abs(row['expected']) / row['within']:.0f}"))

    rows = found["rows"]
    subjects = [[*group] for _, group in groupby(rows, lambda row: row["subject"])]
    return {
        "validation-summary": table(subjects, {
            "subject": lambda of: of[0]["subject"], "numbers": len,
            "largest difference / tolerance": lambda of: "{:.2g}".format(
                max(abs(row["found"] - row["expected"]) / row["within"] for row in of)),
            "sources": lambda of: "; ".join(dict.fromkeys(row["source"] for row in of)),
        }),
        "validation": table(rows, {
            "subject": "subject", "quantity": "what", "unit": "unit",
            "published": lambda row: f"{row['expected']:.{digits(row)}g}",
            "computed": lambda row: f"{row['found']:.{digits(row) if row['expected'] else 2}g}",
            "tolerance": "within:.2g", "source": "source",
        }),
    }  # fmt: skip


def wear(found):
    machines = found["machines"]
    errors = [row["error"] for row in machines if not row["reason"]]
    steps = table(found["convergence"]["rows"], {
        "step, µm": lambda row: f"{1e3 * row['step_mm']:g}", "error of the hours": "hours:.3%",
    })  # fmt: skip
    return {"wear": steps + (
        f"\nOf {len(machines)} machines drawn at random, {len(errors)} were followed to one and a "
        f"half clearances. Between the default ({1e3 * found['step_mm']:g} µm) and a quarter of "
        f"the step, hours differ by {median(errors):.2%} (median) and {max(errors):.1%} at most.\n"
    )}  # fmt: skip


def three(rows, key, digits):
    """A number of each of the three scenes."""
    return " / ".join(number(row[key], digits) if key in row else "–" for row in rows)


def peers(found):
    tools = {}
    for row in found["rows"]:
        tools.setdefault(row["tool"], []).append(row)
    columns = {"tool": lambda of: of[0]["tool"],
               "settings": lambda of: of[0]["settings"] if "seconds" in of[0] else of[0]["reason"],
               }  # fmt: skip
    columns |= {
        head: lambda of, key=key, digits=digits: three(of, key, digits)
        for head, key, digits in (
            ("its CPU s", "seconds", 2), ("its error", "error", 1),
            ("our CPU s", "our_seconds", 2), ("our rtol", "our_rtol", 2),
            ("its CPU time / ours", "ratio", 2),
            ("its wall time / our solver's", "kernel_wall_ratio", 2),
        )
    }  # fmt: skip
    return {"peers": table(tools.values(), columns)}


def by_scene(rows, key, make):
    """A table: a line a value of `key`, a column a scene, each cell made from its row."""
    scenes = [*dict.fromkeys(row["scene"] for row in rows)]
    cells = {(row[key], row["scene"]): make(row) for row in rows}
    head = [f"{scene.replace('_', ' ')} mm" for scene in scenes]
    lines = [[value if isinstance(value, str) else f"{value:.0e}",
              *(cells.get((value, scene), "—") for scene in scenes)]
             for value in dict.fromkeys(row[key] for row in rows)]  # fmt: skip
    return head, lines


def tradeoff(found):
    fastest = sorted(found["fastest"], key=lambda row: -row["error_below"])
    head, rows = by_scene(fastest, "error_below", lambda row: (
        f"{row['method']}, {milliseconds(row['seconds'])} (rtol {row['rtol']:g})"))  # fmt: skip

    def effect(row):
        if row["note"].startswith("failed"):
            return row["note"].partition(": ")[2]
        sizes = [row[f"change_{name}"] for name in ("peak_acceleration", "peak_contact_force")]
        texts = ["—" if size is None else f"{100 * size:+z.1f} %" for size in sizes]
        ratio = row["time_ratio"]
        return ", ".join([*texts, "—" if ratio is None else f"×{ratio:.2g}"])

    heads, changes = by_scene(found["changes"], "change", effect)
    return {"fastest": markdown(["error of acceleration below", *head], rows),
            "modelling": markdown(["change of the model", *heads], changes)}  # fmt: skip


def page(found):
    rows = [{"name": f"{name}, {one['figures']} figures", **one}
            for name, one in found["stores"].items()]  # fmt: skip

    def size(kind):
        return lambda row: f"{row[f'{kind}_bytes'] / 1e6:.2f}"

    return {"page": table(rows, {
        "report of": "name", "written in, s": "write_seconds:.1f",
        "written again, s": "rewrite_seconds:.1f", "page, MB": size("page"),
        "data of figures, MB": size("data"), "plotly, MB": size("library"), "CSV, MB": size("csv"),
        "pictures, MB": size("picture"), "opens in, s": "open_seconds:.2f",
        "first figure live after, s": "first_figure_seconds:.2f",
    })}  # fmt: skip


def sweep(found):
    kills = table(found["kills"], {"killed after, s": "after_s:.0f", "SIGKILL of": "of",
                                   "jobs reported as done": "told:,", "jobs stored": "stored:,"},
                  )  # fmt: skip
    numbers = {name: value for name, value in found.items()
               if isinstance(value, int | float) and not isinstance(value, bool)}  # fmt: skip
    peaks = {f"peak memory of a {name}, MB": size for name, size in found["peak_MB"].items()}
    times = [[name, number(value, 2)] for name, value in found["start"].items()]
    start = markdown(["whole process, code compiled before", "seconds"], times)
    return {"sweep": "\n".join((start, listed(numbers | peaks), kills))}


def chaotic(found):
    row = found["random"]
    numbers = {
        "random cases": row["drawn"], "reported as chaotic": row["regimes"]["chaotic"],
        f"chaotic cases solved again by {row['method']}": row["judged"],
        **{f"their rms differs by at most {k} standard errors": n
           for k, n in row["within"].items()},
        **{f"{name}: median, 90 %, largest": ", ".join(f"{value:.2g}" for value in row[of])
           for name, of in (("relative standard error of the rms", "known"),
                            ("relative difference of the rms", "relative"),
                            ("horizon in revolutions", "horizon_rev"),
                            ("revolutions needed for an rms within 1 %", "more"))},
        f"the first {len(row['scipy']['apart'])} against SciPy's {row['scipy']['method']}: "
        "difference in standard errors": ", ".join(f"{one:.1f}" for one in row["scipy"]["apart"]),
    }  # fmt: skip
    rows = [[name, str(value)] for name, value in numbers.items()]
    return {"chaotic-cases": markdown(["quantity", "value"], rows)}


def share(row):
    """A share with its 95 % interval."""
    return f"{row['share']:.1%} [{row['low']:.0%}, {row['high']:.0%}]" if row["of"] else "–"


def identify(found):
    names = {
        "correct joint": "right", "correct joint, worn machines": "right_where_worn",
        "clearance inside its 90 % interval, joint correct": "covered",
        "clearance inside its 90 % interval, all worn machines": "covered_all",
        "false alarms": "false_alarms", "missed faults": "missed",
        "reported as unlike the study": "nothing_fits",
        "reported as unlike the study, worn machines": "nothing_fits_where_worn",
    }  # fmt: skip
    columns = {head: lambda row, name=name: share(row[name]) for head, name in names.items()}
    columns["upper / lower end of the interval"] = "factor.1:.1f"
    return {"identify": flipped(found["models"], columns, "friction law of the records")}


def calibrate(found):
    rows = [
        {"other": other, "key": key, "machines": of["machines"], "unfit": of["said_not_to_fit"]}
        | one
        for other, of in found["others"].items()
        for key, one in of["keys"].items()
    ]
    return {"calibrate": table(rows, {
        "machine differs from the model by": "other", "key": lambda row: f"`{row['key']}`",
        "true value inside its 95 % interval": lambda row: (
            "{inside} of {machines} [{inside_95[0]:.0%}, {inside_95[1]:.0%}]".format(**row)),
        "error of the best value, % of the range": "off:.1%",
        "width of the interval, % of the range": "width:.0%", "reported as not fitting": "unfit",
    })}  # fmt: skip


def alarms(found):
    def first(row):
        if row["first_low"] is None:
            return "never"
        most = f"> {row['clearances'][-1]:g}"
        low, high = (most if row[f"first_{end}"] is None else f"{row[f'first_{end}']:g}"
                     for end in ("low", "high"))  # fmt: skip
        return f"{'never' if row['first'] is None else format(row['first'], 'g')} [{low}, {high}]"

    def alike(row, rows):
        one = next((one for one in rows if all(one[n] == row[n] for n in ("joint", "alarm"))), None)
        return f"{first(one)}, {one['filter']}" if one else "–"

    columns = {
        "worn joint": lambda row: row["joint"].replace("_", " "),
        "alarm, with its best filter": lambda row: f"{row['alarm']}, {row['filter']}",
        "false alarms": lambda row: "{} % [{}, {}]".format(
            *(f"{100 * row[f'false_alarms{end}']:.2g}" for end in ("", "_low", "_high"))),
        "trips in, by clearance in mm": lambda row: ", ".join(
            f"{one:.0%} at {clearance:g}"
            for clearance, one in zip(row["clearances"], row["detection"], strict=True)),
        "detects from, mm": first,
        f"limits for {found['looser']:.0%}": lambda row: alike(row, found["at_looser"]),
    }  # fmt: skip
    for noise in sorted({row["noise"] for row in found["rows"]} - {0}):
        columns[f"with noise of {noise:g} m/s²"] = lambda row, noise=noise: (
            "–" if row["alarm"] == "velocity of the body"  # a stored metric, without the noise
            else alike(row, [one for one in found["rows"] if one["noise"] == noise])
        )  # fmt: skip
    columns["hours before the limit"] = lambda row: "–" if row["lead_hours"] is None else (
        "{lead_hours:g} [{lead_hours_low:g}, {lead_hours_high:g}]".format(**row))  # fmt: skip
    return {"alarms": table([row for row in found["rows"] if not row["noise"]], columns)}


DRAWN = {"": "other cases", "laws": "cases with other laws", "features": "cases with features"}


def stress(found):
    ends = found["ends"]
    names = sorted(
        {"silent_wrong", *ends["supported"], *ends["whole"]}, key=lambda n: (n != "ok", n)
    )
    rows = [[f"`{name}`", *(str(of.get(name, 0)) for of in ends.values())] for name in names]
    rows.append(["share of `ok`", *(f"{of.get('ok', 0) / sum(of.values()):.1%}"
                                    for of in ends.values())])  # fmt: skip
    text = markdown(["outcome", "supported range", "whole range"], rows)
    bound = "" if found["silent_wrong"] else f" (at most {found['at_most']:.2%}, 95 % confidence)"
    text += (
        f"\n{found['scenes']:,} cases took {found['work_s'] / 60:.0f} minutes of workers' time. "
        f"Results that were wrong without a warning: {found['silent_wrong']}{bound}.\n"
    )
    for one in found["fresh"]:
        all_ends = Counter()
        for name, count in one["ends"].items():  # of an earlier program by range
            all_ends.update(count if isinstance(count, dict) else {name: count})
        counts = ", ".join(f"`{name}` {count}" for name, count in all_ends.most_common())
        wrong = ", ".join(
            f"{row['worst_metric']} (excess {row['excess']:.2g})" for row in one["silent_wrong"]
        )
        text += (
            f"\n**Of {one['scenes']:,} {DRAWN[one['drawn']]}**, {len(one['silent_wrong'])} wrong "
            f"without a warning{f': {wrong}' if wrong else ''}. {counts}.\n"
        )
    return {"stress": text, "worst": table(found["worst"], {
        "verdict": "verdict", "metric": "worst_metric", "error / allowed error": "excess:.2g",
        "error": "error:.1e", "error bar": "bar:.1e",
        "judges": lambda row: row["judges"] if isinstance(row["judges"], str)
        else " ".join(row["judges"]),
    })}  # fmt: skip


def chaos(found):
    rows = [one for one in found["campaigns"].values() if "skipped" not in one]
    return {"chaos": table(rows, {
        "fault": "what", "trials": "trials:,", "failed": "failed",
        "failure rate with 95 % confidence below": lambda row: (
            "" if row["failed"] else f"{300 / row['trials']:.2g} %"),
    })}  # fmt: skip


def mutants(found):
    rows = found["mutants"]
    kinds = {kind: {kind} for kind in dict.fromkeys(row["kind"] for row in rows)}
    lines = []
    for name, of in (kinds | {"all drawn": {*kinds} - {"planted"}}).items():
        some = [row for row in rows if row["kind"] in of]
        same, caught = sum("equivalent" in r for r in some), [r for r in some if r["caught_by"]]
        quick = sum(not row["jit"] for row in caught)
        lines.append([name, *map(str, (len(some), same, len(caught), quick,
                                       len(some) - same - len(caught)))])  # fmt: skip
    head = ["kind of bug", "bugs", "change no result", "caught",
            "of these with the compiler off", "not caught"]  # fmt: skip
    others = [f"- `{row['mutant']}`: {row.get('equivalent', '**not caught**')}\n"
              for row in rows if not row["caught_by"]]  # fmt: skip
    return {"mutants": markdown(head, lines) + "\n" + "".join(others)}


def regimes(found):
    def motion(row):
        if row["regime"] != "periodic":
            return row["regime"]
        return f"period {row['period']:g}" if row["period"] else ""

    def span(name, form):
        def text(rows):
            known = [row[name] for row in rows if row[name] is not None]
            ends = [format(end(known), form) for end in (min, max)] if known else ["–"]
            return " to ".join(dict.fromkeys(ends))

        return text

    key = lambda row: (row["direction"], motion(row))  # noqa: E731
    runs = [[*rows] for _, rows in groupby(found["rows"], key)]
    text = table(runs, {
        "direction": lambda rows: rows[0]["direction"], "clearance, mm": span("value", ".4g"),
        "values": len, "motion": lambda rows: motion(rows[0]),
        "Poincaré points": span("points", "g"),
        "Lyapunov exponent, 1/rev": span("exponent", ".2f"), "its error": span("error", ".2g"),
    })  # fmt: skip
    for words, rows in (("Up and down differ at (mm)", found["differ"]),
                        ("Two motions are confirmed at (mm)",
                         [row for row in found["differ"] if row["confirmed"]])):  # fmt: skip
        values = ", ".join(f"{row['value']:.4g}" for row in rows)
        text += f"\n{words}: {values or 'no value'}.\n"
    return {"regimes": text}


def nameplate(found):
    rows = [{"name": name, **row} for name, row in found["oils"].items()]
    return {"oils": table(rows, {"oil": "name", "peak force, N": "force:.3g",
                                 "error bar, N": "error:.2g", "motion": "regime"})}  # fmt: skip


# campaign: the question of its page in tests/results, and the tables of what it found
CAMPAIGNS = {
    "validation": ("Are published numbers reproduced?", validation),
    "peers": ("How does it compare with other programs?", peers),
    "accuracy": ("Are results as accurate as promised?", accuracy),
    "calibration": ("How is the error estimated?", calibration),
    "tradeoff": ("Which method is fastest, and what does a feature of the model change?", tradeoff),
    "stress": ("What happens in extreme cases?", stress),
    "chaotic": ("Can averages of chaotic motion be trusted?", chaotic),
    "claims": ("Which of the paper's claims hold?", claims),
    "regimes": ("How does the motion change with the clearance?", regimes),
    "wear": ("How accurate are hours until a limit?", wear),
    "alarms": ("Which alarm sees wear first?", alarms),
    "identify": ("Does `compsim identify` find the worn joint?", identify),
    "calibrate": ("Does `compsim calibrate` find a machine's parameters?", calibrate),
    "chaos": ("Do results survive kills, power cuts and damage?", chaos),
    "mutants": ("Would the tests notice a bug?", mutants),
    "sweep": ("How many jobs a second, and does an interrupted sweep lose one?", sweep),
    "store": ("How large and fast is the store?", store),
    "page": ("How fast is the report?", page),
    "nameplate": ("What does the case file of `compsim init machine` give?", nameplate),
}  # fmt: skip

# ---- the ten findings: words, and of a campaign's numbers (measured, required, whether it passes)

KEPT_PROMISES, WITHIN_BARS = 0.99, 0.95  # required; what the error bars are designed for


def judge_published(found):
    good = sum(abs(row["found"] - row["expected"]) <= row["within"] for row in found["rows"])
    return (
        f"{good} of {len(found['rows'])} within their tolerance",
        "all",
        good == len(found["rows"]),
    )


def compare_peers(found):
    apart = max(one["exudyn_to_ours"] for one in found["agreement"])
    times = sorted(r["ratio"] for r in found["rows"] if r["tool"].startswith("Exudyn DOPRI5"))
    return (f"Exudyn's acceleration differs by at most {apart:.1e} (relative L2); its fastest "
            f"solver, with no smaller error, takes {times[0]:.0f} to {times[-1]:.0f} times our CPU "
            "time"), "", None  # fmt: skip


def judge_promises(found):
    claimed = sum(row["kept"] for row in found["words"].values())
    good = claimed - sum(row["broken"] for row in found["words"].values())
    return (f"{good:,} of {claimed:,} runs ({good / claimed:.2%})", f"{KEPT_PROMISES:.0%}",
            good >= KEPT_PROMISES * claimed)  # fmt: skip


def judge_bars(found):
    shares = [within_bars(metrics) for metrics in found["bars"].values()]
    return (f"{min(shares):.1%} to {max(shares):.1%}, by accuracy level", f"{WITHIN_BARS:.0%}",
            min(shares) >= WITHIN_BARS)  # fmt: skip


def judge_extremes(found):
    cases = found["scenes"] + sum(one["scenes"] for one in found["fresh"])
    wrong, ends = found["silent_wrong"] + silent(found["fresh"]), found["ends"]["supported"]
    good = ends["ok"] / sum(ends.values())
    return (f"{wrong} of {cases:,} (in the supported range {good:.1%} give a confirmed result, "
            "the others stop with a reason)"), "none", not wrong  # fmt: skip


def count_averages(found):
    row = found["random"]
    return f"{row['within']['2']} of {row['judged']}", "about 95", None


def judge_faults(found):
    rows = [row for row in found["campaigns"].values() if "skipped" not in row]
    failed, trials = (sum(row[name] for row in rows) for name in ("failed", "trials"))
    return f"{failed} of {trials:,} trials", "none", not failed


def judge_mutants(found):
    rows = [row for row in found["mutants"] if "equivalent" not in row]
    caught = sum(bool(row["caught_by"]) for row in rows)
    return f"{caught} of {len(rows)}", "all", caught == len(rows)


def count_claims(found):
    margins, plane = found["default"]["margin"], found["map"]
    held = sum(margin >= 0.0 for margin in margins)
    return (f"{held} of {len(margins)} at the default masses; all {len(margins)} in {plane['all']} "
            f"of {plane['judged']:,} machines with other masses"), "", None  # fmt: skip


def count_identified(found):
    own, *others = (row["right_where_worn"]["share"] for row in found["models"].values())
    return (f"{own:.1%} of records of worn machines of the study's own model; {min(others):.0%} to "
            f"{max(others):.0%} if the machine has another friction law"), "", None  # fmt: skip


FINDINGS = {
    "validation": ("Published numbers are reproduced", judge_published),
    "peers": ("Another program agrees, and takes longer", compare_peers),
    "accuracy": ("Runs that are reported as accurate are accurate", judge_promises),
    "accuracy#error-bars": ("True errors lie within their error bars", judge_bars),
    "stress": ("Extreme cases that are wrong without a warning", judge_extremes),
    "chaotic": ("Averages of chaotic motions agree between two integrators, within two standard "
                "errors", count_averages),
    "chaos": ("Kills, power cuts and damaged files that lose or change a result", judge_faults),
    "mutants": ("Planted bugs are caught by the tests", judge_mutants),
    "claims": ("Claims of the paper that hold", count_claims),
    "identify": ("`compsim identify` names the worn joint", count_identified),
}  # fmt: skip
VERDICTS = {None: "number", True: "pass", False: "**fail**"}


def findings(read=kept):
    """The rows of the ten findings; `read` gives the numbers of a campaign."""
    for name, (words, find) in FINDINGS.items():
        campaign, _, place = name.partition("#")
        measured, required, passed = find(read(f"{campaign}.json"))
        link = f"[{words}]({campaign}.md{f'#{place}' if place else ''})"
        yield [link, measured, required or "–", VERDICTS[passed]]


# ---- pages


def runs_of(found):
    """Return when, how and of what each part of a campaign was measured."""
    parts = [found, *found.get("campaigns", {}).values(), *found.get("fresh", [])]
    return sorted((one for one in parts if "date" in one), key=lambda one: one["date"])


def measured_by(name):
    """Return the command, dates, commits and machines of a campaign as texts."""
    runs = runs_of(kept(f"{name}.json"))
    dates = " to ".join(dict.fromkeys((runs[0]["date"], runs[-1]["date"])))
    commits = dict.fromkeys(one.get("commit", "not recorded") for one in runs)
    machines = dict.fromkeys(one["machine"] for one in runs)
    return runs[-1]["command"].partition(",")[0], dates, ", ".join(commits), "; ".join(machines)


def measured_words(name):
    """Return the finding of a page, and what it was measured with."""
    text, found = "", kept(f"{name}.json")
    if name in FINDINGS:
        words, find = FINDINGS[name]
        measured, required, passed = find(found)
        asked = f" ({'expected' if passed is None else 'required'}: {required})" if required else ""
        end = {None: "", True: " **Pass.**", False: " **Fail.**"}[passed]
        text = f"**{words}:** {measured}{asked}.{end}\n\n"
    command, dates, commit, machine = measured_by(name)
    versions = ", ".join(f"{k} {v}" for k, v in runs_of(found)[-1]["versions"].items())
    return text + (f"Measured by `{command}`, {dates}; commit: {commit}; {machine}, {versions}. "
                   f"Numbers: [{name}.json]({name}.json).\n")  # fmt: skip


def write_page(name):
    """Write the tables of a campaign's page."""
    _, tables = CAMPAIGNS[name]
    write_blocks(RESULTS / f"{name}.md", {"measured": measured_words(name)}
                 | tables(kept(f"{name}.json")))  # fmt: skip


def write_lists():
    """Write the ten findings and the list of campaigns."""
    rows = []
    for name, (question, _) in CAMPAIGNS.items():
        title = (RESULTS / f"{name}.md").read_text(encoding="utf-8").split("\n")[0].strip("# ")
        command, *others = measured_by(name)
        rows.append([f"[{title}]({name}.md)", question, f"`{command}`", *others])
    head = ["campaign", "question", "command", "date", "commit", "machine"]
    write_blocks(RESULTS / "README.md", {
        "findings": markdown(["finding", "measured", "required or expected", "verdict"],
                             [*findings()]),
        "campaigns": markdown(head, rows),
    })  # fmt: skip


if __name__ == "__main__":
    for campaign in CAMPAIGNS:
        write_page(campaign)
    write_lists()
