"""What others have published, and what comes out here: `make validation`.

Each row has what was expected, what was found, and how far apart the two may be. Nothing here is
fitted; the machines and equations are those of tests/published.py.
"""

import math
import sys

import numpy as np
import published
from result_pages import keep, provenance, run_campaign
from scipy.interpolate import CubicSpline

from compressor.analysis import rubbing_work
from compressor.cases.case import Case
from compressor.cases.materials import contact_stiffness
from compressor.solve import simulate
from compressor.solve.bearing import reynolds
from compressor.solve.search import predictability_horizon

# crank speed (rad/s) and height over clearance at TIMES, by three bodies with multipliers and
# generalised-alpha steps of 2 and 1 µs, extrapolated (the model: tests/campaigns/peers/guide.py of
# commit c73f74f)
EXUDYN = ((139.1158757895556, 0.07748668489982179), (120.46388168624803, 0.49439555411758845))
SICONOS = "Siconos, SliderCrankMoreauJeanDirectProjectionOSI.ref, steps of 0.1 ms"
TIMES = (1e-3, 2e-3)  # s


def row(subject, what, unit, expected, found, within, source):
    """A row: numbers as they are, `within` in their unit."""
    numbers = {"expected": float(expected), "found": float(found), "within": float(within)}
    return {"subject": subject, "what": what, "unit": unit, **numbers, "source": source}


def restitution():
    """Drops through the whole solver."""
    for law, given in published.GIVEN.items():
        for asked, expected in zip(published.ASKED, given, strict=True):
            _, rows = published.drop("small_end", 0.3, law=law, restitution=asked)
            what = f"{law}, e = {asked:g}"
            found = published.given_back(rows)
            yield row("Restitution", what, "", expected, found, 1e-3, "closed form")


def dry_joint():
    """The ideal machine of the dry joint, and its stiffness."""
    source = "Flores and Koshy"
    solve = {"duration_rev": 1, "settle_rev": 0, "output_step_deg": 0.25}
    ideal = {key: value for key, value in published.MACHINE.items() if key != "pin_radius_mm"}
    values = {"load": "none", "friction": False, "machine": ideal, "solve": solve}
    run = simulate(Case.from_values({**values, "output": {"signals": True}}))
    a, torque = run["acceleration"].values, run["crank_torque"].values
    for what, unit, expected, found, within in (
        ("least ideal acceleration", "m/s²", -19419, a.min(), 0.5),
        ("greatest ideal acceleration", "m/s²", 9696, a.max(), 0.5),
        ("greatest crank moment", "N m", 138.5, torque.max(), 0.05),
    ):
        yield row("Dry joint", what, unit, expected, found, within, source)
    contact = {
        "law": "hertz", "stiffness_N_per_mm15": published.DRY["contact"]["stiffness_N_per_mm15"]
    }  # fmt: skip
    case = Case.from_values({**published.DRY, "contact": contact, "solve": {"duration_rev": 3}})
    parted = predictability_horizon(case) / case.turn
    yield row(
        "Dry joint", "undamped: close motions separate after", "rev", 1.6, parted, 0.1, source
    )
    ours = contact_stiffness("steel", "steel", 0.0095, 0.0100, True)
    ours *= (1 - 0.29**2) / (1 - 0.3**2)  # of their Poisson's ratio
    asked = published.STIFFNESS
    yield row("Dry joint", "stiffness", "N/m^1.5", asked, ours, 1e-3 * asked, source)


def play():
    """The slider with play in its guide, before its first contact."""
    subject, source = "Guide with play", "Flores, Leine and Glocker 2010"
    run = published.guided(rtol=1e-11)
    speed = CubicSpline(run.time, run.crank_speed)(TIMES)
    height = CubicSpline(run.time, run.guide_height / 1e-3)(TIMES)
    for i, (one, other) in enumerate([(139.11588, 0.077487), (120.46388, 0.494396)]):
        at = f"at {1e3 * TIMES[i]:g} ms"
        yield row(subject, f"crank speed {at}", "rad/s", one, speed[i], 1e-5, source)
        yield row(subject, f"height over clearance {at}", "", other, height[i], 1e-5, source)
    first = CubicSpline(run.time, run.guide_gap).roots(extrapolate=False)[0]
    yield row(subject, "first contact", "ms", 2.6925, 1e3 * first, 1e-4, source)
    known = (("crank speed", "rad/s", 139.23030734, speed), ("height", "", 0.07712895696, height))
    for what, unit, expected, found in known:
        yield row(subject, f"{what} at 1 ms", unit, expected, found[0], 5e-3 * expected, SICONOS)
    for i, (one, other) in enumerate(EXUDYN):
        at, source = f"at {1e3 * TIMES[i]:g} ms", "Exudyn 1.13.6"
        yield row(subject, f"crank speed {at}", "rad/s", one, speed[i], 1e-6, source)
        yield row(subject, f"height over clearance {at}", "", other, height[i], 1e-7, source)


def elastic_rod(duration=0.008):
    """The published start of an elastic rod, by the equations that the program is held against."""
    source = "IVP test set, crank (Simeon)"
    found = published.simeon(0.0, published.POSITION, published.RATE, published.PUBLIC)
    subject = "Elastic rod"
    x = 0.45 + published.POSITION[5]
    yield row(subject, "x₃ at the start", "m", 0.450016933, x, 1e-9, source)
    spin = -0.15 * 150.0 / (0.30 + published.POSITION[5])
    yield row(subject, "φ₂' at the start", "rad/s", -74.995767, spin, 1e-6, source)
    asked = published.ACCELERATION[1]
    yield row(subject, "x₃'' at the start", "m/s²", asked, found[1], 1e-5, source)
    source = "the same equations, by SciPy's DOP853"
    for name, apart in published.rod_apart(duration).items():
        what = f"{name}, relative difference over {1e3 * duration:g} ms"
        yield row(subject, what, "", 0, apart, 1e-6, source)


def elastic_rod_at_the_end():
    """The published end of an elastic rod by these equations, and its motion up to there.

    The publication's start has nine digits, and the end follows from it within 2e-7.
    """
    subject, source = "Elastic rod", "IVP test set, crank (Simeon)"
    end = published.integrate_simeon([published.END_TIME], published.PUBLIC, 1e-9)[:, -1]
    for name, (place, expected) in published.END.items():
        unit = "rad" if name == "φ₂" else "m"
        yield row(
            subject, f"{name} at 0.1 s", unit, expected, end[place], 1e-6 * abs(expected), source
        )
    source = "the same equations, by SciPy's DOP853"
    for name, apart in published.rod_apart(published.END_TIME).items():
        yield row(subject, f"{name}, relative difference over 0.1 s", "", 0, apart, 1e-6, source)


def frame():
    """A frame that moves both ways, by Exudyn's number; and ours, driven one way, by that frame."""
    subject, source = "Frame", "Exudyn, TestModels/sliderCrankFloatingTest.py"
    what = "slider's x at 0.3 s, frame held plus frame free"
    found = published.exudyn_sliders()
    yield row(subject, what, "m", published.SLIDERS, found, published.SLIDERS_WITHIN, source)
    source = "the same equations, by SciPy's DOP853"
    ours, both_ways = np.abs(published.frame_orders())
    for i, order in enumerate((1, 2)):
        for j, axis in enumerate("xy"):
            if both_ways[i, j] > 1e-6:
                what = f"body velocity along {axis}, order {order}, corrected for one way"
                asked = both_ways[i, j]
                yield row(subject, what, "m/s", asked, ours[i, j], 1e-6 * asked, source)


def wear():
    """What rubs in a run, by its time series, against the energy that friction takes."""
    source = "Archard's law; friction's energy over a constant coefficient"
    for joint in ("big_end", "small_end"):
        run = simulate(published.rubbing(joint))
        asked, found = (
            float(run["friction_loss"] / published.COEFFICIENT),
            float(rubbing_work(run).sum()),
        )
        yield row("Wear", f"∫ F ds, {joint}", "J", asked, found, 3e-3 * asked, source)


def bearing():
    """Sommerfeld numbers and attitudes of the film, from Reynolds' equation."""
    source = "Butenschön 1976, DIN 31652"
    for ratio, eps, number, angle in published.BEARING:
        at, normal, across = f"B/D {ratio:g}, ε {eps:g}", *reynolds(eps, ratio)
        size = eps * math.hypot(normal, across)
        yield row("Journal bearing", f"So at {at}", "", number, size, 4e-3 * number, source)
        if angle:
            turned = math.degrees(math.atan2(across, normal))
            yield row("Journal bearing", f"attitude at {at}", "°", angle, turned, 0.1, source)


def main(target):
    every = (
        restitution, dry_joint, play, bearing, elastic_rod, elastic_rod_at_the_end, frame, wear,
    )  # fmt: skip
    rows = [one for made in every for one in made()]
    kept = provenance("make validation") | {"rows": rows}
    keep(target, kept)
    bad = [one for one in rows if not math.fabs(one["found"] - one["expected"]) <= one["within"]]
    print(f"{len(rows)} numbers, {len(bad)} beyond what they may differ by", *bad, sep="\n")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    np.seterr(all="ignore")
    run_campaign(main)
