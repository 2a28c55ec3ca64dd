"""Bugs to be planted in the sources: as texts, or drawn from the syntax tree by a seed.

A `Mutant` is one file with one change. `drawn` takes the same number of each kind from all changes
that the tree of compressor/physics allows, at most one a statement: those whose identities hash
lowest, so that an edit elsewhere in the sources leaves the draw as it is.
"""

import ast
import copy
import hashlib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PHYSICS = "compressor/physics"
LEFT_OUT = {"__init__.py", "_jit.py"}  # no equations in them
SEED = 2021
# mutants that are not drawn, since no test can run on them: by identity, with the reason
UNLOADABLE = {"rosenbrock.py, module: 3 -> 4 (2)": "a row of the tableau gets a number too few"}
# drawn mutants that change nothing, with the reason: never a place for escapes. Each is tried all
# the same, and the campaign says where a test catches one
EQUIVALENT = {
    "contact_laws.py, solve_rising: rising(middle) < value -> rising(middle) <= value": (
        "where a middle has the value itself, both ends close in on it"
    ),
    "march.py, add_sides: 0.0 -> 1.0 (3)": (
        "where the load is zero at an end, the search closes in on that end and adds nothing"
    ),
    "mechanism_rows.py, beyond_model: deepest > IMPLAUSIBLE * min(p.guide_length, p.guide_height)"
    " -> deepest >= IMPLAUSIBLE * min(p.guide_length, p.guide_height)": (
        "no number of a motion is the limit itself"
    ),
    "step_control.py, first_step: 1e-05 -> 1.0100000000000002e-05 (2)": (
        "from which rate on the first step is guessed by it: every step's error is controlled"
    ),
}

OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
             ast.Pow: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}  # fmt: skip
BOUNDS = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
TURNS = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE, ast.Eq: ast.NotEq,
         ast.NotEq: ast.Eq}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change of one file: bytes from `begin` to `end` become `new`.

    `place`: the function it lies in, or a planted bug's name; `change`: old -> new; `nth`: counts
    changes of a function that are told alike.
    """

    file: str
    place: str
    kind: str
    change: str
    begin: int
    end: int
    new: str
    nth: int = 1

    @property
    def identity(self) -> str:
        """File, place and change: does not depend on where in the file the place is."""
        number = f" ({self.nth})" if self.nth > 1 else ""
        return f"{Path(self.file).name}, {self.place}: {self.change}{number}"

    def source(self, root=ROOT) -> bytes:
        """The file with the change."""
        whole = (root / self.file).read_bytes()
        return whole[: self.begin] + self.new.encode() + whole[self.end :]


def planted(name, file, old, new, root=ROOT) -> Mutant:
    """A bug given by an exact text; LookupError unless that stands in its file exactly once."""
    path = f"compressor/{file}"
    whole = (root / path).read_bytes()
    count = whole.count(old.encode())
    if count != 1:
        raise LookupError(f"{name}: {path} has {old!r} {count} times, not once")
    begin = whole.index(old.encode())
    return Mutant(path, name, "planted", f"{old} -> {new}", begin, begin + len(old.encode()), new)


# ---- the changes that a node of the syntax tree allows


def changed(node, **fields):
    """A copy of a node with other fields."""
    other = copy.copy(node)
    for name, value in fields.items():
        setattr(other, name, value)
    return other


def operators(node):
    """Another operator."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in OPERATORS:
        yield changed(node, op=OPERATORS[type(node.op)]())


def constants(node):
    """A number off by a hundredth, a count off by one."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        off = node.value + 1 if type(node.value) is int else 1.01 * node.value or 1.0
        yield changed(node, value=off)


def comparisons(node):
    """A bound that belongs to the other side, and the opposite comparison."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        for table in (BOUNDS, TURNS):
            if type(node.ops[0]) in table:
                yield changed(node, ops=[table[type(node.ops[0])]()])


def signs(node):
    """A sign that is lost, or a product's that is turned."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield node.operand
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        yield changed(node, left=ast.UnaryOp(ast.USub(), node.left))


def arguments(node):
    """Two neighbouring arguments of a call in the other's place."""
    if isinstance(node, ast.Call):
        for i in range(len(node.args) - 1):
            if ast.unparse(node.args[i]) != ast.unparse(node.args[i + 1]):
                swapped = node.args.copy()
                swapped[i], swapped[i + 1] = swapped[i + 1], swapped[i]
                yield changed(node, args=swapped)


def terms(node):
    """A lost term, factor or addition."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub | ast.Mult):
        yield node.left
    elif isinstance(node, ast.AugAssign):
        yield ast.Pass()


KINDS = {kind.__name__: kind for kind in
         (operators, constants, comparisons, signs, arguments, terms)}  # fmt: skip


# ---- all changes of a file, and the draw


def statements(tree):
    """(place, statement) of every statement that computes something, by function; no docstrings."""

    def walk(node, place):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                yield from walk(child, f"{place}.{child.name}" if place else child.name)
            elif isinstance(child, ast.stmt):
                yield place or "module", child
                yield from walk(child, place)

    return walk(tree, "")


def own_nodes(statement):
    """The nodes of a statement that are not those of a statement inside it."""
    if not isinstance(statement, ast.stmt):
        yield statement
    for child in ast.iter_child_nodes(statement):
        if not isinstance(child, ast.stmt):
            yield from own_nodes(child)


def mutants_of(path, root=ROOT):
    """[(statement's number, Mutant)] of a file, in the order of the text."""
    whole = path.read_bytes()
    lines = [0]
    for line in whole.splitlines(keepends=True):
        lines.append(lines[-1] + len(line))
    seen, found = Counter(), []
    for number, (place, statement) in enumerate(statements(ast.parse(whole))):
        for node in [statement, *own_nodes(statement)]:
            if not hasattr(node, "end_lineno"):
                continue
            begin = lines[node.lineno - 1] + node.col_offset
            end = lines[node.end_lineno - 1] + node.end_col_offset
            for kind, change in KINDS.items():
                for other in change(node):
                    text = ast.unparse(other)
                    told = f"{ast.unparse(node)} -> {text}"
                    seen[place, told] += 1
                    simple = isinstance(other, ast.Constant | ast.stmt)
                    made = Mutant(
                        path.relative_to(root).as_posix(), place, kind, told, begin, end,
                        text if simple else f"({text})", seen[place, told],
                    )  # fmt: skip
                    found.append((number, made))
    return found


def drawn(count, root=ROOT, seed=SEED):
    """`count` mutants of the physics, as many of each kind, at most one a statement."""
    every = [
        (hashlib.sha256(f"{seed} {mutant.identity}".encode()).hexdigest(), number, mutant)
        for path in sorted((root / PHYSICS).glob("*.py"))
        if path.name not in LEFT_OUT
        for number, mutant in mutants_of(path, root)
        if mutant.identity not in UNLOADABLE
    ]
    taken, used = [], set()
    for kind in KINDS:
        left = count // len(KINDS)
        for _, number, mutant in sorted(every, key=lambda entry: entry[:2]):
            if left and mutant.kind == kind and (mutant.file, number) not in used:
                taken.append(mutant)
                used.add((mutant.file, number))
                left -= 1
    return taken
