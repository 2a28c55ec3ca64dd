"""`compsim plan`: what a run would do, without doing it."""

import dataclasses
import json
import math
from typing import TYPE_CHECKING

import click

from compressor.program import duration
from compressor.studies import by_kind
from compsim.progress import ProgressReporter
from compsim.screen import (
    DONE,
    as_json,
    caution,
    configs_argument,
    jobs_option,
    jsonable,
    limit,
    only_option,
    output_option,
    plural,
    print_text,
    report_changes,
    report_machines,
    say,
    setting,
    size,
)  # fmt: skip

if TYPE_CHECKING:
    from compressor.sweep import Forecast

BUSY = 0.8  # of the cores: below, a machine is busy with other things


@click.command()
@configs_argument
@output_option
@jobs_option("Estimate the time with this many worker processes.")
@setting
@only_option
@limit
@click.option("--first", type=click.IntRange(min=0), default=5, show_default=True,
              help="List this many of the missing jobs.")  # fmt: skip
@as_json
def plan(
    configs: tuple[str, ...],
    output: str,
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
    over its design, for some seconds; stores nothing. Of a file with `regimes` it only counts
    chains and values.
    """
    from compressor.cases import load_studies
    from compressor.sweep import cores

    with ProgressReporter(False, "cases read") as progress:
        studies = load_studies(
            *configs, overrides=overrides, max_jobs=max_jobs, only=only, progress=progress
        )
    caution(studies, None)
    kinds = by_kind(studies)
    studies = kinds.pop(None, [])
    ahead = {kind: kind.module("command").ahead(its, output) for kind, its in kinds.items() if kind}
    more = {kind.group: [one._asdict() for one in found] for kind, found in ahead.items()}
    if as_json and not studies:
        print_text(json.dumps(more, indent=1))
    if not as_json:
        for kind, standings in ahead.items():
            print_text("\n".join(kind.module("command").ahead_lines(standings)))
    if not studies:
        return DONE
    report_changes(studies, output)
    report_machines(studies)
    from compressor.analysis import describe_machine
    from compressor.sweep import forecast

    found = forecast(studies, output, first)
    workers = jobs or cores()
    if as_json:
        machines = {one.name: dataclasses.asdict(describe_machine(one)) for one in studies}
        whole = dataclasses.asdict(found.with_times(workers, say)) | more | {"machines": machines}
        whole = jsonable(whole)
        print_text(json.dumps(whole, indent=1))
        return DONE
    width = max(len(part.study) for part in found.counts.studies)
    for part in found.counts.studies:
        print_text(f"{part.study:<{width}}  {plural(part.jobs):>9}  {part.done:>4} done  "
                   f"{part.missing:>4} missing")  # fmt: skip
    if found.counts.missing:
        print_text(cost(found.with_times(workers, say)))
    for job in found.counts.first:
        point = "".join(f" {key}={value}" for key, value in job.coordinates.items())
        print_text(f"missing: {job.study}{point}")
    return DONE


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
    return f"{taken}{busy}{first}, and {size(whole.bytes)}"
