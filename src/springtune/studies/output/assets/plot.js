// A plot of a group: one of its variables over its dimensions, as lines, as a map and as numbers.

const MOST_LINES = 120;

class Plot {
  // `plots` are declared ones; `bare` shows the first alone, without controls and numbers. With `choose` the places are those
  // of a cell, that a click on a tile chooses. `limit` leaves out points beyond it, `marks` gets upright lines.
  constructor(group, plots, { bare = false, choose = null, limit = Infinity, marks = () => [], height = 320 } = {}) {
    Object.assign(this, { group, bare, choose, limit, marks, height, chosen: {} });
    this.plots = plots.filter((plot) => this.possible(plot));
    this.over = element("div", { class: "row" });
    this.under = element("div");
    this.numbers = element("div");
    this.chart = new Chart(element("div", { class: "chart" }));
    this.holder = element("div", {}, this.over, this.chart.holder, this.under, this.numbers);
    const own = Object.values(group.fields).filter((field) => field.dims.length);
    if (this.plots.length) this.take(0);
    else if (own.length && !bare) {
      const full = own.filter((field) => !field.isText && !field.flags && !field.isEmpty);
      this.free((full.find((field) => field.error) || full[0] || own[0]).name);
    }
  }

  // Whether a declared plot has points, over more than one place.
  possible({ value, x, by }) {
    const { fields, dims } = this.group, varies = (field) => new Set(Array.from(field.values).filter(Number.isFinite)).size > 1;
    return value in fields && !fields[value].isEmpty && (!by || by in dims) && (x in dims || x in fields && varies(fields[x]));
  }

  take(index) {
    const plot = this.plots[index], { fields, dims } = this.group;
    this.plot = { ...plot, index };
    if (!this.choose) this.chosen = this.fullest(fields[plot.value], fields[plot.x]);
    for (const [name, label] of Object.entries(plot.selection || {}))
      if (name in dims && this.group.place(name, label) >= 0) this.chosen[name] = this.group.place(name, label);
  }

  // A variable without a declared plot: its last numbers along x, the longest other dimension as lines.
  free(name) {
    const field = this.group.fields[name], size = (one) => this.group.dims[one].size;
    const dims = field.dims.filter((one) => size(one) > 1);
    const x = dims.filter((one) => typeof this.group.label(one, 0) === "number").at(-1) || dims.at(-1) || field.dims.at(-1);
    const others = dims.filter((one) => one !== x).sort((a, b) => size(a) - size(b));
    this.plot = { value: name, x, by: others.filter((one) => size(one) <= MOST_LINES).at(-1) || "", shows: "lines", log: "", beside: [], index: -1 };
    if (!this.choose) this.chosen = this.fullest(field);
  }

  // Places of the first value that is there, and has a number to stand over, so that a view does not begin empty.
  fullest(field, over = null) {
    const stands = (flat) => !over?.within(field.dims) || Number.isFinite(over.of(field.placesOf(flat)));
    const there = (one) => (field.type === "integer" ? one !== 0 : !absent(one));
    return field.placesOf(Math.max(0, field.values.findIndex((one, flat) => there(one) && stands(flat))));
  }

  // The dimension along which points follow each other.
  along() {
    const { x, value, along } = this.plot, own = this.group.fields[value].dims;
    return x in this.group.dims ? x : own.includes(along) ? along : own.at(-1);
  }

  render() {
    if (!this.plot) return undefined;
    const { plot, group } = this, { fields, dims } = group, field = fields[plot.value], along = this.along();
    const own = field.dims.map((name) => [name, spoken(name)]), others = own.filter(([name]) => name !== along), rows = [];
    const again = (take) => (value) => {
      take(value);
      this.render();
    };
    const change = (name) => again((value) => {
      if (name === "x" && value === plot.by) plot.by = plot.x;
      plot[name] = value;
      if (plot.shows === "map" && !plot.by) plot.by = field.dims.find((one) => one !== plot.x) || "";
    });
    if (this.plots.length) rows.push(choice("plot", [...this.plots.map((one, i) => [i, one.title]), [-1, "any variable"]], plot.index,
      again((i) => (i === "-1" ? this.free(plot.value) : this.take(Number(i)))), { id: "plot-choice" }));
    rows.push(choice("variable", Object.values(fields).filter((one) => one.dims.length).map((one) => [one.name, spoken(one.name)]), plot.value,
      again((name) => this.free(name)), { id: "variable-choice" }));
    if (plot.x in dims) rows.push(choice("over", own, plot.x, change("x")));
    if (others.length) rows.push(choice(plot.shows === "map" ? "down" : "a line each", [["", "nothing"], ...others], plot.by, change("by")));
    if (others.length && plot.x in dims && !field.isText)
      rows.push(choice("as", ["lines", "points", "map"].map((one) => [one, one]), plot.shows, change("shows")));
    if (!field.isText && plot.shows !== "map")
      rows.push(choice("axes", [["", "linear"], ["x", "log x"], ["y", "log y"], ["xy", "log both"]], plot.log, change("log")));
    const read = [plot.value, plot.x].flatMap((name) => fields[name]?.dims || []);
    const beside = plot.beside.flatMap((row) => fields[row[1]]?.dims.slice(0, -1) || []);
    const free = Object.keys(dims).filter((name) => [...read, ...beside].includes(name) && ![along, plot.by].includes(name));
    if (!this.choose) rows.push(...selectors(group, free, this.chosen, again((places) => (this.chosen = places))));
    if (!this.bare) {
      this.over.replaceChildren(...rows);
      this.table(field, along);
    }
    this.drawn = this.draw(field, along);
    return this.drawn;
  }

  draw(field, along) {
    this.under.replaceChildren();
    if (field.isText) return this.chart.say("Texts are in the table below.");
    return this.plot.shows === "map" && this.plot.by ? this.map(field) : this.lines(field, along);
  }

  // Values of a variable, or labels of a dimension, along a dimension, and their axis.
  axis(name, along, places) {
    const { dims, fields } = this.group, field = fields[name], dim = dims[name];
    if (field) return field.along(along, places).map((one) => one * unitOf(field)[0]);
    return dim.labels && typeof dim.labels[0] === "number" ? dim.labels.map((one) => one * unitOf(dim)[0]) : upTo(dim.size);
  }

  lines(field, along) {
    const { plot, group, limit } = this, { dims, fields } = group, log = plot.log || "", xDim = dims[plot.x];
    const textual = typeof xDim?.labels?.[0] === "string", logx = log.includes("x") && !textual, logy = log.includes("y") && !field.flags;
    const size = (values, logarithmic) => (logarithmic ? values.map(Math.abs) : values);
    const status = this.statusOf(field), dim = dims[plot.by], count = dims[along].size, series = [];
    for (const i of plot.by ? upTo(dim.size) : [-1]) {
      const { places, name } = this.placesOf(i, field, along), x = size(this.axis(plot.x, along, places), logx);
      const y = size(this.axis(plot.value, along, places), logy);
      const words = status?.dims.includes(along) ? status.along(along, places).map((one) => status.meaning(one)) : y.map(() => "solved");
      let kept = upTo(count).filter((j) => Number.isFinite(x[j]) && Number.isFinite(y[j]));
      if (!kept.length) continue;
      if (plot.ascending) kept.sort((a, b) => x[a] - x[b]);
      else if (kept.some((j) => Math.abs(y[j]) <= limit)) kept = kept.filter((j) => Math.abs(y[j]) <= limit);
      else kept = upTo(count); // with gaps where there is nothing
      const mine = this.choose && plot.x in this.chosen && (i < 0 || this.chosen[plot.by] === i) && places.kinematics === this.chosen.kinematics;
      series.push({
        name, look: look(Math.max(i, 0)), x: kept.map((j) => x[j]), y: kept.map((j) => y[j]),
        words: kept.map((j) => words[j]), hollow: kept.map((j) => words[j] !== "solved"),
        chosen: mine ? kept.indexOf(this.chosen[along]) : -1, width: mine ? 3 : 1.8,
        line: plot.shows !== "points", markers: plot.shows === "points" || !(plot.equal || count > 200),
        tips: kept.map((j) => [field.flags ? spoken(field.meaning(y[j])) : withUnit(field, y[j], number(y[j])),
          `at ${textual ? xDim.labels[j] : number(x[j])}`, spoken(words[j])].join(", ")),
      });
    }
    const shown = series.slice(0, MOST_LINES);
    for (const [x, y, name] of plot.beside) {
      const last = fields[y]?.dims.at(-1);
      if (!last || !(x in fields || x in dims)) continue;
      const drawn = [this.axis(x, last, this.chosen), size(this.axis(y, last, this.chosen), logy)];
      const rounds = fields.outline_round?.dims.at(-1) === last ? fields.outline_round.along(last, this.chosen) : null;
      const [across, up] = rounds ? drawn.map((one) => closed(one, rounds)) : drawn;
      const dash = shown.some((one) => one.look.color === "ink") ? "1 4" : "5 3";
      if (up.some(Number.isFinite)) shown.push({ name, x: across, y: up, markers: false, look: { color: "ink", dash } });
    }
    if (!shown.length) return this.chart.say(`Nothing here: ${spoken(plot.value)} has no value for this choice.`);
    const absolute = logy && field.signed ? `|${titled(field)}|` : titled(field), labels = xDim?.labels;
    const ticks = textual ? labels.map((text, i) => [i, text]) : labels && count <= 8 ? this.axis(plot.x).map((one) => [one, number(one)]) : undefined;
    const marks = this.marks();
    this.under.replaceChildren(legend(shown, [...marks.map((one) => one.name), hollowWords(series),
      logy && field.signed ? "sizes of errors; the table has their signs" : this.signOf(field),
      series.length > MOST_LINES && `and ${series.length - MOST_LINES} lines more: the table below has them all`,
      field.flags && Object.entries(field.flags).map(([key, word]) => `${key}: ${spoken(word)}`).join(", ")]));
    return drawLines(this.chart, {
      series: shown, marks: marks.map((one) => ({ ...one, name: one.name.split(":")[0] })), zero: /error/.test(field.name),
      equal: plot.equal, height: this.height,
      x: { label: titled({ ...(fields[plot.x] || xDim), name: plot.x }), type: logx ? "log" : "linear", ticks },
      y: { label: absolute, type: logy ? "log" : "linear" },
    });
  }

  // Places of a line or a row, in other kinematics where it has nothing in the chosen ones; with its name.
  placesOf(i, field, along) {
    const { group, plot } = this, places = i < 0 ? this.chosen : { ...this.chosen, [plot.by]: i }, kinds = group.dims.kinematics;
    const name = i < 0 ? "" : labelWithUnit(group.dims[plot.by], i);
    if (i < 0 || !field.dims.includes("kinematics") || [along, plot.by].includes("kinematics") || kinds.size < 2) return { places, name };
    const there = (one) => field.along(along, one).some((value) => (field.flags ? field.meaning(value) !== "not_requested" : !absent(value)));
    const found = [places, ...upTo(kinds.size).map((kinematics) => ({ ...places, kinematics }))].find(there) || places;
    return { places: found, name: `${name}, ${kinds.labels[found.kinematics || 0]}` };
  }

  // The sentence on the signs of errors, of the load that is seen.
  signOf(field) {
    const { group, plot } = this, known = group.fields.reference_displacement || window.springtune.groups["/"].fields.reference_displacement;
    const seen = known && field.name === SCENE_ERROR && ![plot.x, plot.by].includes("load");
    const size = seen ? known.of(known.group.placesFrom(group, this.chosen) || {}) : 0;
    return field.sign && size ? `${size > 0 ? "positive" : "negative"}: too soft` : field.sign;
  }

  // Statuses of the values of a variable, where the group has them.
  statusOf(field) {
    const { status } = this.group;
    return status && field !== status && status.within(field.dims) ? status : null;
  }

  map(field) {
    const { plot, group, chosen } = this, across = group.dims[plot.x], down = group.dims[plot.by], unit = unitOf(field)[1], status = this.statusOf(field);
    const own = upTo(down.size).map((j) => this.placesOf(j, field, plot.x)), read = (i, j) => field.of({ ...own[j].places, [plot.x]: i });
    const there = (value) => (field.flags ? !["", "not_requested"].includes(field.meaning(value)) : Number.isFinite(value));
    const word = (places) => (status ? status.meaning(status.of(places)) : "solved");
    const columns = upTo(across.size).filter((i) => upTo(down.size).some((j) => there(read(i, j))));
    const rows = upTo(down.size).filter((j) => columns.some((i) => there(read(i, j))));
    if (!columns.length) return this.chart.say(`Nothing here: ${spoken(plot.value)} has no value for this choice.`);
    const scale = scaleOf(field, columns.flatMap((i) => rows.map((j) => read(i, j))).filter(Number.isFinite)), words = new Set();
    const cells = rows.flatMap((j, row) => columns.map((i, column) => {
      const places = { ...own[j].places, [plot.x]: i }, value = read(i, j), of = word(places), name = `${own[j].name}, ${labelText(across, i)}`;
      const more = { row, column, places, name };
      if (field.flags) return { ...more, colour: statusColour(field, value), text: SIGNS[field.meaning(value)] || "", tip: spoken(field.meaning(value)) };
      if (of !== "solved" && of !== "not_requested") words.add(`${SIGNS[of]} ${spoken(of)}`);
      const sign = of === "solved" ? "" : ` ${SIGNS[of]}`;
      if (!there(value)) return { ...more, colour: MISSING, text: sign, tip: spoken(of) };
      return { ...more, rgb: scale.of(value), text: written(field, value, 2) + sign, tip: `${written(field, value)} ${unit}, ${spoken(of)}` };
    }));
    const missing = [[across, columns], [down, rows]].flatMap(([dim, kept]) => upTo(dim.size).filter((i) => !kept.includes(i)).map((i) => labelText(dim, i)));
    this.under.replaceChildren(scale.key([...words, this.signOf(field), this.choose && "click a tile to choose it",
      missing.length && `with nothing here, left out: ${missing.slice(0, 6).join(", ")}${missing.length > 6 ? ` and ${missing.length - 6} more` : ""}`]));
    return drawTiles(this.chart, {
      cells, columns: columns.map((i) => labelText(across, i)), rows: rows.map((j) => own[j].name),
      x: titled({ ...across, name: plot.x }), y: titled({ ...down, name: plot.by }), pick: this.choose && ((cell) => this.choose(cell.places)),
      chosen: this.choose && { row: rows.indexOf(chosen[plot.by]), column: columns.indexOf(chosen[plot.x]) },
    });
  }

  // What the plot shows as numbers, or texts.
  table(field, along) {
    const { plot, group } = this, dim = group.dims[along], by = group.dims[plot.by], unit = unitOf(field)[1];
    const line = (i) => [i, this.placesOf(i, field, along)];
    const kept = (by ? upTo(by.size) : [-1]).map(line).map(([i, { places, name }]) => [i, field.along(along, places), name])
      .filter(([, values]) => !values.every(absent));
    const columns = [{ name: along, title: titled({ ...dim, name: along }), value: (row) => row, text: (row) => labelText(dim, row) }];
    for (const [i, values, name] of kept) columns.push({ name: `${i}`, title: name || titled(field), numeric: !field.isText && !field.flags,
      value: (row) => (field.isText ? values[row] : values[row] * unitOf(field)[0]), text: (row) => written(field, values[row], 5) });
    const rows = upTo(dim.size).filter((row) => kept.some(([, values]) => !absent(values[row])));
    for (const one of columns) one.width = Math.max(12, one.title.length / 2 + 3, ...rows.slice(0, 50).map((row) => one.text(row).length + 3));
    const label = `Numbers of ${spoken(field.name)}`;
    const fill = () => details.open && details.children.length < 3 && details.append(new Table({ columns, rows, label }).holder);
    const details = element("details", { open: this.open ?? (field.isText || rows.length <= 30), ontoggle: () => {
      this.open = details.open;
      fill();
    } }, element("summary", { text: `${spoken(field.name)}${unit ? ` [${unit}]` : ""} in numbers` }),
      element("p", { class: "small", text: [field.long_name, this.signOf(field)].filter(Boolean).join("; ") }));
    this.numbers.replaceChildren(details);
    fill();
  }
}

// Colours of the values of a map, and their key: sizes of errors have the scale of the figures.
function scaleOf(field, values) {
  const [scale, unit] = unitOf(field), low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (field.flags) return { key: (words) => element("p", { class: "scale" }, Object.entries(field.flags).map(([value, word]) =>
    element("span", { class: "swatch" }, element("i", { style: `background:${statusColour(field, value)}` }), `${SIGNS[word] || ""} ${spoken(word)}`)),
  words.filter(Boolean).join(" · ")) };
  if (!field.error) return {
    of: (value) => between(BLUES, high > low ? (value - low) / (high - low) : 0.3),
    key: (words) => ramp(BLUES, `${number(low * scale, 3)} ${unit}`, `${number(high * scale, 3)} ${unit}`, ...words),
  };
  const { colours, range } = window.springtune.scale, [least, most] = range.map(Math.log10);
  return {
    of: (value) => between(colours, (Math.log10(100 * Math.abs(value)) - least) / (most - least)),
    key: (words) => ramp(colours, `≤ ${number(range[0])} %`, `≥ ${number(range[1])} %`, "size of the error, logarithmic", ...words),
  };
}

function statusColour(field, value) {
  const word = field.meaning(value), place = Object.keys(field.flags).indexOf(String(value));
  return STATUS_COLOURS[word] || (place < 0 || word === "not_requested" ? MISSING : COLOURS[place % COLOURS.length]);
}

// Outlines of several rounds, such as that of a hole, as one line with gaps: each round is closed.
function closed(values, rounds) {
  const found = [];
  let first = 0;
  values.forEach((one, i) => {
    if (!Number.isFinite(one)) return;
    if (i && rounds && rounds[i] !== rounds[i - 1]) {
      found.push(values[first], NaN);
      first = i;
    }
    found.push(one);
  });
  return [...found, values[first]];
}
