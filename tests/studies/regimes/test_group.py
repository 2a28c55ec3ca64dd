"""What `regimes` of a case file asks for, and where every mistake in it is shown."""

import contextlib
import itertools
import json
import math

import jsonschema
import pytest

from compressor.cases import case_schema
from compressor.cases.load import CaseFileError
from compressor.studies.regimes.group import FOLLOWED, NEEDED, ROWS

REGIMES = "regimes: {over: clearance_mm, from: 0.01, to: 1, n: 3, log: true, direction: both}\n"
WORN = "joint: big_end\n"
WHOLE = WORN + REGIMES
SPEED = "regimes: {over: machine.speed_rpm, from: 300, to: 700, n: 5}\n"
LEAVE = "has no meaning beside regimes: leave it out"


def test_cases_are_those_that_chains_begin_at(read):
    study = read(WORN + "machine: {rod_mass_kg: [3, 4]}\n" + REGIMES)
    assert study.request.values == [0.01, 0.1, 1.0]
    assert study.request.directions == ("up", "down")
    assert (study.request.settle_rev, study.request.measure_rev) == (50, 64)
    assert [axis.key for axis in study.axes] == ["machine.rod_mass_kg"]
    assert [case.clearance_mm.big_end for case in study.cases] == [0.01, 0.01]
    found = [(c.machine.rod_mass_kg, c.clearance_mm.big_end) for c in study.chains[1]]
    assert found == [(4.0, 0.01), (4.0, 0.1), (4.0, 1.0)]
    assert study.chains[0][0] == study.cases[0]


def test_defaults_that_depend_on_what_is_followed_follow_it(read):
    mass = "regimes: {over: machine.rod_mass_kg, from: 2, to: 6, n: 2}\n"
    (chain,) = read(WORN + "clearance_mm: 0.2\n" + mass).chains
    assert [case.machine.rod_inertia_kg_m2 for case in chain] == pytest.approx([0.06, 0.18])


def test_a_file_without_has_none(read):
    study = read(WORN + "clearance_mm: [0.1, 0.2]\n")
    assert (study.request, study.chains) == (None, ())


def test_overrides_reach_it_and_one_selects_chains(read):
    assert read(WHOLE, "regimes.n=2").request.n == 2
    whole = read(WORN, "regimes={over: clearance_mm, from: 0.1, to: 0.2, n: 2}")
    assert whole.request.last == 0.2
    two = WORN + "machine: {rod_mass_kg: [3, 4]}\n" + REGIMES
    assert [*read(two, only="machine.rod_mass_kg > 3").selected] == [1]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (WHOLE.replace("over", "ovr"), "2:11: regimes.ovr: unknown key; did you mean regimes.ov"),
        (WHOLE.replace("log:", "lgo:"), "2:56: regimes.lgo: unknown key; did you mean regimes.lo"),
        (WHOLE.replace(" n: 3,", ""), "2:1: regimes: needs n; write {over: clearance_mm, from:"),
        (WORN + "regimes: 5\n", "2:10: regimes: needs a mapping of keys, not 5"),
        (WHOLE.replace("clearance_mm", "speed_rpm"), "2:17: regimes.over: 'speed_rpm' is no key of"
         " a number, such as clearance_mm; did you mean machine.speed_rpm?"),
        (WHOLE.replace("clearance_mm", "joint"), "2:17: regimes.over: joint is no number"),
        (WHOLE.replace("clearance_mm", "solve.rtol"), "2:17: regimes.over: solve.rtol is nothing of"
         " the machine"),
        (WHOLE.replace("to: 1", "to: 2000"), "2:47: regimes.to: of clearance_mm: 2000 is outside"
         " [0, 1000] mm"),
        (WHOLE.replace("to: 1", "to: 0.01"), "2:47: regimes.to: from and to are both 0.01"),
        (WHOLE.replace("to: 1", "to: 0.001"), "2:47: regimes.to: 0.001 is below from, 0.01: write "
         "the lower end first, and direction: down"),
        (WHOLE.replace("0.01", "0"), "2:37: regimes.from: log needs ends above 0"),
        (WHOLE.replace("0.01", "0").replace("true", "false"), "2:1: regimes: starts from "
         "clearance_mm = 0, where a joint is ideal: begin above 0"),
        (WHOLE.replace("n: 3", "n: 1"), "2:53: regimes.n: 1 is outside [2, 100000]"),
        (WHOLE.replace("n: 3", "n: 2.5"), "2:53: regimes.n: needs a whole number in [2, 100000]"),
        (WHOLE.replace("both", "across"), "2:78: regimes.direction: needs up, down or both"),
        (WHOLE.replace("n: 3", "n: 3, section_deg: 360"), "regimes.section_deg: 360 is outside"),
        (WHOLE + "clearance_mm: 0.1\n", "3:1: clearance_mm: is what regimes follows: leave it out"),
        (WHOLE + "clearance_mm: {big_end: [0.1, 0.2]}\n", "3:16: clearance_mm.big_end: is what "),
        (REGIMES + "blocks: [{joint: big_end, clearance_mm: 0.1}]\n", "2:27: clearance_mm: is wh"),
        (WHOLE + "solve: {duration_rev: 5}\n", f"3:9: solve.duration_rev: {LEAVE}"),
        (WHOLE + "solve: {settle_rev: 0}\n", f"3:9: solve.settle_rev: {LEAVE}"),
        (WHOLE + "body: true\n", f"3:1: body: {LEAVE}"),
        (WHOLE + "body: {mass_kg: 900}\n", f"3:8: body.mass_kg: {LEAVE}"),
        (WHOLE + "sensor: true\n", f"3:1: sensor: {LEAVE}"),
        (WORN + f"blocks: [{{{REGIMES.strip()}}}]\n", "2:11: regimes: cannot stand in a block"),
        (SPEED, "1:1: regimes: has nothing to follow: no joint of the machine has clearance"),
        (f"joint: [none, big_end]\nclearance_mm: 0.1\n{SPEED}", "3:1: regimes: has nothing to"),
        (WORN + "clearance_mm: 0.1\nregimes: {over: gas.exponent, from: 1, to: 6, n: 2}\n",
         "3:44: regimes.to: of gas.exponent: 6 is outside [1, 5]"),
        (WHOLE.replace("to: 1", "to: 11"), "2:11: clearance_mm: 11 mm exceeds the pin radius"),
        (WORN + "clearance_mm: 0.1\n" + SPEED.replace("machine.speed_rpm, from: 300, to: 700",
         "gas.back_pressure_MPa, from: 0, to: 0.1"), "3:11: gas: nothing reads this group: it needs"
         " load == gas"),
    ],
)  # fmt: skip
def test_mistakes_are_told_with_place_key_and_remedy(read, text, message):
    with pytest.raises(CaseFileError) as caught:
        read(text)
    assert f"case.yaml:{message}" in str(caught.value) or message in str(caught.value)


def test_a_chain_reads_at_its_last_value_what_it_does_not_at_its_first(read):
    guide = "guide: {crosshead_length_mm: 90}\n"
    play = "regimes: {over: guide.clearance_mm, from: 0, to: 0.1, n: 3}"
    ends = read(f"joint: both\nclearance_mm: 0.1\n{guide}{play}").chains[0][::2]
    assert [case.guide.clearance_mm for case in ends] == [0.0, 0.1]


def test_the_schema_says_what_the_reader_says(read):
    schema = jsonschema.Draft202012Validator(case_schema())
    whole = {"over": "clearance_mm", "from": 0.1, "to": 1, "n": 3}
    for more, good in (
        ({}, True),
        ({"section_deg": 30.5, "direction": "both", "log": True}, True),
        ({"n": None}, False),
        ({"n": 1}, False),
        ({"over": "joint"}, False),
        ({"direction": "left"}, False),
        ({"settle": 3}, False),
    ):
        group = {key: value for key, value in (whole | more).items() if value is not None}
        case = {"joint": "big_end", "regimes": group}
        assert schema.is_valid(case) == good
        assert not schema.is_valid({"blocks": [case]})
        with contextlib.nullcontext() if good else pytest.raises(CaseFileError):
            read(json.dumps(case))
    assert not schema.is_valid({"regimes": 3})


def test_too_many_values_are_refused(read):
    with pytest.raises(CaseFileError, match=r"2:50: regimes\.n: 6 values are more than 5; lower n"):
        read(WHOLE, max_jobs=5)


def test_who_cannot_follow_says_so(read):
    with pytest.raises(CaseFileError, match=r"2:1: regimes: only `compsim run` and `compsim plan`"):
        read(WHOLE, follow=False)


def test_every_key_has_its_row():
    assert {*NEEDED} == {key for key, row in ROWS.items() if row.default is None}
    assert {"clearance_mm", "machine.speed_rpm", "friction.dynamic"} <= {*FOLLOWED}
    assert not {key for key in FOLLOWED if key.startswith(("solve.", "output.", "body."))}


def test_values_are_even_or_have_even_ratios(read):
    assert read(WORN + "clearance_mm: 0.1\n" + SPEED).request.values == [300, 400, 500, 600, 700]
    values = read(WHOLE, "regimes.n=9").request.values
    ratios = [math.log10(b / a) for a, b in itertools.pairwise(values)]
    assert ratios == pytest.approx([0.25] * 8)
