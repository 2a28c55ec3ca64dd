"""The page on new contact laws, followed literally in a copy of the program."""

import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[1]
LAWS, WORDS = "compressor/physics/contact_laws.py", "compressor/cases/laws.py"
PUBLISHED = "tests/published.py"
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


def blocks():
    """The page's blocks of code on contact laws, in their order."""
    page = (ROOT / "compressor/README.md").read_text(encoding="utf-8")
    section = page.partition(BEGIN)[2].partition(END)[0]
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


def test_the_page_on_contact_laws_is_right(tmp_path):
    for folder in ("compressor", "cmd", "tests"):
        shutil.copytree(ROOT / folder, tmp_path / folder,
                        ignore=shutil.ignore_patterns("__pycache__", "results"))  # fmt: skip
    shutil.copyfile(ROOT / "pyproject.toml", tmp_path / "pyproject.toml")
    member, damping, words, given, force, choice = blocks()
    chosen = branches(choice)
    number = int(member.split("=")[1])
    changed(
        tmp_path, LAWS,
        (indented(member + f"\nLINEAR = {number + 1}"), "    LIU = 8\n", True),
        (indented(damping), "    Law.LIU: lambda e: 0.75 * (1.0 - e**2),\n", True),
        ("LINEAR = int(Law.LINEAR)\n\n\n" + force,
         "\n\n@inline_llvm\ndef has_chosen_laws(p)", False),
        *(first_in(name, chosen[name]) for name in
          ("normal_force", "elastic_force", "elastic_energy", "elastic_form")),
    )  # fmt: skip
    laws = (tmp_path / WORDS).read_text(encoding="utf-8")
    laws = re.sub(r"^RESTITUTING = .*?\)\n", words, laws, count=1, flags=re.DOTALL | re.MULTILINE)
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
