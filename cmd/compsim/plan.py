"""`compsim plan`: what a run would do, without doing it."""

import dataclasses
import json

import click

from compsim.screen import (
    DONE,
    caution,
    configs_argument,
    duration,
    jobs_option,
    limit,
    only_option,
    output_option,
    plural,
    say,
    setting,
    size,
)  # fmt: skip


@click.command()
@configs_argument
@output_option
@jobs_option("Worker processes that the time is told for.")
@setting
@only_option
@limit
@click.option("--first", type=click.IntRange(min=0), default=5, show_default=True,
              help="How many of the missing jobs to list.")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="The same as JSON.")
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
    """Tell what a run would do: its jobs, those that are stored, time and bytes of the others.

    Times one job of each study and of each set of worn joints; stores nothing.
    """
    from compressor.cases import load_studies
    from compressor.sweep import cores

    studies = load_studies(*configs, overrides=overrides, max_jobs=max_jobs, only=only)
    caution(studies)
    from compressor.sweep import forecast

    found = forecast(studies, output, jobs or cores(), first, say)
    if as_json:
        click.echo(json.dumps(dataclasses.asdict(found), indent=1))
        return DONE
    width = max(len(part.study) for part in found.studies)
    for part in found.studies:
        click.echo(f"{part.study:<{width}}  {plural(part.jobs):>9}  {part.done:>4} done  "
                   f"{part.missing:>4} missing")  # fmt: skip
    if found.missing:
        workers = f"{found.workers} worker{'s' if found.workers > 1 else ''}"
        click.echo(f"about {duration(found.seconds)} with {workers}, and {size(found.bytes)}")
    for job in found.first:
        point = "".join(f" {key}={value}" for key, value in job.coordinates.items())
        click.echo(f"next: {job.study}{point}")
    return DONE
