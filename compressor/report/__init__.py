"""A store -> figures and a page."""

from compressor.report.figures.outcomes import draw_outcomes
from compressor.report.figures.style import render
from compressor.report.figures.wear import draw_wear
from compressor.report.figures.work_precision import draw_work_precision
from compressor.report.model_choices import ModelTable, headline, model_table, place_text
from compressor.report.page import Running
from compressor.report.plot_choice import PlotChoice
from compressor.report.plots import write_plots
from compressor.report.regime_plots import write_regime_plots
from compressor.report.report import restate, write_report
