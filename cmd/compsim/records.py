"""The options by which commands read a record's file: what it does not say itself."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

OPTIONS = (
    click.option("--channel", metavar="NAME",
                 help="Channel of the acceleration, by name or number from 1."),
    click.option("--unit", metavar="UNIT",
                 help="Its unit: m/s2, mm/s2, g, in/s2 or ft/s2; in place of what the file says."),
    click.option("--full-scale", type=float,
                 help="Of whole numbers in WAV: what the greatest is, in the unit."),
    click.option("--rate", type=float, help="Samples a second of a file without times."),
    click.option("--tacho", metavar="NAME",
                 help="Channel of the tacho, by name or number from 1."),
    click.option("--tacho-deg", type=float,
                 help="Crank angle at which the tacho rises; 0 by default."),
    click.option("--rpm", type=float, help="Steady speed of a record without a tacho."),
    click.option("--tdc", type=float, help="A time of top dead centre in it, s."),
)  # fmt: skip


NAMES = ("channel", "unit", "full_scale", "rate", "tacho", "tacho_deg", "rpm", "tdc")


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
