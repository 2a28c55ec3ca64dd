"""The table and the figure of a machine that is followed along a key.

The Dataset is that of `follow.followed_dataset` at one job: dims direction, the followed key, whose
coordinate `attrs["over"]` names, and those of the variables.
"""

import itertools
from collections.abc import Mapping

import numpy as np
import xarray as xr

from compressor import analysis, report
from compressor.digits import align_columns
from compressor.report import style

# the second is smaller and lies on the first, so that both are seen where they agree
BY_DIRECTION = {"up": (style.BLUE, 4.0, 2.2), "down": (style.RED, 2.1, 2.4)}
# rows of the panel of periods: 1 to 4 one by one, up to 16 by octaves, and where there is none
PERIODS = {1: 0.0, 2: 1.0, 3: 2.0, 4: 3.0, 8: 4.0, 16: 5.0}
ROWS_OF = {"chaotic": 6.2, "undecided": 7.2}
MILLI = 1e3


def name_motion(one: xr.Dataset) -> str:
    """Return the motion at one value in words: period n, chaotic, undecided, failed or missing."""
    status, regime = str(one["status"].values), str(one["regime"].values)
    if status != "ok":
        return " ".join(filter(None, (status, str(one["reason"].values))))
    return f"period {float(one['period']):g}" if regime == "periodic" else regime


def table(machine: xr.Dataset) -> list[str]:
    """Return lines of a table of neighbouring values with the same motion, by direction.

    And where up and down differ.
    """
    over = machine[machine.attrs["over"]]
    cells = [["direction", title_key(over), "values", "motion", "exponent (1/rev)"]]
    for direction in machine["direction"].values.tolist():
        chain = machine.sel(direction=direction)
        exponents = chain["lyapunov_exponent"].values
        motions = [name_motion(chain.isel({over.name: n})) for n in range(over.size)]
        for motion, group in itertools.groupby(range(over.size), motions.__getitem__):
            at = [*group]
            known = sorted(exponents[at][np.isfinite(exponents[at])])
            ends = dict.fromkeys(f"{over.values[n]:.4g}" for n in (at[0], at[-1]))
            rates = dict.fromkeys(f"{rate:.2f}" for rate in (*known[:1], *known[-1:]))
            row = [direction, " to ".join(ends), str(len(at)), motion, " to ".join(rates)]
            cells.append(row)
    lines = align_columns(cells)
    if "differs" in machine and (marked := machine["differs"].values == 1).any():
        listed = ", ".join(f"{value:.4g}" for value in over.values[marked])
        where = f"{int(marked.sum())} of {over.size} values: {listed}"
        lines.append(f"up and down differ (two motions, or a long transient) at {where}")
    return lines


def title_key(over: xr.DataArray) -> str:
    """Return the name of the followed key with its unit."""
    name, unit = over.attrs["long_name"], over.attrs["units"]
    return f"{name} ({unit})" if unit != "1" else name


def draw_followed(machine: xr.Dataset, title: str = "") -> report.PlotlyFigure:
    """Return one machine over the key: Poincaré points, period, exponent, time without contact."""
    over, known = machine.attrs["over"], machine["section"].notnull()
    known = known.any([dim for dim in known.dims if dim != "joint"])
    joints = [str(joint) for joint in machine["joint"].values[known.values]]
    x, log = report.axis_of(machine, over).places, bool(machine.attrs["log"])
    ratios = [2.2] * len(joints) + [1.2, 1.4] + [0.8] * len(joints)
    drawing, _ = report.make_grid(
        len(ratios), 1, 1.35 * sum(ratios) + 1.2, heights=ratios, share_x="all"
    )
    panels = drawing.panels
    chains = {str(name): machine.sel(direction=name) for name in machine["direction"].values}
    for panel in panels:
        panel.x.type, panel.x.title = "log" if log else None, title_key(machine[over])
    for joint, panel in zip(joints, panels, strict=False):
        points = {name: chain["section"].sel(joint=joint, coordinate="x").transpose(over, ...)
                  for name, chain in chains.items()}  # fmt: skip
        panel.label("y", "e<sub>x</sub> (mm)")
        plot(panel, x, {name: MILLI * one.values for name, one in points.items()}, 0.7)
        panel.title = (
            f"journal's place along the cylinder, {analysis.SPOKEN[joint]}, once a revolution"
        )
        leave_room(panel)
    plot_periods(panels[len(joints)], x, chains)
    plot_exponents(panels[len(joints) + 1], x, chains)
    for joint, panel in zip(joints, panels[len(joints) + 2 :], strict=True):
        shares = {name: 100.0 * chain["contact_loss_fraction"].sel(joint=joint).values
                  for name, chain in chains.items()}  # fmt: skip
        plot(panel, x, shares)
        panel.title = f"time without dry contact, {analysis.SPOKEN[joint]}"
        panel.y.title = "%"
        leave_room(panel)
    low, *_, high = report.midway(np.sort(x), log)
    panels[0].span("x", low, high)
    return drawing.figure(title)


def plot(
    panel: report.Panel, x: np.ndarray, of: dict[str, np.ndarray], times: float = 1.0,
    bars: Mapping[str, np.ndarray] | None = None,
) -> None:  # fmt: skip
    """Draw numbers at each value, (values,) or (values, n), by direction, in marks of its own.

    times: size of the marks.
    """
    for name, numbers in of.items():
        color, size, zorder = BY_DIRECTION[name]
        look = style.mark(color, "circle", times * size, zorder, edge_width=0.0)
        at = np.repeat(x, numbers[0].size)
        panel.plot(at, numbers.ravel(), look, name, (bars or {}).get(name))


def plot_periods(panel: report.Panel, x: np.ndarray, chains: dict[str, xr.Dataset]) -> None:
    """Draw the period at each value; above it where there is none."""
    plot(panel, x, {name: period_rows(chain) for name, chain in chains.items()}, 1.2)
    rows = PERIODS | ROWS_OF
    panel.name_ticks("y", [*map(str, rows)], [*rows.values()])
    panel.span("y", -0.6, max(ROWS_OF.values()) + 0.6)
    panel.title = "period (revolutions)"


def period_rows(chain: xr.Dataset) -> np.ndarray:
    """Return the height of each value's period in the panel; nan where it has no result."""
    words, is_ok = chain["regime"].values, chain["status"].values == "ok"
    period = np.where(words == "periodic", chain["period"].values, 1.0)
    rows = np.where(period <= 4, period - 1.0, np.log2(period) + 1.0)
    for word, row in ROWS_OF.items():
        rows = np.where(words == word, row, rows)
    return np.where(is_ok, rows, np.nan)


def plot_exponents(panel: report.Panel, x: np.ndarray, chains: dict[str, xr.Dataset]) -> None:
    """Draw the largest Lyapunov exponent with its error at each value."""
    bars = {}
    for name, chain in chains.items():
        size = chain["lyapunov_exponent_error"].values
        bars[name] = np.stack([np.where(np.isfinite(size), size, np.nan)] * 2)
    plot(
        panel, x, {name: one["lyapunov_exponent"].values for name, one in chains.items()}, bars=bars
    )
    panel.rule(style.LineStyle(style.BLACK, linewidth=0.8), y=0.0)
    panel.title = "largest Lyapunov exponent, with its 95 % bar; above 0 close motions part"
    panel.y.title = "per revolution"
    leave_room(panel)


def leave_room(panel: report.Panel) -> None:
    """Leave a little room below and above the points."""
    drawn = np.concatenate([trace.y for trace in panel.traces])
    low, high = (np.nanmin(drawn), np.nanmax(drawn)) if np.isfinite(drawn).any() else (0.0, 1.0)
    room = 0.05 * (high - low) or 0.05 * abs(high) or 0.05
    panel.span("y", low - room, high + room)
