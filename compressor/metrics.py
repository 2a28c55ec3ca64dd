"""The numbers that are known of a finished job: names, dimensions, units and phrases.

The one table of results, as `compressor.cases` has one of parameters; needs no library, so that
case files that name a metric are read at once.
"""

JOINTS = ("big_end", "small_end")
AXES = ("x", "y")
SIZES = {"joint": len(JOINTS), "axis": len(AXES)}

# name: (dimensions, unit, long name)
METRICS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "peak_acceleration": ((), "m/s2", "greatest |acceleration|"),
    "rms_acceleration": ((), "m/s2", "root mean square of acceleration"),
    "rms_acceleration_deviation": ((), "m/s2", "rms of acceleration less the ideal machine's"),
    "peak_contact_force": (("joint",), "N", "greatest joint force on the rod"),
    "peak_contact_force_axis": (("joint", "axis"), "N", "greatest joint force along an axis"),
    "max_penetration": (("joint",), "m", "greatest penetration; negative: never touched"),
    "contact_loss_fraction": (("joint",), "1", "share of time without contact (F_N = 0)"),
    "impact_count": (("joint",), "1", "times that contact began"),
}
# how far a metric may be from the exact one: inf where that is unknown, as beyond the horizon, nan
# where no bar was made
ERRORS = {
    f"{name}_error": (dims, unit, f"error bar of {name}")
    for name, (dims, unit, _) in METRICS.items()
}
HORIZON = "predictability_horizon"
# energy flows and how the run went
LEDGER: dict[str, tuple[tuple[str, ...], str, str]] = {
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
NUMBERS = METRICS | ERRORS | LEDGER
