"""The kept measurement of alarms: that its numbers follow from each other, and from its cases."""

import json
import math

import measure_alarms
import numpy as np
import page_tables
import pytest
import xarray as xr

from compressor.cases import Case
from compressor.cases.load import load_studies
from compressor.studies.alarms.alarms import judge_alarms, rank_alarms
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
    peaks = KEPT["peaks"]
    assert f"The median peak of the record is {peaks['sound']:g} m/s² of a sound machine" in PAGE
    assert "{:g} and {:g} times that of a sound machine".format(*peaks["greatest"]) in PAGE
    usual, worn = peaks["sound"], peaks["worn"]["small_end"]
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


def test_rows_are_what_the_command_judges(worn_store, monkeypatch):
    """By the made-up records of the command's own tests."""
    monkeypatch.setattr(measure_alarms, "NOISE", (1.0,))
    monkeypatch.setattr(measure_alarms, "peaks", lambda folder, study: {})
    wear = {"limit_mm": 0.3, "coefficient_factor": 2}
    case = Case.from_values({"joint": "both", "clearance_mm": 0.1, "wear": wear})
    opened = [[1e-4, 1e-4], [3e-4, 2e-4]]
    run = xr.Dataset(
        {"hours": ("stage", [0.0, 1000.0]), "clearance": (("stage", "joint"), opened)},
        {"joint": ["big_end", "small_end"]},
    ).assign_attrs(case=case.attributes()["case"])
    found = measure_alarms.judge(worn_store, "worn", run, revolutions=2)
    json.dumps(found, allow_nan=False)
    assert (found["jobs"], found["sound_draws"], found["worn_jobs"]) == (240, 60, 180)
    whole = judge_alarms(worn_store, "worn", noise=(1.0,), revolutions=2)
    for joint in ("big_end", "small_end", "both"):
        row = next(r for r in found["rows"] if (r["joint"], r["noise"]) == (joint, 1.0))
        best = whole.isel(alarm=rank_alarms(whole, joint)[0], noise=0)
        assert (row["alarm"], row["filter"]) == (best["kind"].item(), best["filter"].item())
        mine = best["detection"].sel(end="value").values[best["worn_joint"].values == joint]
        assert row["detection"] == pytest.approx(mine, abs=5e-3)
        assert row["limit"] == pytest.approx(float(best["limit"]), rel=5e-3)
        assert (row["lead_hours"] is None) == (joint == "both")  # no run wears both as one
    first, last = found["rows"][0], found["at_looser"][0]
    assert first["first"] == last["first"] is not None  # strokes are far above either limit
    assert last["limit"] <= first["limit"]


def test_peaks_are_medians_by_clearance(monkeypatch):
    """Sound peaks 1 to 9, and twenty times the number of a clearance that is worn."""
    sound, worn = range(1, 10), {"big_end": [0.15, 0.4], "small_end": [0.11]}
    rows = [(0.1, 0.08, float(peak)) for peak in sound]
    rows += [(one, 0.08, 20.0 + k) for k, one in enumerate(worn["big_end"]) for _ in range(3)]
    rows += [(0.1, one, 40.0 + k) for one in worn["small_end"] for k in (0, 1, 8)]
    big, small, peak = map(np.array, zip(*rows, strict=True))
    study = xr.Dataset({
        "sensor_peak": ("job", peak), "clearance_mm_big_end": ("job", big),
        "clearance_mm_small_end": ("job", small),
    })  # fmt: skip
    monkeypatch.setattr(measure_alarms, "open_study", lambda folder, name: study)
    monkeypatch.setattr(measure_alarms, "WORN", worn)
    found = measure_alarms.peaks("", "")
    assert found["sound"] == 5.0
    assert found["worn"] == {"big_end": [20.0, 21.0], "small_end": [41.0]}
    assert found["greatest"] == [1.8, 1.6]
