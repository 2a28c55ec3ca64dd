"""The cam of the spring load: closed as used, open as printed, and its design checks."""

import math

import numpy as np
import pytest

from compressor.analysis import cam
from compressor.cases.case import Case
from compressor.solve.si_record import record

P = record(Case())
ANGLES = np.linspace(0, 2 * math.pi, 7201)


def test_the_cam_closes():
    assert cam.cam_profile(P, np.array([0.0, 2 * math.pi - 1e-9])) == pytest.approx(0, abs=1e-9)
    assert cam.cam_profile(P, ANGLES).max() == pytest.approx(0.120)
    assert np.abs(np.diff(cam.cam_profile(P, ANGLES))).max() < 2e-4


def test_a_cam_of_another_stroke_closes_too():
    """Where the follower's lift, 2R less the stroke, is not the stroke."""
    p = record(Case.from_values({"spring": {"stroke_mm": 90}}))
    profile = cam.cam_profile(p, ANGLES)
    assert profile.max() == pytest.approx(0.150)
    assert np.abs(np.diff(profile)).max() < 2e-4
    _, bottom, fall = p.corners
    assert np.ptp(cam.cam_profile(p, np.linspace(bottom, fall, 99)[1:-1])) == 0.0


@pytest.mark.parametrize(
    ("degrees", "s_mm"), [(50, 0), (84.26, 0), (180, 120), (250, 120), (355, 0.2)]
)
def test_profile(degrees, s_mm):
    assert cam.cam_profile(P, math.radians(degrees)) * 1e3 == pytest.approx(s_mm, abs=0.5)


def test_slope_is_the_derivative():
    inner = ANGLES[
        np.abs(np.subtract.outer(ANGLES, [*P.corners, 0, 2 * math.pi])).min(axis=1) > 0.01
    ]
    h = 1e-6
    difference = (cam.cam_profile(P, inner + h) - cam.cam_profile(P, inner - h)) / (2 * h)
    assert cam.cam_slope(P, inner) == pytest.approx(difference, abs=1e-8)


def test_the_printed_cam_does_not_close():
    profile = cam.printed_profile(P, ANGLES[:-1]) * 1e3
    _, _, compression = cam.printed_corners_of_gas(P)
    fall = cam.printed_profile(P, np.array([compression + 1e-9]))[0] * 1e3
    assert profile.max() == pytest.approx(208.7, abs=0.05)
    assert fall == pytest.approx(81.3, abs=0.05)


def test_contour_has_the_base_circle_and_the_stroke():
    radius = np.hypot(*cam.contour(P, ANGLES, 0.2))
    assert radius.min() == pytest.approx(0.2)
    assert radius.max() == pytest.approx(0.32)


def test_base_radius_meets_the_pressure_angle():
    allowed = math.radians(30)
    enough = cam.least_base_radius(P, allowed)
    steepest = [
        np.abs(cam.pressure_angle(P, np.linspace(0, 2 * math.pi, 20001), r)).max()
        for r in (enough, 0.99 * enough)
    ]
    assert steepest[0] == pytest.approx(allowed, abs=1e-6)
    assert steepest[1] > allowed


@pytest.mark.parametrize(
    ("quantity", "printed", "follows"),
    [
        ("spring stroke h", 120, 158.7),
        ("spring force in discharge P_max", 3200, 3086.6),
        ("follower's rise, gas corners", 120, 208.7),
        ("follower's fall, gas corners", 120, 81.3),
        ("follower's stroke, closed cam", 120, 120),
    ],
)
def test_printed_beside_what_follows(quantity, printed, follows):
    row = next(c for c in cam.comparisons(P) if c.quantity == quantity)
    assert (row.printed, row.follows) == pytest.approx((printed, follows), abs=0.05)
