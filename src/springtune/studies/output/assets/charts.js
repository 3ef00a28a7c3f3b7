// Charts: figures of Bokeh that are made once and whose data change.

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a6bbe", "#7f7f7f"];
const LIGHTER = ["#4da3e0", "#ff8c42", "#2fc79a", "#e59ac6", "#f0b93a", "#8ccdf5", "#b49be0", "#a8a8a8"]; // on dark ground
const DASHES = ["solid", "6 3", "2 3", "8 3 2 3", "12 4"];
const MARKERS = { circle: "●", square: "■", diamond: "◆", triangle: "▲", inverted_triangle: "▼", hex: "⬢", star: "★", plus: "+" };
const BLUES = ["#f7fbff", "#c6dbef", "#6baed6", "#2171b5", "#08306b"];
const STATUS_COLOURS = {
  solved: "#009e73", beyond_linear: "#f0e442", linear_only: "#56b4e9", not_converged: "#e69f00", unstable: "#cc79a7", failed: "#d55e00",
};
const MISSING = "#8883", FONT = "system-ui, sans-serif";

const dark = matchMedia("(prefers-color-scheme: dark)");
let libraryReady;
function library() {
  libraryReady ||= Promise.all(["bokeh", "bokeh-api"].map((id) => inflated(document.getElementById(id).textContent).text())).then((texts) => {
    for (const text of texts) document.head.append(element("script", { text }));
    Bokeh.set_log_level("error");
    return Bokeh;
  });
  return libraryReady;
}

// Colour, dashes and marker of the line of a number.
function look(i) {
  const turn = Math.floor(i / COLOURS.length), markers = Object.keys(MARKERS);
  return {
    color: (dark.matches ? LIGHTER : COLOURS)[i % COLOURS.length], dash: DASHES[(i + turn) % DASHES.length],
    marker: markers[(i + 3 * turn) % markers.length],
  };
}

function ink(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// A colour [red, green, blue] between stops, at a share from 0 to 1.
function between(stops, share) {
  const place = Math.max(0, Math.min(1, share)) * (stops.length - 1), low = Math.min(Math.floor(place), stops.length - 2);
  const [one, other] = [stops[low], stops[low + 1]].map((text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16)));
  return one.map((value, i) => Math.round(value + (place - low) * (other[i] - value)));
}

function css(rgb) {
  return `rgb(${rgb.join(",")})`;
}

// The key of a scale of colours.
function ramp(stops, from, to, ...words) {
  return element("p", { class: "scale" }, element("span", { text: from }),
    element("span", { class: "bar", style: `background: linear-gradient(to right, ${stops.join(",")})` }), element("span", { text: to }),
    element("span", { class: "soft", text: words.filter(Boolean).join(" · ") }));
}

// A place on the page for one figure; a figure with other settings replaces it.
class Chart {
  constructor(holder) {
    this.holder = holder;
    this.sources = {};
  }

  // Show columns of data by the glyphs that `build` makes of their sources.
  async draw(settings, data, build) {
    const key = JSON.stringify([settings, dark.matches]);
    this.wanted = key;
    const B = await library();
    if (this.wanted !== key) return; // something else is to be shown by now
    if (this.key === key) {
      for (const [name, columns] of Object.entries(data)) this.sources[name].data = columns;
      return;
    }
    this.clear();
    this.key = this.wanted = key;
    this.sources = Object.fromEntries(Object.entries(data).map(([name, columns]) => [name, new B.ColumnDataSource({ data: columns })]));
    const { x, y, height, ...more } = settings;
    this.figure = B.Plotting.figure({
      height, sizing_mode: "stretch_width", tools: "pan,box_zoom,wheel_zoom,reset,save", toolbar_location: "above",
      min_border_right: 14, x_axis_label: x.label, y_axis_label: y.label, x_axis_type: x.type || "linear", y_axis_type: y.type || "linear", ...more,
    });
    this.figure.toolbar.logo = null;
    this.figure.toolbar.autohide = true;
    build(this.figure, B);
    this.style(B, x, y);
    this.holder.style.minHeight = `${height}px`;
    this.view = B.Plotting.show(this.figure, this.holder);
    // Bokeh's plots take the focus, without a name.
    const layer = (await this.view).canvas_view?.events_el;
    layer?.setAttribute("role", "img");
    layer?.setAttribute("aria-label", `Plot: ${y.label} over ${x.label}`);
  }

  style(B, x, y) {
    const [text, soft, line, paper] = ["ink", "soft", "line", "paper"].map(ink), { figure } = this;
    Object.assign(figure, { background_fill_color: paper, border_fill_color: paper, outline_line_color: null });
    for (const [axis, { ticks }] of [[figure.below[0], x], [figure.left[0], y]]) {
      Object.assign(axis, {
        axis_label_text_color: text, axis_label_text_font: FONT, axis_label_text_font_style: "normal", axis_label_text_font_size: "13px",
        major_label_text_color: soft, major_label_text_font: FONT, major_label_text_font_size: "12px", axis_line_color: line,
        major_tick_line_color: line, minor_tick_line_color: null, major_tick_in: 0, major_tick_out: 0, major_label_policy: new B.NoOverlap({ min_distance: 4 }),
      });
      if (!ticks) continue;
      axis.ticker = new B.FixedTicker({ ticks: ticks.map((one) => one[0]) });
      axis.major_label_overrides = new Map(ticks);
      const crowded = axis === figure.below[0] && ticks.map((one) => one[1]).join(" ").length * 7.5 > this.holder.clientWidth - 90;
      if (crowded) axis.major_label_orientation = Math.PI / 4;
    }
    for (const grid of figure.center.filter((one) => "grid_line_color" in one)) {
      grid.grid_line_color = line;
      grid.ticker = figure[grid.dimension ? "left" : "below"][0].ticker;
    }
  }

  // A figure that is not shown any more would go on listening.
  clear() {
    this.view?.then((view) => {
      const shown = view.model.document, place = Bokeh.documents.indexOf(shown);
      view.remove();
      if (place >= 0) Bokeh.documents.splice(place, 1);
      shown?.clear();
    });
    this.view = null;
    this.key = this.wanted = "";
    this.holder.replaceChildren();
  }

  say(words, ...more) {
    this.clear();
    this.holder.style.minHeight = "";
    this.holder.append(element("p", { class: "none", text: words }), ...more);
  }
}

// Columns of rows: {name: [of each row]}.
function columnsOf(rows, names) {
  return Object.fromEntries(names.map((name) => [name, rows.map((one) => one[name])]));
}

function fields(...names) {
  return Object.fromEntries(names.map((name) => [name, { field: name }]));
}

function hover(figure, B, glyph) {
  figure.add_tools(new B.HoverTool({ renderers: [glyph], tooltips: [["", "@name"], ["", "@tip"]] }));
}

// Lines with markers: series of {name, x, y, look, width, tips, hollow}, and upright marks of {x, name}. Axes are {label,
// type, ticks}; `zero` draws the line of zero.
function drawLines(chart, { series, marks = [], x, y, zero = false, equal = false, height = 320 }) {
  const usable = (value, axis) => Number.isFinite(value) && (axis.type !== "log" || value > 0), lines = [], points = [];
  for (const one of series) {
    const there = one.x.map((value, j) => usable(value, x) && usable(one.y[j], y));
    const color = one.look.color === "ink" ? ink("ink") : one.look.color;
    if (one.line !== false) lines.push({ ...one.look, color, width: one.width || 1.8,
      xs: one.x.map((value, j) => (there[j] ? value : NaN)), ys: one.y.map((value, j) => (there[j] ? value : NaN)) });
    if (one.markers !== false) one.x.forEach((value, j) => there[j] && points.push({
      x: value, y: one.y[j], fill: one.hollow?.[j] ? ink("paper") : color, line: color, marker: one.look.marker,
      size: one.chosen === j ? 12 : one.x.length > 60 ? 3 : 6, name: one.name, tip: one.tips[j] }));
  }
  const all = series.flatMap((one) => one.x).filter((value) => usable(value, x)), ys = lines.flatMap((one) => one.ys).filter(Number.isFinite);
  if (zero && y.type !== "log") lines.unshift({ xs: [Math.min(...all), Math.max(...all)], ys: [0, 0], color: ink("soft"), dash: "solid", width: 1 });
  const upright = marks.slice().sort((a, b) => a.x - b.x).map((one, i) => ({ ...one, name: ` ${one.name} `, y: Math.max(...ys), shift: 15 * (i % 4) }));
  return chart.draw({ x, y, height, match_aspect: equal }, {
    lines: columnsOf(lines, ["xs", "ys", "color", "dash", "width"]), points: columnsOf(points, ["x", "y", "fill", "line", "marker", "size", "name", "tip"]),
    marks: columnsOf(upright, ["x", "y", "name", "shift"]),
  }, (figure, B) => {
    const { marks: source } = chart.sources;
    figure.vspan({ field: "x" }, { source, line_color: ink("soft"), line_dash: "4 3", line_width: 1.3 });
    figure.multi_line({ ...fields("xs", "ys"), source: chart.sources.lines, line_color: { field: "color" },
      line_dash: { field: "dash" }, line_width: { field: "width" } });
    hover(figure, B, figure.scatter({ ...fields("x", "y", "marker", "size"), source: chart.sources.points, fill_color: { field: "fill" },
      line_color: { field: "line" }, line_width: 1.4 }));
    figure.text({ ...fields("x", "y"), text: { field: "name" }, y_offset: { field: "shift" }, source, text_font: FONT, text_font_size: "12px",
      text_color: ink("ink"), text_baseline: "top", background_fill_color: ink("paper") });
  });
}

// Which line is which; apart from the chart, since it wraps and can be read out.
function legend(series, words = []) {
  const sign = ({ look: { color, marker }, markers }) => element("span", { "aria-hidden": "true",
    style: `color: ${color === "ink" ? "currentColor" : color}`, text: markers === false ? "― " : `${MARKERS[marker]} ` });
  return element("ul", { class: "legend" }, series.filter((one) => one.name).map((one) => element("li", {}, sign(one), one.name)),
    words.filter(Boolean).map((text) => element("li", { text })));
}

// What hollow points are: their statuses, where a value stands.
function hollowWords(series) {
  const found = new Set(series.flatMap((one) => one.words?.filter((_, i) => one.hollow[i] && Number.isFinite(one.y[i])) || []));
  return found.size ? `○ hollow: ${[...found].map(spoken).join(", ")}` : "";
}

// Cells over two dimensions: {column, row, text, rgb or colour, tip, name}; `pick` gets one that is clicked.
function drawTiles(chart, { cells, columns, rows, x, y, pick = null, chosen = null }) {
  const fits = rows.length <= 30 && Math.max(...cells.map((one) => one.text.length)) * 7.5 <= (chart.holder.clientWidth - 110) / columns.length;
  const placed = cells.map((one) => ({ ...one, x: one.column, y: rows.length - 1 - one.row, text: fits ? one.text : "",
    colour: one.rgb ? css(one.rgb) : one.colour,
    ink: !one.rgb ? "#111" : 0.299 * one.rgb[0] + 0.587 * one.rgb[1] + 0.114 * one.rgb[2] > 140 ? "#111" : "#fff" }));
  const ticks = (labels) => labels.map((text, i) => [i, text]);
  chart.cells = cells;
  chart.pick = pick;
  return chart.draw({
    x: { label: x, ticks: ticks(columns) }, y: { label: y, ticks: ticks(rows.slice().reverse()) },
    height: Math.max(170, Math.min(100 + 30 * rows.length, 640)), x_range: [-0.5, columns.length - 0.5], y_range: [-0.5, rows.length - 0.5] }, {
    tiles: columnsOf(placed, ["x", "y", "colour", "text", "ink", "name", "tip"]),
    chosen: columnsOf(placed.filter((one) => one.row === chosen?.row && one.column === chosen.column), ["x", "y"]),
  }, (figure, B) => {
    const { tiles } = chart.sources, size = { ...fields("x", "y"), width: 0.97, height: 0.94 };
    const glyph = figure.rect({ ...size, source: tiles, fill_color: { field: "colour" }, line_color: null });
    glyph.nonselection_glyph = glyph.selection_glyph = null;
    figure.text({ ...fields("x", "y", "text"), source: tiles, text_color: { field: "ink" }, text_align: "center", text_baseline: "middle",
      text_font: FONT, text_font_size: "12px" });
    figure.rect({ ...size, source: chart.sources.chosen, fill_color: null, line_color: ink("ink"), line_width: 3 });
    hover(figure, B, glyph);
    if (pick) figure.add_tools(new B.TapTool({ renderers: [glyph] }));
    tiles.selected.change.connect(() => {
      const [place] = tiles.selected.indices;
      if (place === undefined) return;
      tiles.selected.indices = [];
      chart.pick(chart.cells[place]);
    });
  });
}
