"""What `compsim run` and `compsim plan` do with case files that have `regimes`."""

import os
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from compressor.digits import plural
from compressor.program import duration, printable
from compsim import screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    from compressor.cases import Study
    from compressor.studies.regimes.run import ChainProgress, RegimesSummary

MAX_FAILURES = 20  # listed one by one


def run_chains(studies: "list[Study]", folder: str, workers: int, rerun: bool, quiet: bool) -> int:
    """Follow the chains of studies; return the exit code."""
    from compressor.studies.regimes.run import run_regimes

    with ProgressReporter(quiet, "values", folder=folder) as progress:
        summary = run_regimes(studies, folder, workers, progress, rerun)
    report_chains(summary, folder, quiet)
    return screen.SOME_FAILED if summary.failed else screen.DONE


def ahead(studies: "list[Study]", folder: str) -> "list[ChainProgress]":
    """Return the number of stored values of each study's chains."""
    if not studies:
        return []
    from compressor.studies.regimes.run import standing

    return standing(studies, folder)


def ahead_lines(standings: "list[ChainProgress]") -> Iterator[str]:
    """Yield the numbers of values of each study's chains, and of stored ones."""
    for one in standings:
        missing = one.chains * one.values - one.done
        chains = f"{plural(one.chains, 'chain')} x {plural(one.values, 'value')}"
        yield f"{one.study}  {chains}  {one.done:>4} done  {missing:>4} missing"


def regimes_of(folder: str, study: str) -> str:
    """Describe how many values of a study are in which regime."""
    from compressor.studies.regimes.dataset import open_regimes

    found = open_regimes(folder, study)
    words = [word for word in found["regime"].values.ravel().tolist() if word]
    periods = [period for period in found["period"].values.ravel().tolist() if period == period]
    texts = [f"{number} {word}" for word, number in sorted(Counter(words).items())]
    of = [f"{n} of {p:g} rev" for p, n in sorted(Counter(periods).items())]
    return ", ".join(texts) + (f"; periods: {', '.join(of)}" if of else "")


def report_chains(summary: "RegimesSummary", folder: str, quiet: bool) -> None:
    """Write what there is now, and what failed."""
    for count in summary.counts:
        where = os.path.join(folder, "regimes", count.study)
        chains = f"{plural(count.chains, 'chain')} x {plural(count.values, 'value')}"
        ok = count.done - count.failed
        with screen.unread():
            screen.print_text(
                f"{count.study}  {chains}  {ok:>4} ok  {count.failed:>4} failed  {where}"
            )
            screen.print_text(f"{count.study}  {regimes_of(folder, count.study)}")
            if count.differ:
                apart = plural(count.differ, "value")
                second = f"second attractors confirmed at {count.confirmed}"
                screen.print_text(f"{count.study}  up and down differ at {apart}; {second}")
    if not quiet:
        new = summary.total - summary.done_before
        done = f"{plural(new, 'value')} run in {duration(summary.seconds)}"
        done += screen.stored_before(summary.done_before)
        screen.say(done if new else screen.all_stored(summary.total, folder, "value"))
    if not summary.failed:
        return
    from compressor.reasons import remedy

    for one in summary.failed[:MAX_FAILURES]:
        point = "".join(f" {key}={value}" for key, value in one.point.items())
        screen.say_wrapped(
            f"{one.study}{point} {one.direction} at {one.value:g}: {one.reason}: "
            f"{printable(one.detail)}",
            2,
        )
    if len(summary.failed) > MAX_FAILURES:
        screen.say(f"  and {len(summary.failed) - MAX_FAILURES} more")
    for reason in dict.fromkeys(one.reason for one in summary.failed):
        screen.say_wrapped(f"{reason}: {remedy(reason)}", 2)
