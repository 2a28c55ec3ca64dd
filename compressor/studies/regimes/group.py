"""The `regimes` of a case file: one machine followed along a parameter, value after value.

Each value's run starts from the end of the last one's. What a file says is read and checked here;
the key that is followed stands in the file's own cases at its first value.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar

from compressor.cases import (
    OF_JOINTS,
    SHORTHANDS,
    Case,
    FileProblem,
    Leaves,
    Node,
    Parameter,
    Place,
    StudyRequest,
    between,
    covers,
    quote_value,
    row_of,
    suggestion,
    table,
)
from compressor.metrics import JOINTS

GROUP = "regimes"
DIRECTIONS = {"up": ("up",), "down": ("down",), "both": ("up", "down")}
# groups whose values are not followed: of the run and its start, or of what the machine shakes
NOT_FOLLOWED = ("solve", "output", "body", "sensor", "initial_offset_mm")
# keys that have no meaning where runs follow on each other, and why
WITHOUT_MEANING = {
    "solve.duration_rev": "settle_rev and measure_rev of regimes say how long a value runs",
    "solve.duration_s": "settle_rev and measure_rev of regimes say how long a value runs",
    "solve.settle_rev": "settle_rev of regimes says how much is dropped at each value",
    "body": "regimes follow the machine alone",
    "sensor": "regimes follow the machine alone",
}


def _not_followed(key: Any) -> str | None:
    """Return why a key cannot be followed, or None."""
    row = row_of(key) if isinstance(key, str) else None
    if row is None:
        hint = suggestion(key, "") if isinstance(key, str) else ""
        return f"{quote_value(key)} is no key of a number, such as clearance_mm{hint}"
    if row.kind != "number":
        return f"{key} is no number: give a key such as clearance_mm or machine.speed_rpm"
    if key.partition(".")[0] in NOT_FOLLOWED:
        return f"{key} is nothing of the machine: give a key such as clearance_mm"
    return None


def _row(
    name: str, default: Any, kind: str, span: tuple[float, float], phrase: str,
    words: tuple[str, ...] = (),
) -> Parameter:  # fmt: skip
    return Parameter(f"{GROUP}.{name}", "", default, *span, False, "program", phrase, kind, words)


FOLLOWED = tuple(key for key in (*SHORTHANDS, *table()) if _not_followed(key) is None)
ABOUT = "one machine followed along a key; each value starts from the end of the last one"
NEEDED = ("over", "from", "to", "n")
ROWS = {
    row.key.rpartition(".")[2]: row
    for row in (
        _row("over", None, "choice", (0, 0), "the key that is followed", FOLLOWED),
        _row("from", None, "number", (-1e300, 1e300), "its least value"),
        _row("to", None, "number", (-1e300, 1e300), "its greatest value"),
        _row("n", None, "integer", (2, 100_000), "how many values"),
        _row("log", False, "boolean", (0, 0), "values with even ratios"),
        _row("direction", "up", "choice", (0, 0), "which way the values are followed",
             tuple(DIRECTIONS)),
        _row("section_deg", 0.0, "number", (0, 359.999), "crank angle of Poincaré points"),
        _row("settle_rev", 50, "integer", (3, 10_000), "most revolutions dropped at each value"),
        _row("measure_rev", 64, "integer", (6, 10_000), "Poincaré points of a motion that does not "
             "repeat itself"),
        _row("exponent", True, "boolean", (0, 0), "the largest Lyapunov exponent of each value"),
    )
}  # fmt: skip


@dataclass(frozen=True)
class Regimes:
    """What is followed, and how: `over` from `first` to `last`, in the case file's unit.

    `direction`: up, down or both; `section_deg`: crank angle of the Poincaré points;
    `settle_rev`: most revolutions dropped at each value; `measure_rev`: Poincaré points of a motion
    that does not repeat itself; `exponent`: whether the largest Lyapunov exponent is looked for.
    """

    over: str
    first: float
    last: float
    n: int
    log: bool = False
    direction: str = "up"
    section_deg: float = 0.0
    settle_rev: int = 50
    measure_rev: int = 64
    exponent: bool = True
    group: ClassVar[str] = GROUP

    @property
    def values(self) -> list[float]:
        """Return the values of the key, going up."""
        word, ends = "logspace" if self.log else "linspace", (self.first, self.last)
        first, last = (Fraction(str(end)) for end in ends)
        return between(word, first, last, self.n)()

    @property
    def directions(self) -> tuple[str, ...]:
        """Return the ways that it is followed, each a chain."""
        return DIRECTIONS[self.direction]

    @property
    def unit(self) -> str:
        """Return the unit of `over` in a case file."""
        row = row_of(self.over)
        return row.unit if row else ""

    def plain(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)

    def at_first(self, leaves: Leaves, problems: list[FileProblem]) -> Leaves:
        """Return a block's leaves with the key that is followed at its first value.

        A key that has no meaning here, or sets what is followed, is a problem.
        """
        for key, node in leaves.values.items():
            if covers(self.over, key) or covers(key, self.over):
                start = f"{self.over} goes from {self.first:g} on"
                message = f"is what regimes follows: leave it out, {start}"
                problems.append(FileProblem(node.key_place, key, message))
            for other, why in WITHOUT_MEANING.items():
                if covers(other, key):
                    message = f"has no meaning beside regimes: leave it out; {why}"
                    problems.append(FileProblem(node.key_place, key, message))
        place = leaves.places.get(f"{GROUP}.over", Place(""))
        values = leaves.values | {self.over: Node(self.first, place, place)}
        return Leaves(values, leaves.places)

    def at_last(self) -> "Regimes":
        """Return the request that begins at the last value."""
        return replace(self, first=self.last)

    def follow(self, chosen: Mapping[str, Node]) -> Iterable[dict[str, Node]]:
        """Yield a combination of a file's values at each value of the key, going up."""
        if at := chosen.get(self.over):  # an ideal machine has no clearance
            for value in self.values:
                yield {**chosen, self.over: Node(value, at.place, at.key_place)}

    def objection(self, cases: tuple[Case, ...]) -> str:
        """Return why the cases of a chain cannot be followed, or ""."""
        worn = {tuple(getattr(case.clearance_mm, joint) > 0 for joint in JOINTS) for case in cases}
        if len(worn) > 1:
            at = f"{self.over} = {self.first:g}"
            return f"starts from {at}, where a joint is ideal: begin above 0"
        if not cases or not any(*worn):
            remedy = f"set joint and {OF_JOINTS[0]}"
            return f"has nothing to follow: no joint of the machine has clearance; {remedy}"
        if cases[0].key == cases[-1].key:
            return f"{self.over} changes nothing in this case: follow another key"
        return ""


def read(leaves: Leaves, problems: list[FileProblem]) -> StudyRequest | None:
    """Return the `regimes` of a file's leaves; None where any of it is a problem."""
    nodes = {
        key.removeprefix(f"{GROUP}."): node
        for key, node in leaves.values.items()
        if key.startswith(f"{GROUP}.")
    }
    if any(problem.key == GROUP for problem in problems):
        return None
    before = len(problems)
    if missing := [name for name in NEEDED if name not in nodes]:
        words = "; write {over: clearance_mm, from: 0.01, to: 1, n: 60}"
        message = f"needs {' and '.join(missing)}{words}"
        problems.append(FileProblem(leaves.places[GROUP], GROUP, message))
    given = {name: _check_value(name, node, problems) for name, node in nodes.items()}
    if len(problems) == before:
        _check_range(given, nodes, problems)
    if len(problems) > before:
        return None
    return Regimes(given.pop("over"), given.pop("from"), given.pop("to"), **given)


def _check_value(name: str, node: Node, problems: list[FileProblem]) -> Any:
    """Return the value of a key of `regimes`; what is wrong with it joins `problems`."""
    value, row = node.plain(), ROWS[name]
    message = _not_followed(value) if name == "over" else row.check(value)
    if message:
        problems.append(FileProblem(node.place, row.key, message))
        return None
    if row.kind == "number":
        return float(value) + 0.0
    return int(value) if row.kind == "integer" else value


def _check_range(
    given: Mapping[str, Any], nodes: Mapping[str, Node], problems: list[FileProblem]
) -> None:
    """Add what is wrong with the ends to `problems`."""
    row, first, last = row_of(given["over"]), given["from"], given["to"]
    for name in ("from", "to"):
        message = row.check(given[name]) if row else None
        if message:
            text = f"of {given['over']}: {message}"
            problems.append(FileProblem(nodes[name].place, f"{GROUP}.{name}", text))
    if first == last:
        message = f"from and to are both {first:g}: give two different ends"
        problems.append(FileProblem(nodes["to"].place, f"{GROUP}.to", message))
    elif first > last:
        message = f"{last:g} is below from, {first:g}: write the lower end first, and direction: "
        problems.append(FileProblem(nodes["to"].place, f"{GROUP}.to", message + "down"))
    elif given.get("log") and first <= 0.0:
        message = "log needs ends above 0"
        problems.append(FileProblem(nodes["from"].place, f"{GROUP}.from", message))
