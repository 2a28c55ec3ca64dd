"""`compsim init`: a commented case file to start from."""

import os
from collections.abc import Iterable
from pathlib import Path

import click

from compressor.program import did_you_mean
from compsim import options, screen


@click.command()
@click.argument("template", required=False)
@click.option("-o", "--output", metavar="FILE", type=options.FILE,
              help="Write this file, or into this folder; TEMPLATE.yaml by default.")  # fmt: skip
def init(template: str | None, output: str | None) -> int:
    """Write a commented case file to start from.

    \b
    compsim init machine -o pump-house-2.yaml

    Its first lines say what it answers, how many jobs it has and how long they take. Without
    TEMPLATE, the templates are listed. A file that exists is never overwritten.
    """
    from compressor.cases import templates

    known = templates()
    if template is None:
        indent = max(map(len, known)) + 2
        for one in known.values():
            first, *more = [
                *screen.wrap_line(one.question, indent),
                *screen.wrap_line(one.jobs, indent),
            ]
            screen.print_text("\n".join([f"{one.name:<{indent}}{first.lstrip()}", *more]))
        screen.say("next: compsim init wear")
        return screen.DONE
    if template not in known:
        raise click.UsageError(unknown(template, known), click.get_current_context())
    path = Path(output or known[template].path.name)
    path = path / known[template].path.name if path.is_dir() else path
    write(path, known[template].text(path), template)
    screen.print_text(str(path))
    screen.say(f"next: {known[template].commands(path).partition(';')[0]}")
    return screen.DONE


def unknown(template: str, known: Iterable[str]) -> str:
    """Return the error of a template that there is not."""
    near = did_you_mean(template, known) or f"there are {', '.join(known)}"
    return f"there is no template {template!r}; {near}"


def write(path: Path, text: str, template: str) -> None:
    """Write a new file. Raises UsageError where there is one, WrongName where none may be made."""
    from compressor.cases import table
    from compressor.store import writable_folder

    context = click.get_current_context()
    if table()["name"].check(path.stem):
        problem = f"{path.name!r} gives the study no name: use letters, digits, dots, _ and -"
        raise click.UsageError(problem, context)
    if os.path.lexists(path):
        remedy = f"compsim init {template} -o OTHER.yaml"
        raise click.UsageError(f"{path} exists, and is not overwritten: {remedy}", context)
    writable_folder(path.parent)
    with open(path, "x", encoding="utf-8") as file:
        file.write(text)
