"""What campaigns have measured is of today's cases, and reaches what is required of it."""

import ast
import math
from collections import Counter

import measure_accuracy
import measure_identify
import measure_peers
import mutation
import planted_bugs
import pytest
from page_tables import FINDINGS, kept
from peers import mechanism

from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.cases.parameter import ACCURACY
from compressor.metrics import METRICS


@pytest.mark.parametrize(
    ("name", "words", "find"), FINDINGS, ids=lambda part: getattr(part, "__name__", part)
)
def test_no_finding_fails(name, words, find):
    """But for extreme cases: their page lists what is wrong."""
    assert name == "stress" or find(kept(f"{name}.json"))[2] is not False


# ---- accuracy

# a bound on how far changes of contact may move, of one number in seven that is wrong at all: it
# was too short in a fifth of them before, 168 and 228 in two draws; and what is left of a blow by
# its acceleration
LONG = {"contact_loss_fraction": 250.0, "knock": 7.5}


@pytest.mark.parametrize("word", ACCURACY)
def test_accuracy_was_judged_on_fresh_cases_and_every_run_says_how_it_ended(word):
    found, tier = kept("accuracy.json"), ACCURACY[word]
    row, cases = found["words"][word], found["random"]["cases"]
    assert cases >= 1000
    assert found["random"]["seeds"] == [*measure_accuracy.SEEDS]
    assert not {*measure_accuracy.SEEDS} & {*kept("calibration.json")["cases"]["seeds"]}
    assert (row["rtol"], row["promise"]) == (tier.rtol, tier.promise)
    chaotic, refused = row["regimes"].get("chaotic", 0), sum(row["refused"].values())
    assert (row["silent"], row["nine"]["kept"], row["chaotic_confirmed"]) == (0, 9, chaotic)
    assert row["kept"] + chaotic + refused == cases
    assert row["nine"]["error"] <= row["nine"]["told"] <= row["promise"]
    if word in ("standard", "fine"):
        assert row["broken"] <= 0.01 * row["kept"]
        assert refused < 0.03 * cases
    if word == "standard":  # what a check costs
        assert row["cost"]["mean"] <= 4.0
        assert max(row["cost"]["median"], row["nine"]["cost"]) <= 2.1


@pytest.mark.parametrize("word", ACCURACY)
@pytest.mark.parametrize("name", METRICS)
def test_bars_are_true_and_short(word, name):
    found = kept("accuracy.json")
    row = found["bars"][word][name]
    chance = 2.0 * math.sqrt(0.95 * 0.05 / found["words"][word]["kept"])  # two standard errors
    assert row["within"] >= 0.95 - chance
    # of one metric it moves by a tenth from draw to draw: 5.3 and 6.03 for max_penetration
    assert row["tightness"] is None or row["tightness"] <= LONG.get(name, 6.6)


# ---- other tools


def test_contests_with_other_tools_are_at_equal_or_better_error():
    found = kept("peers.json")
    tools = {(row["tool"], row["scene"]) for row in found["rows"]}
    assert tools == {(p.tool, s) for p in measure_peers.PEERS for s in mechanism.SCENES}
    for row in found["rows"]:
        assert "reason" in row or row["our_error"] <= row["error"]
    for check in found["agreement"]:  # wrong lever arms would leave 1e-3 and more
        assert check["ours_to_reference"] < 1e-6
        assert "reason" in check or check["exudyn_to_ours"] < 1e-4
    for one in found["evaluations"]["scenes"]:  # the same numbers are what is timed
        assert one["apart"] < 1e-9


# ---- studies


def test_the_nameplate_s_machine_was_run_as_it_is():
    (study,) = load_studies(templates()["machine"].path)
    keys = [row["key"] for row in kept("nameplate.json")["rows"]]
    assert keys == [case.key for case in study.cases], "make nameplate"


def test_identify_is_right_in_90_percent_and_worse_where_its_model_is_wrong():
    models = kept("identify.json")["models"]
    assert [*models] == [*measure_identify.OTHERS]
    own, *others = models.values()
    assert (own["records"], own["right"]["share"] >= 0.9) == (200, True)
    assert 0.85 <= own["covered"]["share"] <= 0.95
    for row in others:
        assert row["right"]["share"] < own["right"]["share"]
        assert row["nothing_fits"]["share"] > own["nothing_fits"]["share"]


def test_mutants_are_caught():
    rows = kept("mutants.json")["mutants"]
    kinds = Counter(row["kind"] for row in rows)
    assert kinds == {"planted": 30} | dict.fromkeys(mutation.KINDS, 10)
    assert not any("cannot_be_loaded" in row for row in rows)
    assert not any(row["caught_by"] for row in rows if "equivalent" in row)
    assert all("::" in row["caught_by"] for row in rows if row["caught_by"])


def test_thirty_bugs_can_be_planted():
    """Their texts still stand in the sources; says which does not."""
    bugs = planted_bugs.bugs()
    assert len({bug.identity for bug in bugs}) == 30
    for bug in bugs:
        ast.parse(bug.source())
