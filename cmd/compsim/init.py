"""`compsim init`: a commented case file to start from."""

import os
from pathlib import Path

import click

from compressor.program import did_you_mean
from compsim import options, screen


@click.command()
@click.argument("template", required=False)
@options.output(
    "Write this file, or into this folder; TEMPLATE.yaml by default.", type=options.FILE
)
def init(template, output) -> int:
    """Write a commented case file to start from.

    \b
    compsim init machine -o pump-house-2.yaml

    Its first lines say what it answers, how many jobs it has and how long they take. Without
    TEMPLATE, the templates are listed. A file that exists is never overwritten.
    """
    from compressor.cases import table, templates
    from compressor.store import writable_folder

    known = templates()
    if template is None:
        indent = max(map(len, known)) + 2
        for one in known.values():
            lines = [*screen.wrap_line(one.question, indent), *screen.wrap_line(one.jobs, indent)]
            screen.print_text(f"{one.name:<{indent}}{lines[0].lstrip()}", *lines[1:])
        screen.say("next: compsim init wear")
        return screen.DONE
    if template not in known:
        near = did_you_mean(template, known) or f"there are {', '.join(known)}"
        raise click.UsageError(f"there is no template {template!r}; {near}")
    made = known[template]
    path = Path(output or made.path.name)
    path = path / made.path.name if path.is_dir() else path
    if table()["name"].check(path.stem):
        problem = "gives the study no name: use letters, digits, dots, _ and -"
        raise click.UsageError(f"{path.name!r} {problem}")
    if os.path.lexists(path):
        remedy = f"compsim init {template} -o OTHER.yaml"
        raise click.UsageError(f"{path} exists, and is not overwritten: {remedy}")
    writable_folder(path.parent)
    with open(path, "x", encoding="utf-8") as file:
        file.write(made.text(path))
    screen.print_text(str(path))
    screen.say(f"next: {made.commands(path).partition(';')[0]}")
    return screen.DONE
