"""Case files that are installed with the program, to start from: README.md lists them."""

from pathlib import Path

FOLDER = Path(__file__).parent


def example(name: str) -> Path:
    """The path of an example case file, such as `consistent`.

    Raises ValueError, which names all examples, where there is none of this name.
    """
    known = {path.stem: path for path in sorted(FOLDER.glob("*.yaml"))}
    if name not in known:
        raise ValueError(f"no example {name!r}; there are: {', '.join(known)}")
    return known[name]
