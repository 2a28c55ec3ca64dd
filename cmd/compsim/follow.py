"""`compsim follow`: the motion of machines along a key, value after value."""

import itertools
import time
from collections import Counter
from typing import TYPE_CHECKING

import click

from compressor.digits import plural
from compressor.program import duration, printable
from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    import xarray as xr

MAX_FAILURES = 20  # listed one by one
MAX_DRAWN = 12  # machines that get a figure


@click.command()
@options.config
@click.option("--over", required=True, metavar="KEY=LOW:HIGH:N",
              help="Follow over N values of this key, in the case file's unit.")  # fmt: skip
@click.option("--both", is_flag=True, help="Follow down from HIGH, too, and compare.")
@click.option("--log", is_flag=True, help="Space values with even ratios.")
@click.option("--points", type=click.IntRange(6, 10_000), default=64, show_default=True,
              help="Take so many Poincaré points of a motion that does not repeat.")  # fmt: skip
@click.option("--no-exponent", is_flag=True,
              help="Leave out the Lyapunov exponent, which takes most of the time; nothing is "
              "called chaotic then.")  # fmt: skip
@click.option("--rerun", is_flag=True, help="Run again from the first failed value on.")
@options.results
@options.jobs()
@options.set_keys
@click.option("--only", default="", metavar="COMPARISON",
              help="Follow only the machines for which this holds at some value.")  # fmt: skip
@options.max_jobs
@options.quiet
def follow(
    config: str,
    over: str,
    both: bool,
    log: bool,
    points: int,
    no_exponent: bool,
    rerun: bool,
    folder: str,
    jobs: int | None,
    overrides: tuple[str, ...],
    only: str,
    max_jobs: int,
    quiet: bool,
) -> int:
    """Follow a motion along a key: periods, chaos, bistability.

    \b
    compsim follow light.yaml --over clearance_mm=0.01:1:80 --log --both
    compsim follow worn.yaml --over machine.speed_rpm=300:900:60

    Each value's run starts from the end of the last one's, so that a motion is followed as long as
    it exists. Whatever else CONFIG sweeps makes machines, each of which is followed on its own. At
    each value the motion settles by itself: solve.settle_rev and duration_rev, body and sensor of
    CONFIG do not count here. A table for each machine goes to stdout, a figure and one Dataset into
    follow/ of the folder; what was interrupted goes on from there.
    """
    screen.one_thread_each()  # before numpy loads
    from compressor.report import render, title_figure
    from compressor.store import publish
    from compressor.studies.follow.figure import draw_followed, table
    from compressor.studies.follow.follow import follow as run_chains
    from compressor.studies.follow.follow import load_values, read_over
    from compressor.studies.follow.motion import HowLong
    from compressor.sweep import cores

    along = read_over(over, log=log, both=both, how=HowLong(points, not no_exponent))
    with ProgressReporter(quiet, "cases read") as progress:
        study = load_values(config, along, overrides, max_jobs, only, progress)
    if not quiet:
        screen.caution([study])
    began = time.monotonic()
    with ProgressReporter(quiet, "values", folder=folder) as progress:
        found = run_chains(study, along, folder, jobs or cores(), progress, rerun)
    data, drawn = found.data, 0
    for number in range(data.sizes["job"]):
        machine = data.isel(job=number)
        is_ok = (machine["status"] == "ok").any()
        if (machine["status"] == "missing").all():
            continue
        where = [f"{name} {machine[name].item()}" for name in data.coords
                 if data[name].dims == ("job",)]  # fmt: skip
        if where:
            screen.print_text(", ".join(where))
        screen.print_text("\n".join(table(machine)))
        if is_ok and drawn < MAX_DRAWN:
            path = found.path.with_name(f"{found.path.stem}-{number + 1}.png")
            title = title_figure(study.title or study.name, "motion", where)
            publish(path, render(draw_followed(machine, title), "png"))
            screen.print_text(str(path))
            drawn += 1
    screen.print_text(str(found.path))
    if not quiet:
        new = found.total - found.done_before
        done = f"{plural(new, 'value')} run in {duration(time.monotonic() - began)}"
        done += screen.stored_before(found.done_before)
        screen.say(done if new else screen.all_stored(found.total, folder, "value"))
    return report_failures(data)


def report_failures(data: "xr.Dataset") -> int:
    """Write why values failed, and what to do; return the exit code."""
    from compressor.reasons import remedy

    failed = data["status"].values == "failed"
    if not failed.any():
        return screen.DONE
    over, reasons = data.attrs["over"], data["reason"].values[failed].tolist()
    places = zip(*failed.nonzero(), reasons, data["detail"].values[failed].tolist(), strict=True)
    for job, way, at, reason, detail in itertools.islice(places, MAX_FAILURES):
        where = f"job {job + 1} {data['direction'].values[way]} at {data[over].values[at]:g}"
        screen.say_wrapped(f"{where}: {reason}: {printable(detail)}", 2)
    if len(reasons) > MAX_FAILURES:
        screen.say(f"  and {len(reasons) - MAX_FAILURES} more")
    for reason, count in Counter(reasons).items():
        screen.say_wrapped(f"{reason} ({count}): {remedy(reason)}; then: --rerun", 2)
    return screen.SOME_FAILED
