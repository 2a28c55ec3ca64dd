"""`compsim claims`: in which machines the paper's claims hold, and what decides them."""

import json
import shlex
from typing import TYPE_CHECKING

import click

from compressor.digits import plural
from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    import xarray as xr

EXAMPLES = ("claims", "assumptions")


@click.command()
@click.argument("configs", nargs=-1, metavar="[CONFIG...]", type=options.FILE)
@options.output("claims", "Write the verdicts into this folder.")
@click.option("--search", "generations", type=click.IntRange(min=0), default=0, metavar="N",
              help="Search for the least change by which all claims hold: N generations of some "
              "50 machines, in the ranges that a CONFIG draws from.")  # fmt: skip
@options.jobs()
@options.set_keys
@options.max_jobs
@options.as_json
@options.quiet
def claims(
    configs: tuple[str, ...],
    output: str,
    generations: int,
    jobs: int | None,
    overrides: tuple[str, ...],
    max_jobs: int,
    as_json: bool,
    quiet: bool,
) -> int:
    """Judge the paper's eight claims on many machines.

    \b
    compsim claims
    compsim claims assumptions.yaml --search 20

    The machines cover assumptions that the paper leaves open. Every point of a CONFIG is a machine:
    masses, friction, contact, loads. Each is judged by the paper's nine worn cases, which are run
    in memory. NAME.nc in the folder has the margin of each claim, 0 at its threshold, with its
    error; the same command goes on from it. Without CONFIG, the map over rod and reciprocating mass
    (claims.nc), and all assumptions drawn for a variance-based sensitivity (assumptions.nc), by the
    examples that come with the program. `compsim report` draws them.

    Exit code 3 if a machine has no verdict.
    """
    screen.one_thread_each()  # before numpy loads
    from compressor.cases import load_studies, templates
    from compressor.store import writable_folder
    from compressor.studies.claims.search import least_change
    from compressor.studies.claims.study import cases_judged, judge_machines
    from compressor.sweep import cores

    paths = configs or tuple(str(templates()[name].path) for name in EXAMPLES)
    studies = load_studies(*paths, overrides=overrides, max_jobs=max_jobs, variants=cases_judged)
    searchable = [study for study in studies if study.axes and all(a.spread for a in study.axes)]
    if generations and not searchable:
        raise click.UsageError(
            "--search needs a CONFIG whose keys are drawn from ranges, such as {saltelli: [2, 9]}"
        )
    writable_folder(output)
    found, workers = [], jobs or cores()
    for study in studies:
        say_unless(quiet, f"{study.name}: {plural(study.jobs, 'machine')} of {study.path}")
        with ProgressReporter(quiet, "machines") as progress:
            found.append(judge_machines(study, output, workers, progress))
    for study in searchable if generations else ():
        say_unless(quiet, f"{study.name}: {plural(generations, 'generation')} of a search")
        with ProgressReporter(quiet, "machines") as progress:
            found.append(least_change(study, output, workers, generations, progress))
    report_machines(found, as_json)
    beside = "" if output == "claims" else f" --claims {shlex.quote(output)}"
    say_unless(quiet, f"next: compsim report{beside}")
    failed = any((one["status"] == "failed").any() for one in found)
    return screen.SOME_FAILED if failed else screen.DONE


def say_unless(quiet: bool, text: str) -> None:
    """Write text on stderr, unless quiet is wanted."""
    if not quiet:
        screen.say(text)


def report_machines(found: "list[xr.Dataset]", as_json: bool) -> None:
    """Write files of judged machines on stdout, each with its findings."""
    from compressor.studies.claims.findings import sentences

    findings = {one.encoding["source"]: [*sentences(one)] for one in found}
    if as_json:
        screen.print_text(json.dumps(findings, indent=1))
        return
    for path, texts in findings.items():
        screen.print_text(path)
        screen.print_text("\n".join(f"  {text}" for text in texts))
