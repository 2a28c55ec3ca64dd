"""`compsim stress`: extreme scenes, each run and judged; what ends how, and what is worst."""

import os
from pathlib import Path

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.option("-n", "--scenes", type=options.COUNT, default=2000, help="Draw this many cases.")
@click.option("--seed", type=options.NUMBER, default=0, help="Draw by this seed.")
@click.option(
    "--laws", "drawn", flag_value="laws", help="Draw laws of contact and friction as well."
)
@click.option(
    "--features", "drawn", flag_value="features", help="Draw laws, oil, guide, drive and rod, too."
)
@options.jobs()
@options.output("Write the campaign into this folder.", default="stress")
@click.option(
    "--scene", type=options.NUMBER, help="Repeat this case of the seed alone, and store nothing."
)
@options.quiet
def stress(scenes, seed, drawn, jobs, output, scene, quiet) -> int:
    """Test numerical stability on extreme cases drawn at random.

    \b
    compsim stress -n 200 --seed 7
    compsim stress --seed 7 --scene 12

    Each case (a scene) is run, and its numbers are judged. Half of the cases lie in the supported
    range, half go far beyond. A case ends ok, confirmed by another integrator at a hundredth of its
    tolerance; failed, with a named reason; silent_wrong, when a number is off by more than ten
    error bars; or unjudged. Writes stress.nc, from which the same command goes on, and the map
    stress.png and stress.svg; shares and worst cases go to stdout. --scene prints one as a case
    file, and how it ended.

    Exit code 3 if a number is wrong without a warning, or more than 2 % of the cases are unjudged.
    """
    from compressor.report import render
    from compressor.store import publish, writable_folder
    from compressor.studies.stress.extremes import Budget
    from compressor.studies.stress.figures import draw_outcomes
    from compressor.studies.stress.stress import campaign
    from compressor.studies.stress.words import list_outcomes, list_scene
    from compressor.sweep import cores

    if scene is not None:
        screen.print_text(*list_scene(scene, seed, drawn or ""))
        return screen.DONE
    writable_folder(output)
    with ProgressReporter(quiet, "scenes") as progress:
        study = campaign(output, scenes, seed, jobs or cores(), progress, Budget(drawn or ""))
    drawing = draw_outcomes(study)
    for kind in ("png", "svg"):
        publish(Path(output, f"stress.{kind}"), render(drawing, kind))
    screen.print_text(*list_outcomes(study))
    if not quiet:
        screen.say(study.encoding["source"])
        screen.say(os.path.join(output, "stress.png"))
    verdicts = study["verdict"].values.tolist()
    doubtful = verdicts.count("silent_wrong") or verdicts.count("unjudged") > 0.02 * scenes
    return screen.SOME_FAILED if doubtful else screen.DONE
