"""`compsim report`: the page, figures and tables of a folder of results."""

import click

from compsim.results import folders, of_results, results_folder
from compsim.screen import (
    DONE,
    print_text,
)


@click.command()
@of_results()
@click.option("-o", "--output", default="report", show_default=True, shell_complete=folders,
              help="Folder of the report.")  # fmt: skip
@click.option("--claims", default="claims", show_default=True, shell_complete=folders,
              help="Folder of what `compsim claims` judged, if there is one.")  # fmt: skip
@click.pass_context
def report(
    context: click.Context, given: tuple[str, ...], folder: str | None, output: str, claims: str
) -> int:
    """Draw figures and tables of stored studies; prints the path of the page."""
    folder, _ = results_folder(given, folder, named=False)
    from compressor.store import read_studies, writable_folder

    read_studies(folder)  # what is wrong is told before libraries load and figures are drawn
    writable_folder(output, make=False)
    from compressor.report import write_report

    print_text(str(write_report(folder, output, context.obj, claims)))
    return DONE
