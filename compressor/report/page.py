"""The report as one HTML page: it holds its figures, and escapes everything it prints.

Whatever is no `Html` is text from a file or a user, and is escaped where it enters an element.
"""

import base64
import datetime
import html
import itertools
import math
import platform
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import compressor
from compressor.analysis import SPOKEN, Claim
from compressor.cases import MODEL_VERSION
from compressor.report.figures.sweep_metric import Measure, measures
from compressor.store import Folder, StoredStudy

LIBRARIES = ("numpy", "scipy", "numba", "xarray", "h5py", "matplotlib")
MOST_ROWS = 500
LONG = 36  # characters, from which a cell's text may be broken into lines

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1b1b; background: #fff;
  max-width: 72rem; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .5rem; }
h2 { font-size: 1.3rem; margin: 2.6rem 0 .6rem; border-bottom: 2px solid #1f4488; }
h3 { font-size: 1.05rem; margin: 1.8rem 0 .4rem; }
p, li { max-width: 50rem; }
a { color: #1f4488; }
nav ul { columns: 3 15rem; padding-left: 1.2rem; font-size: .92rem; }
figure { margin: 1.6rem 0 2.2rem; }
figure img { width: 100%; height: auto; }
figcaption { font-size: .95rem; max-width: 50rem; }
.scroll { overflow-x: auto; margin: .6rem 0 1rem; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .45rem; border-bottom: 1px solid #d9d9d9; text-align: left;
  vertical-align: top; }
th { background: #f1f3f7; vertical-align: bottom; }
td { white-space: nowrap; }
td.number { text-align: right; }
td.prose { white-space: normal; min-width: 13rem; overflow-wrap: break-word; }
td ul { margin: 0; padding-left: 1rem; min-width: 24rem; }
tr.failed td { background: #fbe9e4; }
tr.missing td { background: #f4f4f4; color: #555; }
.held { color: #1d5c2e; font-weight: 600; }
.not-held { color: #a3341a; font-weight: 600; }
.not-measured { color: #555; font-weight: 600; }
code, pre { font-family: ui-monospace, monospace; font-size: .85em; }
p code, li code, dd code, td.prose code { overflow-wrap: anywhere; }
pre { background: #f6f6f6; padding: .7rem; overflow-x: auto; }
dt { font-weight: 600; }
dd { margin: 0 0 .4rem 1.2rem; overflow-wrap: anywhere; }
@media print {
  body { max-width: none; padding: 0; font-size: 11px; }
  nav { display: none; }
  figure, tr { break-inside: avoid; }
  .scroll { overflow: visible; }
}
"""
VERDICTS = {
    True: ("held", "held"),
    False: ("not-held", "not held"),
    None: ("not-measured", "not measured"),
}


class Html(str):
    """Markup: what need not be escaped any more."""


class Numbers(str):
    """Numbers that are text already, in a table."""


@dataclass(frozen=True)
class Section:
    """A part of the page; `anchor` is its place in the list of contents."""

    anchor: str
    title: str
    body: Html


@dataclass(frozen=True)
class Plate:
    """A figure that has been drawn, under the name of its files."""

    name: str
    heading: str
    caption: str
    png: bytes
    svg: bytes


def text(value: object) -> Html:
    """Anything as markup."""
    return value if isinstance(value, Html) else Html(html.escape(str(value)))


def joined(parts: Iterable[object], between: str = "\n") -> Html:
    """Parts one after the other."""
    return Html(between.join(text(part) for part in parts))


def element(tag: str, content: object = "", **attributes: str) -> Html:
    """An element; a trailing underscore frees an attribute's name from Python's keywords."""
    names = {name: name.rstrip("_").replace("_", "-") for name in attributes}
    given = "".join(f' {names[k]}="{html.escape(v)}"' for k, v in attributes.items() if v)
    return Html(f"<{tag}{given}>{text(content)}</{tag}>")


def listing(items: Iterable[object]) -> Html:
    """A list with a bullet an item."""
    return element("ul", joined(element("li", item) for item in items))


def terms(pairs: Iterable[tuple[object, object]]) -> Html:
    """A list of terms and what they are."""
    rows = (joined([element("dt", term), element("dd", what)], "") for term, what in pairs)
    return element("dl", joined(rows))


def figure(plate: Plate) -> Html:
    """A figure inside the page, with its caption and links to its files beside the page."""
    data = base64.b64encode(plate.png).decode()
    image = Html(f'<img src="data:image/png;base64,{data}" alt="{html.escape(plate.heading)}">')
    links = joined(
        (element("a", kind.upper(), href=f"{plate.name}.{kind}") for kind in ("png", "svg")), ", "
    )
    caption = joined([element("strong", plate.heading + "."), plate.caption, links], " ")
    parts = joined([image, element("figcaption", caption)])
    return element("figure", parts, id=plate.name)


def table(head: Sequence[object], rows: Iterable[Html]) -> Html:
    """A table that scrolls sideways where it is too wide."""
    top = element("tr", joined((element("th", cell, scope="col") for cell in head), ""))
    body = joined([element("thead", top), element("tbody", joined(rows))])
    return element(
        "div",
        element("table", body),
        class_="scroll",
        tabindex="0",
        role="region",
        aria_label="table",
    )


def row(cells: Iterable[object], kind: str = "") -> Html:
    """A row of a table: numbers to the right, long text in lines; `kind` may be failed, missing."""
    made = (element("td", number(c) if isinstance(c, float) else c, class_=style(c)) for c in cells)
    return element("tr", joined(made, ""), class_=kind if kind in ("failed", "missing") else "")


def style(cell: object) -> str:
    """The class of a table's cell."""
    if isinstance(cell, float | Numbers):
        return "number"
    return "prose" if len(re.sub(r"<[^>]*>", "", str(cell))) > LONG else ""


def number(value: float) -> str:
    """A measured number to four significant digits; a dash for nan."""
    size = abs(value)
    if math.isnan(value):
        return "–"
    if size < 1e7 and size == int(size):
        return f"{value:.0f}"
    if not 1e-3 <= size < 1e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(size)))}f}"


def columns(shown: Iterable[Measure]) -> dict[str, list[Measure]]:
    """Measures by what stands above their column; both joints share one."""
    found = {}
    for _, same in itertools.groupby(shown, lambda measure: measure.variable):
        group = list(same)
        other = f" | {SPOKEN[group[1].joint]}" if len(group) > 1 else ""
        unit = f" ({group[0].unit})" if group[0].unit else ""
        found[group[0].title + other + unit] = group
    return found


def numbers(values: Sequence[float]) -> Numbers:
    """The numbers of one cell."""
    return Numbers(" | ".join(map(number, values)))


def claims_table(claims: Iterable[Claim]) -> Html:
    """The paper's claims: threshold, what was measured, and whether each held."""
    rows = []
    for claim in claims:
        kind, words = VERDICTS[claim.held]
        note = element("small", claim.note) if claim.note else ""
        statement = joined([f"({claim.number}) {claim.statement}", note], "<br>" if note else "")
        measured = listing(f"{what}: {value}" for what, value in claim.measured)
        rows.append(
            row([statement, element("span", words, class_=kind), claim.threshold, measured])
        )
    return table(["claim", "verdict", "threshold", "measured"], rows)


def outcome(status: object, reason: object) -> str:
    """How a job ended, in words."""
    return f"{status}: {reason}" if reason else str(status)


def axes(data: xr.Dataset) -> dict[str, np.ndarray]:
    """The swept values of a study's jobs, in the order of its `status`, by coordinate."""
    status = data["status"]
    names = [str(n) for n, c in data.coords.items() if {*c.dims} <= {*status.dims} and n != "key"]
    return {
        name: data[name].broadcast_like(status).transpose(*status.dims).values.ravel()
        for name in names
    }


def study_table(data: xr.Dataset) -> Html:
    """A row for every job of a study, as far as a page can hold them."""
    swept, groups = axes(data), columns(measures(data))
    metrics = [[m.of(data).values.ravel() for m in group] for group in groups.values()]
    ends = zip(*(data[name].values.flat for name in ("status", "reason", "key")), strict=True)
    rows = []
    for place, (end, reason, key) in zip(range(MOST_ROWS), ends, strict=False):
        values = [plain(values[place]) for values in swept.values()]
        results = [numbers([series[place] for series in group]) for group in metrics]
        code = element("code", key)
        rows.append(row([*values, outcome(end, reason), *results, code], str(end)))
    body = table([*swept, "status", *groups, "job"], rows)
    if data["status"].size > MOST_ROWS:
        left = f"The first {MOST_ROWS} of {data['status'].size} jobs; open_study gives all."
        body = joined([element("p", left), body])
    return body


def plain(value: Any) -> object:
    """A swept value: a number as the case file may give it, or a word."""
    return Numbers(f"{value:.10g}") if isinstance(value, int | float | np.number) else str(value)


def provenance(studies: Sequence[StoredStudy], results: Folder, command: str) -> Section:
    """What made this page, and the studies it is about."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES)
    facts = terms(
        [
            ("program", f"compsim {compressor.__version__}, model {MODEL_VERSION}"),
            ("libraries", versions),
            ("platform", f"Python {platform.python_version()}, {platform.platform()}"),
            ("results", element("code", Path(results).absolute())),
            ("command", element("code", command)),
            ("written", now),
        ]
    )
    rows = [row(study_source(study)) for study in studies]
    head = ["study", "case file", "command", "versions", "written", "case hashes"]
    return Section("provenance", "Where this comes from", joined([facts, table(head, rows)]))


def study_source(study: StoredStudy) -> list[object]:
    """Where a study comes from: the cells of its row."""
    count = element("summary", f"{len(study.keys)} jobs")
    hashes = element("code", " ".join(study.keys))
    versions = ", ".join(f"{name} {version}" for name, version in study.versions.items())
    code = (element("code", text) for text in (study.case_file, study.command))
    return [study.name, *code, versions, study.written, element("details", joined([count, hashes]))]


def contents(sections: Sequence[Section]) -> Html:
    """The list of contents."""
    links = (element("a", section.title, href=f"#{section.anchor}") for section in sections)
    return element("nav", listing(links), aria_label="contents")


def document(title: str, lead: str, sections: Sequence[Section]) -> str:
    """The whole page."""
    parts = [
        element("section", joined([element("h2", s.title), s.body]), id=s.anchor) for s in sections
    ]
    body = joined([element("h1", title), element("p", lead), contents(sections), *parts])
    head = joined(
        [
            Html('<meta charset="utf-8">'),
            Html('<meta name="viewport" content="width=device-width, initial-scale=1">'),
            element("title", title),
            element("style", Html(STYLE)),
        ]
    )
    page = element("html", joined([element("head", head), element("body", body)]), lang="en")
    return f"<!DOCTYPE html>\n{page}\n"
