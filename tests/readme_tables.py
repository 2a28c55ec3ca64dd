"""The README's generated tables: `make readme` writes them, tests/test_readme.py compares them."""

import json
import re
import sys
from pathlib import Path

from compressor.case import table
from compressor.parameter import parameter_table

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "tests" / "results"


def kept(name):
    """A kept measurement of tests/results."""
    return json.loads((RESULTS / name).read_text(encoding="utf-8"))


def accuracy_table():
    lines = ["| accuracy | rtol | worst error of acceleration, relative L2 | of its peak |",
             "|---|---|---|---|"]  # fmt: skip
    for word, row in kept("accuracy.json")["words"].items():
        lines.append(
            f"| {word} | {row['rtol']:g} | {row['acceleration_error']:.1e} "
            f"| {row['peak_error']:.1e} |"
        )
    return "\n".join(lines) + "\n"


def claims_table():
    measured = kept("claims.json")
    default = next(
        row for row in measured["masses"]
        if (row["rod_mass_kg"], row["reciprocating_mass_kg"]) == (4.7, 14.0)
    )  # fmt: skip
    lines = ["| claim | at the default masses | over the mass sets |", "|---|---|---|"]
    for claim, held in zip(measured["claims"], default["held"], strict=True):
        verdict = "held" if held else "not held"
        lines.append(
            f"| {claim['claim']}. {claim['statement']} | {verdict} "
            f"| {claim['held']} of {claim['of']} |"
        )
    return "\n".join(lines) + "\n"


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


def peers_table():
    kept_rows = kept("peers.json")["rows"]
    lines = [
        "| tool | settings | CPU s | error | our CPU s | our rtol | times faster | solver alone |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for tool in dict.fromkeys(row["tool"] for row in kept_rows):
        rows = [row for row in kept_rows if row["tool"] == tool]
        if not any("seconds" in row for row in rows):
            lines.append(f"| {tool} | {rows[0]['reason']} | | | | | | |")
            continue
        cells = [tool, rows[0]["settings"]]
        for key, digits in (
            ("seconds", 2), ("error", 1), ("our_seconds", 2), ("our_rtol", 1),
            ("ratio", 2), ("kernel_wall_ratio", 2),
        ):  # fmt: skip
            cells.append(of_scenes(rows, key, digits))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


TABLES = {
    "parameters": lambda: parameter_table(table().values()),
    "accuracy": accuracy_table,
    "claims": claims_table,
    "store": store_table,
    "peers": peers_table,
}


def block(name):
    """Pattern of a generated block: its opening comment, the table, its closing comment."""
    return re.compile(rf"(<!-- {name}: [^>]*-->\n)(.*?)(<!-- end of {name} -->)", re.DOTALL)


def main(path):
    text = Path(path).read_text(encoding="utf-8")
    for name, make in TABLES.items():
        text, count = block(name).subn(lambda m, make=make: m[1] + make() + m[3], text)
        assert count == 1, f"{path} has no block for {name}"
    Path(path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
