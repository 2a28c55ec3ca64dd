"""Measure the report's page: how long it takes to write, how large it is, how fast it opens.

Of two stores: the paper's eleven cases, and a study of 100,000 jobs. Writing is the whole command,
in a process of its own, into an empty folder and again into the same one; opening is by a headless
chromium without a network, from the start of the navigation to the end of `load`, and until the
first figure is interactive; without a chromium it is left out. Medians of a few.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from result_pages import keep, provenance, run_campaign

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from browsing import browser, lacking, live, wait_for

CONFIGS = sorted(map(str, (Path(__file__).parents[2] / "configs").glob("*.yaml")))
MANY = """\
joint: big_end
clearance_mm: {{linspace: [0.05, 0.3, 50]}}
machine: {{speed_rpm: {{linspace: [200, 700, {speeds}]}}, rod_mass_kg: {{linspace: [2, 8, 20]}}}}
solve: {{accuracy: draft, duration_rev: 2}}
output: {{keep: metrics}}
"""
LIBRARY = "plotly.min.js"
LOADED = "performance.timing.loadEventEnd - performance.timing.navigationStart"  # ms


def main(target, jobs=100_000):
    if lacking():
        print(f"{lacking()}: how fast pages open is not measured", flush=True)
    stores = {}
    for name, words, rounds in (
        ("the paper's eleven cases", CONFIGS, 3),
        (f"{jobs:,} jobs", ["many.yaml", "--max-jobs", str(jobs)], 1),
    ):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            (folder / "many.yaml").write_text(MANY.format(speeds=jobs // 1000), encoding="utf-8")
            compsim(folder, "run", *words)
            stores[name] = measured(folder, rounds)
            print(name, stores[name], flush=True)
    keep(target, {**provenance("make page"), "stores": stores})


def compsim(folder, *words):
    """Seconds of a command there."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", "compsim", *words], cwd=folder, check=True,
                   capture_output=True)  # fmt: skip
    return time.perf_counter() - began


def measured(folder, rounds):
    """Seconds to write, bytes, and seconds to open."""
    written, again = [], []
    for _ in range(rounds):
        shutil.rmtree(folder / "report", ignore_errors=True)
        written.append(compsim(folder, "report"))
        again.append(compsim(folder, "report"))
    files = {path.name: path.stat().st_size for path in (folder / "report").iterdir()}
    library = files.pop(LIBRARY)

    def size(kind):
        return sum(size for name, size in files.items() if name.endswith(kind))

    opens = [] if lacking() else [opened(folder / "report") for _ in range(3)]
    loaded, first = (
        (round(median(one), 3) for one in zip(*opens, strict=True)) if opens else (None, None)
    )
    return {
        "write_seconds": round(median(written), 2), "rewrite_seconds": round(median(again), 2),
        "figures": sum(name.endswith(".png") for name in files),
        "page_bytes": size(".html"), "data_bytes": size(".js"), "library_bytes": library,
        "csv_bytes": size(".csv"), "picture_bytes": size(".png"),
        "open_seconds": loaded, "first_figure_seconds": first,
    }  # fmt: skip


def opened(report):
    """Seconds until the page is loaded, and until its first figure is interactive."""
    with tempfile.TemporaryDirectory() as profile, browser(profile) as driver:
        driver.get("about:blank")
        driver.get(f"file://{report}/index.html")
        loaded = wait_for(driver, f"return {LOADED} > 0 && {LOADED}")
        name = driver.execute_script("return document.querySelector('figure').id")
        began = driver.execute_script("return performance.now()")
        live(driver, name)
        first = driver.execute_script("return performance.now()") - began
        return loaded / 1e3, first / 1e3


if __name__ == "__main__":
    run_campaign(main)
