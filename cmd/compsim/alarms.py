"""`compsim alarms`: which alarm sees wear first, joint by joint."""

import re
from pathlib import Path

import click

from compsim import options, screen
from compsim.progress import ProgressReporter

Band = tuple[float, float]
FREQUENCIES = re.compile(r"(\d+\.?\d*)-(\d+\.?\d*)")
RATE = click.FloatRange(0.0, 1.0, min_open=True, max_open=True)


def read_bands(_: click.Context, __: click.Parameter, texts: tuple[str, ...]) -> list[Band]:
    """Return bands of texts such as 1000-3000. Raises BadParameter."""
    bands = []
    for text in texts:
        parts = FREQUENCIES.fullmatch(text)
        if parts is None or float(parts[1]) >= float(parts[2]):
            raise click.BadParameter(f"{text!r} is no band such as 1000-3000, in Hz")
        bands.append((float(parts[1]), float(parts[2])))
    return list(dict.fromkeys(bands))


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@options.output("Also write all rates as netCDF, and a figure, here.")
@click.option(
    "--wear",
    "run",
    type=options.TEXT,
    metavar="RUN",
    help="Print hours from each alarm to the limit of a wear run.",
)
@click.option(
    "--false-alarms", type=RATE, default=0.01, help="Set limits for this rate of false alarms."
)
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
@options.revolutions
@options.quiet
def alarms(study, folder, output, run, quiet, **how) -> int:
    """Find which alarm sees wear first, by joint and clearance.

    \b
    compsim alarms plant --noise 0,1 -o alarms

    STUDY has jobs with a sensor's record, of sound and of worn machines. Each combination of what
    else it varies, such as load and speed, is a draw. Alarms are peak, rms, crest factor and
    kurtosis of the record, peak and rms of segments of 10 degrees, counts of peaks, and velocity;
    each with and without band passes. Sound jobs set the usual reading and the limit. The table
    lists the alarms, the earliest first, each with its best filter: the limit over the usual
    reading (of counts, over one a revolution at least), the rate of false alarms, counted on sound
    draws that did not set the limit, and the clearance from which on it detects, with 95 %
    intervals. "> 0.4" is beyond the study's greatest clearance. RUN is a file of compsim
    wear, or its folder of results.
    """
    from compressor.digits import align_columns
    from compressor.report import title_figure, write_figure
    from compressor.store import read_studies, writable_folder, write_dataset
    from compressor.studies.alarms.alarms import (
        CAPTION,
        FILE,
        add_hours,
        draw_alarms,
        judge_alarms,
        list_numbers,
        list_rows,
        list_warnings,
        read_wear,
    )

    wear = read_wear(run) if run else None
    if output:
        writable_folder(output, make=False)
    with ProgressReporter(quiet) as progress:
        found = judge_alarms(folder, study, progress=progress, **how)
    found = found if wear is None else add_hours(found, wear)
    screen.print_text(*list_numbers(found), *align_columns(list_rows(found)))
    for text in list_warnings(found):
        screen.say_wrapped(f"warning: {text}")
    if output:
        titles = [one.title for one in read_studies(folder) if one.name == study]
        figure = draw_alarms(found, title_figure("".join(titles) or study, "alarms by clearance"))
        path = write_dataset(Path(output, FILE), found)
        picture = write_figure(Path(output, "alarms.png"), figure)
        screen.print_text(str(path), str(picture), CAPTION)
    return screen.DONE
