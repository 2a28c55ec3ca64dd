"""Case files that are installed with the program, to start from: README.md lists them."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).parent
# those to begin with, in order
STARTS = ("paper", "machine", "wear", "speed-sweep", "sampling", "diagnosis")
NEXT = "next: "


class Template(NamedTuple):
    """A case file to start from: what it answers, what that takes, and the commands that follow."""

    name: str
    path: Path
    question: str
    jobs: str
    next: str

    def commands(self, file: Path) -> str:
        """Return the commands that follow where the template was written to another file."""
        own = rf"(?<!compsim ){re.escape(self.name)}(\.yaml)?\b"
        quoted = shlex.quote(str(file))
        return re.sub(own, lambda found: quoted if found[1] else shlex.quote(file.stem), self.next)

    def text(self, file: Path) -> str:
        """Return its text for another file."""
        written = self.path.read_text(encoding="utf-8")
        return written.replace(f"{NEXT}{self.next}", f"{NEXT}{self.commands(file)}", 1)


def templates() -> dict[str, Template]:
    """Return all templates by name, those to begin with first.

    The first lines of each are comments: the question that it answers, how many jobs that takes,
    and `next:` with commands.
    """
    found = {path.stem: path for path in sorted(FOLDER.glob("*.yaml"))}
    names = [*STARTS, *(name for name in found if name not in STARTS)]
    return {name: Template(name, found[name], *_header(found[name])) for name in names}


def _header(path: Path) -> tuple[str, str, str]:
    """Return the comments at the head of a template: question, jobs, commands."""
    lines = path.read_text(encoding="utf-8").splitlines()
    words = [line.removeprefix("#").strip() for line in lines[:3]]
    return words[0], words[1], words[2].removeprefix(NEXT)
