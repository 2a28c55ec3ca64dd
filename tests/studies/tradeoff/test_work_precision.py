"""Work and precision: errors that fall, failures that stay, references that know their limits."""

import numpy as np
import pytest
import xarray as xr

from compressor.cases.case import Case
from compressor.report.figures.pictures import render
from compressor.solve.simulate import simulate
from compressor.store.netcdf import write_dataset
from compressor.studies.tradeoff.figures import draw_work_precision
from compressor.studies.tradeoff.work_precision import (
    ReferenceFailed,
    default_cases,
    errors,
    fastest,
    grid_values,
    reference,
    settle_span,
    stored_values,
    work_precision,
)

SHORT = {"duration_rev": 0.25, "settle_rev": 0}
METHODS = ("auto", "RODAS", "LSODA")


def case(**solve):
    return Case.from_values({"joint": "big_end", "clearance_mm": 0.2, "solve": {**SHORT, **solve}})


@pytest.fixture(scope="module")
def study():
    told = []
    found = work_precision(
        {"one": case()}, METHODS, (1e-7, 1e-3, 1e-5), 2, progress=lambda *event: told.append(event)
    )
    assert told[-1][:2] == (2 * 9 + 3, 2 * 9 + 3)
    return found


def test_a_case_that_stores_no_series_settles_before_it_is_measured():
    span = {"duration_rev": "auto", "settle_rev": "auto", "accuracy": "draft"}
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": span}
    case = settle_span(Case.from_values({**values, "output": {"keep": "metrics"}}))
    assert (case.solve.duration_rev, case.solve.settle_rev) == (4.0, 1.0)
    assert case.output.keep == "metrics"
    assert settle_span(case) is case


def test_errors_fall_with_the_tolerance(study):
    assert study["tolerance"].values.tolist() == [1e-3, 1e-5, 1e-7]
    for name in ("acceleration", "peak_acceleration", "rms_acceleration", "peak_contact_force"):
        found = study[f"error_{name}"].values
        assert (found[..., -1] < 1e-5).all(), name
    assert (study["error_acceleration"].diff("tolerance") < 0).all()


def test_tighter_tolerances_take_more_evaluations(study):
    assert (study["status"] == "ok").all()
    assert (study["evaluations"].diff("tolerance") > 0).all()
    assert (study["seconds"] > 0).all()
    assert float(study["seconds_compile"]) >= 0


def test_the_references_agree_better_than_what_they_judge(study):
    apart = study["reference_uncertainty"].sel(quantity="acceleration").item()
    assert 0 < apart < 1e-8
    assert study["error_acceleration"].min() > apart


def test_a_reference_is_never_judged_by_itself():
    found = work_precision({"one": case()}, ("DOP853",), (1e-12,), 1)
    apart = found["reference_uncertainty"].sel(quantity="acceleration").item()
    assert apart > 0
    assert found["error_acceleration"].item() == pytest.approx(apart, rel=1e-6)


def test_a_point_that_fails_stays_and_ends_its_row():
    # a compiled run of few steps ends before anybody looks at the clock
    found = work_precision({"one": case()}, ("auto", "Radau"), (1e-3, 1e-5), 2, budget=1e-9)
    radau = found.sel({"method": "Radau"}).squeeze()
    assert radau["status"].values.tolist() == ["failed", "missing"]
    assert radau["reason"].values.tolist() == ["budget_seconds", ""]
    assert np.isnan(radau["error_acceleration"]).all()
    assert (found.sel({"method": "auto"})["status"] == "ok").all()


def test_an_ideal_machine_is_refused():
    with pytest.raises(ValueError, match="calm has no joint with clearance"):
        work_precision({"calm": Case()})


def test_a_reference_that_fails_says_so():
    with pytest.raises(
        ReferenceFailed, match=r"^one: the reference, RODAS at 1e-12, ends with budget_steps"
    ):
        reference("one", case(max_steps=50), "RODAS")


def test_the_grid_misses_peaks_of_the_dense_solution():
    run = simulate(default_cases()["both 0.2"])
    joints = ["big_end", "small_end"]
    grid, dense = grid_values(run, joints), stored_values(run, joints)
    assert 0.9 < grid["peak_acceleration"] / dense["peak_acceleration"] < 0.999
    assert (grid["peak_contact_force"] <= dense["peak_contact_force"]).all()
    assert grid["rms_acceleration"] == pytest.approx(dense["rms_acceleration"], rel=0.01)
    assert errors(dense, dense) == dict.fromkeys(errors(dense, dense), 0.0)


def test_the_paper_s_point_is_judged_too(study):
    assert 0 < study["paper_error_acceleration"].item() < 0.1
    assert study["paper_error_peak_acceleration"].item() > 1e-3  # read from the output grid
    assert study["paper_seconds"].item() > study["seconds"].sel({"method": "auto"}).max()


def synthetic(errors, seconds, unknown):
    """A study of one scene by method and tolerance."""
    dims = ("scene", "method", "tolerance")
    return xr.Dataset(
        {
            "error_acceleration": (dims, [errors]),
            "seconds": (dims, [seconds]),
            "reference_uncertainty": (("scene", "quantity"), [[unknown]]),
        },
        {"scene": ["s"], "method": ["a", "b"], "tolerance": [1e-2, 1e-5],
         "quantity": ["acceleration"]},
    )  # fmt: skip


def test_the_fastest_of_each_decade():
    data = synthetic([[0.05, 2e-5], [0.5, 1e-4]], [[1.0, 9.0], [0.1, 3.0]], 1e-12)
    found = {row["error_below"]: (row["method"], row["seconds"]) for row in fastest(data)}
    assert found == {0.1: ("a", 1.0), 0.01: ("b", 3.0), 1e-3: ("b", 3.0), 1e-4: ("b", 3.0)}


def test_nothing_is_fastest_below_what_the_references_know():
    data = synthetic([[0.05, 1e-9], [np.nan, np.nan]], [[1.0, 9.0], [np.nan, 4.0]], 5e-5)
    assert [row["error_below"] for row in fastest(data)] == [0.1, 0.01, 1e-3, 1e-4]


def test_a_study_is_stored_for_other_tools(study, tmp_path):
    path = write_dataset(tmp_path / "new" / "study.nc", study)
    with xr.open_dataset(path, engine="h5netcdf") as found:
        assert found.load().equals(study)
        assert found.attrs["references"] == study.attrs["references"]
    assert all(study[name].attrs["long_name"] for name in study.variables)


def test_the_figure_draws_what_is_there(study):
    drawing = draw_work_precision(study)
    (panel,) = drawing.panels
    assert panel.x.log
    assert panel.y.log
    lines = [trace.y for trace in panel.traces if trace.y.size == 3]
    assert len(lines) == len(METHODS)
    assert lines[0] == pytest.approx(study["error_acceleration"].values[0, 0])
    assert render(drawing, "svg").startswith(b"<?xml")


def test_the_figure_has_a_panel_for_each_scene(study):
    scenes = [f"scene {number}" for number in range(4)]
    many = xr.concat(
        [study.assign_coords(scene=[name]) for name in scenes], "scene", data_vars="all"
    )
    drawing = draw_work_precision(many)
    assert [panel.title for panel in drawing.panels] == scenes


def test_the_figure_bears_failures(study):
    broken = study.copy(deep=True)
    broken["error_acceleration"].values[:] = np.nan
    assert render(draw_work_precision(broken), "png").startswith(b"\x89PNG")
