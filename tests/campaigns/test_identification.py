"""The campaign of `compsim identify`: its machines, its counts, and what is kept of it."""

from types import SimpleNamespace

import pytest
from measure_identify import OTHERS, judged
from page_tables import kept

from compressor.studies.diagnosis.identify import Candidate, Identification, Interval


class Told:
    """An identifier that says big end, 0.1 to 0.2 mm, and that nothing fits every other time."""

    def __init__(self):
        self.calls = 0

    def identify(self, row):
        self.calls += 1
        found = [
            Candidate(joint, chance, dict.fromkeys(ends, Interval(0.15, 0.1, 0.2)))
            for joint, chance, ends in (
                ("big_end", 0.7, ["big_end"]),
                ("none", 0.1, []),
                ("small_end", 0.1, ["small_end"]),
                ("both", 0.1, ["big_end", "small_end"]),
            )
        ]
        return Identification(found, self.calls % 2 == 0, 0.5, "")


def test_answers_are_counted():
    records = SimpleNamespace(
        joints=["big_end", "big_end", "none", "both"],
        clearances=[(0.15, 0.0), (0.3, 0.0), (0.0, 0.0), (0.12, 0.4)], features=[None] * 4,
    )  # fmt: skip
    found = judged(Told(), records)
    shares = {name: found[name]["share"] for name in found if isinstance(found[name], dict)
              and "share" in found[name]}  # fmt: skip
    assert shares == pytest.approx({
        "right": 0.5, "right_where_worn": 2 / 3, "covered": 0.5, "covered_all": 0.5,
        "nothing_fits": 0.5, "nothing_fits_where_worn": 1 / 3, "false_alarms": 1.0, "missed": 0.0,
    })  # fmt: skip
    assert found["confused"]["both"]["big_end"] == 1
    assert found["factor"] == [2.0, 2.0, 2.0]


def test_what_is_kept_keeps_what_was_asked_for():
    """The joint right in 90 %, clearances in intervals in 85 to 95 %; elsewhere it is worse."""
    models = kept("identify.json")["models"]
    assert list(models) == list(OTHERS)
    own, *others = models.values()
    assert own["records"] == 200
    assert own["right"]["share"] >= 0.9
    assert 0.85 <= own["covered"]["share"] <= 0.95
    for row in others:
        assert row["right"]["share"] < own["right"]["share"]
        assert row["nothing_fits"]["share"] > own["nothing_fits"]["share"]
