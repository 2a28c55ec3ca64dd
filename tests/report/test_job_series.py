"""The last revolution of single jobs: the stored numbers, of those jobs that kept them."""

import numpy as np
import pytest
from test_report import forget, part_of

from compressor.report import interactive
from compressor.report.figures import pictures
from compressor.report.figures.drawing import panels_of
from compressor.report.interactive import draw_job, job_scripts, script, series_name
from compressor.report.report import write_report
from compressor.store.reader import read_store
from compressor.store.studies import read_studies

LAST = slice(-1201, None)  # of 0.3 degrees a sample


def test_the_last_revolution_is_shown(paper_runs):
    run = paper_runs["both 0.3"]
    acceleration, force = panels_of(draw_job(run))
    assert acceleration.traces[0].y == pytest.approx(run["acceleration"].values[LAST])
    assert acceleration.traces[0].x[[0, -1]] == pytest.approx([0.0, 360.0])
    size = np.hypot(*run["contact_force"].sel(joint="small_end").values[LAST].T) / 1e3
    assert force.traces[1].name == "small end"
    assert force.traces[1].y == pytest.approx(size)


def test_only_jobs_that_kept_their_series_have_scripts(paper_store, monkeypatch):
    stored = read_store(paper_store)
    keys = [key for study in read_studies(paper_store) for key in study.keys]
    found = dict(job_scripts(stored, ["0" * 20, *keys]))
    assert {*found} == {*keys}
    assert all(text.startswith(f'compsimFigure("job-{key}"') for key, text in found.items())
    for key in keys:
        assert found[key] == script(series_name(key), draw_job(stored.job(key)))
    monkeypatch.setattr(interactive, "MAX_SERIES", 2)
    assert [key for key, _ in job_scripts(stored, keys)] == keys[:2]


def test_scripts_lie_beside_the_page_and_stale_ones_go(paper_store, tmp_path, monkeypatch):
    """Two jobs of a study one of which is gone, so that the study is nobody's but its own."""
    part = part_of(paper_store, tmp_path, "big-end")
    (study,) = read_studies(part)
    forget(part, study.keys[0])
    out = tmp_path / "out"
    out.mkdir()
    (out / "job-old.js").write_text("an earlier report's")
    monkeypatch.setattr(pictures, "render", lambda figure: bytes(24))
    write_report(part, out)
    assert {path.name for path in out.glob("job-*.js")} == {
        f"job-{key}.js" for key in study.keys[1:]
    }


def test_a_job_with_foreign_series_or_attributes_has_no_script(paper_store, monkeypatch):
    stored = read_store(paper_store)
    (key, *_) = stored.keys()
    whole, own = stored.values(key, interactive.SHOWN), stored.attributes
    monkeypatch.setattr(stored, "values", lambda *_: whole | {"time": whole["time"][:5]})
    assert not [*job_scripts(stored, [key])]
    monkeypatch.setattr(stored, "values", lambda *_: whole)
    assert [*job_scripts(stored, [key])]
    lacking = {name: one for name, one in own(0).items() if name not in ("settle", "case")}
    monkeypatch.setattr(type(stored), "attributes", lambda rows, position: lacking)
    assert not [*job_scripts(stored, [key])]
    assert stored.case_at(0) is None
