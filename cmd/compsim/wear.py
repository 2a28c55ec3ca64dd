"""`compsim wear`: how bores wear over operating hours, and when a joint is worn out."""

import json
import math
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from compressor.program import duration, printable
from compsim.options import (
    configs_argument,
    jobs_option,
    json_option,
    quiet_option,
    results_option,
    setting,
)
from compsim.progress import ProgressReporter
from compsim.screen import (
    DONE,
    SOME_FAILED,
    all_stored,
    one_thread_each,
    plural,
    print_text,
    say,
    say_wrapped,
    stored_before,
)

if TYPE_CHECKING:
    from compressor.cases import Study
    from compressor.studies.wear.run import WearSummary, WornMachine

MAX_DRAWN = 12  # machines that get a figure
HEAD = f"{'worn out after, h':>17}  {'from more to less wear, h':>31}  at the end"


@click.command()
@configs_argument
@results_option
@jobs_option()
@setting
@click.option("--rerun", is_flag=True, help="Go on with machines whose motion failed.")
@json_option
@quiet_option
def wear(
    configs: tuple[str, ...],
    folder: str,
    jobs: int | None,
    overrides: tuple[str, ...],
    rerun: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Wear bearings over operating hours, until one is worn out.

    \b
    compsim wear life.yaml

    CONFIG has a group `wear`. Motion and wear take turns: what rubs in a run at the clearances as
    they are opens them evenly, by Archard's law, and stands for all revolutions until one has grown
    by wear.step_mm. One line a machine goes to stdout: the hours until a clearance reaches
    wear.limit_mm, with the least and the greatest coefficient beside them. Clearances and metrics
    of the runs are kept in wear/ of the folder, with a figure; what was interrupted goes on from
    there.
    """
    one_thread_each()  # before numpy loads
    from compressor.cases import load_studies
    from compressor.studies.wear.run import run_wear
    from compressor.sweep import cores

    with ProgressReporter(quiet, "cases read") as progress:
        studies = load_studies(*configs, overrides=overrides, follow=False, progress=progress)
    check(studies)
    with ProgressReporter(quiet, "machines", folder=folder) as progress:
        summary = run_wear(studies, folder, jobs or cores(), progress, rerun)
    if as_json:
        print_text(json.dumps([jsonable_wear(one, folder) for one in summary.machines], indent=1))
    else:
        for line in table(summary.machines):
            print_text(line)
    drawn = [*draw(summary, folder, {study.name: study.title for study in studies})]
    if not quiet:
        report_wear(summary, folder, drawn)
    for one in summary.failed:
        fail(one)
    return SOME_FAILED if summary.failed else DONE


def check(studies: "list[Study]") -> None:
    """Raise click.UsageError unless each case wears, and is measured over whole revolutions."""
    for study in studies:
        for case in study.cases:
            if case.joint == "none":
                raise click.UsageError(
                    f"{study.path}: joint: none has no bore that wears: leave none out"
                )
            if not case.wear:
                raise click.UsageError(
                    f"{study.path}: has no wear: write wear: true, or keys of it (compsim schema)"
                )
            if case.solve.duration_rev == "auto":
                continue
            turns = (case.duration - case.settle) / case.turn
            if abs(turns - round(turns)) > 1e-9 or turns < 1.0 - 1e-9:
                raise click.UsageError(
                    f"{study.path}: solve.duration_rev: {turns:g} after settle_rev must be whole "
                    "revolutions, one at least"
                )


def table(machines: "tuple[WornMachine, ...]") -> Iterator[str]:
    """Yield a line for each machine, below a head."""
    names = [" ".join([one.study, *(f"{k}={v}" for k, v in one.point.items())]) for one in machines]
    width = max(map(len, names))
    yield f"{'machine':<{width}}  {HEAD}"
    for name, one in zip(names, machines, strict=True):
        yield f"{name:<{width}}  {wear_ending(one)}"


def wear_ending(one: "WornMachine") -> str:
    """Return the end of a machine's wear in a line."""
    found, wear_keys = one.life, one.case.wear
    if not found or not wear_keys:
        return f"failed: {one.reason}"
    factor = wear_keys.coefficient_factor
    low, mid, high = (
        hours(min(times * found.followed, wear_keys.hours), "> ")
        if math.isnan(value)
        else hours(value)
        for value, times in ((found.low, 1.0 / factor), (found.hours, 1.0), (found.high, factor))
    )
    where = f"{1e3 * found.clearance:.3f} mm at {found.joint}"
    return f"{mid:>17}  {f'{low} to {high}':>31}  {where}" + f"; failed: {one.reason}" * bool(
        one.reason
    )


def hours(value: float, sign: str = "") -> str:
    """Return the hours in four digits."""
    return f"{sign}{value:.0f}" if value >= 1000 else f"{sign}{value:.4g}"


def jsonable_wear(one: "WornMachine", folder: str) -> dict[str, Any]:
    """Return a machine as JSON says it."""
    from compressor.studies.wear.stages import wear_file

    found: dict[str, Any] = {"study": one.study, **one.point, "reason": one.reason}
    if one.life:
        numbers = {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in one.life._asdict().items()
        }
        found |= {**numbers, "file": str(wear_file(folder, one.case))}
    return found


def report_wear(summary: "WearSummary", folder: str, drawn: list[str]) -> None:
    """Write what was done, and where figures are."""
    total = len(summary.machines)
    done = f"{plural(total - summary.done_before, 'machine')} in {duration(summary.seconds)}"
    done += stored_before(summary.done_before)
    say(done if summary.done_before < total else all_stored(total, folder, "machine"))
    for path in drawn:
        say(path)


def draw(summary: "WearSummary", folder: str, titles: dict[str, str]) -> Iterator[str]:
    """Draw the first machines that have a life; titles: of the studies' machines, "" without."""
    from compressor.report import render, title_figure
    from compressor.store import publish
    from compressor.studies.wear.figures import draw_wear
    from compressor.studies.wear.stages import open_wear, wear_file

    for one in [one for one in summary.machines if one.life][:MAX_DRAWN]:
        path = wear_file(folder, one.case).with_suffix(".png")
        wear_keys = one.case.wear
        assert wear_keys
        bounds = wear_keys.limit_mm or math.nan, wear_keys.coefficient_factor
        drawing = draw_wear(open_wear(folder, one.case), *bounds)
        point = [f"{key} {value}" for key, value in one.point.items()]
        drawing.title = title_figure(titles[one.study] or one.study, "wear of the bores", point)
        publish(path, render(drawing, "png"))
        yield os.fspath(path)


def fail(one: "WornMachine") -> None:
    """Write why a machine ended early, and what to do."""
    from compressor.reasons import remedy

    point = "".join(f" {key}={value}" for key, value in one.point.items())
    say_wrapped(f"{one.study}{point}: {one.reason}: {printable(one.detail)}")
    say_wrapped(f"{remedy(one.reason)}; then: compsim wear --rerun", 2)
