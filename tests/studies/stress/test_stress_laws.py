"""Extreme scenes with laws drawn: which they are, who judges them, and a few of a campaign."""

from collections import Counter

import pytest

from compressor.cases.case import Case
from compressor.cases.laws import CONTACT_LAWS, FRICTION_LAWS
from compressor.solve.solution import solve
from compressor.store.files import StoreError
from compressor.studies.stress.extremes import ELASTIC, FEATURES, OF_LAWS, RANGES, Budget, values
from compressor.studies.stress.judge import judge, judges
from compressor.studies.stress.stress import campaign
from compressor.studies.stress.words import list_outcomes

SMALL = Budget(FEATURES, revolutions=0.0625, max_steps=40_000, seconds=20.0)
COUNT, SEED = 4, 1


def test_scenes_have_every_law_and_else_the_numbers_of_old():
    seen, elastic = Counter(), Counter()
    for number in range(400):
        made, plain = values(number, 3, SMALL), values(number, 3, Budget("", 0.0625, 40_000, 20))
        contact, friction = made.pop("contact"), made.pop("friction")
        seen[contact["law"]] += 1
        seen[friction["law"]] += 1
        elastic[contact["law"]] += "restitution" not in contact
        for group, found in (("contact", contact), ("friction", friction)):
            before = plain.pop(group)
            assert {key: found[key] for key in before} == before
            for key, (whole, narrow) in OF_LAWS.items():
                low, high = narrow if number % 2 == 0 else whole
                value = found.get(key.partition(".")[2], low) if key.startswith(group) else low
                assert 0.999 * low <= value <= 1.001 * high
        had = {name: made.pop(name) for name in RANGES if name in made}
        seen.update([*had])
        rubbing = friction.pop("ideal_joints", False)
        seen["ideal_joints"] += rubbing
        for group, found in had.items():
            for key, spans in RANGES[group].items():
                low, high = spans[number % 2 == 0]
                value = found[key]
                assert 0.999 * low <= value <= 1.001 * high or (group, value) == ("guide", 0.0)
        cylinder = made.pop("gas", None)
        seen["gas"] += cylinder is not None
        assert made == plain
        friction |= {"ideal_joints": True} if rubbing else {}
        had |= {"gas": cylinder} if cylinder else {}
        Case.resolve({**made, **had, "contact": contact, "friction": friction})
    assert {*seen} == {*CONTACT_LAWS, *FRICTION_LAWS, *RANGES, "ideal_joints", "gas"}
    assert min(seen.values()) > 20
    assert {law for law, count in elastic.items() if count} == {*ELASTIC}


@pytest.mark.compiled
def test_scipy_judges_laws_that_remember_a_meeting():
    """It lands where bodies meet; a short run is judged by DOP853 first."""
    how = {"duration_rev": 0.1, "settle_rev": 0, "rtol": 1e-6, "horizon": False}
    law = {"law": "flores", "restitution": 0.6}
    values = {"joint": "small_end", "clearance_mm": 0.2, "contact": law, "solve": how}
    found = judge(Case.resolve(values))
    assert (found.verdict, found.by[0]) == ("ok", "DOP853")
    run = solve(Case.resolve(values))
    run.trajectory.evaluations = 20 * run.trajectory.steps  # as of the stiff partner
    assert judges(run) == ("TSIT5", "LSODA", "Radau")


@pytest.mark.compiled
def test_none_of_a_few_scenes_is_wrong_in_silence(tmp_path, in_process):
    study = campaign(tmp_path, COUNT, SEED, 1, budget=SMALL)
    verdicts = Counter(study["verdict"].values.tolist())
    assert verdicts["ok"] >= COUNT / 2, verdicts
    assert not verdicts["silent_wrong"], "\n".join(list_outcomes(study))
    assert f"--seed {SEED} --features" in "\n".join(list_outcomes(study))
    with pytest.raises(StoreError, match="with laws and features drawn"):
        campaign(tmp_path, COUNT, SEED, 1)
