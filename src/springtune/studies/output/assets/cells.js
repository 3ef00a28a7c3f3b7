// The view of cells: their table, and for the chosen cell its facts, charts and code.

const SCENE_ERROR = "deformation_error";

class Cells {
  constructor(page, { columns }) {
    const root = page.groups["/"], { fields: all, status } = root;
    Object.assign(this, { page, root, status, fields: all, dims: status.dims, title: "Scenes" });
    const names = columns.length ? columns : ["status", ...Object.keys(all).filter((name) => name !== "status")];
    this.names = names.filter((name) => all[name]?.within(this.dims) && !all[name].isEmpty);
    this.varying = this.dims.filter((name) => this.root.dims[name].size > 1);
  }

  async build(holder) {
    this.curves = await this.page.groups["/sensitivity"]?.load();
    this.networks = await this.page.groups["/fields"]?.load();
    const counter = element("span", { class: "soft", role: "status", "aria-live": "polite" });
    const reset = element("button", { type: "button", class: "copy", id: "reset", text: "Reset filters", onclick: () => this.table.reset() });
    const all = element("button", { type: "button", class: "copy", id: "columns", text: "All columns", onclick: () => {
      all.textContent = this.table.holder.classList.toggle("few") ? "All columns" : "Few columns";
      this.table.draw(true);
    } });
    const word = (row) => this.status.meaning(this.status.values[row]), rows = upTo(this.status.size).filter((row) => word(row) !== "not_requested");
    this.table = new Table({
      columns: this.columns(), rows, label: "Scenes of the study", kind: word, choose: (row) => this.page.choose(this.status.placesOf(row)),
      changed: (count, wrong) => {
        counter.textContent = [`${count} of ${rows.length} scenes shown.`, ...wrong].join(" ");
        reset.disabled = !Object.values(this.table?.filters || {}).some(Boolean);
      },
    });
    const constant = this.dims.filter((name) => !this.varying.includes(name)).map((name) => labelWithUnit(this.root.dims[name], 0)).join(" · ");
    const sign = this.fields[SCENE_ERROR]?.isEmpty === false && this.fields[SCENE_ERROR].sign;
    this.side = element("div", { class: "chosen-cell" });
    holder.append(element("div", { class: "cells" }, element("div", { class: "list" },
      element("div", { class: "row soft small" }, reset, all, counter, constant && `All scenes: ${constant}.`), this.table.holder,
      element("p", { class: "soft small" }, "Click a row, or use the arrow keys in the table. Click a head to sort.",
        sign ? ` Deformation error, (network − reference) / |reference|: ${sign}.` : "")),
    this.side));
    this.buildSide();
  }

  columns() {
    const { root, status, fields: all } = this, state = (row) => status.meaning(status.values[row]);
    const widest = (text) => Math.max(...text.split(" ").map((one) => one.length)) + 2;
    const dims = this.varying.map((name) => {
      const dim = root.dims[name], labels = upTo(dim.size).map((i) => labelText(dim, i));
      const title = titled({ ...dim, name }), place = (row) => status.placesOf(row)[name];
      return { name, title, hint: dim.long_name, labels, numeric: typeof dim.labels?.[0] === "number", value: place, text: (row) => labels[place(row)],
        width: Math.min(24, Math.max(7, widest(spoken(name)), ...labels.map((one) => one.length + 2))) };
    });
    const words = root.tally().map((one) => spoken(one[0]));
    const more = this.names.map((name) => {
      const field = all[name], scale = unitOf(field)[0], of = (row) => field.of(status.placesOf(row));
      if (name === "status") return { name, title: "status", narrow: true, labels: words, value: of, text: (row) => spoken(state(row)),
        node: (row) => badge(state(row)), width: Math.max(...words.map((one) => one.length)) + 6 };
      return { name, title: titled(field), hint: field.long_name, numeric: !field.isText && !field.flags, pinned: name === SCENE_ERROR, more: name !== SCENE_ERROR,
        width: field.isText ? 34 : Math.max(13, widest(titled(field))), text: (row) => written(field, of(row)),
        value: (row) => (field.isText ? of(row) : of(row) * scale), size: field.error ? (row) => Math.abs(of(row)) : undefined };
    });
    return [...dims, ...more];
  }

  buildSide() {
    const { root, curves } = this, error = this.fields[SCENE_ERROR], choose = (places) => this.page.choose(places);
    this.heading = element("h2", { "aria-live": "polite" });
    this.selectors = element("div", { class: "row" });
    this.facts = element("div");
    this.code = element("pre", { class: "code", tabindex: "0", role: "region", "aria-label": "Python code of this scene" });
    const plot = (value, x, more = {}) => ({ value, x, by: "", shows: "lines", log: "", beside: [], along: "", ...more });
    const by = "definition" in root.dims ? "definition" : "";
    this.plots = { map: new Plot(root, this.page.declared["/"]?.plots || [], { choose }) };
    if (curves) this.plots.curve = new Plot(curves, [plot(SCENE_ERROR, "stiffness", { along: "stiffness_ratio" })],
      { bare: true, choose, limit: 60, marks: () => this.stiffnesses() });
    if (error && this.varying.includes("mesh_size"))
      this.plots.size = new Plot(root, [plot(SCENE_ERROR, "mesh_size", { by, log: "x" })], { bare: true, choose });
    const titles = { curve: "Sensitivity: error against uniform stiffness, to 60 %", size: "Error against mesh size", map: "Scenes compared" };
    this.network = Network.drawnFrom(this.networks) ? new Network(this.networks) : null;
    const none = this.networks?.left_out.length ? LEFT_OUT : "This dataset has no displacement fields: the study does not ask for the output 'deformed'.";
    this.side.append(this.heading, this.selectors, this.facts,
      ...Object.keys(titles).filter((name) => this.plots[name]).map((name) => panel(name, titles[name], this.plots[name].holder)),
      panel("shape", "The network over its reference", this.network ? this.network.holder : element("p", { class: "none", text: none })),
      panel("code", "This scene in Python", this.code));
  }

  // Show a cell; called for every change of the selection.
  show(places) {
    const { root } = this;
    this.places = places;
    this.table.mark(this.status.flat(places));
    this.heading.textContent = this.varying.map((name) => labelWithUnit(root.dims[name], places[name])).join(" · ");
    this.selectors.replaceChildren(...selectors(root, this.varying, places, (one) => this.page.choose(one)));
    this.showFacts();
    this.code.textContent = this.python();
    return this.draw();
  }

  draw() {
    return Promise.all([...Object.values(this.plots).map((plot) => this.drawPlot(plot)), this.showNetwork()]);
  }

  drawPlot(plot) {
    const places = plot.group.placesFrom(this.root, this.places), left = plot.group.left_out.length;
    if (!places || !plot.plot) return plot.chart.say(left ? LEFT_OUT : "This dataset has nothing of this scene.");
    plot.chosen = places;
    return plot.render();
  }

  value(name) {
    return this.fields[name]?.of(this.places);
  }

  // A variable of the chosen cell as text with its unit; nothing where it has none.
  fact(name) {
    const field = this.fields[name], value = this.value(name);
    return !field || absent(value) ? "" : withUnit(field, value, written(field, value, 5));
  }

  showFacts() {
    const reference = this.value("reference_displacement"), rows = [];
    const say = (title, ...found) => {
      const text = found.filter(Boolean).join(", ");
      if (found[0]) rows.push(element("div", {}, element("dt", { text: title }), element("dd", { text })));
    };
    for (const name of this.names.filter((one) => !this.fields[one].isText && one !== "status"))
      say(spoken(name), this.fact(name), name === SCENE_ERROR && signWord(this.value(name), reference),
        name === "paper_deformation_error" && "printed without sign");
    // The error of the printed displacements has a sign; errors themselves are printed without.
    const printed = this.value("paper_reference_displacement"), error = (this.value("paper_displacement") - printed) / Math.abs(printed);
    if (Number.isFinite(error)) say("error of printed displacements", `${error > 0 ? "+" : ""}${number(100 * error, 3)} %`, signWord(error, printed));
    const messages = new Set(["message", "reference_message", "paper_remark"].map((name) => this.value(name)).filter(Boolean));
    this.facts.replaceChildren(element("p", {}, badge(this.status.meaning(this.value("status"))), ...[...messages].map((text) => ` · ${text}`)),
      element("dl", { class: "facts" }, rows));
  }

  // Stiffnesses to mark on the curve.
  stiffnesses() {
    const { best_stiffness: best, predicted_stiffness: predicted } = this.curves.fields, at = this.plots.curve.chosen;
    const found = { printed: this.value("paper_stiffness"), best: best?.of(at), predicted: predicted?.of(at) };
    return Object.entries(found).filter((one) => one[1] > 0).map(([name, x]) => ({ name: `${name}: ${number(x)} N/m${name === "predicted" ? ", by a formula" : ""}`, x }));
  }

  // Of what a study sweeps, and of meshes, fields are kept of one: offer the cell with fields that differs in fewest labels.
  showNetwork() {
    const { network, root, networks: group, places } = this;
    if (!network) return undefined;
    const kept = { ...places }, moved = group.fields.displacement_x, at = group.placesFrom(root, places);
    for (const name of this.dims) {
      const shown = at ? group.fields[`shown_${name}`]?.of(at) : NaN;
      if (Number.isFinite(shown)) kept[name] = root.dims[name].labels.findIndex((one) => Math.abs(one - shown) <= 1e-4 * Math.abs(one));
    }
    const sizes = "mesh_size" in group.dims ? upTo(group.dims.mesh_size.size) : [];
    const size = at && !network.has(at) ? sizes.find((i) => Number.isFinite(moved.of({ ...at, mesh_size: i }))) : undefined;
    if (size !== undefined) kept.mesh_size = root.place("mesh_size", group.label("mesh_size", size));
    const others = this.dims.filter((name) => kept[name] >= 0 && kept[name] !== places[name]);
    if (!others.length) return at && network.has(at) ? network.show(at) : network.say("There are no displacement fields of this scene.");
    const labels = others.map((name) => labelWithUnit(root.dims[name], kept[name])).join(", ");
    return network.say(`Displacement fields are kept of ${others.map(spoken).join(", ")} ${labels}.`,
      element("button", { type: "button", text: `Show ${labels}`, onclick: () => this.page.choose(kept) }));
  }

  python() {
    const { root, places, curves } = this, { study } = root.attributes;
    const labels = (group) => this.dims.filter((name) => name in group.dims).map((name) => `    ${literal(name)}: ${literal(root.label(name, places[name]))},`);
    const lines = ["import xarray as xr", "", `tree = xr.open_datatree(${literal(`results/${study}/dataset.nc`)}, engine="h5netcdf")`,
      "scene = tree.to_dataset().sel({", ...labels(root), "})"];
    if (this.fields[SCENE_ERROR]) lines.push(`print(float(scene.${SCENE_ERROR}))`);
    if (curves?.placesFrom(root, places)) lines.push("", "curve = tree[\"sensitivity\"].to_dataset().sel({", ...labels(curves), "})");
    return `${lines.join("\n")}\n`;
  }
}

// In Python, on one line of characters that are seen.
function literal(value) {
  if (typeof value !== "string") return value === null ? "float(\"nan\")" : String(value);
  return JSON.stringify(value).replace(/(?! )[\p{C}\p{Z}]/gu, (one) => `\\U${one.codePointAt(0).toString(16).padStart(8, "0")}`);
}
