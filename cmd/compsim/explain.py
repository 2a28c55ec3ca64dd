"""`compsim explain`: cost and droppable features of a case, and what moves its metrics."""

import dataclasses
import itertools

import click

from compsim import options, screen
from compsim.progress import ProgressReporter, read_cases


@click.command()
@options.configs
@click.option("--models", is_flag=True, help="Measure what moves each metric, numbers or models.")
@options.results
@options.set_keys
@options.max_jobs
@options.as_json
def explain(configs, models, folder, as_json, **how) -> int:
    """Estimate the cost and droppable features of a case.

    \b
    compsim explain machine.yaml
    compsim explain machine.yaml --models

    Runs the job with the greatest stored contact force, or else the greatest clearance, of each
    case file. Then runs it again without each feature that costs time.

    With --models it runs that job again with one change at a time: each number that the file does
    not give, or that a plant can only guess, at both ends of its plausible range; other laws of
    contact and friction; oil, an elastic rod and play in the guide added or removed. It ranks what
    changes each metric most.

    --set clearance_mm=0.3 chooses another job. Exit code 3 if such a job fails.
    """
    from compressor.cases import points
    from compressor.studies.tradeoff.changes import list_changes, model_table
    from compressor.studies.tradeoff.explain import explain as explain_job
    from compressor.studies.tradeoff.explain import list_explanation
    from compressor.studies.tradeoff.variants import choose_job, explain_models
    from compressor.sweep import cores

    studies = read_cases(configs, **how)
    screen.caution(studies)
    found, code = [], screen.DONE
    for study in studies:
        job, which = choose_job(study, folder)
        at = next(itertools.islice(points(study), job, None))
        place = "".join(f", {key} = {value}" for key, value in at.items())
        screen.say_wrapped(f"running {which} of {study.name}{place}, and with one change at a time")
        with ProgressReporter(False, "variants") as progress:
            if models:
                data = explain_models(study, job, progress)
            else:
                found.append(explain_job(study, job, cores(), progress))
        if not models:
            code = screen.SOME_FAILED if found[-1]["reason"] else code
            if not as_json:
                screen.print_lines(list_explanation(found[-1]))
        elif data["status"].values[0] != "ok":
            why = f"{data['reason'].values[0]}: {data.attrs['detail']}"
            screen.say_wrapped(f"{study.name}: the job failed, {why}")
            code = screen.SOME_FAILED
        else:
            table = model_table(data)
            found.append({"study": study.name, "point": at, **dataclasses.asdict(table)})
            if not as_json:
                sets = "".join(f" --set {text}" for text in how["overrides"])
                screen.print_lines([f"{study.name}{place}{sets}", *list_changes(table)])
    if as_json:
        screen.print_json(found)
    return code
