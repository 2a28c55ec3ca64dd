"""What to know beside stored numbers: said where it is so, and nowhere else."""

import math

import numpy as np
import pytest
from conftest import store_cases

from compressor.cases.case import Case
from compressor.cases.materials import paper_notes
from compressor.store import read_store, read_studies
from compressor.store.caveats import describe_runs, job_caveats, run_caveats
from compressor.store.reader import open_study
from compressor.store.status import report_job

SOLVE = {"duration_rev": 3, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
LATER, FLORES = {"settle_rev": 2}, {"law": "flores", "restitution": 0.7}
STUDY = {
    "joint": "big_end",
    "clearance_mm": 0.2,
    "machine": {"rod_mass_kg": [4.7, 262], "pin_radius_mm": 30},
    "body": {"mass_kg": 5000, "casing_mass_kg": 20},
    "sensor": {"range_m_per_s2": 0.05, "length_rev": 11},
    "solve": SOLVE,
}
OUTSIDE = (
    "machine.rod_mass_kg: 262 kg is outside the range that the program was judged on, 0.1 to 200 kg"
)
PIN = "contact.stiffness_N_per_mm15: 336000 N/mm^1.5 is the paper's, of a pin of 10 mm radius: give"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study of two jobs from the start on, with a sensor that is far too sensitive."""
    place = tmp_path_factory.mktemp("caveats")
    store_cases(place, k1=STUDY)
    return place / "results"


def test_a_run_and_its_status_count_what_started_late_and_what_is_clipped(folder, compsim):
    err = compsim("run", folder.parent / "k1.yaml", "-j", "1", "-r", folder).err
    out, err = (" ".join(text.split()) for text in (compsim("status", "-r", folder).out, err))
    numbers = [report_job(folder, key).numbers for key in open_study(folder).key.values]
    late = sum(numbers_["settled_rev"] > 0 for numbers_ in numbers)
    unrepeated = sum(math.isnan(numbers_["settled_rev"]) for numbers_ in numbers)
    assert late + unrepeated == 2
    counts = f"{unrepeated or late} of 2 jobs: the motion"
    worst = 100 * max(numbers_["clipped_fraction"] for numbers_ in numbers)
    clipped = f"2 of 2 jobs: the sensor's record is clipped, at worst {worst:.3g} % of its samples"
    for text in (out, err):
        assert counts in text
        assert ("solve: {settle_rev: auto, duration_rev: auto}" in text) == bool(unrepeated)
        assert ("solve.settle_rev: auto leaves it out" in text) == bool(late)
        assert clipped in text
    assert OUTSIDE in out
    assert PIN in out
    assert PIN in " ".join(compsim("show", "k1", "rod_mass_kg=4.7", "-r", folder).out.split())
    assert "warning: machine.rod_mass_kg: 262 kg is outside" in err  # before it runs


def test_a_stiffness_that_is_given_is_not_the_paper_s():
    worn = {"joint": "small_end", "clearance_mm": 0.2, "machine": {"pin_radius_mm": 35}}
    assert list(paper_notes(Case.from_values(worn))) == ["contact.stiffness_N_per_mm15"]
    given = {"contact": {"stiffness_N_per_mm15": 5e6}}
    assert paper_notes(Case.from_values(worn | given)) == {}


@pytest.mark.parametrize(
    ("regime", "settled", "begin", "said"),
    [
        ("periodic", 0.0, 0.0, None),
        ("periodic", 2.0, 0.0, "the motion settled after solve.settle_rev"),
        ("predictable", math.nan, 0.0, "the motion was not seen to repeat"),
        # where `auto` found the metrics to agree, numbers begin
        ("predictable", 3.0, 0.0, None),
        ("periodic", 3.0, math.nan, None),
        # these say so themselves
        ("chaotic", math.nan, 0.0, None),
        ("undecided", math.nan, 0.0, None),
    ],
)
def test_what_is_seen_to_repeat_in_time_is_no_caveat(regime, settled, begin, said):
    found = describe_runs(*map(np.atleast_1d, (regime, settled, begin, 1e-4, False)))
    assert bool(found) == bool(said)
    assert all(text.startswith(said) for text in found)


def test_caveats_count_the_jobs_that_they_are_true_of():
    found = describe_runs(
        np.array(["periodic", "periodic", "chaotic"]), np.array([2.0, 1.0, 2.0]), np.ones(3),
        np.array([0.2, 0.1, math.nan]), np.zeros(3, bool),
    )  # fmt: skip
    assert [text.partition(": ")[0] for text in found] == ["1 of 3 jobs", "2 of 3 jobs"]
    assert "at worst 20 % of its samples" in found[1]


def test_a_law_that_remembers_an_impact_of_the_start_up_says_so(tmp_path):
    """flores gave 7405, 7827 and 7573 N for three starts, each as periodic, with tiny bars."""
    starts = {"joint": "big_end", "clearance_mm": 0.2, "load": "gas", "solve": SOLVE | LATER}
    starts |= {"contact": FLORES, "initial_offset_mm": {"big_end_x": [-0.19, 0]}}
    store_cases(tmp_path, starts=starts, impact=starts | {"contact": {}})
    stored = read_store(tmp_path / "results")
    for study, said in zip(read_studies(tmp_path / "results"), (False, True), strict=True):
        places = stored.find(study.keys)
        peaks = stored.numbers(places, ["peak_contact_force"])["peak_contact_force"][:, 0]
        assert (abs(peaks[1] / peaks[0] - 1.0) > 0.03) == said
        for texts in (run_caveats(stored, study), job_caveats(stored, places[0])):
            assert ("numbers depend on how the run began" in " ".join(texts)) == said
