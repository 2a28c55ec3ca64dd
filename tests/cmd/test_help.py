"""Help: whole summaries under headings, an example a verb, options in sentences."""

import re
import shlex

import click
import pytest
from compsim.cli import VERBS as HEADINGS
from compsim.cli import cli

WIDTH = 78  # columns that click fills on a terminal of 80
VERBS = sorted(cli.commands)
FRAGMENTS = {"A", "An", "The", "Of", "No", "Its", "Where", "How", "Which", "Folder"}


def help_of(name=""):
    """The lines of `compsim [NAME] --help` on a terminal of 80 columns."""
    command = cli.commands[name] if name else cli
    parent = click.Context(cli, info_name="compsim")
    context = click.Context(command, parent if name else None, name or "compsim",
                            terminal_width=WIDTH)  # fmt: skip
    return command.get_help(context).splitlines()


def examples(name):
    """The commands in a verb's help, each with its lines joined; some follow a shell's name."""
    text = "\n".join(help_of(name)).partition("Options:")[0].replace("\\\n", " ")
    return re.findall(rf"^ +(?:\w+  )?(compsim {name}\b.*)$", text, re.MULTILINE)


def test_every_summary_is_whole_in_one_line():
    lines = help_of()
    for name, command in cli.commands.items():
        summary = command.help.partition("\n")[0]
        row = rf"  {name} +{re.escape(summary)}"
        assert [line for line in lines if re.fullmatch(row, line)], f"{name}: {summary}"
    assert max(map(len, lines)) <= WIDTH
    assert "..." not in "\n".join(lines[1:])


def test_every_verb_is_under_one_heading():
    listed = [name for names in HEADINGS.values() for name in names]
    assert sorted(listed) == VERBS
    headings = [line.rstrip(":") for line in help_of() if re.fullmatch(r"\w.*:", line)]
    assert headings == ["Options", *HEADINGS]


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_has_examples_that_it_understands(name):
    found = examples(name)
    assert found
    for line in found:
        words = shlex.split(line)
        words = words[2 : words.index(">") if ">" in words else None]
        cli.commands[name].make_context(name, words, click.Context(cli, info_name="compsim"))


@pytest.mark.parametrize("name", VERBS)
def test_every_option_says_in_a_sentence_what_it_does(name):
    for parameter in cli.commands[name].params:
        if isinstance(parameter, click.Option):
            text = parameter.help or ""
            assert re.fullmatch(r"[A-Z].*\.", text), f"{parameter.opts}: {text!r}"
            assert text.split()[0] not in FRAGMENTS, f"{parameter.opts}: {text!r}"
            assert len(text.split()) > 2, f"{parameter.opts}: {text!r}"
