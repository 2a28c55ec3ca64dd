"""Table and figure of what was followed: of the logistic map, in place of a machine."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.metrics import JOINTS
from compressor.report.figures.pictures import render
from compressor.studies.follow.figure import (
    FAILED_NAME,
    PERIODS,
    ROWS_OF,
    draw_followed,
    find_spans,
    period_rows,
    table,
)

POINTS = 64
OVER = "clearance_mm"
VALUES = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]


def orbit(r):
    """Points of the map after a transient, their period (nan: none up to 16), the exponent."""
    x, points = 0.3, np.empty(POINTS)
    for i in range(2000 + POINTS):
        x = r * x * (1 - x)
        points[max(i - 2000, 0)] = x
    rates = np.log(np.abs(r * (1 - 2 * points)))
    period = next((p for p in range(1, 17) if abs(points[p] - points[0]) < 1e-6), math.nan)
    return points, period, rates.mean(), 2 * rates.std() / math.sqrt(points.size)


def made(values=None, joints=("big_end",), ways=("up", "down")):
    """What was followed over the clearance (mm) of these joints, from one period to chaos."""
    values = np.geomspace(0.01, 1.0, 40) if values is None else np.asarray(values)
    shape, dims = (len(ways), len(values)), ("direction", OVER)
    section = np.full((*shape, POINTS, 2, 4), np.nan)
    numbers = {name: np.full(shape, np.nan) for name in ("period", "exponent", "error")}
    for way, clearance in np.ndindex(shape):
        r = 2.8 + 1.1 * np.log(values[clearance] / 0.01) / np.log(100.0) - 0.12 * way
        points, *found = orbit(r)
        count = POINTS if math.isnan(found[0]) else found[0]
        for joint in joints:
            section[way, clearance, :count, JOINTS.index(joint)] = 1e-3 * points[:count, None]
        for array, number in zip(numbers.values(), found, strict=True):
            array[way, clearance] = number
    regime = np.where(np.isnan(numbers["period"]), "chaotic", "periodic")
    gaps = np.where(np.isin(JOINTS, joints), np.linspace(0, 0.4, len(values))[:, None], np.nan)
    data = xr.Dataset(
        {
            "section": ((*dims, "revolution", "joint", "coordinate"), section),
            "period": (dims, numbers["period"]),
            "lyapunov_exponent": (dims, numbers["exponent"]),
            "lyapunov_exponent_error": (dims, numbers["error"]),
            "regime": (dims, regime.astype("<U9")),
            "contact_loss_fraction": ((*dims, "joint"), np.broadcast_to(gaps, (*shape, 2))),
            "status": (dims, np.full(shape, "ok").astype("<U9")),
            "reason": (dims, np.full(shape, "").astype("<U24")),
        },
        {
            "direction": [*ways], "joint": [*JOINTS], "coordinate": ["x", "y", "x_rate", "y_rate"],
            OVER: (OVER, values, {"units": "mm", "long_name": "radial clearance"}),
        },
        {"over": OVER, "log": 1},
    )  # fmt: skip
    if len(ways) > 1:
        data["differs"] = data["confirmed"] = (OVER, np.zeros(len(values), int))
    return data


def failed(data, direction, places, reason="step_underflow"):
    """The same with failed values."""
    gone, at = data.copy(deep=True), ([*data["direction"].values].index(direction), places)
    for name in ("section", "period", "lyapunov_exponent", "lyapunov_exponent_error"):
        gone[name][at] = np.nan
    gone["status"][at], gone["reason"][at], gone["regime"][at] = "failed", reason, ""
    return gone


@pytest.fixture(scope="module")
def data():
    return made()


def names(drawing):
    return [one.name for one in drawing.legend]


def points(panel):
    """Finite points of a panel's marks."""
    found = [np.column_stack((one.x, one.y)) for one in panel.traces if one.is_points]
    return [xy[np.isfinite(xy).all(axis=1)] for xy in found]


# The figure


def test_points_are_the_stored_ones(data):
    panel = draw_followed(data).panels[0]
    for direction, drawn in zip(("up", "down"), points(panel), strict=True):
        stored = data["section"].sel(direction=direction, joint="big_end", coordinate="x").values
        there = np.isfinite(stored)
        x = np.repeat(data[OVER].values, POINTS).reshape(stored.shape)
        np.testing.assert_allclose(drawn, np.column_stack((x[there], 1e3 * stored[there])))
    assert panel.y.title == "$e_x$ (mm)"
    assert panel.x.log


def test_each_worn_joint_has_its_panels():
    machine = made(np.linspace(0.2, 0.4, 5), JOINTS, ("up",))
    drawing = draw_followed(machine, "Unit 3")
    assert drawing.title == "Unit 3"
    assert len(drawing.panels) == 6
    stored = machine["section"].sel(joint="small_end", coordinate="x").values
    np.testing.assert_allclose(
        points(drawing.panels[1])[0][:, 1], 1e3 * stored[np.isfinite(stored)]
    )
    np.testing.assert_allclose(points(drawing.panels[-1])[0][:, 1], np.linspace(0, 40, 5))
    assert drawing.panels[-1].title == "time without dry contact, small end"
    assert names(drawing) == ["up"]


def test_periods_stand_in_their_rows(data):
    chain = data.sel(direction="up").copy(deep=True)
    chain["regime"][:6] = ["periodic"] * 3 + ["undecided", "chaotic", ""]
    chain["period"][:6] = [1, 3, 16, np.nan, np.nan, np.nan]
    chain["status"][5] = "failed"
    expected = [PERIODS[1], PERIODS[3], PERIODS[16], ROWS_OF["undecided"], ROWS_OF["chaotic"],
                np.nan]  # fmt: skip
    np.testing.assert_array_equal(period_rows(chain)[:6], expected)
    heights = [*PERIODS.values(), *ROWS_OF.values()]
    assert heights == sorted(heights)


def test_exponents_have_their_bars_and_a_zero_line(data):
    unsure = data.copy(deep=True)
    unsure["lyapunov_exponent_error"][0, 3] = np.inf
    panel = draw_followed(unsure).panels[2]
    up = panel.traces[0]
    np.testing.assert_allclose(up.y, data["lyapunov_exponent"].values[0])
    bars = data["lyapunov_exponent_error"].values[0].copy()
    bars[3] = np.nan
    np.testing.assert_allclose(up.errors, [bars, bars])
    assert [note.y for note in panel.notes] == [0.0]


def test_failed_values_are_marked_in_every_panel(data):
    drawing = draw_followed(failed(data, "down", [3, 30]))
    for panel in drawing.panels:
        (mark,) = [trace for trace in panel.traces if trace.style.marker == "x"]
        np.testing.assert_allclose(mark.x, data[OVER].values[[3, 30]])
        low, high = panel.limits("y")
        assert (low < mark.y).all()
        assert (mark.y < high).all()
    assert FAILED_NAME in names(drawing)
    assert FAILED_NAME not in names(draw_followed(data))


def test_all_axes_say_what_they_are(data):
    drawing = draw_followed(data)
    assert all(panel.title for panel in drawing.panels)
    assert drawing.panels[-1].x.title == "radial clearance (mm)"
    assert names(drawing) == ["up", "down"]
    assert render(drawing, "png").startswith(b"\x89PNG")


# The table


def course(up, down=()):
    """A machine over six clearances with these motions: a number is a period."""
    data = made(VALUES, ways=("up", "down")[: 1 + bool(down)])
    for i, chain in enumerate([up, down] if down else [up]):
        for j, motion in enumerate(chain):
            is_period = isinstance(motion, int)
            data["regime"][i, j] = "periodic" if is_period else motion
            data["period"][i, j] = motion if is_period else np.nan
    data["lyapunov_exponent"][:] = np.array([-2.0, -1.0, np.nan, 0.5, 0.25, 1.0])
    return data


def test_neighbours_with_one_motion_are_a_line():
    machine = failed(course([1, 1, 2, "chaotic", "chaotic", 1]), "up", [5])
    found = [(one.first, one.last, one.values, one.motion) for one in find_spans(machine)]
    assert found == [
        (0.1, 0.2, 2, "period 1"), (0.3, 0.3, 1, "period 2"), (0.4, 0.5, 2, "chaotic"),
        (0.6, 0.6, 1, "failed step_underflow"),
    ]  # fmt: skip
    assert table(machine) == [
        "direction  radial clearance (mm)  values  motion                 exponent (1/rev)",
        "up         0.1 to 0.2             2       period 1               -2.00 to -1.00",
        "up         0.3                    1       period 2",
        "up         0.4 to 0.5             2       chaotic                0.25 to 0.50",
        "up         0.6                    1       failed step_underflow",
    ]


def test_where_up_and_down_differ_is_below_and_what_was_confirmed():
    machine = course([1] * 6, [1] * 6)
    assert len(table(machine)) == 3
    machine["differs"] = OVER, [0, 1, 1, 0, 1, 0]
    assert table(machine)[3:] == ["up and down differ at 3 of 6 values: 0.2, 0.3, 0.5"]
    machine["confirmed"] = OVER, [0, 1, 0, 0, 1, 0]
    assert table(machine)[4:] == ["two motions are confirmed at 2 of 6 values: 0.2, 0.5"]
