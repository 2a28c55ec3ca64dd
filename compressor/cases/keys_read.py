"""Which keys of case files any of their jobs reads (`compressor.cases.unread` has the rule)."""

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from compressor.cases.keys import Leaves
from compressor.cases.parameter import CaseError
from compressor.cases.readers import Reader
from compressor.cases.shorthands import SHORTHANDS, row_of
from compressor.cases.study import Cases
from compressor.cases.table import WORDS
from compressor.cases.unread import conditions, is_off, problem_of
from compressor.cases.yaml_reader import FileProblem, Node, Place

if TYPE_CHECKING:
    from compressor.cases.sheet import Sheet

Variants = Callable[[Any], Iterable[Any]]  # of a case: the cases that are run for it


def itself(case: Any) -> Iterable[Any]:
    """Return the cases that are run for a case: itself."""
    return (case,)


@dataclass
class KeysRead:
    """The keys that files give, by place, and which of them any job reads.

    A key that stands in a file once may be given for several blocks, and one of the command line
    for several files: it is enough that one job reads it.
    """

    variants: Variants = itself
    read: set[tuple[Place, str]] = field(default_factory=set)
    unread: dict[tuple[Place, str], FileProblem] = field(default_factory=dict)

    def note(self, cases: Cases) -> None:
        """Note which keys of its blocks the cases of a study read, unless they cannot be built."""
        with contextlib.suppress(CaseError):  # which is told elsewhere
            for sheet in cases.sheets:
                self._note(cases.block_of(int(sheet.numbers[0])).leaves, sheet)

    def _note(self, leaves: Leaves, sheet: "Sheet") -> None:
        for key, node in leaves.values.items():
            group = key.partition(".")[0]
            where = node.key_place, group if group in SHORTHANDS else key
            if where in self.read or not (row_of(key) or key in WORDS) or is_off(key, node.value):
                continue
            missing = self._missing(key, sheet)
            if missing is None:
                self.read.add(where)
                self.unread.pop(where, None)
            elif where not in self.unread:
                unread = problem_of(*missing)
                place = _place_of(unread.key, node, leaves)
                self.unread[where] = FileProblem(place, unread.key, unread.message)

    def _missing(self, key: str, sheet: "Sheet") -> tuple[str, Reader] | None:
        """Return the condition that keeps a sheet's jobs from reading a key; None if one reads."""
        needed = conditions(key)

        def holds(several: Iterable[tuple[str, Reader]]) -> bool:
            return sheet.has(
                lambda case: any(
                    all(r.reads(one) for _, r in several) for one in self.variants(case)
                )
            )

        if holds(needed):
            return None
        return next((one for one in needed if not holds([one])), needed[-1])


def _place_of(key: str, node: Node, leaves: Leaves) -> Place:
    """Return where an unread key or group stands: a group, in the file that the key is of."""
    place = leaves.places.get(key, node.key_place)
    return place if place.file == node.key_place.file else node.key_place
