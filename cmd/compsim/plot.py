"""`compsim plot`: figures of one job or of a study, as files."""

import click

from compressor.program import did_you_mean
from compsim import options, screen

OF_JOB = ["analyst", "signals", "cards", "spectra", "orbits"]
OF_STUDY = ["cycles", "waterfall"]
LISTED = f"of a job {', '.join(OF_JOB)}; of a study {', '.join(OF_STUDY)}"


def read_figures(_: click.Context, __: click.Parameter, text: str) -> tuple[str, ...]:
    """Return the names of a list with commas; () for all. Raises BadParameter."""
    names = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    known = [*OF_JOB, *OF_STUDY]
    for name in names:
        if name not in (*known, "all"):
            near = did_you_mean(name, known) or f"there are {', '.join(known)}, or all"
            raise click.BadParameter(f"there is no figure {name!r}; {near}")
    return () if "all" in names else names


@click.command()
@options.job
@options.results
@click.option(
    "--what",
    default="all",
    callback=read_figures,
    metavar="NAME,...",
    help=f"Draw only these figures: {LISTED}.",
)
@options.output("Write the figures into this folder.", default="plots")
@click.option(
    "--over",
    default="",
    show_default=False,
    metavar="AXIS",
    help="Draw a study's rows over this axis; by default a clearance, else the speed.",
)
@click.option(
    "--at",
    multiple=True,
    metavar="KEY=VALUE",
    help="Draw the jobs with this value of another axis; by default its first.",
)
@options.units("kN, mm, µm, m/s²")
def plot(words, folder, output, units, **chosen) -> int:
    """Draw one job, or one study.

    Prints the files and their captions. A job is named as in compsim show: by the beginning of its
    key, or by its study and values of the study's axes. A study's name alone means the study.

    \b
    compsim plot 3fa9c2
    compsim plot bearing-wear clearance_mm=0.2 machine.rod_mass_kg=3
    compsim plot bearing-wear --over clearance_mm --at machine.rod_mass_kg=3
    compsim plot machines --what cycles

    Of a job: a revolution as an analyst reads it (the sensor's record, or the crosshead's
    acceleration, above the rod load, with reversals, valve events and impacts), its signals over
    crank angle, spectra and orbits, beside the same machine without clearance, and cards
    of the gas in its cylinder. Of a study: vibration over crank angle and order spectra over a
    swept axis. Nothing but what is stored is needed, and the files
    of `gas.indicator` of a job that has any.
    """
    from compressor.report import write_plots
    from compressor.store import writable_folder

    writable_folder(output, make=False)
    for path, caption in write_plots(folder, output, words, units=units or "usual", **chosen):
        screen.print_text(str(path), f"  {caption}")
    return screen.DONE
