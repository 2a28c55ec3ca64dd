"""What the README pages say is executed or compared.

Commands in `console` blocks run in one folder, page by page in the order of PAGES, or are read
alone where their own tests run them; `yaml` blocks are files named in their first line; `python`
blocks run there; `bash` and `py` blocks are not run.
"""

import json
import pydoc
import re
import shlex

import page_commands
import page_tables
import pytest
from compsim.cli import VERBS, cli

from compressor.cases.checks import DOUBLES, stands_for
from compressor.cases.json_schema import case_schema
from compressor.cases.load import MAX_JOBS, CaseFileError, load_cases, load_studies
from compressor.cases.table import table
from compressor.solve.simulate import simulate
from compressor.store.reader import read_store

ROOT = page_tables.ROOT
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
PAGES = {
    page: (ROOT / page).read_text(encoding="utf-8")
    for page in (
        "README.md", "configs/README.md",
        *(f"compressor/docs/{name}.md" for name in (
            "the-paper", "my-machine", "a-run", "how-sure", "speed-or-accuracy", "extremes",
            "regimes", "diagnosis", "wear", "sweeps", "commands", "glossary", "notebook",
        )),
        "compressor/solve/README.md", "compressor/store/README.md", "compressor/sweep/README.md",
        "compressor/physics/README.md", "compressor/README.md", "tests/README.md",
        "compressor/cases/examples/README.md",
        *(f"tests/results/{path.name}" for path in sorted(page_tables.RESULTS.glob("*.md"))),
    )
}  # fmt: skip
COMMANDS = "compressor/docs/commands.md"
TEXT = "\n".join(PAGES.values())
QUICK = ["--set", "solve.duration_rev=1", "--set", "solve.settle_rev=0"]
# commands that tests of their own run: their words are read here
READ = {"plan", "plot", *VERBS["Study a machine"], *VERBS["Work with measured records"]}
# a folder that only such commands read; what `make stress` and test_tutorial run
UNRUN = {"hall", "extremes", "extremes.yaml", "compsim report"}


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize(
    ("page", "name"), [(page, name) for page, found in page_tables.PAGES.items() for name in found]
)
def test_generated_tables_are_current(page, name):
    written = page_tables.block(name).search(PAGES[page])
    assert written, f"{page} has no block for {name}"
    assert written[2] == page_tables.PAGES[page][name](), "stale: run make pages"


SOURCES = [*ROOT.glob("compressor/**/*.py"), *ROOT.glob("cmd/**/*.py")]
PLACES = ("", "compressor", "cmd", "tests")  # that paths on pages begin at
EXAMPLES = (
    "cmd/compsim/size.py", "cmd/compsim/count.py", "studies/count", "tests/studies/test_count.py",
    "results/",
)  # fmt: skip


def test_modules_and_files_that_texts_name_are_there():
    lost = []
    for path in [*SOURCES, *(ROOT / page for page in PAGES if "results" not in page)]:
        text = path.read_text(encoding="utf-8")
        for name in re.findall(r"`(compressor(?:\.\w+)+)`", text):
            if pydoc.locate(name) is None:
                lost.append((path.name, name))
        for name in re.findall(r"`((?:[a-z_]+/)+[a-z_0-9]+(?:\.py)?)`", text):
            places = [ROOT / place / name for place in PLACES] + [path.parent / name]
            if not any(one.exists() or one.with_suffix(".py").exists() for one in places):
                lost.append((path.name, name))
    assert [one for one in lost if not one[1].startswith(EXAMPLES)] == []


@pytest.mark.parametrize("verb", sorted(set(re.findall(r"(?:`|^)make ([a-z-]+)", TEXT, re.M))))
def test_make_verbs_exist(verb):
    assert re.search(rf"^{verb}:", MAKEFILE, re.MULTILINE), f"make {verb}"


def test_every_verb_of_the_command_line_is_on_the_page_of_commands():
    named = set(re.findall(r"`compsim ([a-z]+)`", PAGES[COMMANDS]))
    assert named == set(cli.commands)


def test_keys_to_begin_with_are_keys():
    _, _, rest = PAGES["configs/README.md"].partition("## The keys that you will set")
    rows = re.findall(r"^\| (`.*?) \|", rest.partition("\n## ")[0], re.MULTILINE)
    assert len(rows) == 10
    named = {key for row in rows for key in re.findall(r"`([\w.]+)`", row)}
    given = {DOUBLES.get(key, key) for key in named}
    assert [key for key in given if not (stands_for(key) or key in table())] == []


def write_case_files(place):
    """Every YAML block under the name in its first line; how many jobs each says that it has."""
    jobs = {}
    for text in blocks("yaml"):
        name, count = re.match(r"# (\S+\.yaml)(?:: (\d+) jobs)?\n", text).groups()
        (place / name).write_text(text, encoding="utf-8")
        jobs[name] = count
    return jobs


def test_case_files_have_the_jobs_that_they_say(tmp_path):
    jobs = write_case_files(tmp_path)
    assert len(jobs) == 15
    for name, count in jobs.items():
        (study,) = load_studies(tmp_path / name)
        assert len(study.cases) == int(count or 6), name


PLANS = re.findall(r"^compsim (plan .*?)  +# (\d+) jobs", TEXT, re.MULTILINE)


@pytest.mark.parametrize(("command", "jobs"), PLANS)
def test_plans_have_the_jobs_that_they_say(command, jobs, tmp_path, monkeypatch):
    write_case_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    _, path, *words = shlex.split(command)
    given = dict(zip(words[::2], words[1::2], strict=True))
    how = {"overrides": [given["--set"]] if "--set" in given else []}
    if "--max-jobs" in given:  # these many are counted, not made
        assert MAX_JOBS < int(jobs) <= int(given["--max-jobs"])
        with pytest.raises(CaseFileError, match=f" {jobs} jobs are more than {MAX_JOBS}"):
            load_studies(path, **how)
        return
    (study,) = load_studies(path, only=given.get("--only", ""), **how)
    assert len(study.selected) == int(jobs)


def blocks_and_outputs(language):
    """Each block of a language, and the lines that the `text` block behind it says it prints."""
    found = re.findall(rf"```{language}\n(.*?)```\n(?:\n```text\n(.*?)```)?", TEXT, re.DOTALL)
    return [(block, tuple(printed.splitlines())) for block, printed in found]


def run_command(place, command, whole):
    """Run a command of a page there, in short unless `whole`, and return what it prints."""
    _, verb, *words = shlex.split(command, comments=True)
    if verb in READ or UNRUN.intersection([command, *words]):
        assert cli.commands[verb].make_context(verb, words)
        return ""
    return page_commands.run_command(
        place, command, *(QUICK if verb == "run" and not whole else ())
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder as a reader of the pages would have it: their case files, and our configs.

    Pictures of reports are drawn where figures are tested, here only those of `compsim plot`.
    """
    place = tmp_path_factory.mktemp("pages")
    write_case_files(place)
    (place / "configs").symlink_to(page_tables.ROOT / "configs")
    for commands, expected in blocks_and_outputs("console"):
        printed = [run_command(place, line, bool(expected)) for line in commands.splitlines()]
        assert not expected or page_commands.missing(expected, "".join(printed)) == "", commands
    return place


@pytest.mark.slow
def test_console_commands_work(folder):
    assert (read_store(folder / "results").columns["samples"] > 0).sum() == 11
    assert (folder / "wear-report" / "index.html").exists()
    assert len((folder / "big-end.csv").read_text(encoding="utf-8").splitlines()) == 4
    schema = (folder / "compsim.schema.json").read_text(encoding="utf-8")
    assert json.loads(schema) == case_schema()


@pytest.mark.slow
def test_python_example_works(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPLBACKEND", "agg")
    names, printed = {}, ""
    for text, expected in blocks_and_outputs("python"):
        exec(text, names)
        out = capsys.readouterr().out
        assert not expected or page_commands.missing(expected, out) == "", text
        printed += out
    assert names["a"].attrs["units"] == "m/s2"
    assert names["run"].attrs["complete"] == 1
    assert "clearance_mm" in printed


def test_the_peaks_of_the_page_are_those_of_the_program():
    page = PAGES["compressor/docs/a-run.md"]
    told = re.search(r"peaks at 0.1, 0.2 and 0.3 mm are (.*?)\sm/s²", page, re.DOTALL)
    cases = load_cases(ROOT / "configs" / "big-end.yaml")
    assert [case.clearance_mm.big_end for case in cases] == [0.1, 0.2, 0.3]
    peaks = [f"{simulate(case)['peak_acceleration'].item():.1f}" for case in cases]
    assert re.findall(r"[\d.]+\d", told[1]) == peaks
