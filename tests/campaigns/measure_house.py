"""Print the numbers by which the source is compared with that of others.

`measure_house.py [TREE]`: files and lines of each room, of the tests, words of the pages; of
the source its longest function, and what a module imports of its own program.
"""

import ast
import sys
from collections import Counter
from pathlib import Path
from statistics import mean

ROOT = Path(__file__).parents[2]
ROOMS = ("cmd", "compressor", "tests")


def count_own_imports(module: ast.Module) -> int:
    """Return how many names a module imports from the program itself."""
    found = (node for node in ast.walk(module) if isinstance(node, ast.ImportFrom))
    own = (node for node in found if (node.module or "").startswith(("compressor", "compsim")))
    return sum(len(node.names) for node in own)


def house_numbers(tree: Path) -> dict[str, float | str]:
    """Return the numbers of a tree by name."""
    paths = (path for top in ROOMS for path in sorted((tree / top).rglob("*.py")))
    texts = {path.relative_to(tree): path.read_text(encoding="utf-8") for path in paths}
    lines = Counter[str]()
    for path, text in texts.items():
        is_room = len(path.parts) > 2 and path.parts[0] == "compressor"
        lines["/".join(path.parts[: 1 + is_room])] += text.count("\n")
    source = [ast.parse(text) for path, text in texts.items() if path.parts[0] != "tests"]
    nodes = (node for module in source for node in ast.walk(module))
    functions = (node for node in nodes if isinstance(node, ast.FunctionDef))
    size, longest = max(((one.end_lineno or 0) - one.lineno + 1, one.name) for one in functions)
    pages = (path for path in tree.rglob("*.md") if ".venv" not in path.parts)
    return {
        **{f"lines of {room}": count for room, count in lines.items()},
        "lines of the source": lines.total() - lines["tests"],
        "files of the source": len(source),
        f"lines of the longest function, {longest}": size,
        "own names that a module imports, mean": round(mean(map(count_own_imports, source)), 1),
        "words of the pages": sum(len(path.read_text("utf-8").split()) for path in pages),
    }


if __name__ == "__main__":
    for name, number in house_numbers(Path(sys.argv[1] if sys.argv[1:] else ROOT)).items():
        print(f"{name:<52} {number:>8,}")
