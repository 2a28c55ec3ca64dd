"""How far results are to be trusted, as the store keeps and tells it: promises and regimes."""

import math

import numpy as np
import pytest
import xarray as xr
from conftest import store_cases

from compressor.cases.case import Case
from compressor.metrics import METRICS, NUMBERS, QUANTILES
from compressor.outcome import REGIME_WORDS, Regime
from compressor.solve.simulate import measure
from compressor.store.batch import write_batch
from compressor.store.dataset import mask_untrusted
from compressor.store.reader import open_study, read_store
from compressor.store.status import standings

BRIEF = {"duration_rev": 1.2, "settle_rev": 0.2, "output_step_deg": 0.9}
RING = {
    "joint": "big_end",
    "clearance_mm": 0.3,
    "machine": {"rod_mass_kg": 1, "speed_rpm": 1000},
    "contact": {"damping_N_s_per_mm": [0, 336]},
    "solve": {**BRIEF, "duration_rev": 3.2, "max_steps": [5, 10**6]},
    "output": {"keep": "metrics"},
}


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """A folder with a study of four jobs: one is chaotic, one is kept, two failed."""
    folder = tmp_path_factory.mktemp("ring")
    store_cases(folder, ring=RING)
    return folder / "results"


@pytest.fixture(scope="module")
def plain():
    """The outcome of a job that is not chaotic."""
    values = {"joint": "big_end", "clearance_mm": 0.3, "solve": BRIEF}
    return measure(Case.from_values({**values, "output": {"keep": "metrics"}}))


def test_promise_and_regime_of_each_job_are_kept(ring):
    study = open_study(ring)
    assert study["regime"].values.tolist() == [["", "chaotic"], ["", "periodic"]]
    assert study["promise"].values.tolist() == [["none", "none"], ["none", "kept"]]
    for key, regime in zip(study["key"].values.flat, study["regime"].values.flat, strict=True):
        assert read_store(ring).job(key).attrs["regime"] == regime


def test_statistics_take_no_room_where_nothing_is_chaotic(plain, ring, tmp_path):
    always = {name for name, row in NUMBERS.items() if not row.when}
    write_batch(tmp_path, [plain])
    assert read_store(tmp_path).given == always
    assert NUMBERS.keys() & plain.table({}).keys() == always
    assert "quantile" not in plain.table({})
    study = open_study(ring)
    statistics = {name for name, row in NUMBERS.items() if row.when == "chaotic"}
    assert statistics <= {*study.variables}
    assert study["quantile"].values.tolist() == list(QUANTILES)
    chaotic = study["regime"] == "chaotic"
    assert (study["revolutions"].notnull() == chaotic).all()
    assert float(study["revolutions"].where(chaotic).max()) == 3


def test_what_is_not_known_can_be_masked(ring):
    every, known = open_study(ring), open_study(ring, trusted=True)
    for name, row in METRICS.items():
        kept = known[name].notnull()
        bar, value = every[f"{name}_error"], abs(every[name])
        vouched = bar < value if row.bar.relative else np.isfinite(bar)
        vouched |= bar == 0
        assert (kept == (vouched & (every["status"] == "ok"))).all(), name
        assert known[name].where(kept).equals(every[name].where(kept)), name
        assert (known[f"{name}_error"].notnull() == kept).all(), name
    chaotic = every["regime"] == "chaotic"
    assert known["peak_acceleration"].where(chaotic).isnull().all()
    assert known["peak_acceleration"].where(every["promise"] == "kept").notnull().sum() == 1
    assert known["rms_acceleration"].attrs == every["rms_acceleration"].attrs


def test_numbers_that_few_jobs_have_can_be_masked():
    """Of the rod load, the body and its sensor as well; without any bar nothing is known."""
    jobs = {
        "status": ["ok", "ok", "failed"], "sensor_rms": [5.0] * 3,
        "sensor_rms_error": [math.inf, 0.1, 0.1], "peak_rod_load_tension": [9.0] * 3,
        "peak_rod_load_tension_error": [1.0, 10.0, 1.0], "rod_load_reversal_angle": [2.0] * 3,
        "rod_load_reversal_angle_error": [math.inf, 3.0, 1.0], "body_velocity_rms": [1.0] * 3,
    }  # fmt: skip
    found = mask_untrusted(xr.Dataset({name: ("job", values) for name, values in jobs.items()}))
    kept = {
        "sensor_rms": [False, True, False], "peak_rod_load_tension": [True, False, False],
        "rod_load_reversal_angle": [False, True, False], "body_velocity_rms": [False] * 3,
    }  # fmt: skip
    for name, known in kept.items():
        assert found[name].notnull().values.tolist() == known, name


def test_status_counts_by_promise_and_by_regime(ring, compsim):
    (one,) = standings(ring)
    assert one.promises == {"none": 1, "kept": 1}
    assert one.regimes == {"chaotic": 1, "periodic": 1}
    out = compsim("status", "-r", ring).out
    assert max(map(len, out.splitlines())) <= 80
    out = " ".join(out.split())
    assert (
        "of those ok: 1 without an accuracy target, 1 reached their accuracy target of those ok"
        in out
    )
    for regime in ("chaotic", "periodic"):
        assert f"of those ok: 1 {regime} ({REGIME_WORDS[Regime(regime)]})" in out
