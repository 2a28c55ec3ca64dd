"""Print the numbers by which the source is compared with that of others.

`measure_house.py [TREE ...]`: files and lines of each room, of the tests, words of the pages; of
the source its types, its longest function, and what a module imports of its own program.
"""

import argparse
import ast
from collections import Counter
from pathlib import Path
from statistics import mean

ROOT = Path(__file__).parents[2]
ROOMS = ("cmd", "compressor", "tests")


def read_modules(tree: Path) -> dict[Path, str]:
    """Return the text of each module of a tree, by its path from there."""
    paths = (path for top in ROOMS for path in sorted((tree / top).rglob("*.py")))
    return {path.relative_to(tree): path.read_text(encoding="utf-8") for path in paths}


def count_own_imports(module: ast.Module) -> int:
    """Return how many names a module imports from the program itself."""
    return sum(
        len(node.names)
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").split(".")[0] in ("compressor", "compsim")
    )


def house_numbers(tree: Path) -> dict[str, float | str]:
    """Return the numbers of a tree by name."""
    texts = read_modules(tree)
    lines: Counter[str] = Counter()
    for path, text in texts.items():
        inner = path.parts[0] == "compressor" and len(path.parts) > 2
        lines["/".join(path.parts[: 1 + inner])] += text.count("\n")
    source = [ast.parse(text) for path, text in texts.items() if path.parts[0] != "tests"]
    nodes = [node for module in source for node in ast.walk(module)]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    longest = max(functions, key=lambda one: (one.end_lineno or 0) - one.lineno)
    imports = [count_own_imports(module) for module in source]
    pages = [path for path in tree.rglob("*.md") if ".venv" not in path.parts]
    of_source = {room: count for room, count in lines.items() if room != "tests"}
    return {
        **{f"lines of {room}": count for room, count in lines.items()},
        "lines of the source": sum(of_source.values()),
        "files of the source": len(source),
        "types": sum(isinstance(node, ast.ClassDef) for node in nodes),
        f"lines of the longest function, {longest.name}": (
            (longest.end_lineno or 0) - longest.lineno + 1
        ),
        "own names that a module imports, mean": round(mean(imports), 1),
        "own names that a module imports, most": max(imports),
        "words of the pages": sum(len(path.read_text("utf-8").split()) for path in pages),
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tree", nargs="*", type=Path, default=[ROOT], help="checkouts to compare")
    for checkout in parser.parse_args().tree:
        print(checkout)
        for name, number in house_numbers(checkout).items():
            print(f"  {name:<52} {number:>8,}")
