// A view of any group: one of its variables over its dimensions, as lines, as a map and as numbers.

const CROWD = 16, MOST_LINES = 120, MOST_ROWS = 300, MOST_COLUMNS = 60;

class Explorer {
  constructor(page, group, view) {
    Object.assign(this, { page, group, view });
    this.title = view.title;
    this.chosen = {};
    this.lit = new Set();
  }

  async build(holder) {
    await this.group.load();
    const fields = this.group.fields;
    this.plots = this.view.plots.filter((plot) => this.possible(plot));
    this.over = element("div", { class: "row" });
    this.picture = element("div", { class: "chart" });
    this.under = element("div");
    this.numbers = element("div");
    const single = Object.values(fields).filter((field) => !field.dims.length && !/^topology/.test(field.long_name) && field.valueAt(0) !== "");
    const left = this.group.left_out;
    holder.append(element("h2", { text: this.view.title }), this.view.note ? element("p", { text: this.view.note }) : "",
      left.length ? element("p", { class: "none", text: `Too large for this page, and in dataset.nc only: ${left.join(", ")}.` }) : "",
      this.network(), this.over, element("section", { class: "panel wide-panel" }, this.picture, this.under), this.numbers,
      single.length ? element("section", { class: "panel" }, element("h3", { text: "Single numbers" }), this.singles(single)) : "",
      element("section", { class: "panel" }, element("h3", { text: "What the group holds" }), this.inventory()));
    this.lines = new Lines(this.picture, `${this.group.path} lines`, 400);
    this.tiles = new Tiles(this.picture, `${this.group.path} map`);
    this.page.charts[`${this.group.path}`] = this.lines;
    this.page.charts[`${this.group.path} map`] = this.tiles;
    const own = Object.values(fields).filter((field) => field.dims.length);
    if (!own.length) return;
    if (this.plots.length) this.take(Math.max(0, this.plots.findIndex((plot) => this.varies(plot))));
    else {
      const full = own.filter((field) => !field.isText && !field.flags && !this.bare(field));
      this.free((full.find((field) => /error/.test(field.name)) || full[0] || own[0]).name);
    }
  }

  possible(plot) {
    const { fields, dims } = this.group;
    const known = (name) => !name || name in fields || name in dims;
    return plot.value in fields && known(plot.x) && (!plot.by || plot.by in dims) && !this.bare(fields[plot.value])
      && !(plot.x in fields && this.bare(fields[plot.x]));
  }

  // Whether points of a plot stand over more than one place.
  varies(plot) {
    const field = this.group.fields[plot.x];
    if (!field) return true;
    const values = Array.from(field.unpacked()).filter(Number.isFinite);
    return values.some((one) => Math.abs(one - values[0]) > 1e-4 * Math.abs(one));
  }

  // Networks that no cell of the table has, such as those of shapes.
  network() {
    if (this.group.path === "/fields" || !Shape.NEEDED.every((name) => name in this.group.fields)) return "";
    const [over, chart, under] = ["row", "chart", ""].map((name) => element("div", { class: name })), choices = element("div", { class: "row" });
    const shape = new Shape(over, chart, under, this.page, this.group), { dims, fields } = this.group, places = {};
    const free = fields.displacement_x.dims.slice(0, -1), values = fields.displacement_x;
    for (const name of free) places[name] = 0;
    const there = (name, i) => Number.isFinite(values.of({ ...places, [name]: i }));
    const draw = () => {
      free.forEach((name, i) => {
        if (i && !there(name, places[name])) places[name] = Math.max(0, Array.from({ length: dims[name].size }, (_, j) => j).find((j) => there(name, j)) ?? 0);
      });
      choices.replaceChildren(...free.map((name, i) => choice(spoken(name),
        Array.from({ length: dims[name].size }, (_, j) => [j, labelWithUnit(dims[name], j)]).filter(([j]) => !i || there(name, j)), places[name],
        (value) => { places[name] = Number(value); this.moved = draw(); }, { "data-dim": name })));
      const why = shape.fill(places);
      return why ? shape.say({ words: why }) : shape.controls() || shape.draw(true);
    };
    this.page.charts[`${this.group.path} network`] = shape.chart;
    this.moved = draw();
    return element("section", { class: "panel", id: "panel-network" }, element("h3", { text: "The network over its reference" }), choices, over, chart, under);
  }

  bare(field) {
    const values = field.unpacked();
    return field.isText ? values.every((one) => one < 0) : field.type === "float" && values.every((one) => Number.isNaN(one));
  }

  take(number_) {
    const plot = this.plots[number_];
    this.plot = { ...plot, number: number_ };
    const field = this.group.fields[plot.value];
    this.chosen = this.fullest(field, this.group.fields[plot.x]);
    for (const [name, label] of Object.entries(plot.selection || {})) {
      const place = name in this.group.dims ? this.group.place(name, label) : -1;
      if (place >= 0) this.chosen[name] = place;
    }
    this.render();
  }

  // A variable without a declared plot: its last dimension along x, the longest other as lines.
  free(name) {
    const field = this.group.fields[name];
    const dims = field.dims.filter((one) => this.group.dims[one].size > 1);
    const numbers = dims.filter((one) => typeof this.group.label(one, 0) === "number");
    const x = numbers.at(-1) || dims.at(-1) || field.dims.at(-1);
    const others = dims.filter((one) => one !== x).sort((a, b) => this.group.dims[a].size - this.group.dims[b].size);
    const by = others.filter((one) => this.group.dims[one].size <= MOST_LINES).pop() || others[0] || "";
    this.plot = { title: "", value: name, x, by, shows: "lines", along: "", log: "", beside: [], number: -1 };
    this.chosen = this.fullest(field);
    this.render();
  }

  // Places of the first value that is there, and has a number to stand over, so that a view does not begin empty.
  fullest(field, over = null) {
    const values = field.unpacked();
    const places = (flat) => Object.fromEntries(field.dims.map((name) => [name, Math.floor(flat / field.strides[name]) % this.group.dims[name].size]));
    let flat = 0;
    if (over && field.type === "float" && over.dims.every((name) => field.dims.includes(name)))
      for (let i = 0; i < field.size; i++)
        if (!Number.isNaN(field.valueAt(i)) && Number.isFinite(over.of(places(i)))) return places(i);
    if (field.place) flat = Math.max(0, field.place.findIndex((one) => one >= 0)) * field.points;
    else flat = Math.max(0, values.findIndex((one) => field.isText ? one >= 0 : field.type === "float" ? !Number.isNaN(one) : one !== 0));
    return places(flat);
  }

  dimsOf(plot) {
    const { fields, dims } = this.group, found = new Set(fields[plot.value].dims);
    if (plot.x in fields) for (const name of fields[plot.x].dims) found.add(name);
    for (const [x, y] of plot.beside || []) for (const one of [x, y]) for (const name of fields[one]?.dims.slice(0, -1) || []) found.add(name);
    return Object.keys(dims).filter((name) => found.has(name));
  }

  along(plot) {
    if (plot.x in this.group.dims) return plot.x;
    const own = this.group.fields[plot.value].dims;
    return own.includes(plot.along) ? plot.along : own.at(-1);
  }

  render() {
    const { fields, dims } = this.group, plot = this.plot, field = fields[plot.value];
    const along = this.along(plot);
    const again = (change) => (value) => {
      change(value);
      this.render();
    };
    const rows = [];
    if (this.plots.length) {
      const options = this.plots.map((one, i) => [i, one.title]);
      rows.push(choice("plot", [...options, ["-1", "any variable"]], plot.number,
        (value) => (value === "-1" ? this.free(plot.value) : this.take(Number(value))), { id: "plot-choice" }));
    }
    const variables = Object.values(fields).filter((one) => one.dims.length).map((one) => [one.name, spoken(one.name)]);
    rows.push(choice("variable", variables, plot.value, (value) => this.free(value), { id: "variable-choice" }));
    const own = field.dims.map((name) => [name, spoken(name)]);
    if (plot.x in dims) rows.push(choice("over", own, plot.x, again((value) => {
      if (value === plot.by) plot.by = plot.x;
      plot.x = value;
      plot.number = -1;
    })));
    if (field.dims.length > 1) {
      const others = own.filter(([name]) => name !== along);
      rows.push(choice(plot.shows === "map" ? "down" : "a line each", [["", "nothing"], ...others], plot.by, again((value) => (plot.by = value))));
      if (plot.x in dims && !field.isText) rows.push(choice("as", [["lines", "lines"], ["points", "points"], ["map", "map"]], plot.shows,
        again((value) => {
          plot.shows = value;
          if (value === "map" && !plot.by) plot.by = others[0][0];
        })));
    }
    if (!field.isText && plot.shows !== "map") rows.push(choice("axes", [["", "linear"], ["x", "log x"], ["y", "log y"], ["xy", "log both"]], plot.log, again((value) => (plot.log = value))));
    for (const name of this.dimsOf(plot)) {
      if (name === along || name === plot.by || dims[name].size < 2 || plot.shows === "map" && name === plot.x) continue;
      const labels = Array.from({ length: dims[name].size }, (_, i) => [i, labelWithUnit(dims[name], i)]);
      rows.push(choice(spoken(name), labels, this.chosen[name] || 0, again((value) => (this.chosen[name] = Number(value))), { "data-dim": name }));
    }
    this.over.replaceChildren(...rows);
    this.drawn = this.draw(field, along);
    this.page.remember?.();
  }

  async draw(field, along) {
    const plot = this.plot, { dims } = this.group;
    this.table(field, along);
    if (field.isText) {
      this.lines.forget();
      this.tiles.forget();
      this.under.replaceChildren();
      this.picture.replaceChildren(element("p", { class: "soft small", text: "Texts are in the table below." }));
      return;
    }
    if (plot.shows === "map" && plot.by && plot.x in dims) return this.map(field);
    return this.curve(field, along);
  }

  async curve(field, along) {
    const plot = this.plot, { dims, fields, path } = this.group;
    const log = plot.log || "", xField = fields[plot.x], xDim = dims[plot.x];
    const [yScale, yUnit] = unitOf(field);
    const sizes = dims[along].size, labels = xDim?.labels;
    const textual = xDim && labels && typeof labels[0] === "string";
    const logx = log.includes("x") && !textual, logy = log.includes("y") && !field.flags;
    const xScale = xField ? unitOf(xField)[0] : xDim ? unitOf(xDim)[0] : 1;
    const xs = (places) => {
      if (xField) return xField.along(along, places).map((one) => (logx ? Math.abs(one) : one) * xScale);
      if (textual) return labels.map((_, i) => i);
      return Array.from({ length: sizes }, (_, i) => (labels ? labels[i] * xScale : i));
    };
    const status = this.statusOf(field);
    let lines = plot.by ? Array.from({ length: dims[plot.by].size }, (_, i) => i) : [null];
    const series = [];
    let hidden = 0;
    for (const i of lines) {
      const places = i === null ? this.chosen : { ...this.chosen, [plot.by]: i };
      let y = field.along(along, places).map((one) => (logy ? Math.abs(one) : one) * yScale), x = xs(places);
      if (!y.some((one, j) => Number.isFinite(one) && Number.isFinite(x[j]))) continue;
      if (series.length >= MOST_LINES) {
        hidden++;
        continue;
      }
      let words = status?.dims.includes(along) ? status.along(along, places).map((one) => status.meaning(one)) : null;
      if (plot.ascending && xField) {
        const order = x.map((_, j) => j).filter((j) => Number.isFinite(x[j])).sort((a, b) => x[a] - x[b]);
        [x, y, words] = [x, y, words].map((own) => own && order.map((j) => own[j]));
      }
      series.push({
        name: i === null ? "" : labelWithUnit(dims[plot.by], i), x, y, look: look(i ?? 0),
        hollow: words?.map((one) => one !== "solved"), words, size: sizes > 60 ? 3 : 6,
        line: plot.shows !== "points", markers: plot.shows === "points" || !(plot.equal || sizes > 200),
        tips: y.map((one, j) => `${field.flags ? spoken(field.meaning(one)) : number(one)} ${yUnit} at ${textual ? labels[j] : number(x[j])}${words ? `, ${spoken(words[j])}` : ""}`),
      });
    }
    for (const [x, y, name] of plot.beside || []) {
      const second = fields[y];
      if (!second || !(x in fields || x in dims)) continue;
      const last = second.dims.at(-1);
      if (!last) continue;
      let across = x in fields ? fields[x].along(last, this.chosen).map((one) => one * unitOf(fields[x])[0])
        : textual ? labels.map((_, i) => i) : (dims[x].labels || []).map((one) => one * unitOf(dims[x])[0]);
      let up = second.along(last, this.chosen).map((one) => (logy ? Math.abs(one) : one) * unitOf(second)[0]);
      const numbers = fields.outline_round?.dims.at(-1) === last ? fields.outline_round.along(last, this.chosen) : null;
      if (numbers) [across, up] = [across, up].map((one) => rounds(one, numbers));
      if (up.some(Number.isFinite)) series.push({ name, x: across, y: up, width: 2, markers: false,
        look: { color: "ink", dash: series.some((one) => one.look.color === "ink") ? "1 4" : "5 3", marker: "circle" } });
    }
    this.tiles.forget();
    if (!series.length) {
      this.under.replaceChildren();
      return this.lines.say(`Nothing here: ${spoken(plot.value)} has no value for this choice.`);
    }
    const known = new Set(series.map((one) => one.name));
    for (const name of this.lit) if (!known.has(name)) this.lit.delete(name);
    if (this.lit.size) for (const one of series) one.faint = !this.lit.has(one.name);
    const absolute = logy && isSigned(field);
    const name = (one, unit) => one + (unit ? ` [${unit}]` : "");
    const across = textual || plot.equal ? "" : tamed(series, "x", logx), up = plot.equal || field.flags ? "" : tamed(series, "y", logy);
    const xUnit = xField ? unitOf(xField)[1] : xDim ? unitOf(xDim)[1] : "";
    await this.lines.show({
      series, logx, logy, categories: textual ? labels : null, zero: !logy && /error/.test(field.name), window: { equal: plot.equal },
      xticks: xDim && !textual && sizes <= 8 && roomy(series[0].x, logx) ? series[0].x : null,
      xlabel: name(spoken(plot.x), `${across}${xUnit}`),
      ylabel: name(absolute ? `|${spoken(field.name)}|` : spoken(field.name), `${up}${yUnit}`),
    });
    const words = [...hollowWords(series), absolute ? "sizes of errors; the table has their signs" : this.sign(field, along)].filter(Boolean);
    if (series.length > CROWD && !this.lit.size) words.push(`${series.length} lines: choose names to bring them out`);
    if (hidden) words.push(`and ${hidden} lines more: the table below has them all`);
    if (field.flags) words.push(Object.entries(field.flags).map(([key, word]) => `${key}: ${spoken(word)}`).join(", "));
    this.under.replaceChildren(legend(series, words, this.lit, (name) => {
      if (!this.lit.delete(name)) this.lit.add(name);
      this.drawn = this.draw(field, along);
    }));
  }

  // Statuses of the values of a variable, where the group has them.
  statusOf(field) {
    const { status } = this.group.fields;
    return status?.flags && field !== status && status.within(field.dims) ? status : null;
  }

  async map(field) {
    const plot = this.plot, { dims } = this.group, cells = [], values = [];
    const across = dims[plot.x], down = dims[plot.by], unit = unitOf(field)[1];
    const read = (i, j) => field.of({ ...this.chosen, [plot.x]: i, [plot.by]: j });
    const there = (value) => (field.flags ? field.meaning(value) !== "" && field.meaning(value) !== "not_requested" : Number.isFinite(value));
    const status = this.statusOf(field);
    const [columns, rows, without] = filled(across, down, (i, j) => there(read(i, j)));
    rows.forEach((j, row) => columns.forEach((i, column) => {
      const value = read(i, j);
      cells.push({ row, column, value, word: status?.meaning(status.of({ ...this.chosen, [plot.x]: i, [plot.by]: j })) || "solved" });
      if (Number.isFinite(value)) values.push(value);
    }));
    const marked = new Set(cells.filter((cell) => there(cell.value) && !field.flags).map((cell) => cell.word).filter((word) => word !== "solved"));
    const words = [cells.some((cell) => !there(cell.value)) && "hatched: nothing", ...[...marked].map((word) => `${SIGNS[word]} ${spoken(word)}`),
      this.sign(field), without].filter(Boolean);
    const key = element("span", { class: "soft", text: words.join(" · ") }), colours = field.flags ? null : colouring(field, values, key);
    for (const cell of cells) {
      if (field.flags) Object.assign(cell, category(field, cell.value));
      else if (!Number.isFinite(cell.value)) Object.assign(cell, { missing: true, colour: "#8883", text: "", tip: "nothing" });
      else {
        const rgb = colours.of(cell.value);
        Object.assign(cell, { colour: css(rgb), ink: readableOn(rgb), text: written(field, cell.value, 2) + (cell.word === "solved" ? "" : ` ${SIGNS[cell.word]}`), tip: `${written(field, cell.value, 4)} ${unit}, ${spoken(cell.word)}` });
      }
    }
    this.lines.forget();
    if (!cells.length) {
      this.under.replaceChildren();
      return this.tiles.say(`Nothing here: ${spoken(plot.value)} has no value for this choice.`);
    }
    await this.tiles.show({
      cells, columns: columns.map((i) => labelText(across, i)), rows: rows.map((j) => labelText(down, j)),
      xlabel: titled({ ...across, name: plot.x }), ylabel: titled({ ...down, name: plot.by }), pick: null,
    });
    this.under.replaceChildren(field.flags ? categories(field, key) : colours.key);
  }

  // What the sign of the plotted errors means.
  sign(field, along = "") {
    const { x, by } = this.plot;
    return this.group.sign(field, this.chosen, [x, by, along], this.page.groups["/"]);
  }

  // What the plot shows as numbers, or texts.
  rows(field, along) {
    const plot = this.plot, { dims } = this.group, by = plot.by ? dims[plot.by] : null;
    const columns = by ? Array.from({ length: by.size }, (_, i) => i) : [null];
    const kept = columns.map((i) => [i, field.along(along, i === null ? this.chosen : { ...this.chosen, [plot.by]: i })])
      .filter(([, values]) => values.some((one) => (field.isText ? one !== "" : !Number.isNaN(one))));
    const unit = unitOf(field)[1];
    const head = [titled({ ...dims[along], name: along }), ...kept.map(([i]) => (i === null ? titled(field) : labelWithUnit(by, i)))];
    const there = (one) => (field.isText ? one !== "" : !Number.isNaN(one));
    const body = Array.from({ length: dims[along].size }, (_, j) => j).filter((j) => kept.some(([, values]) => there(values[j])))
      .map((j) => [labelText(dims[along], j), ...kept.map(([, values]) => written(field, values[j], 5))]);
    return { head, body, unit };
  }

  table(field, along) {
    const { head, body, unit } = this.rows(field, along);
    const shown = body.slice(0, MOST_ROWS), columns = Math.min(head.length, MOST_COLUMNS);
    const cut = body.length > shown.length || columns < head.length
      ? element("p", { class: "soft small", text: `The first ${shown.length} of ${body.length} rows, ${columns - 1} of ${head.length - 1} columns; the copy has them all.` }) : "";
    const csv = () => [head, ...body].map((row) => row.map((one) => `"${String(one).replaceAll("−", "-").replaceAll('"', '""')}"`).join(",")).join("\n");
    const open = this.opened ?? (field.isText || body.length <= 30);
    const details = element("details", { open, ontoggle: () => (this.opened = details.open) },
      element("summary", { text: `${spoken(field.name)}${unit ? ` [${unit}]` : ""} in numbers` }),
      element("p", { class: "small" }, [field.long_name, this.sign(field, along)].filter(Boolean).join("; ")), cut,
      element("div", { class: "grid plain-grid", tabindex: "0", role: "region", "aria-label": `Numbers of ${spoken(field.name)}` },
        element("table", { class: "plain" },
          element("thead", {}, element("tr", {}, head.slice(0, columns).map((text, i) => element("th", { scope: "col", class: i && !field.isText ? "number" : "", text })))),
          element("tbody", {}, shown.map((row) => element("tr", {}, row.slice(0, columns).map((text, i) => element(i ? "td" : "th", { class: i && !field.isText ? "number" : "", text }))))))),
      copyButton(csv, "Copy as CSV"));
    if (field.isText) details.open = true;
    this.numbers.replaceChildren(details);
  }

  singles(fields) {
    return element("table", { class: "plain" }, element("tbody", {}, fields.map((field) => element("tr", {},
      element("th", { scope: "row", text: spoken(field.name) }),
      element("td", { class: "number", text: `${written(field, field.valueAt(0), 5)} ${unitOf(field)[1]}` }),
      element("td", { class: "soft", text: field.long_name || "" })))));
  }

  inventory() {
    const { dims, fields, attributes } = this.group;
    const pick = (field) => element("button", { type: "button", class: "link", text: field.name, onclick: () => {
      this.free(field.name);
      this.over.scrollIntoView({ block: "nearest" });
    } });
    const rows = Object.values(fields).map((field) => element("tr", {},
      element("th", { scope: "row" }, field.dims.length ? pick(field) : field.name),
      element("td", { text: field.long_name || "" }), element("td", { text: field.units && field.units !== "1" ? field.units : "" }),
      element("td", { class: "soft", text: field.dims.map((name) => `${name} ${dims[name].size}`).join(", ") })));
    const notes = Object.entries(attributes).filter(() => this.group.path !== "/").map(([name, value]) => element("p", { class: "small", text: `${spoken(name)}: ${value}` }));
    return element("details", {}, element("summary", { text: `${rows.length} variables over ${Object.keys(dims).length} dimensions` }), notes,
      element("div", { class: "wide" }, element("table", { class: "plain" }, element("tbody", {}, rows))));
  }

  redraw() {
    this.render();
    this.page.charts[`${this.group.path} network`]?.redraw?.();
  }

  show() {
    return Promise.all([this.moved, this.drawn]);
  }
}

// Numbers of lines brought to a size that an axis can show: divided by the power of ten that is returned for its unit.
function tamed(series, axis, log) {
  const values = series.flatMap((one) => one[axis]).filter(Number.isFinite).map(Math.abs);
  const largest = values.reduce((a, b) => Math.max(a, b), 0);
  const smallest = values.reduce((a, b) => (b > 0 ? Math.min(a, b) : a), Infinity);
  if (log && largest / smallest > 1e3) return "";
  if (!largest || (largest < 1e5 && largest >= 1e-2)) return "";
  const power = Math.floor(Math.log10(largest) / 3) * 3;
  for (const one of series) one[axis] = one[axis].map((value) => value / 10 ** power);
  return `${ten(power)} `;
}

// Whether labels at these places have room side by side.
function roomy(places, log) {
  const sorted = places.map((one) => (log ? Math.log(one) : one)).sort((a, b) => a - b);
  const gap = Math.min(...sorted.slice(1).map((one, i) => one - sorted[i]));
  return sorted.length < 2 || gap > 0.05 * (sorted.at(-1) - sorted[0]);
}

// Labels along two dimensions that have anything, and words on those left out.
function filled(across, down, there) {
  const all = (dim) => Array.from({ length: dim.size }, (_, i) => i);
  const columns = all(across).filter((i) => all(down).some((j) => there(i, j)));
  const rows = all(down).filter((j) => columns.some((i) => there(i, j)));
  const missing = [[across, columns], [down, rows]].flatMap(([dim, kept]) => all(dim).filter((i) => !kept.includes(i)).map((i) => labelText(dim, i)));
  const named = missing.length > 7 ? [...missing.slice(0, 6), `and ${missing.length - 6} more`] : missing;
  return [columns, rows, missing.length ? `with nothing here, left out: ${named.join(", ")}` : ""];
}
