"""`compsim schema`: what editors need to know of case files."""

import click

from compsim import screen


@click.command()
def schema() -> int:
    """Print the JSON Schema of case files, for editors.

    \b
    compsim schema > compsim.schema.json

    After this command an editor with yaml-language-server completes keys, explains them and marks
    mistakes, in files with this first line:

    \b
    # yaml-language-server: $schema=compsim.schema.json
    """
    from compressor.cases import case_schema

    screen.print_json(case_schema())
    return screen.DONE
