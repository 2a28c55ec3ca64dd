"""`compsim tradeoff`: what accuracy costs by method and tolerance, and what the terms change."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click
from compsim.results import files, folders
from compsim.screen import (
    DONE,
    Screen,
    print_text,
    say,
    setting,
)

from compressor.studies.tradeoff.model_text import model_lines

if TYPE_CHECKING:
    import xarray as xr

    from compressor.cases import Case


@click.command()
@click.argument("configs", nargs=-1, metavar="[CONFIG...]", shell_complete=files)
@click.option("-o", "--output", default="tradeoff", show_default=True, shell_complete=folders,
              help="Folder of the study.")  # fmt: skip
@click.option("--repeats", type=click.IntRange(min=1), default=3, show_default=True,
              help="Rounds over all points; the best time counts.")  # fmt: skip
@click.option("--budget", type=click.FloatRange(min=0, min_open=True), default=4.0,
              show_default=True, help="Seconds that one point may take.")  # fmt: skip
@setting
@click.option("--quiet", is_flag=True, help="No progress.")
def tradeoff(
    configs: tuple[str, ...],
    output: str,
    repeats: int,
    budget: float,
    overrides: tuple[str, ...],
    quiet: bool,
) -> int:
    """Measure speed against accuracy by method and tolerance, and what the model's features do.

    Every job of the case files, or the paper's three faults at 0.2 mm where there is none (some
    five minutes), by every method at every tolerance. Writes tradeoff.nc and modelling.nc, which
    xarray and h5py read, and the figure tradeoff.png and tradeoff.svg; the fastest methods and
    the effects of the features go to stdout.
    """
    cases = chosen(configs, overrides)
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff.model_choices import trade as feature_trade
    from compressor.studies.tradeoff.work_precision import work_precision

    folder = Path(output)
    writable_folder(folder)  # minutes before it is needed
    screen = Screen(quiet, "points", alike=False)
    try:
        study = work_precision(cases, repeats=repeats, budget=budget, progress=screen)
        write_study(folder, study)
        screen.end()
        screen = Screen(quiet, "changes of the model", alike=False)
        trade = feature_trade(cases, repeats=repeats, progress=screen)
    finally:
        screen.end()
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


def chosen(configs: tuple[str, ...], overrides: tuple[str, ...]) -> "dict[str, Case]":
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
            name = " ".join([study.name, *(plain(value) for value in point.values())])
            if not faulty(case):
                raise click.UsageError(
                    f"{study.path}: {name} has no joint with clearance, so nothing is integrated: "
                    "set joint and clearance_mm"
                )
            cases[name] = case
    return cases


def plain(value: object) -> str:
    """Return a swept value in few characters."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def fastest_lines(study: "xr.Dataset") -> Iterator[str]:
    """Yield the fastest method for each decade of error, and the paper's numerics."""
    from compressor.studies.tradeoff.work_precision import fastest

    width = max(len(name) for name in study["scene"].values)
    yield f"{'scene':<{width}}  {'error below':>11}  {'method':<7} {'rtol':>7}  {'ms':>7}"
    for row in fastest(study):
        yield (
            f"{row['scene']:<{width}}  {row['error_below']:>11.0e}  {row['method']:<7} "
            f"{row['rtol']:>7.0e}  {1e3 * row['seconds']:>7.1f}"
        )
    for name in study["scene"].values:
        one = study.sel(scene=name)
        yield (
            f"{name}: the paper's BDF at 1e-5 takes {one['paper_seconds'].item():.2g} s; error of "
            f"acceleration {one['paper_error_acceleration'].item():.1e}, of its peak on the output "
            f"grid {one['paper_error_peak_acceleration'].item():.1e}"
        )


def trade_lines(trade: "xr.Dataset") -> Iterator[str]:
    """Yield what each change of the model does to each scene; those that do not apply are left
    out.
    """
    from compressor.studies.tradeoff.page import model_table

    for scene in trade["scene"].values:
        yield from model_lines(scene, model_table(trade.sel(scene=scene)), times=True)
        yield ""
    for scene in trade["scene"].values:
        one = trade.sel(scene=scene)
        yield (
            f"{scene}: the series of Eq. 3-4 would misplace the crosshead by "
            f"{one['place_error'].item():.0%} of the clearance, and change the ideal acceleration "
            f"by {one['acceleration_error'].item():.2%}"
        )
