"""The examples that are installed with the program."""

import pytest

from compressor.analysis.cautions import cautions
from compressor.cases.examples import STARTS, templates
from compressor.cases.load import load_studies
from compressor.solve.simulate import simulate


@pytest.mark.parametrize("name", STARTS)
def test_templates_run_without_a_warning(name):
    """Two jobs of each, short ones: the axes' ends."""
    (study,) = load_studies(templates()[name].path, overrides=["solve.accuracy=draft"])
    assert cautions(study) == []
    for case in (study.cases[0], study.cases[-1]):
        run = simulate(case)
        assert run["status"].item() == "ok"
        assert run["peak_acceleration"] > 0
