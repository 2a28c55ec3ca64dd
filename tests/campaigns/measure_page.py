"""Measure the report's page: how long it takes to write, how large it is, how fast it opens.

    python tests/campaigns/measure_page.py tests/results/page.json [jobs]  (make page)

Of four stores: the paper's eleven cases, a study of 420 jobs over four axes, one of 5,000 sampled
jobs with their time series, and one of 100,000 jobs. Writing is the whole command, in a process of
its own, into an empty folder and again into the same one; opening is by a headless chromium without
a network, from the start of the navigation to the end of `load`, and until the first figure is
interactive; without a chromium it is left out. Medians of a few.
"""

import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from result_pages import keep, provenance, run_campaign

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from browsing import browser, lacking, live, wait_for

ROOT = Path(__file__).parents[2]
CONFIGS = sorted(map(str, (ROOT / "configs").glob("*.yaml")))
ROUNDS = 3
FOUR_AXES = """\
joint: [big_end, small_end]
clearance_mm: {linspace: [0.06, 0.3, 7]}
machine: {speed_rpm: {linspace: [200, 700, 6]}, rod_mass_kg: {linspace: [2, 8, 5]}}
solve: {accuracy: draft}
output: {keep: metrics}
"""
MANY = """\
joint: big_end
clearance_mm: {{linspace: [0.05, 0.3, 50]}}
machine: {{speed_rpm: {{linspace: [200, 700, {speeds}]}}, rod_mass_kg: {{linspace: [2, 8, 20]}}}}
solve: {{accuracy: draft, duration_rev: 2}}
output: {{keep: metrics}}
"""
SAMPLED = """\
joint: big_end
clearance_mm: {lhs: [0.05, 0.3]}
machine:
  speed_rpm: {lhs: [200, 700]}
  rod_mass_kg: {lhs: [2, 8]}
  reciprocating_mass_kg: {lhs: [6, 20]}
sample: {n: 5000, seed: 1}
solve: {accuracy: draft, duration_rev: 2}
"""
LIBRARY = "plotly.min.js"


def main(target, jobs=100_000):
    if lacking():
        print(f"{lacking()}: how fast pages open is not measured", flush=True)
    found = {**provenance("make page"), "stores": {}}
    for name, make, rounds in (
        ("the paper's eleven cases", paper, ROUNDS),
        ("420 jobs, four axes", four_axes, ROUNDS),
        ("5,000 sampled jobs with series", sampled, ROUNDS),
        (f"{jobs:,} jobs", lambda folder: many(folder, jobs), 1),
    ):
        with tempfile.TemporaryDirectory() as folder:
            make(folder)
            found["stores"][name] = measured(Path(folder), rounds)
            print(name, found["stores"][name], flush=True)
    keep(target, found)


def compsim(folder, *words):
    subprocess.run([sys.executable, "-m", "compsim", *words], cwd=folder, check=True,
                   capture_output=True)  # fmt: skip


def paper(folder):
    compsim(folder, "run", *CONFIGS)


def four_axes(folder):
    (Path(folder) / "four.yaml").write_text(FOUR_AXES)
    compsim(folder, "run", "four.yaml")


def sampled(folder):
    (Path(folder) / "sampled.yaml").write_text(SAMPLED)
    compsim(folder, "run", "sampled.yaml", "--max-jobs", "5000")


def many(folder, jobs):
    (Path(folder) / "many.yaml").write_text(MANY.format(speeds=jobs // 1000))
    compsim(folder, "run", "many.yaml", "--max-jobs", str(jobs))


def measured(folder, rounds):
    """Seconds to write, bytes, and seconds to open."""
    written, again = [], []
    for _ in range(rounds):
        shutil.rmtree(folder / "report", ignore_errors=True)
        written.append(writing(folder))
        again.append(writing(folder))
    files = {path.name: path.stat().st_size for path in (folder / "report").iterdir()}
    of = {
        kind: sum(size for name, size in files.items() if name.endswith(kind) and name != LIBRARY)
        for kind in (".html", ".js", ".csv", ".png")
    }
    opens = [] if lacking() else [opened(folder / "report") for _ in range(max(rounds, 2))]
    loaded, first = (
        (round(statistics.median(column), 3) for column in zip(*opens, strict=True))
        if opens
        else (None, None)
    )
    return {
        "write_seconds": round(statistics.median(written), 2),
        "rewrite_seconds": round(statistics.median(again), 2),
        "figures": len([name for name in files if name.endswith(".png")]),
        "page_bytes": of[".html"], "data_bytes": of[".js"], "library_bytes": files[LIBRARY],
        "csv_bytes": of[".csv"], "picture_bytes": of[".png"],
        "open_seconds": loaded, "first_figure_seconds": first,
    }  # fmt: skip


def writing(folder):
    """Seconds of writing the report."""
    began = time.perf_counter()
    compsim(folder, "report")
    return time.perf_counter() - began


def opened(report):
    """Seconds until the page is loaded, and until its first figure is interactive."""
    with tempfile.TemporaryDirectory() as profile, browser(profile) as driver:
        driver.get("about:blank")
        driver.get(f"file://{report}/index.html")
        loaded = wait_for(driver, "return performance.timing.loadEventEnd - "
                                  "performance.timing.navigationStart > 0 && "
                                  "performance.timing.loadEventEnd - "
                                  "performance.timing.navigationStart")  # fmt: skip
        name = driver.execute_script("return document.querySelector('figure')?.id")
        if name is None:
            return loaded / 1e3, loaded / 1e3
        began = driver.execute_script("return performance.now()")
        live(driver, name)
        first = driver.execute_script("return performance.now()") - began
        return loaded / 1e3, first / 1e3


if __name__ == "__main__":
    run_campaign(main)
