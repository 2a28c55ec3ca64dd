"""`compsim report`: the page, figures and tables of a folder of results."""

from collections.abc import Callable
from typing import Any

import click

from compressor.studies import STUDIES, page_additions
from compsim.results import folders, of_results, results_folder
from compsim.screen import (
    DONE,
    print_text,
)


def page_folders(command: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command with an option for each study whose own folder adds to the page."""
    for kind in STUDIES:
        if kind.page_folder:
            text = f"Folder of what `compsim {kind.name}` wrote, if there is one."
            command = click.option(
                f"--{kind.page_folder}", default=kind.page_folder, show_default=True,
                shell_complete=folders, help=text,
            )(command)  # fmt: skip
    return command


@click.command()
@of_results()
@click.option("-o", "--output", default="report", show_default=True, shell_complete=folders,
              help="Folder of the report.")  # fmt: skip
@click.option(
    "--limit", "limits", multiple=True, metavar="NAME=VALUE,...",
    help="Up to three limits of a metric, such as body_velocity_rms_mm_per_s=2,5: tables and "
    "curves show its zones A to D.",
)  # fmt: skip
@page_folders
@click.pass_context
def report(
    context: click.Context,
    given: tuple[str, ...],
    folder: str | None,
    output: str,
    limits: tuple[str, ...],
    **places: str,
) -> int:
    """Draw figures and tables of stored studies; prints the path of the page."""
    folder, _ = results_folder(given, folder, named=False)
    from compressor.store import read_studies, writable_folder

    read_studies(folder)  # errors come before libraries load and figures are drawn
    writable_folder(output, make=False)
    from compressor.report import write_report

    add = page_additions(places)
    print_text(str(write_report(folder, output, context.obj, add, None, limits)))
    return DONE
