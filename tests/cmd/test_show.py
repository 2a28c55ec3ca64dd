"""`compsim show`: how a job is named, and its numbers, units and case."""

import json
import math
import re
from types import SimpleNamespace

import pytest
from compsim.job_text import knock_verdict, notes
from conftest import CHAOTIC, store_cases

from compressor.cases.case import Case
from compressor.cases.load import load_cases, load_studies
from compressor.digits import by_bar
from compressor.store.status import report_job

HERE = ["big-end", "clearance_mm=0.2"]


@pytest.fixture
def show(compsim):
    """Runs `compsim show` and returns what it prints."""
    return lambda *words: compsim("show", *words).out


def values(out):
    """What stands beside each label."""
    pairs = (re.split(r"  +", line.strip(), maxsplit=1) for line in out.splitlines())
    return {pair[0]: pair[1] for pair in pairs if len(pair) == 2}


def test_a_job_is_named_by_its_key_or_by_its_study_and_values(paper_store, show):
    found = report_job(paper_store, *HERE)
    assert found.studies == {"big-end": {"clearance_mm": 0.2}}
    assert json.loads(found.attributes["case"])["clearance_mm"]["big_end"] == 0.2
    out = show("-r", paper_store, *HERE)
    assert out.startswith(f"job {found.key}: ok\n  in big-end clearance_mm=0.2\n")
    assert show(found.key[:12], "-r", paper_store) == out


def test_numbers_have_labels_units_and_error_bars(paper_store, show):
    stored, told = report_job(paper_store, *HERE).numbers, values(show("-r", paper_store, *HERE))
    in_json = json.loads(show("-r", paper_store, *HERE, "--json"))["numbers"]
    assert in_json["peak_contact_force"] == pytest.approx(stored["peak_contact_force"], rel=1e-15)
    force, bar = (stored[name] for name in ("peak_contact_force", "peak_contact_force_error"))
    for place, joint in enumerate(("big end", "small end")):
        said = by_bar(force[place] / 1e3, bar[place] / 1e3)
        assert told[f"peak contact force, {joint}"] == f"{said} kN"
    depth, bar = (stored[name][0] for name in ("max_penetration", "max_penetration_error"))
    assert told["max penetration, big end"] == f"{by_bar(depth * 1e6, bar * 1e6)} µm"
    share = stored["contact_loss_fraction"][0]
    bar = stored["contact_loss_fraction_error"][0]
    assert told["time without dry contact, big end"] == f"{by_bar(100 * share, 100 * bar, False)} %"
    rate = f"{stored['impacts_per_rev'][0]:.6g} per rev"
    assert told["dry contacts after flight, big end"] == rate
    assert not any("count" in label for label in told)  # counts grow with the run
    assert float(told["acceleration"]) == pytest.approx(stored["acceleration_error"], rel=0.05)
    assert told["friction loss"] == f"{stored['friction_loss']:.6g} J"


def test_numbers_may_be_in_plant_units_or_si(paper_store, show):
    numbers = report_job(paper_store, *HERE).numbers
    peak, force = numbers["peak_acceleration"], numbers["peak_contact_force"][0]
    for units, acceleration, newtons in (("plant", "g", "kN"), ("si", "m/s²", "N")):
        told = values(show("-r", paper_store, *HERE, "--units", units))
        value, unit = re.fullmatch(r"(\S+) ± \S+ (\S+)", told["peak acceleration"]).groups()
        assert unit == acceleration
        in_unit = peak / 9.80665 if unit == "g" else peak
        assert float(value) == pytest.approx(in_unit, rel=1e-3)
        value, unit = re.fullmatch(
            r"(\S+) ± \S+ (\S+)", told["peak contact force, big end"]
        ).groups()
        assert unit == newtons
        assert float(value) == pytest.approx(force / (1e3 if unit == "kN" else 1.0), rel=1e-3)


def test_the_case_is_shown_so_that_it_makes_the_same_job(paper_store, show, tmp_path):
    key, path = report_job(paper_store, *HERE).key, tmp_path / "one.yaml"
    changed = show("-r", paper_store, *HERE).partition("(--case prints all)\n")[2].split()
    assert "clearance_mm=0.2" in changed
    assert "speed_rpm" not in "".join(changed)  # the usual one
    path.write_text("load: none\n")
    (study,) = load_studies(path, overrides=["load=spring", *changed])
    assert [*study.keys] == [key]
    whole = show("-r", paper_store, *HERE, "--case")
    assert "  speed_rpm: 500.0\n" in whole
    path.write_text(whole)
    (again,) = load_cases(path)
    assert again.key == key
    assert again.name == f"big-end-{key[:8]}"  # a run of it takes no study's place


def test_of_a_chaotic_job_averages_are_told_and_peaks_are_not(show, tmp_path):
    solve = {"accuracy": "draft", "duration_rev": 11}  # averages over ten settled revolutions
    store_cases(tmp_path, wild=CHAOTIC | {"solve": solve})
    out = show("-r", tmp_path / "results", "wild")
    told = values(out)
    assert told["peak acceleration"] == "unknown"
    assert told["acceleration"] == "unknown"
    assert re.fullmatch(r"[\d.]+ ± [\d.]+ m/s²", told["rms acceleration"])
    mean = told["peak contact force mean, big end"]
    assert re.fullmatch(r"[\d.]+ ± [\d.]+ kN \(standard.*", mean)
    force = report_job(tmp_path / "results", "wild").numbers["peak_contact_force_mean"][0]
    assert float(mean.split()[0]) == pytest.approx(force / 1e3, rel=0.1)
    assert "the motion is chaotic: averages may be trusted, single peaks may not" in out


@pytest.mark.parametrize("oil", [{"lubricant": True}, {}])
def test_a_contact_force_with_oil_says_so(oil):
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.2} | oil)
    lines = [*notes(SimpleNamespace(case=case, attributes={}))]
    assert lines[:1] == ["contact forces include the force of the oil film"] * len(oil)
    assert (lines[1:] != []) == bool(oil)
    assert all("see knock" in line for line in lines[1:])


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [(0.3, 0.01, "knocks (limit 0.25)"), (0.2, 0.01, "does not knock (limit 0.25)"),
     (0.26, 0.02, "may knock (limit 0.25)"), (0.3, math.nan, "knocks (limit 0.25)")],
)  # fmt: skip
def test_a_knock_is_judged_by_its_limit_and_its_bar(value, error, text):
    assert knock_verdict(value, error) == text
