"""`compsim plot`: figures of one job or of a study, as files."""

from typing import TYPE_CHECKING

import click

from compressor.program import did_you_mean
from compsim import options, screen

if TYPE_CHECKING:
    from compressor.units import Units

FIGURES = (
    "analyst", "loads", "signals", "cards", "spectra", "orbits", "modes", "impacts",
    "cycles", "segments", "waterfall", "map",
)  # fmt: skip
KINDS = {"png": ("png",), "svg": ("svg",), "both": ("png", "svg")}


def figures(_: click.Context, __: click.Parameter, text: str) -> tuple[str, ...]:
    """Return the names of a list with commas; () for all. Raises BadParameter."""
    names = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    wrong = [name for name in names if name not in (*FIGURES, "all")]
    if wrong:
        near = did_you_mean(wrong[0], FIGURES)
        listed = f"there are {', '.join(FIGURES)}, or all"
        raise click.BadParameter(f"there is no figure {wrong[0]!r}; {near or listed}")
    return () if "all" in names else names


@click.command()
@options.job
@options.results
@click.option(
    "--what", default="all", show_default=True, callback=figures, metavar="NAME,...",
    help="Draw only these figures: of a job analyst, loads, signals, cards, spectra, orbits, "
    "modes, impacts; of a study cycles, segments, waterfall, map.",
)  # fmt: skip
@options.output("plots", "Write the figures into this folder.")
@click.option("--format", "form", type=click.Choice([*KINDS]), default="png", show_default=True,
              help="Write figures as PNG, as SVG, or as both.")  # fmt: skip
@click.option(
    "--over", default="", metavar="AXIS",
    help="Draw a study's rows over this axis; by default a clearance, else the speed.",
)  # fmt: skip
@click.option(
    "--at", multiple=True, metavar="KEY=VALUE",
    help="Draw the jobs with this value of another axis; by default its first.",
)  # fmt: skip
@click.option(
    "--limit", default="", metavar="LIMIT",
    help="Mark segments whose rms is above this: a number and its unit, such as 2g, or as 3x, "
    "times the machine without clearance.",
)  # fmt: skip
@options.units("kN, mm, µm, m/s²")
def plot(
    words: tuple[str, ...],
    what: tuple[str, ...],
    folder: str,
    output: str,
    form: str,
    over: str,
    at: tuple[str, ...],
    limit: str,
    units: "Units | None",
) -> int:
    """Draw one job, or one study.

    Prints the files and their captions. A job is named as in compsim show: by the beginning of its
    key, or by its study and values of the study's axes. A study's name alone means the study.

    \b
    compsim plot 3fa9c2
    compsim plot bearing-wear clearance_mm=0.2 machine.rod_mass_kg=3
    compsim plot bearing-wear --over clearance_mm --at machine.rod_mass_kg=3
    compsim plot machines --what segments --limit 3x

    A job's revolution as an analyst reads it (the sensor's record, or the crosshead's acceleration,
    above the rod load, with reversals, valve events and impacts), its signals over crank angle,
    spectra, orbits, contact modes and impacts, beside the same machine without clearance, and cards
    of the gas in its cylinder; a study's vibration over crank angle, order spectra and contact
    modes over a swept axis. Nothing but what is stored is needed.
    """
    from compressor.store import writable_folder

    writable_folder(output, make=False)
    from compressor.report import PlotChoice, write_plots

    choice = PlotChoice(what, over, at, limit, KINDS[form], units or "usual")
    for found in write_plots(folder, output, words, choice):
        screen.print_text(" ".join(map(str, found.paths)))
        screen.print_text(f"  {found.caption}")
    return screen.DONE
