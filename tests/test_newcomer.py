"""Recipes of compressor/README.md, followed literally in one copy of the program."""

import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from conftest import part_of

ROOT = Path(__file__).parents[1]


def blocks(begin, end):
    """The page's blocks of code from one heading to another, in their order."""
    page = (ROOT / "compressor/README.md").read_text(encoding="utf-8")
    section = page.partition(f"## How to add {begin}\n")[2].partition(f"## How to add {end}\n")[0]
    found = re.findall(r"^ *```py\n.*?^ *```", section, re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(text).removeprefix("```py\n").removesuffix("```") for text in found]


def put(path, place, new):
    """Put a text into a file, behind its one place."""
    text = path.read_text(encoding="utf-8")
    assert text.count(place) == 1, f"{path}: {place!r}"
    path.write_text(text.replace(place, place + new), encoding="utf-8")


def put_verb(copy, name, module, line):
    """Add a verb by its module and its line in the table of verbs."""
    (copy / f"cmd/compsim/{name}.py").write_text(module, encoding="utf-8")
    put(copy / "cmd/compsim/cli.py", '"Read what is stored": (', f"{line.strip()} ")


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy with two metrics, a figure, two verbs and a study more."""
    place = tmp_path_factory.mktemp("copy")
    for folder in ("compressor", "cmd"):
        shutil.copytree(ROOT / folder, place / folder,
                        ignore=shutil.ignore_patterns("*.pyc.*"))  # fmt: skip
    rows = textwrap.indent("".join(blocks("a metric", "a figure")), "    ")
    put(place / "compressor/metrics.py", "TABLE = (\n", rows)
    with open(place / "compressor/report/figures/paper.py", "a", encoding="utf-8") as figures:
        print("\n", *blocks("a figure", "a verb"), sep="\n", file=figures)
    put_verb(place, "size", *blocks("a verb", "a study"))
    module, *verb = blocks("a study", "a public name")
    (place / "compressor/studies/count.py").write_text(module, encoding="utf-8")
    put_verb(place, "count", *verb, '"count",')
    return place


def run_in(copy, *words):
    """What Python prints in the copy, which compiles nothing."""
    environment = os.environ | {"COMPSIM_JIT": "0", "PYTHONPATH": f"{copy}:{copy / 'cmd'}"}
    ran = subprocess.run(
        [sys.executable, *words], cwd=copy, capture_output=True, text=True, env=environment
    )
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
    return ran.stdout


METRICS = """
import compressor
solve = {"duration_rev": 0.05, "settle_rev": 0, "accuracy": "draft"}
values = {"joint": "big_end", "clearance_mm": 0.2, "solve": solve}
run = compressor.simulate(compressor.Case.from_values(values))
for name in ("contact_seconds_per_rev", "contact_seconds_per_rev_error", "contact_loss_fraction"):
    print(float(run[name].sel(joint="big_end")))
values = {"drive": {"flywheel_kg_m2": 0.5}, "solve": solve}
more = compressor.simulate(compressor.Case.from_values(values))
print(float(more.mean_crank_speed), float(more.crank_speed.mean()))
print(run.contact_seconds_per_rev.attrs["units"], "mean_crank_speed" in run)
"""


def test_new_metrics_are_measured(copy):
    *numbers, unit, of_others = run_in(copy, "-c", METRICS).split()
    assert (unit, of_others) == ("s", "False")
    seconds, bar, lost, speed, mean = map(float, numbers)
    assert seconds == pytest.approx((1 - lost) * 60 / 500)
    assert 0 < bar < 0.1 * seconds
    assert speed == pytest.approx(mean, rel=1e-3)


REPORT = """
import sys
from compressor.report.figures import pictures
from compsim import cli
draw = pictures.render
def draw_new(figure):
    is_new = figure.layout.yaxis.title.text == "velocity (m/s)"
    return draw(figure) if is_new else b"drawn"
pictures.render = draw_new
sys.exit(cli.main(["report", "-o", "out"]))
"""  # the other pictures are as ever


def test_a_new_figure_is_in_the_report_and_new_verbs_run(copy, paper_store):
    part_of(paper_store, copy / "results", "design", "big-end")  # which the figure needs
    run_in(copy, "-c", REPORT)
    page = (copy / "out/index.html").read_text(encoding="utf-8")
    assert "Velocity against displacement" in page
    assert re.search(r"Greatest velocity: 6\.\d+ m/s", page)
    assert len((copy / "out/figure-17.csv").read_text(encoding="utf-8").splitlines()) > 1000
    assert (copy / "out/figure-17.png").stat().st_size > 10_000
    (copy / "some").mkdir()
    (copy / "some/file").write_text("four", encoding="utf-8")
    assert run_in(copy, "-m", "compsim", "size", "-r", "some") == "4\n"
    assert run_in(copy, "-m", "compsim", "count", "big-end") == "periodic 3\n"
    assert "Print how many jobs of a study" in run_in(copy, "-m", "compsim", "--help")
