"""`compsim show`: what is known of one job."""

import dataclasses
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from compressor.program import printable
from compsim import options, screen

if TYPE_CHECKING:
    from compressor.cases import Case
    from compressor.store import JobReport


@click.command()
@options.job
@options.results
@click.option("--case", is_flag=True, help="Print the case alone, as a case file with all keys.")
@options.units("kN, mm, µm, m/s²")
@options.as_json
def show(words, folder, case, units, as_json) -> int:
    """Print all that is known of one job.

    A job is named by the beginning of its key, or by its study and values of the study's axes:

    \b
    compsim show 3fa9c2
    compsim show bearing-wear clearance_mm=0.2 machine.rod_mass_kg=3

    It prints which studies the job belongs to and where in them, how it ended and why, its numbers
    with their error bars, how it was run, and the values of its case other than the defaults.
    Of a job with signals, it says whether the rod load at the crosshead pin changes its side as API
    618 requires, by 15 degrees and 3 percent. --json has all numbers in SI.
    """
    options.check_json_units(as_json, units)
    if case and as_json:
        raise click.UsageError("--case prints a case file: leave out --json, which has all keys")
    from compressor.reasons import remedy
    from compressor.store import report_job
    from compsim.job_text import sections

    found = report_job(folder, *words)
    if as_json:
        screen.print_json(found)
        return screen.DONE
    if case:
        screen.print_text(whole_case(found, folder).removesuffix("\n"))
        return screen.DONE
    ended = {"missing": "not run yet", "failed": f"failed: {found.reason}: {found.detail}"}
    screen.print_text(f"job {found.key}: {printable(ended.get(found.status, found.status))}")
    for study, point in found.studies.items():
        screen.print_text(f"  in {study}{printable(screen.point_text(point))}")
    if found.status == "missing":
        for command in screen.run_commands(found.again, folder):
            screen.say(f"next: {command}")
        return screen.DONE
    if found.status == "failed":
        screen.print_text(f"  what to do: {remedy(found.reason)}")
    for heading, lines in sections(found, units or "usual"):
        if lines and heading:
            screen.print_text(heading)
        screen.print_lines(f"  {line}" for line in lines)
    screen.print_text("values of its case other than the defaults (--case prints all)")
    screen.print_text(*(f"  {line}" for line in changed_values(found.case)))
    return screen.DONE


def changed_values(case: "Case") -> Iterator[str]:
    """Yield the values of a case other than the defaults, as --set takes them."""
    from functools import partial

    from compressor.cases import Case, keys_of, row_of, value_of

    values, usual = case.values(), Case().values()
    for key in keys_of(partial(value_of, values)):
        value, row = value_of(values, key), row_of(key)
        default = row.default if row else None
        if key != "name" and value not in (None, value_of(usual, key), default):
            yield f"{key}={value}"


def whole_case(found: "JobReport", folder: str) -> str:
    """Return a job's case as a case file, under a name of its own: its study's may be taken."""
    from compressor.cases import to_yaml

    if "case" not in found.attributes:
        run = "; ".join(screen.run_commands(found.again, folder)) or "run its case file"
        raise click.UsageError(f"job {found.key} was not run yet: {run}")
    name = f"{found.case.name[:55]}-{found.key[:8]}"  # at most 64 characters
    return to_yaml(dataclasses.replace(found.case, name=name))
