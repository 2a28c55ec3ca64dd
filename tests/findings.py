"""The ten findings of tests/results: from the campaigns' files, with a verdict where there is one.

Each function takes `kept`, the reader of a campaign's file, so that a test can hand in other
numbers. `page_tables` writes them into the pages.
"""

from typing import NamedTuple

SHARE_OF_KEPT_PROMISES = 0.99  # that tests/campaigns/test_accuracy.py requires, too
SHARE_WITHIN_BARS = 0.95  # what the error bars are designed for


class Result(NamedTuple):
    measured: str
    required: str = ""  # a limit or an expected value, in words; "" where there is none
    passed: bool | None = None  # None: no limit


def find_published(kept):
    rows = kept("validation.json")["rows"]
    good = sum(abs(row["found"] - row["expected"]) <= row["within"] for row in rows)
    return Result(f"{good} of {len(rows)} within their tolerance", "all", good == len(rows))


def find_peers(kept):
    peers = kept("peers.json")
    apart = max(one["exudyn_to_ours"] for one in peers["agreement"])
    rows = [row for row in peers["rows"] if row["tool"].startswith("Exudyn DOPRI5")]
    times = sorted(row["ratio"] for row in rows)
    return Result(
        f"Exudyn's acceleration differs by at most {apart:.1e} (relative L2); its fastest solver, "
        f"with no smaller error, takes {times[0]:.0f} to {times[-1]:.0f} times our CPU time"
    )


def find_accuracy(kept):
    words = kept("accuracy.json")["words"].values()
    claimed = sum(row["kept"] for row in words)
    good = claimed - sum(row["broken"] for row in words)
    return Result(
        f"{good:,} of {claimed:,} runs ({good / claimed:.2%})", f"{SHARE_OF_KEPT_PROMISES:.0%}",
        good >= SHARE_OF_KEPT_PROMISES * claimed,
    )  # fmt: skip


def find_bars(kept):
    shares = []
    for metrics in kept("accuracy.json")["bars"].values():
        within = sum(row["within"] * row["of"] for row in metrics.values())
        shares.append(within / sum(row["of"] for row in metrics.values()))
    return Result(
        f"{min(shares):.1%} to {max(shares):.1%}, by accuracy level", f"{SHARE_WITHIN_BARS:.0%}",
        min(shares) >= SHARE_WITHIN_BARS,
    )  # fmt: skip


def find_stress(kept):
    found = kept("stress.json")
    cases = found["scenes"] + sum(one["scenes"] for one in found["fresh"])
    wrong = found["silent_wrong"] + sum(len(one["silent_wrong"]) for one in found["fresh"])
    ends = found["ends"]["supported"]
    return Result(
        f"{wrong} of {cases:,} (in the supported range {ends['ok'] / sum(ends.values()):.1%} give "
        "a confirmed result, the others stop with a reason)", "none", not wrong,
    )  # fmt: skip


def find_chaotic(kept):
    row = kept("chaotic.json")["random"]
    return Result(f"{row['within']['2']} of {row['judged']}", "about 95")


def find_chaos(kept):
    campaigns = kept("chaos.json")["campaigns"].values()
    rows = [row for row in campaigns if "skipped" not in row]
    failed, trials = (sum(row[name] for row in rows) for name in ("failed", "trials"))
    return Result(f"{failed} of {trials:,} trials", "none", not failed)


def find_mutants(kept):
    rows = [row for row in kept("mutants.json")["mutants"] if "equivalent" not in row]
    caught = sum(bool(row["caught_by"]) for row in rows)
    return Result(f"{caught} of {len(rows)}", "all", caught == len(rows))


def find_claims(kept):
    found = kept("claims.json")
    margins, plane = found["default"]["margin"], found["map"]
    held = sum(margin >= 0.0 for margin in margins)
    return Result(
        f"{held} of {len(margins)} at the default masses; all {len(margins)} in {plane['all']} of "
        f"{plane['judged']:,} machines with other masses"
    )


def find_identify(kept):
    models = kept("identify.json")["models"].values()
    own, *others = (row["right_where_worn"]["share"] for row in models)
    return Result(
        f"{own:.1%} of records of worn machines of the study's own model; {min(others):.0%} to "
        f"{max(others):.0%} if the machine has another friction law"
    )


FINDINGS = {  # the campaign: what is found, and how often
    "validation": ("Published numbers are reproduced", find_published),
    "peers": ("Another program agrees, and takes longer", find_peers),
    "accuracy": ("Runs that are reported as accurate are accurate", find_accuracy),
    "bars": ("True errors lie within their error bars", find_bars),
    "stress": ("Extreme cases that are wrong without a warning", find_stress),
    "chaotic": ("Averages of chaotic motions agree between two integrators, within two standard "
                "errors", find_chaotic),
    "chaos": ("Kills, power cuts and damaged files that lose or change a result", find_chaos),
    "mutants": ("Planted bugs are caught by the tests", find_mutants),
    "claims": ("Claims of the paper that hold", find_claims),
    "identify": ("`compsim identify` names the worn joint", find_identify),
}  # fmt: skip
PAGE = {"bars": "accuracy.md#error-bars"}  # of findings whose page has another name


def verdict(result):
    return {None: "number", True: "pass", False: "**fail**"}[result.passed]


def findings_table(kept):
    lines = ["| finding | measured | required or expected | verdict |", "|---|---|---|---|"]
    for name, (words, find) in FINDINGS.items():
        result, page = find(kept), PAGE.get(name, f"{name}.md")
        required = result.required or "–"
        cells = [f"[{words}]({page})", result.measured, required, verdict(result)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def result_words(name, kept):
    """Return the finding of a campaign's page as a paragraph, or nothing."""
    if name not in FINDINGS:
        return ""
    words, find = FINDINGS[name]
    result = find(kept)
    of = "required" if result.passed is not None else "expected"
    required = f" ({of}: {result.required})" if result.required else ""
    end = {None: "", True: " **Pass.**", False: " **Fail.**"}[result.passed]
    return f"**{words}:** {result.measured}{required}.{end}\n\n"
