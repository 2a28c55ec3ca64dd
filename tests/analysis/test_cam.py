"""The cam of the spring load: closed as used, open as printed."""

import math

import numpy as np
import pytest

from compressor.analysis.cam import Cam
from compressor.cases.case import Case
from compressor.solve.si_record import record

CAM = Cam(record(Case()))
ANGLES = np.linspace(0, 2 * math.pi, 7201)


def test_the_cam_closes():
    assert CAM.follower(np.array([0.0, 2 * math.pi - 1e-9])) == pytest.approx(0, abs=1e-9)
    assert CAM.follower(ANGLES).max() == pytest.approx(0.120)
    assert np.abs(np.diff(CAM.follower(ANGLES))).max() < 2e-4


def test_a_cam_of_another_stroke_closes_too():
    """Where the follower's lift, 2R less the stroke, is not the stroke."""
    cam = Cam(record(Case.from_values({"spring": {"stroke_mm": 90}})))
    profile = cam.follower(ANGLES)
    assert profile.max() == pytest.approx(0.150)
    assert np.abs(np.diff(profile)).max() < 2e-4
    _, bottom, fall = cam.p.corners
    assert np.ptp(cam.follower(np.linspace(bottom, fall, 99)[1:-1])) == 0.0


@pytest.mark.parametrize(
    ("degrees", "s_mm"), [(50, 0), (84.26, 0), (180, 120), (250, 120), (355, 0.2)]
)
def test_profile(degrees, s_mm):
    assert CAM.follower(math.radians(degrees)) * 1e3 == pytest.approx(s_mm, abs=0.5)


def test_the_printed_cam_does_not_close():
    profile = CAM.printed_follower(ANGLES[:-1]) * 1e3
    _, _, compression = CAM.gas_corners
    fall = CAM.printed_follower(np.array([compression + 1e-9]))[0] * 1e3
    assert profile.max() == pytest.approx(208.7, abs=0.05)
    assert fall == pytest.approx(81.3, abs=0.05)


def test_contour_has_the_base_circle_and_the_stroke():
    radius = np.hypot(*CAM.contour(ANGLES, 0.2))
    assert radius.min() == pytest.approx(0.2)
    assert radius.max() == pytest.approx(0.32)
