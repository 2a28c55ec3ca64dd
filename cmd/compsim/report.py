"""`compsim report`: the page, figures and tables of a folder of results."""

import click

from compsim.screen import DONE


@click.command()
@click.option("-i", "--input", "results", default="results", show_default=True,
              help="Folder of results.")  # fmt: skip
@click.option("-o", "--output", default="report", show_default=True, help="Folder of the report.")
@click.option("--claims", default="claims", show_default=True,
              help="Folder of what `compsim claims` judged, if there is one.")  # fmt: skip
@click.pass_context
def report(context: click.Context, results: str, output: str, claims: str) -> int:
    """Draw figures and tables of stored studies; prints the path of the page."""
    from compressor.report import write_report

    click.echo(write_report(results, output, context.obj, claims))
    return DONE
