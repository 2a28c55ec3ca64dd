"""`compsim plan`: what a run would do, without doing it."""

import dataclasses
import json
import math
from typing import TYPE_CHECKING

import click

from compressor.digits import plural
from compressor.program import duration
from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    from compressor.sweep import Forecast

BUSY = 0.8  # of the cores: below, a machine is busy with other things


@click.command()
@options.configs
@options.results
@options.jobs("Estimate the time with this many worker processes.")
@options.set_keys
@options.only
@options.max_jobs
@click.option("--first", type=click.IntRange(min=0), default=5, show_default=True,
              help="List this many of the missing jobs.")  # fmt: skip
@options.as_json
def plan(
    configs: tuple[str, ...],
    folder: str,
    jobs: int | None,
    overrides: tuple[str, ...],
    only: str,
    max_jobs: int,
    first: int,
    as_json: bool,
) -> int:
    """Count the jobs of a run, and estimate its time and bytes.

    \b
    compsim plan machine.yaml
    compsim plan wear.yaml --only 'clearance_mm < 0.2'

    Jobs that are stored already are not run again. Times up to a dozen jobs of each study, drawn
    over its design, for some seconds; stores nothing.
    """
    from compressor.cases import load_studies
    from compressor.sweep import cores

    with ProgressReporter(False, "cases read") as progress:
        studies = load_studies(
            *configs, overrides=overrides, max_jobs=max_jobs, only=only, progress=progress
        )
    screen.caution(studies, None)
    screen.report_changes(studies, folder)
    screen.report_machines(studies)
    from compressor.analysis import describe_machine
    from compressor.sweep import forecast

    found = forecast(studies, folder, first)
    workers = jobs or cores()
    if as_json:
        machines = {one.name: dataclasses.asdict(describe_machine(one)) for one in studies}
        whole = dataclasses.asdict(found.with_times(workers, screen.say)) | {"machines": machines}
        screen.print_text(json.dumps(screen.jsonable(whole), indent=1))
        return screen.DONE
    width = max(len(part.study) for part in found.counts.studies)
    for part in found.counts.studies:
        screen.print_text(f"{part.study:<{width}}  {plural(part.jobs):>9}  {part.done:>4} done  "
                   f"{part.missing:>4} missing")  # fmt: skip
    if found.counts.missing:
        screen.print_text(cost(found.with_times(workers, screen.say)))
    for job in found.counts.first:
        point = "".join(f" {key}={value}" for key, value in job.coordinates.items())
        screen.print_text(f"missing: {job.study}{point}")
    return screen.DONE


def cost(whole: "Forecast") -> str:
    """Return the line of what a run will take: time with its range, workers, bytes, compiling.

    Where others are at work on this machine, also the time without them.
    """
    from compressor.sweep import cores

    workers, by = plural(whole.workers, "worker"), f"by {plural(whole.timed, 'timed job')}"
    if whole.timed < whole.missing and not math.isnan(whole.most):
        by = f"{duration(whole.least)} to {duration(whole.most)} {by}"
    first = f", after about {duration(whole.compiling)} of compiling" if whole.compiling else ""
    idle = min(whole.workers, cores())
    alone = whole.seconds * whole.cores / idle
    busy = f", or {duration(alone)} if nothing else ran" if whole.cores < BUSY * idle else ""
    taken = f"about {duration(whole.seconds)} with {workers} ({by})"
    return f"{taken}{busy}{first}, and {screen.size(whole.bytes)}"
