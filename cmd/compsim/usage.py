"""Mistakes on the command line: each is answered by one line that says what to do."""

import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import click

from compressor.program import did_you_mean

CASE_FILES = (".yaml", ".yml")
WHOLE = 1000  # characters, from which click would cut a summary
HELP_OPTIONS = {"help": "compsim --help, or compsim COMMAND --help", "version": "compsim --version"}
# what stands for the folder of results in some commands, and is missing from others
FOLDERS = {"-o": "output", "--output": "output", "-i": "folder", "--input": "folder"}


class Commands(click.Group):
    """The commands, listed by headings; the error of an unknown one says what was meant."""

    def __init__(self, *values: Any, **more: Any):
        super().__init__(*values, **more)
        self.headings: dict[str, list[str]] = {}

    def add_under(self, heading: str, commands: Iterable[click.Command]) -> None:
        """Add commands, which `--help` lists under a heading."""
        for command in commands:
            self.add_command(command)
            self.headings.setdefault(heading, []).append(str(command.name))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by headings, each with the whole first sentence of its help."""
        longest = max(map(len, self.commands))
        for heading, names in self.headings.items():
            with formatter.section(heading):
                formatter.write_dl([
                    (f"{name:<{longest}}", self.commands[name].get_short_help_str(WHOLE))
                    for name in names
                ])  # fmt: skip

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command and its arguments. Raises UsageError for an unknown name."""
        word = args[0]
        if (command := self.get_command(ctx, word)) and not ctx.resilient_parsing:
            refuse_empty_words(args[1:], click.Context(command, ctx, info_name=word))
        unknown = command is None and not word.startswith("-")
        if unknown and not ctx.resilient_parsing:
            raise click.UsageError(self.describe_unknown(word, args[1:]), ctx)
        return super().resolve_command(ctx, args)

    def describe_unknown(self, word: str, more: Sequence[str]) -> str:
        """Return what is said of a word in the place of a command."""
        if word == "help" and more and more[0] in self.commands:
            return f"No such command 'help': compsim {more[0]} --help"
        if word in HELP_OPTIONS:
            return f"No such command {word!r}: {HELP_OPTIONS[word]}"
        if word.endswith(CASE_FILES):
            line = shlex.join(["compsim", "run", word, *more])
            return f"{word!r} is a case file, and a command comes first: {line}"
        if Path(word).is_dir():
            place = shlex.quote(word)
            line = f"compsim status {place}, or compsim report {place}"
            return f"{word!r} is a folder, and a command comes first: {line}"
        near = did_you_mean(word, self.commands) or f"there are {', '.join(self.commands)}"
        return f"No such command {word!r}; {near}"


MAY_BE_EMPTY = ("--only",)  # which selects all jobs then


def refuse_empty_words(words: Sequence[str], ctx: click.Context) -> None:
    """Raise UsageError for an empty word among those after a command: `-o ""` is no folder.

    A shell passes one on where a variable in quotes is not set.
    """
    for before, word in zip(("", *words), words, strict=False):
        if word and not (word.startswith("--") and word.find("=") == len(word) - 1):
            continue
        option = word[:-1] or (before if before.startswith("-") and before != "--" else "")
        if option not in MAY_BE_EMPTY:
            what = f"{option} is given an empty word" if option else "an argument is empty"
            raise click.UsageError(f"{what}: is a shell variable not set?", ctx)


def one_line(error: click.ClickException, arguments: Sequence[str]) -> str:
    """Return a mistake in the use of a command in a line; arguments: those after `compsim`."""
    context = getattr(error, "ctx", None)
    path = context.command_path if context else " ".join(["compsim", *arguments[:1]])
    text = " ".join(error.format_message().split())
    if isinstance(error, click.NoSuchOption) and context:
        text = f"No such option {error.option_name!r}{other_option(error.option_name, context)}"
    if text.endswith("?") or "compsim " in text:  # what to do is said
        return f"{path}: {text}"
    return f"{path}: {text.rstrip('.')}; see {path} --help"


def other_option(option: str, context: click.Context) -> str:
    """Return what to write instead of an option that a command does not have; "" where unknown."""
    names = {parameter.name for parameter in context.command.params}
    if FOLDERS.get(option) == "output" and "folder" in names:
        return f": the folder of results is an argument, {context.command_path} FOLDER"
    if FOLDERS.get(option) == "folder" and "output" in names:
        return ": the folder of results is -o FOLDER here"
    near = did_you_mean(option, [name for one in context.command.params for name in one.opts])
    return near and f"; {near}"
