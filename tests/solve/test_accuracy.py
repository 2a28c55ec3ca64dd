"""Accuracy by number, error bars: what they cover, what they say when they cannot, what is kept."""

import numpy as np
import pytest
from conftest import keep
from random_cases import random_cases

from compressor.cases.accuracy import ACCURACY, TIGHTEST, first_rung
from compressor.cases.case import Case
from compressor.cases.load import CaseFileError, load_studies
from compressor.metrics import ERRORS, METRICS, Bar, Metric
from compressor.solve import attempts
from compressor.solve.error_bars import INSTANTS, LARGE, OtherRun, bars, journal_distance, unmet
from compressor.solve.simulate import measure, simulate
from compressor.store.reader import job_status, open_study
from compressor.store.studies import read_studies, write_study

SHORT = {"duration_rev": 1, "settle_rev": 0.5, "accuracy": "draft"}
BOTH = {"joint": "both", "clearance_mm": 0.2}
EIGHT = random_cases(8)


def run(values, **solve):
    """A run's numbers, at draft unless rtol is given."""
    short = {key: value for key, value in SHORT.items() if key != "accuracy" or "rtol" not in solve}
    return measure(Case.from_values({**values, "solve": {**short, **solve}})).numbers


def exact(values):
    return run(values, rtol=1e-11, error_bars=False)


def within(found, truth, stretch=1.0):
    """Whether each number of each metric lies within its bar of the truth, times `stretch`."""
    return np.concatenate([
        np.ravel(np.abs(found[name] - truth[name]) <= stretch * found[f"{name}_error"])
        for name in METRICS
    ])  # fmt: skip


# Error bars


@pytest.mark.parametrize("method", ["auto", "LSODA"])
def test_metrics_are_bit_equal_with_and_without_bars(method):
    plain, barred = (run(BOTH, error_bars=bars, method=method) for bars in (False, True))
    for name in METRICS:
        np.testing.assert_array_equal(plain[name], barred[name])
        assert np.isnan(plain[f"{name}_error"]).all()
        assert np.isfinite(barred[f"{name}_error"]).all()
    assert barred["peak_acceleration_error"] > 0


@pytest.fixture(scope="module")
def eight():
    """Runs at draft of eight random cases, and the exact ones."""
    return [(run(values), exact(values)) for values in EIGHT]


def test_bars_cover_most_true_errors(eight):
    covered = np.concatenate([within(*pair) for pair in eight])
    assert covered.mean() >= 0.9
    # and no more than needed: the same bars do not cover when they are a hundred times shorter
    assert np.concatenate([within(*pair, stretch=0.01) for pair in eight]).mean() < 0.7


def test_bars_of_the_same_run_twice_would_cover_little(eight):
    """What would go wrong if the looser run were no looser."""
    covered = []
    for found, truth in eight:
        metrics = {name: found[name] for name in METRICS}
        rtol = ACCURACY["draft"].rtol
        same = bars(metrics, [OtherRun(metrics, 10 * rtol)], rtol, 0.0)
        wrong = [np.ravel(np.abs(found[n] - truth[n]) > same[n]) for n in METRICS]
        covered.append(~np.concatenate(wrong))
    assert np.concatenate(covered).mean() < 0.6


def test_the_looser_run_is_ten_times_looser(monkeypatch):
    asked = []
    original = attempts.integrate
    monkeypatch.setattr(
        attempts, "integrate", lambda request: asked.append(request) or original(request)
    )
    run(BOTH, rtol=1e-5)
    assert [request.rtol for request in asked] == pytest.approx([1e-5, 1e-4])
    assert asked[1].times.size == INSTANTS + 1
    assert set(asked[1].times) <= set(asked[0].times)


@pytest.mark.parametrize(
    ("rtol", "others"), [(1e-3, [1e-4]), (2e-7, [2e-6, 2e-4]), (1e-8, [1e-7, 1e-5])]
)
def test_the_other_runs_of_a_run(rtol, others):
    case = Case.from_values(
        {**BOTH, "solve": {"duration_rev": 0.25, "settle_rev": 0, "rtol": rtol}}
    )
    found = attempts.attempt(case, 0, 60.0, False)
    runs = attempts.other_runs(case, found, 60.0)
    assert [run.rtol for run in runs] == pytest.approx(others)


def test_a_run_that_was_repeated_is_compared_with_a_tighter_one():
    """Its looser run has failed the audit of its energy."""
    case = Case.from_values(
        {**BOTH, "solve": {"duration_rev": 0.25, "settle_rev": 0, "rtol": 1e-5}}
    )
    found = attempts.attempt(case, 1, 60.0, False)
    (other,) = attempts.other_runs(case, found, 60.0)
    assert other.rtol == pytest.approx(1e-7)


def test_a_looser_run_that_fails_leaves_the_error_unknown(monkeypatch):
    original = attempts.integrate

    def failing(request):
        found = original(request)
        if request.times.size == INSTANTS + 1:
            found.reason, found.detail = "step_underflow", "made to fail"
        return found

    monkeypatch.setattr(attempts, "integrate", failing)
    found = measure(Case.from_values({**BOTH, "solve": SHORT}))
    assert found.status == "ok"
    for name in ERRORS:
        assert np.isinf(found.numbers[name]).all()


LOOSE = {
    "joint": "both", "clearance_mm": {"big_end": 0.023235, "small_end": 0.00067005},
    "machine": {"speed_rpm": 10636, "rod_mass_kg": 0.021709, "reciprocating_mass_kg": 0.11307,
                "pin_radius_mm": 11.146},
    "contact": {"stiffness_N_per_mm15": 527880, "exponent": 1.4911, "damping_N_s_per_mm": 59.029},
    "friction": {"static": 0.86904, "dynamic": 0.43905, "stiction_velocity_mm_per_s": 0.089756,
                 "friction_velocity_mm_per_s": 0.89756},
}  # fmt: skip


def test_beyond_loose_tolerances_the_stiff_partner_estimates_the_error():
    """Explicit steps run over friction's fast modes, at ten times this tolerance as well."""
    solve = {"duration_rev": 0.03125, "settle_rev": 0, "output_step_deg": 0.0625}
    case, exact = (
        Case.from_values({**LOOSE, "solve": {**solve, **how}})
        for how in ({"rtol": 2.5e-4}, {"rtol": 1e-7, "method": "RODAS"})
    )
    found, truth = attempts.solve(case), attempts.solve(exact)
    looser = attempts.bars_of(found, [attempts.attempt(case, -1, 60.0, False)])
    name = "rms_acceleration_deviation"
    error = abs(found.metrics[name] - truth.metrics[name])
    assert error > 10 * looser[name]
    assert error <= found.bars[name]


def test_bars_do_not_trust_metrics_that_agree_by_chance(eight):
    """Runs whose journals have parted, but whose metrics have not."""
    metrics = {name: eight[0][0][name] for name in METRICS}
    near, together, parted = (
        bars(metrics, [OtherRun(metrics, 1e-5, apart)], 1e-6, 0.0) for apart in (0.0, 0.009, 0.1)
    )
    for name, value in metrics.items():
        if not METRICS[name].bar.relative:
            assert parted[name] == pytest.approx(0.03 * np.maximum(value, 1.0)), name
            continue
        assert (near[name] <= 1e-12 * np.abs(value)).all(), name
        path = 0.009 * METRICS[name].bar.of_path
        assert together[name] == pytest.approx(path * np.abs(value), rel=2 * path / LARGE), name
        size = np.max(np.abs(value)) or 1.0  # a metric may be 0
        grown = 0.03 * np.abs(value) * (1 + 0.03 * np.abs(value) / (LARGE * size))
        assert parted[name] == pytest.approx(grown), name


def test_a_second_run_catches_what_the_first_misses(eight):
    """A run ten times looser that agrees by chance, and one a thousand times looser."""
    metrics = {name: eight[0][0][name] for name in METRICS}
    other = {name: 1.1 * value for name, value in metrics.items()}
    twin, far = OtherRun(metrics, 1e-7), OtherRun(other, 1e-5)
    alone, both = bars(metrics, [twin], 1e-8, 0.0), bars(metrics, [twin, far], 1e-8, 0.0)
    near = bars(metrics, [OtherRun(other, 1e-7)], 1e-8, 0.0)
    for name in (name for name, row in METRICS.items() if row.peak):
        size = np.max(np.abs(metrics[name]))
        assert np.max(alone[name]) < 1e-12 * size
        assert 2e-3 * size < np.max(both[name]) < 0.1 * np.max(near[name])


def test_a_metric_added_to_the_table_has_error_bars(monkeypatch):
    """Without shares of its own it gets the default ones."""
    given = attempts.metrics
    monkeypatch.setitem(METRICS, "loss", Metric("loss", (), "J", "a toy metric"))
    monkeypatch.setattr(
        attempts, "metrics", lambda p, tally: given(p, tally) | {"loss": tally["damping_loss"]}
    )
    how = {"duration_rev": 0.5, "settle_rev": 0, "rtol": 1e-5}
    case = Case.from_values({**BOTH, "solve": how})
    found, looser = attempts.solve(case), attempts.attempt(case, -1, 60.0, False)
    apart = abs(found.metrics["loss"] - looser.metrics["loss"])
    assert 0 < Bar().own * apart <= found.bars["loss"] < 0.5 * found.metrics["loss"]


def test_long_bars_grow(eight):
    metrics = {name: eight[0][0][name] for name in METRICS}
    rms, ratio = metrics["rms_acceleration"], []
    for share in (1e-4, 1e-2, 1.0):
        other = OtherRun({**metrics, "rms_acceleration": (1 + share) * rms}, 1e-5)
        ratio.append(bars(metrics, [other], 1e-6, 0.0)["rms_acceleration"] / (share * rms))
    own = METRICS["rms_acceleration"].bar.own
    grown = [own * (1 + own * share / LARGE) for share in (1e-4, 1e-2, 1.0)]
    assert ratio == pytest.approx(grown, rel=1e-3)


def test_bars_do_not_depend_on_the_output_grid():
    found = [
        measure(Case.from_values({**BOTH, "solve": {**SHORT, **solve}, "output": {"keep": keep}}))
        for solve, keep in (({}, "series"), ({"output_step_deg": 7.2}, "series"), ({}, "metrics"))
    ]
    for other in found[1:]:
        for name in ERRORS:
            np.testing.assert_array_equal(found[0].numbers[name], other.numbers[name])


def test_journals_part_by_their_distance_over_their_room():
    p = np.array((np.array([1e-4, 0.0]),), dtype=[("clearance", "f8", 2)])[()]
    ours, theirs = np.zeros((3, 2, 2)), np.zeros((3, 2, 2))
    assert journal_distance(p, ours, theirs) == 0.0
    theirs[1, 0] = 3e-5, 4e-5
    theirs[1, 1] = 1.0  # of a joint without clearance
    assert journal_distance(p, ours, theirs) == pytest.approx(0.5)
    ours[2, 0] = theirs[2, 0] = 0.0, 2e-4  # as far as it came
    assert journal_distance(p, ours, theirs) == pytest.approx(0.25)


def test_a_failed_run_has_no_bars():
    found = run(BOTH, max_steps=50)
    for name in ERRORS:
        assert np.isnan(found[name]).all()


@pytest.mark.parametrize("load", ["design", "typical", "none"])
def test_bars_of_the_ideal_machine_cover_its_quadrature(load):
    found = measure(Case.from_values({"load": load, "solve": SHORT}))
    truth = attempts.attempt(Case.from_values({"load": load, "solve": SHORT}), 3, 60, True).metrics
    for name in METRICS:
        error = np.abs(found.numbers[name] - truth[name])
        assert (error <= found.numbers[f"{name}_error"]).all(), name
    assert found.numbers["peak_acceleration_error"] < 1e-5 * found.numbers["peak_acceleration"]


def test_a_long_ideal_run_is_cut_by_revolutions():
    """Without load corners the whole run is one stretch."""
    solve = {"duration_rev": 200, "settle_rev": 0, "output_step_deg": 10}
    long = measure(Case.from_values({"load": "none", "solve": solve})).numbers
    short = measure(Case.from_values({"load": "none", "solve": SHORT | {"settle_rev": 0}})).numbers
    assert long["rms_acceleration"] == pytest.approx(short["rms_acceleration"], rel=1e-9)
    assert long["peak_contact_force"] == pytest.approx(short["peak_contact_force"], rel=1e-4)


def test_bars_are_no_part_of_a_job_s_identity():
    keys = {Case.from_values({**BOTH, "solve": {"error_bars": bars}}).key for bars in (True, False)}
    assert len(keys) == 1


def test_a_stored_job_without_bars_does_not_serve_a_case_that_wants_them(tmp_path):
    solve = SHORT | {"duration_rev": 0.25, "settle_rev": 0}
    plain, barred, by_number = (
        Case.from_values({"solve": solve | more, "output": {"keep": "metrics"}})
        for more in ({"error_bars": False}, {}, {"accuracy": {"rms_acceleration": 0.1}})
    )
    keep(tmp_path, simulate(plain))
    stored = job_status(tmp_path, plain.key)
    assert stored.serves(plain)
    assert not stored.serves(barred)
    keep(tmp_path, simulate(barred))
    stored = job_status(tmp_path, plain.key)
    assert stored.serves(plain)
    assert stored.serves(barred)
    keep(tmp_path, simulate(by_number))
    assert job_status(tmp_path, by_number.key).serves(by_number)


# Accuracy by number


@pytest.mark.parametrize("values", [EIGHT[0], EIGHT[5]])
def test_a_number_is_reached_truly_and_a_looser_one_costs_less(values):
    truth = exact(values)
    steps = []
    for target in (1e-2, 1e-4, 1e-6):
        found = measure(
            Case.from_values(
                {**values, "solve": SHORT | {"accuracy": {"peak_acceleration": target}}}
            )
        )
        peak, bar = (found.numbers[f"peak_acceleration{end}"] for end in ("", "_error"))
        assert found.status == "ok"
        assert bar <= target * peak
        assert abs(peak / truth["peak_acceleration"] - 1) <= target
        steps.append(found.numbers["steps"])
    assert steps == sorted(steps)
    assert steps[0] < steps[-1]


def test_the_rtol_told_is_the_one_that_gives_the_same_metrics():
    found = measure(
        Case.from_values({**BOTH, "solve": SHORT | {"accuracy": {"max_penetration": 1e-3}}})
    )
    assert found.attributes["rtol"] < first_rung((("max_penetration", 1e-3),))
    again = run(BOTH, rtol=found.attributes["rtol"])
    for name in METRICS:
        assert found.numbers[name].tolist() == again[name].tolist()


@pytest.mark.parametrize(
    ("solve", "reason", "detail"),
    [
        ({"accuracy": {"peak_contact_force": 2e-9}}, "accuracy_not_reached", "no run is tighter"),
        ({"accuracy": {"peak_acceleration": 1e-7}, "max_steps": 12_000},
         "accuracy_not_reached", "the next run: more than 12000 steps"),
    ],
)  # fmt: skip
def test_accuracy_that_is_not_reached_is_told_and_numbers_are_kept(solve, reason, detail):
    found = measure(Case.from_values({**BOTH, "solve": SHORT | solve}))
    (name, target), *_ = solve["accuracy"].items()
    assert (found.status, found.reason) == ("failed", reason)
    assert found.attributes["detail"].startswith(f"{name}: its error bar is ")
    assert found.attributes["detail"].endswith(detail)
    assert found.attributes["complete"] == 1
    bar = found.numbers[f"{name}_error"] / found.numbers[name]
    assert target < bar.max() < np.inf
    assert found.attributes["rtol"] >= 0.99 * TIGHTEST


def test_time_that_runs_out_on_the_ladder_can_be_raised():
    """The clock's reason, which a longer timeout makes try again (JobStatus.serves)."""
    case = Case.from_values(
        {**BOTH, "solve": SHORT | {"accuracy": {"peak_acceleration": 1e-4}, "timeout_s": 1e-9}}
    )
    assert measure(case).reason == "budget_seconds"


def test_ideal_joints_meet_any_number():
    solve = SHORT | {"accuracy": {"max_penetration": 1e-6, "impact_count": 1e-6}}
    found = measure(Case.from_values({"solve": solve}))
    assert found.status == "ok"
    assert found.numbers["max_penetration_error"].tolist() == [0, 0]
    one = measure(Case.from_values({"joint": "big_end", "clearance_mm": 0.2, "solve": solve}))
    assert one.status == "ok"


def test_unmet_names_the_worst_joint():
    found = {"max_penetration": np.array([2.0, 0.0]), "impact_count": np.array([0.0, 0.0])}
    error = {"max_penetration": np.array([0.1, 0.0]), "impact_count": np.array([0.0, 1.0])}
    assert unmet((("max_penetration", 0.1),), found, error) == []
    (said,) = unmet((("max_penetration", 0.01),), found, error)
    assert said == "max_penetration: its error bar is 0.05 of it, not 0.01"
    (said,) = unmet((("impact_count", 0.5),), found, error)
    assert "inf" in said


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("{peak_accelaration: 0.01}", "2:21", "solve.accuracy.peak_accelaration: unknown metric; "
         "did you mean peak_acceleration?"),
        ("{loudness: 0.01}", "2:21", "solve.accuracy.loudness: unknown metric; metrics are "
         "peak_acceleration, "),
        ("{peak_acceleration: 0.6}", "2:40",
         "solve.accuracy.peak_acceleration: 0.6 is outside (1e-09, 0.5]"),
        ("{peak_acceleration: [0.1, 0.2]}", "2:40",
         "solve.accuracy.peak_acceleration: needs a number, not [0.1, 0.2]"),
        ("{}", "2:20", "solve.accuracy: needs a metric, such as {peak_acceleration: 0.01}"),
        ("finest", "2:20", "solve.accuracy: 'finest' is none of draft | standard | fine"),
        ("[fine, {impact: 0.1}]", "2:28", "solve.accuracy.impact: unknown metric"),
        ("{peak_acceleration: 0.1}\n  rtol: 1e-5", "3:9", "solve.rtol: stands in place of"),
    ],
)  # fmt: skip
def test_mistakes_are_told_with_their_place(tmp_path, text, place, message):
    path = tmp_path / "case.yaml"
    path.write_text(f"solve:\n         accuracy: {text}\n".replace("\n  rtol", "\n         rtol"))
    with pytest.raises(CaseFileError) as caught:
        load_studies(path)
    (problem,) = caught.value.problems
    assert message in str(problem)
    assert problem.place.line == int(place.partition(":")[0])


def test_accuracy_by_number_is_an_axis_too(tmp_path):
    path = tmp_path / "trade.yaml"
    path.write_text(
        "solve:\n  accuracy:\n    - fine\n    - {peak_acceleration: 0.01}\n"
        "    - rms_acceleration: 1e-3\n      max_penetration: 0.02\n"
    )
    (study,) = load_studies(path)
    assert [case.targets for case in study.cases] == [
        (),
        (("peak_acceleration", 0.01),),
        (("max_penetration", 0.02), ("rms_acceleration", 1e-3)),
    ]
    assert len({case.key for case in study.cases}) == 3
    for case in study.cases:
        assert Case.from_values(case.values()) == case
        keep(tmp_path, simulate(case))
    for _ in range(2):  # written once, though JSON knows no tuples
        write_study(tmp_path, study, "once")
        (stored,) = read_studies(tmp_path)
        assert stored.axes[0].values == study.axes[0].values
    with open_study(tmp_path) as data:
        assert data.accuracy.values.tolist() == [
            "fine",
            "peak_acceleration, 0.01",
            "max_penetration, 0.02, rms_acceleration, 0.001",
        ]
        assert data.peak_acceleration_error.dims == ("accuracy",)
        assert np.isfinite(data.peak_acceleration_error).all()


def test_tiers_promise_more_for_tighter_tolerances():
    tiers = list(ACCURACY.values())
    assert [tier.rtol for tier in tiers] == sorted((t.rtol for t in tiers), reverse=True)
    assert [tier.promise for tier in tiers] == sorted((t.promise for t in tiers), reverse=True)
    assert first_rung((("peak_acceleration", 0.5),)) > ACCURACY["draft"].rtol
