"""The numbers that are known of a finished job: names, dimensions, units and phrases.

The one table of results, as `compressor.cases` has one of parameters; needs no library, so that
case files that name a metric are read at once. A new metric is a row of `TABLE`.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

JOINTS = ("big_end", "small_end")
AXES = ("x", "y")
QUANTILES = (0.5, 0.95)  # of the revolutions' greatest values
SEGMENTS = tuple(10.0 * number for number in range(36))  # of a revolution: where each begins, deg
THRESHOLDS = ("first", "second")
SIZES = {
    "joint": len(JOINTS), "axis": len(AXES), "quantile": len(QUANTILES),
    "segment": len(SEGMENTS), "threshold": len(THRESHOLDS),
}  # fmt: skip


class Bar(NamedTuple):
    """How a metric's error bar follows from another run (`compressor.solve.error_bars`).

    Shares that hold are measured (`make accuracy`). The defaults, for a metric that was not, are
    the most careful of those that were.
    """

    own: float = 5.0  # share of the metric's own difference
    path: float = 0.3  # of the distance of the time series that it is taken from
    relative: bool = True  # False: of a share, a count or a mean that may be 0
    least: float = 1e-13  # share of the metric that its bar has at least: rounding, or more


class Shown(NamedTuple):
    """How the report draws a metric: its title, and the unit with its factor from SI."""

    title: str
    unit: str
    factor: float = 1.0


class Metric(NamedTuple):
    """One row of the table: a number of a job."""

    name: str
    dims: tuple[str, ...]
    unit: str
    phrase: str  # long name
    series: str = ""  # the time series that it is taken from
    bar: Bar = Bar()
    shown: Shown | None = None  # None: not drawn
    contact: bool = False  # of a contact: without meaning at an ideal joint
    # how it comes from the run; a count grows with it, a rate is a count by revolutions
    kind: Literal["greatest", "root", "share", "count", "rate"] = "share"
    # what it is made from: sums over the dense solution, or the motion of the body and its sensor's
    # record, with an error bar; other numbers or series; the revolutions of a chaotic motion;
    # anything else of the run
    source: Literal["tally", "body", "error", "series", "statistics", "sensor", "run"] = "tally"
    when: str = ""  # what few jobs have, others are nan: a flag of the record, or another word
    joint: int = 0  # whose part of its series counts for a metric without that dimension, in JOINTS
    limit: float = math.nan  # above which it is a fault
    # of source "tally": its value, from a `compressor.solve.run_metrics.Tallied`
    made: Callable[[Any], Any] | None = None

    def is_given(self, values: Any) -> bool:
        """Return whether any of some jobs has it, by an array of values, nan where one has not."""
        return not self.when or bool((abs(values) >= 0.0).any())

    @property
    def attributes(self) -> dict[str, str]:
        """Return the unit and long name, as a stored variable has them."""
        return {"units": self.unit, "long_name": self.phrase}

    @property
    def is_pure_number(self) -> bool:
        """Return whether it has no unit: a share, a count or an angle, which may be 0."""
        return self.unit in ("1", "1/rev", "rad")

    @property
    def counted(self) -> bool:
        """Return whether it counts events: contact that grazes begins any number of times."""
        return self.kind in ("count", "rate")


HORIZON = "predictability_horizon"
# of `knock`: up to it a guide's sensor reads what it does on a sound machine, to 30 %; from 0.3 on
# twice that and more (docs/a-run.md, Knock)
KNOCKS = 0.25
# of the body and its sensor: at least what is lost between the samples of the forces, which no run
# at these samples shows; measured against samples three times as fine
OF_MEAN, OF_POWER, OF_PEAK = (Bar(5.0, 1.0, least=share) for share in (2e-4, 2e-3, 5e-3))
RUN = {  # numbers of a run without error bars: their units and phrases
    "crank_work": ("J", "work put in by the crank, or by its motor, over the run"),
    "load_work": ("J", "work put in by the piston force over the run"),
    "contact_damping_loss": ("J", "energy lost to damping of contacts and oil over the run"),
    "rod_damping_loss": ("J", "energy lost in the material of an elastic rod over the run"),
    "friction_loss": ("J", "energy lost to joint friction over the run"),
    "energy_residual": ("1", "worst energy imbalance relative to the contact's losses"),
    "steps": ("1", "accepted integration steps"),
    "rejected": ("1", "rejected steps; SciPy's methods do not count them"),
    "evaluations": ("1", "evaluations of the right-hand side"),
    "seconds": ("s", "wall time of the solution, without that of its error bars"),
    HORIZON: ("s", "time for which neighbouring motions stay together; inf: to the end"),
    "period_rev": ("rev", "period of a motion that repeats itself within its errors"),
    "settled_rev": ("rev", "revolutions until a motion repeats itself, or metrics settle"),
}
TABLE = (
    Metric(
        "peak_acceleration", (), "m/s2", "greatest |acceleration|", "acceleration",
        # a parabola between the nodes of a step finds the peak to some 5e-9
        Bar(3.0, 0.2, least=5e-9), Shown("peak acceleration", "m/s²"), kind="greatest",
        made=lambda t: t.greatest("ACCELERATION"),
    ),
    Metric(
        "rms_acceleration", (), "m/s2", "root mean square of acceleration", "acceleration",
        Bar(3.5, 0.01), Shown("rms acceleration", "m/s²"), kind="root",
        made=lambda t: t.root_mean_square("ACCELERATION"),
    ),
    Metric(
        "rms_acceleration_deviation", (), "m/s2", "rms of acceleration less the ideal machine's",
        "acceleration", Bar(3.5, 0.17), Shown("rms acceleration deviation", "m/s²"), kind="root",
        made=lambda t: t.root_mean_square("DEVIATION"),
    ),
    Metric(
        # journal and bore move alike in a machine without clearance, so that it is 0 there
        "knock", ("joint",), "1",
        "force of the hardest blow of a journal on its bore over the greatest joint force; above "
        f"{KNOCKS:g} the joint knocks", "contact_force", Bar(relative=False),
        shown=Shown(f"knock (limit {KNOCKS:g})", ""), contact=True, kind="greatest",
        limit=KNOCKS, made=lambda t: t.ratio(t.blow, t.greatest("FORCE_SIZE", 2)),
    ),
    Metric(
        "peak_contact_force", ("joint",), "N",
        "greatest joint force on the rod, with that of an oil film", "contact_force",
        Bar(4.0, 0.1), Shown("peak contact force", "kN", 1e-3), kind="greatest",
        made=lambda t: t.greatest("FORCE_SIZE", 2),
    ),
    Metric(
        "peak_contact_force_axis", ("joint", "axis"), "N", "greatest joint force along an axis",
        "contact_force", Bar(4.2, 0.16), kind="greatest",
        made=lambda t: t.greatest("FORCE", 2, 2),
    ),
    Metric(
        "max_penetration", ("joint",), "m", "greatest penetration; negative: never touched",
        "penetration", Bar(4.0, 0.04), Shown("max penetration", "µm", 1e6), True, "greatest",
        made=lambda t: t.max_penetration,
    ),
    Metric(
        # an oil film bears without it: a share of 1 is a full film, and no disaster
        "contact_loss_fraction", ("joint",), "1", "share of time without dry contact (F_N = 0)",
        "penetration", Bar(1.5, 0.01, False), Shown("time without dry contact", "%", 1e2), True,
        made=lambda t: t.loss_seconds / t.seconds,
    ),
    Metric(
        "mean_crank_torque", (), "N m", "mean torque that drives the crank against the rod",
        "acceleration", Bar(4.0, 0.02, False, 1e-12),
        made=lambda t: t.mean("CRANK_TORQUE"),
    ),
    Metric(
        "mean_guide_moment", (), "N m",
        "mean moment of the crosshead on its guide about the crank centre",
        "acceleration", Bar(4.0, 0.15, False, 1e-12),
        made=lambda t: t.mean("GUIDE_MOMENT"),
    ),
    Metric(
        "impact_count", ("joint",), "1", "dry contacts that began after flight",
        "penetration", Bar(1.0, 0.0, False), None, True, "count",
        made=lambda t: t.impacts,
    ),
    Metric(
        "release_count", ("joint",), "1", "contacts that began again without flight",
        "penetration", Bar(1.0, 0.0, False), None, True, "count",
        made=lambda t: t.releases,
    ),
    Metric(
        "impacts_per_rev", ("joint",), "1/rev",
        "dry contacts in a revolution that began after flight", "penetration",
        Bar(1.0, 0.0, False), Shown("dry contacts after flight", "per rev"), True, "rate",
        made=lambda t: t.impacts / t.revolutions,
    ),
    Metric(
        "releases_per_rev", ("joint",), "1/rev",
        "contacts in a revolution that began again without flight", "penetration",
        Bar(1.0, 0.0, False), Shown("releases", "per rev"), True, "rate",
        made=lambda t: t.releases / t.revolutions,
    ),
    Metric(
        "rod_load_reversal_angle", (), "rad",
        "crank angle a revolution on the smaller side of the rod load",
        "contact_force", Bar(5.0, 1.0, False), Shown("rod load reversal", "°", math.degrees(1.0)),
        when="signals", joint=1,
        # without load, as in flight, the rod is on neither side
        made=lambda t: math.tau * t.side_seconds.min() / t.steady_seconds,
    ),
    Metric(
        "rod_load_reversal_share", (), "1",
        "peak of the smaller side of the rod load over that of the other",
        "contact_force", Bar(10.0, 0.6, False), kind="greatest", when="signals", joint=1,
        made=lambda t: t.ratio(t.side_peak.min(), t.side_peak.max()),
    ),
    Metric(
        "peak_rod_load_tension", (), "N", "greatest pull of the rod load at the crosshead pin",
        # twice the usual: where valves open within a step, two runs agreed better than they were
        # right, by 1.6 bars at worst of two machines; judged by 58 others, whose errors are at most
        # 0.52 bars
        "contact_force", Bar(10.0, 0.6), Shown("peak rod load, tension", "kN", 1e-3),
        kind="greatest", when="signals", joint=1,
        made=lambda t: t.side_peak[0],
    ),
    Metric(
        "peak_rod_load_compression", (), "N", "greatest push of the rod load at the crosshead pin",
        "contact_force", Bar(10.0, 0.6), Shown("peak rod load, compression", "kN", 1e-3),
        kind="greatest", when="signals", joint=1,
        made=lambda t: t.side_peak[1],
    ),
    *(Metric(name, (), unit, phrase, source="run") for name, (unit, phrase) in RUN.items()),
    Metric(
        "revolutions", (), "1", "settled revolutions that statistics are taken over",
        source="statistics", when="chaotic",
    ),
    Metric(
        "revolutions_to_one_percent", (), "1",
        "settled revolutions that would bring the standard error of rms_acceleration to 1 %",
        source="statistics", when="chaotic",
    ),
    Metric(
        "body_velocity_rms", ("axis",), "m/s", "rms velocity of the body's mass centre, in a band",
        bar=OF_MEAN, source="body", when="body", kind="root",
        shown=Shown("body velocity rms", "mm/s", 1e3),
    ),
    Metric(
        "sensor_peak", (), "m/s2", "greatest |sample| of the sensor",
        bar=OF_PEAK, source="body", when="sensor", kind="greatest",
        shown=Shown("sensor peak", "m/s²"),
    ),
    Metric(
        "sensor_rms", (), "m/s2", "root mean square of the sensor's record",
        bar=OF_MEAN, source="body", when="sensor", kind="root", shown=Shown("sensor rms", "m/s²"),
    ),
    Metric(
        "sensor_crest_factor", (), "1", "sensor_peak over sensor_rms",
        bar=OF_PEAK, source="body", when="sensor", shown=Shown("crest factor", ""),
    ),
    Metric(
        "sensor_kurtosis", (), "1", "kurtosis of the sensor's record: 3 of Gaussian noise",
        bar=OF_POWER, source="body", when="sensor", shown=Shown("kurtosis", ""),
    ),
    Metric(
        "sensor_segment_peak", ("segment",), "m/s2", "greatest |sample| in 10 degrees of the crank",
        bar=OF_PEAK, source="body", when="sensor", kind="greatest",
    ),
    Metric(
        "sensor_segment_rms", ("segment",), "m/s2", "rms of the record in 10 degrees of the crank",
        bar=OF_POWER, source="body", when="sensor", kind="root",
    ),
    Metric(
        "sensor_counts_per_rev", ("threshold",), "1/rev",
        "peaks of the sensor's record in a revolution over a threshold",
        bar=Bar(2.0, 5.0, False, 0.03), source="body", when="threshold", kind="rate",
    ),
    Metric(
        "clipped_fraction", (), "1", "fraction of the sensor's samples beyond its range",
        source="sensor", when="sensor",
    ),
)  # fmt: skip
# time series, over time and these dimensions: (dimensions, unit, long name)
SERIES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "displacement": ((), "m", "crosshead position from the crank centre"),
    "velocity": ((), "m/s", "crosshead velocity"),
    "acceleration": ((), "m/s2", "crosshead acceleration"),
    "rod_angle": ((), "rad", "rod angle phi"),
    "piston_force": ((), "N", "piston force, positive towards the crank"),
    "contact_force": (("joint", "axis"), "N", "joint force on the rod, with that of an oil film"),
    "eccentricity": (("joint", "axis"), "m", "journal centre less bearing centre"),
    "penetration": (("joint",), "m", "contact penetration, negative where there is a gap"),
}


def of_source(source: str) -> list[Metric]:
    """Return the rows of the table that are made from a source."""
    return [row for row in TABLE if row.source == source]


def derive(row: Metric, end: str, phrase: str, dims: tuple[str, ...] = ()) -> Metric:
    """Return the row of a number that follows from a metric, `NAME_end`; its unit stays.

    By default it is a statistic of a chaotic motion, by batch means over its revolutions.
    """
    return row._replace(
        name=f"{row.name}_{end}", dims=row.dims + dims, phrase=f"{phrase} {row.name}",
        source="statistics", when="chaotic", made=None,
    )  # fmt: skip


def error_bar(row: Metric) -> Metric:
    """Return the row of a metric's error bar: how far the metric may be from the exact one.

    Its values are inf where that is not known, as beyond the horizon, nan where no bar was made.
    """
    return derive(row, "error", "error bar of")._replace(source="error", when=row.when)


def series_error(name: str) -> Metric:
    """Return the row of the relative L2 error of a time series; a vector counts by its length."""
    dims = tuple(dim for dim in SERIES[name][0] if dim != "axis")
    phrase = f"relative L2 error of {name} after settling"
    contact = name in ("eccentricity", "penetration")
    return Metric(f"{name}_error", dims, "1", phrase, contact=contact, source="series")


def statistics_of(row: Metric) -> Iterator[Metric]:
    """Yield the rows of a metric's statistics in a chaotic motion; averages have an error."""
    if row.kind == "greatest":
        mean = derive(row, "mean", "mean over revolutions of each one's")
        yield from (mean, derive(mean, "standard_error", "standard error of"))
        yield derive(row, "quantile", "quantile over revolutions of each one's", ("quantile",))
    else:
        yield derive(row, "standard_error", "standard error of")


def every_number() -> Iterator[Metric]:
    """Yield the rows of all numbers that are stored of a job, in the order of files."""
    metrics = of_source("tally")
    yield from (*metrics, *map(error_bar, metrics), *map(series_error, SERIES))
    yield from of_source("run")
    for row in metrics:
        yield from () if row.when else statistics_of(row)
    yield from of_source("statistics")
    for row in of_source("body"):
        yield from (row, error_bar(row))
    yield from of_source("sensor")


NUMBERS = {row.name: row for row in every_number()}
ALWAYS = frozenset(name for name, row in NUMBERS.items() if not row.when)  # of every job
METRICS = {row.name: row for row in of_source("tally") if not row.when}
BARRED = {row.name: row for row in NUMBERS.values() if row.source in ("tally", "body")}
