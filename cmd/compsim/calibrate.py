"""`compsim calibrate`: what is not known of a sound machine, by a record of it."""

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from compsim.options import (
    FILE,
    config_argument,
    jobs_option,
    json_option,
    quiet_option,
    results_option,
    setting,
)
from compsim.progress import ProgressReporter
from compsim.records import record_options
from compsim.screen import DONE, one_thread_each, print_text, say

if TYPE_CHECKING:
    from compressor.studies.calibrate.calibrate import Calibration

POOR_FIT = 1.3  # misfit from which on the machine is said not to be this one


@click.command()
@click.argument("record", metavar="RECORD|JOB", type=FILE)
@config_argument
@click.option("--fit", "ranges", multiple=True, required=True, metavar="KEY=LOW:HIGH",
              help="Fit this key within this range, in the case file's unit.")  # fmt: skip
@record_options
@setting
@results_option
@jobs_option()
@json_option
@quiet_option
def calibrate(
    record: str, config: str, ranges: tuple[str, ...], hints: dict[str, Any],
    overrides: tuple[str, ...], folder: str, jobs: int | None, as_json: bool, quiet: bool,
) -> int:  # fmt: skip
    """Fit keys of a sound machine to its accelerometer's record.

    \b
    compsim calibrate healthy.csv machine.yaml \\
        --fit machine.reciprocating_mass_kg=10:20 \\
        --fit body.frequency_y_Hz=15:30 > sound.yaml

    CONFIG makes one case, with body and sensor, and joints as they are in the sound machine. It
    runs at the record's mean speed. Compared are the orders of the mean revolution, amplitude and
    phase, each relative to its size. What is printed is the case file with the values that fit
    best; comments say their 95 % intervals, and what the record cannot separate. Copies of this
    file with worn joints make a study for `compsim identify`.

    Every point is a job of the study CONFIG-calibrate in the folder of results: it is stored, and
    not run again. Exit code 0 also where the machine does not fit: that is an answer.
    """
    one_thread_each()  # before numpy loads
    from compressor.store import find_record
    from compressor.studies.calibrate.calibrate import Unknown
    from compressor.studies.calibrate.calibrate import calibrate as fit_case
    from compressor.sweep import cores

    unknowns = [Unknown.written(text) for text in ranges]
    _, measured = find_record(record, folder, hints)
    with ProgressReporter(quiet, "points") as progress:
        found = fit_case(measured, config, unknowns, folder, overrides, jobs or cores(), progress)
    if as_json:
        print_text(json.dumps(jsonable(record, found), indent=1))
        return DONE
    from compressor.cases import to_yaml

    for text in measured.remarks:
        print_text(f"# read: {text}")
    for line in describe(record, config, found):
        print_text(f"# {line}".rstrip())
    print_text(to_yaml(found.case).rstrip("\n"))
    if not quiet:
        say(f"{found.jobs} points, {found.run_now} of them run now, in study {found.study}")
    return DONE


def describe(record: str, config: str, found: "Calibration") -> Iterator[str]:
    """Yield what was fitted, how well, and what the record does not determine."""
    fit = found.fit
    yield (f"{config}, fitted to {record}: {found.revolutions} revolutions at "
           f"{60 * found.speed:.6g} rpm, in place of the file's {found.rpm_given:g}; "
           f"orders 1 to {found.orders}")  # fmt: skip
    for place, one in enumerate(found.unknowns):
        low, high = found.interval(place)
        best = one.value(fit.shares[place])
        is_at_end = min(fit.shares[place], 1.0 - fit.shares[place]) < 1e-3
        more = "; at an end of its range: widen it" if is_at_end else ""
        yield f"{one.key}: {best:.4g}, 95 % interval {low:.4g} to {high:.4g}{more}"
    yield (f"the machine explains {fit.explained:.2%} of the mean revolution's mean square; "
           f"noise is {fit.noise:.2g} of it")  # fmt: skip
    if fit.misfit >= POOR_FIT:
        yield (f"THE MACHINE DOES NOT FIT: orders are off by {fit.misfit:.3g} times what a model "
               "may err; intervals are widened by as much")  # fmt: skip
    for group in fit.open_directions:
        keys = " and ".join(found.unknowns[place].key for place in group)
        how = "are not separated" if len(group) > 1 else "is not determined"
        yield f"{keys} {how}: the record narrows their range by less than half"


def jsonable(record: str, found: "Calibration") -> dict[str, Any]:
    """Return what was fitted as JSON says it."""
    fit = found.fit
    keys = {}
    for place, one in enumerate(found.unknowns):
        low, high = found.interval(place)
        keys[one.key] = {"value": one.value(fit.shares[place]), "low": low, "high": high}
    return {
        "record": record, "study": found.study, "keys": keys, "misfit": fit.misfit,
        "explained": fit.explained, "noise": fit.noise, "orders": found.orders,
        "revolutions": found.revolutions, "speed_rpm": 60 * found.speed,
        "not_told_apart": [[found.unknowns[p].key for p in group] for group in fit.open_directions],
        "case": found.case.values(),
    }  # fmt: skip
