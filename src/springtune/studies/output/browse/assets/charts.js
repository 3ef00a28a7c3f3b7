// Charts: figures of Bokeh that are made once and whose data change.

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a6bbe", "#7f7f7f"];
const LIGHTER = ["#4da3e0", "#ff8c42", "#2fc79a", "#e59ac6", "#f0b93a", "#8ccdf5", "#b49be0", "#a8a8a8"]; // on dark ground
const DASHES = ["solid", "6 3", "2 3", "8 3 2 3", "12 4"];
const MARKERS = ["circle", "square", "diamond", "triangle", "inverted_triangle", "hex", "star", "plus"];
const SHAPES = {
  circle: "●", square: "■", diamond: "◆", triangle: "▲", inverted_triangle: "▼", hex: "⬢", star: "★", plus: "+",
};
const BLUES = ["#f7fbff", "#c6dbef", "#6baed6", "#2171b5", "#08306b"];
const CATEGORIES = ["#56b4e9", "#009e73", "#e69f00", "#d55e00", "#cc79a7", "#0072b2", "#8a6bbe", "#7f7f7f"];

const dark = matchMedia("(prefers-color-scheme: dark)");

let libraryReady;
function library() {
  libraryReady ||= Promise.all(["bokeh", "bokeh-api"].map(inflatedText)).then((texts) => {
    for (const text of texts) {
      const script = document.createElement("script");
      script.textContent = text;
      document.head.append(script);
    }
    Bokeh.set_log_level("error");
    return Bokeh;
  });
  return libraryReady;
}

function look(i) {
  const turn = Math.floor(i / COLOURS.length);
  return {
    color: (dark.matches ? LIGHTER : COLOURS)[i % COLOURS.length], dash: DASHES[(i + turn) % DASHES.length],
    marker: MARKERS[(i + 3 * turn) % MARKERS.length],
  };
}

function ink(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// A colour between stops, at a share from 0 to 1.
function between(stops, share) {
  const place = Math.max(0, Math.min(1, share)) * (stops.length - 1), low = Math.min(Math.floor(place), stops.length - 2);
  const [one, other] = [stops[low], stops[low + 1]].map((text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16)));
  return one.map((value, i) => Math.round(value + (place - low) * (other[i] - value)));
}

function css(rgb) {
  return `rgb(${rgb.join(",")})`;
}

function readableOn(rgb) {
  return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2] > 140 ? "#111" : "#fff";
}

// Colours of the finite values of a map, and its key: sizes of errors have the scale of the figures.
function colouring(field, values, key) {
  const scale = unitOf(field)[0], unit = unitOf(field)[1], finite = values.filter(Number.isFinite);
  const low = Math.min(...finite), high = Math.max(...finite);
  const ramp = (stops, from, to, words) => element("p", { class: "scale" }, element("span", { text: from }),
    element("span", { class: "bar", style: `background: linear-gradient(to right, ${stops.join(",")})` }), element("span", { text: to }),
    words ? element("span", { class: "soft", text: words }) : null, key);
  if (isError(field)) {
    const { colours, range } = window.springtune.scale, [least, most] = range.map(Math.log10);
    return {
      of: (value) => between(colours, (Math.log10(100 * Math.abs(value)) - least) / (most - least)),
      key: ramp(colours, `≤ ${number(range[0])} %`, `≥ ${number(range[1])} %`, "size of the error, logarithmic"),
    };
  }
  return {
    of: (value) => between(BLUES, high > low ? (value - low) / (high - low) : 0.3),
    key: finite.length ? ramp(BLUES, `${number(low * scale, 3)} ${unit}`, `${number(high * scale, 3)} ${unit}`) : key,
  };
}

const charts = new Set();

// A figure with its sources; `settings` that Bokeh cannot change later make another one.
class Chart {
  constructor(holder, name, height = 300) {
    this.holder = holder;
    this.name = name;
    this.height = height;
    this.sources = {};
    charts.add(this);
  }

  figure(settings, build) {
    const key = JSON.stringify(settings);
    if (this.key !== key) {
      this.key = key;
      this.made = this.make(settings, build);
    }
    return this.made;
  }

  async make(settings, build) {
    const B = await library();
    if (this.key !== JSON.stringify(settings)) return null; // something else is to be shown by now
    this.ranges = {
      x_range: new B.Range1d({ start: 1, end: 2 }), y_range: new B.Range1d({ start: 1, end: 2 }),
    };
    const fig = B.Plotting.figure({
      height: this.height, sizing_mode: "stretch_width", tools: "pan,box_zoom,wheel_zoom,reset,save",
      toolbar_location: "above", min_border_right: 14, ...this.ranges, ...settings.figure,
    });
    fig.toolbar.logo = null;
    fig.toolbar.autohide = true;
    this.fig = fig;
    this.sources = {};
    build(fig, B);
    this.restyle();
    this.remove();
    this.holder.replaceChildren();
    const view = await B.Plotting.show(fig, this.holder);
    if (this.fig === fig) this.view = view;
    else dispose(view);
    this.name_();
    return fig;
  }

  // Bokeh's plots take the focus, without a name.
  name_() {
    const find = (root) => root.querySelector?.(".bk-events") || [...root.querySelectorAll("*")].map((one) => one.shadowRoot && find(one.shadowRoot)).find(Boolean);
    const layer = this.view && find(this.holder);
    layer?.setAttribute("role", "img");
    layer?.setAttribute("aria-label", `Plot: ${this.spoken || this.name}`);
  }

  remove() {
    if (this.view) dispose(this.view);
    this.view = null;
  }

  source(name, columns) {
    const data = Object.fromEntries(columns.map((column) => [column, []]));
    return (this.sources[name] = new Bokeh.ColumnDataSource({ data }));
  }

  restyle() {
    if (!this.fig) return;
    const [text, soft, line, paper] = ["ink", "soft", "line", "paper"].map(ink);
    const font = "system-ui, sans-serif";
    const fig = this.fig;
    fig.background_fill_color = paper;
    fig.border_fill_color = paper;
    fig.outline_line_color = null;
    for (const side of ["above", "below", "left", "right"])
      for (const axis of fig[side].filter((one) => "axis_label" in one)) {
        Object.assign(axis, {
          axis_label_text_color: text, major_label_text_color: soft, axis_line_color: line,
          major_tick_line_color: line, minor_tick_line_color: null, axis_label_text_font: font,
          major_label_text_font: font, axis_label_text_font_style: "normal", axis_label_text_font_size: "13px",
          major_label_text_font_size: "12px", major_tick_in: 0,
        });
        // Rotated labels are names: all are kept.
        if (axis.major_label_orientation === "horizontal") axis.major_label_policy = new Bokeh.NoOverlap({ min_distance: 4 });
      }
    for (const grid of fig.center.filter((one) => "grid_line_color" in one)) grid.grid_line_color = line;
    this.recolour?.(text, soft);
  }

  axes(x, y, spoken_ = `${y} over ${x}`) {
    this.spoken = spoken_;
    this.name_();
    for (const [side, words] of [["below", x], ["left", y]])
      for (const axis of this.fig[side]) if ("axis_label" in axis) axis.axis_label = words;
  }

  ticks(side, labels) {
    const axis = this.fig[side][0];
    // As many labels as there is room for.
    const step = Math.ceil(labels.length / (side === "below" ? Math.max(4, this.holder.clientWidth / 28) : 40));
    const places = labels.map((_, i) => i).filter((i) => i % step === 0);
    axis.ticker = new Bokeh.FixedTicker({ ticks: places });
    axis.major_label_overrides = new Map(places.map((i) => [i, labels[i]]));
    for (const grid of this.fig.center.filter((one) => one.dimension === (side === "below" ? 0 : 1))) grid.ticker = axis.ticker;
    const crowded = side === "below" && labels.join(" ").length * 7.5 > this.holder.clientWidth - 90;
    axis.major_label_orientation = crowded ? Math.PI / 4 : "horizontal";
  }

  window(x, y) {
    for (const [name, [start, end]] of [["x_range", x], ["y_range", y]]) {
      const range = this.fig[name];
      range.setv({ start, end, reset_start: start, reset_end: end });
    }
  }

  say(words) {
    this.forget();
    this.holder.replaceChildren(element("p", { class: "none", text: words }));
  }

  forget() {
    this.remove();
    this.fig = null;
    this.key = "";
  }
}

// A figure that is not shown any more would go on listening.
function dispose(view) {
  const shown = view.model.document, place = Bokeh.documents.indexOf(shown);
  view.remove();
  if (place >= 0) Bokeh.documents.splice(place, 1);
  shown?.clear();
}

function spread(values, log, margin = 0.06) {
  const good = values.filter((one) => Number.isFinite(one) && (!log || one > 0));
  if (!good.length) return log ? [0.1, 10] : [0, 1];
  let low = Infinity, high = -Infinity;
  for (const one of good) {
    if (one < low) low = one;
    if (one > high) high = one;
  }
  if (log) {
    const factor = Math.max((high / low) ** margin, 1.15);
    return [low / factor, high * factor];
  }
  const room = high > low ? margin * (high - low) : Math.abs(high) * 0.1 || 1;
  return [low - room, high + room];
}

// Lines with markers: series of {name, x, y, hollow, tips}, upright marks of {x, name}.
class Lines extends Chart {
  async show({ series, marks = [], xlabel, ylabel, logx = false, logy = false, categories = null, xticks = null,
    window = {}, zero = false }) {
    const count = series.reduce((sum, one) => sum + one.x.length, 0);
    const settings = {
      figure: { x_axis_type: logx ? "log" : "linear", y_axis_type: logy ? "log" : "linear" },
      categories, equal: Boolean(window.equal), xticks,
    };
    const made = await this.figure(settings, (fig, B) => {
      const zeroLine = new B.Span({ dimension: "width", location: 0, line_width: 1.2, visible: false });
      fig.add_layout(zeroLine);
      this.zero = zeroLine;
      const upright = this.source("marks", ["x", "low", "high", "at", "name", "align"]);
      this.markLines = fig.segment({ field: "x" }, { field: "low" }, { field: "x" }, { field: "high" },
        { source: upright, line_dash: "4 3", line_width: 1.3 });
      const lines = this.source("lines", ["xs", "ys", "color", "dash", "width"]);
      fig.multi_line({ field: "xs" }, { field: "ys" }, {
        source: lines, line_color: { field: "color" }, line_dash: { field: "dash" }, line_width: { field: "width" },
      });
      const points = this.source("points", ["x", "y", "fill", "line", "marker", "size", "name", "tip"]);
      const glyph = fig.scatter({ field: "x" }, { field: "y" }, {
        source: points, marker: { field: "marker" }, size: { field: "size" }, fill_color: { field: "fill" },
        line_color: { field: "line" }, line_width: 1.4,
      });
      this.markWords = fig.text({ field: "x" }, { field: "at" }, { field: "name" }, {
        source: upright, text_font_size: "12px", text_font: "system-ui, sans-serif",
        text_align: { field: "align" }, text_baseline: "bottom",
      });
      fig.add_tools(new B.HoverTool({ renderers: [glyph], tooltips: [["", "@name"], ["", "@tip"]] }));
      this.recolour = (text, soft) => {
        zeroLine.line_color = soft;
        this.markLines.glyph.line_color = soft;
        this.markWords.glyph.text_color = text;
        this.markWords.glyph.background_fill_color = ink("paper");
      };
      if (categories) this.ticks("below", categories);
      if (xticks) {
        fig.below[0].ticker = new B.FixedTicker({ ticks: xticks });
        fig.below[0].major_label_overrides = new Map(xticks.map((one) => [one, number(one)]));
        for (const grid of fig.center.filter((one) => one.dimension === 0)) grid.ticker = fig.below[0].ticker;
      }
    });
    if (!made || this.fig !== made) return; // something else is shown by now
    const usable = (x, y) => Number.isFinite(x) && Number.isFinite(y) && (!logx || x > 0) && (!logy || y > 0);
    const lines = { xs: [], ys: [], color: [], dash: [], width: [] };
    const points = { x: [], y: [], fill: [], line: [], marker: [], size: [], name: [], tip: [] };
    const paper = ink("paper"), small = count > 400;
    const order = series.map((one, i) => [one, i]).sort(([a], [b]) => Boolean(b.faint) - Boolean(a.faint));
    order.forEach(([one, i]) => {
      const style = { ...look(i), ...one.look };
      if (one.faint) style.color = ink("line");
      if (one.line !== false) {
        lines.xs.push(one.x.map((x, j) => (usable(x, one.y[j]) ? x : NaN)));
        lines.ys.push(one.y.map((y, j) => (usable(one.x[j], y) ? y : NaN)));
        lines.color.push(style.color === "ink" ? ink("ink") : style.color);
        lines.dash.push(style.dash);
        lines.width.push(one.width || 1.8);
      }
      if (one.markers === false) return;
      one.x.forEach((x, j) => {
        if (!usable(x, one.y[j])) return;
        points.x.push(x);
        points.y.push(one.y[j]);
        points.fill.push(one.hollow?.[j] ? paper : style.color);
        points.line.push(style.color);
        points.marker.push(style.marker);
        points.size.push(one.chosen === j ? 12 : small ? 3 : one.size || 6);
        points.name.push(one.name);
        points.tip.push(one.tips ? one.tips[j] : `${number(x)}, ${number(one.y[j])}`);
      });
    });
    const range = (values, log, given) => given || spread(values, log);
    const allX = [].concat(...lines.xs, points.x, marks.map((one) => one.x)), allY = [].concat(...lines.ys, points.y);
    let x = categories ? [-0.5, categories.length - 0.5] : range(allX, logx, window.x);
    let y = range(zero ? [...allY, 0] : allY, logy, window.y);
    if (window.equal) [x, y] = this.fitted(x, y);
    const sorted = marks.filter((one) => Number.isFinite(one.x) && (!logx || one.x > 0)).sort((a, b) => a.x - b.x);
    const levels = Math.min(sorted.length, 4);
    const head = (level) => logy ? y[1] / (y[1] / y[0]) ** (0.065 * (level + 1)) : y[1] - (y[1] - y[0]) * 0.075 * (level + 1);
    this.sources.marks.data = {
      x: sorted.map((one) => one.x), low: sorted.map(() => y[0]), high: sorted.map(() => y[1]),
      at: sorted.map((_, i) => head(i % levels)), name: sorted.map((one) => ` ${one.name} `),
      align: sorted.map((one) => ((one.x - x[0]) / (x[1] - x[0]) > 0.6 ? "right" : "left")),
    };
    this.sources.lines.data = lines;
    this.sources.points.data = points;
    this.zero.visible = zero && !logy;
    this.axes(xlabel, ylabel);
    this.window(x, y);
  }

  // Limits that give both axes one scale, in a figure of this size.
  fitted(x, y) {
    const width = Math.max(this.holder.clientWidth - 90, 100), height = this.height - 85;
    const scale = Math.max((x[1] - x[0]) / width, (y[1] - y[0]) / height);
    const middle = (range, length) => {
      const centre = (range[0] + range[1]) / 2;
      return [centre - (scale * length) / 2, centre + (scale * length) / 2];
    };
    return [middle(x, width), middle(y, height)];
  }
}

// Which line is which; drawn apart from the chart, since it wraps and can be read out.
function legend(series, words = [], lit = null, light = null) {
  const list = element("ul", { class: "legend" });
  series.forEach((one, i) => {
    if (!one.name) return;
    const style = { ...look(i), ...one.look };
    const colour = style.color === "ink" ? "currentColor" : style.color;
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", "0 0 30 12");
    svg.setAttribute("aria-hidden", "true");
    const line = document.createElementNS(svg.namespaceURI, "path");
    line.setAttribute("d", "M1 6H29");
    line.setAttribute("stroke", colour);
    line.setAttribute("stroke-width", "2");
    if (style.dash !== "solid") line.setAttribute("stroke-dasharray", style.dash);
    if (one.line !== false) svg.append(line);
    if (one.markers !== false) {
      const mark = document.createElementNS(svg.namespaceURI, "text");
      mark.setAttribute("x", "15");
      mark.setAttribute("y", "10");
      mark.setAttribute("text-anchor", "middle");
      mark.setAttribute("font-size", "11");
      mark.setAttribute("fill", colour);
      mark.textContent = SHAPES[style.marker];
      svg.append(mark);
    }
    const entry = light ? element("button", { type: "button", "aria-pressed": String(lit.has(one.name)), title: "Show this line before the others", onclick: () => light(one.name) }, svg, one.name) : [svg, one.name];
    list.append(element("li", {}, entry));
  });
  for (const word of words) list.append(element("li", { text: word }));
  return list;
}

// Cells over two dimensions, coloured: {column, row, text, colour, missing, tip}.
class Tiles extends Chart {
  async show({ cells, columns, rows, xlabel, ylabel, pick, chosen = null }) {
    this.pick = pick;
    this.height = Math.max(170, Math.min(100 + 30 * rows.length, 640));
    const made = await this.figure({ figure: { height: this.height }, columns, rows, width: this.holder.clientWidth }, (fig, B) => {
      const tiles = this.source("tiles", ["x", "y", "fill", "tip", "what"]);
      const hatched = this.source("hatched", ["x", "y"]);
      const glyph = fig.rect({ field: "x" }, { field: "y" }, 0.97, 0.94, {
        source: tiles, fill_color: { field: "fill" }, line_color: null,
      });
      fig.rect({ field: "x" }, { field: "y" }, 0.97, 0.94, {
        source: hatched, fill_color: null, line_color: null, hatch_pattern: "/", hatch_color: "#8888", hatch_scale: 8,
      });
      const words = this.source("words", ["x", "y", "text", "color"]);
      this.words = fig.text({ field: "x" }, { field: "y" }, { field: "text" }, {
        source: words, text_color: { field: "color" }, text_align: "center",
        text_baseline: "middle", text_font_size: "12px", text_font: "system-ui, sans-serif",
      });
      const frame = this.source("chosen", ["x", "y"]);
      const ring = fig.rect({ field: "x" }, { field: "y" }, 0.97, 0.94, { source: frame, fill_color: null, line_width: 3 });
      fig.add_tools(new B.HoverTool({ renderers: [glyph], tooltips: [["", "@what"], ["", "@tip"]] }), new B.TapTool({ renderers: [glyph] }));
      tiles.selected.change.connect(() => {
        const [place] = tiles.selected.indices;
        if (place === undefined) return;
        tiles.selected.indices = [];
        this.pick?.(this.cells[place]);
      });
      glyph.nonselection_glyph = null;
      glyph.selection_glyph = null;
      for (const grid of fig.center.filter((one) => "grid_line_color" in one)) grid.visible = false;
      this.ticks("below", columns);
      this.ticks("left", rows);
      fig.left[0].major_label_orientation = "horizontal";
      this.recolour = (text) => (ring.glyph.line_color = text);
    });
    if (!made || this.fig !== made) return;
    this.cells = cells;
    const room = (this.holder.clientWidth - 110) / columns.length - 4, most = Math.max(...cells.map((one) => one.text?.length || 0));
    const size = [12, 10].find((one) => most * 0.65 * one <= room), fits = size && rows.length <= 30;
    if (fits) this.words.glyph.text_font_size = `${size}px`;
    this.sources.tiles.data = {
      x: cells.map((one) => one.column), y: cells.map((one) => rows.length - 1 - one.row),
      fill: cells.map((one) => one.colour), tip: cells.map((one) => one.tip),
      what: cells.map((one) => `${rows[one.row]}, ${columns[one.column]}`),
    };
    // Hatching takes long: not where tiles are pixels.
    const gaps = cells.length <= 1500 ? cells.filter((one) => one.missing) : [];
    this.sources.hatched.data = { x: gaps.map((one) => one.column), y: gaps.map((one) => rows.length - 1 - one.row) };
    const said = fits ? cells.filter((one) => one.text) : [];
    this.sources.words.data = {
      x: said.map((one) => one.column), y: said.map((one) => rows.length - 1 - one.row),
      text: said.map((one) => one.text), color: said.map((one) => one.ink || "#111"),
    };
    this.sources.chosen.data = chosen
      ? { x: [chosen.column], y: [rows.length - 1 - chosen.row] } : { x: [], y: [] };
    this.axes(xlabel, ylabel);
    this.window([-0.5, columns.length - 0.5], [-0.5, rows.length - 0.5]);
  }

  ticks(side, labels) {
    super.ticks(side, side === "left" ? labels.slice().reverse() : labels);
  }
}

// Outlines of several rounds, such as that of a hole, as one line with gaps: each round is closed.
function rounds(values, numbers) {
  const found = [];
  let first = 0;
  values.forEach((one, i) => {
    if (!Number.isFinite(one)) return;
    if (i && numbers && numbers[i] !== numbers[i - 1]) {
      found.push(values[first], NaN);
      first = i;
    }
    found.push(one);
  });
  return [...found, values[first]];
}

// What hollow points are: their statuses, where a value stands.
function hollowWords(series) {
  const found = new Set(series.flatMap((one) => one.y.map((y, i) => (one.hollow?.[i] && Number.isFinite(y) ? one.words[i] : ""))));
  found.delete("");
  return found.size ? [`○ hollow: ${[...found].map(spoken).join(", ")}`] : [];
}

dark.addEventListener("change", () => {
  for (const chart of charts) chart.restyle();
  window.springtune?.redraw();
});
