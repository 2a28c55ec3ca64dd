"""The options and arguments that commands share."""

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from compressor.units import Units

MAX_JOBS = 10_000


class GivenPath(click.Path):
    """A path; an empty word, as of a shell variable that is not set, is none."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the path. Raises BadParameter."""
        if not os.fspath(value):
            self.fail("an empty word: is a shell variable not set?", param, ctx)
        return super().convert(value, param, ctx)


FILE, FOLDER = GivenPath(readable=False), GivenPath(file_okay=False, readable=False)

config = click.argument("config", metavar="CONFIG", type=FILE)
configs = click.argument("configs", nargs=-1, required=True, metavar="CONFIG...", type=FILE)
job = click.argument("words", nargs=-1, required=True, metavar="JOB | STUDY [AXIS=VALUE]...")
results = click.option(
    "-r", "--results", "folder", default="results", show_default=True, type=FOLDER,
    metavar="FOLDER", help="Use this folder of results.",
)  # fmt: skip
set_keys = click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE",
    help="Set a key in all case files, such as machine.speed_rpm=300.",
)  # fmt: skip
only = click.option(
    "--only", default="", metavar="COMPARISON",
    help="Take only the jobs for which this holds, such as 'clearance_mm < 0.2'; the others stay "
    "missing.",
)  # fmt: skip
max_jobs = click.option(
    "--max-jobs", type=click.IntRange(min=1), default=MAX_JOBS, show_default=True,
    help="Refuse a case file with more jobs than this.",
)  # fmt: skip
as_json = click.option("--json", "as_json", is_flag=True, help="Print the same as JSON.")
quiet = click.option("--quiet", is_flag=True, help="Print no progress; errors are still reported.")


def output(default: str, text: str) -> Callable[..., Any]:
    """Return the option -o, of a folder to write into."""
    return click.option("-o", "--output", default=default, show_default=True, type=FOLDER,
                        metavar="FOLDER", help=text)  # fmt: skip


def jobs(text: str = "Run in this many worker processes.") -> Callable[..., Any]:
    """Return the option -j, by default as many processes as this one may use cores."""
    return click.option("-j", "--jobs", type=click.IntRange(min=1),
                        show_default="cores available", help=text)  # fmt: skip


def units(usual: str) -> Callable[..., Any]:
    """Return the option --units; usual: what there is without it."""
    return click.option(
        "--units", type=click.Choice(["si", "plant"]), show_default=usual,
        help="Units: SI, or those of a plant: mm, mm/s, g, kN, bar, rpm.",
    )  # fmt: skip


def check_json_units(as_json: bool, units: "Units | None") -> None:
    """Raise UsageError where other units than SI are requested in JSON."""
    if as_json and units == "plant":
        raise click.UsageError("--json has all numbers in SI: leave out --units plant")
