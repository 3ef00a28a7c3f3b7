// The view of cells: the table, and for the chosen cell its facts, charts, code and files.

const SCENE_ERROR = "deformation_error";

class Cells {
  constructor(page, view) {
    this.page = page;
    this.view = view;
    this.root = page.groups["/"];
    this.title = "Cells";
  }

  async build(holder) {
    const root = await this.root.load();
    this.status = root.fields.status;
    this.dims = this.status.dims;
    this.varying = this.dims.filter((name) => root.dims[name].size > 1);
    if (!this.varying.length) this.varying = this.dims.slice(0, 1);
    const constant = this.dims.filter((name) => !this.varying.includes(name));
    const count = this.status.size, present = new Int32Array(count);
    for (let i = 0; i < count; i++) present[i] = i;
    const tally = this.page.tally;
    const boxes = Object.entries(tally).filter((one) => one[1]).map(([status, number_]) => element("label", { class: "box" },
      element("input", { type: "checkbox", value: status, checked: status !== "not_requested", onchange: () => this.table.update() }),
      badge(status), ` ${number_}`));
    const shown = () => new Set([...holder.querySelectorAll(".boxes input:checked")].map((one) => one.value));
    const counter = element("span", { class: "soft", role: "status", "aria-live": "polite" });
    const reset = element("button", { type: "button", class: "copy", id: "reset", text: "Reset filters", onclick: () => {
      for (const box of holder.querySelectorAll(".boxes input")) box.checked = box.value !== "not_requested";
      this.table.reset();
    } });
    const error = root.fields[SCENE_ERROR], sentence = error && !this.empty(error) ? root.sign(error, {}, ["load"]) : "";
    const tableHolder = element("div");
    const caption = constant.map((name) => labelWithUnit(root.dims[name], 0)).join(" · ");
    this.side = element("div", { class: "chosen-cell" });
    holder.append(element("div", { class: "cells" },
      element("div", { class: "list" },
        element("div", { class: "row" }, element("fieldset", { class: "boxes" }, element("legend", { text: "Status" }), boxes), reset),
        element("p", { class: "soft small" }, caption ? `All cells: ${caption}. ` : "", counter),
        tableHolder,
        element("p", { class: "soft small" }, "Click a row, or use the arrow keys in the table. Click a head to sort.",
          sentence ? ` Deformation error, (network − reference) / |reference|: ${sentence}.` : "")),
      this.side));
    this.table = new Table(tableHolder, {
      columns: this.columns(), rows: Array.from(present), label: "Cells of the study",
      choose: (row) => this.page.choose(this.placesOf(row)),
      changed: (count_, all, wrong, filtered) => {
        counter.textContent = [`${count_} of ${all} cells shown.`, ...wrong].join(" ");
        reset.disabled = !filtered && [...holder.querySelectorAll(".boxes input")].every((box) => box.checked === (box.value !== "not_requested"));
      },
      kind: (row) => this.status.meaning(this.status.valueAt(row)),
      extra: () => {
        const words = shown();
        return (row) => words.has(this.status.meaning(this.status.valueAt(row)));
      },
    });
    this.buildSide();
    const first = this.table.order[0] ?? 0;
    this.places ||= this.placesOf(first);
  }

  columns() {
    const root = this.root, columns = [];
    for (const name of this.varying) {
      const dim = root.dims[name];
      const labels = Array.from({ length: dim.size }, (_, i) => labelText(dim, i));
      const unit = unitOf(dim)[1], stride = this.status.strides[name];
      const place = (row) => Math.floor(row / stride) % dim.size;
      const longest = Math.max(...labels.map((one) => one.length));
      columns.push({
        name, title: spoken(name) + (unit ? ` [${unit}]` : ""), hint: dim.long_name, labels,
        width: Math.min(24, Math.max(longest + 2, widest(spoken(name)) + 2, 7)),
        numeric: typeof dim.labels?.[0] === "number", value: place, text: (row) => labels[place(row)],
      });
    }
    const named = this.view.columns.includes("status") ? this.view.columns : ["status", ...Object.keys(root.fields)];
    for (const name of named) {
      const field = root.fields[name];
      if (name === "status") columns.push(this.statusColumn());
      if (!field || name === "status" || !field.dims.every((one) => this.dims.includes(one))) continue;
      const at = field.from(this.status), scale = unitOf(field)[0], unit = unitOf(field)[1];
      const numeric = !field.isText && !field.flags;
      const absent = this.empty(field);
      if (absent) continue;
      columns.push({
        name, title: titled(field), hint: field.long_name, numeric, pinned: name === SCENE_ERROR,
        width: field.isText ? 34 : Math.max(longest(field) + 3, widest(titled(field)) + 2),
        value: (row) => { const value = field.valueAt(at(row)); return numeric ? value * scale : value; },
        sortValue: unit === "%" && /error/.test(name)
          ? (row) => Math.abs(field.valueAt(at(row))) : undefined,
        text: (row) => written(field, field.valueAt(at(row))),
      });
    }
    if (!columns.some((one) => one.pinned)) for (const one of columns) one.pinned = one.name === "status";
    return columns;
  }

  statusColumn() {
    const labels = Object.entries(this.page.tally).filter((one) => one[1]).map((one) => spoken(one[0]));
    const word = (row) => this.status.meaning(this.status.valueAt(row));
    return {
      name: "status", title: "status", width: Math.max(...labels.map((one) => one.length)) + 6, labels,
      value: (row) => this.status.valueAt(row), text: (row) => spoken(word(row)), node: (row) => badge(word(row)),
    };
  }

  // Whether a variable holds nothing at all.
  empty(field) {
    const values = field.unpacked();
    return field.isText ? values.every((one) => one < 0) : field.type === "float" && values.every((one) => Number.isNaN(one));
  }

  placesOf(row) {
    return Object.fromEntries(this.dims.map((name) => [
      name, Math.floor(row / this.status.strides[name]) % this.root.dims[name].size,
    ]));
  }

  buildSide() {
    const panel = (name, title, ...children) => element("section", { class: "panel", id: `panel-${name}` },
      element("h3", { text: title }), children);
    this.heading = element("h2", { "aria-live": "polite" });
    this.selectors = element("div", { class: "row" });
    this.facts = element("div");
    this.parts = {};
    const chart = (name) => (this.parts[name] = element("div", { class: "chart" }));
    const under = (name) => (this.parts[`${name}-under`] = element("div"));
    const over = (name) => (this.parts[`${name}-over`] = element("div", { class: "row" }));
    const groups = this.page.groups;
    const has = { error: this.root.fields[SCENE_ERROR], curve: groups["/sensitivity"], fields: groups["/fields"] };
    this.has = has;
    const sections = [];
    if (has.curve) sections.push(panel("curve", "Sensitivity: error against uniform stiffness", chart("curve"), under("curve")));
    if (has.error && this.varying.includes("mesh_size"))
      sections.push(panel("size", "Error against mesh size", chart("size"), under("size")));
    if (this.status.size > 1 && this.dims.length > 1) sections.push(panel("map", "Map over two parameters", over("map"), chart("map"), under("map")));
    sections.push(panel("shape", "The network over its reference", over("shape"), chart("shape"), under("shape")));
    this.code = element("pre", { class: "code", tabindex: "0", role: "region", "aria-label": "Python code of this cell" });
    this.files = element("div");
    this.everything = element("div");
    this.side.append(this.heading, this.selectors, this.facts, ...sections,
      panel("code", "This cell in Python", this.code, copyButton(() => this.code.textContent, "Copy")),
      panel("files", "Files", this.files),
      panel("all", "Everything about this cell", this.everything));
    this.charts = {
      curve: new Lines(this.parts.curve, "curve", 320), size: new Lines(this.parts.size || element("div"), "size", 300),
      map: new Tiles(this.parts.map || element("div"), "map"),
    };
    this.shape = new Shape(this.parts["shape-over"], this.parts.shape, this.parts["shape-under"], this.page);
    Object.assign(this.page.charts, this.charts, { shape: this.shape.chart });
    this.mapChoice = { x: "", y: "", value: "status" };
    const error = this.root.fields[SCENE_ERROR];
    if (error && !this.empty(error)) this.mapChoice.value = SCENE_ERROR;
    const sizes = this.varying.slice();
    const first = sizes.includes("mesh_size") ? "mesh_size" : sizes[0];
    const second = ["definition", ...sizes].find((name) => sizes.includes(name) && name !== first)
      || this.dims.find((name) => name !== first);
    this.mapChoice.x = first;
    this.mapChoice.y = second;
    if (this.parts["map-over"]) this.mapControls();
  }

  mapControls() {
    const names = Object.entries(this.root.fields).filter(([, field]) => !field.isText
      && field.dims.length > 1 && field.dims.every((one) => this.dims.includes(one)) && !this.empty(field)).map(([name]) => name);
    const dims = this.dims.map((name) => [name, spoken(name)]);
    const set = (key) => (value) => {
      const other = { x: "y", y: "x" }[key];
      if (other && this.mapChoice[other] === value) this.mapChoice[other] = this.mapChoice[key];
      this.mapChoice[key] = value;
      this.mapControls();
      this.showMap();
    };
    this.parts["map-over"].replaceChildren(
      choice("of", names.map((name) => [name, spoken(name)]), this.mapChoice.value, set("value"), { id: "map-value" }),
      choice("across", dims, this.mapChoice.x, set("x"), { id: "map-x" }),
      choice("down", dims, this.mapChoice.y, set("y"), { id: "map-y" }));
  }

  // Show a cell; called for every change of the selection.
  show(places) {
    this.places = places;
    const row = this.status.flat(places);
    this.table.mark(row);
    const root = this.root;
    this.heading.textContent = this.varying.map((name) => labelWithUnit(root.dims[name], places[name])).join(" · ");
    this.selectors.replaceChildren(...this.varying.map((name) => choice(spoken(name),
      Array.from({ length: root.dims[name].size }, (_, i) => [i, labelWithUnit(root.dims[name], i)]), places[name],
      (value) => this.page.choose({ ...this.places, [name]: Number(value) }), { "data-dim": name })));
    this.showFacts(places);
    this.code.textContent = this.python(places);
    this.showFiles(places);
    this.showEverything(places);
    return this.draw();
  }

  draw() {
    return Promise.all([this.showCurve(), this.showSize(), this.showMap(), this.shape.show(this.places)]);
  }

  value(name, places = this.places) {
    const field = this.root.fields[name];
    return field ? field.of(places) : undefined;
  }

  fact(name, places) {
    const field = this.root.fields[name];
    if (!field) return null;
    const value = field.of(places);
    if (value === "" || Number.isNaN(value)) return null;
    const unit = unitOf(field)[1];
    return written(field, value, 5) + (unit && !field.flags && !isFile(field, value) ? ` ${unit}` : "");
  }

  // The error of the printed displacements; errors themselves are printed without sign.
  printed(places) {
    const reference = this.value("paper_reference_displacement", places);
    const error = (this.value("paper_displacement", places) - reference) / Math.abs(reference);
    return Number.isFinite(error) ? [`${signed(100 * error, 3)} %`, signWord(error, reference)] : [];
  }

  showFacts(places) {
    const status = this.status.meaning(this.status.of(places));
    const rows = [];
    const say = (title, ...found) => {
      if (found[0]) rows.push(element("div", {}, element("dt", { text: title }), element("dd", { text: found.filter(Boolean).join(", ") })));
    };
    const add = (title, name, ...more) => say(title, this.fact(name, places), ...more);
    add("deformation error", SCENE_ERROR, this.sign(places));
    add("network", "displacement");
    add("reference", "reference_displacement");
    add("printed error", "paper_deformation_error", "printed without sign");
    say("error of printed displacements", ...this.printed(places));
    add("uniform stiffness", "stiffness");
    add("force", "force");
    add("particles", "particles");
    add("residual", "residual");
    add("seconds", "solve_seconds");
    const words = [["", "message"], ["reference: ", "reference_message"], ["print: ", "paper_remark"]]
      .map(([what, name]) => [what, this.value(name, places)]).filter(([, text]) => text)
      .filter(([, text], i, all) => all.findIndex((one) => one[1] === text) === i).map(([what, text]) => ` · ${what}${text}`);
    this.facts.replaceChildren(element("p", {}, badge(status), words.join("")),
      element("dl", { class: "facts" }, rows));
  }

  // What the sign of an error of a cell means: of its own, or of one that is given.
  sign(places = this.places, error = this.value(SCENE_ERROR, places)) {
    return signWord(error, this.value("reference_displacement", places));
  }

  // What is written under the errors of the chosen cell's parameters.
  signNote() {
    const reference = this.value("reference_displacement"), sentence = signSentence([["", reference]]);
    const beyond = this.status.meaning(this.status.of(this.places)) === "beyond_linear";
    return [sentence, beyond && "the linear reference does not apply to this cell"].filter(Boolean);
  }

  async showCurve() {
    const group = this.has.curve;
    if (!group) return;
    await group.load();
    const places = this.inGroup(group), chart = this.charts.curve;
    const error = group.fields[SCENE_ERROR], status = group.fields.status, stiffness = group.fields.stiffness;
    if (!places || !error || !stiffness) return chart.say(group.left_out.length ? LEFT_OUT : "This dataset has no curve of this cell.");
    const x = stiffness.along("stiffness_ratio", places), y = error.along("stiffness_ratio", places);
    if (!y.some(Number.isFinite)) {
      const why = group.fields.message?.of(places);
      this.parts["curve-under"].replaceChildren();
      return chart.say(why ? `There is no curve: ${why}` : "The study asks for no sensitivity curve of this mesh, material, load and kinematics.");
    }
    const [unit, scale] = stiffnessUnit(x);
    const marks = this.stiffnesses(group, places).map((one) => ({ ...one, x: one.value / scale }));
    const words = status?.flags ? status.along("stiffness_ratio", places).map((one) => status.meaning(one)) : [];
    const hollow = words.map((one) => one !== "solved");
    const limits = window_(x.map((one) => one / scale), y.map((one) => 100 * one), marks.map((one) => one.x));
    await chart.show({
      series: [{
        name: "error of the network", x: x.map((one) => one / scale), y: y.map((one) => 100 * one), hollow, words,
        tips: y.map((one, i) => `${signed(100 * one, 4)} % ${this.sign(this.places, one)} at ${number(x[i], 4)} N/m, ${spoken(words[i] || "")}`), size: 5,
      }],
      marks, xlabel: `uniform stiffness [${unit}]`, ylabel: "deformation error [%]", zero: true, window: limits,
    });
    const list = marks.map((one) => element("li", {}, element("b", { text: one.name }), ` ${number(one.value, 4)} N/m`));
    this.parts["curve-under"].replaceChildren(element("ul", { class: "legend" }, list,
      [...hollowWords([{ y, hollow, words }]), ...this.signNote()].map((text) => element("li", { text }))));
  }

  // Stiffnesses to mark on a curve; those that say the same number share a mark.
  stiffnesses(group, places) {
    const found = [];
    const add = (name, value) => {
      if (!Number.isFinite(value) || !(value > 0)) return;
      const same = found.find((one) => Math.abs(one.value / value - 1) < 2e-4);
      if (!same) found.push({ name, value });
      else if (!same.name.split(" = ").includes(name)) same.name += ` = ${name}`;
    };
    add("printed", this.value("paper_stiffness"));
    add("best", group.fields.best_stiffness?.of(places));
    add("predicted", group.fields.predicted_stiffness?.of(places));
    const field = this.root.fields.stiffness;
    if (field?.dims.includes("definition")) {
      const dim = this.root.dims.definition;
      field.along("definition", this.places).forEach((value, i) => add(labelText(dim, i), value));
    }
    return found;
  }

  // Places of the chosen cell in a group, by label; nothing where the group has not that label.
  inGroup(group) {
    const places = {};
    for (const name of this.dims) {
      if (!(name in group.dims)) continue;
      places[name] = group.place(name, this.root.label(name, this.places[name]));
      if (places[name] < 0) return null;
    }
    return places;
  }

  async showSize() {
    const field = this.has.error;
    if (!this.parts.size || !field) return;
    const dim = this.root.dims.mesh_size, by = this.dims.includes("definition") ? "definition" : null;
    const sizes = Array.from({ length: dim.size }, (_, i) => this.root.label("mesh_size", i) * 1e3);
    const series = [];
    for (let i = 0; i < (by ? this.root.dims[by].size : 1); i++) {
      const places = by ? { ...this.places, [by]: i } : this.places;
      const y = field.along("mesh_size", places).map((one) => 100 * one);
      if (!y.some(Number.isFinite)) continue;
      const words = this.status.along("mesh_size", places).map((one) => this.status.meaning(one));
      series.push({
        name: by ? labelText(this.root.dims[by], i) : "error", x: sizes, y, hollow: words.map((one) => one !== "solved"), words,
        tips: y.map((one, j) => `${signed(one, 4)} % ${this.sign(this.places, one)} at ${number(sizes[j])} mm, ${spoken(words[j])}`),
        look: look(i), chosen: !by || i === this.places[by] ? this.places.mesh_size : -1,
        width: !by || i === this.places[by] ? 3 : 1.5,
      });
    }
    const under = this.parts["size-under"];
    if (!series.length) {
      under.replaceChildren();
      return this.charts.size.say("No cell of these parameters has an error.");
    }
    await this.charts.size.show({
      series, xlabel: "mesh size [mm]", ylabel: "deformation error [%]", zero: true, logx: sizes.length > 1, xticks: sizes,
    });
    under.replaceChildren(legend(series, [...hollowWords(series), ...this.signNote()]));
  }

  async showMap() {
    if (!this.parts.map) return;
    const field = this.root.fields[this.mapChoice.value], { x, y } = this.mapChoice;
    const root = this.root, columns = root.dims[x], rows = root.dims[y];
    const there = (i, j) => {
      const places = { ...this.places, [x]: i, [y]: j };
      return this.status.meaning(this.status.of(places)) !== "not_requested" || (i === this.places[x] && j === this.places[y]);
    };
    const [across, down, without] = filled(columns, rows, there);
    const values = [], cells = [];
    down.forEach((j, row) => across.forEach((i, column) => {
      const places = { ...this.places, [x]: i, [y]: j };
      const value = field.of(places), status = this.status.meaning(this.status.of(places));
      values.push(value);
      cells.push({ row, column, places, value, status });
    }));
    const signs = Object.keys(SIGNS).filter((word) => !["solved", "not_requested"].includes(word) && cells.some((cell) => cell.status === word))
      .map((word) => `${SIGNS[word]} ${spoken(word)}`);
    const words = [cells.some((cell) => cell.status === "not_requested") && "hatched: not requested", ...signs,
      root.sign(field, this.places, [x, y]), "click a tile to choose it", without];
    const key = element("span", { class: "soft", text: words.filter(Boolean).join(" · ") });
    const colours = field.flags ? null : colouring(field, values, key), [scale, unit] = unitOf(field);
    for (const cell of cells) {
      const { value, status } = cell;
      cell.tip = `${spoken(status)}${Number.isFinite(value) && !field.flags ? `, ${written(field, value, 4)} ${unit}` : ""}`;
      if (field.flags) Object.assign(cell, category(field, value));
      else if (!Number.isFinite(value)) {
        cell.missing = status === "not_requested";
        cell.colour = cell.missing ? "#8883" : ink("band");
        cell.text = cell.missing ? "" : status === "solved" ? "no value" : SIGNS[status];
        cell.ink = ink("ink");
      } else {
        const rgb = colours.of(value);
        cell.colour = css(rgb);
        cell.ink = readableOn(rgb);
        cell.text = written(field, value, 2) + (status === "solved" ? "" : ` ${SIGNS[status]}`);
      }
    }
    const chosen = { row: down.indexOf(this.places[y]), column: across.indexOf(this.places[x]) };
    await this.charts.map.show({
      cells, columns: across.map((i) => labelText(columns, i)), rows: down.map((j) => labelText(rows, j)),
      xlabel: titled({ ...columns, name: x }), ylabel: titled({ ...rows, name: y }),
      pick: (cell) => this.page.choose(cell.places), chosen: chosen.row >= 0 && chosen.column >= 0 ? chosen : null,
    });
    this.parts["map-under"].replaceChildren(field.flags ? categories(field, key) : colours.key);
  }

  python(places) {
    const root = this.root, study = String(root.attributes.study);
    const named = /^[\w-][\w.-]{0,59}$/.test(study) ? study : "study";  // of a stranger's dataset it may be any path
    const labels = (dims) => dims.map((name) => `    ${literal(name)}: ${literal(root.label(name, places[name]))},`);
    const lines = [
      "import xarray as xr", "",
      `tree = xr.open_datatree(${literal(`results/${named}/dataset.nc`)}, engine="h5netcdf")`,
      "cell = tree.to_dataset().sel({", ...labels(this.dims), "})",
    ];
    if (this.has.error) lines.push(`print(float(cell.${SCENE_ERROR}))`);
    if (this.has.curve && this.inGroup(this.has.curve)) {
      const curve = this.dims.filter((name) => name in this.has.curve.dims);
      lines.push("", "curve = tree[\"sensitivity\"].to_dataset().sel({", ...labels(curve), "})");
    }
    return lines.join("\n") + "\n";
  }

  showFiles(places) {
    const labels = this.dims.map((name) => [name, `_${this.root.label(name, places[name])}_`]);
    const others = this.dims.map((name) => (this.root.dims[name].labels || []).filter((one) => typeof one === "string").map((one) => `_${one}_`));
    const figures = this.page.files.filter((path) => /^figures\/.*\.(png|svg)$/.test(path));
    const fits = figures.filter((path) => {
      const stem = `_${path.slice("figures/".length).replace(/\.\w+$/, "")}_`;
      return labels.every(([, mine], i) => stem.includes(mine) || !others[i].some((one) => one !== mine && stem.includes(one)))
        && labels.some(([, mine]) => stem.includes(mine));
    });
    const links = fits.map((path) => element("li", {}, element("a", { href: path, text: path.slice("figures/".length) })));
    this.files.replaceChildren(element("ul", { class: "links" },
      element("li", {}, element("a", { href: "dataset.nc", text: "dataset.nc" }), " (all of this study)"), links));
  }

  showEverything(places) {
    const rows = Object.values(this.root.fields).filter((field) => field.dims.every((one) => this.dims.includes(one)))
      .map((field) => [field, this.fact(field.name, places)]).filter(([, text]) => text !== null)
      .map(([field, text]) => element("tr", {}, element("th", { scope: "row", text: field.name }),
        element("td", { text }), element("td", { class: "soft", text: field.long_name || "" })));
    const details = element("details", { open: this.everything.querySelector("details")?.open },
      element("summary", { text: `${rows.length} variables` }), element("div", { class: "wide" }, element("table", { class: "plain" }, element("tbody", {}, rows))));
    this.everything.replaceChildren(details);
  }
}

// In Python, on one line of characters that are seen.
function literal(value) {
  if (typeof value !== "string") return value === null ? "float(\"nan\")" : String(value);
  return JSON.stringify(value).replace(/(?! )[\p{C}\p{Z}]/gu, (one) => `\\U${one.codePointAt(0).toString(16).padStart(8, "0")}`);
}

function stiffnessUnit(values) {
  const largest = Math.max(...values.filter(Number.isFinite));
  const power = Math.floor(Math.log10(largest) / 3) * 3;
  return power ? [`${ten(power)} N/m`, 10 ** power] : ["N/m", 1];
}

// What of a curve is shown first: around the marks, errors that can be told apart. No limit goes through a point.
function window_(x, y, marks) {
  const good = x.map((_, i) => i).filter((i) => Number.isFinite(y[i])), least = Math.min(...marks), most = Math.max(...marks);
  const near = good.filter((i) => !marks.length || x[i] >= 0.6 * least && x[i] <= 1.7 * most);
  const legible = near.filter((i) => Math.abs(y[i]) <= 60), seen = [legible, near, good].find((one) => one.length);
  const low = Math.min(...seen.map((i) => x[i])), high = Math.max(...seen.map((i) => x[i]));
  const side = 0.03 * (Math.max(high, most) - Math.min(low, least) || high);
  const before = Math.max(...good.map((i) => x[i]).filter((one) => one < low)), after = Math.min(...good.map((i) => x[i]).filter((one) => one > high));
  const left = Math.min(Math.max(low - side, (low + before) / 2), least - side);
  const right = Math.max(Math.min(high + side, (high + after) / 2), most + side);
  const inside = good.filter((i) => x[i] >= left && x[i] <= right).map((i) => y[i]);
  const bottom = Math.min(...inside, 0), top = Math.max(...inside, 0), room = 0.08 * (top - bottom || 1);
  return { x: [left, right], y: [bottom - room, top + 4 * room] };
}

function category(field, value) {
  const meaning = field.meaning(value), place = Object.keys(field.flags).indexOf(String(value));
  const colours = {
    solved: "#009e73", beyond_linear: "#f0e442", linear_only: "#56b4e9", not_converged: "#e69f00", unstable: "#cc79a7", failed: "#d55e00",
  };
  const missing = place < 0 || meaning === "not_requested";
  return {
    missing, colour: missing ? "#8883" : colours[meaning] || CATEGORIES[place % CATEGORIES.length], ink: "#111",
    sign: meaning in SIGNS, text: missing ? "" : SIGNS[meaning] || meaning.slice(0, 2), tip: meaning ? spoken(meaning) : "nothing",
  };
}

function categories(field, extra) {
  return element("p", { class: "scale" }, Object.keys(field.flags).map((value) => {
    const one = category(field, Number(value));
    return element("span", { class: "swatch" }, element("i", { class: one.missing ? "missing" : "", style: one.missing ? "" : `background:${one.colour}` }),
      `${one.text && one.sign ? `${one.text} ` : ""}${spoken(field.meaning(Number(value)))}`);
  }), extra);
}

function widest(words) {
  return Math.max(...words.split(" ").map((one) => one.length));
}

// Most letters of a number of a field, as the table writes it.
function longest(field) {
  const scale = unitOf(field)[0];
  let least = Infinity, most = 0, negative = isSigned(field);
  for (const value of field.unpacked()) {
    const size = Math.abs(value);
    if (size > 0 && size < least) least = size;
    if (size > most && size < Infinity) most = size;
    negative ||= value < 0;
  }
  const length = (value) => (value > 0 && value < Infinity ? number(1.111 * 10 ** Math.floor(Math.log10(value * scale))).length : 1);
  return Math.max(length(least), length(most)) + Number(negative);
}
