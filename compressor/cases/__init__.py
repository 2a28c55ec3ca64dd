"""A YAML text -> checked cases and studies."""

from compressor.cases.accuracy import ACCURACY, TIGHTEST
from compressor.cases.case import Case, require_case
from compressor.cases.examples import templates
from compressor.cases.file_error import CaseFileError
from compressor.cases.groups import (
    METHODS,
    Contact,
    Friction,
    Gas,
    Machine,
    Offset,
    Output,
    PerJoint,
    Solve,
    Spring,
)
from compressor.cases.ideal import with_ideal_joints
from compressor.cases.json_schema import case_schema
from compressor.cases.judged import judged_range, outside_judged
from compressor.cases.laws import CYLINDRICAL, READ_BY, law_of
from compressor.cases.load import load_cases, load_studies
from compressor.cases.lubricant import Lubricant
from compressor.cases.materials import joint_stiffness
from compressor.cases.mechanism import Drive, Guide, Rod
from compressor.cases.one_way import back_action
from compressor.cases.parameter import IMPLAUSIBLE, CaseError, to_si
from compressor.cases.regimes import Regimes
from compressor.cases.revisions import MODEL, MODEL_VERSION, SUSPECT, changes_since, model_of
from compressor.cases.shorthands import phrase_of, row_of, stands_for, value_in
from compressor.cases.study import Axis, Study, points
from compressor.cases.swept import design
from compressor.cases.table import table
from compressor.cases.unread import reads
from compressor.cases.vibration import Body, Sensor
from compressor.cases.wear import Wear
from compressor.cases.written import to_yaml
