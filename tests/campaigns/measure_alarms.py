"""Which alarm sees wear of the nameplate machine first (make alarms): sound and worn draws of it.

The machine of `compsim init machine` with speed, discharge pressure, oil and the clearances of its
sound pins drawn at random: sound draws that set limits and count false alarms, and others with the
big or the small end worn to each of some clearances. They are simulated into a store, and judged by
the command's own call, at several levels of noise. Beside it, one machine whose bores wear, for
lead times. Writes a small JSON file, with a digest of the jobs' keys: other cases, or another
model, make other keys, and tests/campaigns/test_kept_results.py then asks for a new run.
"""

import hashlib
import json
import math
from pathlib import Path

import yaml
from result_pages import keep, provenance, run_campaign

from compressor.cases import Wear
from compressor.cases.load import load_studies
from compressor.metrics import JOINTS
from compressor.program import no_progress
from compressor.store import find_study
from compressor.studies.alarms.alarms import add_hours, judge_alarms, rank_alarms, read_wear
from compressor.studies.wear import Worn, run_wear
from compressor.sweep.sweep import Options, sweep

ROOT = Path(__file__).parent.parent.parent
TEMPLATE = ROOT / "compressor/cases/examples/machine.yaml"
SEED, SOUND, DRAWS = 3501, 124, 36
HEALTHY = {"big_end": 0.12, "small_end": 0.1}
SOUND_PINS = {"big_end": [0.08, 0.12], "small_end": [0.06, 0.1]}
WORN = {
    "big_end": [0.15, 0.2, 0.25, 0.3, 0.4],
    "small_end": [0.15, 0.2, 0.25, 0.3, 0.4],
}  # fmt: skip
DRAWN = {  # about the nameplate: speed by 5 %, pressure by 10 %, oil by 20 %
    "machine": {"speed_rpm": [703, 777]},
    "gas": {"discharge_MPa": [0.63, 0.77]},
    "lubricant": {"viscosity_mPa_s": [32, 48]},
}
NOISE = (0.0, 1.0, 5.0)  # m/s2 rms, beside the sensor's own
SOLVE = {
    "accuracy": "draft", "error_bars": False, "settle_rev": 2, "duration_rev": 5,
    "output_step_deg": 3.6,
}  # fmt: skip
WEAR = {"limit_mm": 0.5, "hours": 1e7, "step_mm": 0.04}


def plant(template=TEMPLATE):
    """The values of the nameplate machine, with what is drawn of it."""
    values = yaml.safe_load(template.read_text(encoding="utf-8"))
    for group, drawn in DRAWN.items():
        values[group] |= {key: {"random": span} for key, span in drawn.items()}
    return values | {
        "name": "plant", "healthy_clearance_mm": HEALTHY, "solve": SOLVE,
        "output": {"precision": "single"},
    }  # fmt: skip


def case_text(sound=SOUND, draws=DRAWS, worn=WORN):
    """The study's case file: sound draws, and draws with either pin worn; YAML, as JSON."""
    pins = {joint: {"random": span} for joint, span in SOUND_PINS.items()}
    values = plant()
    values.pop("clearance_mm")
    blocks = [{"clearance_mm": pins, "sample": {"n": sound, "seed": SEED}}]
    blocks += [
        {"clearance_mm": pins | {joint: clearances}, "sample": {"n": draws, "seed": SEED + 1}}
        for joint, clearances in worn.items()
    ]
    return json.dumps(values | {"blocks": blocks}, indent=1) + "\n"


def wear_text():
    """The case file of the machine that wears: dry, since wear is that of a dry bore."""
    values = plant()
    for group in ("body", "sensor", "lubricant"):
        values.pop(group)
    for group, drawn in DRAWN.items():
        if group in values:
            values[group] |= {key: sum(span) / 2 for key, span in drawn.items()}
    clearance = {joint: max(span) for joint, span in SOUND_PINS.items()}
    return json.dumps(values | {
        "name": "worn", "clearance_mm": clearance, "output": {"keep": "metrics"},
        "solve": SOLVE | {"duration_rev": 4}, "wear": WEAR,
    }, indent=1) + "\n"  # fmt: skip


def digest_keys(studies, wear_studies):
    """A digest of the keys of all jobs and of all wear runs, in the order of the case files."""
    keys = [case.key for study in studies for case in study.cases]
    keys += [Worn(case).key for study in wear_studies for case in study.cases]
    return hashlib.sha256("\n".join(keys).encode()).hexdigest()[:20]


def judge(folder, study, run=None, revolutions=5):
    """What the command says of a stored study: best alarms by joint and noise, with their rates."""
    found = judge_alarms(folder, study, noise=NOISE, revolutions=revolutions)
    found = found if run is None else add_hours(found, run)
    return {
        "sound_draws": int(found.attrs["sound_draws"]), "jobs": len(find_study(folder, study).keys),
        "worn_jobs": int(found.attrs["worn_jobs"]), "left_out": json.loads(found.attrs["left_out"]),
        "attainable": found.attrs["rate"], "detected": found.attrs["detected"],
        "alarms": found.sizes["alarm"], "clipped": int(found.attrs["clipped"]),
        "rows": [row for joint in found["joint"].values.tolist() for row in rows_of(found, joint)],
        "wear_end": found.attrs.get("wear_end", math.nan),
    }  # fmt: skip


def rows_of(found, joint):
    """A row for the best filter of each kind of alarm, by joint and noise."""
    mine = found["worn_joint"].values == joint
    for level, noise in enumerate(found["noise"].values.tolist()):
        for place in rank_alarms(found, joint, level):
            one = found.isel(alarm=place, noise=level).sel(joint=joint)
            row = {
                "joint": joint, "noise": noise, "alarm": one["kind"].item(),
                "filter": one["filter"].item(), "limit": one["limit"].item(),
                "clearances": one["clearance"].values[mine].tolist(),
                "draws": one["draws"].values[mine].tolist(),
            }  # fmt: skip
            for ending, end in (("", "value"), ("_low", "low"), ("_high", "high")):
                of = one.sel(end=end)
                row[f"detection{ending}"] = of["detection"].values[mine].tolist()
                row[f"false_alarms{ending}"] = of["false_alarms"].item()
                row[f"first{ending}"] = of["first_clearance"].item()
                if "hours" in found:
                    row[f"lead_hours{ending}"] = of["hours"].item()
            yield row


def main(target, results="alarms", jobs=2):
    place = Path(results)
    place.mkdir(parents=True, exist_ok=True)
    for name, text in (("plant", case_text()), ("worn", wear_text())):
        (place / f"{name}.yaml").write_text(text, encoding="utf-8")
    studies, worn = load_studies(place / "plant.yaml"), load_studies(place / "worn.yaml")
    summary = sweep(studies, place / "plant", jobs, no_progress, Options("make alarms"))
    run_wear(worn, place / "worn", jobs, no_progress)
    run = read_wear(place / "worn")
    kept = judge(place / "plant", "plant", run)
    opened = 1e3 * run["clearance"].transpose("stage", "joint").values[-1]
    stages = dict(zip(JOINTS, opened.tolist(), strict=True))
    wear = {
        "end": kept.pop("wear_end"), "limit_mm": WEAR["limit_mm"],
        "factor": Wear().coefficient_factor, "clearances": stages,
    }  # fmt: skip
    result = {
        **provenance("make alarms"), "keys": digest_keys(studies, worn),
        "failed": len(summary.failed), **kept, "wear": wear,
    }  # fmt: skip
    keep(target, result, 3)
    for row in kept["rows"]:
        print({name: one for name, one in row.items() if not isinstance(one, list)})


if __name__ == "__main__":
    run_campaign(main)
