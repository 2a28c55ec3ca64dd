"""`compsim verify`: which stored files are damaged, which jobs that costs, and how to repair it."""

import click

from compressor.digits import plural
from compsim import options, screen


@click.command()
@options.results
@options.as_json
def verify(folder, as_json) -> int:
    """Compare every stored file with its checksum.

    \b
    compsim verify -r results

    Damaged files are listed with the jobs that are lost with them (of a batch that cannot be opened
    all that are missing), by study and swept values, and with the command that computes them again;
    batches of jobs are renamed to .damaged. Exit code 5 if any is damaged.
    """
    from compressor.store import verify as compare

    damages = compare(folder)
    if as_json:
        screen.print_json(damages)
    for damage in () if as_json else damages:
        remedy = f"; {damage.remedy}" if damage.remedy else ""
        screen.print_text(f"{damage.path}: {damage.problem}{remedy}")
        for job, points in damage.studies.items():
            screen.print_text(f"  job {job}")
            for study, point in points.items():
                screen.print_text(f"    in {study}{screen.point_text(point)}")
    if not damages:
        screen.say("no damage")
        return screen.DONE
    lost = len({key for damage in damages for key in damage.studies})
    most = "up to " if lost and any(damage.at_most for damage in damages) else ""
    screen.say(f"{plural(len(damages), 'damaged file')}, {most}{plural(lost)} lost")
    for command in screen.run_commands((one for damage in damages for one in damage.again), folder):
        screen.say(f"to repair: {command}")
    return screen.STORE
