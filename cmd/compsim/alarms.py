"""`compsim alarms`: which alarm sees wear first, joint by joint."""

import re
import shlex
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from compsim import options, screen
from compsim.progress import ProgressReporter
from compsim.records import read_levels

if TYPE_CHECKING:
    from compressor.studies.alarms.readings import Band

FREQUENCIES = re.compile(r"([\d.]+)-([\d.]+)")


def read_bands(
    context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]
) -> "tuple[Band, ...] | None":
    """Return bands of texts such as 1000-3000; None without any."""
    found = []
    for text in texts:
        parts = FREQUENCIES.fullmatch(text)
        try:
            found.append((float(parts[1]), float(parts[2])) if parts else None)
        except ValueError:
            found.append(None)
        if found[-1] is None:
            raise click.BadParameter(f"{text!r} is no band such as 1000-3000, in Hz")
    return tuple(one for one in found if one) or None


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@click.option("-o", "--output", metavar="FOLDER", type=options.FOLDER,
              help="Also write all rates as CSV and netCDF, and figures, here.")  # fmt: skip
@click.option("--wear", "run", metavar="RUN",
              help="Print how many hours before its limit each alarm trips, by this wear run: a "
              "file of compsim wear, or its folder of results.")  # fmt: skip
@click.option("--false-alarms", type=click.FloatRange(0, 1, min_open=True, max_open=True),
              default=0.01, show_default=True,
              help="Set limits for this rate of false alarms.")  # fmt: skip
@click.option("--factor", type=click.FloatRange(0, min_open=True),
              help="Set limits at so many times a sound machine's usual reading.")  # fmt: skip
@click.option("--detected", type=click.FloatRange(0, 1, min_open=True), default=0.9,
              show_default=True,
              help="Count a clearance as detected at this share of windows.")  # fmt: skip
@click.option("--band", "bands", multiple=True, metavar="LOW-HIGH", callback=read_bands,
              show_default="2-1000, and two above it",
              help="Filter the record by this band pass, Hz; repeat it for more.")  # fmt: skip
@click.option("--noise", default="0", show_default=True, callback=read_levels, metavar="RMS,...",
              help="Add white noise of these levels, m/s2 rms, each judged by itself.")  # fmt: skip
@click.option("--revolutions", type=click.IntRange(min=1), default=5, show_default=True,
              help="Cut windows of so many whole revolutions.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True,
              help="Draw by this seed the noise, and which draws judge by which limits.",
)  # fmt: skip
@options.quiet
def alarms(
    study: str, folder: str, output: str | None, run: str | None,
    false_alarms: float, factor: float | None, detected: float, bands: "tuple[Band, ...] | None",
    noise: tuple[float, ...], revolutions: int, seed: int, quiet: bool,
) -> int:  # fmt: skip
    """Find which alarm sees wear first, by joint and clearance.

    \b
    compsim alarms plant --noise 0,1 -o alarms

    STUDY has jobs with a sensor's record, of sound machines and of worn ones. What it varies beside
    joint and clearance, such as load and speed, is a draw. Alarms are peak, rms, crest factor and
    kurtosis of the record, peak and rms of segments of 10 degrees, counts of peaks, and velocity;
    each on the record as it is and behind band passes. Sound jobs set what is usual, and the limit,
    and never judge their own draws. The table lists alarms, the first to see wear on top, each with
    its best filter: the clearance from which on it detects, with an interval, and the false alarms
    that were counted. An interval that ends with "> 0.4" goes beyond the study's greatest
    clearance: its draws are too few to be sure.
    """
    source = click.get_current_context().get_parameter_source("false_alarms")
    if factor is not None and source is ParameterSource.COMMANDLINE:
        raise click.UsageError("--factor and --false-alarms both set limits: give one of them")
    screen.one_thread_each()  # before numpy loads
    from compressor.store import writable_folder
    from compressor.studies.alarms.alarms import judge_alarms
    from compressor.studies.alarms.lead import add_lead_times, open_run
    from compressor.studies.alarms.windows import AlarmOptions
    from compressor.studies.alarms.words import list_lines, list_remarks

    how = AlarmOptions(revolutions, bands, noise, false_alarms, factor, detected, seed)
    worn = open_run(run) if run else None
    if output:
        writable_folder(output, make=False)
    with ProgressReporter(quiet) as progress:
        found = judge_alarms(folder, study, how, progress)
    found = add_lead_times(found, worn) if worn else found
    for line in list_lines(found):
        screen.print_text(line)
    for text in () if quiet else list_remarks(found):
        screen.say_wrapped(text)
    if output:
        from compressor.studies.alarms.figures import write_alarms

        for line in write_alarms(found, output, machine_title(folder, study)):
            screen.print_text(line)
        if not quiet:
            beside = "" if output == "alarms" else f" --alarms {shlex.quote(output)}"
            screen.say(f"next: compsim report -r {shlex.quote(folder)}{beside}")
    return screen.DONE


def machine_title(folder: str, study: str) -> str:
    """Return the title that a stored study's case file gives its machine, else the study's name."""
    from compressor.store import read_studies

    return next((one.title for one in read_studies(folder) if one.name == study), "") or study
