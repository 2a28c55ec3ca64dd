"""A store -> figures and a page; the tools by which studies draw and add to the page."""

from compressor.report.figures import Drawing
from compressor.report.figures.job import MODE_COLORS, UNSEEN, mode_handles
from compressor.report.figures.style import (
    BLACK,
    BLUE,
    CYCLE,
    GOLD,
    GREY,
    RED,
    LineStyle,
    in_style,
    legend_above,
    render,
    sheet,
)
from compressor.report.figures.sweep_data import (
    FOOT,
    MARKS,
    Measure,
    measures,
    positions,
    shown_value,
)
from compressor.report.page import (
    Add,
    Additions,
    Cell,
    Chapter,
    Draw,
    PageTable,
    Plate,
    Running,
    Section,
    StudyNote,
    TableRow,
    column_title,
)
from compressor.report.plots import (
    PlotChoice,
    PlotError,
    Plotted,
    choose_figures,
    publish_drawings,
    write_plots,
)
from compressor.report.report import restate, write_report
from compressor.report.study_section import file_name
