"""Figures of one job: a revolution, signals, cards, spectra, orbits."""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from compressor import analysis
from compressor.cases import Sensor
from compressor.metrics import JOINTS
from compressor.report.figures import curves, style
from compressor.report.figures.drawing import WAYS, Panel, make_grid
from compressor.report.figures.sweep_data import MEASURES
from compressor.report.figures.table import DrawnFigure, Number, figure, spell, spell_span
from compressor.store import CLIPPED
from compressor.units import Units, unit_in

PATH = style.LineStyle(style.BLUE, (), 0.9, 2.3)
ZERO = style.LineStyle(style.BLACK, linewidth=0.8)
BY_JOINT = dict(zip(JOINTS, ((style.BLUE, "circle"), (style.RED, "diamond")), strict=True))
CORNERS = {0: ("top dead centre", "circle"), 90: ("90°", "triangle-up"),
           180: ("bottom dead centre", "square"), 270: ("270°", "triangle-down")}  # fmt: skip
MICROMETRE = 1e6
ROD_LOADS = ("peak_rod_load_tension", "peak_rod_load_compression")
MAX_ANGLES = 12  # that a caption lists
_, G = unit_in("m/s²", "plant")  # from m/s2 to g
Twin: TypeAlias = xr.Dataset | None  # the same machine without clearance

CHAOTIC = (
    " The motion is chaotic: another correct solution has other peaks and lines; more settled "
    "revolutions (solve.duration_rev) make averages that hold."
)
FILM = (
    " The joints have oil: forces include its film's, contact is dry contact, and without it the "
    "film bears the journal."
)


def caution(run: xr.Dataset) -> str:
    """Return the sentence that captions of a chaotic run add, else nothing."""
    return CHAOTIC if run.attrs.get("regime") == "chaotic" else ""


def film(run: xr.Dataset) -> str:
    """Return the sentence that captions of contacts add for joints with oil, else nothing."""
    return FILM if analysis.case_of(run).lubricant else ""


THIS = style.LineStyle(style.BLUE, (), 1.1, 2.3)
TWIN = style.LineStyle(style.GOLD, (), 2.2, 2.1)  # broader and lighter, below
MARK = style.LineStyle(style.RED, (4, 1.5), 1.0, 2.2)
EVENT = style.LineStyle(style.GREY, (1, 1.65), 1.0, 2.0)
OPEN = style.LineStyle(style.BLACK, (), 4.0)
BEGINS = ("opens", "begins")  # words of events; the others end what has begun
NAMES = {"this": "this job", "twin": "the same machine without clearance"}
MAX_ORDERS = 200  # that are drawn
DECADES = 4  # below the greatest line
ORDERS_AXIS = "order (cycles per revolution)"


@figure("job", "analyst", "a revolution as an analyst reads it")
def draw_analyst(run: xr.Dataset, twin: Twin, units: Units = "usual") -> DrawnFigure:
    """Return a revolution as an analyst reads it: events, vibration and rod load.

    twin: the ideal machine, with the same sensor where the run has one.
    """
    found = analysis.read_cycle(run)
    spans = split_events(found.events)
    lanes = 1 + len(spans) + len(found.struck)
    drawing, panels = make_grid(
        3, 1, 6.4 + 0.2 * lanes, heights=(0.34 * lanes, 3.4, 2.0), units=units, share_x="all"
    )
    strip, vibration, load = panels[:, 0]
    vibration.label("y", "a ({})", "m/s²")
    load.label("y", "F<sub>r</sub> ({})", "kN")
    for one, line, name in ((run, THIS, NAMES["this"]), (twin, TWIN, NAMES["twin"])):
        if one is None:
            continue
        cycle = analysis.read_cycle(one)
        vibration.plot(cycle.angle, cycle.vibration, line, name)
        load.plot(cycle.load_angle, cycle.rod_load * curves.KILONEWTON, line, name)
    # a film takes the blow itself: contact that begins later is none
    word = "dry contact" if analysis.case_of(run).lubricant else "impacts"
    struck = {
        f"{word}, {analysis.SPOKEN[joint]}": (at, joint) for joint, at in found.struck.items()
    }
    plot_events(strip, spans, struck, found.reversals)
    for panel in (strip, vibration, load):
        for angle, _ in found.events:
            panel.rule(EVENT, x=angle)
        for angle in found.reversals:
            panel.rule(MARK, x=angle)
    load.rule(ZERO, y=0.0)
    vibration.title = "acceleration of the crosshead"
    sensor = analysis.case_of(run).sensor
    if found.is_sensed and sensor:
        vibration.title = f"record of the sensor: {sensor.place}, along {sensor.direction}"
    load.title = "rod load at the crosshead pin, tension positive; dashed: it changes its side"
    for panel in drawing.panels:
        show_turn(panel)
    sentence = (
        f"The last settled revolution: {vibration.title}, every {spell_step(found.angle)}, and rod "
        f"load below, every {spell_step(found.load_angle)}; peaks are of these samples."
    )
    numbers = number_analyst(found, word, units)
    vibrates = "sensor_peak" if found.is_sensed else "peak_acceleration"
    numbers += number_metrics(run, units, vibrates, *ROD_LOADS)
    if twin is not None:
        peak, _ = loudest(analysis.read_cycle(twin))
        numbers.insert(2, ("greatest without clearance", spell(peak, "m/s²", units)))
    clipped = float(run.get("clipped_fraction", 0.0))
    if clipped >= Sensor.REPORTED:
        numbers.append(("record", CLIPPED.format(share=f"{100.0 * clipped:.3g}")))
    return DrawnFigure(drawing.figure(), sentence + film(run) + caution(run), numbers)


def number_analyst(found: analysis.Cycle, contact: str, units: Units) -> list[Number]:
    """Return the numbers of a revolution; contact: what begins, in words."""
    peak, at = loudest(found)
    also = f" ({spell(G * peak, 'g')})" * (units != "plant")
    rms = float(np.sqrt(np.mean(found.vibration**2)))
    events = ", ".join(f"{name} at {angle:.0f}°" for angle, name in found.events)
    struck = [(f"{contact} at the {analysis.SPOKEN[joint]}", spell_turns(at))
              for joint, at in found.struck.items()]  # fmt: skip
    return [
        ("greatest acceleration", f"{spell(peak, 'm/s²', units)}{also} at {at:.0f}°"),
        ("rms", spell(rms, "m/s²", units)),
        ("rod load", spell_span(found.rod_load * curves.KILONEWTON, "kN", units)),
        ("it changes its side at", spell_turns(found.reversals)),
        *([("events", events)] if events else []),
        *struck,
    ]


def spell_step(angle: np.ndarray) -> str:
    """Return how far samples are apart."""
    return f"{np.median(np.diff(angle)):.3g}°"


def number_metrics(run: xr.Dataset, units: Units, *names: str) -> list[Number]:
    """Return the job's metrics of some names, which no sampling or single revolution lessens."""
    shown = [
        one.read_in(units) for one in MEASURES if one.variable in names and one.variable in run
    ]
    texts = [f"{one.title} {spell(one.of(run), one.unit)}" for one in shown
             if np.isfinite(one.of(run))]  # fmt: skip
    return [("over all settled revolutions", ", ".join(texts))] * bool(texts)


def spell_turns(angles: Sequence[float] | np.ndarray) -> str:
    """Return the first crank angles (degrees), and how many more there are."""
    words = [f"{angle:.0f}°" for angle in angles[:MAX_ANGLES]]
    more = len(angles) - len(words)
    return (", ".join(words) or "none") + (f" and {more} more" if more else "")


def loudest(found: analysis.Cycle) -> tuple[float, float]:
    """Return the greatest magnitude of a revolution's vibration (m/s2), and its angle (degrees)."""
    place = int(np.argmax(np.abs(found.vibration)))
    return float(np.abs(found.vibration[place])), float(found.angle[place])


class Signal(NamedTuple):
    """A panel over the crank angle: its title, its axis without the unit, the unit, the series."""

    title: str
    axis: str
    unit: str
    name: str


SIGNALS = (
    Signal("acceleration of the crosshead", "a", "m/s²", "acceleration"),
    Signal("force on the frame along the cylinder", "X", "kN", "along"),
    Signal("force on the frame across the cylinder", "Y", "kN", "across"),
    Signal("force of the crosshead on its guide, upwards", "F<sub>g</sub>", "kN", "guide_force"),
    Signal("torque that drives the crank", "T", "N m", "crank_torque"),
    Signal("load of gas or spring on the piston, tension positive", "−F<sub>p</sub>", "kN", "load"),
    Signal("inertia of what reciprocates", "F<sub>i</sub>", "kN", "inertia"),
    Signal("rod load at the crosshead pin: both combined", "F<sub>r</sub>", "kN", "rod_load"),
)


def read_signals(run: xr.Dataset) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return crank angles (degrees) of the last revolution, and its signals by name, SI.

    Of a rigid crosshead in a guide without friction the rod load is that of gas or spring and of
    inertia together.
    """
    degrees, revolution = analysis.last_revolution(run)
    forces = analysis.frame_forces(revolution)
    along, across = forces["shaking_force"].T
    acceleration = revolution["acceleration"].values
    return degrees, forces | {
        "acceleration": acceleration, "along": along, "across": across,
        "load": -revolution["piston_force"].values,
        "inertia": -analysis.case_of(run).machine.reciprocating_mass_kg * acceleration,
    }  # fmt: skip


@figure("job", "signals", "acceleration, loads, forces and torque over crank angle")
def draw_signals(run: xr.Dataset, twin: Twin, units: Units = "usual") -> DrawnFigure:
    """Return panels of a run's last settled revolution, with the ideal machine's."""
    drawing, panels = make_grid(4, 2, 10.4, units=units, share_x="all")
    for panel, signal in zip(panels.flat, SIGNALS, strict=True):
        panel.title = signal.title
        panel.label("x", curves.ANGLE_AXIS, "°")
        panel.label("y", f"{signal.axis} ({{}})", signal.unit)
        panel.rule(ZERO, y=0.0)
    numbers = []
    both = (run, THIS, "this", ""), (twin, TWIN, "twin", ", without clearance")
    for one, line, name, where in both:
        if one is None:
            continue
        degrees, series = read_signals(one)
        for panel, signal in zip(panels.flat, SIGNALS, strict=True):
            values = series[signal.name] * (curves.KILONEWTON if signal.unit == "kN" else 1.0)
            panel.plot(degrees, values, line, NAMES[name])
            numbers.append((f"{signal.title}{where}", spell_span(values, signal.unit, units)))
        panels[0, 0].span("x", degrees[0], degrees[-1])
    panels[0, 0].x.dtick = 90.0
    numbers += number_metrics(run, units, "peak_acceleration", *ROD_LOADS)
    sentence = (
        "The last settled revolution over crank angle, at stored samples, every "
        f"{spell_step(analysis.last_revolution(run)[0])}; peaks are of these."
    )
    return DrawnFigure(drawing.figure(), sentence + caution(run), numbers)


def split_events(events: Sequence[tuple[float, str]]) -> dict[str, list[tuple[float, float]]]:
    """Return the spans (degrees) in which a valve is open, or the cam dwells, by lane.

    A cylinder's two ends have lanes of their own. Spans lie within a revolution from 0 to 360.
    """
    found: dict[str, list[tuple[float, float]]] = {}
    begun: dict[str, float] = {}
    for angle, name in events:
        what, _, word = name.rpartition(" ")
        end, _, valve = what.partition(" ")
        lane = what if end == "cam:" else f"{what} open"
        lane = f"{valve} open, {end} end" if end in BY_END else lane
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
        at = np.array([end for span in sorted(own) for end in (*span, np.nan)][:-1])
        panel.plot(at, 0.0 * at - number, OPEN, lanes[number], listed=False)
    marks = [(name, at, *BY_JOINT[joint]) for name, (at, joint) in struck.items()]
    marks.append(("reversals", np.array(reversals), style.RED, "square"))
    for name, angles, color, shape in marks:
        y = np.full(angles.size, -float(len(lanes)))
        panel.plot(angles, y, style.mark(color, shape, 5), name, listed=False)
        lanes.append(name)
    panel.title = "events"
    panel.name_ticks("y", lanes, -np.arange(len(lanes)))
    panel.span("y", 0.6 - len(lanes), 0.8)
    panel.x.showgrid = panel.y.showgrid = False


BY_END = {
    "head": style.LineStyle(style.BLUE, (), 1.5, 2.3),
    "crank": style.LineStyle(style.RED, (3.7, 1.6), 1.5, 2.3),
}


@figure("job", "cards", "indicator cards", "gas")
def draw_cards(run: xr.Dataset, twin: Twin, units: Units = "usual") -> DrawnFigure:
    """Return the pressure in each end over gas volume and over crank angle, a revolution."""
    drawing, panels = make_grid(1, 2, 4.6, units=units, share_y="all")
    over_volume, over_angle = panels.flat
    measured = analysis.case_of(run).gas.is_measured
    over_volume.label("x", "displaced volume (litres)" if measured else "gas volume V (litres)")
    over_angle.label("x", curves.ANGLE_AXIS, "°")
    for panel in panels.flat:
        panel.label("y", "pressure ({}, absolute)", "MPa")
    degrees, revolution = analysis.last_revolution(run)
    seconds, numbers = float(np.ptp(revolution["time"].values)), []
    for end, gas in analysis.end_states(revolution).items():
        over_volume.plot(gas.volume, gas.pressure, BY_END[end], f"{end} end")
        over_angle.plot(degrees, gas.pressure, BY_END[end], f"{end} end")
        numbers.append((f"indicated power, {end} end", spell(1e-3 * gas.work / seconds, "kW")))
    over_angle.x.dtick = 90.0
    over_angle.span("x", degrees[0], degrees[-1])
    sentence = (
        "Pressure of the gas over its volume and over crank angle, in the last settled revolution, "
        "as it presses on the piston."
    )
    return DrawnFigure(drawing.figure(), sentence + caution(run), numbers)


@figure("job", "spectra", "order spectrum of the force on the frame along the cylinder")
def draw_spectra(run: xr.Dataset, twin: Twin, units: Units = "usual") -> DrawnFigure:
    """Return the order spectrum of X, on a log scale from order 1 on."""
    drawing, panels = make_grid(1, 1, 3.2, units=units)
    (panel,) = panels.flat
    panel.label("y", "amplitude of X ({})", "N")
    panel.rule(MARK, x=analysis.ORDER)
    numbers, top = [], 0.0
    both = (
        (run, THIS, "this", f"rms of X above order {analysis.ORDER}"),
        (twin, TWIN, "twin", "without clearance"),
    )
    for one, line, name, label in both:
        if one is not None:
            found = analysis.shaking(one)
            amplitudes = found.amplitudes[1 : MAX_ORDERS + 1]
            panel.plot(np.arange(1, amplitudes.size + 1), amplitudes, line, NAMES[name])
            panel.span("x", 0, amplitudes.size)
            top = max(top, amplitudes.max())
            numbers.append((label, spell(found.above, "N", units)))
    panel.y.type = "log"
    if top > 0:
        panel.span("y", top * 10.0**-DECADES, 3 * top)
    panel.x.title = ORDERS_AXIS
    step = spell_step(analysis.last_revolution(run)[0])
    sentence = (
        f"Peak amplitudes over the settled revolutions, of stored samples, every {step}; dashed: "
        f"order {analysis.ORDER}."
    )
    return DrawnFigure(drawing.figure(), sentence + caution(run), numbers)


@figure("job", "orbits", "orbits of the journals", "clearance")
def draw_orbits(run: xr.Dataset, twin: Twin, units: Units = "usual") -> DrawnFigure:
    """Return the journal's orbit in each bore with clearance over the last revolution."""
    joints = analysis.joints_with_clearance(run)
    drawing, panels = make_grid(1, len(joints), 5.4, units=units)
    degrees, revolution = analysis.last_revolution(run)
    numbers = []
    for panel, (joint, clearance) in zip(panels.flat, joints.items(), strict=True):
        here = revolution.sel(joint=joint)
        place = MICROMETRE * here["eccentricity"].transpose("time", "axis").values
        plot_orbit(panel, degrees, place, MICROMETRE * clearance)
        panel.title = f"{analysis.SPOKEN[joint]}; circle: clearance {1e3 * clearance:.3g} mm"
        depth = here["penetration"].values
        off = spell(100.0 * (depth < 0).mean(), "% of the time")
        numbers += [
            (f"{analysis.SPOKEN[joint]}, off its wall", off),
            ("deepest, below 0 a gap", spell(MICROMETRE * depth.max(), "µm", units)),
        ]
    sentence = "Journal centres in their bores to scale, in the last settled revolution."
    return DrawnFigure(drawing.figure(), sentence + film(run) + caution(run), numbers)


def plot_orbit(panel: Panel, degrees: np.ndarray, place: np.ndarray, clearance: float) -> None:
    """Draw one orbit (µm), to scale, in its clearance circle; marks stand at each quarter turn."""
    panel.label("x", "e<sub>x</sub> ({}), along the cylinder", "µm")
    panel.label("y", "e<sub>y</sub> ({})", "µm")
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    wall = style.LineStyle(style.BLACK, linewidth=1.0, zorder=1.0)
    panel.plot(clearance * np.cos(turn), clearance * np.sin(turn), wall)
    panel.plot(place[:, 0], place[:, 1], PATH, "path of the journal's centre")
    for angle, (name, shape) in CORNERS.items():
        nearest = np.argmin(np.abs((degrees - angle + 180) % 360 - 180))
        x, y = place[nearest]
        panel.plot(x, y, style.mark(style.GOLD, shape, 7, 4, edge=style.BLACK), name)
    room = 1.08 * max(clearance, np.linalg.norm(place, axis=1).max())
    panel.y.scaleanchor = f"x{panel.suffix}"
    for way in WAYS:
        panel.span(way, -room, room)
        panel.axis(way).nticks = 5


def show_turn(panel: Panel, step: float = 45.0) -> None:
    """Show one turn of the crank, with ticks so many degrees apart."""
    panel.label("x", curves.ANGLE_AXIS, "°")
    panel.span("x", 0.0, 360.0)
    panel.x.dtick = step
