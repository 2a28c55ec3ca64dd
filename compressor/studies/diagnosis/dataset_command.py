"""`compsim dataset`: labelled windows of a sensor's records, to learn diagnosis from."""

import json
import os
from typing import TYPE_CHECKING

import click
from compsim.results import of_results, one_word, results_folder, studies
from compsim.screen import (
    DONE,
    Screen,
    print_text,
    say,
    size,
)

if TYPE_CHECKING:
    import xarray as xr


def levels(context: click.Context, parameter: click.Parameter, text: str) -> tuple[float, ...]:
    """Return the numbers of a list with commas."""
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError as error:
        raise click.BadParameter(f"{text!r} is no list such as 0,0.1,1") from error


@click.command()
@of_results("STUDY", studies)
@click.option("-o", "--output", required=True, metavar="FOLDER", help="Folder of the data set.")
@click.option("--revolutions", type=click.IntRange(min=2), default=5, show_default=True,
              help="Whole revolutions of a window.")  # fmt: skip
@click.option("--hop", type=click.IntRange(min=1), show_default="as many",
              help="Revolutions from the begin of a window to that of the next.")  # fmt: skip
@click.option("--noise", default="0", show_default=True, callback=levels, metavar="RMS,...",
              help="White noise that is added, m/s2 rms; features at each level.")  # fmt: skip
@click.option("--test-share", type=click.FloatRange(0, 1, min_open=True, max_open=True),
              default=0.3, show_default=True, help="Machines that are for testing.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True,
              help="Of noise and split.")  # fmt: skip
@click.option("--no-signals", is_flag=True, help="Features and labels, without samples.")
@click.option("--quiet", is_flag=True, help="No progress.")
def dataset(
    given: tuple[str, ...],
    folder: str | None,
    output: str,
    revolutions: int,
    hop: int | None,
    noise: tuple[float, ...],
    test_share: float,
    seed: int,
    no_signals: bool,
    quiet: bool,
) -> int:
    """Make labelled windows of a study's sensor records, with features, split by machine.

    Writes windows.nc, features.parquet and README.md, a card of what was simulated and what is not
    in it, and replaces those of an earlier data set. The study needs a body and a sensor.
    """
    folder, words = results_folder(given, folder)
    study = one_word(words, "STUDY")
    from compressor.studies.diagnosis.data_files import build_data_set
    from compressor.studies.diagnosis.data_set import DataSetOptions

    options = DataSetOptions(revolutions, hop, noise, test_share, seed, not no_signals)
    screen = Screen(quiet)
    try:
        made, written = build_data_set(folder, study, output, options, screen)
    finally:
        screen.end()
    for line in told(made):
        print_text(line)
    for name, count in written.files.items():
        print_text(f"{os.path.join(output, name)}  {size(count)}")
    if written.remark:
        say(written.remark)
    if not quiet:
        say(f"next: read {os.path.join(output, 'README.md')}, then open windows.nc in xarray")
    return DONE


def told(made: "xr.Dataset") -> list[str]:
    """Return what was made: windows and machines by joint and split, and what was left out."""
    from compressor.studies.diagnosis.data_card import counts

    rows = counts(made)
    width = max(len(joint) for joint, *_ in rows)
    lines = [f"{'joint':<{width}}  {'split':<5}  {'machines':>8}  {'windows':>8}"]
    lines += [f"{j:<{width}}  {s:<5}  {m:>8,}  {w:>8,}" for j, s, m, w in rows]
    alone = [joint for joint, split, machines, _ in rows if split == "test" and not machines]
    if alone:
        lines.append(f"too few machines to test on: {', '.join(alone)}")
    for reason, count in json.loads(made.attrs["left_out"]).items():
        lines.append(f"left out: {count:,} {reason}")
    return lines
