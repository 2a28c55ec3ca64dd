"""`compsim report`: the page, figures and tables of a folder of results."""

import os

import click

from compsim import options, screen


@click.command()
@click.argument("names", nargs=-1, metavar="[STUDY]...")
@options.results
@options.output("Write the report into this folder.", default="report")
@click.option("--single", is_flag=True, help="Write one file that can be mailed: OUTPUT.html.")
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="'METRIC=VALUE,... UNIT'",
    help="Show the zones A to D of a metric in tables and curves, by up to three limits with their "
    "unit, such as 'sensor_peak=0.5,2 g'.",
)
@options.units("kN, mm, µm, m/s²")
@click.pass_obj
def report(command, names, folder, output, single, limits, units) -> int:
    """Draw stored studies as a page of figures and tables.

    \b
    compsim report
    compsim report bearing-wear --single -o for-the-plant
    compsim report -r /data/results -o page --limit 'body_velocity_rms=2,5 mm/s'

    Prints the path of the page, which a browser opens without a server. It has the named studies in
    this order, or all of them, those of compsim find and calibrate last. --units applies to figures
    and tables, but not to columns and axes with the name of a key.
    """
    from compressor.store import read_studies, writable_folder

    read_studies(folder)  # errors come before libraries load and figures are drawn
    if single and not output.endswith(".html"):
        output += ".html"
    writable_folder((os.path.dirname(output) or ".") if single else output, make=False)
    from compressor.report import write_report

    path = write_report(folder, output, command, limits, units or "usual", names, single)
    screen.print_text(str(path))
    if single:
        screen.say(f"{screen.size(path.stat().st_size)}, all in one file")
    return screen.DONE
