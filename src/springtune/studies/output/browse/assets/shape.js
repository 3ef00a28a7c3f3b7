// The network deformed over its reference, springs coloured by what they carry.

const SCALES = [0, 0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 1e4];

class Shape {
  static NEEDED = ["x", "y", "spring_nodes", "displacement_x", "displacement_y"];

  constructor(over, holder, under, page, group = page.groups["/fields"]) {
    Object.assign(this, { over, holder, under, page, group });
    this.chart = new Outline(holder, "network", 320);
    this.chart.redraw = () => this.data && this.draw(true);
    this.factor = 1;
  }

  async show(places) {
    this.stop();
    const why = await this.read(places);
    return why ? this.say(why) : this.controls() || this.draw(true);
  }

  say(why) {
    this.data = null;
    this.over.replaceChildren();
    this.under.replaceChildren();
    this.chart.say(why.words);
    if (why.button) this.holder.append(why.button);
  }

  // Read the fields of a cell; what is said where it has none.
  async read(places) {
    const root = this.page.groups["/"], group = this.group;
    if (!group) return { words: "This dataset has no displacement fields: the study does not ask for the output 'deformed'." };
    await group.load();
    const f = group.fields;
    if (!Shape.NEEDED.every((name) => name in f)) return { words: group.left_out.length ? LEFT_OUT : "The group /fields has not the variables that a network is drawn from; its own view shows what there is." };
    const at = {};
    for (const name of Object.keys(places))
      if (name in group.dims) at[name] = group.place(name, root.label(name, places[name]));
    if (Object.values(at).some((one) => one < 0)) return { words: "There are no displacement fields of this cell." };
    // Of what a study sweeps, fields are of one value each.
    const kept = {};
    for (const name of Object.keys(places)) {
      const shown = f[`shown_${name}`]?.of(at);
      if (Number.isFinite(shown)) kept[name] = root.dims[name].labels.findIndex((one) => Math.abs(one - shown) <= 1e-4 * Math.abs(one));
    }
    const others = Object.keys(kept).filter((name) => kept[name] >= 0 && kept[name] !== places[name]);
    if (others.length) {
      const values = others.map((name) => `${spoken(name)} ${labelWithUnit(root.dims[name], kept[name])}`).join(", ");
      return {
        words: `Of what this study sweeps, displacement fields are kept of ${values}.`,
        button: element("button", { type: "button", text: `Show ${values}`, onclick: () => this.page.choose({
          ...places, ...Object.fromEntries(others.map((name) => [name, kept[name]])) }) }),
      };
    }
    if (this.fill(at)) {
      const sizes = "mesh_size" in at ? group.dims.mesh_size.size : 0;
      const other = Array.from({ length: sizes }, (_, i) => i)
        .find((i) => Number.isFinite(f.displacement_x.of({ ...at, mesh_size: i })));
      if (other === undefined) {
        const status = root.fields.status, word = status.meaning(status.of(places));
        const reason = word === "not_requested" ? "the study does not ask for it" : ["solved", "beyond_linear"].includes(word) ? "none were kept" : spoken(word);
        return { words: `There are no displacement fields of this cell (${reason}).` };
      }
      const size = labelWithUnit(group.dims.mesh_size, other);
      return {
        words: "Displacement fields are kept of the coarsest mesh of each beam and mesh type.",
        button: element("button", { type: "button", text: `Show ${size}`, onclick: () => this.page.choose({
          ...places, mesh_size: root.place("mesh_size", group.label("mesh_size", other)) }) }),
      };
    }
    return null;
  }

  // Take the fields at places of the group; words where there are none.
  fill(at) {
    this.stop();
    this.factor = 1;
    const trimmed = (field, along, where) => {
      const values = field.along(along, where);
      let end = values.length;
      while (end && Number.isNaN(values[end - 1])) end--;
      return values.slice(0, end);
    };
    const f = this.group.fields, dimOf = (field) => field.dims[field.dims.length - 1];
    const particle = dimOf(f.x), [spring, end] = f.spring_nodes.dims.slice(-2);
    const x = trimmed(f.x, particle, at), ux = trimmed(f.displacement_x, particle, at);
    if (!x.length || !ux.length) return "There are no displacement fields of this network.";
    const own = (field) => Object.fromEntries(field.dims.filter((name) => name in at).map((name) => [name, at[name]]));
    const read = (field, along) => field.along(along, own(field)).slice(0, along === particle ? x.length : undefined);
    const [first, second] = [0, 1].map((one) => trimmed(f.spring_nodes, spring, { ...at, [end]: one }));
    const data = { x, ux, y: read(f.y, particle), uy: read(f.displacement_y, particle), first, second };
    data.carried = this.carried(data, spring, at);
    const line = f.outline_x && dimOf(f.outline_x);
    if (line) {
      data.ox = trimmed(f.outline_x, line, at);
      data.oy = f.outline_y.along(line, at).slice(0, data.ox.length);
      data.rounds = f.outline_round?.along(line, at);
      const moved = f.reference_displacement_x;
      if (moved) {
        data.oux = moved.along(line, at).slice(0, data.ox.length);
        data.ouy = f.reference_displacement_y.along(line, at).slice(0, data.ox.length);
        if (!data.oux.some(Number.isFinite)) data.oux = null;
      }
    }
    this.data = data;
    let most = 0;
    for (let i = 0; i < x.length; i++) most = Math.max(most, Math.hypot(ux[i], data.uy[i]));
    const length = Math.max(...x) - Math.min(...x);
    const wanted = (0.1 * length) / (most || 1);
    // A linear answer may be larger than the body.
    this.scale = wanted > 0.2 && wanted < 2 ? 1 : SCALES.filter((one) => one && (one <= wanted || one === 0.001)).pop();
    return null;
  }

  // What colours the springs: a force where the dataset has one, or a stiffness; else their strain.
  carried(data, spring, at) {
    const fields = Object.values(this.group.fields).filter((one) => one.dims.includes(spring));
    const read = (field) => field.along(spring, at).slice(0, data.first.length);
    // Springs of a definition by energies alone carry nothing: their strain says more.
    const any = (values) => values.some((one) => Number.isFinite(one) && one !== 0);
    const force = fields.find((one) => one.units === "N" && /force/.test(one.name));
    const lengths = (moved) => data.first.map((a, i) => {
      const b = data.second[i], part = (p, u) => p[b] - p[a] + (moved ? u[b] - u[a] : 0);
      return Math.hypot(part(data.x, data.ux), part(data.y, data.uy));
    });
    if (force) {
      const values = read(force);
      if (any(values)) return { name: "force of the spring", unit: "N", values };
    }
    const rest = lengths(false), now = lengths(true);
    const stiffness = fields.find((one) => one.units === "N/m" && /stiffness/.test(one.name));
    if (stiffness) {
      const values = read(stiffness).map((k, i) => k * (now[i] - rest[i]));
      if (any(values)) return { name: "force of the spring", unit: "N", values };
    }
    return { name: "strain of the spring", unit: "%", values: now.map((one, i) => 100 * (one / rest[i] - 1)) };
  }

  controls() {
    const out = element("output", { text: `× ${number(this.scale)}` });
    const scale = element("input", { type: "range", min: 0, max: SCALES.length - 1, step: 1, id: "shape-scale",
      value: SCALES.indexOf(this.scale), oninput: () => {
        this.scale = SCALES[scale.value];
        out.textContent = `× ${number(this.scale)}`;
        this.draw(true);
      } });
    const share = element("output", { text: "100 %" });
    const factor = element("input", { type: "range", min: 0, max: 100, step: 1, value: 100, id: "shape-load",
      oninput: () => { this.stop(); this.load(factor.value / 100); } });
    this.load = (value) => {
      this.factor = value;
      factor.value = Math.round(100 * value);
      share.textContent = `${Math.round(100 * value)} %`;
      this.draw(false);
    };
    this.button = element("button", { type: "button", id: "shape-play", text: "▶ Animate", onclick: () => this.playing ? this.stop() : this.play() });
    this.over.replaceChildren(element("label", { class: "choice" }, element("span", { text: "displacements" }), scale, out),
      element("label", { class: "choice" }, element("span", { text: "load" }), factor, share), this.button);
  }

  play() {
    const begin = performance.now(), from = this.factor < 1 ? this.factor : 0;
    this.button.textContent = "■ Stop";
    const step = (now) => {
      const value = Math.min(1, from + (now - begin) / 1800);
      this.load(value);
      if (value < 1) this.playing = requestAnimationFrame(step);
      else this.stop();
    };
    this.playing = requestAnimationFrame(step);
  }

  stop() {
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    if (this.button) this.button.textContent = "▶ Animate";
  }

  async draw(frame) {
    const { data, scale, factor } = this, s = scale * factor, mm = 1e3;
    const moved = (p, u, share) => p.map((one, i) => mm * (one + share * (u ? u[i] : 0)));
    const x = moved(data.x, data.ux, s), y = moved(data.y, data.uy, s);
    const sizes = data.carried.values.filter(Number.isFinite).map(Math.abs).sort((a, b) => a - b);
    const limit = sizes[Math.floor(0.97 * (sizes.length - 1))] || sizes.at(-1) || 1; // a few at a corner carry far more
    const closed = (line) => rounds(line, data.rounds);
    const outlines = [];
    if (data.ox?.length) {
      outlines.push({ x: closed(moved(data.ox, null, 0)), y: closed(moved(data.oy, null, 0)), what: "rest" });
      if (data.oux) outlines.push({ x: closed(moved(data.ox, data.oux, s)), y: closed(moved(data.oy, data.ouy, s)), what: "reference" });
    }
    const whole = frame ? {
      x: [moved(data.x, null, 0), moved(data.x, data.ux, scale), data.oux ? moved(data.ox, data.oux, scale) : []].flat(),
      y: [moved(data.y, null, 0), moved(data.y, data.uy, scale), data.oux ? moved(data.oy, data.ouy, scale) : []].flat(),
    } : null;
    const { name, unit, values } = data.carried;
    await this.chart.show({
      x0: data.first.map((i) => x[i]), y0: data.first.map((i) => y[i]),
      x1: data.second.map((i) => x[i]), y1: data.second.map((i) => y[i]),
      shares: values.map((one) => (factor * one) / limit), outlines, whole,
      tips: values.map((one) => `${signed(factor * one, 4)} ${unit}`), name,
    });
    if (frame) {
      const bar = element("span", { class: "bar", style: `background: linear-gradient(to right, ${[-1, -0.5, 0, 0.5, 1].map(carriedColour).join(",")})` });
      this.under.replaceChildren(element("p", { class: "scale" }, element("span", { text: `≤ −${number(limit, 3)} ${unit}` }), bar,
        element("span", { text: `≥ +${number(limit, 3)} ${unit}` }),
        element("span", { class: "soft", text: `${name}, tension positive · thin line: at rest${data.oux ? " · wide line: the reference" : " · the page has no reference of this load"}` })),
        element("p", { class: "soft small", text: "The load's slider scales the displacements under the whole load: the dataset holds no path to it." }));
    }
  }
}

function carriedColour(share) {
  const middle = dark.matches ? [105, 108, 115] : [165, 168, 172];
  const end = share < 0 ? (dark.matches ? [90, 190, 255] : [0, 84, 190]) : dark.matches ? [255, 150, 40] : [205, 80, 0];
  const size = Math.min(1, Math.abs(share));
  return css(middle.map((one, i) => Math.round(one + size * (end[i] - one))));
}

class Outline extends Lines {
  async show({ x0, y0, x1, y1, shares, tips, name, outlines, whole }) {
    const made = await this.figure({ figure: {}, shape: true }, (fig, B) => {
      const lines = this.source("lines", ["xs", "ys", "width", "dash"]);
      const springs = this.source("springs", ["x0", "y0", "x1", "y1", "color", "tip", "what"]);
      // Under the springs: those on the outline carry most.
      this.edges = fig.multi_line({ field: "xs" }, { field: "ys" },
        { source: lines, line_width: { field: "width" }, line_dash: { field: "dash" }, line_alpha: 0.5 });
      const glyph = fig.segment({ field: "x0" }, { field: "y0" }, { field: "x1" }, { field: "y1" },
        { source: springs, line_color: { field: "color" }, line_width: 1.6 });
      fig.add_tools(new B.HoverTool({ renderers: [glyph], tooltips: [["", "@what"], ["", "@tip"]] }));
      this.recolour = (text) => (this.edges.glyph.line_color = text);
    });
    if (!made || this.fig !== made) return;
    this.sources.springs.data = { x0, y0, x1, y1, color: shares.map(carriedColour), tip: tips, what: tips.map(() => name) };
    this.sources.lines.data = {
      xs: outlines.map((one) => one.x), ys: outlines.map((one) => one.y),
      width: outlines.map((one) => (one.what === "rest" ? 1 : 5)), dash: outlines.map((one) => (one.what === "rest" ? "3 3" : "solid")),
    };
    if (whole) {
      const across = spread(whole.x, false, 0.03), up = spread(whole.y, false, 0.06);
      const wanted = ((this.holder.clientWidth - 90) * (up[1] - up[0])) / (across[1] - across[0]) + 85;
      this.height = Math.round(Math.max(170, Math.min(wanted, 460)));
      this.fig.height = this.height;
      const [x, y] = this.fitted(across, up);
      this.window(x, y);
    }
    this.axes("x [mm]", "y [mm]", "the deformed network over its reference");
  }
}
