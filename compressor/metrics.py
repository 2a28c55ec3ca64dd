"""The numbers that are known of a finished job: names, dimensions, units and phrases.

The one table of results, as `compressor.cases` has one of parameters; needs no library, so that
case files that name a metric are read at once. A new metric is a row of `METRICS` and its value in
`compressor.solve.tallied.metrics`.
"""

from typing import NamedTuple

JOINTS = ("big_end", "small_end")
AXES = ("x", "y")
SIZES = {"joint": len(JOINTS), "axis": len(AXES)}


class Bar(NamedTuple):
    """How a metric's error bar follows from another run (`compressor.solve.error_bars`).

    Shares that hold are measured (`make accuracy`). The defaults, for a metric that was not, are
    the most careful of those that were.
    """

    own: float = 1.0  # share of the metric's own difference
    of_peaks: float = 0.6  # of the mean relative difference of the peaks
    of_path: float = 0.02  # of the distance of the journals over their room
    relative: bool = True  # False: the bar of a share or a count is its difference, or of_path


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
    bar: Bar = Bar()
    peak: bool = False  # the greatest value over time: the relative errors of all are of one size
    shown: Shown | None = None  # None: not drawn
    contact: bool = False  # of a contact: of an ideal joint it tells nothing


METRICS = {
    row.name: row
    for row in (
        Metric(
            "peak_acceleration", (), "m/s2", "greatest |acceleration|",
            Bar(0.8, 0.5, 0.02), True, Shown("peak acceleration", "m/s²"),
        ),
        Metric(
            "rms_acceleration", (), "m/s2", "root mean square of acceleration",
            Bar(0.4, 0.02, 0.003), shown=Shown("rms acceleration", "m/s²"),
        ),
        Metric(
            "rms_acceleration_deviation", (), "m/s2",
            "rms of acceleration less the ideal machine's",
            Bar(0.5, 0.4, 0.02), shown=Shown("rms deviation from ideal", "m/s²"),
        ),
        Metric(
            "peak_contact_force", ("joint",), "N", "greatest joint force on the rod",
            Bar(0.7, 0.6, 0.02), True, Shown("peak contact force", "kN", 1e-3),
        ),
        Metric(
            "peak_contact_force_axis", ("joint", "axis"), "N",
            "greatest joint force along an axis", Bar(1.0, 0.4, 0.02), True,
        ),
        Metric(
            "max_penetration", ("joint",), "m", "greatest penetration; negative: never touched",
            Bar(0.8, 0.01, 0.002), True, Shown("greatest penetration", "µm", 1e6), True,
        ),
        Metric(
            "contact_loss_fraction", ("joint",), "1",
            "share of time without contact (F_N = 0)",
            Bar(of_path=0.01, relative=False), shown=Shown("time without contact", "%", 1e2),
            contact=True,
        ),
        Metric(
            "impact_count", ("joint",), "1", "times that contact began",
            Bar(of_path=0.0, relative=False), shown=Shown("times contact began", ""), contact=True,
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
HORIZON = "predictability_horizon"
# energy flows and how the run went
LEDGER: Rows = {
    "crank_work": ((), "J", "work put in by the crank over the run"),
    "load_work": ((), "J", "work put in by the piston force over the run"),
    "contact_damping_loss": ((), "J", "energy lost to contact damping over the run"),
    "friction_loss": ((), "J", "energy lost to joint friction over the run"),
    "energy_residual": ((), "1", "worst energy imbalance relative to the contact's losses"),
    "steps": ((), "1", "accepted integration steps"),
    "rejected": ((), "1", "rejected steps; SciPy's methods do not tell"),
    "evaluations": ((), "1", "evaluations of the right-hand side"),
    "seconds": ((), "s", "wall time of the solution, without that of its error bars"),
    HORIZON: ((), "s", "time up to which close twins stay together; inf: to the end"),
}
NUMBERS: Rows = {row.name: (row.dims, row.unit, row.phrase) for row in METRICS.values()}
NUMBERS |= ERRORS | LEDGER
