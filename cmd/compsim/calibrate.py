"""`compsim calibrate`: what is not known of a sound machine, by a record of it."""

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("record", metavar="RECORD|JOB", type=options.FILE)
@options.config
@click.option(
    "--fit", "ranges", multiple=True, required=True, metavar="KEY=LOW:HIGH", help="Fit this key."
)
@options.record
@options.set_keys
@options.results
@options.jobs()
@options.as_json
@options.quiet
def calibrate(record, config, ranges, hints, overrides, folder, jobs, as_json, quiet) -> int:
    """Fit keys of a sound machine to its accelerometer's record.

    \b
    compsim calibrate healthy.csv machine.yaml \\
        --fit machine.reciprocating_mass_kg=10:20 \\
        --fit body.frequency_y_Hz=15:30 > sound.yaml

    Fits each key within its range, in its own unit. CONFIG gives one case, with body and sensor and
    the joints of the sound machine. It runs at the record's mean speed. Amplitude and phase of the
    orders of the mean revolution are compared, each relative to its size. Prints the case file with
    the values that fit best; comments give their 95 % intervals, and what the record cannot
    separate. Copies of this file with worn joints make a study for `compsim identify`.

    Each point is a stored job of the study CONFIG-calibrate. Exit code 0 also if the machine does
    not fit: that is an answer.
    """
    from compressor.cases import load_studies, to_yaml
    from compressor.store import find_record
    from compressor.studies.calibrate import calibrate as fit_case
    from compressor.studies.calibrate import jsonable_fit, list_fit
    from compressor.studies.frame import read_range, replace_settings
    from compressor.sweep import cores

    unknowns = [read_range("--fit", text) for text in ranges]
    _, measured = find_record(record, folder, hints)
    middle = replace_settings(overrides, *(f"{one.key}={one.value(0.5)!r}" for one in unknowns))
    screen.caution(load_studies(config, overrides=middle))
    with ProgressReporter(quiet, "points") as progress:
        found = fit_case(measured, config, unknowns, folder, overrides, jobs or cores(), progress)
    if as_json:
        screen.print_json(jsonable_fit(record, found))
        return screen.DONE
    texts = [f"read: {text}" for text in measured.remarks] + [*list_fit(record, config, found)]
    _, _, values = to_yaml(found.case).partition("\n")  # without the name: copies have their own
    screen.print_text(*(f"# {text}" for text in texts), values.rstrip("\n"))
    if not quiet:
        screen.say(f"{found.jobs} points, {found.run_now} of them run now, in study {found.study}")
    return screen.DONE
