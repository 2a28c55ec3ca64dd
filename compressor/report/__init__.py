"""A store -> figures and a page; the tools by which studies draw and add to the page."""

from compressor.report.additions import Add, Additions, Chapter, Draw, Note
from compressor.report.figures import Drawing
from compressor.report.figures.contact import MODE_COLORS, UNSEEN, mode_handles
from compressor.report.figures.style import (
    BLACK,
    BLUE,
    CYCLE,
    GOLD,
    GREY,
    RED,
    Line,
    legend_above,
    render,
    sheet,
    styled,
)
from compressor.report.figures.sweep_metric import (
    FOOT,
    MARKS,
    Measure,
    measures,
    positions,
    shown_value,
)
from compressor.report.page import Plate, Running, Section
from compressor.report.plot_choice import PlotChoice, PlotError, Plotted, chosen, published
from compressor.report.plots import write_plots
from compressor.report.report import restate, write_report
from compressor.report.study_section import file_name
from compressor.report.tables import Cell, Row, Table, column_title
