"""The numbers that are known of a finished job: names, dimensions, units and phrases.

The one table of results, as `compressor.cases` has one of parameters; needs no library, so that
case files that name a metric are read at once. A new metric is a row of `METRICS` and its value in
`compressor.solve.run_metrics.metrics`.
"""

from typing import Literal, NamedTuple

JOINTS = ("big_end", "small_end")
AXES = ("x", "y")
QUANTILES = (0.5, 0.95)  # of the revolutions' greatest values
SIZES = {"joint": len(JOINTS), "axis": len(AXES), "quantile": len(QUANTILES)}


class Bar(NamedTuple):
    """How a metric's error bar follows from another run (`compressor.solve.error_bars`).

    Shares that hold are measured (`make accuracy`). The defaults, for a metric that was not, are
    the most careful of those that were.
    """

    own: float = 5.0  # share of the metric's own difference
    path: float = 0.3  # of the distance of the time series that it is taken from
    relative: bool = True  # False: of a share, a count or a mean that may be 0
    least: float = 1e-13  # share of the metric that a relative bar has at least: rounding, or more


class Shown(NamedTuple):
    """How the report draws a metric: its title, and the unit with its factor from SI."""

    title: str
    unit: str
    factor: float = 1.0


class Metric(NamedTuple):
    """One row of the table of metrics."""

    name: str
    dims: tuple[str, ...]
    unit: str
    phrase: str  # long name
    series: str  # the time series that it is taken from
    bar: Bar = Bar()
    shown: Shown | None = None  # None: not drawn
    contact: bool = False  # of a contact: of an ideal joint it tells nothing
    # how it comes from the run; a count grows with it, a rate is a count by revolutions
    kind: Literal["greatest", "root", "share", "count", "rate"] = "share"

    @property
    def is_pure_number(self) -> bool:
        """Return whether it has no unit: a share or a count, which may be 0."""
        return self.unit in ("1", "1/rev")

    @property
    def counted(self) -> bool:
        """Whether it counts events: contact that grazes begins any number of times."""
        return self.kind in ("count", "rate")


METRICS = {
    row.name: row
    for row in (
        Metric(
            "peak_acceleration", (), "m/s2", "greatest |acceleration|", "acceleration",
            # a parabola between the nodes of a step finds the peak to some 5e-9
            Bar(3.0, 0.2, least=5e-9), Shown("peak acceleration", "m/s²"), kind="greatest",
        ),
        Metric(
            "rms_acceleration", (), "m/s2", "root mean square of acceleration", "acceleration",
            Bar(3.5, 0.01), Shown("rms acceleration", "m/s²"), kind="root",
        ),
        Metric(
            "rms_acceleration_deviation", (), "m/s2",
            "rms of acceleration less the ideal machine's", "acceleration",
            Bar(3.5, 0.17), Shown("rms deviation from ideal", "m/s²"), kind="root",
        ),
        Metric(
            "peak_contact_force", ("joint",), "N", "greatest joint force on the rod",
            "contact_force", Bar(4.0, 0.1), Shown("peak contact force", "kN", 1e-3),
            kind="greatest",
        ),
        Metric(
            "peak_contact_force_axis", ("joint", "axis"), "N",
            "greatest joint force along an axis", "contact_force", Bar(4.2, 0.16), kind="greatest",
        ),
        Metric(
            "max_penetration", ("joint",), "m", "greatest penetration; negative: never touched",
            "penetration", Bar(4.0, 0.04), Shown("greatest penetration", "µm", 1e6), True,
            "greatest",
        ),
        Metric(
            "contact_loss_fraction", ("joint",), "1",
            # an oil film bears without it: a share of 1 is a full film, and no disaster
            "share of time without dry contact (F_N = 0)", "penetration",
            Bar(1.5, 0.01, False), Shown("time without dry contact", "%", 1e2), True,
        ),
        Metric(
            "mean_crank_torque", (), "N m", "mean torque that drives the crank against the rod",
            "acceleration", Bar(4.0, 0.02, False, 1e-12),
        ),
        Metric(
            "mean_guide_moment", (), "N m",
            "mean moment of the crosshead on its guide about the crank centre", "acceleration",
            Bar(4.0, 0.15, False, 1e-12),
        ),
        Metric(
            "impact_count", ("joint",), "1", "contacts that began after flight", "penetration",
            Bar(1.0, 0.0, False), None, True, "count",
        ),
        Metric(
            "release_count", ("joint",), "1", "contacts that began while pressed in", "penetration",
            Bar(1.0, 0.0, False), None, True, "count",
        ),
        Metric(
            "impacts_per_rev", ("joint",), "1/rev",
            "contacts in a revolution that began after flight", "penetration",
            Bar(1.0, 0.0, False), Shown("impacts after flight", "per rev"), True, "rate",
        ),
        Metric(
            "releases_per_rev", ("joint",), "1/rev",
            "contacts in a revolution that began while pressed in", "penetration",
            Bar(1.0, 0.0, False), Shown("releases while pressed in", "per rev"), True, "rate",
        ),
    )
}  # fmt: skip
# of a run with `output: {signals: true}`; nan of any other (`compressor.solve.run_metrics`)
ROD_LOAD = {
    row.name: row
    for row in (
        Metric(
            "rod_load_reversal_angle", (), "rad",
            "crank angle a revolution on the smaller side of the rod load", "contact_force",
        ),
        Metric(
            "rod_load_reversal_share", (), "1",
            "peak of the smaller side of the rod load over that of the other", "contact_force",
        ),
    )
}  # fmt: skip
# what is stored of a job, by name: (dimensions, unit, long name)
Rows = dict[str, tuple[tuple[str, ...], str, str]]
# how far a metric may be from the exact one: inf where that is unknown, as beyond the horizon, nan
# where no bar was made
ERRORS: Rows = {
    f"{row.name}_error": (row.dims, row.unit, f"error bar of {row.name}")
    for row in METRICS.values()
}
# time series, over time and these dimensions
SERIES: Rows = {
    "displacement": ((), "m", "crosshead position from the crank centre"),
    "velocity": ((), "m/s", "crosshead velocity"),
    "acceleration": ((), "m/s2", "crosshead acceleration"),
    "rod_angle": ((), "rad", "rod angle phi"),
    "piston_force": ((), "N", "piston force, positive towards the crank"),
    "contact_force": (("joint", "axis"), "N", "joint force on the rod"),
    "eccentricity": (("joint", "axis"), "m", "journal centre less bearing centre"),
    "penetration": (("joint",), "m", "contact penetration, negative where there is a gap"),
}
# how far a time series may be from the exact one, as ERRORS; vectors by their length
SERIES_ERRORS: Rows = {
    f"{name}_error": (
        tuple(dim for dim in dims if dim != "axis"), "1",
        f"relative L2 error of {name} after settling",
    )
    for name, (dims, _, _) in SERIES.items()
}  # fmt: skip
# of a chaotic run, by batch means over its settled revolutions; nan of any other
STATISTICS: Rows = {}
for row in METRICS.values():
    if row.kind != "greatest":
        STATISTICS[f"{row.name}_standard_error"] = (
            row.dims, row.unit, f"standard error of {row.name}"
        )  # fmt: skip
        continue
    for word, dims, phrase in (
        ("mean", (), "mean over revolutions of each one's"),
        ("quantile", ("quantile",), "quantile over revolutions of each one's"),
    ):
        one = f"{row.name}_{word}"
        STATISTICS[one] = ((*row.dims, *dims), row.unit, f"{phrase} {row.name}")
        STATISTICS[f"{one}_standard_error"] = (
            (*row.dims, *dims), row.unit, f"standard error of {one}"
        )  # fmt: skip
STATISTICS["revolutions"] = ((), "1", "settled revolutions that statistics are taken over")
STATISTICS["revolutions_to_one_percent"] = (
    (), "1", "settled revolutions that would bring the standard error of rms_acceleration to 1 %"
)  # fmt: skip
HORIZON = "predictability_horizon"
# energy flows and how the run went
LEDGER: Rows = {
    "crank_work": ((), "J", "work put in by the crank, or by its motor, over the run"),
    "load_work": ((), "J", "work put in by the piston force over the run"),
    "contact_damping_loss": ((), "J", "energy lost to damping of contacts and oil over the run"),
    "rod_damping_loss": ((), "J", "energy lost in the material of an elastic rod over the run"),
    "friction_loss": ((), "J", "energy lost to joint friction over the run"),
    "energy_residual": ((), "1", "worst energy imbalance relative to the contact's losses"),
    "steps": ((), "1", "accepted integration steps"),
    "rejected": ((), "1", "rejected steps; SciPy's methods do not tell"),
    "evaluations": ((), "1", "evaluations of the right-hand side"),
    "seconds": ((), "s", "wall time of the solution, without that of its error bars"),
    HORIZON: ((), "s", "time up to which close twins stay together; inf: to the end"),
    "period_rev": ((), "rev", "period of a motion that repeats itself within its errors"),
    "settled_rev": ((), "rev", "revolutions after which it does, or metrics no longer change"),
}
NUMBERS: Rows = {row.name: (row.dims, row.unit, row.phrase) for row in METRICS.values()}
NUMBERS |= ERRORS | SERIES_ERRORS | LEDGER | STATISTICS
SOMETIMES: Rows = dict(STATISTICS)  # absent where no job has them
for row in ROD_LOAD.values():
    SOMETIMES[row.name] = (row.dims, row.unit, row.phrase)
    SOMETIMES[f"{row.name}_error"] = (row.dims, row.unit, f"error bar of {row.name}")
SOMETIMES["clipped_fraction"] = ((), "1", "fraction of the sensor's samples beyond its range")
NUMBERS |= SOMETIMES
