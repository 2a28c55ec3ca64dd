"""`compsim stress`: extreme scenes, each run and judged; what ends how, and what is worst."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from compressor.program import duration
from compsim.options import jobs_option, output_option, quiet_option
from compsim.progress import ProgressReporter
from compsim.screen import DONE, SOME_FAILED, one_thread_each, plural, print_text, say

if TYPE_CHECKING:
    import xarray as xr


@click.command()
@click.option("-n", "--scenes", type=click.IntRange(min=1), default=2000, show_default=True,
              help="Draw this many cases.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True,
              help="Draw by this seed.")  # fmt: skip
@click.option(
    "--laws",
    "drawn",
    flag_value="laws",
    help="Draw laws of contact and friction as well, each as often as any other.",
)
@click.option(
    "--features",
    "drawn",
    flag_value="features",
    help="Draw laws, oil, guide, drive and rod as well.",
)
@jobs_option()
@output_option("stress", "Write the campaign into this folder.")
@click.option("--scene", type=click.IntRange(min=0),
              help="Repeat this case of the seed alone, and store nothing.")  # fmt: skip
@quiet_option
def stress(
    scenes: int, seed: int, drawn: str | None, jobs: int | None, output: str, scene: int | None,
    quiet: bool,
) -> int:  # fmt: skip
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
    one_thread_each()  # before numpy loads
    from compressor.sweep import cores

    if scene is not None:
        print_text("\n".join(write_scene(scene, seed, drawn or "")))
        return DONE
    from compressor.report import render
    from compressor.store import publish, writable_folder
    from compressor.studies.stress.extremes import Budget
    from compressor.studies.stress.figures import draw_outcomes
    from compressor.studies.stress.stress import campaign

    writable_folder(output)
    with ProgressReporter(quiet, "scenes") as progress:
        study = campaign(output, scenes, seed, jobs or cores(), progress, Budget(drawn or ""))
    drawing = draw_outcomes(study)
    for kind in ("png", "svg"):
        publish(Path(output, f"stress.{kind}"), render(drawing, kind))
    print_text("\n".join(summary(study)))
    if not quiet:
        say(study.encoding["source"])
        say(os.path.join(output, "stress.png"))
    verdicts = study["verdict"].values.tolist()
    doubtful = verdicts.count("silent_wrong") or verdicts.count("unjudged") > 0.02 * scenes
    return SOME_FAILED if doubtful else DONE


def write_scene(number: int, seed: int, drawn: str) -> Iterator[str]:
    """Yield a scene as a case file, and below it, as comments, how it ends."""
    from compressor.studies.stress.stress import repeat

    values, row = repeat(number, seed, drawn)
    yield from (f"{key}: {json.dumps(value)}" for key, value in values.items())
    for key, value in row.items():
        if key not in ("load", "joint") and value != "":
            yield f"# {key}: {value:.3g}" if isinstance(value, float) else f"# {key}: {value}"


def summary(study: "xr.Dataset") -> Iterator[str]:
    """Yield shares, the worst scenes with the command that repeats each, and the slowest one."""
    from compressor.studies.stress.stress import counts, slowest, worst

    for kind, ends in counts(study).items():
        total = sum(ends.values())
        named = ", ".join(f"{name} {count}" for name, count in sorted(ends.items()))
        share = ends.get("ok", 0) / max(total, 1)
        yield f"{kind} range: {plural(total, 'scene')}, {share:.1%} ok: {named}"
    yield ""
    yield f"{'verdict':<13} {'excess':>7} {'beyond':>7} {'error':>8} {'bar':>8}  repeat by"
    most = worst(study)
    for place in range(most.sizes["scene"]):
        row = most.isel(scene=place)
        far, beyond, error, size = (
            row[name].item() for name in ("excess", "excess_beyond", "error", "bar")
        )
        yield (
            f"{row['verdict'].item():<13} {far:>7.2g} {beyond:>7.2g} {error:>8.1e} {size:>8.1e}  "
            f"{command(row, study.attrs)}"
        )
    longest = slowest(study)
    if longest is not None:
        yield (
            f"slowest ok scene: {duration(longest['seconds'].item())}, "
            f"{command(longest, study.attrs)}"
        )
    yield f"peak memory of a worker: {study['peak_memory'].max().item() / 2**20:.0f} MiB"


def command(row: "xr.Dataset", attrs: dict[str, Any]) -> str:
    """Return the command that repeats a scene of a campaign."""
    drawn = f" --{attrs['drawn']}" if attrs.get("drawn") else ""
    return f"compsim stress --scene {row['scene'].item()} --seed {attrs['seed']}{drawn}"
