"""`compsim status`: how many jobs of each stored study are done, failed or missing."""

import dataclasses
import json

import click

from compsim.screen import DONE, as_json, plural, results, run_commands, say


@click.command()
@results
@as_json
def status(folder: str, as_json: bool) -> int:
    """Tell how many jobs of each stored study are done, failed or missing, and why they failed."""
    from compressor.reasons import remedy
    from compressor.store import standings

    found = standings(folder)
    if as_json:
        click.echo(json.dumps([dataclasses.asdict(one) for one in found], indent=1))
        return DONE
    width = max(len(one.study) for one in found)
    for one in found:
        click.echo(f"{one.study:<{width}}  {plural(one.jobs):>9}  {one.ok:>4} ok  "
                   f"{one.failed:>4} failed  {one.missing:>4} missing")  # fmt: skip
        for reason, number in one.reasons.items():
            click.echo(f"{'':<{width}}  {number:>4} {reason}: {remedy(reason)}")
    for command in run_commands((one.again for one in found if one.missing), folder):
        say(f"next: {command}")
    return DONE
