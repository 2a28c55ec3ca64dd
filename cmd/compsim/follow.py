"""`compsim follow`: the motion of machines along a key, value after value."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    import xarray as xr

MAX_DRAWN = 12  # machines that get a figure


@click.command()
@options.config
@click.option(
    "--over", required=True, metavar="KEY=LOW:HIGH:N", help="Follow over N values of this key."
)
@click.option("--both", is_flag=True, help="Follow down from HIGH, too, and compare.")
@click.option("--log", is_flag=True, help="Space values with even ratios.")
@click.option(
    "--points",
    type=click.IntRange(6, 10_000),
    default=64,
    help="Take so many Poincaré points of a motion that does not repeat.",
)
@click.option(
    "--no-exponent",
    is_flag=True,
    help="Leave out Lyapunov exponents; nothing is called chaotic then.",
)
@click.option("--rerun", is_flag=True, help="Run again from the first failed value on.")
@options.results
@options.jobs()
@options.set_keys
@options.only
@options.max_jobs
@options.quiet
def follow(config, over, both, log, points, no_exponent, rerun, folder, jobs, quiet, **how) -> int:
    """Follow a motion along a key: periods, chaos, bistability.

    \b
    compsim follow light.yaml --over clearance_mm=0.01:1:80 --log --both
    compsim follow worn.yaml --over machine.speed_rpm=300:900:60

    Each run starts from the end of the run before, so that a motion is followed as long as it
    exists. Each combination of the other swept keys of CONFIG is a machine, followed by itself.
    Each value settles: solve.settle_rev and duration_rev, body and sensor of CONFIG are not used.
    Prints a table for each machine; writes figures and a Dataset into follow/ of the folder of
    results. The same command continues what was interrupted.
    """
    from compressor.report import title_figure, write_figure
    from compressor.studies.follow.figure import draw_followed, table
    from compressor.studies.follow.follow import follow as run_chains
    from compressor.studies.follow.follow import load_values, read_over
    from compressor.sweep import cores

    along = read_over(over, log=log, both=both, points=points, exponent=not no_exponent)
    with ProgressReporter(quiet, "cases read") as progress:
        study = load_values(config, along, progress=progress, **how)
    if not quiet:
        screen.caution([study])
    with ProgressReporter(quiet, "values", folder=folder) as progress:
        found = run_chains(study, along, folder, jobs or cores(), progress, rerun)
    data, drawn = found.data, 0
    of_job = [name for name in data.coords if data[name].dims == ("job",)]
    for number in range(data.sizes["job"]):
        machine = data.isel(job=number)
        where = [f"{name} {machine[name].item()}" for name in of_job]
        screen.print_text(*([", ".join(where)] if where else []), *table(machine))
        if (machine["status"] == "ok").any() and drawn < MAX_DRAWN:
            path = found.path.with_name(f"{found.path.stem}-{number + 1}.png")
            title = title_figure(study.title or study.name, "motion", where)
            screen.print_text(str(write_figure(path, draw_followed(machine, title))))
            drawn += 1
    able = sum((data.isel(job=n)["status"] == "ok").any().item() for n in range(data.sizes["job"]))
    if drawn < able and not quiet:
        screen.say(f"figures are of the first {drawn} of {able} machines")
    screen.print_text(str(found.path))
    if not quiet:
        new = found.total - found.done_before
        screen.say_done(new, found.done_before, progress.seconds, folder, "value")
    failures = [*list_failures(data)]
    if failures:
        screen.say_failures(failures)
        screen.say("--rerun runs again from the first failed value on.")
    return screen.SOME_FAILED if failures else screen.DONE


def list_failures(data: "xr.Dataset") -> Iterator[tuple[str, str, str]]:
    """Yield the place, reason and detail of each value that failed."""
    failed, values = data["status"].values == "failed", data[data.attrs["over"]].values
    for job, way, at in zip(*failed.nonzero(), strict=True):
        one = data.isel(job=job, direction=way)
        where = f"job {job + 1} {one['direction'].item()} at {values[at]:g}"
        yield where, one["reason"].values[at], one["detail"].values[at]
