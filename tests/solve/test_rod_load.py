"""Rod-load reversal: closed forms, the ideal machine, error bars, and the verdict."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from compsim import cli
from compsim.job_text import reversal_verdict
from conftest import store

from compressor.cases.case import Case
from compressor.physics import WIDE, exact_motion
from compressor.solve.error_bars import Companion
from compressor.solve.run_metrics import SAMPLED, SMALL_END, sampled_bars, sampled_metrics
from compressor.solve.simulate import measure

SIGNALLED = {"output": {"signals": True}}
NO_PEAK = {"peak_contact_force_axis": np.zeros((2, 2))}
TURN = {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 0.9}


def loads(values):
    rows = np.zeros((len(values), WIDE))
    rows[:, SMALL_END] = values
    return rows


@pytest.mark.parametrize("shift", [-0.7, -0.2, 0.0, 0.5])
def test_of_a_shifted_sine(shift):
    """sin + s is negative for pi - 2 arcsin(s) of 2 pi; its peaks are 1 + s and 1 - s."""
    angle = 2 * math.pi * (np.arange(3600) + 0.5) / 3600
    found = sampled_metrics(loads(800 * (np.sin(angle) + shift)), NO_PEAK)
    expected = math.pi - 2 * math.asin(abs(shift))
    assert found["rod_load_reversal_angle"] == pytest.approx(expected, rel=1e-3)
    share = (1 - abs(shift)) / (1 + abs(shift))
    assert found["rod_load_reversal_share"] == pytest.approx(share, rel=1e-5)
    assert found["peak_rod_load_tension"] == pytest.approx(800 * (1 + shift), rel=1e-5)
    assert found["peak_rod_load_compression"] == pytest.approx(800 * (1 - shift), rel=1e-5)


def test_of_a_load_that_keeps_its_side():
    for load in (3.0, -3.0, 0.0):
        found = sampled_metrics(loads(np.full(100, load)), NO_PEAK)
        peaks = [found.pop(f"peak_rod_load_{side}") for side in ("tension", "compression")]
        assert peaks == [max(load, 0.0), max(-load, 0.0)]
        assert set(found.values()) == {0.0}
    assert sampled_metrics(loads([]), NO_PEAK) == {}


@pytest.mark.parametrize("place", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("power", [1, 2])
def test_bars_hold_what_is_lost_between_samples(place, power):
    """Of a kink and of a parabola, wherever the top lies; the greater side has no such loss."""
    at = np.arange(-20.0, 21.0) - place
    rows = loads(np.where(abs(at) < 10, 1000.0 - abs(at) ** power, -3000.0))
    found = {"peak_contact_force_axis": np.array([[0.0, 0.0], [3000.0, 0.0]])}
    numbers = sampled_metrics(rows, found)
    same = Companion(found | numbers, 0.5, {"contact_force": np.zeros(2)})
    bars = sampled_bars(rows, found, same)
    lost = 1000.0 - numbers["peak_rod_load_tension"]
    assert lost <= bars["peak_rod_load_tension"] * (1.0 + 1e-9)
    assert bars["peak_rod_load_tension"] < 4.5
    assert (numbers["peak_rod_load_compression"], bars["peak_rod_load_compression"]) == (3000, 0)


def test_a_peak_that_may_be_of_either_side_is_known_by_samples_alone():
    """The greatest load, 1005, is a push between two samples, whose greatest is a pull."""
    push = -1005.0 + 30.0 * abs(np.arange(-20.0, 21.0) - 0.5)
    rows = loads(np.concatenate([np.full(41, 1000.0), np.minimum(push, 0.0)]))
    found = {"peak_contact_force_axis": np.array([[0.0, 0.0], [1005.0, 0.0]])}
    numbers = sampled_metrics(rows, found)
    same = Companion(found | numbers, 0.5, {"contact_force": np.zeros(2)})
    bars = sampled_bars(rows, found, same)
    for name, true in (("tension", 1000.0), ("compression", 1005.0)):
        name = f"peak_rod_load_{name}"
        assert abs(numbers[name] - true) <= bars[name] < 20.0
    share = "rod_load_reversal_share"
    assert abs(numbers[share] - 1000.0 / 1005.0) <= bars[share]


def test_the_greatest_load_is_that_of_the_whole_solution():
    """It was the greatest of 1,440 samples a revolution, whose bar missed a peak between them."""
    values = {"joint": "small_end", "clearance_mm": 0.3, "load": "gas", "solve": TURN, **SIGNALLED}
    numbers = measure(Case.from_values(values)).numbers
    peaks = [numbers[f"peak_rod_load_{side}"] for side in ("tension", "compression")]
    assert max(peaks) == numbers["peak_contact_force_axis"][1][0]
    assert numbers["rod_load_reversal_share"] == min(peaks) / max(peaks)


@pytest.mark.parametrize(
    ("load", "degrees", "share"), [("spring", 108.6, 0.49), ("gas", 117.3, 0.73)]
)
def test_of_the_ideal_machine(load, degrees, share):
    numbers = measure(Case.from_values({"load": load, "solve": TURN, **SIGNALLED})).numbers
    assert math.degrees(numbers["rod_load_reversal_angle"]) == pytest.approx(degrees, abs=0.1)
    assert numbers["rod_load_reversal_share"] == pytest.approx(share, abs=0.01)
    if load == "spring":
        peaks = [numbers[f"peak_rod_load_{side}"] for side in ("tension", "compression")]
        assert sorted(peaks) == pytest.approx([2330, 4725], abs=1.0)


def test_of_a_double_acting_cylinder():
    """Combined rod load of the ideal machine: gas on both faces, less the ideal m a."""
    gas = {
        "action": "double", "bore_mm": 220, "rod_diameter_mm": 60, "suction_MPa": 0.2,
        "discharge_MPa": 0.7, "exponent": 1.3, "clearance_percent": {"head": 12, "crank": 14},
        "back_pressure_MPa": 0,
    }  # fmt: skip
    machine = {"stroke_mm": 180, "rod_length_mm": 450, "speed_rpm": 740,
               "reciprocating_mass_kg": 30}  # fmt: skip
    values = {"load": "gas", "machine": machine, "gas": gas, "solve": TURN, **SIGNALLED}
    numbers = measure(Case.from_values(values)).numbers
    theta = np.radians(np.arange(0, 360, 0.05) + 0.025)
    x, _, a = exact_motion(theta, 0.09, 0.45, 740 * math.pi / 30)
    faces, shares = (math.pi * 0.11**2, math.pi * (0.11**2 - 0.03**2)), (0.12, 0.14)
    push = np.zeros_like(x)
    for face, share, gap, sign in zip(faces, shares, (0.54 - x, x - 0.36), (1, -1), strict=True):
        space, clearance = gap + share * 0.18, share * 0.18
        grows = (theta < math.pi) == (sign == 1)
        expanded = np.maximum(2e5, 7e5 * (clearance / space) ** 1.3)
        compressed = np.minimum(7e5, 2e5 * ((clearance + 0.18) / space) ** 1.3)
        push += sign * face * np.where(grows, expanded, compressed)
    load = -push - 30 * a  # positive in tension
    pull, push = load.max(), -load.min()
    tension = 360 * np.mean(load > 0)
    assert numbers["peak_rod_load_tension"] == pytest.approx(pull, rel=2e-3)
    assert numbers["peak_rod_load_compression"] == pytest.approx(push, rel=2e-3)
    share = min(pull, push) / max(pull, push)
    assert numbers["rod_load_reversal_share"] == pytest.approx(share, rel=4e-3)
    angle = math.degrees(numbers["rod_load_reversal_angle"])
    assert angle == pytest.approx(min(tension, 360 - tension), abs=0.2)


CYLINDER = {"action": "double", "rod_diameter_mm": 30, "clearance_percent": 9}


@pytest.mark.parametrize("joint", ["big_end", "small_end"])
@pytest.mark.parametrize("load", ["spring", "gas", CYLINDER])
def test_bars_hold_the_error(joint, load):
    """Against a run at rtol 1e-11, whose own samples are as dense."""
    values = {"joint": joint, "clearance_mm": 0.2, "load": load, **SIGNALLED}
    values |= {"load": "gas", "gas": load} if load is CYLINDER else {}
    ours = measure(Case.from_values({**values, "solve": {**TURN, "accuracy": "draft"}})).numbers
    exact = measure(Case.from_values({**values, "solve": {**TURN, "rtol": 1e-11}})).numbers
    for name in SAMPLED:
        away = abs(ours[name] - exact[name])
        assert away <= ours[f"{name}_error"] < 0.2 * ours[name], name


def test_a_run_without_signals_or_with_a_stop_has_none():
    plain = measure(Case.from_values({"solve": TURN})).numbers
    short = {**TURN, "max_steps": 40}
    stopped = {"joint": "big_end", "clearance_mm": 0.2, "solve": short, **SIGNALLED}
    for numbers in (plain, measure(Case.from_values(stopped)).numbers):
        assert math.isnan(numbers["rod_load_reversal_angle"])
        assert math.isnan(numbers["rod_load_reversal_share_error"])


def test_a_reversal_that_is_not_known_is_not_judged():
    found = SimpleNamespace(numbers={
        f"rod_load_reversal_{name}{end}": value
        for name in ("angle", "share") for end, value in (("", 1.0), ("_error", math.inf))
    })  # fmt: skip
    ((_, line),) = reversal_verdict(found, 15.0, 3.0)
    assert line.endswith("its reversal is not known well enough to be judged")
    near = {"rod_load_reversal_angle": math.radians(15.2), "rod_load_reversal_share": 0.2,
            "rod_load_reversal_angle_error": math.radians(0.5),
            "rod_load_reversal_share_error": 0.01}  # fmt: skip
    ((_, line),) = reversal_verdict(SimpleNamespace(numbers=near), 15.0, 3.0)
    assert "cannot be distinguished from API 618's 15 degrees and 3 %" in line


def test_show_judges_the_reversal(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(json.dumps({"solve": TURN, **SIGNALLED}))
    (study,) = store(tmp_path / "results", tmp_path / "s.yaml")
    key = study.cases[0].key

    def told(*words):
        capsys.readouterr()
        assert cli.main(["show", key, *words]) == 0
        return " ".join(capsys.readouterr().out.split())

    assert "%: passes API 618's 15 degrees and 3 %" in told()
    assert "%: passes the maker's 30 degrees and 25 %" in told("--reversal", "30,25")
    assert "%: fails the maker's 30 degrees and 60 %" in told("--reversal", "30,60")
