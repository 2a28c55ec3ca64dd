"""Run the commands of pages in this process, and compare what they print with what pages say."""

import contextlib
import math
import re
import shlex

from click.testing import CliRunner
from compsim import cli
from conftest import jobs_here, without_pictures

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.]*\w)")
ANY = "…"  # in a line of output anything, alone any lines
CLOSE = 2e-3  # relative: the last digits of a number differ between machines


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
    return all(  # or nothing but a bound: a share below a millionth of a per cent
        math.isclose(a, b, rel_tol=CLOSE) or (a in bars and b in bars) or max(abs(a), abs(b)) < 1e-5
        for a, b in zip(*numbers, strict=True)
    )


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
    drawing = contextlib.nullcontext() if words[0] == "plot" else without_pictures()
    with drawing, jobs_here(), contextlib.chdir(place), isolated as (out, err, _):
        code, said = cli.main([*words, *more]), err.getvalue()
    assert code == 0, f"{command}\n{said.decode()}"
    if target:
        (place / target).write_bytes(out.getvalue())
    return out.getvalue().decode()


def expanded(place, word):
    """What a shell makes of a word."""
    return sorted(map(str, place.glob(word))) if "*" in word else [word]
