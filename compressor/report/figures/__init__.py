"""The table of figures, which the modules beside it fill."""

from compressor.report.figures.paper import paper_figure
from compressor.report.figures.rows import SweptRow
from compressor.report.figures.table import FIGURES, DrawnFigure, Figure

FIGURES["paper"] = dict(sorted(FIGURES["paper"].items()))  # by number, whatever function they share
