"""The options by which commands read a record's file: what it does not say itself; and noise."""

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any

import click

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "blank": " "}
DECIMALS = {"comma": ",", "point": "."}


def read_sign(signs: Mapping[str, str]) -> Callable[..., str | None]:
    """Return the callback of an option whose value is a sign, or its name."""

    def read(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
        found = signs.get(text or "", text)
        if found is not None and found not in signs.values():
            raise click.BadParameter(f"{text!r} is none of {', '.join(signs)}")
        return found

    return read


OPTIONS = (
    click.option("--channel", metavar="NAME",
                 help="Read the acceleration from this channel, a name or a number from 1."),
    click.option("--unit", metavar="UNIT",
                 help="Take the acceleration in this unit, whatever the file says: m/s2, mm/s2, g, "
                 "in/s2 or ft/s2."),
    click.option("--full-scale", type=float,
                 help="Scale whole numbers in WAV so that the greatest is this, in the unit."),
    click.option("--rate", type=float,
                 help="Take so many samples a second where a file has no times."),
    click.option("--time", metavar="NAME",
                 help="Read the times from this channel, a name or a number from 1."),
    click.option("--time-unit", metavar="UNIT",
                 help="Take the times in this unit, whatever the file says: s, ms or us."),
    click.option("--separator", metavar="SIGN", callback=read_sign(SEPARATORS),
                 help="Split lines of text at a comma, semicolon, tab or blank; found by default."),
    click.option("--decimal", metavar="SIGN", callback=read_sign(DECIMALS),
                 help="Read numbers of a text with a decimal comma or point; found by default."),
    click.option("--skip-lines", type=click.IntRange(min=0), metavar="COUNT",
                 help="Skip so many lines of a text above its header; found by default."),
    click.option("--tacho", metavar="NAME",
                 help="Read the tacho from this channel, a name or a number from 1."),
    click.option("--tacho-deg", type=float,
                 help="Set the crank angle at which the tacho rises, in degrees; 0 by default."),
    click.option("--rpm", type=float, help="Take this steady speed of a record without a tacho."),
    click.option("--tdc", type=float,
                 help="Take this time, in s, as a top dead centre, without a tacho."),
)  # fmt: skip


NAMES = (
    "channel", "unit", "full_scale", "rate", "time", "time_unit", "separator", "decimal",
    "skip_lines", "tacho", "tacho_deg", "rpm", "tdc",
)  # fmt: skip


def read_levels(context: click.Context, parameter: click.Parameter, text: str) -> tuple[float, ...]:
    """Return the numbers of a list with commas: levels of noise, m/s2."""
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError as error:
        raise click.BadParameter(f"{text!r} is no list such as 0,0.1,1") from error


def record_options(command: Callable[..., int]) -> Callable[..., int]:
    """Give a command the options of a record's file, as `hints`: those that are given, by name."""

    @wraps(command)
    def with_hints(**values: Any) -> int:
        hints = {name: found for name in NAMES if (found := values.pop(name)) is not None}
        if ("rpm" in hints) != ("tdc" in hints):
            raise click.UsageError("--rpm and --tdc belong together")
        return command(hints=hints, **values)

    for option in reversed(OPTIONS):
        with_hints = option(with_hints)
    return with_hints
