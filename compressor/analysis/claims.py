"""The paper's claims, measured on stored runs by the rules of `claim_rules`."""

from dataclasses import dataclass, field

from compressor.analysis.claim_rules import RULES, Runs, vibrating
from compressor.analysis.continuity import Shares
from compressor.analysis.margins import Margin, least
from compressor.analysis.runs import settled


@dataclass(frozen=True)
class Claim:
    """One claim of the paper, measured: `held` is None when its cases are not there."""

    number: int
    statement: str
    threshold: str
    held: bool | None
    measured: list[tuple[str, str]] = field(default_factory=list)
    note: str = ""
    margin: Margin | None = None


def claims(runs: Runs) -> list[Claim]:
    """Measure every claim on the runs at hand, complete ones by label (see `paper_cases`)."""
    found = []
    for number, rule in enumerate(RULES, 1):
        missing = [name for name in rule.needs if name not in runs]
        said = (number, rule.statement, rule.threshold)
        if missing:
            found.append(Claim(*said, None, [("missing", ", ".join(missing))], rule.note))
            continue
        margins, rows = rule.judge(runs)
        margin = least(margins)
        found.append(Claim(*said, margin.value >= 0.0, [*rows], rule.note, margin))
    return found


def claim_margins(runs: Runs) -> tuple[list[Margin], dict[str, Margin]]:
    """Return how far each claim is from its threshold, as `claims` tells, all of whose runs are
    there.

    Of claim 7 also by each of its shares alone, and by the share of time in which the machine
    vibrates (`active_share`), without an error.
    """
    kept = {name: settled(run) for name, run in runs.items()}
    each = [rule.judge(kept)[0] for rule in RULES]
    shares = Shares._fields
    alone = {name: least(each[6][n :: len(shares)]) for n, name in enumerate(shares)}
    return [least(margins) for margins in each], alone | {"active": vibrating(kept)}
