"""`compsim plan`: what a run would do, without doing it."""

import dataclasses
import json
import math
from typing import TYPE_CHECKING

import click

from compsim.explain import without_nan
from compsim.screen import (
    DONE,
    Reading,
    caution,
    configs_argument,
    duration,
    jobs_option,
    limit,
    only_option,
    output_option,
    plural,
    print_text,
    say,
    setting,
    size,
    tell_changes,
)  # fmt: skip

if TYPE_CHECKING:
    from compressor.regimes import Standing
    from compressor.sweep import Forecast


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

    Times up to a dozen jobs of each study, drawn over its design, for some seconds; stores
    nothing. Of a file with `regimes` it tells chains and values alone.
    """
    from compressor.cases import load_studies
    from compressor.sweep import cores

    with Reading() as told:
        studies = load_studies(
            *configs, overrides=overrides, max_jobs=max_jobs, only=only, told=told
        )
    caution(studies)
    chained = [study for study in studies if study.regimes]
    studies = [study for study in studies if not study.regimes]
    ahead: list[Standing] = []
    if chained:
        from compressor.regimes import standing

        ahead = standing(chained, output)
    if not studies:
        tell_chains(ahead, as_json)
        return DONE
    tell_changes(studies, output)
    from compressor.sweep import forecast

    found = forecast(studies, output, first)
    workers = jobs or cores()
    if as_json:
        more = {"regimes": [one._asdict() for one in ahead]} if ahead else {}
        whole = without_nan(dataclasses.asdict(found.timed(workers, say)) | more)
        print_text(json.dumps(whole, indent=1))
        return DONE
    tell_chains(ahead, as_json)
    width = max(len(part.study) for part in found.counts.studies)
    for part in found.counts.studies:
        print_text(f"{part.study:<{width}}  {plural(part.jobs):>9}  {part.done:>4} done  "
                   f"{part.missing:>4} missing")  # fmt: skip
    if found.counts.missing:
        print_text(cost(found.timed(workers, say)))
    for job in found.counts.first:
        point = "".join(f" {key}={value}" for key, value in job.coordinates.items())
        print_text(f"next: {job.study}{point}")
    return DONE


def cost(whole: "Forecast") -> str:
    """The line of what a run will take: time with its range, workers, bytes, compiling."""
    workers, by = plural(whole.workers, "worker"), f"by {plural(whole.timed, 'timed job')}"
    if whole.timed < whole.missing and not math.isnan(whole.most):
        by = f"{duration(whole.least)} to {duration(whole.most)} {by}"
    first = f", after about {duration(whole.compiling)} of compiling" if whole.compiling else ""
    taken = f"about {duration(whole.seconds)} with {workers} ({by})"
    return f"{taken}{first}, and {size(whole.bytes)}"


def tell_chains(ahead: "list[Standing]", as_json: bool) -> None:
    """Say how many values the chains of regimes have, and how many of them are stored."""
    if as_json:
        print_text(json.dumps({"regimes": [one._asdict() for one in ahead]}, indent=1))
        return
    for one in ahead:
        missing = one.chains * one.values - one.done
        chains = f"{plural(one.chains, 'chain')} x {plural(one.values, 'value')}"
        print_text(f"{one.study}  {chains}  {one.done:>4} done  {missing:>4} missing")
