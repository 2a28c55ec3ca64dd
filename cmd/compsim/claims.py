"""`compsim claims`: in which machines the paper's claims hold, and what decides them."""

import shlex

import click

from compressor.digits import plural
from compsim import options, screen
from compsim.progress import ProgressReporter, read_cases

EXAMPLES = ("claims", "assumptions")


@click.command()
@click.argument("configs", nargs=-1, metavar="[CONFIG...]", type=options.FILE)
@options.output("Write the verdicts into this folder.", default="claims")
@click.option(
    "--search", type=options.NUMBER, default=0, help="Search so many generations for all claims."
)
@options.jobs()
@options.set_keys
@options.max_jobs
@options.quiet
def claims(configs, output, search, jobs, quiet, **how) -> int:
    """Judge the paper's eight claims on many machines.

    \b
    compsim claims
    compsim claims assumptions.yaml --search 20

    The machines cover assumptions that the paper leaves open. Every point of a CONFIG is a machine:
    masses, friction, contact, loads. Each is judged by the paper's nine worn cases, which are run
    in memory. NAME.nc in the folder has the margin of each claim, 0 at its threshold, with its
    error; the same command goes on from it. Without CONFIG, the map over rod and reciprocating mass
    (claims.nc), and all assumptions drawn for a variance-based sensitivity (assumptions.nc), by the
    examples that come with the program. `compsim report` draws them. --search looks for the least
    change by which all claims hold, by generations of some 50 machines, in the ranges that a CONFIG
    draws from.

    Exit code 3 if a machine has no verdict.
    """
    from compressor.cases import templates
    from compressor.store import writable_folder
    from compressor.studies.claims.findings import sentences
    from compressor.studies.claims.search import least_change
    from compressor.studies.claims.study import cases_judged, judge_machines
    from compressor.sweep import cores

    paths = configs or [str(templates()[name].path) for name in EXAMPLES]
    studies = read_cases(paths, quiet, variants=cases_judged, **how)
    searchable = [study for study in studies if study.axes and all(a.spread for a in study.axes)]
    if search and not searchable:
        drawn = "whose keys are drawn from ranges, such as {saltelli: [2, 9]}"
        raise click.UsageError(f"--search needs a CONFIG {drawn}")
    writable_folder(output)
    say = (lambda text: None) if quiet else screen.say
    found, workers = [], jobs or cores()
    for study in studies:
        say(f"{study.name}: {plural(study.jobs, 'machine')} of {study.path}")
        with ProgressReporter(quiet, "machines") as progress:
            found.append(judge_machines(study, output, workers, progress))
    for study in searchable if search else ():
        say(f"{study.name}: {plural(search, 'generation')} of a search")
        with ProgressReporter(quiet, "machines") as progress:
            found.append(least_change(study, output, workers, search, progress))
    for one in found:
        screen.print_text(one.encoding["source"], *(f"  {text}" for text in sentences(one)))
    beside = "" if output == "claims" else f" --claims {shlex.quote(output)}"
    say(f"next: compsim report{beside}")
    failed = any((one["status"] == "failed").any() for one in found)
    return screen.SOME_FAILED if failed else screen.DONE
