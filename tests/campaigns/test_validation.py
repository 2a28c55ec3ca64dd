"""The kept comparison with published numbers, and a sample of it made anew."""

import measure_validation
import page_tables
import pytest

ROWS = page_tables.kept("validation.json")["rows"]
SUBJECTS = {"Restitution": 20, "Dry joint": 5, "Guide with play": 7, "Journal bearing": 12,
            "Elastic rod": 15, "Wear": 2}  # fmt: skip


def test_each_published_number_comes_out():
    far = [one for one in ROWS if not abs(one["found"] - one["expected"]) <= one["within"]]
    assert far == []
    for subject, count in SUBJECTS.items():
        assert sum(one["subject"] == subject for one in ROWS) >= count


@pytest.mark.compiled
def test_a_sample_comes_out_again():
    """What is kept was found by this code, to the digits that are shown."""
    kept = {(one["what"], one["source"]): one["found"] for one in ROWS}
    again = [*measure_validation.play(), *measure_validation.elastic_rod()]
    again += [*measure_validation.bearing(), *measure_validation.wear()]
    for one in again:
        found = kept[one["what"], one["source"]]
        assert one["found"] == pytest.approx(found, rel=1e-6, abs=one["within"])
        assert abs(one["found"] - one["expected"]) <= one["within"]
    assert len(again) >= 16
