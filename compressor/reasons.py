"""Why a job fails: the stable names that are stored, what each means, and what to do about it.

The one list of them: the physics stops with these, workers report with these, and `compsim run`,
`status`, `show`, the report and the README take their texts from here.
"""

from enum import StrEnum


class Reason(StrEnum):
    """A reason's name; `meaning`: what has happened; `remedy`: what to do next."""

    meaning: str
    remedy: str

    def __new__(cls, name: str, meaning: str, remedy: str) -> "Reason":
        member = str.__new__(cls, name)
        member._value_, member.meaning, member.remedy = name, meaning, remedy
        return member

    INVALID_INPUT = (
        "invalid_input",
        "a `Case` made in Python has values that a case file may not have; nothing is simulated",
        "correct what the detail lists; Case.from_values raises it at once",
    )
    NON_FINITE = (
        "non_finite",
        "the motion or its rates are no longer finite, such as the load when the piston "
        "passes the cylinder head",
        "the motion leaves what the model can describe: check the values that are swept furthest, "
        "and gas.head_clearance_mm",
    )
    PENETRATION_IMPLAUSIBLE = (
        "penetration_implausible",
        "a journal sank deeper into its bearing than a tenth of its radius, for which no contact "
        "law is valid, or with johnson than half the clearance",
        "the contact is too soft for the forces: check contact.stiffness, masses and speed, and "
        "their units",
    )
    GUIDE_IMPLAUSIBLE = (
        "guide_implausible",
        "a corner of the crosshead sank deeper into its guide than a tenth of half its length or "
        "height: contact laws are not valid there",
        "the guide is too soft, or its friction lets the crosshead jam: check guide.stiffness, "
        "guide.friction and the crosshead's sizes",
    )
    ROD_IMPLAUSIBLE = (
        "rod_implausible",
        "an elastic rod is bent, pressed or stretched by more than a tenth of its length: a linear "
        "bar is not valid there",
        "the rod is too soft for the forces: check rod.youngs_modulus_GPa, depth_mm and width_mm",
    )
    STEP_UNDERFLOW = (
        "step_underflow",
        "the integrator's step has become too short to advance the time",
        "try another solve.method, such as Radau, or a looser rtol",
    )
    CRANK_STALLED = (
        "crank_stalled",
        "the crank of a case with a drive has stopped, or would turn back",
        "give the drive more torque_N_m, slope_N_m_s or flywheel_kg_m2",
    )
    BUDGET_STEPS = (
        "budget_steps",
        "the run took solve.max_steps, rejected ones included, before its end",
        "raise solve.max_steps",
    )
    BUDGET_SECONDS = (
        "budget_seconds",
        "the run took solve.timeout_s before its end",
        "the same command tries again; raise solve.timeout_s if that is not enough",
    )
    CONTACT_UNDERRESOLVED = (
        "contact_underresolved",
        "a contact began and ended within one step, and its impulse is more than the tolerance "
        "allows: the method stepped over it",
        "use solve.method: auto, which ends a step at every onset of contact, or a smaller rtol",
    )
    ENERGY_AUDIT_FAILED = (
        "energy_audit_failed",
        "the energy does not balance within what the tolerance allows, not even at a hundredth of "
        "it: metrics cannot be trusted, and none are stored",
        "try solve.method: DOP853, which takes time; very small stiction velocities and friction "
        "of 0.5 or more at tight tolerances are the usual causes",
    )
    ACCURACY_NOT_REACHED = (
        "accuracy_not_reached",
        "no run has estimated errors as small as solve.accuracy requires; numbers and errors are "
        "stored",
        "choose a lower solve.accuracy, or raise solve.max_steps if the detail names steps; "
        "solve.horizon shows whether the motion is chaotic",
    )
    NOT_SETTLED = (
        "not_settled",
        "solve.settle_rev is auto, and the metrics of no revolutions in a row agree within the "
        "accuracy target; numbers and errors of the run's second half are stored",
        "raise solve.duration_rev, or give settle_rev as a number",
    )
    WORKER_DIED = (
        "worker_died",
        "the worker process ended or hung in this job, twice, the second time alone",
        "it crashed, was killed from outside, or had too little memory: use a smaller -j; if that "
        "does not help, it is a bug of compsim: please report it with the case",
    )
    OUT_OF_MEMORY = (
        "out_of_memory",
        "the job needs more memory than its worker may use, also alone",
        "use a smaller -j, which gives each worker more memory, a longer solve.output_step_deg, or "
        "output.keep=metrics",
    )
    INTERNAL_ERROR = (
        "internal_error",
        "an unexpected exception in the program",
        "a bug of compsim: please report it, with what Python prints for "
        "compressor.read_job(FOLDER, JOB).traceback",
    )


def remedy(name: str) -> str:
    """Return what to do about a stored reason, also one of another version's."""
    known = Reason.__members__.get(name.upper())
    return known.remedy if known else "compsim show JOB prints its detail"
