"""Print the numbers by which the source is compared with that of others.

`measure_house.py [TREE]`: files and lines, what a module imports of its own program, names of
functions by one participle, docstrings that open with a verb, names of classes with several
meanings, comments that have a line of their own, `# fmt: skip`.
"""

import argparse
import ast
import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PARTICIPLES = {
    "told", "kept", "made", "asked", "said", "shown", "drawn", "found", "known", "given", "taken",
    "held", "laid", "lost", "met", "read", "seen", "worn", "left", "built", "cut", "begun", "gone",
    "put", "sent", "written", "chosen", "broken", "driven", "spoken", "bent", "heard", "meant",
}  # fmt: skip
NO_VERBS = {
    "a", "an", "the", "what", "whether", "how", "which", "where", "who", "why", "when", "that",
    "all", "as", "of", "about", "for", "in", "by", "its", "those", "each", "some", "one", "time",
}  # fmt: skip


def modules(tree: Path) -> dict[str, ast.Module]:
    """Return the parsed modules of the program in a tree, by their path."""
    paths = [*(tree / "compressor").rglob("*.py"), *(tree / "cmd").rglob("*.py")]
    return {
        str(path.relative_to(tree)): ast.parse(path.read_text(encoding="utf-8")) for path in paths
    }


def own_imports(module: ast.Module) -> int:
    """Return how many names a module imports from the program itself."""
    return sum(
        len(node.names)
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").split(".")[0] in ("compressor", "compsim")
    )


def is_participle(name: str) -> bool:
    """Return whether a function is named by one participle."""
    return name in PARTICIPLES or bool(re.fullmatch(r"[a-z]{2,}[^e]ed", name))


def opens_with_a_verb(text: str) -> bool:
    """Return whether a docstring opens with a verb in the imperative, as far as words tell."""
    word = re.split(r"\W", text, maxsplit=1)[0]
    return word[:1].isupper() and word.lower() not in NO_VERBS and not word.endswith("s")


def house_numbers(tree: Path) -> dict[str, float]:
    """Return the numbers of a tree by name."""
    found = modules(tree)
    texts = [(tree / name).read_text(encoding="utf-8") for name in found]
    lines = [line.strip() for text in texts for line in text.splitlines()]
    functions = [
        node for one in found.values() for node in one.body if isinstance(node, ast.FunctionDef)
    ]
    every = [
        node for one in found.values() for node in ast.walk(one)
        if isinstance(node, ast.FunctionDef)
    ]  # fmt: skip
    documented = [text for node in every if (text := ast.get_docstring(node))]
    classes = Counter(
        node.name for one in found.values() for node in ast.walk(one)
        if isinstance(node, ast.ClassDef)
    )  # fmt: skip
    imports = [own_imports(one) for one in found.values()]
    named = sum(is_participle(node.name) for node in functions)
    verbs = sum(map(opens_with_a_verb, documented))
    return {
        "files": len(found),
        "lines": len(lines),
        "own names that a module imports, mean": sum(imports) / len(imports),
        "own names that a module imports, most": max(imports),
        "functions named by one participle, %": 100 * named / len(functions),
        "docstrings that open with a verb, %": 100 * verbs / len(documented),
        "class names with several meanings": sum(count > 1 for count in classes.values()),
        "comments with a line of their own, %": (
            100 * sum(line.startswith("#") for line in lines) / len(lines)
        ),
        "# fmt: skip": sum("# fmt: skip" in line for line in lines),
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tree", nargs="*", type=Path, default=[ROOT], help="checkouts to compare")
    columns = [house_numbers(tree) for tree in parser.parse_args().tree]
    for name in columns[0]:
        print(f"{name:<42}", *(f"{one[name]:>10.4g}" for one in columns))
