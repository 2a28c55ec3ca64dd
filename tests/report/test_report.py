"""The report: what is on the page, what is not, and that nothing on it escapes or reaches out."""

import base64
import html.parser
import json
import re
import shutil
import sys
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr
from compsim import cli
from conftest import damage_series, keep, part_of, store, without_pictures

from compressor.analysis.runs import paper_cases
from compressor.analysis.shaking import last_revolution
from compressor.cases.case import Case
from compressor.cases.load import load_cases, load_studies
from compressor.program import CompsimWarning
from compressor.reasons import Reason
from compressor.report.figures import FIGURES, pictures
from compressor.report.figures.table import spell
from compressor.report.paper_sections import find_runs
from compressor.report.report import KINDS, write_report
from compressor.store.caveats import study_caveats
from compressor.store.files import StoreError, StoreWarning
from compressor.store.reader import read_job, read_store
from compressor.store.studies import encode, read_studies, write_study

SHORT = ["solve.duration_rev=0.1", "solve.settle_rev=0", "solve.output_step_deg=1"]
DRAFT = ["solve.accuracy=draft"]
VOID = {"meta", "img", "br", "wbr"}
EVIL = "<script>alert('1')</script>&amp;"


class Reader(html.parser.HTMLParser):
    """What a page is made of; asserts that its elements are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.sources, self.ids, self.words = [], [], [], [], []
        self.rows, self.tags, self.jobs = [], set(), {}
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.tags.add(tag)
        self.links += [attrs["href"]] if "href" in attrs else []
        self.sources += [attrs[name] for name in ("src", "srcset", "data") if name in attrs]
        self.ids += [attrs["id"]] if "id" in attrs else []
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append((attrs.get("class"), []))
            self.jobs.setdefault(attrs.get("data-job", ""), self.rows[-1])
        if tag in ("td", "th"):
            self.rows[-1][1].append("")
        assert tag != "img" or attrs.get("alt")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if {"td", "th"} & {*self.open}:
            self.rows[-1][1][-1] += data.replace("\N{NO-BREAK SPACE}", " ")
        if not {"style", "script"} & {*self.open}:
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def read(folder):
    text = (folder / "index.html").read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    return Reader(text)


@pytest.fixture(scope="module")
def full(once, paper_store):
    """The folder of a report on all of the paper's cases."""
    command = f"compsim report {EVIL}"

    def fill(folder):
        with without_pictures():
            write_report(paper_store, folder, command)

    return once("full-report-without-pictures", fill)


@pytest.fixture(autouse=True)
def unpainted(monkeypatch):
    """No pixels are made, which takes seconds; test_figures paints each figure."""
    monkeypatch.setattr(pictures, "render", lambda drawing: bytes(24))


@pytest.fixture(scope="module")
def own_store(tmp_path_factory):
    """A store with a short sweep, none of it the paper's: 2 x 2 jobs."""
    folder = tmp_path_factory.mktemp("own")
    file = folder / "own.yaml"
    file.write_text("joint: big_end\nclearance_mm: [0.1, 0.2]\nmachine: {rod_mass_kg: [3, 5]}\n")
    store(folder / "results", file, overrides=[*SHORT, *DRAFT])
    return folder


@pytest.fixture
def own(own_store, tmp_path):
    """A copy of that store, beside its case file."""
    return shutil.copytree(own_store, tmp_path, dirs_exist_ok=True) / "results"


def fail(folder, key, reason, detail):
    """Make a stored job one that failed."""
    bad = read_job(folder, key)
    metrics = {n: v * np.nan for n, v in bad.items() if "time" not in v.dims and v.dtype == float}
    bad = bad.assign(status="failed", reason=reason, **metrics)
    bad.attrs |= {"detail": detail, "complete": 0}
    replace_jobs(folder, bad)


def replace_jobs(folder, *jobs):
    """Put jobs in place of what was stored of them, which a failed run by itself never is."""
    kept = {key: read_job(folder, key) for key in sorted(read_store(folder).keys())}
    kept |= {job.attrs["key"]: job for job in jobs}
    shutil.rmtree(folder / "batches")
    keep(folder, *kept.values())


# ---- the paper's report -----------------------------------------------------------------------


def test_every_figure_is_drawn_and_shown(full):
    figures = FIGURES["paper"]
    names = {f"{name}.{kind}" for name in figures for kind in KINDS}
    beside = {"index.html", "plotly.min.js"}
    assert {path.name for path in full.iterdir()} == names | beside
    found = read(full)
    assert [name for name in found.ids if name in figures] == [*figures]
    assert len(found.sources) == len(figures)
    for figure in figures.values():
        assert figure.title in found.text


def test_every_csv_has_the_curves_of_its_figure(full):
    """That of Figure 3 was one empty line."""
    for path in full.glob("*.csv"):
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        assert head, path.name
        assert len(rows) > 100, path.name


def test_plotly_takes_every_figure(full, own, tmp_path):
    """Of the paper, of a sweep and of single jobs; plotly refuses what it does not know."""
    with without_pictures():
        write_report(own, tmp_path / "out")
    scripts = [*full.glob("*.js"), *(tmp_path / "out").glob("*.js")]
    scripts = [path for path in scripts if path.name != "plotly.min.js"]
    assert len(scripts) >= 15
    for path in scripts:
        text = path.read_text(encoding="utf-8").removeprefix("compsimFigure(")
        name, _, content = text.removesuffix(");\n").partition(",")
        assert go.Figure(json.loads(content)).data, name


def test_the_first_screen_is_the_answer(full, paper_runs):
    """What was run, the three findings by the runs' numbers, and the claims."""
    text = (full / "index.html").read_text(encoding="utf-8")
    first = Reader("<!DOCTYPE html>" + re.search('<section id="answer">.*?</section>', text,
                                                 re.DOTALL)[0])  # fmt: skip
    assert "The paper's cases : 11 jobs: 11 ok" in first.text
    peak = float(paper_runs["both 0.3"]["peak_acceleration"])
    ideal = float(paper_runs["design"]["peak_acceleration"])
    found = re.search(r"Peak acceleration: from (\S+) .*? to (\S+) .*?, (\S+) times", first.text)
    assert [float(word) for word in found.groups()] == pytest.approx(
        [ideal, peak, peak / ideal], rel=5e-3
    )
    assert "5 of 8 hold, as each is measured" in first.text
    assert first.text.count("not held") == 3


def test_the_page_reaches_for_nothing_outside(full):
    found = read(full)
    assert all((full / source).exists() for source in found.sources)
    anchors = [link[1:] for link in found.links if link.startswith("#")]
    assert set(anchors) <= set(found.ids)
    assert len(anchors) >= 18
    files = [link for link in found.links if not link.startswith("#")]
    assert all((full / link).exists() and "/" not in link for link in files)
    assert not found.tags & {"link", "iframe", "object", "embed", "base"}
    text = (full / "index.html").read_text(encoding="utf-8")
    assert not re.search(r"<script[^>]* src", text)
    assert not re.search(r"https?:|@import|url\(", text)
    assert len(found.ids) == len(set(found.ids))


def test_every_case_has_a_row(full, paper_runs):
    found = read(full)
    rows = {cells[0]: cells for _, cells in found.rows}
    case = rows["both joints, 0.3 mm"]
    run = paper_runs["both 0.3"]
    assert case[1] == "ok: periodic"
    value, *bar = map(float, case[2].split(" ± "))
    error = float(run["peak_acceleration_error"])
    assert value == pytest.approx(float(run["peak_acceleration"]), abs=max(error, 0.5))
    assert bool(bar) == (error >= 5e-4 * value)  # one below the last of four digits is not told
    # a digit of it, and no digit below the last of the value's four
    assert bar == pytest.approx([error] * len(bar), rel=0.6, abs=5e-4 * value)
    for columns, values in (
        (case[5:7], run["knock"].values),
        (case[7:9], run["peak_contact_force"].values / 1e3),
    ):
        both = [float(word.split(" ± ")[0]) for word in columns]
        assert both == pytest.approx(values, rel=1e-3)
    assert run.attrs["key"].startswith(case[-1])
    assert found.jobs[run.attrs["key"]][1] == case
    assert {one.attrs["key"] for one in paper_runs.values()} <= {*found.jobs}
    assert len([name for name in rows if name.endswith((" no clearance", " mm"))]) == 11
    assert rows["big end, 0.1 mm"][10] == "–"  # penetration in an ideal small end


def test_every_claim_has_a_verdict(full):
    rows = [c for _, c in read(full).rows if c[0].startswith("(") and len(c) == 4]
    assert [cells[0][1] for cells in rows] == list("12345678")
    verdicts = [
        re.fullmatch(r"(held|not held)margin ([+-]\S+) %(?: \(± \S+ %(?:, undecided)?\))?", c[1])
        for c in rows
    ]
    assert all((found[1] == "held") == (float(found[2]) > 0) for found in verdicts)
    assert verdicts[0][1] == "held"
    assert "by construction" in rows[0][0]
    assert all(cells[2] and cells[3] for cells in rows)


def test_the_page_says_what_is_assumed_and_how_it_was_made(full):
    text = read(full).text
    for words in ("rod 4.7 kg", "14 kg", "clearance is radial", "Claim (1) holds by construction",
                  "numpy ", "big-end.yaml", f"compsim report {EVIL}"):  # fmt: skip
        assert words in text


# ---- what is missing --------------------------------------------------------------------------


def forget(folder, key):
    """Make a job one that is not stored."""
    stored = read_store(folder)
    others = [stored.job(other).load() for other in sorted(stored.keys() - {key})]
    shutil.rmtree(folder / "batches")
    keep(folder, *others)


def test_missing_cases_are_named_with_what_gives_them(paper_store, tmp_path):
    part = part_of(paper_store, tmp_path / "part", "design", "typical", "big-end")
    gone = next(s for s in read_studies(part) if s.name == "big-end").keys[1]
    forget(part, gone)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "figure-09.csv").write_text("an earlier report's")
    write_report(part, tmp_path / "out")
    assert {p.name for p in (tmp_path / "out").glob("figure-*.png")} == {
        f"{name}.png"
        for name, one in FIGURES["paper"].items()
        if {*one.needs} <= {"design", "typical"}
    }
    assert not (tmp_path / "out" / "figure-09.csv").exists()
    found = read(tmp_path / "out")
    assert "Figure 9: Contact force at the big end needs big end, 0.2 mm (not stored)" in found.text
    assert "typical model needs" not in found.text
    assert "compsim init paper writes a file that has all cases of the paper" in found.text
    assert f"compsim run paper.yaml -r {part} runs those that are not stored" in found.text
    assert cli.main(["init", "paper", "-o", str(tmp_path / "paper.yaml")]) == 0
    given = {case.physics_key for case in load_cases(tmp_path / "paper.yaml")}
    assert given == {case.physics_key for case in paper_cases().values()}
    rows = {cells[0]: kind for kind, cells in found.rows}
    assert rows["big end, 0.2 mm"] == "missing"
    assert rows["big end, 0.1 mm"] is None


def test_a_failed_case_is_told_with_its_reason(paper_store, tmp_path):
    part = part_of(paper_store, tmp_path / "part", "design", "typical")
    key = next(s for s in read_studies(part) if s.name == "design").keys[0]
    fail(part, key, "non_finite", EVIL)
    paper = find_runs(read_store(part), read_studies(part), paper_cases())
    assert paper.absent["design"] == "failed: non_finite"
    assert "design" not in paper.usable
    write_report(part, tmp_path / "out")
    found = read(tmp_path / "out")
    assert "design model, no clearance (failed: non_finite)" in found.text
    assert "A case that failed is run again with --rerun failed" in found.text
    assert ("failed", "failed: non_finite") in [(k, c[1]) for k, c in found.rows if len(c) > 1]
    assert [p.name for p in (tmp_path / "out").glob("*.png")] == ["figure-03.png"]


def test_a_damaged_case_is_told(paper_store, tmp_path):
    part = part_of(paper_store, tmp_path / "part", "typical")
    path = damage_series(part, read_studies(part)[0].keys[0])
    with pytest.warns(StoreWarning, match=f"{path.name}: is damaged"):
        paper = find_runs(read_store(part), read_studies(part), paper_cases())
    assert paper.absent["typical"] == "its file is damaged"
    assert not paper.stored


def test_the_paper_s_cases_say_how_far_their_numbers_are_settled(full, paper_store):
    page, stored = read(full).text, read_store(paper_store)
    found = {study.name: study_caveats(stored, study) for study in read_studies(paper_store)}
    assert any("settled after solve" in text for texts in found.values() for text in texts)
    for name, texts in found.items():
        for text in texts:
            assert f"{name}: {text}" in page


def test_metrics_without_series_have_tables_but_no_figures(paper_store, tmp_path):
    part = part_of(paper_store, tmp_path / "part", "typical")
    (key,) = read_store(part).keys()
    replace_jobs(part, read_job(part, key).drop_dims("time"))
    write_report(part, tmp_path / "out", limits=["peak_acceleration=300,400 m/s2"])
    found = read(tmp_path / "out")
    assert "stored without its time series" in found.text
    assert not found.sources
    (row,) = [cells for _, cells in found.rows if cells[0] == "typical model, no clearance"]
    assert row[2] == "394.8 B"
    assert "Zones of peak acceleration, by limits that were given: A below 300" in found.text


def test_the_most_exact_run_is_shown(paper_store, tmp_path):
    part = part_of(paper_store, tmp_path / "part", "typical")
    (tmp_path / "exact.yaml").write_text("load: gas\nsolve: {rtol: [1e-3, 1e-7]}\n")
    store(part, tmp_path / "exact.yaml")
    found = find_runs(read_store(part), read_studies(part), paper_cases())
    assert found.usable["typical"].attrs["rtol"] == 1e-7


# ---- a user's own sweep -----------------------------------------------------------------------


def test_a_sweep_has_its_table_and_plots(own, tmp_path):
    path = write_report(own, tmp_path / "out")
    assert path == tmp_path / "out" / "index.html"
    drawn = {"sweep-own-ranking", "sweep-own-map"}  # no revolution is settled
    assert {p.stem for p in (tmp_path / "out").glob("*.png")} == drawn
    found = read(tmp_path / "out")
    assert len(found.sources) == 2
    head = next(cells for _, cells in found.rows if cells[0] == "clearance_mm")
    assert head[:4] == ["clearance_mm", "rod_mass_kg", "status", "peak acceleration (m/s²)"]
    rows = {key: cells for key, (_, cells) in found.jobs.items()}
    (study,) = read_studies(own)
    for key, point in zip(study.keys, [(0.1, 3), (0.1, 5), (0.2, 3), (0.2, 5)], strict=True):
        with read_job(own, key) as run:
            peak = float(run["peak_acceleration"])
        assert (float(rows[key][0]), float(rows[key][1])) == point
        assert float(rows[key][3].split(" ± ")[0]) == pytest.approx(peak, rel=1e-3)
    assert "4 jobs: 4 ok." in found.text
    assert found.ids.index("study-own") < found.ids.index("jobs-own")
    # nothing of the paper stands over a sweep of one's own
    assert not {"figures", "claims", "cases", "missing"} & {*found.ids}
    assert "Figure" not in found.text


def test_a_sweep_is_drawn_over_the_crank_angle(tmp_path):
    """By the greatest of two clearances at the rod's first mass; a damaged job is left out."""
    file, own = tmp_path / "own.yaml", tmp_path / "results"
    titled = "report: {title: Unit 3, notes: Rod weighed.}\nhealthy_clearance_mm: 0.1\n"
    swept = "joint: big_end\nclearance_mm: [0.1, 0.2]\nmachine: {rod_mass_kg: [3, 5]}\n"
    file.write_text(swept + titled)
    settings = ["solve.duration_rev=2", "solve.settle_rev=1", *DRAFT]
    (whole,) = load_studies(file, overrides=settings)
    write_study(own, whole, "compsim run", settings)
    store(own, file, overrides=settings)
    write_report(own, tmp_path / "out")
    raw = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "<h1>Unit 3</h1>" in raw
    assert "<title>Unit 3</title>" in raw
    assert '<p class="notes">Rod weighed.</p>' in raw
    assert f", with <code>{'</code>, <code>'.join(settings)}</code>.</p>" in raw
    assert "Without clearance and worn" in read(tmp_path / "out").text  # test_worn_and_ideal
    drawn = {"sweep-own-ranking", "sweep-own-map", "cycles-own", "analyst-own"}
    assert {p.stem for p in (tmp_path / "out").glob("*.png")} == drawn
    text = " ".join(read(tmp_path / "out").text.split())
    (study,) = read_studies(own)
    peaks = {}
    for key, clearance in zip(study.keys[::2], (0.1, 0.2), strict=True):
        with read_job(own, key) as run:
            _, last = last_revolution(run)
            peaks[clearance] = np.abs(last["acceleration"].values).max()
    assert peaks[0.1] < peaks[0.2]
    ends = [f"{spell(peak)} m/s² at {clearance}" for clearance, peak in peaks.items()]
    assert f"Greatest magnitude: least {ends[0]}, greatest {ends[1]};" in text
    assert "own: a revolution as an analyst reads it, clearance_mm 0.2" in text
    assert f"Greatest acceleration: {spell(peaks[0.2])} m/s² (" in text
    assert "It is the job with the greatest vibration of these. Here machine.rod_mass_kg 3." in text
    damage_series(own, study.keys[2])
    write_report(own, tmp_path / "out")
    text = " ".join(read(tmp_path / "out").text.split())
    assert "own: a revolution as an analyst reads it, clearance_mm 0.1" in text
    assert "vibration over crank angle and clearance_mm" not in text


def test_tables_and_figures_may_be_in_plant_units(own, tmp_path):
    write_report(own, tmp_path / "out", units="plant", limits=["rms_acceleration=1 m/s2"])
    found = read(tmp_path / "out")
    head = next(cells for _, cells in found.rows if cells[0] == "clearance_mm")
    assert head[3] == "peak acceleration (g)"
    for key in read_studies(own)[0].keys:
        _, cells = found.jobs[key]
        with read_job(own, key) as run:
            peak, rms = (float(run[f"{name}_acceleration"]) for name in ("peak", "rms"))
        assert float(cells[3].split(" ± ")[0]) == pytest.approx(peak / 9.80665, rel=1e-3)
        assert cells[4].endswith(" B") == (rms >= 1.0)  # the limit is 1 m/s2
    assert "Zones of rms acceleration, by limits that were given: A below 0.101972 g" in found.text
    table = (tmp_path / "out" / "sweep-own-map.csv").read_text(encoding="utf-8")
    assert "peak acceleration: g" in table


def section(folder, anchor):
    """The text of a section of the page."""
    text = (folder / "index.html").read_text(encoding="utf-8")
    (found,) = re.findall(rf'<section id="{anchor}">(.*?)</section>', text, re.DOTALL)
    return Reader(found).text


def test_a_study_says_what_was_given_swept_and_assumed(own, tmp_path):
    file = tmp_path / "fed.yaml"
    file.write_text(
        "load: gas\njoint: big_end\nclearance_mm: 0.2\n"
        "machine: {stroke_mm: 240, rod_mass_kg: [3, 5], pin_radius_mm: 10}\n"
    )
    store(own, file, overrides=[*SHORT, *DRAFT])
    write_report(own, tmp_path / "out", studies=["fed"])
    text = section(tmp_path / "out", "study-fed")
    _, text = text.split("Inputs The machine without clearance, by what was given ")
    told, text = text.split(" Given ")
    given, text = text.split(" Swept ")
    swept, text = text.split(" Not given: values of the program ")
    assumed, _ = text.split(" Without clearance and worn ")
    assert "rod load tension" in told
    # the stroke and the pin are the program's own values, too, but the file gives them
    for words in ("load gas", "clearance 0.2 mm", "stroke 240 mm", "pin radius 10 mm"):
        assert words in given
        assert words not in assumed
    assert swept == "machine rod mass 3, 5 kg"
    for words in ("reciprocating mass 14 kg", "speed 500 rpm", "suction 0.105 MPa", "law impact"):
        assert words in assumed
        assert words not in given
    assert "rod mass" not in assumed
    assert "viscosity" not in assumed  # there is no oil


def test_studies_are_chosen_and_trials_come_last(own, tmp_path, capsys):
    """The 18 jobs of a search headed the page, since their name comes first."""
    (study,) = read_studies(own)
    trial = replace(study, name="a-find-x", command="compsim find own.yaml --over x=1:2")
    (own / "studies" / "a-find-x.json").write_bytes(encode(trial))
    write_report(own, tmp_path / "out")
    ids = [name for name in read(tmp_path / "out").ids if name.startswith("study-")]
    assert ids == ["study-own", "study-a-find-x"]
    first = section(tmp_path / "out", "answer")
    assert "Study a-find-x : 4 jobs" in first
    assert first.count("Peak contact force") == 1
    report = ["report", "-r", str(own), "-o", str(tmp_path / "out")]
    assert cli.main([*report, "a-find-x"]) == 0
    assert "study-own" not in read(tmp_path / "out").ids
    assert "Peak contact force" in section(tmp_path / "out", "answer")
    capsys.readouterr()
    assert cli.main([*report, "onw"]) == 2
    assert "did you mean own" in capsys.readouterr().err


def test_a_study_among_the_paper_s_cases_keeps_its_section_and_notes(paper_store, tmp_path):
    """It was told by the paper's figures alone; so was one of two of the three clearances."""
    part = part_of(paper_store, tmp_path / "part", "design", "typical", "big-end")
    whole = next(one for one in read_studies(paper_store) if one.name == "big-end")
    two = replace(whole, name="two", keys=whole.keys[:2],
                  axes=(replace(whole.axes[0], values=whole.axes[0].values[:2]),))  # fmt: skip
    noted = replace(whole, name="noted", title="Unit 3", notes="Rod weighed in March.")
    for one in (two, noted):
        (part / "studies" / f"{one.name}.json").write_bytes(encode(one))
    write_report(part, tmp_path / "out")
    found = [name for name in read(tmp_path / "out").ids if name.startswith("study-")]
    assert found == ["study-noted", "study-two"]
    assert "Rod weighed in March." in section(tmp_path / "out", "study-noted")


def test_a_page_is_one_file(own, tmp_path, capsys):
    """By mail the page came without its figures."""
    assert cli.main(["report", "-r", str(own), "--single", "-o", str(tmp_path / "mailed")]) == 0
    out, err = capsys.readouterr()
    file = tmp_path / "mailed.html"
    assert out == f"{file}\n"
    assert " MB, all in one file" in err
    assert not (tmp_path / "mailed").exists()
    text = file.read_text(encoding="utf-8")
    found = Reader(text)
    assert found.sources
    for source in (*found.sources, *(link for link in found.links if link[0] != "#")):
        kind, data = source.split(";base64,")
        assert kind in ("data:image/png", "data:text/csv")
        assert base64.b64decode(data)
    write_report(own, tmp_path / "out")
    for script in (tmp_path / "out").glob("*.js"):
        assert script.read_text(encoding="utf-8").strip() in text
    pictures = {path.read_bytes() for path in (tmp_path / "out").glob("*.png")}
    assert {base64.b64decode(one.split(",")[1]) for one in found.sources} == pictures


def test_failed_jobs_are_highlighted_and_everything_is_escaped(own, tmp_path):
    (study,) = read_studies(own)
    fail(own, study.keys[2], "non_finite", f"detail {EVIL}")
    forget(own, study.keys[3])
    evil = replace(study, case_file=f"/{EVIL}.yaml", command=EVIL)
    (own / "studies" / "own.json").write_bytes(encode(evil))
    write_report(own, tmp_path / "out", EVIL)
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    found = Reader(text)
    assert text.count("<script") == 2
    assert "alert('1')</script>" not in text
    assert f"Case file /{EVIL}.yaml ." in found.text
    assert f"clearance_mm 0.2, rod_mass_kg 3: non_finite: detail {EVIL}" in found.text
    assert "4 jobs: 2 ok, 1 failed, 1 not run." in found.text
    kinds = {key: kind for key, (kind, _) in found.jobs.items()}
    assert [kinds[key] for key in study.keys] == [None, None, "failed", "missing"]
    assert all("<" not in p.name and "/" not in p.name for p in (tmp_path / "out").iterdir())


def test_a_study_whose_card_is_gone_costs_the_page_itself_alone(own, tmp_path):
    card = tmp_path / "head.csv"
    rows = (f"{angle},{0.4 + 0.2 * np.cos(np.radians(angle))}" for angle in range(0, 360, 5))
    card.write_text("\n".join(["crank_angle_deg,pressure_MPa", *rows]))
    file = tmp_path / "measured.yaml"
    file.write_text(
        f"load: gas\ngas: {{indicator: {{head: {card}}}}}\nclearance_mm: 0.1\njoint: both\n"
    )
    store(own, file, overrides=[*SHORT, *DRAFT])
    card.unlink()
    with pytest.warns(CompsimWarning, match="study measured is left out: .*put the card of that"):
        page = write_report(own, tmp_path / "report")
    text = page.read_text()
    assert "Study measured is left out" in text
    assert "Study own" in text


def test_long_tables_are_cut_and_say_so(own, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules["compressor.report.study_section"], "MAX_ROWS", 3)
    write_report(own, tmp_path / "out")
    found = read(tmp_path / "out")
    assert "The first 3 of 4 jobs" in found.text
    (study,) = read_studies(own)
    assert {*found.jobs} - {""} == {*study.keys[:3]}


def test_a_study_whose_jobs_all_broke_has_a_page(own, tmp_path):
    broken = []
    for key in sorted(read_store(own).keys()):
        attrs = {"key": key, "detail": "ValueError: a bug", "case": json.dumps(Case().values())}
        broken.append(xr.Dataset({"status": "failed", "reason": "internal_error"}, attrs=attrs))
    replace_jobs(own, *broken)
    write_report(own, tmp_path / "out")
    found = read(tmp_path / "out")
    assert found.text.count("internal_error: ValueError: a bug") == 4
    assert found.text.count(f"internal_error: {Reason.INTERNAL_ERROR.remedy}") == 1
    assert not found.sources


# ---- files ------------------------------------------------------------------------------------


def test_an_interrupted_report_leaves_the_old_one(own, tmp_path, monkeypatch):
    out = tmp_path / "out"
    write_report(own, out, "first")
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def interrupt(figure):
        raise KeyboardInterrupt

    monkeypatch.setattr(pictures, "render", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_report(own, out, "second")
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_a_report_that_cannot_be_written_is_an_error(own, tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(StoreError, match="out"):
        write_report(own, tmp_path / "out")
