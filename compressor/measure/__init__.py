"""The trade of speed for accuracy, and the extremes."""

from compressor.measure.explain import Explanation, explain
from compressor.measure.extremes import Budget
from compressor.measure.find import Answer, find
from compressor.measure.model_choices import explain_models, trade
from compressor.measure.question import Question
from compressor.measure.stress import campaign, counts, repeat, slowest, worst
from compressor.measure.work_precision import default_cases, fastest, faulty, work_precision
