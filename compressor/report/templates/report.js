// The page's own script: tables that sort, figures that zoom and tell values.
// Without it, or where a figure's script is missing, the page shows pictures and plain tables.
"use strict";

const root = document.documentElement;
const each = (selector, act, within = document) => within.querySelectorAll(selector).forEach(act);

const dark = matchMedia("(prefers-color-scheme: dark)");

// ---- tables ---------------------------------------------------------------------------------
const collator = new Intl.Collator(undefined, { numeric: true });

function value(row, column) {
  const cell = row.cells[column];
  return cell?.dataset.value ?? cell?.textContent.trim() ?? "";
}

function compare(a, b) {
  const [x, y] = [Number(a), Number(b)];
  const numbers = a !== "" && b !== "" && !Number.isNaN(x) && !Number.isNaN(y);
  if (numbers) return x - y;
  if (a === "" || b === "") return (a === "") - (b === ""); // what has no value comes last
  return collator.compare(a, b);
}

function sortable(table) {
  const rows = [...table.tBodies[0].rows];
  if (rows.length < 2) return;
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      each("th[aria-sort]", (other) => other.removeAttribute("aria-sort"), table);
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      rows.sort((one, other) => {
        const [a, b] = [value(one, column), value(other, column)];
        return down && a !== "" && b !== "" ? -compare(a, b) : compare(a, b);
      });
      table.tBodies[0].append(...rows);
    });
  });
}

// The key of a job becomes a button that tells of it.
function openJob(code) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "job";
  button.title = "where it is in the sweep, how to show it, its last revolution";
  code.replaceWith(button);
  button.append(code);
  button.addEventListener("click", () => showJob(button.closest("tr").dataset.job));
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
const tone = (color) => (dark.matches && ON_DARK[color]) || color;
const SCALE = 74; // px that a scale of colours takes
const TOOLBAR = 90; // px in the upper right corner of a figure

class Figure {
  constructor(frame) {
    this.frame = frame;
    this.name = frame.id;
  }

  async start() {
    try {
      // in a single file both are there already
      await Promise.all([window.Plotly ?? script(LIBRARY),
        sheets.has(this.name) || script(`${this.name}.js`)]);
      this.sheet = sheets.get(this.name);
      this.place = document.createElement("div");
      this.place.className = "plot";
      this.frame.querySelector("img, figcaption").before(this.place);
      new ResizeObserver(() => {
        if (this.place.clientWidth && this.place.clientWidth !== this.width) this.redraw();
      }).observe(this.place);
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

  redraw() {
    if (!this.sheet) return Promise.resolve();
    const { data, layout } = this.fitted();
    const done = Plotly.react(this.place, data, layout, { displaylogo: false,
      doubleClick: "reset", modeBarButtons: [["zoom2d", "pan2d", "resetScale2d"]] });
    ["plotly_click", "plotly_relayout"].forEach((kind) => this.place.removeAllListeners?.(kind));
    this.place.on("plotly_relayout", (change) => this.freeTicks(change));
    this.place.on("plotly_click", (event) => {
      const point = event.points.find((one) => one.customdata);
      if (point) showJob([point.customdata].flat()[0]);
    });
    return done;
  }

  // Ticks at whole quarters of a turn suit the whole view; a part of it has its own.
  freeTicks(change) {
    const fixed = Object.entries(this.place.layout)
      .filter(([key, axis]) => /^[xy]axis/.test(key) && axis.dtick);
    if (!fixed.some(([key]) => `${key}.range[0]` in change)) return;
    Plotly.relayout(this.place, Object.fromEntries(fixed.flatMap(([key]) =>
      [[`${key}.dtick`, null], [`${key}.tickmode`, "auto"]])));
  }

  // The figure in the width and colours of the page; where that is narrow, its panels lie below
  // each other.
  fitted() {
    const isArea = /^(\d+|bdata)$/; // of maps, in their own colours
    const { data, layout } = JSON.parse(JSON.stringify(this.sheet), (key, value) =>
      (typeof value === "string" && !isArea.test(key) ? tone(value) : value));
    const style = getComputedStyle(root);
    const [ink, faint, paper] = ["--ink", "--grid", "--paper"].map((name) =>
      style.getPropertyValue(name).trim());
    const width = this.width = this.place.clientWidth || 900;
    const panels = Object.keys(layout).filter((key) => key.startsWith("xaxis")).map((key) =>
      ({ name: `x${key.slice(5)}`, x: layout[key], y: layout[key.replace("x", "y")] }));
    panels.sort((a, b) => b.y.domain[0] - a.y.domain[0] || a.x.domain[0] - b.x.domain[0]);
    const columns = new Set(panels.map(({ x }) => x.domain[0])).size;
    const isNarrow = width < Math.max(560, 190 * columns);
    const { margin } = layout;
    panels.forEach(({ x, y }) => {
      const long = Math.max(1, ...(y.ticktext ?? []).map((text) => text.length));
      const size = Math.max(8, Math.min(12, 0.4 * width / (LETTER * long)));
      y.tickfont = { size };
      const words = LETTER * size * long + (y.title?.text ? 30 : 12);
      if (isNarrow || !x.domain[0]) margin.l = Math.max(margin.l, words);
    });
    const across = width - margin.l - margin.r;
    if (isNarrow) {
      const total = panels.length * 250 - 70;
      layout.height = total + margin.t + margin.b;
      panels.forEach(({ name, x, y }, n) => {
        const scale = data.find((one) => one.xaxis === name && one.colorbar && one.showscale);
        x.domain = [0, scale ? 1 - SCALE / across : 1];
        y.domain = [total - 250 * n - 180, total - 250 * n].map((at) => Math.max(0, at / total));
        [x, y].forEach((axis) => delete axis.showticklabels);
        if (scale) Object.assign(scale.colorbar,
          { x: x.domain[1], y: (y.domain[0] + y.domain[1]) / 2, len: y.domain[1] - y.domain[0] });
      });
    }
    const listed = data.filter((trace) => trace.showlegend);
    const showlegend = listed.length > 1 || listed.some((one) => !/lines/.test(one.mode));
    const letters = listed.reduce((sum, one) => sum + 7 * one.name.length + 56, 0);
    // a legend that would reach the toolbar in the corner stands below it
    const bar = showlegend && margin.l + 1.1 * letters > width - TOOLBAR ? 24 : 0;
    const legend = showlegend ? bar + 6 + 23 * Math.ceil(1.1 * letters / width) : 0;
    layout.height += legend;
    layout.margin = { ...margin, t: margin.t + legend };
    const axis = { gridcolor: faint, zeroline: false, linecolor: faint, showline: true,
      ticks: "outside", ticklen: 3, tickcolor: faint, exponentformat: "power", tickangle: 0 };
    panels.forEach(({ name, x, y }) => {
      const room = across * (x.domain[1] - x.domain[0]);
      y.automargin = "left";
      [[x, room], [y, 250]].forEach(([one, most]) => {
        const text = one.title?.text ?? "";
        // a title that is longer than its axis has smaller letters
        const size = Math.max(9, Math.min(12, most / (LETTER * Math.max(1, text.length))));
        one.title = text ? { text, font: { size }, standoff: 6 } : undefined; // "" takes room, too
      });
      if (x.dtick) {
        x.dtick *= Math.ceil(40 * (x.range[1] - x.range[0]) / x.dtick / room);
        x.tick0 = 0;
      }
      const titles = (layout.annotations ?? [])
        .filter((note) => note.name === "title" && note.xref.split(" ")[0] === name);
      titles.forEach((note) => {
        note.font.size = Math.max(9.2, Math.min(13, 1.75 * room / note.text.length));
        note.text = `<b>${wrapped(note.text, room + 12, note.font.size)}</b>`;
      });
    });
    return { data, layout: { ...layout, width, title: undefined, showlegend, dragmode: "zoom",
      legend: { orientation: "h", yref: "container", y: 1 - bar / layout.height,
        yanchor: "top", x: 0 },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 12, color: ink },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: faint, activecolor: ink },
      hoverlabel: { bgcolor: paper, font: { color: ink }, namelength: -1 },
      template: { layout: { xaxis: axis, yaxis: axis } } } };
  }
}

// ---- jobs behind points ---------------------------------------------------------------------
// The dialog about a job: its row in a table up to how it ended, and its last revolution.
function showJob(key) {
  const box = document.getElementById("job");
  box.querySelector("h2").textContent = `Job ${key.slice(0, 10)}`;
  const row = document.querySelector(`tr[data-job="${key}"]`);
  const list = box.querySelector("dl");
  list.replaceChildren();
  if (row) {
    const heads = [...row.closest("table").tHead.rows[0].cells].map((head) => head.textContent);
    heads.slice(0, heads.indexOf("status") + 1).forEach((name, n) => {
      const [term, value] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = name;
      value.textContent = row.cells[n].textContent;
      list.append(term, value);
    });
    row.id = `row-${key}`;
  }
  const command = box.querySelector("code");
  command.textContent = `compsim show ${key.slice(0, 10)} -r ${box.dataset.results}`;
  const link = box.querySelector("a");
  link.hidden = !row;
  link.href = `#row-${key}`;
  link.onclick = () => box.close();
  box.querySelector("figure")?.remove();
  box.showModal();
  if (box.dataset.series.split(" ").includes(key)) {
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

// ---- start ----------------------------------------------------------------------------------
document.addEventListener("DOMContentLoaded", () => {
  dark.addEventListener("change", () => drawn.forEach((figure) => figure.redraw()));
  each("tr[data-job] td code", openJob);
  each("table", sortable);
  const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (!entry.isIntersecting) return;
    seen.unobserve(entry.target);
    new Figure(entry.target).start();
  }), { rootMargin: "500px" });
  each("figure[data-title]", (frame) => seen.observe(frame));
});
