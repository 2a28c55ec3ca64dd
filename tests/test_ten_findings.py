"""The ten findings: one that fails says so, and each measurement says how it was made."""

import copy
import re
import subprocess

import findings
import page_tables
import pytest
from measure_accuracy import provenance

CAMPAIGNS = page_tables.ROOT / "tests" / "campaigns"


def changed(**wrong):
    """A reader of the campaigns' files, which changes some of them first."""

    def kept(name):
        found = copy.deepcopy(page_tables.kept(name))
        wrong.get(name.removesuffix(".json"), lambda _: None)(found)
        return found

    return kept


def off(found):
    found["rows"][0]["found"] += 2 * found["rows"][0]["within"]


def short(found):
    for metrics in found["bars"].values():
        metrics["peak_acceleration"]["within"] = 0.0


def untrue(found):
    found["words"]["standard"]["broken"] += 50


def lost(found):
    found["campaigns"]["kill"]["failed"] += 1


def unseen(found):
    found["mutants"][0]["caught_by"] = ""


def right(found):
    found["fresh"] = []


def first_number(result):
    return int(re.match(r"[\d,]+", result.measured)[0].replace(",", ""))


@pytest.mark.parametrize(
    ("name", "change", "more"),
    [
        ("validation", off, -1),
        ("accuracy", untrue, -50),
        ("chaos", lost, 1),
        ("mutants", unseen, -1),
    ],
)
def test_a_finding_that_fails_says_so(name, change, more):
    find = findings.FINDINGS[name][1]
    good, bad = find(page_tables.kept), find(changed(**{name: change}))
    assert good.passed
    assert first_number(bad) - first_number(good) == more
    assert findings.verdict(bad) == "**fail**"


def test_bars_that_are_too_short_fail():
    assert findings.find_bars(page_tables.kept).passed
    assert not findings.find_bars(changed(accuracy=short)).passed


def test_cases_that_are_wrong_without_a_warning_fail():
    found = page_tables.kept("stress.json")
    wrong = sum(len(one["silent_wrong"]) for one in found["fresh"])
    result = findings.find_stress(page_tables.kept)
    assert result.measured.startswith(f"{wrong + found['silent_wrong']} of ")
    assert result.passed == (wrong + found["silent_wrong"] == 0)
    assert findings.find_stress(changed(stress=right)).passed == (found["silent_wrong"] == 0)


def test_there_are_ten_findings_with_pages():
    assert len(findings.FINDINGS) == 10
    lines = findings.findings_table(page_tables.kept).splitlines()[2:]
    assert len(lines) == 10
    pages = [re.search(r"\]\((\w+)\.md", line)[1] for line in lines]
    assert {*pages} <= {*page_tables.CAMPAIGNS}


def test_every_campaign_has_a_page_and_every_page_a_campaign():
    pages = {path.stem for path in page_tables.RESULTS.glob("*.md")} - {"README"}
    files = {path.stem for path in page_tables.RESULTS.glob("*.json")} - {"model-3"}
    assert pages == files == {*page_tables.CAMPAIGNS}


def test_the_page_names_what_make_measurements_leaves_out():
    makefile = (page_tables.ROOT / "Makefile").read_text(encoding="utf-8")
    repeated = re.search(r"^measurements: (.*?) +##", makefile, re.MULTILINE)[1].split()
    found = {page_tables.spans(page_tables.runs_of(name))[0] for name in page_tables.CAMPAIGNS}
    page = (page_tables.RESULTS / "README.md").read_text(encoding="utf-8")
    named = {*re.findall("`(make [a-z-]+)`", page.partition("campaigns except")[2])}
    assert named == {one for one in found if one.removeprefix("make ") not in repeated}


def test_every_campaign_says_what_it_measured():
    writers = [path for path in CAMPAIGNS.glob("*.py")
               if "json.dumps" in (text := path.read_text(encoding="utf-8"))
               and re.search(r"[tT]arget\)?\.write_text", text)]  # fmt: skip
    assert len(writers) >= len(page_tables.CAMPAIGNS)
    assert all("provenance(" in path.read_text(encoding="utf-8") for path in writers)


def test_a_measurement_says_its_commit():
    git = ["git", "-C", str(CAMPAIGNS), "rev-parse", "HEAD"]
    head = subprocess.run(git, capture_output=True, text=True)
    made = provenance("make nothing")
    if head.returncode == 0:
        assert head.stdout.startswith(made["commit"].split()[0])
    else:
        assert "commit" not in made
    assert made["command"] == "make nothing"
