"""The public names: imports that type checkers see, docstrings whose examples run, their page."""

import ast
import doctest
import inspect
import re
import warnings
from importlib import import_module
from pathlib import Path

import api_page
import pytest
from compsim import cli

import compressor

PUBLIC = dict(api_page.public())
TEXTS = {name: inspect.cleandoc(made.__doc__ or "") for name, made in PUBLIC.items()}
EXAMPLES = {name: text for name, text in TEXTS.items() if ">>>" in text}


def test_the_page_is_what_the_docstrings_say():
    assert api_page.PAGE.read_text(encoding="utf-8") == api_page.page(), "stale: run make pages"


def test_type_checkers_see_every_name_where_it_is_found():
    tree = ast.parse(Path(compressor.__file__).read_text(encoding="utf-8"))
    ifs = [one for one in tree.body if isinstance(one, ast.If)]
    (block,) = (one for one in ifs if ast.unparse(one.test) == "TYPE_CHECKING")
    seen = {alias.name: line.module for line in block.body for alias in line.names}
    here = {"__version__", "CompsimError", "CompsimWarning"}
    assert {*seen} | here == {*compressor.__all__}
    for name, module in seen.items():
        assert getattr(compressor, name) is getattr(import_module(module), name)


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
