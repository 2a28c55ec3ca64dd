"""The page of the Python interface, compressor/API.md: signatures and first sentences.

`make pages` writes it; tests/test_api_page.py compares, and runs the examples of the docstrings.
"""

import inspect
import re
from functools import cached_property
from pathlib import Path

import compressor

PAGE = Path(__file__).parent.parent / "compressor" / "API.md"
SECTIONS = {package.capitalize(): names for package, names in compressor.HOMES.items()}
SECTIONS["Every package"] = ("CompsimError", "CompsimWarning")
HELP = (
    "`help(compressor.simulate)` and the like show parameters, units, errors and examples. "
    "The fields of a group are the [keys of a case file](../configs/README.md#keys).\n"
)
PROPERTIES = property | cached_property
METHODS = classmethod | staticmethod


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
            known = inspect.isfunction(made) or isinstance(made, PROPERTIES | METHODS)
            if known and not name.startswith("_"):
                yield name, made


def signature(made):
    """Return how a function is called, in one line."""
    made = made.__func__ if isinstance(made, classmethod) else made
    text = str(inspect.signature(made)).replace("'", "").replace("xr.", "xarray.")
    text = re.sub(r"\b(collections\.abc|typing|compressor(\.\w+)+)\.(?=[A-Z])", "", text)
    return re.sub(r"^\((self|cls)(, )?", "(", text)


def entry(name, made):
    """A line for one public name; classes are called with keywords, so they have no signature."""
    called = "" if inspect.isclass(made) else signature(made)
    summary, *_ = inspect.cleandoc(made.__doc__).partition("\n\n")
    return f"- `{name}{called}`: {summary}\n"


def page():
    """The whole page."""
    head, example = inspect.cleandoc(compressor.__doc__).split("\n\n", 1)
    example, rest = re.split(r"\n\n(?=What)", example)
    example = example.replace(">>> import", "```pycon\n>>> import", 1) + "\n```"
    parts = ["<!-- generated from the docstrings by make pages -->", "# The Python interface\n",
             f"{head}\n", f"{example}\n", f"{rest}\n", HELP]  # fmt: skip
    for title, names in SECTIONS.items():
        parts.append(f"## {title}\n")
        parts.append("".join(entry(name, getattr(compressor, name)) for name in names))
        if "Case" in names:
            own = [pair for pair in members(compressor.Case) if not isinstance(pair[1], PROPERTIES)]
            parts.append("`Case` has these methods, and properties that `help` lists:\n")
            parts.append("".join(entry(f"Case.{name}", made) for name, made in own))
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
