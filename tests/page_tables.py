"""Generated blocks of the pages for users: `make pages` writes them, test_pages compares.

The pages of campaigns are written by these, with tests/campaigns/result_pages.py.
"""

import json
import math
import re
from pathlib import Path

from compressor.cases.laws import CLEARANCE
from compressor.cases.parameter import PART_WORDS
from compressor.cases.table import GROUPS, READ, parts_by_key, table
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


def milliseconds(seconds):
    """A time, to three digits below a second."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 0.9995 else f"{1e3 * seconds:.0f} ms"


# ---- the findings: words, and of a campaign's numbers (measured, required, whether it passes)

KEPT_PROMISES, WITHIN_BARS = 0.99, 0.95  # required; what the error bars are designed for


def within_bars(metrics):
    """The share of the true errors of some metrics that are within their bars."""
    rows = metrics.values()
    return sum(row["within"] * row["of"] for row in rows) / sum(row["of"] for row in rows)


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
    wrong = found["silent_wrong"] + sum(len(one["silent_wrong"]) for one in found["fresh"])
    ends = found["ends"]["supported"]
    good = ends["ok"] / sum(ends.values())
    return (f"{wrong} of {cases:,} (in the supported range {good:.1%} give a confirmed result, "
            "the others stop with a reason)"), "none", not wrong  # fmt: skip


def judge_faults(found):
    rows = [row for row in found["campaigns"].values() if "skipped" not in row]
    failed, trials = (sum(row[name] for row in rows) for name in ("failed", "trials"))
    return f"{failed} of {trials:,} trials", "none", trials > 0 and not failed


def judge_mutants(found):
    rows = [row for row in found["mutants"] if "equivalent" not in row]
    caught = sum(bool(row["caught_by"]) for row in rows)
    return f"{caught} of {len(rows)}", "all", caught == len(rows)


def count_identified(found):
    own, *others = (row["right_where_worn"]["share"] for row in found["models"].values())
    return (f"{own:.1%} of records of worn machines of the study's own model; {min(others):.0%} to "
            f"{max(others):.0%} if the machine has another friction law"), "", None  # fmt: skip


FINDINGS = (
    ("validation", "Published numbers are reproduced", judge_published),
    ("peers", "Another program agrees, and takes longer", compare_peers),
    ("accuracy", "Runs that are reported as accurate are accurate", judge_promises),
    ("accuracy", "True errors lie within their error bars", judge_bars),
    ("stress", "Extreme cases that are wrong without a warning", judge_extremes),
    ("chaos", "Kills, power cuts and damaged files that lose or change a result", judge_faults),
    ("mutants", "Planted bugs are caught by the tests", judge_mutants),
    ("identify", "`compsim identify` names the worn joint", count_identified),
)  # fmt: skip


def state(*names, begin="", folder=""):
    """Return what some campaigns found, a line a finding; folder: of their pages, for links."""
    lines = []
    for name in names:
        for words, find in (finding[1:] for finding in FINDINGS if finding[0] == name):
            title = f"[{words}]({folder}{name}.md)" if folder else words
            lines.append(f"{begin}**{title}:** {find(kept(f'{name}.json'))[0]}.\n")
    return "".join(lines)


# ---- tables


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


def default_of(row):
    """The default as a cell: a value, or what stands in its place, and whether it is assumed."""
    word, _, text = row.source.partition(": ")
    if row.default is None or row.kind == "text":
        return text or ("as the joints'" if row.source == "as the joints'" else "")
    shown = str(row.default).lower() if row.kind == "boolean" else str(row.default)
    assumed = ", assumed" if word == "assumed" else ", inferred" if "inferred" in word else ""
    return shown.removesuffix(".0") + assumed


def key_rows(rows):
    """One row for the parts of a key, such as the two joints: its name and its phrase."""
    found = {}
    for row in rows:
        whole, _, part = row.key.rpartition(".")
        if part in parts_by_key().get(whole, ()):
            name = f"{whole}.{{{', '.join(parts_by_key()[whole])}}}"
            found.setdefault(name, (row, row.phrase.replace(f" {PART_WORDS[part]}", "")))
        else:
            found[row.key] = (row, row.phrase)
    return found


def needs_of(row, group):
    """The conditions under which a case reads a key, but for those of its group."""
    known = (CLEARANCE, group, *READ.get(group, ()))
    # of "a" and "a or b" it is "a"
    needed = [one for one in row.read if not any(o != one and o in one for o in row.read)]
    mine = [one for one in dict.fromkeys(needed) if not (one in known or CLEARANCE in one)]
    return f"; needs `{' and '.join(mine)}`" if mine else ""


# kind -> what a value may be beside the words of its row
OTHERWISE = {"accuracy": "{metric: relative error}", "text": "[A-Za-z0-9._-], at most 64",
             "card": "path of a CSV file"}  # fmt: skip


def range_of(row):
    """The allowed values of a row, such as auto | (0, 5]."""
    if row.kind == "materials":
        return "two of " + ", ".join(row.choices)
    more = row.span if row.is_number else OTHERWISE.get(row.kind, "")
    return " | ".join([*row.words, *filter(None, [more])])


def parameter_table(rows, group):
    """The table of parameters in Markdown; `compressor.cases.table.table` has the rows."""
    head = ["key", "default", "range", "what it is"]
    lines = []
    for name, (row, phrase) in key_rows(rows).items():
        needs = needs_of(row, group) if name == row.key and group else ""
        tested = "; tested {:g} to {:g}".format(*row.judged) if row.judged else ""
        cells = (f"`{name}`", default_of(row), range_of(row) + tested, phrase + needs)
        lines.append([cell.replace("|", "\\|") for cell in cells])
    needed = " and ".join(READ.get(group, ())).replace(CLEARANCE, "a joint with clearance")
    return (f"Needs {needed}.\n\n" if needed else "") + markdown(head, lines)


def parameter_tables():
    """The table of parameters in parts, a heading each: the keys of a case, then its groups."""
    rows = {}
    for row in table().values():
        group, dot, _ = row.key.partition(".")
        alone = not dot or group in ("clearance_mm", "healthy_clearance_mm", "initial_offset_mm")
        rows.setdefault("Load and joints" if alone else group, []).append(row)
    return "\n".join(
        f"### {group}\n\n{parameter_table(of, group if group in GROUPS else '')}"
        for group, of in rows.items()
    )


def nameplate_table(found=None):
    """What the case file of `compsim init machine` gives over the small end's clearance."""
    rows = [
        [f"{row['clearance_mm']:g}", f"{row['peak_contact_force'] / 1e3:.3g}",
         f"{row['impacts_per_rev']:.3g}", f"{row['sensor_rms']:.2g}",
         f"{math.degrees(row['rod_load_reversal_angle']):.0f}",
         f"{1e3 * row['body_velocity_rms']:.2f}"]
        for row in (found or kept("nameplate.json"))["rows"]
    ]  # fmt: skip
    head = ["small end, mm", "peak force on it, kN", "dry contacts a revolution",
            "sensor, m/s² rms", "rod load reversal, °", "body along x, mm/s rms"]  # fmt: skip
    return markdown(head, rows)


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


def reason_table():
    """The reasons of failures, what they mean and what to do."""
    rows = [[f"`{one}`", one.meaning, one.remedy] for one in Reason]
    return markdown(["reason", "what it means", "what to do"], rows)


def block(name):
    """Pattern of a generated block: its opening comment, the table, its closing comment."""
    return re.compile(rf"(<!-- {name}: [^>]*-->\n)(.*?)(<!-- end of {name} -->)", re.DOTALL)


def write_blocks(path, blocks):
    """Write generated blocks, texts by name, into a page."""
    text = path.read_text(encoding="utf-8")
    for name, made in blocks.items():
        text, count = block(name).subn(lambda m, made=made: m[1] + made + m[3], text)
        assert count == 1, f"{path} has no block for {name}"
    path.write_text(text, encoding="utf-8")


PAGES = {  # page -> its generated blocks by name
    "README.md": {
        "numbers": lambda: state(
            "accuracy", "peers", "stress", "identify", begin="- ", folder="tests/results/"
        )
    },
    "configs/README.md": {"parameters": parameter_tables},
    "compressor/docs/extremes.md": {
        "reasons": reason_table,
        "stress-words": lambda: state("stress"),
    },
    "compressor/docs/diagnosis.md": {"identify-words": lambda: state("identify")},
    "compressor/docs/my-machine.md": {"nameplate": nameplate_table, "decides": deciding_table},
    "compressor/docs/speed-or-accuracy.md": {"choose": choose_table},
}

if __name__ == "__main__":
    for page, blocks in PAGES.items():
        write_blocks(ROOT / page, {name: make() for name, make in blocks.items()})
