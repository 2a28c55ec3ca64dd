"""`compsim plan`: what a run would do, without doing it."""

import dataclasses
from typing import TYPE_CHECKING

import click

from compressor.digits import align_columns, plural
from compressor.program import duration
from compsim import options, screen
from compsim.progress import read_cases

if TYPE_CHECKING:
    from compressor.sweep import Forecast

FIRST = 5  # missing jobs that are listed


@click.command()
@options.configs
@options.results
@options.jobs("Estimate the time with this many worker processes.")
@options.set_keys
@options.only
@options.max_jobs
@options.shard
@options.as_json
def plan(configs, folder, jobs, shard, as_json, **how) -> int:
    """Count the jobs of a run, and estimate its time and bytes.

    \b
    compsim plan machine.yaml
    compsim plan wear.yaml --only 'clearance_mm < 0.2'

    Jobs that are stored already are not run again. Times one job of each study, and takes the
    others to cost as much; stores nothing.
    """
    from compressor.sweep import add_times, cores, forecast

    studies = read_cases(configs, **how)
    studies = [study.shard(*shard) for study in studies] if shard else studies
    machines = screen.caution(studies, None)
    screen.say_machines(machines)
    (found, missing), workers = forecast(studies, folder, FIRST), jobs or cores()
    if as_json:
        plain = {study: dataclasses.asdict(machine) for study, machine in machines.items()}
        times = dataclasses.asdict(add_times(found, missing, workers, screen.say))
        screen.print_json(times | {"machines": plain})
        return screen.DONE
    rows = []
    for one in found.studies:
        rows.append((one.study, plural(one.jobs), f"{one.done} done", f"{one.missing} missing"))
    screen.print_text(*align_columns(rows, "<>>>"))
    if missing:
        screen.print_text(cost(add_times(found, missing, workers, screen.say)))
    for job in found.first:
        screen.print_text(f"missing: {job.study}{screen.point_text(job.coordinates)}")
    return screen.DONE


def cost(whole: "Forecast") -> str:
    """Return the line of what a run will take: time, workers, compiling, bytes."""
    workers = plural(whole.workers, "worker")
    first = f", after about {duration(whole.compiling)} of compiling" if whole.compiling else ""
    taken = f"about {duration(whole.seconds)} with {workers} (by one timed job of each study)"
    return f"{taken}{first}, and {screen.size(whole.bytes)}"
