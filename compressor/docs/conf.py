"""The site: the pages of the tree, where they stand, as `make docs` builds them with Sphinx.

The README is the front page. PAGES says where each other page is found. Nothing of a page is
written for the site: links between files, images and formulas work on a code host as well.
"""

import re
from fnmatch import fnmatch
from importlib.resources import files
from pathlib import Path

from compressor.program import VERSION

ROOT = Path(__file__).parents[2]
FRONT = "README"
COMMANDS = "compressor/docs/commands"  # to which the site adds the help of every command
# by the headings of the contents; a pattern stands for the pages that nobody else names
PAGES = {
    "Begin": (
        "compressor/cases/examples/TUTORIAL",
        "compressor/docs/my-machine",
        "compressor/docs/notebook",
        "compressor/cases/examples/README",
    ),
    "Answers": (
        "compressor/docs/how-sure",
        "compressor/docs/speed-or-accuracy",
        "compressor/docs/extremes",
        "compressor/docs/a-run",
        "compressor/docs/sweeps",
        "compressor/docs/diagnosis",
        "compressor/docs/wear",
        "compressor/docs/regimes",
        "compressor/docs/the-paper",
        "compressor/docs/*",
    ),
    "Look it up": (
        "configs/README",
        COMMANDS,
        "compressor/API",
        "compressor/docs/glossary",
        "compressor/CHANGELOG",
    ),
    "How it works": (
        "compressor/physics/README",
        "compressor/solve/README",
        "compressor/store/README",
        "compressor/sweep/README",
        "compressor/*",
        "tests/README",
    ),
    "How we know": ("tests/results/README", "tests/results/*"),
}


def contents(known: set[str]) -> dict[str, list[str]]:
    """Return the pages under each heading; known: all pages there are, without `.md`."""
    named = {one for pages in PAGES.values() for one in pages}
    found = {
        heading: [
            page
            for one in pages
            for page in ([one] if "*" not in one else sorted(known - named))
            if page in known and fnmatch(page, one) and page.count("/") == one.count("/")
        ]
        for heading, pages in PAGES.items()
    }
    return {heading: pages for heading, pages in found.items() if pages}


def read_pages() -> set[str]:
    """Return the pages in the folders that PAGES names, without `.md`."""
    folders = {Path(one).parent for pages in PAGES.values() for one in pages}
    return {
        path.relative_to(ROOT).with_suffix("").as_posix()
        for folder in folders
        for path in (ROOT / folder).glob("*.md")
    }


CONTENTS = contents(read_pages())
# a block of commands without prompts, whose words would be coloured as what a command prints
COMMAND_LINES = re.compile(r"^```console(\n(?!\$)(?:(?!```).*\n)*```$)", re.MULTILINE)
CLICK = """
## All options

```{eval-rst}
.. click:: compsim.cli:cli
   :prog: compsim
   :nested: full
```
"""

project = "compsim"
version = release = VERSION
root_doc = FRONT
include_patterns = [
    f"{page}.md" for page in (FRONT, *(one for found in CONTENTS.values() for one in found))
]
exclude_patterns = [".*", "build", "dist", "site", "results", "report"]  # not searched for pages
extensions = ["myst_parser", "sphinx_click"]
myst_enable_extensions = ["dollarmath", "html_image"]
myst_dmath_allow_digits = myst_dmath_allow_space = False  # as on a code host
myst_fence_as_directive = ["math"]
myst_heading_anchors = 6
smartquotes = False  # -- is an option
html_theme = "furo"
html_title = f"compsim {VERSION}"
html_copy_source = html_show_sourcelink = html_use_index = False
html_show_copyright = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
pygments_style, pygments_dark_style = "tango", "github-dark"


def add_contents(app, page, source):
    """Add the contents to the front page, and the help of every command to its page."""
    source[0] = COMMAND_LINES.sub(r"```bash\1", source[0])
    if page == FRONT:
        for heading, pages in CONTENTS.items():
            listed = "\n".join(f"/{one}" for one in pages)
            source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {heading}\n\n{listed}\n```\n"
    if page == COMMANDS:
        source[0] += CLICK


def show_blocks(app, context, lines):
    """Make what a command's help does not wrap, its examples and tables, a block of code."""

    def block(found):
        language = "bash" if "compsim " in found[0] else "text"
        inside = re.sub("^[|] ", "   ", found[0], flags=re.MULTILINE)
        return f"\n.. code-block:: {language}\n\n{inside}\n"

    text = re.sub(r"(?:^\| .*\n)+", block, "\n".join([*lines, ""]), flags=re.MULTILINE)
    lines[:] = text.splitlines()


def add_font(app, config):
    """Add a font for formulas, whose indices are placed badly without one."""
    config.html_static_path.append(str(files("ziamath.fonts") / "STIXTwoMath-Regular.ttf"))


def write_formula(display):
    """Return the visitor that writes a formula as MathML, which browsers draw by themselves."""

    def visit(writer, node):
        from docutils.nodes import SkipNode
        from latex2mathml.converter import convert
        from sphinx.util.logging import getLogger

        drawn = convert(node.astext().replace("{aligned}", "{split}"), display=display)
        if "\\" in drawn or "&</mi>" in drawn:
            getLogger(__name__).warning("not drawn: %s", node.astext(), location=node)
        block = display == "block"  # scrolls by itself where it is wider than a phone
        writer.body.append(f'<div class="formula">{drawn}</div>' if block else drawn)
        raise SkipNode

    return visit, None


def write_index(app, error):
    """Let the folder's own page lead to the front page."""
    page = f'<!doctype html><meta http-equiv="refresh" content="0; url={FRONT}.html">\n'
    if not error:
        (Path(app.outdir) / "index.html").write_text(page, encoding="utf-8")


def show_defaults():
    """Let options say their defaults, which sphinx-click does not take from the group."""
    from click import Option
    from compsim.cli import cli

    for option in (one for verb in cli.commands.values() for one in verb.params):
        if isinstance(option, Option) and not option.is_flag and option.show_default is None:
            option.show_default = isinstance(option.default, str | int | float)


def setup(app):
    """Connect the above with Sphinx."""
    show_defaults()
    app.connect("config-inited", add_font)
    app.connect("source-read", add_contents)
    app.connect("sphinx-click-process-description", show_blocks)
    app.connect("build-finished", write_index)
    app.add_html_math_renderer("mathml", write_formula("inline"), write_formula("block"))
