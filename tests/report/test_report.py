"""The report: what is on the page, what is not, and that nothing on it escapes or reaches out."""

import base64
import csv
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
from conftest import damage_series, keep, part_of, store, store_cases, without_pictures

from compressor.analysis import last_revolution, paper_cases
from compressor.analysis.runs import CLEARANCES, FAULTS, case_of, label
from compressor.cases import Axis, Case, load_cases, load_studies
from compressor.program import CompsimWarning
from compressor.reasons import Reason
from compressor.report import inputs, interactive, write_report
from compressor.report.figures import FIGURES, pictures
from compressor.report.figures.drawing import panels_of
from compressor.report.figures.table import spell
from compressor.report.interactive import draw_job
from compressor.report.paper_sections import comparable, find_runs
from compressor.report.report import has_spring
from compressor.store import StoreWarning, read_job, read_store, read_studies, study_caveats
from compressor.store.studies import encode, write_study

SHORT = ["solve.duration_rev=0.1", "solve.settle_rev=0", "solve.output_step_deg=1"]
DRAFT = ["solve.accuracy=draft"]
VOID = {"meta", "img", "br", "wbr"}
EVIL = "' onx=\"1\" '><script>alert('1')</script>&amp;"
ATTRIBUTES = {
    "alt", "aria-label", "charset", "class", "content", "data-job", "data-results",
    "data-series", "data-title", "data-value", "decoding", "download", "height", "href", "id",
    "lang", "method", "name", "role", "scope", "src", "tabindex", "width",
}  # fmt: skip


class Reader(html.parser.HTMLParser):
    """What a page is made of; asserts that its elements are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.sources, self.ids, self.words = [], [], [], [], []
        self.rows, self.tags, self.attributes, self.jobs = [], set(), set(), {}
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.tags.add(tag)
        self.attributes |= {*attrs}
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


def section(folder, anchor):
    text = (folder / "index.html").read_text(encoding="utf-8")
    (found,) = re.findall(rf'<section id="{anchor}">(.*?)</section>', text, re.DOTALL)
    return Reader(found).text


def written(results, place, *command, **how):
    write_report(results, place / "out", *command, **how)
    return read(place / "out")


@pytest.fixture(scope="module", autouse=True)
def unpainted():
    """No pixels are made, which takes seconds; test_figures paints each figure."""
    with without_pictures():
        yield


@pytest.fixture(scope="module")
def full(once, paper_store):
    command = f"compsim report {EVIL}"
    return once("unpainted-report", lambda folder: write_report(paper_store, folder, command))


@pytest.fixture(scope="module")
def own_store(tmp_path_factory):
    """A store with a short sweep, none of it the paper's: 2 x 2 jobs."""
    folder = tmp_path_factory.mktemp("own")
    solve = {"duration_rev": 0.1, "settle_rev": 0, "output_step_deg": 1, "accuracy": "draft"}
    swept = {"clearance_mm": [0.1, 0.2], "machine": {"rod_mass_kg": [3, 5]}}
    store_cases(folder, own={"joint": "big_end", **swept, "solve": solve})
    return folder


@pytest.fixture
def own(own_store, tmp_path):
    return shutil.copytree(own_store, tmp_path, dirs_exist_ok=True) / "results"


def fail(folder, key, reason, detail):
    bad = read_job(folder, key)
    metrics = {n: v * np.nan for n, v in bad.items() if "time" not in v.dims and v.dtype == float}
    bad = bad.assign(status="failed", reason=reason, **metrics)
    bad.attrs |= {"detail": detail, "complete": 0}
    replace_jobs(folder, bad)


def replace_jobs(folder, *jobs, without=()):
    """Put jobs in place of what was stored of them, which a failed run by itself never is."""
    kept = {key: read_job(folder, key) for key in sorted(read_store(folder).keys() - {*without})}
    kept |= {job.attrs["key"]: job for job in jobs}
    shutil.rmtree(folder / "batches")
    keep(folder, *kept.values())


# ---- the paper's report -----------------------------------------------------------------------


def test_every_figure_is_drawn_and_shown(full):
    figures = FIGURES["paper"]
    names = {f"{name}.{kind}" for name in figures for kind in ("png", "csv", "js")}
    assert {path.name for path in full.iterdir()} == names | {"index.html", "plotly.min.js"}
    found = read(full)
    assert [name for name in found.ids if name in figures] == [*figures]
    assert len(found.sources) == len(figures)
    for name, figure in figures.items():
        assert figure.title in found.text
        head, *rows = (full / f"{name}.csv").read_text(encoding="utf-8").splitlines()
        assert head, name
        assert len(rows) > 100, name
        text = (full / f"{name}.js").read_text(encoding="utf-8")
        _, _, content = text.removesuffix(");\n").partition(",")
        assert go.Figure(json.loads(content)).data, name  # plotly refuses what it does not know


def test_the_first_screen_is_the_answer(full, paper_runs):
    """What was run, the three findings by the runs' numbers, and the claims."""
    first = section(full, "answer")
    assert "The paper's cases : 11 jobs: 11 ok" in first
    peak = float(paper_runs["both 0.3"]["peak_acceleration"])
    ideal = float(paper_runs["design"]["peak_acceleration"])
    found = re.search(r"Peak acceleration: from (\S+) .*? to (\S+) .*?, (\S+) times", first)
    told = [float(word) for word in found.groups()]
    assert told == pytest.approx([ideal, peak, peak / ideal], rel=5e-3)
    assert "5 of 8 hold, as each is measured" in first
    assert first.count("not held") == 3


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
    for words in ("big-end.yaml", f"compsim report {EVIL}", "rod 4.7 kg"):  # where it is from
        assert words in found.text


def test_every_case_has_a_row(full, paper_runs):
    found = read(full)
    rows = {cells[0]: cells for _, cells in found.rows}
    case = rows["both joints, 0.3 mm"]
    run = paper_runs["both 0.3"]
    assert case[1] == "ok: periodic"
    peak, bar = (float(run[f"peak_acceleration{end}"]) for end in ("", "_error"))
    assert float(case[2].split(" ± ")[0]) == pytest.approx(peak, abs=max(bar, 0.5))
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
    said = r"(held|not held)margin ([+-]\S+) %(?: \(± \S+ %(?:, undecided)?\))?"
    verdicts = [re.fullmatch(said, cells[1]) for cells in rows]
    assert all((found[1] == "held") == (float(found[2]) > 0) for found in verdicts)
    assert verdicts[0][1] == "held"
    assert "by construction" in rows[0][0]
    assert all(cells[2] and cells[3] for cells in rows)


# ---- what is missing --------------------------------------------------------------------------


def test_missing_failed_and_damaged_cases_are_rows_with_what_gives_them(
    paper_store, tmp_path, compsim
):
    part = part_of(paper_store, tmp_path / "part", "design", "typical", "big-end")
    keys = {study.name: study.keys for study in read_studies(part)}
    damaged, gone, last = keys["big-end"]
    replace_jobs(part, without=[gone])
    fail(part, keys["design"][0], "non_finite", EVIL)
    path = damage_series(part, damaged)
    with pytest.warns(StoreWarning, match=f"{path.name}: is damaged"):
        found = written(part, tmp_path)
    assert [one.name for one in (tmp_path / "out").glob("job-*.js")] == [f"job-{last}.js"]
    assert [one.name for one in (tmp_path / "out").glob("figure-*.png")] == ["figure-03.png"]
    assert "compsim init paper writes a file of all cases" in found.text
    compsim("init", "paper", "-o", tmp_path / "paper.yaml")
    given = {case.physics_key for case in load_cases(tmp_path / "paper.yaml")}
    assert given == {case.physics_key for case in paper_cases().values()}
    rows = {cells[0]: kind for kind, cells in found.rows}
    assert rows["big end, 0.2 mm"] == "missing"
    assert rows["big end, 0.3 mm"] is None
    assert ("failed", "failed: non_finite") in [(k, c[1]) for k, c in found.rows if len(c) > 1]


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
    found = written(part, tmp_path, limits=["peak_acceleration=300,400 m/s2"])
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


@pytest.mark.parametrize(("units", "unit", "size"), [("usual", "m/s²", 1), ("plant", "g", 9.80665)])
def test_a_sweep_has_its_table_and_plots(own, tmp_path, units, unit, size):
    write_report(own, tmp_path / "out", units=units, limits=["rms_acceleration=1 m/s2"])
    drawn = {"sweep-own-ranking", "sweep-own-map"}  # no revolution is settled
    assert {p.stem for p in (tmp_path / "out").glob("*.png")} == drawn
    found = read(tmp_path / "out")
    assert len(found.sources) == 2
    head = next(cells for _, cells in found.rows if cells[0] == "clearance_mm")
    assert head[:4] == ["clearance_mm", "rod_mass_kg", "status", f"peak acceleration ({unit})"]
    assert "The cam of the spring load is" in found.text
    gas = replace(read_studies(own)[0], fixed={"load": "gas"}, axes=())
    assert not has_spring(gas)
    assert has_spring(replace(gas, axes=(Axis("load", ("spring",)),)))
    rows = {key: cells for key, (_, cells) in found.jobs.items()}
    (study,) = read_studies(own)
    for key, point in zip(study.keys, [(0.1, 3), (0.1, 5), (0.2, 3), (0.2, 5)], strict=True):
        with read_job(own, key) as run:
            peak, rms = (float(run[f"{name}_acceleration"]) for name in ("peak", "rms"))
        assert (float(rows[key][0]), float(rows[key][1])) == point
        assert float(rows[key][3].split(" ± ")[0]) == pytest.approx(peak / size, rel=1e-3)
        assert rows[key][4].endswith(" B") == (rms >= 1.0)
    assert f"by limits that were given: A below {1 / size:g} {unit}" in found.text
    table = (tmp_path / "out" / "sweep-own-map.csv").read_text(encoding="utf-8")
    assert f"peak acceleration: {unit}" in table
    assert "4 jobs: 4 ok." in found.text
    assert found.ids.index("study-own") < found.ids.index("jobs-own")
    # nothing of the paper stands over a sweep of one's own
    assert not {"figures", "claims", "cases"} & {*found.ids}
    assert "Figure" not in found.text


def test_a_sweep_is_drawn_over_the_crank_angle(tmp_path):
    """Rows at the rod's first mass, the revolution of the loudest of all; no damaged job."""
    file, own = tmp_path / "own.yaml", tmp_path / "results"
    titled = "report: {title: Unit 3, notes: Rod weighed.}\nhealthy_clearance_mm: 0.1\n"
    swept = "joint: big_end\nclearance_mm: [0.1, 0.2]\nmachine: {rod_mass_kg: [5, 3]}\n"
    file.write_text(swept + titled)
    settings = ["solve.duration_rev=2", "solve.settle_rev=1", *DRAFT]
    (whole,) = load_studies(file, overrides=settings)
    write_study(own, whole, "compsim run", settings)
    store(own, file, overrides=settings)
    text = written(own, tmp_path).text
    raw = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "<h1>Unit 3</h1>" in raw
    assert "<title>Unit 3</title>" in raw
    assert '<p class="notes">Rod weighed.</p>' in raw
    assert f", with <code>{'</code>, <code>'.join(settings)}</code>.</p>" in raw
    assert "Without clearance and worn" in text  # test_worn_and_ideal
    drawn = {"sweep-own-ranking", "sweep-own-map", "cycles-own", "analyst-own"}
    assert {p.stem for p in (tmp_path / "out").glob("*.png")} == drawn
    (study,) = read_studies(own)
    runs = [read_store(own).job(key) for key in study.keys]
    peaks = [spell(np.abs(last_revolution(run)[1]["acceleration"]).max()) for run in runs]
    assert f", greatest {peaks[2]} m/s² at 0.2;" in text
    assert "Here machine.rod_mass_kg 5." in text
    places = [f"clearance {c} mm, rod mass {m} kg" for c in (0.1, 0.2) for m in (5, 3)]
    loudest = max(range(4), key=lambda n: float(runs[n]["peak_acceleration"]))
    assert loudest == 3  # no row of the map: the figure had the greatest of these
    title = "own: a revolution as an analyst reads it, {} (clearance at the big end)"
    assert title.format(places[3]) in text
    assert f"Greatest acceleration: {peaks[3]} m/s² (" in text
    assert "Of the study's jobs with series it has the greatest vibration." in text
    assert "m/s²" not in written(own, tmp_path, units="plant").text  # nor in captions
    damage_series(own, study.keys[2])
    damage_series(own, study.keys[3])
    text = written(own, tmp_path).text
    assert "own: a revolution as an analyst reads it, clearance 0.1 mm" in text
    assert "vibration over crank angle and clearance_mm" not in text


def test_a_study_says_what_was_given_swept_and_assumed(own, tmp_path, monkeypatch):
    file = tmp_path / "fed.yaml"
    file.write_text(
        "load: gas\njoint: big_end\nclearance_mm: 0.2\n"
        "machine: {stroke_mm: 240, rod_mass_kg: [3, 4, 5], pin_radius_mm: 10}\n"
    )
    monkeypatch.setattr(inputs, "draw_jobs", lambda jobs: [jobs[0], jobs[-1]])
    store(own, file, overrides=[*SHORT, *DRAFT])
    write_report(own, tmp_path / "out", studies=["fed"])
    text = section(tmp_path / "out", "study-fed")
    _, text = text.split(
        "Inputs The machine without clearance, by what was given (by 2 of 3 jobs) "
    )
    told, text = text.split(" Given ")
    given, text = text.split(" Swept ")
    swept, text = text.split(" Not given: values of the program ")
    assumed, _ = text.split(" Without clearance and worn ")
    assert "rod load tension" in told
    # the stroke and the pin are the program's own values, too, but the file gives them
    for words in ("load gas", "clearance 0.2 mm", "stroke 240 mm", "pin radius 10 mm"):
        assert (words in given, words in assumed) == (True, False)
    assert swept == "machine rod mass 3, 4, 5 kg"
    assert "rod inertia 0.09 to 0.15 kg m2" in assumed  # not that of one job
    for words in ("reciprocating mass 14 kg", "speed 500 rpm", "suction 0.105 MPa", "law impact"):
        assert (words in given, words in assumed) == (False, True)
    assert "rod mass" not in assumed
    assert "viscosity" not in assumed  # there is no oil
    some = [Case.from_values({"body": {"mass_kg": mass}}) for mass in (2000, 3000)] + [Case()]
    assert inputs.spell_over_jobs("body.mass_kg", 2000.0, some) == "2000 to 3000 kg"


def test_studies_are_chosen_and_trials_come_last(own, tmp_path, compsim):
    """The 18 jobs of a search headed the page, since their name comes first."""
    (study,) = read_studies(own)
    trial = replace(study, name="a-find-x", command="compsim find own.yaml --over x=1:2")
    (own / "studies" / "a-find-x.json").write_bytes(encode(trial))
    ids = [name for name in written(own, tmp_path).ids if name.startswith("study-")]
    assert ids == ["study-own", "study-a-find-x"]
    first = section(tmp_path / "out", "answer")
    assert "Study a-find-x : 4 jobs" in first
    assert first.count("Peak contact force") == 1
    report = ["report", "-r", own, "-o", tmp_path / "out"]
    compsim(*report, "a-find-x")
    assert "study-own" not in read(tmp_path / "out").ids
    assert "Peak contact force" in section(tmp_path / "out", "answer")
    assert "did you mean own" in compsim(*report, "onw", code=2).err


def test_a_study_among_the_paper_s_cases_keeps_its_section_and_notes(paper_store, tmp_path):
    """It was told by the paper's figures alone; so was one of two of the three clearances."""
    part = part_of(paper_store, tmp_path / "part", "big-end")
    (whole,) = read_studies(part)
    replace_jobs(part, *(read_job(part, key).drop_dims("time") for key in whole.keys))
    two = replace(whole, name="two", keys=whole.keys[:2],
                  axes=(replace(whole.axes[0], values=whole.axes[0].values[:2]),))  # fmt: skip
    noted = replace(whole, name="noted", title="Unit 3", notes="Rod weighed in March.")
    for one in (two, noted):
        (part / "studies" / f"{one.name}.json").write_bytes(encode(one))
    found = [name for name in written(part, tmp_path).ids if name.startswith("study-")]
    assert found == ["study-noted", "study-two"]
    assert "Rod weighed in March." in section(tmp_path / "out", "study-noted")


def test_a_page_is_one_file(own, tmp_path, compsim):
    """By mail the page came without its figures."""
    out, err = compsim("report", "-r", own, "--single", "-o", tmp_path / "mailed")
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
    for path in (tmp_path / "out").glob("*.js"):
        assert path.read_text(encoding="utf-8").strip() in text
    pictures = {path.read_bytes() for path in (tmp_path / "out").glob("*.png")}
    assert {base64.b64decode(one.split(",")[1]) for one in found.sources} == pictures


def test_failed_jobs_are_highlighted_and_everything_is_escaped(own, tmp_path):
    """All that is not the program's own: texts of the case file, of commands and of failures."""
    (study,) = read_studies(own)
    fail(own, study.keys[2], "non_finite", f"detail {EVIL}")
    replace_jobs(own, without=[study.keys[3]])
    texts = {name: f"{name} {EVIL}" for name in ("case_file", "command", "title", "notes")}
    evil = replace(study, overrides=(f"set {EVIL}",), **texts)
    (own / "studies" / "own.json").write_bytes(encode(evil))
    own = own.rename(own.with_name(folder := EVIL.replace("/", "")))
    found = written(own, tmp_path, f"report {EVIL}")
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert text.count("<script") == 1
    assert "alert('1')</script>" not in text
    assert found.attributes <= ATTRIBUTES
    for planted in (*texts.values(), f"set {EVIL}", f"report {EVIL}", folder):
        assert planted in found.text
    assert f"1 job failed, non_finite: {Reason.NON_FINITE.remedy}" in found.text
    assert "4 jobs: 2 ok, 1 failed, 1 not run." in found.text
    kinds = {key: kind for key, (kind, _) in found.jobs.items()}
    assert [kinds[key] for key in study.keys] == [None, None, "failed", "missing"]
    assert all("<" not in p.name and "/" not in p.name for p in (tmp_path / "out").iterdir())


def test_a_study_whose_card_is_gone_costs_the_page_itself_alone(own, tmp_path):
    card = tmp_path / "head.csv"
    rows = (f"{angle},{0.4 + 0.2 * np.cos(np.radians(angle))}" for angle in range(0, 360, 5))
    card.write_text("\n".join(["crank_angle_deg,pressure_MPa", *rows]))
    file = tmp_path / "measured.yaml"
    gas = f"gas: {{indicator: {{head: {card}}}}}\n"
    file.write_text(f"load: gas\n{gas}clearance_mm: 0.1\njoint: both\n")
    store(own, file, overrides=[*SHORT, *DRAFT])
    card.unlink()
    with pytest.warns(CompsimWarning, match="study measured is left out: .*put the card of that"):
        page = write_report(own, tmp_path / "report")
    text = page.read_text()
    assert "Study measured is left out" in text
    assert "Study own" in text


def test_long_tables_are_cut_and_say_so(own, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules["compressor.report.study_section"], "MAX_ROWS", 3)
    found = written(own, tmp_path)
    assert "The first 3 of 4 jobs" in found.text
    (study,) = read_studies(own)
    assert {*found.jobs} - {""} == {*study.keys[:3]}


def test_a_study_whose_jobs_all_broke_has_a_page(own, tmp_path):
    broken = []
    for key in sorted(read_store(own).keys()):
        attrs = {"key": key, "detail": "ValueError: a bug", "case": json.dumps(Case().values())}
        broken.append(xr.Dataset({"status": "failed", "reason": "internal_error"}, attrs=attrs))
    replace_jobs(own, *broken)
    found = written(own, tmp_path)
    told = f"4 jobs failed, internal_error: {Reason.INTERNAL_ERROR.remedy}; the first, job "
    assert found.text.count(told) == found.text.count(": ValueError: a bug") == 1
    assert not found.sources


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


LAST = slice(-1201, None)  # of 0.3 degrees a sample


def test_the_last_revolution_is_shown(paper_runs):
    run = paper_runs["both 0.3"]
    acceleration, force = panels_of(draw_job(run))
    assert acceleration.traces[0].y == pytest.approx(run["acceleration"].values[LAST])
    assert acceleration.traces[0].x[[0, -1]] == pytest.approx([0.0, 360.0])
    size = np.hypot(*run["contact_force"].sel(joint="small_end").values[LAST].T) / 1e3
    assert force.traces[1].name == "small end"
    assert force.traces[1].y == pytest.approx(size)


# ---- the paper's figures of a machine of one's own


HEAVY = {"rod_mass_kg": 3, "reciprocating_mass_kg": 20}
NINE = {"joint": [*FAULTS], "clearance_mm": [*CLEARANCES]}
CASE = {"machine": HEAVY, "report": {"figures": "paper"}, "blocks": [{"joint": "none"}, NINE],
        "solve": {"accuracy": "draft", "error_bars": False}}  # fmt: skip
FILES = {f"heavy-figure-{n:02d}" for n in (4, *range(8, 17))}


@pytest.fixture(scope="module")
def heavy_store(once):
    """A store with the study `heavy`: an ideal machine and the nine faults, with other masses."""
    return once("heavy-own", lambda folder: store_cases(folder, heavy=CASE)) / "results"


def test_runs_on_other_grids_cannot_be_drawn_together(heavy_store):
    study = read_studies(heavy_store)[0]
    found = [read_store(heavy_store).job(key) for key in study.keys]
    assert comparable(found)
    later = found[1].assign_attrs(settle=2 * found[1].attrs["settle"])
    assert not comparable([found[0], later])
    assert not comparable([found[0], found[1].isel(time=slice(None, -1))])
    turn = [run.isel(time=slice(None, 2401)) for run in found]  # the first revolution is start-up
    assert comparable(turn)
    assert not comparable([run.isel(time=slice(None, -1)) for run in turn])


def test_figures_captions_and_claims_are_the_machine_s(heavy_store, tmp_path, monkeypatch):
    monkeypatch.setattr(interactive, "MAX_SERIES", 2)
    write_report(heavy_store, tmp_path / "out")
    assert len([*(tmp_path / "out").glob("job-*.js")]) == 2  # of ten jobs
    assert {path.stem for path in (tmp_path / "out").glob("*.png")} == FILES  # and no sweep
    found, study = read(tmp_path / "out"), read_studies(heavy_store)[0]
    order = [i for i in found.ids if i in ("figures-heavy", "heavy-figure-08", "study-heavy")]
    assert order == ["study-heavy", "figures-heavy", "heavy-figure-08"]
    runs = find_runs(read_store(heavy_store), [study], paper_cases(**HEAVY)).usable
    of = [runs[label("both", c)] for c in CLEARANCES]
    assert {case_of(run).machine.reciprocating_mass_kg for run in of} == {20}
    peaks = [float(run["peak_contact_force_axis"].sel(joint="big_end", axis="x")) for run in of]
    for words in (
        "heavy: Figure 15: Contact force at the big end",
        f"Greatest along the cylinder at 0.1, 0.2, 0.3 mm: {spell(np.array(peaks) / 1e3)} kN",
        " ".join(FIGURES["paper"]["figure-08"].make(runs).caption.split()),
        "Figure 4 · Figure 8 · Figure 9",  # each link had the study's name
        "rod mass 3 kg",
    ):
        assert words in found.text
    table = (tmp_path / "out" / "heavy-figure-15.csv").read_text(encoding="utf-8")
    _, *rows = csv.reader(table.splitlines())
    forces = np.array(rows)[:, 1:4].astype(float)  # along the cylinder, beside the crank angle
    series = [run["contact_force"].sel(joint="big_end", axis="x").values[-1201:] for run in of]
    assert forces == pytest.approx(np.array(series).T / 1e3, rel=1e-6, abs=1e-6)
    rows = [cells for _, cells in found.rows if cells[0].startswith("(")]
    verdicts = [cells[1].partition("margin")[0] for cells in rows]
    assert verdicts[:2] == ["not measured"] * 2
    assert {*verdicts[2:]} <= {"held", "not held"}
    assert {"claims-heavy-1", "claims-heavy-8"} <= {*found.ids}
    assert {*found.jobs} >= {*study.keys}  # its table
