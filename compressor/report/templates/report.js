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

// Text in lines that some pixels hold; a letter takes half the size of its font, or a little more.
const LETTER = 0.56;
const wrapped = (text, room, size) => {
  const most = Math.max(8, Math.floor(room / (LETTER * size)));
  return text.replaceAll("<br>", " ").split(" ").reduce((lines, word) => {
    const last = lines.pop();
    const longer = last ? `${last} ${word}` : word;
    return longer.length > most && last ? [...lines, last, word] : [...lines, longer];
  }, [""]).join("<br>");
};

// the printed figures' colours of lines, made light enough for a dark ground
const ON_DARK = {
  "#000000": "#f2f2f2", "#1f4488": "#86aef5", "#d0583b": "#f08a6f", "#ecb44a": "#f2c46d",
  "#b5b5b5": "#6d737d", "#8c8c8c": "#a0a0a0", "#606060": "#b0b0b0", "#303030": "#d0d0d0",
};
const tone = (color) => (isDark() && ON_DARK[color]) || color;
const looksOf = (trace) => trace.fill || trace.type === "bar" ? "band"
  : !/lines/.test(trace.mode) ? (/open/.test(trace.marker.symbol) ? "ring" : "points")
    : trace.line.dash === "solid" ? "line" : "dashed";

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
      const told = document.createElement("p");
      told.className = "told";
      told.textContent = `shown as a picture: ${problem.message}`;
      this.frame.querySelector("figcaption").append(told);
    }
  }

  build() {
    const head = document.createElement("div");
    head.className = "controls";
    const listed = this.sheet.data.filter((trace) => trace.showlegend && trace.type !== "heatmap");
    listed.sort((a, b) => a.legendrank - b.legendrank);
    if (listed.length > 1 || listed.some((one) => looksOf(one) !== "line")) head.append(...listed.map((trace) => this.entry(trace)));
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

  entry(trace) {
    const { name } = trace;
    const button = document.createElement("button");
    button.type = "button";
    button.className = "curve";
    button.setAttribute("aria-pressed", "true");
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.dataset.kind = looksOf(trace);
    swatch.dataset.color = trace.fillcolor ??
      (/lines/.test(trace.mode) ? trace.line : trace.marker).color;
    button.append(swatch, name);
    button.addEventListener("click", () => {
      const on = this.off.has(name);
      if (on) this.off.delete(name); else this.off.add(name);
      button.setAttribute("aria-pressed", String(on));
      Plotly.restyle(this.place, { visible: this.sheet.data.map((one) => !this.off.has(one.name)) });
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
    const { layout } = this.place;
    const axes = Object.keys(change).map((key) => /^([xy]axis\d*)\.range/.exec(key)?.[1]);
    if (!axes.some((axis) => axis && layout[axis].dtick)) return;
    const fixed = Object.keys(layout).filter((key) => /^[xy]axis/.test(key) && layout[key].dtick);
    Plotly.relayout(this.place, Object.fromEntries(fixed.flatMap((axis) =>
      [[`${axis}.dtick`, null], [`${axis}.tickmode`, "auto"], [`${axis}.nticks`, 8]])));
  }

  redraw() {
    if (!this.sheet) return Promise.resolve();
    this.frame.querySelectorAll(".swatch").forEach((swatch) => {
      const { color, kind } = swatch.dataset;
      swatch.style.setProperty("--curve", kind === "band" ? color : tone(color));
    });
    const { data, layout } = this.fitted();
    const done = Plotly.react(this.place, data, layout, { displayModeBar: false, doubleClick: "reset" });
    ["plotly_click", "plotly_relayout"].forEach((kind) => this.place.removeAllListeners?.(kind));
    this.place.on("plotly_relayout", (change) => this.freeTicks(change));
    this.place.on("plotly_click", (event) => {
      const point = event.points.find((one) => one.customdata);
      if (point) showJob([point.customdata].flat()[0]);
    });
    return done;
  }

  // Each panel with its axes, and where it lies in shares of the figure: beside each other, or
  // below where it is narrow.
  places(data, layout, width) {
    const { rows, columns, places, units } = layout.meta;
    const narrow = width < 190 * columns.length || width < 560;
    const across = narrow ? Math.max(1, Math.min(columns.length, Math.floor(width / 330))) : 0;
    const down = narrow ? Math.ceil(places.length / across) : 0;
    const most = rows.length === 1 ? 380 : 240 * rows.length;
    const total = narrow ? down * 260
      : Math.max(130 * rows.length, Math.min(width * layout.height / layout.width, most));
    const sum = (part) => part.reduce((a, b) => a + b, 0);
    const share = (sizes, ends) => ends.map((end) => sum(sizes.slice(0, end)) / sum(sizes));
    const panels = places.map(([top, bottom, left, right], n) => {
      const [x, y] = ["x", "y"].map((way) => `${way}${n ? n + 1 : ""}`);
      const axes = { x: layout[x.replace("x", "xaxis")], y: layout[y.replace("y", "yaxis")] };
      const letters = Math.max(0, ...(axes.y.ticktext ?? []).map((text) => text.length));
      const at = [n % across, Math.floor(n / across)];
      return { x, axes, letters, isFirst: left === 0 && !narrow, unit: units[n],
        isBare: axes.y.showticklabels === false && !narrow,
        room: Math.max(62, 24 + LETTER * 12 * letters), // that words at an axis take
        scales: data.filter((trace) => trace.xaxis === x && trace.colorbar && trace.showscale),
        column: narrow ? [at[0] / across, (at[0] + 1) / across] : share(columns, [left, right]),
        row: narrow ? [at[1] / down, (at[1] + 1) / down] : share(rows, [top, bottom]) };
    });
    // what the words of the first column take is given by all columns
    const first = panels.filter((panel) => panel.isFirst && !panel.isBare);
    const lead = Math.min(0.4 * width, Math.max(62, ...first.map((panel) => panel.room))) - 62;
    panels.forEach((panel) => {
      const [from, to] = panel.column.map((end) => lead + end * (width - lead));
      const wide = panel.isBare ? 24 : panel.isFirst ? 62 : Math.min(0.6 * (to - from), panel.room);
      const given = wide + (panel.isFirst ? lead : 0) - 24;
      panel.font = Math.max(8, 12 * Math.min(1, given / Math.max(1, LETTER * 12 * panel.letters)));
      panel.axes.x.domain = [from + wide, to - 14 - 62 * Math.min(1, panel.scales.length)]
        .map((at) => at / width);
      const [top, bottom] = panel.row;
      panel.axes.y.domain = [(1 - bottom) * total + 48, (1 - top) * total - 30]
        .map((at) => at / total);
    });
    return { panels, total, narrow };
  }

  // The figure in the width and colours of the page.
  fitted() {
    const isArea = /^(\d+|fillcolor|bgcolor|bdata)$/; // of maps and areas, in their own colours
    const { data, layout } = JSON.parse(JSON.stringify(this.sheet), (key, value) =>
      (typeof value === "string" && !isArea.test(key) ? tone(value) : value));
    const style = getComputedStyle(root);
    const [ink, faint, paper] = ["--ink", "--grid", "--paper"].map((name) =>
      style.getPropertyValue(name).trim());
    const width = this.width = this.place.clientWidth || 900;
    const { panels, total, narrow } = this.places(data, layout, width);
    const axis = { gridcolor: faint, zeroline: false, linecolor: faint, showline: true,
      ticks: "outside", ticklen: 3, tickcolor: faint, exponentformat: "power", tickangle: 0,
      automargin: false, title: { standoff: 6 } };
    data.forEach((trace) => {
      trace.visible = !this.off.has(trace.name);
      if (trace.fill && isDark()) trace.opacity = 0.35 * (trace.opacity ?? 1);
    });
    panels.forEach((panel) => {
      const { x, y } = panel.axes;
      Object.entries(panel.axes).forEach(([way, axis]) => {
        const room = (axis.domain[1] - axis.domain[0]) * (way === "x" ? width : total);
        const title = axis.title?.text ?? "";
        // a title that is longer than its axis has smaller letters
        const size = Math.max(9, Math.min(12, room / (LETTER * Math.max(1, title.length))));
        axis.title = { text: title, font: { size } };
        if (narrow) delete axis.showticklabels;
        if (axis.dtick) {
          const wanted = (axis.range[1] - axis.range[0]) / axis.dtick;
          axis.dtick *= Math.ceil(wanted / (width < 640 ? 5 : 9));
          axis.tick0 = 0;
        } else axis.nticks = Math.max(2, Math.floor(room / (way === "x" ? 48 : 21)));
      });
      x.unifiedhovertitle = { text: `%{x:.6~g} ${panel.unit}` };
      if (y.ticktext) y.tickfont = { size: panel.font };
      panel.scales.forEach((map) => Object.assign(map.colorbar, { x: x.domain[1], xpad: 6,
        y: (y.domain[0] + y.domain[1]) / 2, len: y.domain[1] - y.domain[0], thickness: 10,
        outlinewidth: 0, tickfont: { size: 10 } }));
      (layout.annotations ?? []).filter((note) => note.xref.split(" ")[0] === panel.x)
        .forEach((note) => this.fit(note, x, width));
    });
    return { data, layout: { ...layout, width, height: total, title: undefined,
      margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, dragmode: "zoom", bargap: 0,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 12, color: ink },
      hoverlabel: { bgcolor: paper, font: { color: ink } },
      template: { layout: { xaxis: axis, yaxis: axis } } } };
  }

  // Break a note into lines of the room it has. One that runs out of the figure moves back as far
  // as that takes, or stands before its place.
  fit(note, axis, width) {
    if (note.showarrow) return;
    const [left, right] = axis.domain;
    if (note.name === "title") {
      const room = width * (right - left);
      note.font.size = Math.max(9.2, Math.min(13, 1.75 * room / note.text.length));
      note.text = `<b>${wrapped(note.text, room + 12, note.font.size)}</b>`;
      return;
    }
    const [inside, size] = [/domain/.test(note.xref), 11];
    const [low, high] = axis.range;
    const share = inside ? note.x : (note.x - low) / (high - low);
    const at = width * (left + share * (right - left)); // px from the figure's left
    const wide = (LETTER * size + 0.5) * note.text.length;
    const over = note.xanchor === "left" ? Math.max(0, at + note.xshift + wide - width) : 0;
    const moved = !inside && over > 0 && wide < width * (right - left) ? over : 0;
    const before = inside && note.x > 0.5 || (over > moved && at > width / 2);
    const room = (before || note.xanchor === "right" ? at - width * left : width - at) - 6;
    note.font.size = size;
    note.text = wrapped(note.text, room + moved, size);
    note.xshift = before && note.xanchor === "left" ? -Math.abs(note.xshift) : note.xshift - moved;
    if (before) note.xanchor = "right";
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
