"""The cam of the spring load, closed as used; as printed: tests/report."""

import math

import numpy as np
import pytest

from compressor.analysis.cam import Cam
from compressor.cases.case import Case
from compressor.solve.si_record import record

ANGLES = np.linspace(0, 2 * math.pi, 7201)


@pytest.mark.parametrize(("stroke_mm", "lift"), [(120, 0.120), (90, 0.150)])
def test_a_cam_of_any_stroke_closes(stroke_mm, lift):
    """Where the follower's lift, 2R less the stroke, is not the stroke, too."""
    cam = Cam(record(Case.from_values({"spring": {"stroke_mm": stroke_mm}})))
    profile = cam.follower(ANGLES)
    assert profile[[0, -2]] == pytest.approx(0.0, abs=1e-4)
    assert profile.max() == pytest.approx(lift)
    radius = np.hypot(*cam.contour(ANGLES))
    assert (radius.min(), radius.max()) == pytest.approx((0.2, 0.2 + lift))
    assert np.abs(np.diff(profile)).max() < 2e-4
    _, bottom, fall = cam.p.corners
    assert np.ptp(cam.follower(np.linspace(bottom, fall, 99)[1:-1])) == 0.0
