"""A YAML text -> checked cases and studies."""

from compressor.cases.card import CardError, open_card
from compressor.cases.case import (
    FOLLOWING,
    MODEL_VERSION,
    Case,
    require_case,
    to_yaml,
    with_ideal_joints,
)
from compressor.cases.checks import (
    DOUBLES,
    keys_of,
    phrase_of,
    row_of,
    stands_for,
    suggestion,
    value_of,
    values_given,
)
from compressor.cases.conflicts import outside_judged, reads
from compressor.cases.examples import templates
from compressor.cases.groups import (
    METHODS,
    Contact,
    Friction,
    Gas,
    Machine,
    Offset,
    Output,
    Solve,
    Spring,
)
from compressor.cases.json_schema import case_schema
from compressor.cases.keys import path_of, put
from compressor.cases.laws import CONTACT_LAWS, CYLINDRICAL, FRICTION_LAWS, READ_BY
from compressor.cases.load import load_cases, load_studies
from compressor.cases.materials import joint_stiffness, paper_notes
from compressor.cases.optional_groups import Body, Drive, Guide, Lubricant, Rod, Sensor, Wear
from compressor.cases.parameter import ACCURACY, IMPLAUSIBLE, TIGHTEST, CaseError, PerJoint, to_si
from compressor.cases.plausible import PLAUSIBLE
from compressor.cases.study import Axis, Study, points
from compressor.cases.swept import design
from compressor.cases.table import table
from compressor.cases.text_table import open_text_table
from compressor.cases.yaml_reader import CaseFileError
