"""The first screen: which changes are told, by which numbers, and in which words."""

import numpy as np
import pytest
import xarray as xr
from swept_made import grid

from compressor.report.answer import finding, name_jobs, rank_findings, study_findings, worn_joints
from compressor.report.figures.sweep_data import MEASURES
from compressor.report.page import format_measure, value_cell

FIRST = {one.variable: one for one in reversed(MEASURES)}  # of joints and axes the first
PEAK, RMS, FORCE, LOSS, DEPTH, REVERSAL, TENSION, RATE = (FIRST[name] for name in (
    "peak_acceleration", "rms_acceleration", "peak_contact_force", "contact_loss_fraction",
    "max_penetration", "rod_load_reversal_angle", "peak_rod_load_tension", "impacts_per_rev",
))  # fmt: skip
SMALL_END = [m for m in MEASURES if m.variable == "peak_contact_force"][1]
KNOCKS = {m.joint: m for m in MEASURES if m.variable == "knock"}
NAMES = ["a", "b", "c"]


SAME = "nearly the same in all jobs"


@pytest.mark.parametrize(
    ("measure", "values", "bars", "expected"),
    [
        (PEAK, [300, 200, 500], [1, 2, 3], ("200 ± 2 m/s²", "b", "500 ± 3 m/s²", "c", "2.5 times")),
        # within the bars, and by some percent: it was told as 1.01 times, and as 1 times
        (PEAK, [200, 202, 203], [2] * 3, None),
        (PEAK, [200, 201, 202], [0.01] * 3, None),
        (TENSION, [-200, -202, -201], [0.01] * 3, None),
        (PEAK, [200, 202, 215], [2] * 3, ("200 ± 2 m/s²", "a", "215 ± 2 m/s²", "c", "1.07 times")),
        (PEAK, [200, 201, 211], [0.01] * 3, ("200 m/s²", "a", "211 m/s²", "c", "1.05 times")),
        # what a chaotic motion's infinite bar or a failed job leave unknown does not count
        (PEAK, [200, 900, 300], [1, np.inf, 1],
         ("200 ± 1 m/s²", "a", "300 ± 1 m/s²", "c", "1.5 times")),
        (PEAK, [np.nan] * 3, [np.nan] * 3, None),
        (REVERSAL, [np.nan] * 3, [np.nan] * 3, None),
        # no ratio is formed across zero
        (TENSION, [-2, 4, 1], [0.1] * 3, ("-2.0 ± 0.1 kN", "a", "4.0 ± 0.1 kN", "b", "")),
        (TENSION, [-2, -4, -2], [0.1] * 3, ("-4.0 ± 0.1 kN", "b", "-2.0 ± 0.1 kN", "a", "")),
        # a bar below four digits: it was told as 394.78 m/s² ± 5e-07 %
        (PEAK, [394.784176, 784.7], [2e-6, 1.3],
         ("394.8 m/s²", "a", "784.7 ± 1.3 m/s²", "b", "1.99 times")),
        # what always stands there
        (REVERSAL, [163.4, 164, 163.6], [0.01] * 3, ("", "", "163.4 to 164 °", "", SAME)),
        (REVERSAL, [150, np.nan, np.nan], [0.1] * 3,
         ("", "", "150.0 ± 0.1 °", "", "known of 1 of 3 jobs")),
        (REVERSAL, [150, np.nan, 150], [0.1] * 3,
         ("", "", "150.0 ± 0.1 °", "", "known of 2 of 3 jobs, the same within its error bars")),
        (REVERSAL, [150] * 3, [np.inf] * 3, ("", "", "unknown", "", "within its error bar")),
    ],
)  # fmt: skip
def test_a_change_is_told_by_its_ends(measure, values, bars, expected):
    found = finding(measure, np.array(values, float), np.array(bars, float), NAMES)
    told = found and (found.low, found.at_low, found.high, found.at_high, found.change)
    assert told == expected
    if found and found.change.endswith("times"):
        assert found.rank == pytest.approx(np.log(float(found.change.split()[0])), abs=0.01)


@pytest.fixture
def study():
    axes = {"speed_rpm": [500.0, 600.0], "clearance_mm": [0.1, 0.2, 0.3]}
    made = grid(axes, lambda n, c: (1.5 - n / 1000) * 50 * 2 ** (10 * c))  # 100, 200, 400; 90 ...
    return made.drop_vars(["rms_acceleration", "rms_acceleration_error"])


def test_a_study_s_findings_name_its_points(study):
    (found,) = study_findings(study)
    assert found.at_low == "speed 600 rpm, clearance 0.1 mm"
    assert found.at_high == "speed 500 rpm, clearance 0.3 mm"
    assert name_jobs(study.isel(speed_rpm=[0]))[1] == "clearance 0.2 mm"
    assert len(name_jobs(study)) == 6
    (alone,) = study_findings(study.isel(speed_rpm=[0], clearance_mm=[0]))
    assert (alone.low, alone.high) == ("", "100 ± 1 m/s²")


def test_the_worn_joint_s_force_and_the_reversal_stand_there_though_they_do_not_change():
    steady, none = np.full(3, 150.0), np.zeros(3)
    rows = [
        (PEAK, np.array([100.0, 200.0, 300.0]), none),
        (LOSS, np.array([0.0, 0.0, 5.0]), none),
        (TENSION, np.array([1.0, 2.0, 9.0]), none),
        (RMS, np.array([1, 2, 9]), none),
        (FORCE, np.array([1.0, 500.0, 900.0]), none),
        (SMALL_END, np.array([80.0, 82.2, 81.0]), none),
        (REVERSAL, steady, np.full(3, 0.1)),
        (KNOCKS["big_end"], np.array([0.001, 0.02, 0.03]), none),
        (KNOCKS["small_end"], np.array([0.1, 0.2, 0.7]), none),
        (RATE, np.array([0.0, 0.0, 999.0]), none),  # counted, and of no ratio: left out
        (DEPTH, np.array([-30.0, 2.0, 8.0]), none),
    ]
    found = rank_findings(rows, NAMES, {"small_end"})
    assert [one.title for one in found] == [
        "Knock (limit 0.25), small end", "Time without dry contact, big end",
        "Peak rod load, tension", "Rms acceleration",
        "Peak contact force, small end", "Rod load reversal",
    ]  # fmt: skip
    assert found[0].change == "1 of 3 jobs knocks; big end: none of 3 jobs knocks"
    assert found[1].change == "from nearly nothing"  # what appears ranks before what grows
    assert (found[-2].high, found[-2].change) == ("80 to 82.20 kN", "nearly the same in all jobs")
    assert (found[-1].low, found[-1].high) == ("", "150.0 ± 0.1 °")
    assert found[-1].change == "the same in all jobs within its error bars"


def knocking(knock, error, mean=None, regime="periodic", turns=20):
    """A study of the small end's knock over its clearance, 0.1, 0.2 ... mm, out of order."""
    count = len(knock)

    def of_joint(values):
        each = np.stack([np.zeros(count), np.array(values, float)], axis=1)
        return xr.DataArray(each, {"joint": ["big_end", "small_end"]}, ("clearance_mm", "joint"))

    regimes = np.broadcast_to(np.array(regime, object), count)
    sizes = {"clearance_mm": 0.1 * np.arange(1, count + 1)}
    data = grid(sizes, lambda c: c, regime=regimes).assign(
        knock=of_joint(knock), knock_error=of_joint(error),
        knock_mean=of_joint(knock if mean is None else mean),
        knock_mean_standard_error=of_joint([0.005] * count),
        revolutions=("clearance_mm", np.full(count, float(turns))),
        max_penetration=of_joint([1e-6] * count),
    )  # fmt: skip
    return study_findings(data.isel(clearance_mm=np.roll(np.arange(count), 1)))[0]


@pytest.mark.parametrize(
    ("knocks", "change"),
    [
        (([0.1, 0.24, 0.4, 0.7], [0.01, 0.02, 0.01, 0.01]),
         "2 of 4 jobs knock, from clearance 0.3 mm on, 1 may"),
        (([0.7, 0.24, 0.1], [0.0, np.nan, 0.0]), "1 of 3 jobs knocks, up to clearance 0.1 mm"),
        (([0.7, 0.1, 0.7], [0.0] * 3), "2 of 3 jobs knock"),
        (([0.3, 0.4], [0.01, 0.01]), "2 of 2 jobs knock"),
        (([0.3, 0.4], [0.1, 0.2]), "none of 2 jobs knocks, 2 may"),
        (([0.3], [0.01]), "it knocks"),
        (([0.3], [0.1]), "it may knock"),
        (([0.3], [np.inf]), "it may knock"),
        (([0.2], [0.01]), "it does not knock"),
        # a chaotic job: by its mean over revolutions, where these are enough
        (([0.9], [np.inf], [0.4], "chaotic"), "it knocks"),
        (([0.9], [np.inf], [0.1], "chaotic"), "it does not knock"),
        (([0.9], [np.inf], [0.4], "chaotic", 9), "it may knock"),
        (([0.1, 0.9], [0.01, np.inf], [0.1, 0.4], ["periodic", "chaotic"]),
         "1 of 2 jobs knocks, from clearance 0.2 mm on"),
    ],
)  # fmt: skip
def test_only_a_knock_beyond_its_bar_counts_and_from_where_on(knocks, change):
    found = knocking(*knocks)
    assert found.change == change
    if knocks[2:] == ([0.4], "chaotic"):
        assert found.high == "0.400 ± 0.011"  # of Student's t
    elif knocks[4:]:
        assert found.high == "unknown"
    elif len(knocks[0]) == 4:
        assert (found.at_low, found.at_high) == ("clearance 0.1 mm", "clearance 0.4 mm")


def test_joints_with_clearance_are_found_in_any_job(study):
    assert worn_joints(study) == set()
    depth = np.zeros((2, 3, 2))
    depth[0, 0] = np.nan  # a job that failed
    depth[1, 2, 1] = -3e-6  # a film bears: metal never touches
    dims = (*study["status"].dims, "joint")
    data = study.assign(max_penetration=(dims, depth)).assign_coords(joint=["big_end", "small_end"])
    assert worn_joints(data) == {"small_end"}


@pytest.mark.parametrize(
    ("value", "bar", "text"),
    [(784.7, 1.3, "784.7 ± 1.3"), (1234.5678, 1.3, "1235 ± 2"), (12345.6, 0.1, "12350"),
     (12345.6, 14.0, "12350 ± 20"), (1234.5678, 2000.0, "unknown"), (82.2083, np.nan, "82.21"),
     (394.784, 0.0, "394.8"), (0.0, np.nan, "0"), (3.0, np.nan, "3"), (67.5, np.nan, "67.50"),
     (0.20641, np.nan, "0.2064"), (7.15e-12, np.nan, "7.150e-12"), (np.nan, np.nan, "–"),
     (-394.784, np.nan, "-394.8"), (2.5e9, np.nan, "2.500e+09"), (np.inf, np.nan, "inf")],
)  # fmt: skip
def test_a_page_has_four_digits(value, bar, text):
    assert format_measure(PEAK, value, bar) == text
    assert value_cell(np.nan).text == value_cell("").text == "–"  # of a key that a job has not
