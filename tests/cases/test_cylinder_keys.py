"""Keys of a cylinder: what may be left out, what is refused, and keys of jobs that stay."""

import pytest

from compressor.cases.case import Case, CaseError
from compressor.solve.si_record import record

DOUBLE = {"action": "double", "rod_diameter_mm": 30}


def case(gas, **more):
    return Case.from_values({"load": "gas", "gas": gas, **more})


def refused(gas, **more):
    with pytest.raises(CaseError) as caught:
        case(gas, **more)
    return str(caught.value)


def test_what_is_so_by_default_makes_no_other_job():
    whole = {"unloaded": "none", "valve_loss_percent": 0, "switching": "exact"}
    assert case(DOUBLE).key == case(DOUBLE | whole).key
    for key, parts in (("clearance_percent", ("head", "crank")),
                       ("valve_loss_percent", ("suction", "discharge"))):  # fmt: skip
        assert case(DOUBLE | {key: 12}).key == case(DOUBLE | {key: dict.fromkeys(parts, 12)}).key
    assert case({"unloaded": "none"}).key == case({"action": "single"}).key


def test_clearances_are_of_the_stroke():
    """240 mm here; the crank end has the head's millimetres where nothing else is given."""
    found = record(case(DOUBLE | {"clearance_percent": {"head": 10, "crank": 12.5}}))
    assert (found.head_clearance, found.crank_clearance) == pytest.approx((0.024, 0.03))
    found = record(case(DOUBLE))
    assert (found.head_clearance, found.crank_clearance) == (0.02, 0.02)
    found = record(case(DOUBLE | {"clearance_percent": {"crank": 12.5}}))
    assert (found.head_clearance, found.crank_clearance) == pytest.approx((0.02, 0.03))


@pytest.mark.parametrize("clearance", [14, {"crank": 14}, {"head": 12, "crank": 14}])
def test_a_crank_end_alone_takes_its_clearance_in_every_form(clearance):
    """Facts of a cylinder: two of the forms were refused, with opposite advice."""
    one = case({"action": "crank_end", "rod_diameter_mm": 20, "clearance_percent": clearance})
    assert record(one)["crank_clearance"] == pytest.approx(0.14 * 0.24)
    both = {"head": 12, "crank": 14}
    single = case({"action": "single", "clearance_percent": both})
    assert record(single)["head_clearance"] == pytest.approx(0.0288)


def test_a_piston_that_would_reach_a_cover():
    worn = {"joint": "both", "clearance_mm": 0.3}
    found = refused(DOUBLE | {"clearance_percent": {"head": 10, "crank": 0.2}}, **worn)
    assert "gas.clearance_percent.crank: 0.48 mm does not exceed the clearances, 0.6 mm" in found
    assert "the cylinder cover at the crank end" in found
    assert "raise it; it is in per cent of the swept volume: 17, not 0.17" in found
