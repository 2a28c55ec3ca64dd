"""`compsim explain`: terms, scales and cost of a case, and what moves its metrics."""

import dataclasses
import itertools
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    from compressor.cases import Study


@click.command()
@options.configs
@options.jobs("Estimate the sweep's cost with this many worker processes.")
@click.option("--models", is_flag=True,
              help="Measure instead what moves each metric, numbers or models.")  # fmt: skip
@click.option("--vary", "named", multiple=True, metavar="KEY",
              help="With --models: also this number, though the file gives it.")  # fmt: skip
@options.results
@options.set_keys
@options.max_jobs
@click.option("--json", "as_json", is_flag=True, help="Print the same as JSON, a list of studies.")
def explain(
    configs: tuple[str, ...],
    jobs: int | None,
    models: bool,
    named: tuple[str, ...],
    folder: str,
    overrides: tuple[str, ...],
    max_jobs: int,
    as_json: bool,
) -> int:
    """Estimate the cost, scales and droppable features of a case.

    \b
    compsim explain machine.yaml
    compsim explain machine.yaml --models

    Runs the first job of each case file, and again without each feature that costs time. With
    --models it runs the job with the greatest contact force that the folder -r has stored, or the
    one with the greatest clearance where it has none, and again with one thing otherwise at a time:
    each number that the file does not give, or that a plant can only guess, at both ends of its
    plausible range (the table of keys has them), other laws of contact and friction, oil, an
    elastic rod and play in the guide, or without where the case has them. It says what moves each
    metric most; all is stored in models/ of the folder -r, a file for each job, and the report of
    that folder shows it. --set clearance_mm=0.3 chooses another job. Exit code 3 where such a job
    fails.
    """
    if named and not models:
        raise click.UsageError("--vary names what --models varies: add --models")
    check_named(named)
    from compressor.cases import load_studies

    studies = load_studies(*configs, overrides=overrides, max_jobs=max_jobs)
    screen.caution(studies)
    if models:
        return explain_models(studies, folder, named, overrides, as_json)
    from compressor.studies.tradeoff.explain import explain as explained
    from compressor.studies.tradeoff.words import lines
    from compressor.sweep import cores

    found = []
    for study in studies:
        which = f"the first of {study.jobs} jobs" if study.jobs > 1 else "the job"
        say_job(study, 0, which, "with and without each of its features")
        with ProgressReporter(False, "features") as progress:
            found.append(explained(study, jobs or cores(), progress=progress))
        if not as_json:
            screen.print_lines(lines(found[-1]))
    if as_json:
        plain = [screen.jsonable(dataclasses.asdict(one)) for one in found]
        screen.print_text(json.dumps(plain, indent=1, ensure_ascii=False))
    return screen.SOME_FAILED if any(one.reason for one in found) else screen.DONE


def check_named(keys: Sequence[str]) -> None:
    """Raise UsageError for a key that has no plausible range."""
    from compressor.cases import PER_PART, suggestion, table

    for key in keys:
        whole, _, part = key.rpartition(".")
        row = table().get(PER_PART.get(whole, {}).get(part, key))
        if row is None:
            hint = suggestion(part, whole)
            raise click.UsageError(f"--vary {key}: unknown key{hint}")
        if row.plausible is None:
            raise click.UsageError(
                f"--vary {key}: the table of keys has no plausible range of it: sweep it, as in "
                f"--set {key}=[...]"
            )


def say_job(study: "Study", job: int, which: str, how: str) -> None:
    """Report which job of a study is run and why, and how to choose another."""
    from compressor.cases import points

    point = ""
    if study.jobs > 1:
        at = next(itertools.islice(points(study), job, None))
        point = ", ".join(f"{key} = {value}" for key, value in at.items())
    another = f"; it has {point}: --set KEY=VALUE takes another" if point else ""
    screen.say_wrapped(f"running {which} of {study.name}, {how}{another}")


def explain_models(
    studies: "list[Study]", folder: str, named: Sequence[str], overrides: Sequence[str],
    as_json: bool,
) -> int:  # fmt: skip
    """Print and store how far numbers in doubt and other models move a job of each study."""
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff.model_choices import choose_job
    from compressor.studies.tradeoff.model_choices import explain_models as run_models
    from compressor.studies.tradeoff.page import model_table, models_file, place_text
    from compressor.studies.tradeoff.words import model_lines

    writable_folder(folder)
    failed, found = False, []
    for study in studies:
        job, which = choose_job(study, folder)
        say_job(study, job, which, "with one thing otherwise at a time")
        with ProgressReporter(False, "variations") as progress:
            data = run_models(study, job, named, progress=progress)
        if data["status"].values[0] != "ok":
            failed = True
            screen.say_wrapped(
                f"{study.name}: the job failed, {data['reason'].values[0]}: {data.attrs['detail']}"
            )
            continue
        path = models_file(folder, study.name, data.attrs["key"])
        write_dataset(path, data)
        table = model_table(data)
        found.append({"study": study.name, "file": str(path), **dataclasses.asdict(table)})
        if not as_json:
            place = place_text(study, data.attrs["key"]) + ", by" * bool(overrides)
            place += "".join(f" --set {text}" for text in overrides)
            screen.print_lines(model_lines(place, table))
            screen.say(str(path))
    if as_json:
        screen.print_text(json.dumps(screen.jsonable(found), indent=1, ensure_ascii=False))
    return screen.SOME_FAILED if failed else screen.DONE
