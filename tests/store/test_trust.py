"""How far results are to be trusted, as the store keeps and tells it: promises and regimes."""

import pytest
from conftest import store_cases

from compressor.cases.case import Case
from compressor.metrics import NUMBERS, QUANTILES
from compressor.outcome import REGIME_WORDS, Regime
from compressor.solve.simulate import measure
from compressor.store.batch import write_batch
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
