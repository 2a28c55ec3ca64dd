"""`compsim alarms`: which alarm sees wear first, joint by joint."""

import re
import shlex

import click
from click.core import ParameterSource

from compsim import options, screen
from compsim.progress import ProgressReporter

Band = tuple[float, float]
FREQUENCIES = re.compile(r"(\d+\.?\d*)-(\d+\.?\d*)")


def read_bands(_: click.Context, __: click.Parameter, texts: tuple[str, ...]) -> list[Band] | None:
    """Return bands of texts such as 1000-3000; None without any. Raises BadParameter."""
    bands = []
    for text in texts:
        parts = FREQUENCIES.fullmatch(text)
        if parts is None:
            raise click.BadParameter(f"{text!r} is no band such as 1000-3000, in Hz")
        bands.append((float(parts[1]), float(parts[2])))
    return bands or None


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@options.output("Also write all rates as CSV and netCDF, and figures, here.")
@click.option(
    "--wear", "run", metavar="RUN", help="Print hours from each alarm to the limit of a wear run."
)
@click.option("--false-alarms", default=0.01, help="Set limits for this rate of false alarms.")
@click.option("--factor", type=float, help="Set limits at so many times a sound machine's reading.")
@click.option("--detected", default=0.9, help="Call a clearance detected at this share of windows.")
@click.option(
    "--band",
    "bands",
    multiple=True,
    metavar="LOW-HIGH",
    callback=read_bands,
    show_default="2-1000, and two above it",
    help="Filter the record by this band pass, Hz; repeat it for more.",
)
@options.noise("Add white noise of these levels, m/s2 rms, each judged by itself.")
@click.option("--revolutions", default=5, help="Cut windows of so many whole revolutions.")
@click.option("--seed", type=options.NUMBER, default=1, help="Draw noise and folds by this seed.")
@options.quiet
def alarms(study, folder, output, run, quiet, **how) -> int:
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
    clearance: its draws are too few to be sure. RUN is a file of compsim wear, or its folder of
    results.
    """
    source = click.get_current_context().get_parameter_source("false_alarms")
    if how["factor"] is not None and source is ParameterSource.COMMANDLINE:
        raise click.UsageError("--factor and --false-alarms both set limits: give one of them")
    from compressor.store import read_studies, writable_folder
    from compressor.studies.alarms.alarms import judge_alarms
    from compressor.studies.alarms.lead import add_lead_times, open_run
    from compressor.studies.alarms.windows import AlarmOptions
    from compressor.studies.alarms.words import list_alarms, list_remarks

    options = AlarmOptions(**how)
    worn = open_run(run) if run else None
    if output:
        writable_folder(output, make=False)
    with ProgressReporter(quiet) as progress:
        found = judge_alarms(folder, study, options, progress)
    found = add_lead_times(found, worn) if worn else found
    screen.print_text(*list_alarms(found))
    for text in () if quiet else list_remarks(found):
        screen.say_wrapped(text)
    if output:
        from compressor.studies.alarms.figures import write_alarms

        titles = [one.title for one in read_studies(folder) if one.name == study]
        screen.print_text(*write_alarms(found, output, "".join(titles) or study))
        if not quiet:
            beside = "" if output == "alarms" else f" --alarms {shlex.quote(output)}"
            screen.say(f"next: compsim report -r {shlex.quote(folder)}{beside}")
    return screen.DONE
