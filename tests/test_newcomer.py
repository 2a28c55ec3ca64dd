"""The recipes of compressor/README.md, followed literally in a copy of the program."""

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
LAWS, WORDS = "compressor/physics/contact_laws.py", "compressor/cases/laws.py"
PUBLISHED = "tests/published.py"
BIG_END = {"joint": "big_end", "clearance_mm": 0.2}
BEGIN, END = "## How to add a contact law", "## How to add a feature"
TESTS = ("tests/physics/test_contact_laws.py", "tests/physics/test_restitution.py")
WHICH = "contact_laws or herbert_mcwhannell-0.5"
PASS = (
    "test_every_choice_of_a_case_file_is_compiled[contact.law-Law]",
    "test_the_energy_is_the_work_of_the_elastic_force[1.5-herbert_mcwhannell]",
    "test_the_energy_is_the_work_of_the_elastic_force[1.5-linear]",
    "test_the_force_is_elastic_and_damped_and_never_pulls[linear]",
    "test_a_drop_through_the_whole_solver_gives_it_back[herbert_mcwhannell-0.5-0.5936]",
)


def blocks(begin=BEGIN, end=END):
    """The page's blocks of code from one heading to another, in their order."""
    page = (ROOT / "compressor/README.md").read_text(encoding="utf-8")
    section = page.partition(begin)[2].partition(end)[0]
    found = re.findall(r"^( *)```py\n(.*?)^ *```", section, re.DOTALL | re.MULTILINE)
    return [re.sub(f"^{indent}", "", text, flags=re.MULTILINE) for indent, text in found]


def indented(text):
    return textwrap.indent(text.rstrip("\n") + "\n", "    ")


def changed(copy, name, *edits):
    """Put texts into a file of the copy: (text, the one place where it goes, behind it or not)."""
    path = copy / name
    text = path.read_text(encoding="utf-8")
    for new, place, behind in edits:
        assert text.count(place) == 1, f"{name}: {place!r}"
        text = text.replace(place, place + new if behind else new + place)
    path.write_text(text, encoding="utf-8")


def first_in(function, branch):
    """An edit that puts a branch first in a function, behind its docstring."""
    source = (ROOT / LAWS).read_text(encoding="utf-8")
    head = re.search(rf'def {function}\(.*?""".*?"""\n', source, re.DOTALL)
    return indented(branch), head.group(), True


def branches(block):
    """The branch for each function that a block names in a comment."""
    found = re.split(r"^# (\w+)[^\n]*\n", block, flags=re.MULTILINE)[1:]
    return dict(zip(found[::2], found[1::2], strict=True))


def copy_of_the_program(place, *more):
    """Byte code too, whose temporary files may vanish meanwhile: to compile it takes seconds."""
    for folder in ("compressor", "cmd", *more):
        shutil.copytree(ROOT / folder, place / folder,
                        ignore=shutil.ignore_patterns("results", "*.pyc.*"))  # fmt: skip
    shutil.copyfile(ROOT / "pyproject.toml", place / "pyproject.toml")


def run_in(copy, *words, cwd):
    """What a command prints in a copy, which compiles nothing."""
    environment = os.environ | {"COMPSIM_JIT": "0", "PYTHONPATH": f"{copy}:{copy / 'cmd'}"}
    ran = subprocess.run(
        [sys.executable, *words], cwd=cwd, capture_output=True, text=True, env=environment
    )
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
    return ran.stdout


def test_the_page_on_metrics_is_right(tmp_path):
    copy_of_the_program(tmp_path)
    found = blocks("## How to add a metric", "## How to add a figure")
    changed(
        tmp_path, "compressor/metrics.py",
        (indented("".join(found)), '    Metric(\n        "impact_count"', False),
    )  # fmt: skip
    code = (
        "import compressor\n"
        "solve = {'duration_rev': 0.05, 'settle_rev': 0, 'accuracy': 'draft'}\n"
        "values = {'joint': 'big_end', 'clearance_mm': 0.2, 'solve': solve}\n"
        "run = compressor.simulate(compressor.Case.from_values(values))\n"
        "print(run.contact_seconds_per_rev.attrs['units'])\n"
        "for name in ('contact_seconds_per_rev', 'contact_seconds_per_rev_error',\n"
        "             'contact_loss_fraction'):\n"
        "    print(float(run[name].sel(joint='big_end')))\n"
        "values = {'drive': {'flywheel_kg_m2': 0.5}}\n"
        "more = compressor.simulate(compressor.Case.from_values(values | {'solve': solve}))\n"
        "print(float(more.mean_crank_speed), float(more.mean_crank_speed_error))\n"
        "print('mean_crank_speed' in run, float(more.crank_speed.mean()))\n"
    )
    unit, *told = run_in(tmp_path, "-c", code, cwd=tmp_path).split()
    speed, its_bar, of_others, mean = told[3:]
    assert of_others == "False"
    assert float(speed) == pytest.approx(float(mean), rel=1e-3)
    assert 0 < float(its_bar) < 0.1 * float(speed)
    found, bar, lost = map(float, told[:3])
    assert unit == "s"
    assert found == pytest.approx((1 - lost) * 60 / 500)
    assert 0 < bar < 0.1 * found


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


def add_verb(place, name, module, line):
    """Add a verb to a copy of the program, by its module and its line in the table of verbs."""
    (place / f"cmd/compsim/{name}.py").write_text(module, encoding="utf-8")
    place_of_it = '"Read what is stored": ('
    changed(place, "cmd/compsim/cli.py", (line.strip() + " ", place_of_it, True))


def test_the_pages_on_figures_verbs_and_studies_are_right(tmp_path, paper_store):
    """In one copy: each costs seconds."""
    copy_of_the_program(tmp_path)
    (function,) = blocks("## How to add a figure", "## How to add a verb")
    with open(tmp_path / "compressor/report/figures/paper.py", "a", encoding="utf-8") as paper:
        paper.write(f"\n\n{function}")
    add_verb(tmp_path, "size", *blocks("## How to add a verb", "## How to add a study"))
    module, verb = blocks("## How to add a study", "## How to add a public name")
    (tmp_path / "compressor/studies/count.py").write_text(module, encoding="utf-8")
    add_verb(tmp_path, "count", verb, '"count",\n')
    part_of(paper_store, tmp_path / "results", "design", "big-end")  # which the figure needs
    run_in(tmp_path, "-c", REPORT, cwd=tmp_path)
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert "Velocity against displacement" in page
    assert re.search(r"Greatest velocity: 6\.\d+ m/s", page)
    rows = (tmp_path / "out/figure-17.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) > 1000
    assert (tmp_path / "out/figure-17.png").stat().st_size > 10_000
    (tmp_path / "some").mkdir()
    (tmp_path / "some/file").write_text("four", encoding="utf-8")
    assert run_in(tmp_path, "-m", "compsim", "size", "-r", "some", cwd=tmp_path) == "4\n"
    assert run_in(tmp_path, "-m", "compsim", "count", "big-end", cwd=tmp_path) == "periodic 3\n"
    help_text = run_in(tmp_path, "-m", "compsim", "--help", cwd=tmp_path)
    assert "Print how many bytes" in help_text
    assert "Print how many jobs of a study" in help_text


def test_the_page_on_contact_laws_is_right(tmp_path):
    copy_of_the_program(tmp_path, "tests")
    member, damping, words, given, force, choice = blocks()
    chosen = branches(choice)
    name, number = member.split("=")[0], max(Law) + 1
    changed(
        tmp_path, LAWS,
        (indented(f"{name}= {number}\nLINEAR = {number + 1}"), "    IMPACT = 0", False),
        (indented(damping), "    Law.LIU: lambda e: 0.75 * (1.0 - e**2),\n", True),
        ("LINEAR = int(Law.LINEAR)\n\n\n" + force,
         "\n\n@inline_llvm\ndef may_choose_laws(p)", False),
        *(first_in(name, chosen[name]) for name in
          ("normal_force", "elastic_force", "elastic_form")),
    )  # fmt: skip
    laws = (tmp_path / WORDS).read_text(encoding="utf-8")
    laws = laws.replace("RESTITUTING = (", f"RESTITUTING = ({words.strip()} ")
    laws = laws.replace('("impact", "hertz", *', '("impact", "hertz", "linear", *')
    laws = laws.replace('"damping_N_s_per_mm": ("impact",)',
                        '"damping_N_s_per_mm": ("impact", "linear")')  # fmt: skip
    (tmp_path / WORDS).write_text(laws, encoding="utf-8")
    changed(tmp_path, PUBLISHED, (indented(given), "GIVEN = {\n", True))
    words = [sys.executable, "-m", "pytest", "-vv", "-p", "no:cacheprovider", "-p", "no:xdist"]
    ran = subprocess.run(
        [*words, *TESTS, "-k", WHICH], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"COMPSIM_JIT": "0", "PYTHONPATH": f"{tmp_path}:{tmp_path / 'cmd'}"},
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
    for name in PASS:
        assert re.search(rf"::{re.escape(name)} PASSED", ran.stdout), name
