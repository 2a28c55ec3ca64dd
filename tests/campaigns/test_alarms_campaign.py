"""The kept measurement of alarms: that its numbers follow from each other, and from its cases."""

import math

import measure_alarms
import page_tables
import pytest

from compressor.cases.load import load_studies
from compressor.studies.alarms.readings import ALARMS

KEPT = page_tables.kept("alarms.json")
PAGE = (page_tables.ROOT / "tests/results/alarms.md").read_text(encoding="utf-8")


def wilson(share, count):
    """Wilson's interval, from its equation (p - share)^2 = z^2 p (1 - p) / n."""
    square = 1.959964**2 / count
    a, b, c = 1.0 + square, -(2.0 * share + square), share**2
    root = math.sqrt(max(b * b - 4.0 * a * c, 0.0))
    return (-b - root) / (2.0 * a), (-b + root) / (2.0 * a)


def test_intervals_and_first_clearances_follow_from_the_rates():
    for row in KEPT["rows"]:
        ends = [wilson(*one) for one in zip(row["detection"], row["draws"], strict=True)]
        for k, end in enumerate(("_low", "_high")):
            found = row[f"detection{end}"]
            assert found == pytest.approx([pair[k] for pair in ends], abs=2e-3)
        low, high = wilson(row["false_alarms"], KEPT["sound_draws"])
        assert (row["false_alarms_low"], row["false_alarms_high"]) == pytest.approx(
            (low, high), abs=2e-3
        )
        for end, shares in (("", row["detection"]), ("_low", row["detection_high"]),
                            ("_high", row["detection_low"])):  # fmt: skip
            held = [share >= KEPT["detected"] for share in shares]
            from_on = [c for k, c in enumerate(row["clearances"]) if all(held[k:])]
            assert row[f"first{end}"] == (from_on[0] if from_on else None)


def test_each_kind_of_alarm_is_judged_for_each_joint_and_noise():
    kinds = {alarm.title for alarm in ALARMS}
    for joint in measure_alarms.WORN:
        for noise in measure_alarms.NOISE:
            rows = [r for r in KEPT["rows"] if (r["joint"], r["noise"]) == (joint, noise)]
            assert {row["alarm"] for row in rows} == kinds
            firsts = [row["first"] or math.inf for row in rows]
            assert firsts == sorted(firsts)


def test_lead_times_are_what_the_wear_run_leaves():
    """None of an alarm that sees nothing before the run ends; never more than the whole run."""
    wear = KEPT["wear"]
    for row in KEPT["rows"]:
        low, mid, high = (row[f"lead_hours{end}"] for end in ("_low", "", "_high"))
        assert 0.0 <= low <= mid <= high <= wear["factor"] * wear["end"] * 1.01
        if row["first"] is None or row["first"] > wear["clearances"][row["joint"]]:
            assert mid == 0.0


def test_the_sentences_say_what_the_rates_say():
    for joint in measure_alarms.WORN:
        rows = [row for row in KEPT["rows"] if row["joint"] == joint and not row["noise"]]
        name, best = joint.replace("_", " "), rows[0]
        first = [row["alarm"] for row in rows if row["first"] == best["first"] is not None]
        if len(first) > 1:
            words = f"detect wear of the {name} from {best['first']:g} mm on: {', '.join(first)}."
            assert f"{len(first)} of {len(rows)} kinds of alarm {words}" in PAGE
        elif first:
            words = f"{first[0]} ({best['filter']}), from {best['first']:g} ["
            assert f"Wear of the {name} is seen first by {words}" in PAGE
        never = [row["alarm"] for row in rows if row["first"] is None]
        assert f"Never within {best['clearances'][-1]:g} mm: {', '.join(never) or 'none'}." in PAGE
    (limits,) = {
        tuple(row["limits"])
        for row in KEPT["rows"]
        if (row["alarm"], row["filter"], row["noise"]) == ("peak", "record", 0.0)
    }
    # the loudest sound draw sets the greatest limit, and the next one that of its own fold
    assert limits[::-1] == pytest.approx(KEPT["peaks"]["greatest"], rel=0.1)
    usual, worn = KEPT["peaks"]["sound"], KEPT["peaks"]["worn"]["small_end"]
    assert worn[0] < 3.0 * usual
    assert max(worn) > 20.0 * usual  # it knocks


def test_the_cases_are_those_that_were_run(tmp_path):
    """The same machines, drawn alike, by the same model: else `make alarms` measures anew."""
    path, worn_path = tmp_path / "plant.yaml", tmp_path / "worn.yaml"
    path.write_text(measure_alarms.case_text(), encoding="utf-8")
    worn_path.write_text(measure_alarms.wear_text(), encoding="utf-8")
    (study,) = load_studies(path)
    assert measure_alarms.digest_keys([study], load_studies(worn_path)) == KEPT["keys"]
    assert len(study.cases) == KEPT["jobs"]
    worn = [case.worn_joint for case in study.cases]
    assert worn.count("none") == KEPT["sound_draws"] == measure_alarms.SOUND
    assert len(worn) - worn.count("none") == KEPT["worn_jobs"]
