// The page: its head, its views, and the selection that they share with the address.

// A view of any group: its networks, a plot of its variables, and what it holds.
class Explorer {
  constructor(page, group, view) {
    Object.assign(this, { page, group, view, title: view.title });
  }

  async build(holder) {
    const { group, view } = this, { fields: all, dims } = (await group.load()), left = group.left_out;
    this.plot = new Plot(group, view.plots, { height: 400 });
    const held = Object.values(all).map((field) => [field.name, field.long_name || "",
      field.dims.length ? unitOf(field)[1] : withUnit(field, field.values[0], written(field, field.values[0], 5)),
      element("span", { class: "soft", text: field.dims.map((name) => `${name} ${dims[name].size}`).join(", ") })]);
    const notes = Object.entries(group.path === "/" ? {} : group.attributes);
    const summary = element("summary", { text: `${held.length} variables over ${Object.keys(dims).length} dimensions` });
    holder.append(element("h2", { text: view.title }), element("p", { text: view.note || "" }),
      left.length ? element("p", { class: "none", text: `Too large for this page, and in dataset.nc only: ${left.join(", ")}.` }) : "",
      ...(Network.drawnFrom(group) && group.path !== "/fields" ? [this.drawn()] : []), panel("plot", "Plot", this.plot.holder),
      panel("holds", "What the group holds", element("details", { open: held.length <= 12 }, summary,
        notes.map(([name, value]) => element("p", { class: "small", text: `${spoken(name)}: ${value}` })), plainTable(held))));
  }

  // Networks that no cell of the table has, such as those of shapes.
  drawn() {
    const network = this.network = new Network(this.group), moved = this.group.fields.displacement_x;
    const names = moved.dims.slice(0, -1), first = names[0], choices = element("div", { class: "row" });
    // Of the networks there are, take the one that has most of the labels, the first above all.
    const change = (places) => {
      const stride = moved.strides[names.at(-1)], there = upTo(moved.size / stride).map((row) => moved.placesOf(row * stride));
      const like = (one) => names.filter((name) => one[name] === places[name]).length + names.length * (one[first] === places[first]);
      this.places = there.filter((one) => network.has(one)).reduce((a, b) => (like(b) > like(a) ? b : a), places);
      choices.replaceChildren(...selectors(this.group, names, this.places, change));
      if (choices.isConnected) this.moved = network.show(this.places);
    };
    change({});
    return panel("network", "The network over its reference", choices, network.holder);
  }

  show() {
    return Promise.all([this.plot.render(), this.network?.show(this.places)]);
  }
}

class Page {
  constructor(content) {
    Object.assign(this, content);
    this.groups = Object.fromEntries(content.groups.map((row) => [row.path, new Group(row)]));
  }

  async start() {
    const root = await this.groups["/"].load(), others = Object.values(this.groups).filter((group) => group !== root);
    this.counted = others.filter((group) => group.status && group.path !== "/sensitivity");
    for (const group of this.counted) await group.load();
    const [overview, study] = ["overview", "study"].map((name) => document.getElementById(name));
    this.views = overview ? { overview: { title: "Overview", holder: overview } } : {};
    const declared = (group, name) => ({ note: "", plots: [], columns: [], ...(this.declared[group.path] || { title: spoken(name) }) });
    if (root.tally().length) this.views.cells = new Cells(this, declared(root, "cells"));
    else if (Object.keys(root.fields).length && !root.fields.status) this.views.cells = new Explorer(this, root, declared(root, "cells"));
    for (const group of others) this.views[group.path.slice(1)] = new Explorer(this, group, declared(group, group.path.slice(1)));
    this.views.study = { title: "Study", holder: study };
    this.head(root);
    document.getElementById("tabs").append(...Object.entries(this.views).map(([name, view]) => element("a", { href: `#view=${name}`, text: view.title })));
    addEventListener("hashchange", () => this.follow());
    dark.addEventListener("change", () => this.views[this.opened].show?.(this.places));
    await this.follow();
  }

  head(root) {
    const put = (id, ...children) => document.getElementById(id).append(...children.flat());
    const count = ([word, number_]) => element("span", { class: "count" }, badge(word, number_)), all = root.tally().reduce((sum, one) => sum + one[1], 0);
    if (all) put("end", element("b", { text: all === 1 ? "1 scene:" : `${all} scenes:` }), root.tally().map(count),
      root.notRequested ? element("span", { class: "soft", text: `${root.notRequested} not requested` }) : "");
    for (const group of this.counted.filter((one) => one.tally().length)) {
      const name = group.path.slice(1);
      put("holds", element("span", { class: "holds" }, element("a", { href: `#view=${name}`, text: this.views[name].title }), ": ", group.tally().map(count)));
    }
  }

  // What the address says: a view, and for each dimension of the root a label.
  async follow() {
    const wanted = new URLSearchParams(location.hash.slice(1)), names = Object.keys(this.views), root = this.groups["/"];
    const places = {};
    for (const name of root.status?.dims || []) {
      const place = upTo(root.dims[name].size).findIndex((i) => String(root.label(name, i)) === wanted.get(name));
      if (place >= 0) places[name] = place;
    }
    if (root.tally().length) this.places = { ...(this.places || this.firstPlaces(root)), ...places };
    await this.open(names.includes(wanted.get("view")) ? wanted.get("view") : Object.keys(places).length ? "cells" : names[0]);
  }

  firstPlaces({ status }) {
    const row = (test) => status.values.findIndex((one) => test(status.meaning(one)));
    const solved = row((word) => word === "solved");
    return status.placesOf(solved >= 0 ? solved : row((word) => word !== "not_requested"));
  }

  async open(name) {
    const view = this.views[name], fresh = !view.holder;
    this.opened = name;
    for (const link of document.getElementById("tabs").children) {
      if (link.hash === `#view=${name}`) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    view.holder ||= element("div", { class: `view view-${name}` });
    document.getElementById("view").replaceChildren(view.holder);
    if (fresh) await view.build(view.holder);
    await view.show?.(this.places);
  }

  choose(places) {
    const root = this.groups["/"], named = Object.keys(places).filter((name) => root.dims[name].size > 1);
    const address = new URLSearchParams(named.map((name) => [name, String(root.label(name, places[name]))]));
    history.replaceState(null, "", `#${address || "view=cells"}`);
    this.places = places;
    return this.views.cells.show(places);
  }
}

async function main() {
  window.springtune = new Page(await inflated(document.getElementById("content").textContent).json());
  await window.springtune.start();
  document.documentElement.dataset.ready = "yes";
}

main().catch((error) => {
  document.getElementById("view").textContent = `The page cannot be shown: ${error.message}`;
  throw error;
});
