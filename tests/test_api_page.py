"""The public docstrings: what they say at least, that their examples run, and the page of them."""

import doctest
import inspect
import re
import warnings

import api_page
import pytest
from compsim import cli

import compressor

PUBLIC = dict(api_page.public())
TEXTS = {name: inspect.cleandoc(made.__doc__ or "") for name, made in PUBLIC.items()}
EXAMPLES = {name: text for name, text in TEXTS.items() if ">>>" in text}
FUNCTIONS = [name for name, made in PUBLIC.items() if inspect.isfunction(made)]
RAISING = ("load_cases", "open_study", "read_job", "Case.from_values", "Case.from_attribute")


def test_the_page_is_what_the_docstrings_say():
    assert api_page.PAGE.read_text(encoding="utf-8") == api_page.page(), "stale: run make pages"


def test_every_public_name_is_on_the_page():
    named = [name for names in api_page.SECTIONS.values() for name in names]
    assert sorted([*named, "__version__"]) == compressor.__all__


@pytest.mark.parametrize("name", TEXTS)
def test_a_docstring_begins_with_one_line(name):
    first, _, rest = TEXTS[name].partition("\n")
    assert first.endswith(".")
    assert len(first) <= 100
    assert rest == "" or rest.startswith("\n")


@pytest.mark.parametrize("name", [n for n in TEXTS if "." not in n.removeprefix("compressor.")])
def test_what_is_public_has_an_example(name):
    assert name in EXAMPLES


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_tells_its_parameters_and_what_it_raises(name):
    words = set(re.findall(r"\w+", TEXTS[name].partition(">>>")[0]))
    given = inspect.signature(PUBLIC[name]).parameters
    assert {*given} - {"self", "paths"} <= words
    if name.removeprefix("compressor.") in RAISING:
        assert re.search(r"Raises \w+Error", TEXTS[name])


@pytest.mark.parametrize("name", api_page.SECTIONS["Groups of a case"])
def test_a_group_tells_each_field_with_unit_range_default_and_source(name):
    for field in inspect.signature(getattr(compressor, name)).parameters:
        (line,) = re.findall(rf"^- `{field}`: .*$", TEXTS[f"compressor.{name}"], re.M)
        assert re.search(
            r"\. Needs .+; default .+ \(.+\)\.( Judged on .+\.)?( Read with .+\.)?"
            r"( Plausible: .+ \(.+\)\.)?$",
            line,
        ), line


def test_a_field_is_told_as_it_is_checked():
    line = (
        "- `speed_rpm`: crank speed. Needs a number in (0, 100000] rpm; default 500 (Table 1). "
        "Judged on 50 to 6000."
    )
    assert line in TEXTS["compressor.Machine"].splitlines()


# Examples


def run(name):
    """Run the examples of one docstring; fails with what doctest has to say."""
    test = doctest.DocTestParser().get_doctest(TEXTS[name], {}, name, None, 0)
    told = []
    with warnings.catch_warnings():
        found = doctest.DocTestRunner().run(test, out=told.append)
    assert found.failed == 0, "".join(told)
    return found.attempted


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which the commands were run that docstrings name, on the file of `load_cases`."""
    place = tmp_path_factory.mktemp("examples")
    commands = {c for text in TEXTS.values() for c in re.findall(r"After `compsim ([^`]+)`", text)}
    assert commands == {"run wear.yaml"}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        run("compressor.load_cases")
        for command in commands:
            assert cli.main([*command.split(), "-j", "1", "--quiet"]) == 0
    return place


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_run(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert run(name) > 0


def test_an_example_that_is_wrong_fails(monkeypatch):
    monkeypatch.setitem(TEXTS, "planted", "One line.\n\n>>> 1 + 1\n3\n")
    with pytest.raises(AssertionError, match=r"Expected:\s+3\s+Got:\s+2"):
        run("planted")
