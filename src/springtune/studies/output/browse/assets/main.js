// The page: its head, its views, and the selection that they share with the address.

const MANY = 100; // times as many cells: their view is the first

// How many cells a study asked for.
function asked(tally) {
  return Object.entries(tally || {}).reduce((sum, [word, count]) => sum + (word === "not_requested" ? 0 : count), 0);
}

class Page {
  constructor(content) {
    Object.assign(this, content);
    this.groups = Object.fromEntries(content.groups.map((row, i) => [row.path, new Group(row, i)]));
    this.charts = {};
  }

  async start() {
    const root = await this.groups["/"].load();
    this.counted = Object.values(this.groups).filter((group) => group !== root && group.path !== "/sensitivity" && group.fields.status);
    for (const group of this.counted) await group.load();
    this.tally = asked(root.tally()) ? root.tally() : null;
    this.head(root);
    this.views = {};
    if (this.tally) this.views.cells = new Cells(this, this.declared["/"] || { columns: [] });
    if (Object.keys(root.fields).length && (this.tally || !root.fields.status))
      this.views.compare = new Explorer(this, root, { ...(this.declared["/"] || { note: "", plots: [] }), title: "Compare" });
    for (const [path, group] of Object.entries(this.groups)) {
      if (path === "/") continue;
      const declared = this.declared[path] || { note: "", plots: [] };
      this.views[path.slice(1)] = new Explorer(this, group, { ...declared, title: declared.title || spoken(path.slice(1)) });
    }
    this.views.study = new About(this);
    this.tabs();
    addEventListener("hashchange", () => this.follow());
    await this.follow();
  }

  // A group's cells by status, and what it counts first: "8 shapes".
  holds(group) {
    const tally = group.tally(), all = asked(tally);
    if (!all) return null;
    const first = group.fields.status.dims.find((name) => group.dims[name].size > 1), title = this.declared[group.path]?.title || spoken(group.path.slice(1));
    const several = first && counted(group.labelsInUse(first), spoken(first));
    const badges = Object.entries(tally).filter(([word, count]) => count && word !== "not_requested")
      .map(([word, count]) => element("span", { class: "count" }, badge(word), ` ${count}`));
    return element("span", { class: "holds" }, element("a", { href: `#view=${group.path.slice(1)}`, text: title }),
      several ? `: ${several} ` : ": ", badges);
  }

  head(root) {
    const about = root.attributes;
    const words = [about.study, about.springtune_version && `springtune ${about.springtune_version}`,
      about.git_commit && `commit ${about.git_commit.slice(0, 10)}`, about.created && about.created.slice(0, 10)].filter(Boolean);
    document.getElementById("facts").textContent = words.join(" · ");
    const end = document.getElementById("end");
    if (this.tally) {
      const all = asked(this.tally);
      end.append(element("span", {}, element("b", { text: String(all) }), all === 1 ? " cell: " : " cells: "),
        ...Object.entries(this.tally).filter(([word, count]) => count && word !== "not_requested")
          .map(([word, count]) => element("span", { class: "count" }, badge(word), ` ${count}`)),
        this.tally.not_requested ? element("span", { class: "soft", text: `${this.tally.not_requested} not requested` }) : "");
      this.errors(root, end);
    }
    document.getElementById("holds").append(...this.counted.map((group) => this.holds(group)).filter(Boolean));
    const links = document.getElementById("links");
    const named = [["dataset.nc", "dataset.nc"], ["tables/index.html", "tables"], ["paper.pdf", "paper.pdf"], ["report.zip", "report"]];
    for (const [path, text] of named)
      if (path === "dataset.nc" || this.files.includes(path)) links.append(element("a", { href: path, text }));
    for (const [view, text] of [["study", "config, provenance, figures"]]) links.append(element("a", { href: `#view=${view}`, text }));
  }

  errors(root, end) {
    const field = root.fields[SCENE_ERROR], status = root.fields.status;
    if (!field || field.dims.join() !== status.dims.join()) return;
    const values = field.unpacked(), sizes = [];
    let worst = -1;
    for (let i = 0; i < values.length; i++) {
      if (!Number.isFinite(values[i]) || status.meaning(status.valueAt(i)) !== "solved") continue;
      sizes.push(Math.abs(values[i]));
      if (worst < 0 || Math.abs(values[i]) > Math.abs(values[worst])) worst = i;
    }
    if (!sizes.length) return end.append(element("span", { class: "soft", text: this.tally.beyond_linear ? "no cell has an error that counts" : "no cell has an error" }));
    sizes.sort((a, b) => a - b);
    const middle = (sizes[(sizes.length - 1) >> 1] + sizes[sizes.length >> 1]) / 2;
    const places = Object.fromEntries(status.dims.map((name) => [name, Math.floor(worst / status.strides[name]) % root.dims[name].size]));
    const word = signWord(values[worst], root.fields.reference_displacement?.of(places));
    end.append(element("span", { text: `|error|${this.tally.beyond_linear ? " where the reference applies" : ""}: median ${number(100 * middle, 3)} %, ` },
      element("a", { href: this.address("cells", places), text: `largest ${number(100 * sizes.at(-1), 3)} %` }), word ? `, ${word}` : ""));
  }

  tabs() {
    const list = document.getElementById("tabs");
    this.buttons = Object.entries(this.views).map(([name, view]) => element("button", {
      type: "button", role: "tab", id: `tab-${name}`, "aria-controls": "view", text: view.title,
      onclick: () => this.open(name),
      onkeydown: (event) => {
        const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
        if (!step) return;
        const names = Object.keys(this.views), next = (names.indexOf(name) + step + names.length) % names.length;
        this.open(names[next]);
        this.buttons[next].focus();
      },
    }));
    list.append(...this.buttons);
  }

  // What the address says: a view, and for each dimension of the root a label.
  async follow() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    const names = Object.keys(this.views);
    const view = names.includes(wanted.get("view")) ? wanted.get("view") : [...wanted.keys()].length ? names[0] : this.first();
    if (this.views.cells) {
      const root = this.groups["/"], places = {};
      for (const name of root.fields.status.dims) {
        if (!wanted.has(name)) continue;
        const place = Array.from({ length: root.dims[name].size }, (_, i) => String(root.label(name, i))).indexOf(wanted.get(name));
        if (place >= 0) places[name] = place;
      }
      if (Object.keys(places).length) this.places = { ...(this.places || this.firstPlaces()), ...places };
    }
    await this.open(view, false);
  }

  // The view to begin with: that of cells, unless a few stand beside very many others.
  first() {
    const names = Object.keys(this.views), most = (name) => asked(this.counted.find((group) => group.path === `/${name}`)?.tally());
    const largest = names.reduce((one, other) => (most(other) > most(one) ? other : one), names[0]);
    return asked(this.tally) * MANY < most(largest) ? largest : names[0];
  }

  firstPlaces() {
    const root = this.groups["/"], status = root.fields.status, values = status.unpacked();
    const solved = values.findIndex((one) => status.meaning(one) === "solved");
    const row = solved >= 0 ? solved : Math.max(0, values.findIndex((one) => status.meaning(one) !== "not_requested"));
    return Object.fromEntries(status.dims.map((name) => [name, Math.floor(row / status.strides[name]) % root.dims[name].size]));
  }

  address(view, places) {
    const root = this.groups["/"], found = new URLSearchParams();
    if (view !== "cells") found.set("view", view);
    if (view === "cells" && places)
      for (const name of Object.keys(places)) if (root.dims[name].size > 1) found.set(name, String(root.label(name, places[name])));
    return `#${String(found) || "view=cells"}`;
  }

  async open(name, remember = true) {
    const view = this.views[name], holder = document.getElementById("view");
    this.opened = name;
    Object.keys(this.views).forEach((one, i) => {
      this.buttons[i].setAttribute("aria-selected", String(one === name));
      this.buttons[i].tabIndex = one === name ? 0 : -1;
      if (one === name) this.buttons[i].scrollIntoView({ block: "nearest", inline: "nearest" });
    });
    this.holders ||= {};
    const fresh = !this.holders[name];
    const own = (this.holders[name] ||= element("div", { class: `view view-${name}` }));
    holder.replaceChildren(own);
    holder.setAttribute("aria-labelledby", `tab-${name}`);
    if (fresh) await view.build(own);
    if (name === "cells") {
      this.places ||= this.firstPlaces();
      performance.mark("table");
      await view.show(this.places);
    } else await view.show();
    if (remember) this.remember();
    performance.mark("shown");
  }

  remember() {
    const address = this.address(this.opened, this.places);
    if (location.hash !== address) history.replaceState(null, "", address);
  }

  // Draw what is open again, in the colours of now.
  redraw() {
    const view = this.views[this.opened];
    return view.redraw ? view.redraw() : view.draw?.();
  }

  async choose(places) {
    const begin = performance.now();
    this.places = places;
    this.remember();
    await this.views.cells.show(places);
    this.took = performance.now() - begin;
  }
}

// The study as it was asked for, and where its results come from.
class About {
  constructor(page) {
    this.page = page;
    this.title = "Study";
  }

  build(holder) {
    const about = this.page.groups["/"].attributes;
    const plain = Object.entries(about).filter(([name, value]) => value !== "" && !["config", "software", "title"].includes(name));
    let software = [];
    try {
      software = Object.entries(JSON.parse(about.software || "{}"));
    } catch {
      software = [["software", about.software]];
    }
    const table = (rows) => element("div", { class: "wide" }, element("table", { class: "plain" }, element("tbody", {}, rows.map(([name, value]) =>
      element("tr", {}, element("th", { scope: "row", text: spoken(name) }), element("td", { text: String(value) }))))));
    const link = (path) => element("li", {}, element("a", { href: path, text: path }));
    const files = this.page.files;
    const config = element("pre", { class: "code", tabindex: "0", role: "region", "aria-label": "The study's YAML", text: about.config || "" });
    holder.append(element("h2", { text: about.title || "Study" }),
      element("section", { class: "panel" }, element("h3", { text: "Where it comes from" }), table(plain)),
      element("section", { class: "panel" }, element("h3", { text: "Versions" }), table(software)),
      element("section", { class: "panel wide-panel" }, element("h3", { text: "The study, as run" }), config, copyButton(() => config.textContent, "Copy")),
      element("section", { class: "panel wide-panel" }, element("h3", { text: "Files" }),
        element("ul", { class: "links columns" }, link("dataset.nc"), files.map(link)),
        element("p", { class: "soft small", text: "Links work where this page lies in the folder of its study." })));
  }

  show() {}
}

async function main() {
  if (!("DecompressionStream" in window)) throw new Error("this browser is too old for this page; open dataset.nc with xarray instead");
  const content = JSON.parse(await inflatedText("content"));
  const page = new Page(content);
  window.springtune = page;
  await page.start();
  document.documentElement.dataset.ready = "yes";
  performance.mark("ready");
}

main().catch((error) => {
  document.getElementById("view").textContent = `The page cannot be shown: ${error.message}`;
  throw error;
});
