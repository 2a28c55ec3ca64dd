// The page's own script: theme, tables that sort and filter, figures that zoom and tell values.
// Without it, or where a figure's script is missing, the page shows pictures and plain tables.
"use strict";

const root = document.documentElement;
const each = (selector, act, within = document) => within.querySelectorAll(selector).forEach(act);

// ---- light and dark -------------------------------------------------------------------------
const remembered = {
  get: (key) => { try { return localStorage.getItem(key); } catch { return null; } },
  set: (key, value) => { try { localStorage.setItem(key, value); } catch { /* not kept */ } },
};
const prefersDark = matchMedia("(prefers-color-scheme: dark)");
const isDark = () =>
  (root.dataset.theme || (prefersDark.matches ? "dark" : "light")) === "dark";

const nameTheme = (button) => { button.textContent = isDark() ? "light" : "dark"; };

function setTheme(theme) {
  root.dataset.theme = theme;
  remembered.set("compsim-theme", theme);
  each(".theme", nameTheme);
  drawn.forEach((figure) => figure.redraw());
}

// ---- tables ---------------------------------------------------------------------------------
const collator = new Intl.Collator(undefined, { numeric: true });

function value(row, column) {
  const cell = row.cells[column];
  return cell === undefined ? "" : cell.dataset.value ?? cell.textContent.trim();
}

function compare(a, b) {
  const [x, y] = [Number(a), Number(b)];
  const numbers = a !== "" && b !== "" && !Number.isNaN(x) && !Number.isNaN(y);
  if (numbers) return x - y;
  if (a === "" || b === "") return (a === "") - (b === ""); // what has no value comes last
  return collator.compare(a, b);
}

// Blocks of a table, each with other columns: rows that stand at one place belong together.
function sortable(table, rows) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      each("th[aria-sort]", (other) => other.removeAttribute("aria-sort"),
        table.closest(".blocks") ?? table);
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const at = (parts) => value(parts.find((row) => table.contains(row)), column);
      rows.sort((one, other) => {
        const [a, b] = [at(one), at(other)];
        return down && a !== "" && b !== "" ? -compare(a, b) : compare(a, b);
      });
      rows.flat().forEach((row) => row.parentElement.append(row));
    });
  });
}

function filterable(rows, tools) {
  const label = document.createElement("label");
  const field = document.createElement("input");
  const count = document.createElement("output");
  field.type = "search";
  label.append("Show rows with ", field);
  const marked = ([row], mark) => row.classList.contains(mark);
  const marks = ["failed", "chaotic", "missing"].filter((mark) =>
    rows.some((row) => marked(row, mark)));
  const boxes = marks.map((mark) => {
    const box = document.createElement("label");
    const input = document.createElement("input");
    input.type = "checkbox";
    input.value = mark;
    const found = rows.filter((row) => marked(row, mark)).length;
    box.append(input, ` ${mark === "missing" ? "not run" : mark} (${found})`);
    return [box, input];
  });
  const update = () => {
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    const only = boxes.filter(([, input]) => input.checked).map(([, input]) => input.value);
    let shown = 0;
    rows.forEach((row) => {
      const text = row.map((part) => part.textContent).join(" ").toLowerCase();
      const fits = words.every((word) => text.includes(word)) &&
        (!only.length || only.some((mark) => marked(row, mark)));
      row.forEach((part) => { part.hidden = !fits; });
      shown += fits;
    });
    count.textContent = shown === rows.length ? "" : `${shown} of ${rows.length} rows`;
  };
  field.addEventListener("input", update);
  boxes.forEach(([, input]) => input.addEventListener("change", update));
  tools.append(label, ...boxes.map(([box]) => box), count);
}

// The key of a job becomes a button that tells of it.
function openJobs(table) {
  each("tr[data-job] td code", (code) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "job";
    button.title = "where it is in the sweep, how to show it, its last revolution";
    code.replaceWith(button);
    button.append(code);
    button.addEventListener("click", () => showJob(button.closest("tr").dataset.job));
  }, table);
}

function openTable(frame) {
  const tables = [...frame.querySelectorAll("table")];
  const rows = [...tables[0].tBodies[0].rows].map((_, n) =>
    tables.map((table) => table.tBodies[0].rows[n]));
  tables.forEach(openJobs);
  if (rows.length < 2) return;
  tables.forEach((table) => sortable(table, rows));
  if (rows.length < 12) return;
  const tools = document.createElement("div");
  tools.className = "tools";
  frame.before(tools);
  filterable(rows, tools);
}

// ---- figures --------------------------------------------------------------------------------
const LIBRARY = "plotly.min.js";
const scripts = new Map();
const sheets = new Map();
const drawn = [];

function script(source) {
  if (!scripts.has(source)) {
    scripts.set(source, new Promise((good, bad) => {
      const tag = document.createElement("script");
      tag.src = source;
      tag.onload = good;
      tag.onerror = () => bad(new Error(`${source} does not lie beside the page`));
      document.head.append(tag);
    }));
  }
  return scripts.get(source);
}

window.compsimFigure = (name, sheet) => sheets.set(name, sheet);

function numbers(packed) {
  if (Array.isArray(packed)) {
    const [first, step, count] = packed;
    return Float64Array.from({ length: count }, (_, n) => first + step * n);
  }
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

const escaped = (text) =>
  text.replace(/[&<>]/g, (letter) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[letter])
    .replace(/\b([A-Za-zδ])_([A-Za-z0-9]{1,3})\b/g, "$1<sub>$2</sub>");

// Text in lines that some pixels hold; a letter takes half the size of its font, or a little more.
const LETTER = 0.56;
const wrapped = (text, room, size) => {
  const most = Math.max(8, Math.floor(room / (LETTER * size)));
  return text.split(" ").reduce((lines, word) => {
    const last = lines.pop();
    const longer = last ? `${last} ${word}` : word;
    return longer.length > most && last ? [...lines, last, word] : [...lines, longer];
  }, [""]).map(escaped).join("<br>");
};

// the printed figures' colours, made light enough for a dark ground
const ON_DARK = {
  "#000000": "#f2f2f2", "#1f4488": "#86aef5", "#d0583b": "#f08a6f", "#ecb44a": "#f2c46d",
  "#b5b5b5": "#6d737d", "#8c8c8c": "#a0a0a0", "#606060": "#b0b0b0",
};
const tone = (color) => (isDark() && ON_DARK[color]) || color;
const POINT = 4 / 3; // px of a point
const LEVELS = { top: "top", center: "middle", bottom: "bottom", baseline: "bottom" };
const SYMBOLS = { o: "circle", ".": "circle", s: "square", D: "diamond", d: "diamond",
  "^": "triangle-up", v: "triangle-down", x: "x-thin", "+": "cross-thin", "*": "star" };

class Figure {
  constructor(frame) {
    this.frame = frame;
    this.name = frame.id;
    this.off = new Set(); // names of the curves that are switched off
  }

  async start() {
    try {
      // in a single file both are there already
      await Promise.all([window.Plotly ?? script(LIBRARY),
        sheets.has(this.name) || script(`${this.name}.js`)]);
      this.sheet = sheets.get(this.name);
      this.build();
      drawn.push(this);
      await this.redraw();
      this.frame.classList.add("live");
    } catch (problem) {
      this.frame.classList.remove("live");
      this.say(`shown as a picture: ${problem.message}`);
    }
  }

  say(text) {
    const told = document.createElement("p");
    told.className = "told";
    told.textContent = text;
    this.frame.querySelector("figcaption").append(told);
  }

  build() {
    const head = document.createElement("div");
    head.className = "controls";
    const names = new Map(); // of curves, with the first that is called so
    this.sheet.panels.forEach((panel) => panel.traces.forEach((trace) => {
      if (trace.name && trace.kind !== "map" && !names.has(trace.name)) names.set(trace.name, trace);
    }));
    if (names.size > 1) {
      const sorted = [...names].sort(([a], [b]) => collator.compare(a, b));
      sorted.forEach(([name, trace]) => head.append(this.entry(name, trace)));
    }
    const whole = document.createElement("button");
    whole.type = "button";
    whole.textContent = "whole view";
    whole.addEventListener("click", () => this.redraw());
    head.append(whole);
    this.place = document.createElement("div");
    this.place.className = "plot";
    this.place.tabIndex = 0;
    this.place.setAttribute("role", "application");
    this.place.setAttribute("aria-label", `${this.frame.dataset.title}, interactive: ` +
      "plus and minus zoom, left and right arrows move, zero shows all");
    this.place.addEventListener("keydown", (event) => this.key(event));
    this.frame.querySelector("img, figcaption").before(head, this.place);
    new ResizeObserver(() => {
      if (this.place.clientWidth && this.place.clientWidth !== this.width) this.redraw();
    }).observe(this.place);
  }

  entry(name, trace) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "curve";
    button.setAttribute("aria-pressed", "true");
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.dataset.color = trace.color;
    swatch.dataset.kind = trace.dash.length ? "dashed" : trace.hollow ? "ring" : trace.kind;
    button.append(swatch, name);
    button.addEventListener("click", () => {
      const on = this.off.has(name);
      if (on) this.off.delete(name); else this.off.add(name);
      button.setAttribute("aria-pressed", String(on));
      const wanted = this.plotted.map((one) => !this.off.has(one.meta));
      Plotly.restyle(this.place, { visible: wanted });
    });
    return button;
  }

  key(event) {
    const zoom = { "+": 0.7, "=": 0.7, "-": 1 / 0.7 }[event.key];
    const move = { ArrowLeft: -0.15, ArrowRight: 0.15 }[event.key];
    if (event.key === "0") { this.redraw(); return; }
    if (!zoom && !move) return;
    event.preventDefault();
    const change = {};
    Object.entries(this.place.layout).forEach(([key, axis]) => {
      if (!/^xaxis/.test(key) || axis.matches) return;
      const [low, high] = axis.range;
      const [middle, half] = [(low + high) / 2 + (move ?? 0) * (high - low), (high - low) / 2];
      change[`${key}.range`] = [middle - half * (zoom ?? 1), middle + half * (zoom ?? 1)];
    });
    Plotly.relayout(this.place, change);
  }

  // Ticks at whole quarters of a turn suit the whole view; a part of it has its own.
  freeTicks(change) {
    const axes = Object.keys(change).map((key) => /^([xy]axis\d*)\.range/.exec(key)?.[1]);
    const fixed = axes.filter((axis) => axis && this.place.layout[axis].dtick);
    if (!fixed.length) return;
    const links = Object.keys(this.place.layout).filter((key) =>
      /^[xy]axis/.test(key) && this.place.layout[key].dtick);
    Plotly.relayout(this.place, Object.fromEntries(links.flatMap((axis) =>
      [[`${axis}.dtick`, null], [`${axis}.tickmode`, "auto"], [`${axis}.nticks`, 8]])));
  }

  redraw() {
    if (!this.sheet) return Promise.resolve();
    const { data, layout } = this.plotly();
    this.plotted = data;
    this.frame.querySelectorAll(".swatch").forEach((swatch) => {
      swatch.style.setProperty("--curve", tone(swatch.dataset.color));
    });
    const settings = { displaylogo: false, responsive: false, scrollZoom: false,
      displayModeBar: false, doubleClick: "reset" };
    const done = Plotly.react(this.place, data, layout, settings);
    this.place.removeAllListeners?.("plotly_click");
    this.place.removeAllListeners?.("plotly_relayout");
    this.place.on("plotly_relayout", (change) => this.freeTicks(change));
    this.place.on("plotly_click", (event) => {
      const point = event.points.find((one) => one.customdata);
      if (point) showJob([point.customdata].flat()[0]);
    });
    return done;
  }

  // Where each panel lies, in shares of the figure: beside each other, or below where it is narrow.
  places(width) {
    const { panels, heights, widths, aspect } = this.sheet;
    const narrow = width < 190 * widths.length || width < 560;
    const columns = narrow ? Math.max(1, Math.min(widths.length, Math.floor(width / 330))) : 0;
    const rows = narrow ? Math.ceil(panels.length / columns) : 0;
    const most = heights.length === 1 ? 380 : 240 * heights.length;
    const total = narrow ? rows * 260
      : Math.max(130 * heights.length, Math.min(width * aspect, most));
    const share = (sizes, [first, last]) => {
      const sum = (part) => part.reduce((a, b) => a + b, 0);
      return [sum(sizes.slice(0, first)) / sum(sizes), sum(sizes.slice(0, last)) / sum(sizes)];
    };
    // What words at an axis take; those of the first column are given room by all columns.
    const letters = (panel) => Math.max(0, ...(panel.y.words ?? []).map(([, t]) => t.length));
    const room = (panel) => Math.max(62, 24 + LETTER * 12 * letters(panel));
    const first = panels.filter((panel) => panel.column[0] === 0 && !panel.y.bare);
    const lead = narrow ? 0 : Math.min(0.4 * width, Math.max(62, ...first.map(room))) - 62;
    return { total, narrow, boxes: panels.map((panel, n) => {
      const [across, down] = [n % columns, Math.floor(n / columns)];
      const [left, right] = narrow ? [across / columns, (across + 1) / columns]
        : share(widths, panel.column);
      const [top, bottom] = narrow ? [down / rows, (down + 1) / rows] : share(heights, panel.row);
      const scale = panel.traces.some((trace) => trace.kind === "map") ? 62 : 0;
      const bare = panel.y.bare && !narrow;
      const [from, to] = [left, right].map((share) => lead + share * (width - lead));
      const led = !narrow && panel.column[0] === 0;
      const wide = bare ? 24 : led ? 62 : Math.min(0.6 * (to - from), room(panel));
      const given = wide + (led ? lead : 0) - 24;
      const box = { x: [from + wide, to - 14 - scale],
        y: [(1 - bottom) * total + 48, (1 - top) * total - 30] };
      return { x: box.x.map((at) => at / width), y: box.y.map((at) => at / total),
        font: Math.max(8, 12 * Math.min(1, given / Math.max(1, LETTER * 12 * letters(panel)))) };
    }) };
  }

  plotly() {
    const style = getComputedStyle(root);
    const ink = style.getPropertyValue("--ink").trim();
    const faint = style.getPropertyValue("--grid").trim();
    const width = this.width = this.place.clientWidth || 900;
    const { total, boxes, narrow } = this.places(width);
    const { panels } = this.sheet;
    const layout = {
      width, height: total, margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", dragmode: "zoom",
      font: { family: "system-ui, sans-serif", size: 12, color: ink },
      hoverlabel: { bgcolor: style.getPropertyValue("--paper").trim(), font: { color: ink } },
      annotations: [], shapes: [], bargap: 0,
    };
    const data = [];
    // a title that is longer than its axis has smaller letters
    const fitting = (title, [low, high], size) => Math.max(9,
      Math.min(12, (high - low) * size / (LETTER * Math.max(1, title.length))));
    panels.forEach((panel, n) => {
      const [x, y] = [`x${n ? n + 1 : ""}`, `y${n ? n + 1 : ""}`];
      const lowest = narrow || !panels.some((other) => other !== panel &&
        other.row[0] >= panel.row[1] && other.column[0] === panel.column[0] &&
        other.x.link === panel.x.link);
      const axis = (way, domain, anchor, titled) => {
        const scale = panel[way];
        const log = (value) => (scale.log ? Math.log10(value) : value);
        const made = {
          domain, anchor, type: scale.log ? "log" : "linear", range: scale.range.map(log),
          gridcolor: faint, zeroline: false, linecolor: faint, showline: true, ticks: "outside",
          ticklen: 3, tickcolor: faint, exponentformat: "power", automargin: false,
          tickangle: 0, showticklabels: !scale.bare || narrow || way === "x" && titled,
          title: { text: titled ? escaped(scale.title) : "", standoff: 6,
            font: { size: fitting(scale.title, domain, way === "x" ? width : total) } },
        };
        if (way === "x") made.unifiedhovertitle = { text: `%{x:.6~g} ${escaped(scale.unit)}` };
        if (way === "y" && scale.words) made.tickfont = { size: boxes[n].font };
        if (scale.words) {
          made.tickmode = "array";
          made.tickvals = scale.words.map(([at]) => at);
          made.ticktext = scale.words.map(([, text]) => escaped(text));
        } else if (scale.step) {
          const wanted = Math.abs(scale.range[1] - scale.range[0]) / scale.step;
          made.dtick = scale.step * Math.ceil(wanted / (width < 640 ? 5 : 9));
          made.tick0 = 0;
        } else {
          const [low, high] = boxes[n][way];
          made.nticks = Math.max(2, Math.floor((high - low) * (way === "x" ? width / 48 : total / 21)));
        }
        if (scale.link !== n) made.matches = `${way}${scale.link ? scale.link + 1 : ""}`;
        return made;
      };
      layout[`xaxis${n ? n + 1 : ""}`] = axis("x", boxes[n].x, y, lowest || panel.x.title);
      layout[`yaxis${n ? n + 1 : ""}`] = axis("y", boxes[n].y, x, true);
      if (panel.square) layout[`yaxis${n ? n + 1 : ""}`].scaleanchor = x;
      if (panel.title) {
        const room = width * (boxes[n].x[1] - boxes[n].x[0]);
        const size = Math.max(9.2, Math.min(13, 1.75 * room / panel.title.length));
        layout.annotations.push({ text: `<b>${wrapped(panel.title, room + 12, size)}</b>`,
          xref: "paper", yref: "paper", x: boxes[n].x[0], y: boxes[n].y[1], xanchor: "left",
          yanchor: "bottom", yshift: 4, align: "left", showarrow: false, font: { size } });
      }
      panel.traces.forEach((trace) => {
        const made = this.trace(trace, panel, boxes[n]);
        made.xaxis = x;
        made.yaxis = y;
        data.push(made);
      });
      panel.notes.forEach((note) => this.note(note, layout, x, y, panel, boxes[n].x));
    });
    layout.hovermode = this.sheet.unified ? "x unified" : "closest";
    return { data, layout };
  }

  trace(trace, panel, box) {
    const color = Array.isArray(trace.color) ? trace.color : tone(trace.color);
    const [xu, yu] = [escaped(panel.x.unit), escaped(panel.y.unit)];
    const name = escaped(trace.name || panel.title || "");
    const made = { type: "scatter", x: numbers(trace.x), y: numbers(trace.y), name,
      meta: trace.name, visible: !this.off.has(trace.name), opacity: trace.opacity };
    const jobs = trace.jobs && Array.from(numbers(trace.jobs), (n) => this.sheet.jobs[n]);
    if (jobs) made.customdata = jobs;
    const inX = `%{x:.6~g} ${xu}`;
    made.hovertemplate = `%{y:.4~r} ${yu}<extra>${name}</extra>`;
    if (!trace.name && trace.kind !== "map" && trace.kind !== "bars") made.hoverinfo = "skip";
    if (made.hoverinfo) delete made.hovertemplate;
    const error = (way) => (trace.errors && { type: "data", symmetric: false, color,
      array: numbers(trace.errors[1]), arrayminus: numbers(trace.errors[0]), width: 3,
      thickness: 1.2, visible: true, [way]: undefined });
    if (trace.kind === "map") {
      const scale = trace.color;
      const stops = scale.length < 33
        ? scale.flatMap((c, n) => [[n / scale.length, c], [(n + 1) / scale.length, c]])
        : scale.map((c, n) => [n / (scale.length - 1), c]);
      const columns = made.x.length - 1;
      const flat = numbers(trace.z);
      const rows = Array.from({ length: made.y.length - 1 }, (_, n) =>
        flat.slice(n * columns, (n + 1) * columns));
      Object.assign(made, { type: "heatmap", z: rows, colorscale: stops,
        zmin: trace.limits[0], zmax: trace.limits[1], hoverinfo: undefined,
        colorbar: { x: box.x[1], xpad: 6, y: (box.y[0] + box.y[1]) / 2, thickness: 10,
          len: box.y[1] - box.y[0], tickfont: { size: 10 }, outlinewidth: 0,
          title: { text: escaped(trace.scale), side: "right", font: { size: 11 } } } });
      const shown = (v) => String(Number((trace.log ? 10 ** v : v).toPrecision(4)));
      if (trace.log) {
        const [low, high] = trace.limits;
        const ends = high - low < 3 ? [0, Math.log10(3)] : [0];
        const step = Math.ceil((high - low) / 7) || 1;
        let ticks = [];
        for (let ten = Math.floor(low); ten <= high; ten += step) {
          ticks.push(...ends.map((end) => ten + end));
        }
        ticks = ticks.filter((tick) => low <= tick && tick <= high);
        if (ticks.length < 2) ticks = [low, high];
        Object.assign(made.colorbar, { tickmode: "array", tickvals: ticks,
          ticktext: ticks.map(shown) });
      }
      made.text = rows.map((row) => Array.from(row, shown));
      made.hovertemplate = `${inX}, %{y:.4~r} ${yu}<br>%{text}` +
        `<extra>${escaped(trace.scale || panel.title)}</extra>`;
      if (jobs) {
        made.customdata = rows.map((row, n) => jobs.slice(n * columns, (n + 1) * columns));
      }
      if (trace.limits[0] === trace.limits[1]) made.showscale = false;
      return made;
    }
    if (trace.kind === "bars" || trace.kind === "columns") {
      const lying = trace.kind === "bars";
      Object.assign(made, { type: "bar", orientation: lying ? "h" : "v",
        width: trace.width, marker: { color } });
      if (trace.errors) made[lying ? "error_x" : "error_y"] = error();
      made.hovertemplate = lying ? `%{x:.4~r} ${xu}<extra>${name}</extra>` : made.hovertemplate;
      return made;
    }
    if (trace.kind === "band") {
      return Object.assign(made, { fill: "toself", mode: "none", fillcolor: color,
        opacity: Math.min(trace.opacity, 0.5), hoverinfo: "skip", hovertemplate: undefined });
    }
    const dash = trace.dash.length ? trace.dash.map((d) => `${d * 1.4}px`).join(",") : "solid";
    made.mode = trace.kind === "line" ? (trace.marker ? "lines+markers" : "lines") : "markers";
    made.line = { color, width: Math.max(1, trace.width * 1.3), dash };
    const symbol = SYMBOLS[trace.marker] ?? "circle";
    const stroke = trace.marker === "x" || trace.marker === "+" ? 2 : trace.hollow ? 1.2 : 0;
    made.marker = { color, symbol: trace.hollow ? `${symbol}-open` : symbol,
      size: trace.kind === "points" ? Math.max(3, trace.width * 1.4) : 6,
      line: { color, width: stroke } };
    if (trace.errors) made[trace.across ? "error_x" : "error_y"] = error();
    if (!this.sheet.unified) {
      made.hovertemplate = made.hoverinfo ? undefined
        : `${inX}, %{y:.4~r} ${yu}<extra>${name}</extra>`;
    }
    return made;
  }

  note(note, layout, x, y, panel, [left, right]) {
    const color = tone(note.color);
    const log = (value, scale) => (scale.log ? Math.log10(value) : value);
    if (!note.text) {
      const across = note.x === undefined;
      const at = across ? log(note.y, panel.y) : log(note.x, panel.x);
      layout.shapes.push({ type: "line", layer: note.dash.length ? "above" : "below",
        xref: across ? `${x} domain` : x, yref: across ? y : `${y} domain`,
        x0: across ? 0 : at, x1: across ? 1 : at, y0: across ? at : 0, y1: across ? at : 1,
        line: { color, width: 1, dash: note.dash.length ? "dash" : "solid" } });
      return;
    }
    const [inside, size] = [note.inside, 11];
    const [low, high] = panel.x.range.map((end) => log(end, panel.x));
    const share = inside ? note.x : (log(note.x, panel.x) - low) / (high - low);
    const at = this.width * (left + share * (right - left)); // px from the figure's left
    const aside = POINT * note.shift[0];
    const wide = (LETTER * size + 0.5) * note.text.length;
    const over = note.side === "left" ? Math.max(0, at + aside + wide - this.width) : 0;
    // what runs out of the figure moves back as far as that takes, or stands before its place
    const moved = !inside && over > 0 && wide < this.width * (right - left) ? over : 0;
    const before = inside && note.x > 0.5 || (over > moved && at > this.width / 2);
    const room = (before || note.side === "right" ? at - this.width * left : this.width - at) - 6;
    layout.annotations.push({ showarrow: false, align: "left", font: { size, color },
      text: wrapped(note.text, room + moved, size),
      xref: inside ? `${x} domain` : x, yref: inside ? `${y} domain` : y,
      x: inside ? note.x : log(note.x, panel.x), y: inside ? note.y : log(note.y, panel.y),
      xshift: before && note.side === "left" ? -Math.abs(aside) : aside - moved,
      yshift: POINT * note.shift[1],
      xanchor: before ? "right" : note.side, yanchor: LEVELS[note.level] });
  }
}

// ---- jobs behind points ---------------------------------------------------------------------
function showJob(key) {
  const box = document.getElementById("job");
  const rows = [...document.querySelectorAll("tr[data-job]")]
    .filter((one) => one.dataset.job === key);
  const study = told.studies.find((one) => key in one.jobs);
  box.querySelector("h2").textContent = `Job ${key.slice(0, 10)}`;
  const list = box.querySelector("dl");
  list.replaceChildren();
  study?.names.forEach((name, n) => {
    const [term, value] = [document.createElement("dt"), document.createElement("dd")];
    term.textContent = name;
    value.textContent = study.jobs[key][n];
    list.append(term, value);
  });
  const command = box.querySelector("code");
  command.textContent = `compsim show ${key.slice(0, 10)} -r ${told.results}`;
  const link = box.querySelector("a");
  link.hidden = !rows.length;
  link.onclick = (event) => {
    event.preventDefault();
    box.close();
    each("tr.chosen", (other) => other.classList.remove("chosen"));
    rows.forEach((row) => row.classList.add("chosen"));
    rows[0].scrollIntoView({ block: "center" });
  };
  box.querySelector("figure")?.remove();
  box.showModal();
  if (told.series.includes(key)) {
    const frame = document.createElement("figure");
    frame.id = `job-${key}`;
    frame.dataset.title = "last revolution";
    const caption = document.createElement("figcaption");
    caption.textContent = "The last revolution, as it is kept with the job.";
    frame.append(caption);
    list.after(frame);
    new Figure(frame).start();
  }
}

let told = { results: "results", studies: [], series: [] };

// ---- start ----------------------------------------------------------------------------------
const kept = remembered.get("compsim-theme");
if (kept) root.dataset.theme = kept;

document.addEventListener("DOMContentLoaded", () => {
  const facts = document.getElementById("jobs");
  if (facts) told = JSON.parse(facts.textContent);
  each(".theme", (button) => {
    button.hidden = false;
    nameTheme(button);
    button.addEventListener("click", () => setTheme(isDark() ? "light" : "dark"));
  });
  prefersDark.addEventListener("change", () => {
    each(".theme", nameTheme);
    drawn.forEach((figure) => figure.redraw());
  });
  each(".blocks, .scroll:not(.blocks *)", openTable);
  each("dialog button", (button) => button.addEventListener("click", () => {
    if (button.dataset.copy !== undefined) {
      navigator.clipboard?.writeText(button.closest("dialog").querySelector("code").textContent);
    } else {
      button.closest("dialog").close();
    }
  }));
  const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (!entry.isIntersecting) return;
    seen.unobserve(entry.target);
    new Figure(entry.target).start();
  }), { rootMargin: "500px" });
  each("figure[data-title]", (frame) => seen.observe(frame));
});
