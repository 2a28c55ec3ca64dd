"""The trade of speed for accuracy, and the extremes."""

from compressor.measure.explain import Advice, Explanation, explain
from compressor.measure.features import SERIES, trade
from compressor.measure.stress import FILE, campaign, counts, repeat, slowest, worst
from compressor.measure.work_precision import default_cases, fastest, faulty, work_precision
