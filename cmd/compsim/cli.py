"""compsim on the command line: data on stdout, progress and messages on stderr.

Nothing heavy is imported at the top: `compsim --help` answers at once.
"""

import contextlib
import itertools
import os
import platform
import shlex
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

import click

from compressor.program import PROGRAM, CompsimError, CompsimWarning, library_versions
from compsim import screen

# of paths, that a program makes; any other error of a path is the file system's
MISTAKES = (FileNotFoundError, FileExistsError, NotADirectoryError, IsADirectoryError)
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")  # that ask a program to end; Windows has no SIGHUP
NO_ROOM = ("failed to map segment", "Cannot allocate memory")  # as a library that is loaded says
NO_THREAD = "can't start new thread"  # as Python says
LIBRARIES = ("numpy", "scipy", "numba", "h5py", "xarray")
UNREAD = 141  # exit code, as of a program that SIGPIPE ends, which Windows does not have
COMPLETING = "_COMPSIM_COMPLETE"  # set by a shell that completes a word: click prints and exits
VERBS = {  # by their headings in `compsim --help`; each is in the module of its name
    "Work": ("init", "plan", "run", "report"),
    "Read what is stored": ("status", "show", "plot", "export", "verify"),
    "Study a machine": ("explain", "find", "follow", "wear", "alarms"),
    "Study the model": ("tradeoff", "claims", "judge"),
    "Work with measured records": ("dataset", "identify", "compare", "calibrate"),
    "Editor": ("schema",),
}


class Interrupted(BaseException):
    """The arrival of a signal, whose number it holds."""


def version(context: click.Context, _: click.Parameter, is_set: bool) -> None:
    """Print the versions of the program, of its model and of its libraries, and end."""
    if is_set and not context.resilient_parsing:
        from compressor.cases import MODEL_VERSION

        others = {"Python": platform.python_version()} | library_versions(*LIBRARIES)
        listed = ", ".join(f"{name} {number}" for name, number in others.items())
        click.echo(f"{PROGRAM}, model {MODEL_VERSION} ({listed})")
        context.exit()


class Commands(click.Group):
    """The commands, listed by headings, each with the whole first sentence of its help."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by headings."""
        longest = max(map(len, self.commands))
        for heading, names in VERBS.items():
            with formatter.section(heading):
                texts = (self.commands[name].get_short_help_str(1000) for name in names)
                padded = (f"{name:<{longest}}" for name in names)
                formatter.write_dl([*zip(padded, texts, strict=True)])


@click.group(
    cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "show_default": True}
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=version,
    help="Print the versions of program, model and libraries.",
)
def cli() -> None:
    """Sweep a reciprocating compressor over joint clearances, and draw what comes out.

    To begin: compsim init.

    Exit codes: 0 done, 1 internal error, 2 usage or case file, 3 some jobs failed, 5 store,
    130/143/129 interrupted, 141 where nobody reads the output.
    """


for verb in itertools.chain(*VERBS.values()):
    cli.add_command(getattr(import_module(f"compsim.{verb}"), verb))


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Turn the signals that ask a program to end into Interrupted; a second one ends it at once."""

    def interrupt(number: int, frame: Any) -> None:
        for other in old:
            signal.signal(other, signal.SIG_DFL)
        raise Interrupted(number)

    numbers = [signal.Signals[name] for name in SIGNALS if hasattr(signal, name)]
    old = {number: signal.getsignal(number) for number in numbers}
    old = {number: handler for number, handler in old.items() if handler != signal.SIG_IGN}
    for number in old:  # but not what nohup ignores
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def report_warnings() -> Iterator[None]:
    """Report the store's warnings, each once, as a user reads them; others stay as they are."""
    show, reported = warnings.showwarning, set()

    def report_once(message: Any, category: type[Warning], *where: Any, **more: Any) -> None:
        if not issubclass(category, CompsimWarning):
            show(message, category, *where, **more)
        elif str(message) not in reported:
            reported.add(str(message))
            screen.say_wrapped(f"compsim: {message}")

    with warnings.catch_warnings():
        warnings.showwarning = report_once
        yield


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = shlex.join(["compsim", *arguments])
    screen.one_thread_each()  # before numpy loads
    try:
        with interruptible(), report_warnings():
            return cli.main(arguments, "compsim", standalone_mode=False, obj=command) or screen.DONE
    except Interrupted as arrival:
        (number,) = arrival.args
        screen.say(f"interrupted by {signal.Signals(number).name}")
        return 128 + number
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (SystemExit, BrokenPipeError):
        if COMPLETING in os.environ:
            raise
        screen.discard_output()  # otherwise click exits only where nobody reads on
        return UNREAD
    except Exception as error:
        return report_error(error)


def report_error(error: Exception) -> int:
    """Report what went wrong and return the exit code; a traceback only of internal errors."""
    if isinstance(error.__cause__ or error, FileNotFoundError) and not is_somewhere():
        screen.say("compsim: the current folder was removed; cd to one that is there")
        return screen.USAGE
    if isinstance(error, CompsimError):
        screen.say(f"{error.prefix}{error}")
        return error.exit_code
    if isinstance(error, MemoryError) or any(words in str(error) for words in NO_ROOM):
        screen.say("compsim: not enough memory: allow more (ulimit -v), or use fewer workers (-j)")
        return screen.INTERNAL
    if NO_THREAD in f"{error} {error.__context__}":  # on which joblib may stumble
        screen.say("compsim: too few processes: allow more (ulimit -u), or use fewer workers (-j)")
        return screen.INTERNAL
    if isinstance(error, OSError) and error.filename and not isinstance(error, MISTAKES):
        from compressor.store import system_error

        return report_error(system_error(error.filename, error))
    # raised by click's echo: stdout does not take it, such as a full disk
    if isinstance(error, OSError) and traceback.extract_tb(error.__traceback__)[-1].name == "echo":
        screen.say(f"compsim: stdout: {error.strerror}; the same command prints it again")
        screen.discard_output()
        return screen.STORE
    screen.say("".join(traceback.format_exception(error)).rstrip())
    screen.say("compsim: internal error: please report it, with the lines above")
    return screen.INTERNAL


def is_somewhere() -> bool:
    """Return whether the current folder is there still."""
    try:
        os.getcwd()
    except FileNotFoundError:
        return False
    return True
