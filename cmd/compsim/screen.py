"""What the commands share: exit codes, and how they print and speak on stderr."""

import contextlib
import dataclasses
import json
import math
import os
import re
import shlex
import sys
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from compressor.digits import align_columns, plural, setting
from compressor.program import THREAD_VARIABLES, duration, printable
from compsim import options

if TYPE_CHECKING:
    from compressor.analysis import MachineDescription
    from compressor.cases import Study
    from compressor.store import Again

DONE, INTERNAL, USAGE, SOME_FAILED, STORE = 0, 1, 2, 3, 5  # exit codes; 128 + n: signal n
WIDTH = 80  # columns of what is printed
MAX_CAUTIONS = 5  # reported of one case file
MAX_FAILURES = 20  # listed one by one


def one_thread_each() -> None:
    """Keep numeric libraries that load later, here or in workers, to one thread a process."""
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")


# ---- stdout -------------------------------------------------------------------------------------


def harmless(text: str) -> str:
    """Return lines of text in which no character can steer a terminal."""
    return "\n".join(map(printable, text.split("\n")))


def print_text(*lines: str) -> None:
    """Print lines on stdout as they are."""
    for text in lines:
        click.echo(harmless(text))


def print_lines(lines: Iterable[str]) -> None:
    """Print lines on stdout, wrapped to the width."""
    for line in lines:
        print_text(*wrap_value(printable(line)))


def print_json(value: Any) -> None:
    """Print a value on stdout as JSON."""
    click.echo(json.dumps(jsonable(value), indent=1))


def jsonable(value: Any) -> Any:
    """Return a value as JSON can hold it: null for nan, "inf" for an unknown error."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = dataclasses.asdict(value)
    if isinstance(value, dict):
        return {key: jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [*map(jsonable, value)]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return str(value) if isinstance(value, os.PathLike) else value


@contextlib.contextmanager
def unread() -> Iterator[None]:
    """Ignore that nobody reads stdout any more: what it would report is done all the same."""
    try:
        yield
    except BrokenPipeError:
        discard_output()


def discard_output() -> None:
    """Let what is still written to stdout go nowhere, also what is in its buffer."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)


def wrap_line(text: str, indent: int, more: int = 2) -> list[str]:
    """Return a line as lines of the width, the later ones indented by more.

    No word is broken, and none of `12 %`, `12 ± 3` and `key = 12`.
    """
    wrapper = textwrap.TextWrapper(
        WIDTH, " " * indent, " " * (indent + more), break_long_words=False, break_on_hyphens=False
    )
    lines = wrapper.wrap(re.sub(r" (?=[%±=])|(?<=[±=]) ", "\u00a0", text))
    return [line.replace("\u00a0", " ") for line in lines]


def wrap_value(line: str) -> list[str]:
    """Return a sentence, or a label and its value, as lines of the width that hang below it."""
    body = line.lstrip()
    indent = len(line) - len(body)
    text = body.partition("  ")[2].lstrip()
    if len(line) <= WIDTH or (text and " " not in text):  # a path
        return [line.rstrip()]
    return wrap_line(body, indent, len(body) - len(text) if text else 2)


def point_text(point: Mapping[str, Any]) -> str:
    """Return a job's swept values, each behind a blank: ` clearance_mm=0.2`."""
    texts = {key: setting(it) if isinstance(it, float) else it for key, it in point.items()}
    texts |= {key: str(it).lower() for key, it in point.items() if isinstance(it, bool)}
    return "".join(f" {key}={text}" for key, text in texts.items())


def size(count: float) -> str:
    """Return the bytes as people say them."""
    for unit in ("B", "kB", "MB"):
        if count < 999.5:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.4g} GB"


# ---- stderr -------------------------------------------------------------------------------------


def say(text: str) -> None:
    """Write to stderr; nobody may be there to read it."""
    with contextlib.suppress(OSError):
        if sys.stderr:  # not closed
            print(harmless(text), file=sys.stderr, flush=True)


def say_wrapped(text: str, indent: int = 0) -> None:
    """Write a remark to stderr in lines of the width; what is copied or parsed goes to `say`."""
    say("\n".join(wrap_line(text, indent)))


def say_done(new: int, before: int, seconds: float, folder: str, thing: str = "job") -> None:
    """Report how many things were run, or that all were stored before."""
    be = "was" if before == 1 else "were"
    if new:
        stored = f", {before} {be} stored before" if before else ""
        say(f"{plural(new, thing)} run in {duration(seconds)}{stored}")
    else:
        every = f"the {thing} is" if before == 1 else f"all {before} {thing}s are"
        say(f"nothing to do: {every} stored in {folder}")


def say_failures(failures: Sequence[tuple[str, str, str]]) -> None:
    """Report what failed, by its place, reason and detail, and what to do about each reason."""
    from compressor.reasons import remedy

    for place, reason, detail in failures[:MAX_FAILURES]:  # a line each, for who searches a log
        say(f"  {place}: {reason}: {printable(detail)}")
    if len(failures) > MAX_FAILURES:
        say(f"  and {len(failures) - MAX_FAILURES} more")
    say("what to do:")
    for reason, number in Counter(reason for _, reason, _ in failures).items():
        say_wrapped(f"{reason} ({number}): {remedy(reason)}", 2)


# ---- case files and their studies ---------------------------------------------------------------


def run_commands(studies: "Iterable[Again]", folder: str) -> list[str]:
    """Return the commands that run the missing jobs of studies, one for each set of overrides."""
    found: dict[tuple[str, ...], list[Again]] = {}
    for study in dict.fromkeys(studies):
        found.setdefault(study.overrides, []).append(study)
    commands = []
    for overrides, group in found.items():
        words = ["compsim", "run", *(study.case_file for study in group), "-r", folder]
        words += [word for text in overrides for word in ("--set", text)]
        jobs = max(study.jobs for study in group)
        words += ["--max-jobs", str(jobs)] if jobs > options.MAX_JOBS else []
        commands.append(shlex.join(words))
    return commands


def caution(
    studies: "Sequence[Study]", most: int | None = MAX_CAUTIONS, ignored: str = ""
) -> "dict[str, MachineDescription]":
    """Return what each study says of its machine; report what is odd about case files.

    In at most `most` warnings a file; ignored: a group whose own warning is left out.
    """
    from compressor.analysis import cautions, describe_machine

    machines = {study.name: describe_machine(study) for study in studies}
    for study in studies:
        found = [one for one in cautions(study) if one.key != ignored]
        implausible = machines[study.name].remarks({one.key for one in found})
        texts = [f"{key}: {text}" for key, text in implausible.items()]
        for one in found:
            looked = "" if one.of == len(study.selected) else " that were looked at"
            share = "" if one.of == 1 else f" ({one.jobs} of {one.of} jobs{looked})"
            texts.append(f"{one.key}: {one.message}{share}")
        for text in texts[:most]:
            say_wrapped(f"{study.path}: warning: {text}")
        if most is not None and len(texts) > most:
            more = plural(len(texts) - most, "more warning")
            command = f"compsim plan {shlex.quote(study.path)}"
            say_wrapped(f"{study.path}: and {more}, which {command} lists")
    return machines


def say_machines(machines: "Mapping[str, MachineDescription]") -> None:
    """Report what studies, by name, say of their machines: loads, power, pressures, pins."""
    for study, machine in machines.items():
        say(f"{study}: its machine, without clearance{machine.part}")
        for line in align_columns(machine.lines()):
            say("\n".join(wrap_value(f"  {line}")))
