"""A store -> figures and a page; the tools by which studies draw."""

from compressor.report.figures import style
from compressor.report.figures.drawing import Panel, PlotlyFigure, make_grid, midway, rectangle
from compressor.report.figures.sweep_data import Measure, axis_of, measures
from compressor.report.plots import title_figure, write_figure, write_plots
from compressor.report.report import write_report
