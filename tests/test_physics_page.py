"""The page of the model: its drawing, its symbols by the program's names, and its formulas."""

import re
import xml.etree.ElementTree as ElementTree

import page_tables

from compressor.cases.table import parts_by_key, table
from compressor.metrics import SERIES
from compressor.physics.record import RECORD

FOLDER = page_tables.ROOT / "compressor" / "physics"
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
SYMBOLS = re.findall(r"^\|([^|]*\$[^|]*)\|[^|]*\|[^|]*\|([^|]*)\|([^|]*)\|$", PAGE, re.MULTILINE)
BLOCKS = re.findall(r"^```math\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
INLINE = re.findall(r"(?<![\\$`])\$([^$\n]+)\$", re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL))


def test_the_drawing_names_what_the_page_names():
    root = ElementTree.parse(FOLDER / "mechanism.svg").getroot()
    drawn = {"".join(one.itertext()) for one in root.iter("{http://www.w3.org/2000/svg}text")}
    names = {"R", "L", "θ", "φ", "x", "e", "n", "t", "δ", "c", "Rb", "Rj", "Fp", "ω", "a", "b"}
    assert names | {"big end", "small end", "crosshead", "guide"} <= drawn
    assert "](mechanism.svg)" in PAGE
    css = root.find("{http://www.w3.org/2000/svg}style").text
    assert "prefers-color-scheme: dark" in css


def test_symbols_are_named_as_in_the_program():
    assert len(SYMBOLS) > 20
    keys = {name.partition(".")[0] for name in table()} | {*table(), *parts_by_key()}
    keys |= {name.rpartition(".")[2] for name in table()}
    for _, key, name in SYMBOLS:
        assert {*re.findall(r"`([\w.]+)`", key)} <= keys, key
        known = {*RECORD.names, *SERIES, "crank_angle"}
        assert {*re.findall(r"`(\w+)`", name)} <= known, name


def is_whole(formula):
    """Return whether a renderer can read a formula, as far as braces and environments say."""
    return (
        formula.count("{") == formula.count("}")
        and formula.count(r"\left") == formula.count(r"\right")
        and re.findall(r"\\begin\{(\w+)", formula) == re.findall(r"\\end\{(\w+)", formula)
    )


def test_formulas_are_whole():
    """A code host drops a backslash before a sign in them; a bar would end the cell of a table."""
    assert len(BLOCKS) > 15
    assert [one for one in (*BLOCKS, *INLINE) if not is_whole(one)] == []
    assert [one for one in INLINE if one != one.strip() or re.search(r"\\[^a-zA-Z]|\|", one)] == []
    # the site's parser takes a cell's last sign for the one before its first
    cells = re.findall(r"(?<=\| )\$[^|\n]*(?= \|)", PAGE)
    assert [cell for cell in cells if cell[-1].isdigit()] == []
