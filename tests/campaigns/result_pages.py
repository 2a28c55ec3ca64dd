"""What campaigns keep: a JSON file, and the tables of the page beside it, written when it measures.

`keep` writes both and the lists of tests/results/README.md; `make pages` writes the pages again.
"""

import argparse
import inspect
import json
import math
import platform
import subprocess
import sys
from collections import Counter
from datetime import date
from importlib import metadata
from itertools import groupby
from pathlib import Path

from page_tables import (
    FINDINGS,
    RESULTS,
    kept,
    markdown,
    nameplate_table,
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


def provenance(command, *more):
    """Return command, date, commit, machine and versions of a measurement, which its file keeps.

    more: libraries beside those of the program.
    """
    names = ("compsim", "numpy", "scipy", "numba", *more)
    installed = {one.name: one.version for one in metadata.distributions()}
    commit = read_commit()
    return {
        "command": command,
        "date": date.today().isoformat(),
        **({"commit": commit} if commit else {}),
        "machine": f"{platform.machine()}, Python {platform.python_version()}",
        "versions": {name: installed.get(name, "not installed") for name in names},
    }


def rounded(found, digits):
    """Return numbers in lists and mappings to some digits, None where they are not finite."""
    if isinstance(found, dict):
        return {name: rounded(one, digits) for name, one in found.items()}
    if isinstance(found, list | tuple):
        return [rounded(one, digits) for one in found]
    if isinstance(found, float):
        return float(f"{found:.{digits}g}") if math.isfinite(found) else None
    return found


def keep(target, found, digits=0):
    """Write what a campaign found, and its page if the file lies beside one.

    digits: of numbers that are not whole; 0: all of them.
    """
    target, found = Path(target), rounded(found, digits) if digits else found
    target.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if target.resolve().parent == RESULTS and target.stem in CAMPAIGNS:
        write_page(target.stem)
        write_lists()


def run_campaign(main):
    """Call a campaign by the command line: the file to write, and an option for each default."""
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    for name, one in inspect.signature(main).parameters.items():
        if one.default is one.empty:
            parser.add_argument(name)
        else:
            many = isinstance(one.default, tuple)
            kind = type((*one.default, "")[0] if many else one.default)
            parser.add_argument(f"--{name}", default=one.default, type=kind,
                                nargs="*" if many else None)  # fmt: skip
    main(**vars(parser.parse_args()))


# ---- tables: one a page


def pick(row, path):
    """Return the value at a path of keys and places, such as error.0; None where there is none."""
    for step in path.split("."):
        if row is None:
            return None
        row = row[int(step)] if isinstance(row, list) else row.get(step)
    return row


def cell(row, column):
    """Return a cell: a function of the row, or `path:format`; a dash where there is nothing."""
    if callable(column):
        return str(column(row))
    path, _, form = column.partition(":")
    value = pick(row, path)
    return "–" if value is None else value if isinstance(value, str) else format(value, form)


def table(rows, columns):
    """Return a table with a line a row."""
    lines = [[cell(row, column) for column in columns.values()] for row in rows]
    return markdown([*columns], lines)


def flipped(rows, columns, head):
    """Return a table with a column a row, by its name."""
    lines = [
        [name, *(cell(row, column) for row in rows.values())] for name, column in columns.items()
    ]
    return markdown([head, *rows], lines)


def number(value, digits=3):
    """Return a number with some digits as a text, a count whole, a text as it is."""
    if isinstance(value, str):
        return value
    return f"{value:,}" if isinstance(value, int) else f"{float(f'{value:.{digits}g}'):g}"


def accuracy(found):
    rows = {
        word: row | {"bars": within_bars(found["bars"][word])}
        for word, row in found["words"].items()
    }
    return flipped(rows, {
        "largest allowed error": "promise:g", "first rtol": "rtol:g",
        "runs reported as accurate": "kept:,", "of these, error above the allowed one": "broken",
        "chaotic": lambda row: row["regimes"].get("chaotic", 0),
        "failed": lambda row: sum(row["refused"].values()), "error: median": "error.0:.1e",
        "error: 95 %": "error.2:.1e", "error: largest": "error.3:.1e",
        "estimated error / error: median": "told_over_error:.1f",
        "accurate without the check": "bare_kept:.1%",
        "time with check / without: median": "cost.median:.2f",
        "errors of metrics within their error bars": "bars:.1%",
    }, "accuracy level")  # fmt: skip


def calibration(found):
    percentiles = enumerate(found["cases"]["percentiles"][1:], 1)
    columns = {"tolerance of the second run": "ratio:g", "pairs of runs": "pairs:,",
               "error / distance: median": "error_over_distance.0:.2g"}  # fmt: skip
    columns |= {f"{share:g} %": f"error_over_distance.{k}:.2g" for k, share in percentiles}
    return table(found["series"], columns | {"factor in the program": "share:.2g"})


def validation(found):
    subjects = [[*group] for _, group in groupby(found["rows"], lambda row: row["subject"])]
    return table(subjects, {
        "subject": lambda of: of[0]["subject"], "numbers": len,
        "largest difference / tolerance": lambda of: "{:.2g}".format(
            max(abs(row["found"] - row["expected"]) / row["within"] for row in of)),
        "sources": lambda of: "; ".join(dict.fromkeys(row["source"] for row in of)),
    })  # fmt: skip


def three(rows, key, digits):
    """Return a number of each of the three clearance configurations."""
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
            ("our CPU s", "our_seconds", 2), ("its CPU time / ours", "ratio", 2),
            ("its wall time / our solver's", "kernel_wall_ratio", 2),
        )
    }  # fmt: skip
    timed = found["evaluations"]["scenes"]
    return table(tools.values(), columns) + "\n" + table(
        timed,
        {"one evaluation": lambda row: row["scene"].replace("_", " "),
         "ours, ns": lambda row: number(1e9 * row["seconds"]),
         "the other, ns": lambda row: number(1e9 * row["other_seconds"]), "ratio": "ratio"},
    )  # fmt: skip


def tradeoff(found):
    """Return the effect of each change of the model, a column a clearance configuration."""

    def effect(row):
        if row["note"].startswith("failed"):
            return row["note"].partition(": ")[2]
        sizes = [row[f"change_{name}"] for name in ("peak_acceleration", "peak_contact_force")]
        texts = ["–" if size is None else f"{100 * size:+z.1f}" for size in sizes]
        ratio = row["time_ratio"]
        return ", ".join([*texts, "–" if ratio is None else f"×{ratio:.2g}"])

    rows = found["changes"]
    scenes = [*dict.fromkeys(row["scene"] for row in rows)]
    cells = {(row["change"], row["scene"]): effect(row) for row in rows}
    lines = [[change, *(cells.get((change, scene), "–") for scene in scenes)]
             for change in dict.fromkeys(row["change"] for row in rows)]  # fmt: skip
    heads = [f"{scene.replace('_', ' ')} mm" for scene in scenes]
    return markdown(["change of the model", *heads], lines)


def page(found):
    rows = [{"name": f"{name}, {one['figures']} figures", **one}
            for name, one in found["stores"].items()]  # fmt: skip

    def size(row):
        return f"{sum(value for key, value in row.items() if key.endswith('_bytes')) / 1e6:.1f}"

    return table(rows, {
        "report of": "name", "written in, s": "write_seconds:.1f",
        "written again, s": "rewrite_seconds:.1f", "all files, MB": size,
        "opens in, s": "open_seconds:.2f", "first figure live after, s": "first_figure_seconds:.2f",
    })  # fmt: skip


def sweep(found):
    numbers = {name: value for name, value in found.items()
               if isinstance(value, int | float) and not isinstance(value, bool)}  # fmt: skip
    start = {f"{name}, s": value for name, value in found["start"].items()}
    peaks = {f"peak memory of a {name}, MB": size for name, size in found["peak_MB"].items()}
    lost = sum(max(0, one["told"] - one["stored"]) for one in found["kills"])
    kills = {"times killed": len(found["kills"]), "jobs reported as done and lost": lost}
    every = start | numbers | peaks | kills
    rows = [[name.replace("_", " "), number(value)] for name, value in every.items()]
    return markdown(["quantity", "value"], rows)


def share(row):
    """Return a fraction with its 95 % interval."""
    return f"{row['share']:.1%} [{row['low']:.0%}, {row['high']:.0%}]" if row["of"] else "–"


def identify(found):
    names = {
        "correct joint": "right", "correct joint, worn machines": "right_where_worn",
        "clearance inside its 90 % interval, worn machines": "covered_all",
        "healthy machines called worn": "false_alarms", "worn machines called healthy": "missed",
        "reported as unlike the study, worn machines": "nothing_fits_where_worn",
    }  # fmt: skip
    columns = {head: lambda row, name=name: share(row[name]) for head, name in names.items()}
    columns["upper / lower end of the interval"] = "factor.1:.1f"
    return flipped(found["models"], columns, "friction law of the records")


DRAWN = {"laws": "other laws", "features": "features"}


def stress(found):
    ends = {"supported range": Counter(found["ends"]["supported"]),
            "whole range": Counter(found["ends"]["whole"])}  # fmt: skip
    for one in found["fresh"]:
        counts = ends.setdefault(f"fresh, {DRAWN[one['drawn']]}", Counter())
        counts.update(one["ends"])
    names = sorted({"silent_wrong"}.union(*ends.values()), key=lambda n: (n != "ok", n))
    rows = [[f"`{name}`", *(str(of[name]) for of in ends.values())] for name in names]
    rows.append(["share of `ok`", *(f"{of['ok'] / of.total():.1%}" for of in ends.values())])
    return markdown(["outcome", *ends], rows)


def chaos(found):
    rows = [one for one in found["campaigns"].values() if "skipped" not in one]
    return table(rows, {
        "fault": "what", "trials": "trials:,", "failed": "failed",
        "failure rate with 95 % confidence below": lambda row: (
            "" if row["failed"] else f"{300 / row['trials']:.2g} %"),
    })  # fmt: skip


def mutants(found):
    rows = found["mutants"]
    lines = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        some = [row for row in rows if row["kind"] == kind]
        same, caught = sum("equivalent" in r for r in some), sum(bool(r["caught_by"]) for r in some)
        lines.append([kind, *map(str, (len(some), same, caught, len(some) - same - caught))])
    return markdown(["kind of bug", "bugs", "change no result", "caught", "not caught"], lines)


# campaign: the question of its page in tests/results, and the table of what it found
CAMPAIGNS = {
    "validation": ("Are published numbers reproduced?", validation),
    "peers": ("How does it compare with other programs?", peers),
    "accuracy": ("Are results as accurate as promised?", accuracy),
    "calibration": ("How is the error estimated?", calibration),
    "tradeoff": ("Which method is fastest, and what does a feature of the model change?", tradeoff),
    "stress": ("What happens in extreme cases?", stress),
    "identify": ("Does `compsim identify` find the worn joint?", identify),
    "chaos": ("Do results survive kills, power cuts and damage?", chaos),
    "mutants": ("Would the tests notice a bug?", mutants),
    "sweep": ("How many jobs a second, and does an interrupted sweep lose one?", sweep),
    "page": ("How fast is the report?", page),
    "nameplate": ("What does the case file of `compsim init machine` give?", nameplate_table),
}  # fmt: skip

# ---- pages

VERDICTS = {None: "number", True: "pass", False: "**fail**"}


def findings(read=kept):
    """Yield the rows of the findings; `read` returns the numbers of a campaign."""
    for name, words, find in FINDINGS:
        measured, required, passed = find(read(f"{name}.json"))
        yield [f"[{words}]({name}.md)", measured, required or "–", VERDICTS[passed]]


def measured_by(found):
    """Return the command, the dates and the commits of a campaign."""
    parts = [found, *found.get("campaigns", {}).values(), *found.get("fresh", [])]
    runs = sorted((one for one in parts if "date" in one), key=lambda one: one["date"])
    dates = " to ".join(dict.fromkeys((runs[0]["date"], runs[-1]["date"])))
    commits = dict.fromkeys(one.get("commit", "not recorded") for one in runs)
    return runs[-1]["command"].partition(",")[0], dates, ", ".join(commits)


def page_text(name):
    """Return the findings of a campaign's page, its table, and how that was measured."""
    found = kept(f"{name}.json")
    text = ""
    for campaign, words, find in FINDINGS:
        if campaign == name:
            measured, required, passed = find(found)
            limit = f" ({'expected' if passed is None else 'required'}: {required})"
            end = {None: "", True: " **Pass.**", False: " **Fail.**"}[passed]
            text += f"**{words}:** {measured}{limit if required else ''}.{end}\n\n"
    command, dates, commits = measured_by(found)
    return text + CAMPAIGNS[name][1](found) + (
        f"\nMeasured by `{command}`, {dates}; commit {commits}; [all numbers]({name}.json).\n"
    )  # fmt: skip


def write_page(name):
    """Write the generated part of a campaign's page."""
    write_blocks(RESULTS / f"{name}.md", {"measured": page_text(name)})


def write_lists():
    """Write the findings and the list of campaigns."""
    rows = []
    for name, (question, _) in CAMPAIGNS.items():
        title = (RESULTS / f"{name}.md").read_text(encoding="utf-8").split("\n")[0].strip("# ")
        command, *_ = measured_by(kept(f"{name}.json"))
        rows.append([f"[{title}]({name}.md)", question, f"`{command}`"])
    write_blocks(RESULTS / "README.md", {
        "findings": markdown(["finding", "measured", "required or expected", "verdict"],
                             [*findings()]),
        "campaigns": markdown(["campaign", "question", "command"], rows),
    })  # fmt: skip


if __name__ == "__main__":
    for campaign in CAMPAIGNS:
        write_page(campaign)
    write_lists()
