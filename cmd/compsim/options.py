"""The options and arguments that commands share."""

import math
import os
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from compressor.units import Units

MAX_JOBS = 10_000
EMPTY = "an empty word: is a shell variable not set?"


class GivenPath(click.Path):
    """A path; an empty word, as of a shell variable that is not set, is none."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the path. Raises BadParameter."""
        if not os.fspath(value):
            self.fail(EMPTY, param, ctx)
        return super().convert(value, param, ctx)


class GivenText(click.ParamType):
    """A text; an empty one, as of a shell variable that is not set, is none."""

    name = "text"

    def convert(self, value: Any, param: Any, ctx: Any) -> str:
        """Return the text. Raises BadParameter."""
        return str(value) if value else self.fail(EMPTY, param, ctx)


TEXT = GivenText()
COUNT, NUMBER = click.IntRange(min=1), click.IntRange(min=0)
FILE, FOLDER = GivenPath(readable=False), GivenPath(file_okay=False, readable=False)
# as help and messages call them
COUNT.name, NUMBER.name, FILE.name, FOLDER.name = "number", "number", "file", "folder"
config = click.argument("config", metavar="CONFIG", type=FILE)
configs = click.argument("configs", nargs=-1, required=True, metavar="CONFIG...", type=FILE)
job = click.argument("words", nargs=-1, required=True, metavar="JOB | STUDY [AXIS=VALUE]...")
results = click.option(
    "-r", "--results", "folder", default="results", type=FOLDER, help="Use this folder of results."
)
set_keys = click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Set a key in all case files."
)


def take_one(_: click.Context, __: click.Parameter, texts: tuple[str, ...]) -> str:
    """Return the one condition; "" of none. Raises BadParameter of several."""
    if texts[1:]:
        raise click.BadParameter("is given twice: join the conditions by `and`")
    return "".join(texts)


def read_shard(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Return (I, N) of I/N with 1 <= I <= N. Raises BadParameter for other text."""
    if text is None:
        return None
    number, of = text.partition("/")[::2]
    if not (number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        raise click.BadParameter(f"{text!r} is no I/N with 1 <= I <= N, such as 2/8")
    return int(number), int(of)


only = click.option(
    "--only",
    type=TEXT,
    multiple=True,
    callback=take_one,
    metavar="COMPARISON",
    help="Take only jobs with this, as 'clearance_mm < 0.2'.",
)
shard = click.option(
    "--shard", metavar="I/N", callback=read_shard, help="Take part I of N; others run the rest."
)
max_jobs = click.option(
    "--max-jobs", type=COUNT, default=MAX_JOBS, help="Refuse a case file with more jobs than this."
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print the same as JSON.")
quiet = click.option("--quiet", is_flag=True, help="Print no progress; errors are still reported.")


def output(text: str, **how: Any) -> Callable[..., Any]:
    """Return the option -o, of a folder to write into unless `how` says otherwise."""
    return click.option("-o", "--output", help=text, **{"type": FOLDER, **how})


def jobs(text: str = "Run in this many worker processes.") -> Callable[..., Any]:
    """Return the option -j, by default as many processes as this one may use cores."""
    return click.option("-j", "--jobs", type=COUNT, show_default="cores available", help=text)


def units(usual: str) -> Callable[..., Any]:
    """Return the option --units; usual: what there is without it."""
    choice, text = click.Choice(["si", "plant"]), "Units: SI, or mm, mm/s, g, kN, bar, rpm."
    return click.option("--units", type=choice, show_default=usual, help=text)


def check_json_units(as_json: bool, units: "Units | None") -> None:
    """Raise UsageError where other units than SI are requested in JSON."""
    if as_json and units == "plant":
        raise click.UsageError("--json has all numbers in SI: leave out --units plant")


RECORD: dict[str, tuple[Any, str, str]] = {  # option -> type, metavar, help
    "channel": (str, "NAME", "Read the acceleration from this channel, a name or a number from 1."),
    "unit": (str, "UNIT", "Take the acceleration in this unit: m/s2, mm/s2, g, in/s2 or ft/s2."),
    "full_scale": (float, "VALUE", "Scale whole numbers in WAV so that the greatest is this."),
    "rate": (float, "HZ", "Take so many samples a second where a file has no times."),
    "time": (str, "NAME", "Read the times from this channel, a name or a number from 1."),
    "time_unit": (str, "UNIT", "Take the times in this unit, whatever the file says: s, ms or us."),
    "tacho": (str, "NAME", "Read the tacho from this channel, a name or a number from 1."),
    "tacho_deg": (float, "DEG", "Set the crank angle at which the tacho rises; 0 by default."),
    "rpm": (float, "RPM", "Take this steady speed of a record without a tacho."),
    "tdc": (float, "SECONDS", "Take this time as a top dead centre, without a tacho."),
}


def record(command: Callable[..., int]) -> Callable[..., int]:
    """Give a command the options of a record's file, as `hints`: those that are given, by name."""

    @wraps(command)
    def with_hints(**values: Any) -> int:
        given = {name: values.pop(name) for name in RECORD}
        hints = {name: it for name, it in given.items() if it is not None}
        if ("rpm" in hints) != ("tdc" in hints):
            raise click.UsageError("--rpm and --tdc belong together")
        return command(hints=hints, **values)

    for name, (kind, metavar, text) in reversed(RECORD.items()):
        option = click.option("--" + name.replace("_", "-"), type=kind, metavar=metavar, help=text)
        with_hints = option(with_hints)
    return with_hints


def read_levels(context: click.Context, parameter: click.Parameter, text: str) -> tuple[float, ...]:
    """Return the numbers of a list with commas: levels of noise, m/s2. Raises BadParameter."""
    try:
        levels = tuple(float(word) for word in text.split(","))
    except ValueError as error:
        raise click.BadParameter(f"{text!r} is no list such as 0,0.1,1") from error
    if not all(0.0 <= level < math.inf for level in levels):
        raise click.BadParameter(f"{text}: noise is an rms, 0 or more")
    if len({*levels}) < len(levels):
        raise click.BadParameter(f"{text}: a noise level is given twice")
    return levels


def noise(text: str) -> Callable[..., Any]:
    """Return the option --noise, a list of levels."""
    return click.option("--noise", default="0", callback=read_levels, metavar="RMS,...", help=text)


revolutions = click.option(
    "--revolutions",
    type=click.IntRange(min=2),
    default=5,
    help="Cut windows of so many whole revolutions.",
)
