"""`compsim verify`: which stored files are damaged, which jobs that costs, and how to repair it."""

import json
from typing import TYPE_CHECKING, Any

import click

from compsim.options import json_option, results_option
from compsim.screen import DONE, STORE, plural, print_text, run_commands, say

if TYPE_CHECKING:
    from compressor.store import Damage


@click.command()
@results_option
@json_option
def verify(folder: str, as_json: bool) -> int:
    """Compare every stored file with its checksum.

    \b
    compsim verify -r results

    Damaged files are listed with the jobs that are lost with them, by study and swept values, and
    with the command that computes them again. Exit code 5 if any is damaged.
    """
    from compressor.store import verify as compare

    damages = compare(folder)
    if as_json:
        print_text(json.dumps([jsonable_damage(damage) for damage in damages], indent=1))
    for damage in () if as_json else damages:
        print_text(f"{damage.path}: {damage.problem}" + f"; {damage.remedy}" * bool(damage.remedy))
        for job, points in damage.studies.items():
            print_text(f"  job {job}")
            for study, point in points.items():
                values = "".join(f" {key}={value}" for key, value in point.items())
                print_text(f"    in {study}{values}")
    if not damages:
        say("no damage")
        return DONE
    lost = len({key for damage in damages for key in damage.keys})
    say(f"{plural(len(damages), 'damaged file')}, {plural(lost)} lost")
    for command in run_commands((one for damage in damages for one in damage.again), folder):
        say(f"to repair: {command}")
    return STORE


def jsonable_damage(damage: "Damage") -> dict[str, Any]:
    """Return the damage as JSON has it."""
    return {
        "path": str(damage.path),
        "problem": damage.problem,
        "jobs": damage.keys,
        "studies": damage.studies,
        "case_files": [study.case_file for study in damage.again],
        "remedy": damage.remedy,
    }
