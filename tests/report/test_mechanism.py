"""The picture of the mechanism: to scale by the closed form, worn joints marked, nothing broken."""

import math
from xml.etree import ElementTree

import pytest

from compressor.cases.case import Case
from compressor.report.answer import mechanism, mechanism_svg, mechanism_words


def case(joint="both", crank=120.0, rod=600.0, **more):
    values = {"joint": joint, "machine": {"crank_radius_mm": crank, "rod_length_mm": rod}, **more}
    if joint != "none":
        values["clearance_mm"] = more.get("clearance_mm", 0.2)
    return Case.from_values(values)


@pytest.mark.parametrize("rod", [1.1 * 120.0, 600.0, 20.0 * 120.0])
@pytest.mark.parametrize("angle", [0.0, 60.0, 135.0, 300.0])
def test_the_joints_are_where_the_closed_form_has_them(rod, angle):
    found = mechanism(case("none", rod=rod), angle)
    scale = found.crank / 120.0
    turn = math.radians(angle)
    big = [(at - of) / scale for at, of in zip(found.big, found.origin, strict=True)]
    assert big == pytest.approx([120.0 * math.cos(turn), -120.0 * math.sin(turn)], abs=1e-9)
    small = (found.small[0] - found.origin[0]) / scale
    assert small == pytest.approx(
        120.0 * math.cos(turn) + math.sqrt(rod**2 - (120.0 * math.sin(turn)) ** 2)
    )
    assert found.small[1] == found.origin[1]
    assert math.dist(found.big, found.small) == pytest.approx(rod * scale)
    for x, y in (found.big, found.small):
        assert 0 < x < 1000
        assert 0 < y < found.height


@pytest.mark.parametrize(
    ("joint", "worn"),
    [("none", []), ("big_end", ["big end"]), ("small_end", ["small end"]),
     ("both", ["big end", "small end"])],
)  # fmt: skip
def test_worn_joints_are_marked_and_enlarged(joint, worn):
    root = ElementTree.fromstring(mechanism_svg(case(joint)))
    marks = [one for one in root.iter("circle") if one.get("class") == "worn"]
    texts = [one.text for one in root.iter("text")]
    assert len(marks) == len(worn)
    assert texts.count("clearance 0.2 mm") == len(worn)
    said = root.find("desc").text
    assert all(f"{name} (0.2 mm)" in said for name in worn)
    assert ("No joint has clearance" in said) == (not worn)
    assert root.get("role") == "img"


def test_the_wider_clearance_has_the_wider_gap():
    sizes = {"big_end": 0.3, "small_end": 0.1}
    big, small = mechanism(case(clearance_mm=sizes)).insets
    assert (big.clearance, small.clearance) == ("0.3 mm", "0.1 mm")
    assert big.gap == pytest.approx(3 * small.gap)
    assert big.journal + big.gap == pytest.approx(small.journal + small.gap)


def test_words_say_what_the_picture_does_not():
    assert mechanism_words(case()) == (
        "500 rpm; rod 4.7 kg, crosshead with piston 14 kg; pins of 10 mm radius."
    )
    balanced = mechanism_words(case(machine={"counterweight_kg_mm": 900}))
    assert balanced.endswith("pins of 10 mm radius; counterweight 900 kg mm.")
