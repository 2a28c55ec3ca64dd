"""The recipes of compressor/README.md, followed literally in one copy of the program."""

import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from conftest import part_of

from compressor.physics.contact_laws import Law

ROOT = Path(__file__).parents[1]
LAWS = "compressor/physics/contact_laws.py"


def blocks(begin, end):
    """The page's blocks of code from one heading to another, in their order."""
    page = (ROOT / "compressor/README.md").read_text(encoding="utf-8")
    section = page.partition(f"## How to add {begin}\n")[2].partition(f"## How to add {end}\n")[0]
    found = re.findall(r"^ *```py\n.*?^ *```", section, re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(text).removeprefix("```py\n").removesuffix("```") for text in found]


def indented(text):
    return textwrap.indent(text, "    ")


def put(copy, name, *edits):
    """Put texts into a file of the copy: each behind its one place, or at the end if that is ""."""
    path = copy / name
    text = path.read_text(encoding="utf-8")
    for place, new in edits:
        assert not place or text.count(place) == 1, f"{name}: {place!r}"
        text = text.replace(place, place + new) if place else f"{text}\n\n{new}"
    path.write_text(text, encoding="utf-8")


def put_verb(copy, name, module, line):
    """Add a verb by its module and its line in the table of verbs."""
    (copy / f"cmd/compsim/{name}.py").write_text(module, encoding="utf-8")
    put(copy, "cmd/compsim/cli.py", ('"Read what is stored": (', f"{line.strip()} "))


def put_laws(copy):
    """Add the law that damps by a restitution, and the one with a force of its own."""
    member, damping, words, given, force, choice = blocks(
        "a contact law", "a feature of the mechanism"
    )
    source = (ROOT / LAWS).read_text(encoding="utf-8")
    _, *branches = re.split(r"^# (\w+)[^\n]*\n", choice, flags=re.MULTILINE)
    heads = [
        re.search(rf'def {name}\(.*?""".*?"""\n', source, re.DOTALL).group()
        for name in branches[::2]
    ]
    put(
        copy, LAWS,
        (f"    LIU = {int(Law.LIU)}\n", indented(f"{member}LINEAR = {Law.LIU + 2}\n")),
        ("    Law.LIU: lambda e: 0.75 * (1.0 - e**2),\n", indented(damping)),
        *zip(heads, map(indented, branches[1::2]), strict=True),
        ("", f"LINEAR = int(Law.LINEAR)\n\n\n{force}"),
    )  # fmt: skip
    put(
        copy, "compressor/cases/laws.py",
        ("RESTITUTING = (", f"{words.strip()} "),
        ('CONTACT_LAWS = ("impact", ', '"linear", '),
        ('"damping_N_s_per_mm": ("impact",', ' "linear"'),
    )  # fmt: skip
    put(copy, "tests/published.py", ("GIVEN = {\n", indented(given)))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy with two laws, two metrics, a figure, two verbs and a study more."""
    place = tmp_path_factory.mktemp("copy")
    for folder in ("compressor", "cmd", "tests"):
        shutil.copytree(ROOT / folder, place / folder,
                        ignore=shutil.ignore_patterns("results", "numba-*"))  # fmt: skip
    shutil.copyfile(ROOT / "pyproject.toml", place / "pyproject.toml")
    put_laws(place)
    put(
        place,
        "compressor/metrics.py",
        ("TABLE = (\n", indented("".join(blocks("a metric", "a figure")))),
    )
    put(place, "compressor/report/figures/paper.py", ("", *blocks("a figure", "a verb")))
    put_verb(place, "size", *blocks("a verb", "a study"))
    module, *verb = blocks("a study", "a public name")
    (place / "compressor/studies/count.py").write_text(module, encoding="utf-8")
    put_verb(place, "count", *verb, '"count",')
    return place


WORK = """
import compressor
import pytest
from compsim import cli
from compressor.report.figures import pictures

draw = pictures.render
def draw_new(figure):
    is_new = figure.layout.yaxis.title.text == "velocity (m/s)"
    return draw(figure) if is_new else b"drawn"
pictures.render = draw_new  # the other pictures are as ever
for words in ("report -o out", "size -r some", "count big-end", "--help"):
    assert cli.main(words.split()) == 0, words
print("metrics")
solve = {"duration_rev": 0.05, "settle_rev": 0, "accuracy": "draft"}
values = {"joint": "big_end", "clearance_mm": 0.2, "solve": solve}
run = compressor.simulate(compressor.Case.from_values(values))
for name in ("contact_seconds_per_rev", "contact_seconds_per_rev_error", "contact_loss_fraction"):
    print(float(run[name].sel(joint="big_end")))
values = {"drive": {"flywheel_kg_m2": 0.5}, "solve": solve}
more = compressor.simulate(compressor.Case.from_values(values))
print(float(more.mean_crank_speed), float(more.crank_speed.mean()))
print(run.contact_seconds_per_rev.attrs["units"], "mean_crank_speed" in run)
print("tests")
which = "contact_laws or herbert_mcwhannell-0.5"
options = ("-vv", "-p", "no:cacheprovider", "-p", "no:xdist", "-k", which)
tests = ("tests/physics/test_contact_laws.py", "tests/physics/test_restitution.py")
assert pytest.main([*options, *tests]) == 0
"""


@pytest.fixture(scope="module")
def printed(copy, paper_store):
    """What is printed there: by a report, two verbs and the help; metrics; tests of laws."""
    part_of(paper_store, copy / "results", "design", "big-end")  # which the figure needs
    (copy / "some").mkdir()
    (copy / "some/file").write_text("four", encoding="utf-8")
    environment = os.environ | {"COMPSIM_JIT": "0", "PYTHONPATH": f"{copy}:{copy / 'cmd'}"}
    words = [sys.executable, "-c", WORK]  # it compiles nothing
    ran = subprocess.run(words, cwd=copy, capture_output=True, text=True, env=environment)
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
    return re.split("^(?:metrics|tests)\n", ran.stdout, flags=re.MULTILINE)


def test_new_metrics_are_measured(printed):
    *numbers, unit, of_others = printed[1].split()
    assert (unit, of_others) == ("s", "False")
    seconds, bar, lost, speed, mean = map(float, numbers)
    assert seconds == pytest.approx((1 - lost) * 60 / 500)
    assert 0 < bar < 0.1 * seconds
    assert speed == pytest.approx(mean, rel=1e-3)


def test_a_new_figure_is_in_the_report_and_new_verbs_run(copy, printed):
    page = (copy / "out/index.html").read_text(encoding="utf-8")
    assert "Velocity against displacement" in page
    assert re.search(r"Greatest velocity: 6\.\d+ m/s", page)
    assert len((copy / "out/figure-17.csv").read_text(encoding="utf-8").splitlines()) > 1000
    assert (copy / "out/figure-17.png").stat().st_size > 10_000
    assert printed[0].startswith("out/index.html\n4\nperiodic 3\n")
    assert "Print how many jobs of a study" in printed[0]


PASS = (
    "test_every_choice_of_a_case_file_is_compiled[contact.law-Law]",
    "test_the_energy_is_the_work_of_the_elastic_force[1.5-herbert_mcwhannell]",
    "test_the_energy_is_the_work_of_the_elastic_force[1.5-linear]",
    "test_the_force_is_elastic_and_damped_and_never_pulls[linear]",
    "test_a_drop_through_the_whole_solver_gives_it_back[herbert_mcwhannell-0.5-0.5936]",
)


def test_new_contact_laws_pass_the_tests_of_all_laws(printed):
    for name in PASS:
        assert re.search(rf"::{re.escape(name)} PASSED", printed[2]), name
