"""The groups of a case file that say what stands on the foundation, and what listens to it."""

from dataclasses import dataclass, replace
from typing import ClassVar

from compressor.cases.parameter import choice, documented, parameter
from compressor.cases.readers import (
    ALONG_X,
    ALONG_Y,
    CASING,
    CASING_HEARD,
    RANDOM,
    ROCKING,
    STEADY,
)

OURS = "ours"
BODIES_PER_CASING = 25.0  # mass of the body over the modal mass of a casing mode


@documented
@dataclass(frozen=True)
class Body:
    """The compressor's rigid body on its foundation; a case's `body`, None unless a case asks.

    It is driven one way: the machine's forces move it, and it does not move the machine back. A
    body for which that would be wrong, since its motion would change the force by more than 30 %
    at the speed's first two orders, is refused. `True` stands for the defaults:

    >>> import compressor
    >>> compressor.Case.from_values({"body": True}).body.mass_kg
    500.0
    """

    freedoms: str = choice(
        "xy", ("x", "y", "xy", "xy_rocking"), OURS, "how the rigid body may move"
    )
    mass_kg: float = parameter(500.0, "kg", (0, 1e7), OURS, "mass of the body", above=True)
    inertia_kg_m2: float = parameter(
        40.0, "kg m2", (0, 1e9), OURS, "its inertia about its mass centre", above=True, read=ROCKING
    )
    centre_x_mm: float = parameter(
        300.0, "mm", (-1e5, 1e5), OURS, "mass centre from the crank's", read=ROCKING
    )
    centre_y_mm: float = parameter(
        -200.0, "mm", (-1e5, 1e5), OURS, "mass centre from the crank's", read=ROCKING
    )
    frequency_x_Hz: float = parameter(
        20.0, "Hz", (0, 1e5), OURS, "natural frequency along x", above=True, read=ALONG_X
    )
    frequency_y_Hz: float = parameter(
        20.0, "Hz", (0, 1e5), OURS, "natural frequency along y", above=True, read=ALONG_Y
    )
    frequency_rocking_Hz: float = parameter(
        20.0, "Hz", (0, 1e5), OURS, "natural frequency of rocking", above=True, read=ROCKING
    )
    damping_ratio: float = parameter(0.03, "", (0, 0.99), OURS, "of the foundation", above=True)
    casing: bool = choice(
        True, (), OURS, "a casing mode at the guide and one at the main bearing, heard by sensors",
        kind="boolean", read=CASING_HEARD,
    )  # fmt: skip
    casing_mass_kg: float | None = parameter(
        None, "kg", (0, 1e6), "ours: a 25th of the body's mass", "modal mass of a casing mode",
        above=True, optional=True, read=CASING,
    )  # fmt: skip
    casing_frequency_Hz: float = parameter(
        2000.0, "Hz", (0, 1e5), OURS, "natural frequency of a casing mode", above=True, read=CASING
    )
    casing_damping_ratio: float = parameter(
        0.02, "", (0, 0.99), OURS, "damping ratio of a casing mode", above=True, read=CASING
    )
    start: str = choice(
        "steady", ("steady", "rest"), OURS,
        "steady: as if the settled revolutions had always repeated; rest: at rest at time 0",
    )  # fmt: skip


@documented
@dataclass(frozen=True)
class Sensor:
    """An accelerometer on the body, with a tacho; a case's `sensor`, None unless a case asks.

    `True` stands for the defaults:

    >>> import compressor
    >>> sensor = {"place": "bearing", "noise_m_per_s2": 0.05}
    >>> case = compressor.Case.from_values({"body": True, "sensor": sensor})
    >>> case.sensor.rate_Hz, case.sensor.noise_m_per_s2
    (25600.0, 0.05)
    """

    REPORTED: ClassVar[float] = 1e-3  # of a record's samples: clipping is reported from here on

    place: str = choice(
        "guide", ("guide", "bearing", "body"), OURS,
        "crosshead guide at mid-stroke, main bearing, or the body's mass centre",
    )  # fmt: skip
    direction: str = choice("y", ("x", "y"), OURS, "what it measures along")
    rate_Hz: float = parameter(25600.0, "Hz", (0, 1e6), OURS, "sampling rate", above=True)
    low_pass_Hz: float | None = parameter(
        None, "Hz", (0, 1e6), "usual: rate_Hz / 2.56", "anti-aliasing filter's corner",
        above=True, optional=True,
    )  # fmt: skip
    mounting_Hz: float = parameter(
        25000.0, "Hz", (0, 1e6), "usual: on a stud", "mounting resonance", above=True
    )
    mounting_damping_ratio: float = parameter(
        0.03, "", (0, 0.99), OURS, "damping ratio of the mounting", above=True
    )
    range_m_per_s2: float = parameter(
        490.0, "m/s2", (0, 1e6), "usual: 50 g", "beyond it the signal is clipped", above=True
    )
    noise_m_per_s2: float = parameter(
        0.0015, "m/s2", (0, 1e6), "usual: piezoelectric", "rms of white noise up to half the rate"
    )
    speed_jitter: float = parameter(
        0.0, "", (0, 0.1), OURS,
        "rms of the speed's relative deviation, drawn once a revolution and smooth between: 0.93 "
        "of it at all times, 0.81 of it in a revolution's mean speed", read=STEADY,
    )  # fmt: skip
    seed: int = parameter(
        1, "", (0, 2**31), OURS, "of noise and jitter", kind="integer", read=RANDOM
    )
    length_rev: int | None = parameter(
        None, "", (1, 10_000), "the settled ones", "revolutions of the record; more of them repeat",
        kind="integer", optional=True, read=STEADY,
    )  # fmt: skip

    def report_clipping(self, fraction: float) -> str:
        """Return a sentence about a record with a fraction clipped; "" below a thousandth."""
        if not fraction >= self.REPORTED:
            return ""
        return (
            f"{100 * fraction:.3g} % of the sensor's samples are clipped at its range, "
            f"{self.range_m_per_s2:g} m/s²: levels and spectra are those of the clipped record; "
            "raise sensor.range_m_per_s2"
        )


def filled_body(body: Body) -> Body:
    """Return a body with the modal mass of its casing, by default a 25th of the body's mass."""
    if body.casing_mass_kg is not None:
        return body
    return replace(body, casing_mass_kg=body.mass_kg / BODIES_PER_CASING)
