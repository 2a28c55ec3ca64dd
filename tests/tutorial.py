"""The tutorial as pieces: prose, commands, Python and what they print; and as a notebook.

`make pages` writes the notebook from the page; tests/test_tutorial.py runs it.
"""

import contextlib
import json
import math
import re
import shlex
from typing import NamedTuple

import page_tables
from click.testing import CliRunner
from compsim import cli
from conftest import jobs_here, without_pictures

FOLDER = page_tables.ROOT / "compressor" / "cases" / "examples"
PAGE, NOTEBOOK = FOLDER / "TUTORIAL.md", FOLDER / "TUTORIAL.ipynb"
BLOCK = re.compile(
    r"^```(console|py)\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL
)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.]*\w)")
ANY = "…"  # in a line of output anything, alone any lines
CLOSE = 2e-3  # relative: the last digits of a number differ between machines


class Piece(NamedTuple):
    """A part of the page: prose (`markdown`), or a cell (`console`, `py`) and what it prints."""

    kind: str
    source: str
    output: tuple[str, ...] = ()


def pieces(text: str) -> list[Piece]:
    """The parts of a page in their order."""
    found, place = [], 0
    for block in BLOCK.finditer(text):
        found.append(Piece("markdown", text[place : block.start()].strip()))
        kind, inside, printed = block.groups()
        lines = inside.splitlines()
        if kind == "console":
            commands = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
            output = tuple(line for line in lines if not line.startswith("$ "))
            found.append(Piece(kind, "\n".join(commands), output))
        else:
            found.append(Piece(kind, inside.strip(), tuple((printed or "").splitlines())))
        place = block.end()
    return [*(one for one in found if one.source), Piece("markdown", text[place:].strip())]


def notebook(text: str) -> str:
    """The page as a notebook without outputs: commands are cells of the shell sh."""
    cells = []
    for number, one in enumerate(pieces(text)):
        cell = {"cell_type": "markdown" if one.kind == "markdown" else "code",
                "id": f"piece-{number}", "metadata": {}}  # fmt: skip
        source = one.source.replace(" The same text is a [notebook](TUTORIAL.ipynb).", "")
        if one.kind != "markdown":
            cell |= {"execution_count": None, "outputs": []}
            source = f"%%sh\n{source}" if one.kind == "console" else source
        cells.append(cell | {"source": source.splitlines(keepends=True)})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    made = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(made, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def missing(expected: tuple[str, ...], printed: str) -> str:
    """The first line of an output that was not printed in its place; "" where all were."""
    lines, place, gap = printed.splitlines(), 0, False
    for want in expected:
        if want.strip() == ANY:
            gap = True
            continue
        end = len(lines) if gap else place + 1
        found = next((n for n in range(place, min(end, len(lines))) if alike(want, lines[n])), None)
        if found is None:
            return want
        place, gap = found + 1, False
    return "" if gap or place == len(lines) else f"more is printed: {lines[place]}"


def alike(want: str, line: str) -> bool:
    """Whether a line is the expected one, but for the last digits of its numbers."""
    parts = [re.escape(NUMBER.sub("#", part)) for part in " ".join(want.split()).split(ANY)]
    shape = NUMBER.sub("#", " ".join(line.split()))
    if not re.fullmatch(".*".join(parts), shape):
        return False
    if ANY in want:  # other numbers may stand there
        return True
    numbers = [[float(n) for n in NUMBER.findall(text)] for text in (want, line)]
    after = [text.split("±")[1:] for text in (want, line)]
    bars = {float(n) for texts in after for text in texts for n in NUMBER.findall(text)[:1]}
    return all(
        math.isclose(a, b, rel_tol=CLOSE) or (a in bars and b in bars) or small(a, b)
        for a, b in zip(*numbers, strict=True)
    )


def small(one: float, other: float) -> bool:
    """Whether numbers are nothing but a bound: a share below a millionth of a per cent."""
    return max(abs(one), abs(other)) < 1e-5


def run_command(place, command: str, *more: str) -> str:
    """What a command of a page prints there: of ours, and of cat.

    It runs in this process. Pictures of reports are drawn where figures are tested.
    """
    name, *words = shlex.split(command, comments=True)
    words, target = (words[:-2], words[-1]) if ">" in words else (words, "")
    if name == "cat":
        return "".join((place / word).read_text(encoding="utf-8") for word in words)
    assert name == "compsim"
    words = [w for word in words for w in expanded(place, word)]
    isolated = CliRunner().isolation()
    with without_pictures(), jobs_here(), contextlib.chdir(place), isolated as (out, err, _):
        code, said = cli.main([*words, *more]), err.getvalue()
    assert code == 0, f"{command}\n{said.decode()}"
    if target:
        (place / target).write_bytes(out.getvalue())
    return out.getvalue().decode()


def expanded(place, word):
    """What a shell makes of a word."""
    return sorted(map(str, place.glob(word))) if "*" in word else [word]


def main() -> None:
    NOTEBOOK.write_text(notebook(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
