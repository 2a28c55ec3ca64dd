"""What the artists of a panel show: curves, points, maps, bars and areas."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection, QuadMesh
from matplotlib.colors import LogNorm, to_hex
from matplotlib.container import BarContainer, ErrorbarContainer
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from compressor.report.figures.shown import Trace

Names = dict[tuple[str, str, str], str]  # what stands in legends, by how it looks
COLORS = 33  # of a continuous scale
JOBS = "job_keys"  # attribute of an artist whose points are jobs


def with_jobs(artist: Artist, keys: object) -> Artist:
    """Say of which job each point of an artist is: a click on it can then tell of the job.

    keys: in the order of the points, of a map in C order of its cells.
    """
    setattr(artist, JOBS, tuple(map(str, np.ravel(np.asarray(keys, object)))))
    return artist


def look(artist: Any) -> tuple[str, str, str]:
    """By what a legend's entry is like the curve that it names."""
    if isinstance(artist, Line2D):
        dash = artist.get_linestyle() if artist.get_linestyle() not in ("", " ") else "None"
        color = artist.get_color() if dash != "None" else artist.get_markeredgecolor()
        marker = str(artist.get_marker()) if dash == "None" else ""
        return to_hex(color), str(pattern(artist)) if dash != "None" else "None", marker
    return to_hex(artist.get_facecolor()), "patch", ""


def legend_names(figure: Figure) -> Names:
    """Return the names in all legends of a figure, by how their entries look."""
    legends = [*figure.legends, *(own for a in figure.axes if (own := a.get_legend()))]
    found: Names = {}
    for legend in legends:
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=False):
            if isinstance(handle, Line2D | Patch):
                found.setdefault(look(handle), text.get_text())
    return found


def every_trace(axes: Axes, named: Names) -> Iterator[Trace]:
    """Yield what the artists of a panel show, in the order in which they were drawn."""
    inside: set[Artist] = set()  # parts of a container, which tells of them
    for container in axes.containers:
        inside |= {*flat(container)}
        if isinstance(container, ErrorbarContainer):
            yield from errorbar(axes, container, named)
        elif isinstance(container, BarContainer):
            yield bars(container, named)
    for artist in sorted(axes.get_children(), key=lambda artist: artist.get_zorder()):
        if artist in inside or not artist.get_visible():
            continue
        for kind, read in READERS:
            if isinstance(artist, kind):
                trace = read(axes, artist, named)
                if trace is not None and trace.y.size:
                    yield trace
                break


def flat(container: Any) -> Iterator[Artist]:
    """Yield all artists of a container."""
    for item in container:
        if isinstance(item, Artist):
            yield item
        elif item is not None:
            yield from flat(item)


def name_of(artist: Any, named: Names) -> str:
    """Return what an artist is called: its label, or the legend's entry that looks alike."""
    return label_of(artist) or (
        named.get(look(artist), "") if isinstance(artist, Line2D | Patch) else ""
    )


def label_of(artist: Any) -> str:
    """Return an artist's own label; "" where matplotlib gave it one."""
    label = str(artist.get_label())
    return "" if label.startswith("_") else label


def jobs_of(artist: object) -> tuple[str, ...]:
    return getattr(artist, JOBS, ())


def pattern(line: Line2D) -> tuple[float, ...]:
    """Return a line's dashes in points: lengths of strokes and gaps; none if it is solid."""
    dashes = line._dash_pattern[1]  # type: ignore[attr-defined]
    return tuple(round(float(d), 2) for d in dashes) if dashes else ()


def in_data(axes: Axes, artist: Artist) -> bool:
    """Return whether an artist's coordinates are those of the axes."""
    return bool(artist.get_transform().contains_branch(axes.transData))


def curve(axes: Axes, line: Any, named: Names) -> Trace | None:
    """Return a line or its markers; None for a straight line across the panel, which `notes`
    has.
    """
    if line.get_transform().contains_branch_seperately(axes.transData) != (True, True):
        return None
    x = np.asarray(np.ma.filled(line.get_xdata(orig=False), np.nan), float)
    y = np.asarray(np.ma.filled(line.get_ydata(orig=False), np.nan), float)
    drawn = line.get_linestyle() not in ("None", "", " ")
    marker = line.get_marker()
    marker = "" if marker in (None, "None", "", " ") else str(marker)
    color = line.get_color() if drawn else line.get_markeredgecolor()
    return Trace(
        "line" if drawn else "points",
        name_of(line, named),
        x,
        y,
        color=to_hex(color),
        width=line.get_linewidth() if drawn else line.get_markersize(),
        dash=pattern(line) if drawn else (),
        marker=marker,
        opacity=1.0 if line.get_alpha() is None else float(line.get_alpha()),
        jobs=jobs_of(line),
    )


def errorbar(axes: Axes, container: ErrorbarContainer, named: Names) -> Iterator[Trace]:
    """Yield the points, or a line, with error bars in y or in x."""
    line, _, collections = container.lines
    label = str(container.get_label())
    if line is None:  # bars without points: lines, where something else has the points
        found = (segments(axes, one, named) for one in collections)
        yield from (trace for trace in found if trace is not None)
        return
    if not collections:
        return
    across = not container.has_yerr
    at = np.array([line.get_ydata(), line.get_xdata()] if across else line.get_data(), float)
    way = 0 if across else 1  # of a segment's ends that differ
    ends = np.full((2, at.shape[1]), np.nan)
    for segment in collections[0].get_segments():
        if len(segment) == 2:
            here = np.flatnonzero((at[0] == segment[0][1 - way]) & np.isfinite(at[1]))
            ends[0, here] = at[1, here] - segment[0][way]
            ends[1, here] = segment[1][way] - at[1, here]
    base = curve(axes, line, named)
    if base is not None:
        name = base.name if label.startswith("_") else label
        fields = vars(base) | {
            "name": name,
            "errors": ends,
            "across": across,
            "jobs": jobs_of(container) or base.jobs,
        }
        yield Trace(**fields)


def bars(container: BarContainer, named: Names) -> Trace:
    """Return the bars, lying (x: where they end, y: where they stand) or standing (x and y
    exchanged).
    """
    patches = container.patches
    lying = container.orientation == "horizontal"
    middles = [
        p.get_y() + p.get_height() / 2 if lying else p.get_x() + p.get_width() / 2 for p in patches
    ]
    ends = [p.get_x() + p.get_width() if lying else p.get_y() + p.get_height() for p in patches]
    label = str(container.get_label())
    name = label if not label.startswith("_") else name_of(patches[0], named) if patches else ""
    errors = None
    if container.errorbar is not None and container.errorbar.lines[2]:
        segments = container.errorbar.lines[2][0].get_segments()
        axis = 0 if lying else 1
        errors = np.array(
            [(end - s[0][axis], s[1][axis] - end) for end, s in zip(ends, segments, strict=False)]
        ).T
    x, y = (ends, middles) if lying else (middles, ends)
    color = to_hex(patches[0].get_facecolor()) if patches else "#000000"
    thick = float(patches[0].get_height() if lying else patches[0].get_width()) if patches else 1.0
    return Trace("bars" if lying else "columns", name, np.array(x, float), np.array(y, float),
                 color=color, errors=errors, across=lying, width=thick,
                 jobs=jobs_of(container))  # fmt: skip


def mesh(axes: Axes, artist: Any, named: Names) -> Trace:
    """Return a map of coloured cells."""
    corners = artist.get_coordinates()
    values = np.ma.filled(artist.get_array().astype(float), np.nan)
    values = values.reshape(corners.shape[0] - 1, corners.shape[1] - 1)
    low, high = artist.norm.vmin, artist.norm.vmax
    log = isinstance(artist.norm, LogNorm)
    if log:
        values, low, high = np.log10(values), np.log10(low), np.log10(high)
    count = artist.cmap.N if artist.cmap.N < COLORS else COLORS
    colors = tuple(to_hex(artist.cmap(share)) for share in np.linspace(0.0, 1.0, count))
    bar = artist.colorbar
    title = "" if bar is None else bar.ax.get_ylabel() or bar.ax.get_xlabel()
    return Trace(
        "map", label_of(artist), corners[0, :, 0], corners[:, 0, 1],
        z=values, color=colors, jobs=jobs_of(artist), limits=(float(low), float(high)), log=log,
        scale_name=title,
    )  # fmt: skip


def scatter(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return the points of a scatter diagram."""
    points = np.ma.filled(artist.get_offsets().astype(float), np.nan)
    colors = artist.get_facecolor()
    width = float(np.sqrt(artist.get_sizes()[0])) if len(artist.get_sizes()) else 4.0
    return Trace("points", label_of(artist), points[:, 0], points[:, 1], marker="o",
                 color=first_color(colors), width=width, jobs=jobs_of(artist))  # fmt: skip


def outline(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return a filled area between curves."""
    if not in_data(axes, artist) or not artist.get_paths():
        return None
    rings = [path.vertices for path in artist.get_paths() if len(path.vertices)]
    colors = artist.get_facecolor()
    joined = broken(rings)
    return Trace("band", label_of(artist), joined[:, 0], joined[:, 1],
                 color=first_color(colors),
                 opacity=float(colors[0][3]) if len(colors) else 0.3)  # fmt: skip


def segments(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return many straight lines, such as those of an impact's time and speed."""
    if artist.get_transform().contains_branch_seperately(axes.transData) != (True, True):
        return None
    joined = broken([np.asarray(s, float) for s in artist.get_segments()])
    colors = artist.get_color()
    return Trace("line", label_of(artist), joined[:, 0], joined[:, 1],
                 color=first_color(colors), width=float(artist.get_linewidth()[0]))  # fmt: skip


def contour(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return the lines of equal value, without a name: they follow from the map that they lie
    on.
    """
    parts = [part for path in artist.get_paths() for part in path.to_polygons(closed_only=False)]
    joined = broken([np.asarray(part, float) for part in parts])
    colors = artist.get_edgecolor()
    return Trace("line", "", joined[:, 0], joined[:, 1], color=first_color(colors), width=0.8)


def shape(axes: Axes, artist: Any, named: Names) -> Trace | None:
    """Return the outline of a rectangle, a circle or another shape."""
    if artist is axes.patch or not in_data(axes, artist):
        return None
    transform = artist.get_transform() - axes.transData
    rings = artist.get_path().transformed(transform).to_polygons(closed_only=False)
    joined = broken([np.asarray(ring, float) for ring in rings])
    filled = bool(artist.get_fill())
    color = artist.get_facecolor() if filled else artist.get_edgecolor()
    return Trace("band" if filled else "line", name_of(artist, named) if filled else "",
                 joined[:, 0], joined[:, 1], color=to_hex(color),
                 width=artist.get_linewidth(), opacity=float(color[3]))  # fmt: skip


def broken(parts: list[np.ndarray]) -> np.ndarray:
    """Return the lines one after the other with a gap of nan between them, shape (n, 2)."""
    gap = np.full((1, 2), np.nan)
    joined = [array for part in parts for array in (part, gap)][:-1]
    return np.concatenate(joined) if joined else np.empty((0, 2))


def first_color(colors: Any) -> str:
    return to_hex(colors[0]) if len(colors) else "#000000"


Reader = Callable[[Axes, Any, Names], Trace | None]


READERS: tuple[tuple[type, Reader], ...] = (
    (Line2D, curve),
    (QuadMesh, mesh),
    (ContourSet, contour),
    (PathCollection, scatter),
    (PolyCollection, outline),
    (LineCollection, segments),
    (Patch, shape),
)
