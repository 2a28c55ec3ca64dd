"""Captions of `compsim plot`: sentences that say the numbers of what is drawn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from compressor.analysis.contacts import (
    MODES,
    OILED_MODES,
    UNKNOWN,
    contact_modes,
    impacts,
    joints_with_clearance,
    mode_shares,
)
from compressor.analysis.cycle import Cycle, read_cycle, read_loads
from compressor.analysis.cylinder import cylinder_words, end_states
from compressor.analysis.orbit import orbit
from compressor.analysis.runs import SPOKEN, case_of, record_of, settled_revolutions
from compressor.analysis.shaking import (
    ORDER,
    Shaking,
    deviation_spectrum,
    frame_forces,
    last_revolution,
    sensor_envelope,
    shaking,
    whole_revolutions,
)
from compressor.metrics import JOINTS
from compressor.units import unit_in

if TYPE_CHECKING:
    import xarray as xr


def plural(count: int, thing: str) -> str:
    """Return a number of things in words."""
    return f"{count} {thing}" + ("s" if count != 1 else "")


@dataclass(frozen=True)
class Segments:
    """The rms of a sensor's record in 36 segments of 10 degrees, m/s2, (36,) each.

    `rms` with its error `bar`; `healthy`: of the same machine without clearance; `limit`: nan where
    none is given.
    """

    rms: np.ndarray
    bar: np.ndarray
    healthy: np.ndarray
    limit: np.ndarray

    @property
    def ratio(self) -> np.ndarray:
        """Return the rms over that of the machine without clearance, (36,)."""
        return self.rms / self.healthy

    @property
    def over_limit(self) -> np.ndarray:
        """Return which segments are over their limit by more than their error bar, (36,)."""
        return self.rms - self.bar > self.limit

    @property
    def doubtful(self) -> np.ndarray:
        """Return which segments may be over their limit, within their error bar, (36,)."""
        return (self.rms + self.bar > self.limit) & ~self.over_limit


@dataclass(frozen=True)
class SweptRow:
    """One job: its value on the axis in words, and what its series show.

    `shaking` is None, and `problem` says why, where the job has none. `modes`: as `angle_modes`
    gives them, None of ideal joints. `cycle`: its last revolution; `segments`: of its sensor's
    record. `chaotic`: single lines hold for this course of the motion only. `lubricated`: its
    joints have oil.
    """

    value: str
    shaking: Shaking | None = None
    modes: "xr.Dataset | None" = None
    cycle: Cycle | None = None
    segments: Segments | None = None
    problem: str = ""
    chaotic: bool = False
    lubricated: bool = False

    def with_segments(
        self, run: "xr.Dataset", healthy: np.ndarray, limit: tuple[float, bool] | None
    ) -> "SweptRow":
        """Return the row with the segments of a run that has a sensor.

        healthy: rms in each segment without clearance, m/s2, (36,); limit: m/s2, or times that of
        the healthy machine where the second is True.
        """
        rms = run["sensor_segment_rms"].values
        bar = run["sensor_segment_rms_error"].values if "sensor_segment_rms_error" in run else None
        limits = np.full(rms.size, np.nan)
        if limit is not None:
            limits = limit[0] * (healthy if limit[1] else np.ones(rms.size))
        found = Segments(rms, np.zeros(rms.size) if bar is None else bar, healthy, limits)
        return replace(self, segments=found)


def row_modes_words(rows: Sequence[SweptRow]) -> tuple[str, ...]:
    """Return what the contact modes of rows are called: of oiled joints where all have oil."""
    return OILED_MODES if all(row.lubricated for row in rows if row.modes) else MODES


def rows_modes(rows: Sequence[SweptRow]) -> dict[str, np.ndarray]:
    """Return the most frequent mode over rows and crank angle, by joint: (rows, bins).

    Integers, -1 where nothing is known; {} where no joint has clearance.
    """
    known = [row.modes for row in rows if row.modes is not None]
    found = {}
    for joint in (one for one in JOINTS if any(one in modes["joint"] for modes in known)):
        table = np.full((len(rows), known[0].sizes["angle"]), UNKNOWN)
        for number, row in enumerate(rows):
            if row.modes is not None and joint in row.modes["joint"]:
                table[number] = row.modes["majority"].sel(joint=joint).values
        found[joint] = table
    return found


_, G = unit_in("m/s²", "plant")  # from m/s2 to g
Twin: TypeAlias = "xr.Dataset | None"  # the same machine without clearance

CHAOTIC = (
    " The motion is chaotic: another correct solution has other peaks and lines; more settled "
    "revolutions (solve.duration_rev) make averages that hold."
)
FILM = (
    " The joints have oil: forces include its film's, contact is dry contact, and without it the "
    "film bears the journal."
)
MIN_FORCE = 0.05  # N: below it a force is given as less than 0.1


def caution(run: "xr.Dataset") -> str:
    """Return the sentence that captions of a chaotic run add, else nothing."""
    return CHAOTIC if run.attrs.get("regime") == "chaotic" else ""


def film(run: "xr.Dataset") -> str:
    """Return the sentence that captions of contacts add for joints with oil, else nothing."""
    return FILM if case_of(run).lubricant else ""


def signals(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the last revolution: the greatest and least of what is drawn."""
    _, revolution = last_revolution(run)
    _, count = whole_revolutions(run)
    forces = frame_forces(revolution)
    x, y = 1e-3 * forces["shaking_force"].T
    torque, rod = forces["crank_torque"], 1e-3 * forces["rod_load"]
    peak = np.abs(revolution["acceleration"].values).max()
    beside, ideal_joints = "", " No joint has clearance: there is no contact to draw."
    ideal_joints = "" if record_of(run)["clearance"].any() else ideal_joints
    if twin is not None:
        _, ideal = last_revolution(twin)
        beside = f" ({np.abs(ideal['acceleration'].values).max():.0f} m/s² without clearance)"
    return (
        f"The last of {plural(count, 'settled revolution')} over crank angle, at stored samples. "
        f"Acceleration reaches {peak:.0f} m/s²{beside}, X {span(x)} kN, Y {span(y)} kN, the "
        f"guide's force {span(1e-3 * forces['guide_force'])} kN, the torque "
        f"{span(torque, '.0f')} N m, the rod load {span(rod)} kN.{ideal_joints}{caution(run)}"
    )


def cards(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the gas in the cylinder: its indicated power, and that of the ideal cycle."""
    _, revolution = last_revolution(run)
    seconds = float(revolution["time"][-1] - revolution["time"][0])
    powers = {end: 1e-3 * one.work / seconds for end, one in end_states(revolution).items()}
    each = ", ".join(f"{end} end {power:.2f} kW" for end, power in powers.items())
    return (
        "Pressure of the gas over its volume and over crank angle, in the last settled revolution, "
        f"as it presses on the piston. Indicated power {sum(powers.values()):.2f} kW ({each}) by "
        f"the areas; without clearance {cylinder_words(case_of(run))}.{caution(run)}"
    )


def spectra(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the order spectra: what lies above `ORDER`."""
    found = shaking(run)
    sentences = [
        f"Peak amplitudes, mean squares over {plural(found.revolutions, 'settled revolution')}.",
        f"rms of X above order {ORDER}: {newtons(found.spectrum.above)}",
    ]
    if twin is not None:
        sentences[-1] += f"; without clearance {newtons(shaking(twin).spectrum.above)}"
    deviation = deviation_spectrum(run).above
    text = f"{deviation:.1f}" if deviation >= MIN_FORCE else "less than 0.1"
    sentences[-1] += f". Of the crosshead's deviation above it: {text} m/s²."
    envelope = sensor_envelope(run)
    if envelope is not None:
        low, high = envelope.band
        sentences.append(
            f"The sensor's band from {low:.0f} to {high:.0f} Hz has the greatest spectral "
            f"kurtosis, {envelope.kurtosis:.1f}."
        )
        sensor, clipped = case_of(run).sensor, float(run.get("clipped_fraction", 0.0))
        text = sensor.report_clipping(clipped) if sensor else ""
        sentences += [f"{text}."] if text else []
    else:
        has_record = "sensor_acceleration" in run
        sentences.append(
            "The sensor's record is too short, or silent, for an envelope."
            if has_record
            else "No sensor record: a case with body and sensor has one."
        )
    return " ".join(sentences) + caution(run)


def analyst(run: "xr.Dataset", twin: Twin) -> str:
    """Describe a revolution as an analyst reads it: peaks, reversals, valve events, impacts."""
    found, case = read_cycle(run), case_of(run)
    kind = "The acceleration of the crosshead"
    if found.is_sensed and case.sensor:
        kind = f"The sensor's record ({case.sensor.place}, along {case.sensor.direction})"
    peak, at = loudest(found)
    rms = float(np.sqrt(np.mean(found.vibration**2)))
    beside = ""
    if twin is not None:
        beside = f"; without clearance it reaches {loudest(read_cycle(twin))[0]:.3g} m/s²"
    sentences = [
        f"The last settled revolution. {kind} reaches {peak:.3g} m/s² ({G * peak:.3g} g) at "
        f"{at:.0f}°, rms {rms:.3g} m/s²{beside}.",
        f"The rod load goes from {span(1e-3 * found.rod_load)} kN and changes its side at "
        f"{angles(found.reversals)}." if found.reversals
        else f"The rod load, {span(1e-3 * found.rod_load)} kN, does not change its side.",
    ]  # fmt: skip
    if found.events:
        names = [f"{name} at {angle:.0f}°" for angle, name in found.events]
        kind = "Valves" if case.load == "gas" else "Load"
        sentences.append(f"{kind}: {', '.join(names)}.")
    kind = "Dry contact that begins" if case.lubricant else "Impacts after flight"
    for joint, struck in found.struck.items():
        text = f"at {angles(struck)}" if len(struck) else "none"
        sentences.append(f"{kind} at the {SPOKEN[joint]}: {text}.")
    return " ".join(sentences) + film(run) + caution(run)


MAX_ANGLES = 12  # that a caption lists


def angles(values: Sequence[float] | np.ndarray) -> str:
    """Return crank angles (degrees) in words."""
    words = [f"{value:.0f}°" for value in values[:MAX_ANGLES]]
    more = len(values) - len(words)
    return ", ".join(words) + (f" and {more} more" if more else "")


def loudest(found: Cycle) -> tuple[float, float]:
    """Return the greatest magnitude of a revolution's vibration (m/s2), and its angle (degrees)."""
    place = int(np.argmax(np.abs(found.vibration)))
    return float(np.abs(found.vibration[place])), float(found.angle[place])


def orbits(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the orbits: how far out the journals are, and whether they leave the wall."""
    found = orbit(run)
    _, revolution = last_revolution(run)
    sentences = ["Journal centres in their bores to scale, last revolution."]
    for joint in joints_with_clearance(run):
        depth = 1e6 * float(revolution["penetration"].sel(joint=joint).max())
        one = found.sel(joint=joint)
        off = 100.0 * float(one["off_wall_share"])
        leaves = f"is off its wall for {off:.3g} % of the time" if off else "never leaves its wall"
        sinks = f"sinks in by up to {depth:.0f} µm" if depth >= 0.0 else (
            f"comes as near to it as {-depth:.2g} µm"
        )  # fmt: skip
        size = 1e3 * joints_with_clearance(run)[joint]
        sentences.append(
            f"At the {SPOKEN[joint]}, clearance {size:.3g} mm, the journal {leaves} and {sinks}; "
            f"it goes round {float(one['laps']):+.2f} times a revolution, "
            "counter-clockwise positive."
        )
    return " ".join(sentences) + film(run) + caution(run)


def modes(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the contact modes: their shares of the time."""
    shares = mode_shares(contact_modes(run))["share"]
    sentences = []
    words, all_contact = MODES, "following contact throughout, no flight and no impact"
    if case_of(run).lubricant:
        words, all_contact = OILED_MODES, "dry contact throughout"
    for joint in joints_with_clearance(run):
        each = [100.0 * float(shares.sel(joint=joint, mode=mode)) for mode in MODES]
        if each[MODES.index("following")] == 100.0:
            text = all_contact
        else:
            text = ", ".join(f"{word} {x:.3g} %" for word, x in zip(words, each, strict=True))
        sentences.append(f"At the {SPOKEN[joint]}: {text}.")
    return " ".join(["Shares of the settled time.", *sentences]) + film(run) + caution(run)


def struck(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the impacts: how many, the hardest, and what they lost; with oil: dry contacts."""
    found, oil = impacts(run), film(run)
    if not found.sizes["impact"]:
        none = "No impacts: after settling no journal came back from flight."
        return f"{'No dry contact begins after settling.' if oil else none}{oil}{caution(run)}"
    sentences, turns = [], settled_revolutions(run)
    kind, one = ("dry contacts", "fastest") if oil else ("impacts", "hardest")
    for joint in joints_with_clearance(run):
        mine = found.isel(impact=found["joint"].values == joint)
        if not mine.sizes["impact"]:
            sentences.append(f"None at the {SPOKEN[joint]}.")
            continue
        lost = float(mine["lost_energy"].sum())
        hardest = mine.isel(impact=int(np.argmax(mine["approach_speed"].values)))
        sentences.append(
            f"At the {SPOKEN[joint]} {mine.sizes['impact'] / turns:.3g} {kind} a revolution; the "
            f"{one} at {float(hardest['approach_speed']):.3g} m/s and "
            f"{float(hardest['crank_angle']):.0f}°"
            + (f"; together they lost {lost:.3g} J." if lost > 0.0 else ".")
        )
    what = "Dry contacts that begin" if oil else "Contacts after flight"
    return (
        " ".join([f"{what}, over {turns:.3g} rev after settling.", *sentences]) + oil + caution(run)
    )


def waterfall(rows: Sequence[SweptRow], axis: str) -> str:
    """Describe order spectra along an axis: where the rms above `ORDER` is least and greatest."""
    known = [(row.shaking.spectrum.above, row.value) for row in rows if row.shaking]
    least, greatest = min(known), max(known)
    span = (
        f"least, {newtons(least[0])}, at {least[1]}, and greatest, {newtons(greatest[0])}, at "
        f"{greatest[1]}"
    )
    return (
        f"Order spectra of X, {describe_rows(rows, axis)}. The rms of X above order {ORDER} is "
        f"{span if len(known) > 1 else newtons(least[0])}.{left_out(rows)}"
    )


def describe_rows(rows: Sequence[SweptRow], axis: str) -> str:
    """Describe what a row of a map is: a value of the axis, or a job where values repeat."""
    values = [row.value for row in rows]
    if len({*values}) < len(values):
        return f"a row for each job, in the order of {axis}"
    return f"a row for each value of {axis}"


def cycles(rows: Sequence[SweptRow], axis: str) -> str:
    """Describe the vibration over crank angle along an axis: where it is least and greatest."""
    known = [(*loudest(row.cycle), row.value) for row in rows if row.cycle]
    least, greatest = min(known), max(known)
    sensed = any(row.cycle.is_sensed for row in rows if row.cycle)
    kind = "sensor's record" if sensed else "acceleration of the crosshead"
    lowest = f"least, {least[0]:.3g} m/s², at {least[2]}, and " if len(known) > 1 else ""
    text = (
        f"The greatest magnitude of the {kind} in each degree of the last settled revolution, "
        f"{describe_rows(rows, axis)}. Over the revolution it is {lowest}greatest, "
        f"{greatest[0]:.3g} m/s² ({G * greatest[0]:.3g} g), at {greatest[2]}, where it comes at "
        f"{greatest[1]:.0f}°."
    )
    counts = [len(row.cycle.reversals) for row in rows if row.cycle]
    few, most = min(counts), max(counts)
    number = f"{few}" if few == most else f"{few} to {most}"
    return f"{text} The rod load changes its side {number} times a revolution.{left_out(rows)}"


def segment_rows(rows: Sequence[SweptRow], axis: str) -> str:
    """Describe segments along an axis: the greatest, and which is over its limit first."""
    known = [(row.segments, row.value) for row in rows if row.segments]
    found, value = max(known, key=lambda one: np.nanmax(one[0].rms))
    place = int(np.nanargmax(found.rms))
    sentences = [
        f"The rms of the sensor's record in 36 segments of 10°, over that of the same machine "
        f"without clearance, {describe_rows(rows, axis)}. The greatest rms is "
        f"{found.rms[place]:.3g} m/s², {segment_words(place)} at {value}, "
        f"{found.ratio[place]:.3g} times that without clearance. The model has no noise of valves, "
        f"so that a sound machine is quieter than a real one."
    ]
    if not np.isnan(known[0][0].limit).all():
        sentences.append(describe_first_over(known))
    return " ".join(sentences) + left_out(rows)


def describe_first_over(known: Sequence[tuple[Segments, str]]) -> str:
    """Return which segment is over its limit first, in the order of the rows, and how many last."""
    over = [(found, value) for found, value in known if found.over_limit.any()]
    if not over:
        doubtful = sum(int(found.doubtful.any()) for found, _ in known)
        may = f"; within error bars in {plural(doubtful, 'row')}" if doubtful else ""
        return f"No segment is over its limit{may}."
    found, value = over[0]
    place = int(np.nanargmax(np.where(found.over_limit, found.rms / found.limit, np.nan)))
    last, last_value = over[-1]
    return (
        f"The first over its limit of {found.limit[place]:.3g} m/s² is {segment_words(place)} at "
        f"{value}, by {found.rms[place]:.3g} m/s²; over theirs are "
        f"{plural(int(found.over_limit.sum()), 'segment')} there and "
        f"{int(last.over_limit.sum())} at {last_value}."
    )


def segment_words(place: int) -> str:
    """Return a segment's crank angles in words."""
    return f"{10 * place} to {10 * place + 10}°"


def mode_rows(rows: Sequence[SweptRow], axis: str) -> str:
    """Describe the mode map: the share of angles whose most frequent mode is flight."""
    sentences = [f"The most frequent contact mode in each degree, {describe_rows(rows, axis)}."]
    away = row_modes_words(rows)[0]
    for joint, table in rows_modes(rows).items():
        flight = 100.0 * (table == MODES.index("flight")).mean(axis=1)
        if flight.max() == 0.0:
            sentences.append(f"At the {SPOKEN[joint]} it is nowhere {away}.")
        else:
            at = rows[int(np.argmax(flight))].value
            sentences.append(
                f"At the {SPOKEN[joint]} it is {away} over at most {flight.max():.3g} % of the "
                f"revolution, at {at}."
            )
    oil = FILM if any(row.lubricated for row in rows) else ""
    return " ".join(sentences) + oil + left_out(rows)


def left_out(rows: Sequence[SweptRow]) -> str:
    """Describe the rows that could not be drawn, and those of chaotic motion."""
    problems = [row.problem for row in rows if row.problem]
    wild = sum(row.chaotic for row in rows)
    text = f" Not drawn: {plural(len(problems), 'job')} of {len(rows)} "
    text = f"{text}({', '.join(sorted({*problems}))})." if problems else ""
    return text + (f" {plural(wild, 'job')} chaotic: their lines change." if wild else "")


def span(values: np.ndarray, form: str = ".2f") -> str:
    """Return the least and the greatest of some values in words."""
    return f"{values.min():{form}} to {values.max():{form}}"


def loads(run: "xr.Dataset", twin: Twin) -> str:
    """Describe the loads of the last revolution: their greatest tension and compression."""
    sentences = ["Tension is positive."]
    for one, where in ((twin, ", without clearance"), (run, "")):
        if one is not None:
            _, found = read_loads(one)
            each = (f"{name} {span(1e-3 * load)} kN" for name, load in found.items())
            sentences.append(f"Loads of the last revolution{where}: {', '.join(each)}.")
    return " ".join(sentences) + caution(run)


def newtons(force: float) -> str:
    """Return a force (N) in words."""
    if force < MIN_FORCE:
        return "less than 0.1 N"
    return f"{force:.0f} N" if force >= 9.95 else f"{force:.1f} N"


# of a job: functions of its run and its twin; of a study: of its rows and its axis
PLOT_CAPTIONS: dict[str, dict[str, Callable[..., str]]] = {
    "job": {
        "analyst": analyst,
        "loads": loads,
        "signals": signals,
        "cards": cards,
        "spectra": spectra,
        "orbits": orbits,
        "modes": modes,
        "impacts": struck,
    },
    "study": {"cycles": cycles, "segments": segment_rows, "waterfall": waterfall, "map": mode_rows},
}
