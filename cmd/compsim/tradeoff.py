"""`compsim tradeoff`: speed against accuracy, and what features of the model do."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from compsim.explain import model_lines
from compsim.options import FILE, output_option, quiet_option, setting
from compsim.progress import ProgressReporter
from compsim.screen import DONE, print_text, say, wrap_line

if TYPE_CHECKING:
    import xarray as xr

    from compressor.cases import Case


@click.command()
@click.argument("configs", nargs=-1, metavar="[CONFIG...]", type=FILE)
@output_option("tradeoff", "Write the study into this folder.")
@click.option("--repeats", type=click.IntRange(min=1), default=3, show_default=True,
              help="Time all points in so many rounds; the best time counts.")  # fmt: skip
@click.option("--budget", type=click.FloatRange(min=0, min_open=True), default=4.0,
              show_default=True, help="Allow one point so many seconds.")  # fmt: skip
@setting
@quiet_option
def tradeoff(
    configs: tuple[str, ...],
    output: str,
    repeats: int,
    budget: float,
    overrides: tuple[str, ...],
    quiet: bool,
) -> int:
    """Measure speed against accuracy, and what model features do.

    \b
    compsim tradeoff machine.yaml --repeats 1 --budget 1

    Every job of the case files, or the paper's three faults at 0.2 mm where there is none (some
    five minutes), by every method at every tolerance. Writes tradeoff.nc and modelling.nc, which
    xarray and h5py read, and the figure tradeoff.png and tradeoff.svg; the fastest methods and
    the effects of the features go to stdout.
    """
    cases = cases_of_files(configs, overrides)
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff.model_choices import trade as feature_trade
    from compressor.studies.tradeoff.work_precision import work_precision

    folder = Path(output)
    writable_folder(folder)  # minutes before it is needed
    with ProgressReporter(quiet, "points") as progress:
        study = work_precision(cases, repeats=repeats, budget=budget, progress=progress)
        write_study(folder, study)
    with ProgressReporter(quiet, "changes of the model") as progress:
        trade = feature_trade(cases, repeats=repeats, progress=progress)
    write_dataset(folder / "modelling.nc", trade)
    print_text("\n".join([*fastest_lines(study), "", *trade_lines(trade)]))
    if not quiet:
        for name in ("tradeoff.png", "tradeoff.nc", "modelling.nc"):
            say(os.path.join(output, name))
        say("next: compsim explain --models CONFIG does the same for a case, in seconds")
    return DONE


def write_study(folder: Path, study: "xr.Dataset") -> None:
    """Store a study of methods and draw it."""
    from compressor.report import render
    from compressor.store import publish, write_dataset
    from compressor.studies.tradeoff.figures import draw_work_precision

    write_dataset(folder / "tradeoff.nc", study)
    drawing = draw_work_precision(study)
    for kind in ("png", "svg"):
        publish(folder / f"tradeoff.{kind}", render(drawing, kind))


def cases_of_files(configs: tuple[str, ...], overrides: tuple[str, ...]) -> "dict[str, Case]":
    """Return the cases to be studied, by label; each needs a joint with clearance."""
    from compressor.cases import load_studies, points
    from compressor.studies.tradeoff.work_precision import default_cases, faulty

    if not configs:
        if overrides:
            raise click.UsageError("--set changes case files: name one, such as configs/both.yaml")
        return default_cases()
    cases = {}
    for study in load_studies(*configs, overrides=overrides, follow=False):
        for point, case in zip(points(study), study.cases, strict=True):
            name = " ".join([study.name, *(format_swept(value) for value in point.values())])
            if not faulty(case):
                raise click.UsageError(
                    f"{study.path}: {name} has no joint with clearance, so nothing is integrated: "
                    "set joint and clearance_mm"
                )
            cases[name] = case
    return cases


def format_swept(value: object) -> str:
    """Return a swept value in few characters."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def fastest_lines(study: "xr.Dataset") -> Iterator[str]:
    """Yield the fastest method for each decade of error, and the paper's numerics."""
    from compressor.studies.tradeoff.work_precision import fastest

    width = max(len(name) for name in study["scene"].values)
    yield f"{'case':<{width}}  {'error below':>11}  {'method':<7} {'rtol':>7}  {'ms':>7}"
    for row in fastest(study):
        yield (
            f"{row['scene']:<{width}}  {row['error_below']:>11.0e}  {row['method']:<7} "
            f"{row['rtol']:>7.0e}  {1e3 * row['seconds']:>7.1f}"
        )
    for name in study["scene"].values:
        one = study.sel(scene=name)
        yield from wrap_line(
            f"{name}: the paper's BDF at 1e-5 takes {one['paper_seconds'].item():.2g} s; error of "
            f"acceleration {one['paper_error_acceleration'].item():.1e}, of its peak on the output "
            f"grid {one['paper_error_peak_acceleration'].item():.1e}",
            0,
        )


def trade_lines(trade: "xr.Dataset") -> Iterator[str]:
    """Yield the effect of each change of the model on each scene, and its time over the scene's."""
    from compressor.studies.tradeoff.page import model_table

    for scene in trade["scene"].values:
        table = model_table(trade.sel(scene=scene))
        yield from model_lines(scene, table)
        ratios = [f"{row.name} × {row.time_ratio:.2g}" for row in table.rows if row.time_ratio > 0]
        yield from wrap_line(f"times over the case's own: {'; '.join(ratios)}", 0)
        yield ""
    for scene in trade["scene"].values:
        one = trade.sel(scene=scene)
        yield from wrap_line(
            f"{scene}: the series of Eq. 3-4 would misplace the crosshead by "
            f"{one['place_error'].item():.0%} of the clearance, and change the ideal acceleration "
            f"by {one['acceleration_error'].item():.2%}",
            0,
        )
