"""The group of a case file that says what stands between journal and bore."""

from dataclasses import dataclass

from compressor.cases.parameter import documented, parameter

LEAST_RATIO, GREATEST_RATIO = 0.125, 1.0  # of a bearing's length and diameter


@documented
@dataclass(frozen=True)
class Lubricant:
    """An oil film in the joints that have clearance; a case's `lubricant`, None: they run dry.

    The film bears by rotation and squeeze; in its last share of the clearance the dry contact takes
    over. `True` stands for the defaults:

    >>> import compressor
    >>> case = compressor.Case.from_values(
    ...     {"joint": "big_end", "clearance_mm": 0.05, "lubricant": True}
    ... )
    >>> case.lubricant.viscosity_mPa_s
    30.0
    """

    viscosity_mPa_s: float = parameter(
        30.0, "mPa s", (0, 1e6), "ISO VG 100 at about 65 °C (ISO 3448)", "dynamic viscosity",
        above=True, judged=(3.0, 300.0),
    )  # fmt: skip
    bearing_length_mm: float = parameter(
        20.0, "mm", (0, 1e4), "assumed: as long as wide", "length of the bearings", above=True
    )
    last_share: float = parameter(
        0.02,
        "",
        (0.001, 0.5),
        "ours",
        "of the clearance, in which the film bears no more",
        judged=(0.01, 0.1),
    )
