"""A revolution as an analyst reads it: by plain NumPy of what is stored, and closed forms."""

import csv
import io
import math

import numpy as np
import pytest
from conftest import listed

from compressor.analysis import Cam, frame_forces, healthy_twin, impacts, read_cycle, record_of
from compressor.analysis.cycle import find_reversals
from compressor.cases.case import Case
from compressor.report.figures.drawing import as_csv, panels_of
from compressor.report.figures.job import draw_analyst, read_signals, split_events
from compressor.report.figures.table import spell
from compressor.solve.simulate import simulate

SOLVE = {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft", "error_bars": False}
HARD = {  # a joint that leaves its bore: damped little
    "joint": "big_end", "clearance_mm": 0.3, "load": "gas", "friction": False,
    "contact": {"damping_N_s_per_mm": 10}, "machine": {"rod_mass_kg": 1}, "solve": SOLVE,
}  # fmt: skip
BODY = {"body": {"frequency_x_Hz": 4.0, "frequency_y_Hz": 30.0}}


def run(**values):
    return simulate(Case.from_values({**HARD, **values}))


@pytest.fixture(scope="module")
def sensed():
    return run(**BODY, sensor=True)


def test_the_last_settled_revolution_of_the_record_is_drawn(sensed):
    """3072 samples a revolution at 500 rpm; the record begins where the run has settled."""
    found = read_cycle(sensed)
    assert found.is_sensed
    np.testing.assert_array_equal(found.vibration, sensed["sensor_acceleration"].values[3072:])
    np.testing.assert_allclose(found.angle, 360 * np.arange(3072) / 3072, atol=1e-6)
    load = frame_forces(sensed)["rod_load"]
    np.testing.assert_array_equal(found.rod_load[1:-1], load[2401:3600])
    np.testing.assert_allclose(found.load_angle[1:-1], 0.3 * np.arange(1, 1200), atol=1e-6)


def test_a_longer_record_shows_the_revolution_of_the_load():
    lengths = ({"length_rev": 1}, {"length_rev": 5}, {})
    short, long, whole = (
        read_cycle(run(**BODY, sensor={"noise_m_per_s2": 0} | one)) for one in lengths
    )
    np.testing.assert_allclose(long.vibration, whole.vibration, atol=0.05)
    np.testing.assert_array_equal(long.rod_load, whole.rod_load)
    assert not np.array_equal(short.rod_load, whole.rod_load)  # of the first one


def test_a_part_that_does_not_begin_at_top_dead_centre_is_drawn_from_0_to_360():
    found = read_cycle(run(solve={**SOLVE, "settle_rev": 1.25, "duration_rev": 3}))
    assert (np.diff(found.angle) >= 0).all()
    assert found.angle[0] >= 0.0
    assert found.angle[-1] < 360.0
    assert found.angle.size == 1201


def test_reversals_are_where_the_load_is_zero(sensed, twin):
    """And as many as it has changes of sign; of the ideal machine two."""
    found = read_cycle(sensed)
    assert len(found.reversals) == (np.diff(np.sign(found.rod_load[:-1])) != 0).sum() > 2
    at = np.interp(found.reversals, found.load_angle, found.rod_load)
    assert np.abs(at).max() < 2e-3 * np.abs(found.rod_load).max()
    assert len(read_cycle(twin).reversals) == 2


@pytest.mark.parametrize("flight", [0, 1, 3])
def test_a_reversal_through_flight_is_one(flight):
    """Tension, no load, compression: a change of side where load comes back; a dip to 0 is none."""
    zeros = [0.0] * flight
    load = np.array([2.0, 2.0, *zeros, -2.0, -2.0, *zeros, -2.0])
    turns = 3.0 + np.arange(load.size) / 100
    at = 1 + flight if flight else 1.5
    assert find_reversals(turns, load) == pytest.approx((3.6 * at,))


def test_valve_events_are_the_corners_of_the_gas_cycle(sensed):
    """Suction opens at 38.95 degrees and discharge at 294.2 (Eq. 13 of the paper)."""
    events = {name: angle for angle, name in read_cycle(sensed).events}
    corners = np.degrees(record_of(sensed)["corners"])
    assert events == {
        "discharge closes": 0.0,
        "suction opens": pytest.approx(corners[0]),
        "suction closes": pytest.approx(180.0),
        "discharge opens": pytest.approx(corners[2]),
    }
    assert corners[[0, 2]] == pytest.approx([38.95, 294.2], abs=0.1)
    whole = run(solve={**SOLVE, "duration_rev": 1, "settle_rev": 0})
    assert read_cycle(whole).events == read_cycle(sensed).events
    driven = run(load="spring")
    at, names = zip(*read_cycle(driven).events, strict=True)
    assert names == ("cam: dwell begins", "cam: dwell ends") * 2
    cam, inside = Cam(record_of(driven)), np.radians(np.array(at) + 20.0)
    dwells = cam.follower(inside) == cam.follower(inside + 1e-3)
    assert dwells.tolist() == [True, False, True, False]
    assert read_cycle(run(load="none")).events == ()


def test_events_of_two_ends_are_told_apart(sensed, monkeypatch):
    """A cylinder's phase is its head end's plus four times its crank end's."""
    turn = 0.12
    edges = np.append(np.add.outer(range(4), [0.0, 0.1, 0.5, 0.8]).ravel(), 4.0) * turn
    phases = np.tile([0 + 4 * 2, 1 + 4 * 2, 2 + 4 * 0, 3 + 4 * 1], 4)
    monkeypatch.setattr("compressor.analysis.cycle.segments", lambda p, end: (edges, phases))
    assert [(round(at), name) for at, name in read_cycle(sensed).events] == [
        (0, "crank suction closes"), (0, "head discharge closes"), (36, "head suction opens"),
        (180, "crank discharge closes"), (180, "head suction closes"),
        (288, "crank suction opens"), (288, "head discharge opens"),
    ]  # fmt: skip
    spans = split_events(read_cycle(sensed).events)
    assert {lane: np.round(own).tolist() for lane, own in spans.items()} == {
        "suction open, head end": [[36, 180]], "suction open, crank end": [[288, 360]],
        "discharge open, head end": [[288, 360]], "discharge open, crank end": [[0, 180]],
    }  # fmt: skip


@pytest.fixture(scope="module")
def twin(sensed):
    return healthy_twin(sensed)


@pytest.fixture(scope="module")
def drawn(sensed, twin):
    return draw_analyst(sensed, twin)


def test_the_caption_has_the_numbers(sensed, twin, drawn):
    found = drawn
    told = dict(found.numbers)
    record = sensed["sensor_acceleration"].values[3072:]
    peak, at = np.abs(record).max(), 360 * np.abs(record).argmax() / 3072
    ideal = np.abs(twin["sensor_acceleration"].values[3072:]).max()
    assert "record of the sensor: guide, along y" in found.sentence
    words = f"{spell(peak)} m/s² ({spell(peak / 9.80665)} g) at {at:.0f}°"
    assert told["greatest acceleration"] == words
    whole = spell(sensed["sensor_peak"], "m/s²")
    assert told["over all settled revolutions"].startswith(f"sensor peak {whole}")
    step = f"along y, every {360 / 3072:.3g}°, and rod load below, every 0.3°; peaks are of these"
    assert step in found.sentence
    assert told["rms"] == spell(math.sqrt(np.mean(record**2)), "m/s²")
    assert told["greatest without clearance"] == spell(ideal, "m/s²")
    load = frame_forces(sensed)["rod_load"][2400:3601] / 1e3
    assert told["rod load"] == f"{spell(load.min())} to {spell(load.max())} kN"
    assert told["events"].startswith("discharge closes at 0°, suction opens at 39°, suction closes")
    mine = [one.crank_angle for one in impacts(sensed) if one.revolution == 3]
    assert read_cycle(sensed).struck.keys() == {"big_end"}
    np.testing.assert_array_equal(read_cycle(sensed).struck["big_end"], mine)
    assert told["impacts at the big end"].startswith(f"{mine[0]:.0f}°")
    quiet = run(joint="none", clearance_mm=0, load="none", contact={}, machine={"speed_rpm": 60})
    assert "impacts" not in draw_analyst(quiet, None).caption


def test_all_that_is_marked_is_in_the_table(sensed, drawn):
    figure = drawn.figure
    found = read_cycle(sensed)
    strip, vibration, load = panels_of(figure)
    lanes = ["suction open", "discharge open", "impacts, big end", "reversals"]
    assert [*strip.y.ticktext] == lanes
    angles = {name: angle for angle, name in found.events}
    open_at = {trace.name: trace.x.tolist() for trace in strip.traces[:2]}
    assert open_at == {
        "suction open": [angles["suction opens"], angles["suction closes"]],
        "discharge open": [angles["discharge opens"], 360.0],
    }
    lines = [rule.x0 for rule in load.rules if "domain" in rule.yref]
    assert sorted(lines) == sorted([*found.reversals, *(angle for angle, _ in found.events)])
    assert vibration.title == "record of the sensor: guide, along y"
    assert listed(figure) == ["this job", "the same machine without clearance"]
    head = next(csv.reader(io.StringIO(as_csv(figure))))
    at = head.index("events: reversals: crank angle (°), 0 = top dead centre")
    assert head[at + 1] == "events: reversals"  # was "bars: a valve is open: reversals: "
    for text in ("a (m/s²)", "F_r (kN)", "impacts, big end"):
        assert any(text in one for one in head)


def test_gas_and_inertia_make_the_rod_load():
    """Of a machine without clearance, and with it: Newton's law of the crosshead."""
    for worn in ({}, {"joint": "both", "clearance_mm": 0.1}):
        run = simulate(Case.from_values({"load": "gas"} | worn))
        degrees, found = read_signals(run)
        assert degrees[-1] - degrees[0] == pytest.approx(360.0)
        assert np.abs(found["rod_load"]).max() > 3e3
        both = found["load"] + found["inertia"]
        np.testing.assert_allclose(found["rod_load"], both, atol=1e-6, rtol=1e-6)
