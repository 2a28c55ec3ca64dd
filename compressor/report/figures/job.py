"""Figures of one job: signals, cards, spectra, orbits, modes, impacts; and maps of a study."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis import (
    MODES,
    OILED_MODES,
    ORDER,
    SPOKEN,
    SweptRow,
    angle_modes,
    case_of,
    deviation_spectrum,
    end_states,
    frame_forces,
    impacts,
    joints_with_clearance,
    last_revolution,
    read_cycle,
    read_loads,
    row_modes_words,
    rows_modes,
    sensor_envelope,
    settled_revolutions,
    shaking,
)
from compressor.metrics import JOINTS
from compressor.report.figures.curves import ANGLE_AXIS, KILONEWTON
from compressor.report.figures.drawing import (
    ColorScale,
    Drawing,
    Note,
    Panel,
    Trace,
    circle,
    entry,
    join_with_gaps,
    make_grid,
    map_cells,
    share_scales,
    strokes,
)
from compressor.report.figures.style import (
    BLACK,
    BLUE,
    GOLD,
    GREY,
    RED,
    LineStyle,
    fill,
    mark,
    palette,
)

# flight, impact, following: lightness 30, 54, 90
MODE_COLORS = dict(zip(MODES, (BLUE, RED, "#dde3ee"), strict=True))
UNSEEN = fill("#ffffff", edge=GREY, is_hatched=True)
PATH = LineStyle(BLUE, "-", 0.9, 2.3)
ZERO = LineStyle(BLACK, linewidth=0.8)
BY_JOINT = dict(zip(JOINTS, ((BLUE, "o"), (RED, "D")), strict=True))
CORNERS = {0: ("top dead centre", "o"), 90: ("90°", "^"), 180: ("bottom dead centre", "s"),
           270: ("270°", "v")}  # fmt: skip
MICROMETRE = 1e6


def draw_orbits(run: xr.Dataset) -> Drawing:
    """Return the journal's orbit in each bore with clearance over the last revolution."""
    joints = joints_with_clearance(run)
    figure, panels = make_grid(1, len(joints), 5.4)
    for panel, joint in zip(panels.flat, joints, strict=True):
        plot_orbit(panel, run, joint)
    figure.legend = [one for one in panels[0, 0].traces if one.is_points]
    return figure


def plot_orbit(panel: Panel, run: xr.Dataset, joint: str) -> None:
    """Draw one orbit, to scale, in its clearance circle; marks stand at every quarter turn."""
    degrees, revolution = last_revolution(run)
    place = (
        revolution["eccentricity"].sel(joint=joint).transpose("time", "axis").values * MICROMETRE
    )
    clearance = joints_with_clearance(run)[joint] * MICROMETRE
    panel.traces.append(circle(clearance, LineStyle(BLACK, linewidth=1.0, zorder=1.0), "line"))
    panel.plot(place[:, 0], place[:, 1], PATH, "path of the journal's centre")
    for angle, (name, shape) in CORNERS.items():
        nearest = np.argmin(np.abs((degrees - angle + 180) % 360 - 180))
        x, y = place[nearest]
        panel.plot(x, y, mark(GOLD, shape, 7, 4, edge=BLACK), name)
    room = 1.08 * max(clearance, np.linalg.norm(place, axis=1).max())
    panel.is_square = True
    panel.title = f"{SPOKEN[joint]}; circle: clearance {clearance / 1e3:.3g} mm"
    panel.x.title, panel.y.title = "$e_x$ (µm), along the cylinder", "$e_y$ (µm)"
    for scale in (panel.x, panel.y):
        scale.span(-room, room)
        scale.max_ticks = 5


def draw_modes(run: xr.Dataset) -> Drawing:
    """Return contact modes over the crank angle, as shares of the revolutions, and penetration."""
    joints = joints_with_clearance(run)
    shares, words = angle_modes(run), OILED_MODES if case_of(run).lubricant else MODES
    rows = 2 * len(joints)
    figure, panels = make_grid(rows, 1, 1.45 * rows + 0.9, heights=(1.0, 2.2) * len(joints))
    for joint, strip, depth in zip(joints, panels[::2, 0], panels[1::2, 0], strict=True):
        plot_strip(strip, shares, joint, words)
        degrees, revolution = last_revolution(run)
        values = revolution["penetration"].sel(joint=joint).values * MICROMETRE
        order = np.argsort(degrees % 360.0, kind="stable")
        depth.plot((degrees % 360.0)[order], values[order], PATH)
        depth.notes.append(Note(y=0.0, style=ZERO))
        depth.title = f"penetration, {SPOKEN[joint]}, last revolution; below 0 a gap"
        depth.y.title = "δ (µm)"
    panels[-1, 0].x.title = ANGLE_AXIS
    share_turn(figure.panels)
    figure.legend = mode_entries(words)
    return figure


def share_turn(panels: Sequence[Panel], step: float = 45.0) -> None:
    """Show one turn of the crank in all panels."""
    panels[0].x.span(0.0, 360.0)
    panels[0].x.step = step
    share_scales(panels, "x")


def plot_strip(panel: Panel, shares: xr.Dataset, joint: str, words: Sequence[str]) -> None:
    """Draw the share of revolutions in each mode, stacked, over bins of the crank angle."""
    share = shares["share"].sel(joint=joint)
    heights = [share.sel(mode=mode).fillna(0.0).values for mode in MODE_COLORS]
    stack_modes(panel, shares["angle"].values, 360.0 / shares.sizes["angle"], heights, words)
    panel.title = f"share of revolutions in each contact mode, {SPOKEN[joint]}"


def stack_modes(
    panel: Panel,
    x: np.ndarray,
    width: float | np.ndarray,
    heights: Sequence[np.ndarray],
    words: Sequence[str] = MODES,
) -> None:
    """Draw the shares of the contact modes one above the other, over the middles of bins."""
    foot = np.zeros(x.size)
    for word, color, height in zip(words, MODE_COLORS.values(), heights, strict=True):
        panel.plot(x, foot + height, fill(color), word, kind="columns", thick=width, foot=foot)
        foot = foot + np.nan_to_num(height)
    panel.y.title, panel.y.ticks, panel.grid = "share", (0, 1), ""
    panel.y.span(0, 1)


def mode_entries(words: Sequence[str] = MODES) -> list[Trace]:
    """Return the modes' colours, for a legend."""
    looks = [fill(color, edge=BLACK, edge_width=0.4) for color in MODE_COLORS.values()]
    return [entry(word, look, "band") for word, look in zip(words, looks, strict=True)]


def draw_impacts(run: xr.Dataset) -> Drawing:
    """Return the approach speed of the impacts of all settled revolutions over the crank angle.

    Of oiled joints, whose film takes the blow, it is that of dry contacts that begin.
    """
    found = impacts(run)
    kind, none = "impacts", "no impact: no journal came back from flight"
    if case_of(run).lubricant:
        kind, none = "dry contacts", "no dry contact begins"
    figure, panels = make_grid(1, 1, 3.6)
    (panel,) = panels.flat
    turns = settled_revolutions(run)
    for joint in joints_with_clearance(run):
        color, shape = BY_JOINT[joint]
        mine = found.isel(impact=found["joint"].values == joint)
        angle, speed = mine["crank_angle"].values, mine["approach_speed"].values
        name = f"{SPOKEN[joint]}: {angle.size / turns:.3g} {kind} a revolution"
        panel.traces.append(strokes(angle, 0.0, speed, LineStyle(color, linewidth=0.8)))
        panel.plot(angle, speed, mark(color, shape, 5), name)
    if not found.sizes["impact"]:
        panel.notes.append(Note(none, 180, 0.5, side="center"))
        panel.y.span(0, 1)
        panel.y.ticks = ()
    else:
        panel.y.span(low=0)
    panel.x.title, panel.y.title = ANGLE_AXIS, "approach speed (m/s)"
    share_turn([panel])
    figure.legend = [one for one in panel.traces if one.name]
    return figure


Forces = dict[str, np.ndarray]

THIS = LineStyle(BLUE, "-", 1.1, 2.3)
TWIN = LineStyle(GOLD, "-", 2.2, 2.1)  # broader and lighter, below
MARK = LineStyle(RED, (0, (4, 1.5)), 1.0, 2.2)
EVENT = LineStyle(GREY, ":", 1.0, 2.0)
OPEN = LineStyle(BLACK, "-", 4.0)
BEGINS = ("opens", "begins")  # words of events; the others end what has begun
NAMES = {"this": "this job", "twin": "the same machine without clearance"}
MAX_ORDERS = 200  # that are drawn
MAX_ENVELOPE = 60  # of an envelope
ROUNDING = 1e-6  # m/s2, of an acceleration
DECADES = 4  # below the greatest line
ORDERS_AXIS = "order (cycles per revolution)"


@dataclass(frozen=True)
class Signal:
    """A panel of the page of signals."""

    title: str
    axis: str
    values: Callable[[xr.Dataset, Forces], np.ndarray]


SIGNALS = (
    Signal("acceleration of the crosshead", "a (m/s²)", lambda run, _: run["acceleration"].values),
    Signal("force on the frame along the cylinder", "X (kN)",
           lambda _, force: force["shaking_force"][:, 0] * KILONEWTON),
    Signal("force on the frame across the cylinder", "Y (kN)",
           lambda _, force: force["shaking_force"][:, 1] * KILONEWTON),
    Signal("force of the crosshead on its guide, upwards", "$F_g$ (kN)",
           lambda _, force: force["guide_force"] * KILONEWTON),
    Signal("torque that drives the crank", "T (N m)", lambda _, force: force["crank_torque"]),
    Signal("rod load at the crosshead pin, tension positive", "$F_r$ (kN)",
           lambda _, force: force["rod_load"] * KILONEWTON),
)  # fmt: skip


def draw_signals(run: xr.Dataset, twin: xr.Dataset | None) -> Drawing:
    """Return six panels of a run's last settled revolution, with the ideal machine's."""
    figure, panels = make_grid(3, 2, 8.6)
    for one, line, name in ((twin, TWIN, NAMES["twin"]), (run, THIS, NAMES["this"])):
        if one is None:
            continue
        degrees, revolution = last_revolution(one)
        forces = frame_forces(revolution)
        for panel, signal in zip(panels.flat, SIGNALS, strict=True):
            panel.plot(degrees, signal.values(revolution, forces), line, name)
            panel.title, panel.y.title = signal.title, signal.axis
        panels[0, 0].x.span(degrees[0], degrees[-1])
    panels[0, 0].x.step = 90.0
    for panel in panels[-1]:
        panel.x.title = ANGLE_AXIS
    share_scales(figure.panels, "x")
    figure.legend = [] if twin is None else panels[0, 0].traces[::-1]
    return figure


LOADS = (
    ("load of gas or spring on the piston, tension positive", "$F_g$ (kN)", "gas"),
    ("inertia of what reciprocates", "$F_i$ (kN)", "inertia"),
    ("rod load at the crosshead pin: both combined", "$F_r$ (kN)", "rod"),
)


def draw_loads(run: xr.Dataset, twin: xr.Dataset | None) -> Drawing:
    """Return the gas load, inertia and rod load over a revolution, with the ideal machine's."""
    figure, panels = make_grid(3, 1, 7.2)
    for one, line, name in ((twin, TWIN, NAMES["twin"]), (run, THIS, NAMES["this"])):
        if one is None:
            continue
        degrees, loads = read_loads(one)
        for panel, (title, axis, key) in zip(panels[:, 0], LOADS, strict=True):
            panel.plot(degrees, loads[key] * KILONEWTON, line, name)
            panel.title, panel.y.title = title, axis
        panels[0, 0].x.span(degrees[0], degrees[-1])
    panels[0, 0].x.step = 90.0
    panels[-1, 0].x.title = ANGLE_AXIS
    for panel in panels[:, 0]:
        panel.notes.append(Note(y=0.0, style=ZERO))
    share_scales(figure.panels, "x")
    figure.legend = [] if twin is None else panels[0, 0].traces[::-1]
    return figure


def draw_analyst(run: xr.Dataset, twin: xr.Dataset | None) -> Drawing:
    """Return a revolution as an analyst reads it: events, vibration and rod load.

    twin: the ideal machine, with the same sensor where the run has one.
    """
    found = read_cycle(run)
    spans = split_events(found.events)
    lanes = 1 + len(spans) + len(found.struck)
    figure, panels = make_grid(3, 1, 6.4 + 0.2 * lanes, heights=(0.34 * lanes, 3.4, 2.0))
    strip, vibration, load = panels[:, 0]
    for one, line, name in ((twin, TWIN, NAMES["twin"]), (run, THIS, NAMES["this"])):
        if one is None:
            continue
        cycle = read_cycle(one)
        vibration.plot(cycle.angle, cycle.vibration, line, name)
        load.plot(cycle.load_angle, cycle.rod_load * KILONEWTON, line, name)
    # a film takes the blow itself: contact that begins later is none
    word = "dry contact" if case_of(run).lubricant else "impacts"
    struck = {f"{word}, {SPOKEN[joint]}": (at, joint) for joint, at in found.struck.items()}
    plot_events(strip, spans, struck, found.reversals)
    for panel in (strip, vibration, load):
        panel.notes += [Note(x=angle, style=EVENT) for angle, _ in found.events]
        panel.notes += [Note(x=angle, style=MARK) for angle in found.reversals]
    load.notes.append(Note(y=0.0, style=ZERO))
    vibration.title = "acceleration of the crosshead"
    sensor = case_of(run).sensor
    if found.is_sensed and sensor:
        vibration.title = f"record of the sensor: {sensor.place}, along {sensor.direction}"
    vibration.y.title = "a (m/s²)"
    load.title = "rod load at the crosshead pin, tension positive; dashed: it changes its side"
    load.y.title = "$F_r$ (kN)"
    load.x.title = ANGLE_AXIS
    share_turn(figure.panels)
    figure.legend = [] if twin is None else vibration.traces[::-1]
    return figure


def split_events(events: Sequence[tuple[float, str]]) -> dict[str, list[tuple[float, float]]]:
    """Return the spans (degrees) in which a valve is open, or the cam dwells, by lane.

    A cylinder's two ends have lanes of their own. Spans lie within a revolution from 0 to 360.
    """
    found: dict[str, list[tuple[float, float]]] = {}
    begun: dict[str, float] = {}
    for angle, name in events:
        what, _, word = name.rpartition(" ")
        end, _, valve = what.partition(" ")
        lane = f"{valve}, {end} end" if end in BY_END else what
        spans = found.setdefault(lane, [])
        if word in BEGINS:
            begun[lane] = angle
        elif angle:
            spans.append((begun.pop(lane, 0.0), angle))
    for lane, angle in begun.items():
        found[lane].append((angle, 360.0))
    return dict(sorted(found.items(), reverse=True))


def plot_events(
    panel: Panel,
    spans: dict[str, list[tuple[float, float]]],
    struck: dict[str, tuple[np.ndarray, str]],
    reversals: Sequence[float],
) -> None:
    """Draw a lane each for every valve or the cam, the impacts of each joint, and the reversals.

    Crank angles in degrees; spans: of `split_events`; struck: angles and joint of a lane.
    """
    lanes = [*spans]
    for number, own in enumerate(spans.values()):
        x, y = join_with_gaps(np.array([(at, -number) for at in span]) for span in sorted(own))
        panel.plot(x, y, OPEN, lanes[number])
    marks = [(name, at, *BY_JOINT[joint]) for name, (at, joint) in struck.items()]
    for name, angles, color, shape in [*marks, ("reversals", np.array(reversals), RED, "s")]:
        panel.plot(angles, np.full(angles.size, -float(len(lanes))), mark(color, shape, 5), name)
        lanes.append(name)
    if spans:
        panel.title = f"bars: {'the cam dwells' if 'cam: dwell' in spans else 'a valve is open'}"
    panel.y.words = {-float(number): name for number, name in enumerate(lanes)}
    panel.y.span(0.6 - len(lanes), 0.8)
    panel.grid = ""


BY_END = {"head": LineStyle(BLUE, "-", 1.5, 2.3), "crank": LineStyle(RED, "--", 1.5, 2.3)}


def draw_cards(run: xr.Dataset, twin: xr.Dataset | None) -> Drawing:
    """Return the pressure in each end over gas volume and over crank angle, a revolution."""
    figure, panels = make_grid(1, 2, 4.6)
    over_volume, over_angle = panels.flat
    degrees, revolution = last_revolution(run)
    for end, gas in end_states(revolution).items():
        over_volume.plot(gas.volume, gas.pressure, BY_END[end], f"{end} end")
        over_angle.plot(degrees, gas.pressure, BY_END[end], f"{end} end")
    measured = case_of(run).gas.is_measured
    over_volume.x.title = "displaced volume (litres)" if measured else "gas volume V (litres)"
    over_volume.y.title = "pressure (MPa, absolute)"
    over_angle.x.title = ANGLE_AXIS
    over_angle.x.span(degrees[0], degrees[-1])
    over_angle.x.step = 90.0
    share_scales(figure.panels, "y")
    figure.legend = over_volume.traces
    return figure


def draw_spectra(run: xr.Dataset, twin: xr.Dataset | None) -> Drawing:
    """Return the order spectra of X and of the crosshead's deviation.

    With a sensor, of its envelope.
    """
    envelope = sensor_envelope(run)
    rows = 2 if envelope is None else 3
    figure, panels = make_grid(rows, 1, 2.7 * rows + 0.5)
    force, deviation = panels[:2, 0]
    if twin is not None:
        plot_lines(force, shaking(twin).spectrum.lines, TWIN, NAMES["twin"])
    plot_lines(force, shaking(run).spectrum.lines, THIS, NAMES["this"])
    force.title, force.y.title = "force on the frame along the cylinder", "amplitude of X (N)"
    plot_deviation(deviation, deviation_spectrum(run).lines)
    deviation.title = "acceleration of the crosshead less that of ideal joints"
    deviation.y.title = "amplitude (m/s²)"
    if envelope is not None:
        plot_envelope(panels[2, 0], (envelope.orders, envelope.amplitudes), envelope.band)
    for panel in panels.flat:
        panel.x.title = ORDERS_AXIS
    figure.legend = [] if twin is None else force.traces[::-1]
    return figure


def plot_lines(
    panel: Panel, lines: tuple[np.ndarray, np.ndarray], line: LineStyle, name: str
) -> None:
    """Draw orders and amplitudes, (k,) each, on a log scale from order 1 on; mark `ORDER`."""
    shown = (lines[0] >= 1) & (lines[0] <= MAX_ORDERS)
    orders, amplitudes = (values[shown] for values in lines)
    panel.plot(orders, amplitudes, line, name)
    top = max(one.y.max() for one in panel.traces)
    panel.y.log = True
    if top > 0:
        panel.y.span(top * 10.0**-DECADES, 3 * top)
    panel.x.span(0, orders[-1])
    if not panel.notes:
        panel.notes = [
            Note(x=ORDER, style=MARK),
            Note(f"order {ORDER}", ORDER, 1, LineStyle(RED), "y", (4, -4), level="top", size=8.5),
        ]


def plot_deviation(panel: Panel, lines: tuple[np.ndarray, np.ndarray]) -> None:
    """Draw the spectrum of a deviation, m/s2; in words where it is rounding, as of ideal joints."""
    if lines[1].max() > ROUNDING:
        plot_lines(panel, lines, THIS, NAMES["this"])
        return
    text = "none: the motion is that of ideal joints"
    panel.notes.append(Note(text, 0.5, 0.5, inside="xy", side="center"))
    panel.x.span(0, MAX_ORDERS)
    panel.y.ticks = ()


def plot_envelope(
    panel: Panel, lines: tuple[np.ndarray, np.ndarray], band: tuple[float, float]
) -> None:
    """Draw a sensor's envelope spectrum, orders and amplitudes (k,), without mean; band in Hz."""
    shown = (lines[0] > 0.01) & (lines[0] <= MAX_ENVELOPE)
    panel.plot(lines[0][shown], lines[1][shown], THIS, NAMES["this"])
    low, high = (edge / 1e3 for edge in band)
    panel.title = f"envelope of the sensor between {low:.3g} and {high:.3g} kHz"
    panel.y.title = "amplitude (m/s²)"
    panel.y.span(low=0)
    panel.x.span(0, MAX_ENVELOPE)


MAX_TICKS = 12
MAX_MAP_ORDERS = 150
MAP_DECADES = 3  # below the greatest line above `ORDER`
CYCLE_DECADES = 2  # below the greatest vibration
ROW, LEAST = 0.24, 3.4  # inches: of a row, and of all


def start_map(
    rows: Sequence[SweptRow], title: str, x: np.ndarray, table: np.ndarray,
    ends: tuple[float, float], name: str,
) -> tuple[Drawing, Panel]:  # fmt: skip
    """Return a figure with a table in colour, a row a value, and the panel of that.

    title: of the rows; x: edges of the table's columns; ends: of the colours, which `name` titles.
    """
    figure, panels = make_grid(1, 2, height(len(rows)) + 0.9, widths=(3, 1))
    image = panels[0, 0]
    colors = ColorScale(palette("cividis"), *ends, True, name, "top", 50, pointed=True)
    edges = np.arange(len(rows) + 1) - 0.5
    image.traces.append(map_cells(x, edges, np.maximum(table, ends[0]), colors))
    label_rows(image, rows, title)
    return figure, image


def finish_map(figure: Drawing, values: np.ndarray, title: str, top: float) -> Drawing:
    """Return a figure of `start_map` with a number a row beside the map, and a legend of marks."""
    image, beside = figure.panels
    dots = LineStyle(BLUE, linewidth=1.5, marker="o", markersize=3.5)
    beside.plot(values, np.arange(values.size, dtype=float), dots)
    beside.x.title = title
    beside.x.span(0, top)
    share_scales(figure.panels, "y")
    figure.legend = [one for one in image.traces if one.is_points]
    return figure


def draw_waterfall(rows: Sequence[SweptRow], title: str) -> Drawing:
    """Return order spectra of X, a row a value, in colour; beside them the rms above `ORDER`."""
    found = [row.shaking for row in rows]
    size = min(MAX_MAP_ORDERS, *(one.spectrum.orders.size - 1 for one in found if one))
    table = np.full((len(rows), size), np.nan)
    for number, one in enumerate(found):
        if one:
            table[number] = one.spectrum.amplitudes[1 : size + 1]
    top = np.nanmax(table[:, ORDER:])  # the first orders are beyond the scale
    if top < 1e-9 * np.nanmax(table):  # ideal joints: rounding
        top = np.nanmax(table)
    ends = top * 10.0**-MAP_DECADES, top
    figure, image = start_map(rows, title, np.arange(size + 1) + 0.5, table, ends,
                              "amplitude of X (N)")  # fmt: skip
    image.notes.append(Note(x=ORDER + 0.5, style=LineStyle(RED, (0, (4, 1.5)))))
    image.x.title = ORDERS_AXIS + f"; dashed: order {ORDER}"
    above = np.array([one.spectrum.above if one else np.nan for one in found])
    words = f"rms of X above\norder {ORDER} (N)"
    return finish_map(figure, above, words, max(1.0, 1.08 * np.nanmax(above)))


def draw_cycles(rows: Sequence[SweptRow], title: str) -> Drawing:
    """Return the vibration in each degree, a row a value, in colour; beside them its peaks.

    Marks: the rod load changes its side; valves open and close, or the cam's follower stops.
    """
    found = [row.cycle for row in rows]
    table = np.array([one.degree_peaks if one else np.full(360, np.nan) for one in found])
    top = np.nanmax(table)
    ends = top * 10.0**-CYCLE_DECADES, top
    figure, image = start_map(rows, title, np.arange(361.0), table, ends, "|a| (m/s²)")
    corners = [[at for at, _ in one.events] if one else [] for one in found]
    reversals = [one.reversals if one else () for one in found]
    has_cam = any(event.startswith("cam") for one in found if one for _, event in one.events)
    corner = "corner of the load" if has_cam else "a valve opens or closes"
    for name, shape, color, angles in (
        (corner, "v", "#ffffff", corners),
        ("rod load changes its side", "s", RED, reversals),
    ):
        if not any(len(some) for some in angles):
            continue
        x = np.array([at for some in angles for at in some])
        y = np.array([float(n) for n, some in enumerate(angles) for _ in some])
        image.plot(x, y, mark(color, shape, 4, edge=BLACK), name)
    image.x.title = ANGLE_AXIS
    share_turn([image], 90.0)
    peaks = np.nanmax(np.where(np.isnan(table), -1.0, table), axis=1)
    return finish_map(figure, np.where(peaks < 0, np.nan, peaks), "peak (m/s²)", 1.08 * top)


def draw_segments(rows: Sequence[SweptRow], title: str) -> Drawing:
    """Return the rms in segments of 10 degrees over the healthy machine's, a row a value.

    In colour, with marks where a segment is over its limit; beside them the greatest rms.
    """
    found = [row.segments for row in rows]
    table = np.array([one.ratio if one else np.full(36, np.nan) for one in found])
    top = max(float(np.nanmax(table)), 1.1)
    figure, image = start_map(rows, title, 10.0 * np.arange(37), table, (1.0, top),
                              "rms over that without clearance")  # fmt: skip
    for name, shape, color, over in (
        ("over its limit", "s", RED, [o.over_limit if o else None for o in found]),
        ("perhaps over it, by the bar", "o", GOLD, [o.doubtful if o else None for o in found]),
    ):
        marks = [(10.0 * at + 5.0, float(n)) for n, some in enumerate(over) if some is not None
                 for at in np.flatnonzero(some)]  # fmt: skip
        if marks:
            x, y = np.array(marks).T
            image.plot(x, y, mark(color, shape, 4, edge=BLACK), name)
    image.x.title = ANGLE_AXIS
    share_turn([image], 90.0)
    greatest = np.array([np.nanmax(one.rms) if one else np.nan for one in found])
    words = "greatest rms of a\nsegment (m/s²)"
    return finish_map(figure, greatest, words, 1.08 * float(np.nanmax(greatest)))


def draw_map(rows: Sequence[SweptRow], title: str) -> Drawing:
    """Return the most frequent contact mode over the crank angle, a row a value, for each joint."""
    modes = rows_modes(rows)
    figure, panels = make_grid(1, len(modes), height(len(rows)) + 0.9)
    for panel, (joint, table) in zip(panels.flat, modes.items(), strict=True):
        plot_modes(panel, table)
        panel.title = SPOKEN[joint]
        panel.x.title = ANGLE_AXIS
    label_rows(panels[0, 0], rows, title)
    share_scales(figure.panels, "y")
    figure.legend = mode_entries(row_modes_words(rows))
    if any((table < 0).any() for table in modes.values()):
        figure.legend += [entry("no series, or no clearance", UNSEEN, "band")]
    return figure


def plot_modes(panel: Panel, table: np.ndarray) -> None:
    """Draw modes, (rows, bins) of integers as in `mode_map`, in their colours; below 0 hatched."""
    edges = np.linspace(0, 360, table.shape[1] + 1), np.arange(len(table) + 1) - 0.5
    colors = ColorScale((*MODE_COLORS.values(),), -0.5, len(MODES) - 0.5, side="")
    known = np.where(table < 0, np.nan, table)
    panel.ground, panel.grid = UNSEEN, ""
    panel.traces.append(map_cells(*edges, known, colors))
    if len(table) < 40:
        between = [np.array([[0.0, edge], [360.0, edge]]) for edge in edges[1][1:-1]]
        panel.plot(*join_with_gaps(between), LineStyle("#ffffff", linewidth=0.8))
    panel.x.span(0, 360)
    panel.x.step = 90.0


def label_rows(panel: Panel, rows: Sequence[SweptRow], title: str) -> None:
    """Draw the swept values at some of the rows, with what became of those that have no series."""
    each = -(-len(rows) // MAX_TICKS)
    words = [f"{row.value} ({row.problem})" if row.problem else row.value for row in rows]
    panel.y.words = {float(n): words[n] for n in range(0, len(rows), each)}
    panel.y.span(-0.5, len(rows) - 0.5)
    panel.y.title, panel.grid = title, ""


def height(rows: int) -> float:
    """Return the height (inches) of so many rows."""
    return min(9.0, max(LEAST, ROW * rows))
