"""The page of the Python interface, compressor/API.md: written from the public docstrings.

`make pages` writes it; tests/test_api_page.py compares, and runs every example.
"""

import inspect
import re
from functools import cached_property
from pathlib import Path

import compressor

PAGE = Path(__file__).parent.parent / "compressor" / "API.md"
SECTIONS = {
    "Cases": ("load_cases", "Case", "PerJoint"),
    "Groups of a case": (
        "Offset", "Machine", "Gas", "Spring", "Contact", "Friction",
        "Lubricant", "Guide", "Drive", "Rod", "Wear", "Body", "Sensor", "Solve", "Output",
    ),
    "Runs": ("simulate",),
    "Results": ("open_study", "read_job"),
    "Errors and warnings": (
        "CompsimError", "CaseError", "CaseFileError", "StoreError", "CompsimWarning",
        "StoreWarning",
    ),
}  # fmt: skip
INTRODUCTION = {
    "Groups of a case": "A field has the name of its key in a case file. Tables, equations and "
    "sections (§) are those of Xiao et al. 2021, *Dynamic Analysis for a Reciprocating Compressor "
    "System with Clearance Fault*; [keys](../configs/README.md#keys) says what *assumed*, "
    "*inferred* and *program* mean."
}


def public():
    """Every documented object by its name as a user writes it: `compressor` and all in it."""
    yield "compressor", compressor
    for names in SECTIONS.values():
        for name in names:
            yield f"compressor.{name}", getattr(compressor, name)
    yield from ((f"compressor.Case.{name}", made) for name, made in members(compressor.Case))


def members(owner):
    """The public methods and properties of a class and its bases, in the order of the sources."""
    for one in owner.__mro__:
        for name, made in vars(one).items():
            known = property | cached_property | classmethod | staticmethod
            if not name.startswith("_") and (inspect.isfunction(made) or isinstance(made, known)):
                yield name, made


def signature(made):
    """How a function is called, as Markdown has it in one line."""
    text = str(inspect.signature(made)).replace("'", "").replace("xr.", "xarray.")
    return re.sub(r"\b(collections\.abc|typing|compressor(\.\w+)+)\.(?=[A-Z])", "", text)


def markdown(text):
    """A docstring: its examples fenced, the pages that it names linked."""
    lines, fenced = [], False
    for line in inspect.cleandoc(text).splitlines():
        if line.startswith(">>>") and not fenced:
            lines.append("```pycon")
            fenced = True
        elif fenced and not line:
            lines.append("```")
            fenced = False
        lines.append(line if fenced else linked(line))
    return "\n".join([*lines, *(["```"] if fenced else [])]) + "\n"


def linked(line):
    """A line with a link in place of each page in backquotes."""
    return re.sub(r"`((?:[a-z]+/)?[A-Za-z-]+\.md)`", lambda page: link(page[1]), line)


def link(page):
    """A page of the repository, seen from ours."""
    up = "" if (PAGE.parent / page).exists() else "../"
    return f"[{page.removesuffix('/README.md')}]({up}{page})"


def summary(made):
    """The first paragraph of a docstring, which is one line."""
    return inspect.cleandoc(made.__doc__).partition("\n\n")[0]


def entry(name):
    """What the page says of one public name."""
    made = getattr(compressor, name)
    called = f"```py\n{name}{signature(made)}\n```\n\n" if inspect.isfunction(made) else ""
    text = f"### {name}\n\n{called}{markdown(made.__doc__)}"
    if made is compressor.Case:
        text += "\n" + "\n".join(member(*found) for found in members(made))
    return text


def member(name, made):
    """What the page says of a method or a property of `Case`."""
    if isinstance(made, property | cached_property):
        function = made.fget if isinstance(made, property) else made.func
        kind = signature(function).partition("-> ")[2]
        return f"#### Case.{name}\n\n```py\nCase.{name}: {kind}\n```\n\n{markdown(made.__doc__)}"
    function = made.__func__ if isinstance(made, classmethod) else made
    called = re.sub(r"^\((self|cls)(, )?", "(", signature(function))
    return f"#### Case.{name}\n\n```py\nCase.{name}{called}\n```\n\n{markdown(function.__doc__)}"


def page():
    """The whole page."""
    rows = [
        f"| [`{name}`](#{name.lower()}) | {summary(getattr(compressor, name))} |"
        for names in SECTIONS.values()
        for name in names
    ]
    parts = [
        "<!-- generated from the docstrings by make pages -->",
        "# The Python interface\n",
        markdown(compressor.__doc__),
        "| name | what it is |\n|---|---|\n" + "\n".join(rows) + "\n",
    ]
    for title, names in SECTIONS.items():
        parts.append(f"## {title}\n")
        if title in INTRODUCTION:
            parts.append(f"{INTRODUCTION[title]}\n")
        parts += [entry(name) for name in names]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
