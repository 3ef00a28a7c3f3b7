// The network deformed over its reference, springs coloured by what they carry.

const SCALES = [0, 0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 1e4];
const CARRIED = { light: ["#0054be", "#a5a8ac", "#cd5000"], dark: ["#5abeff", "#696c73", "#ff9628"] };

class Network {
  static NEEDED = ["x", "y", "spring_nodes", "displacement_x", "displacement_y"];

  static drawnFrom(group) {
    return Boolean(group) && Network.NEEDED.every((name) => name in group.fields);
  }

  constructor(group) {
    this.group = group;
    this.chart = new Chart(element("div", { class: "chart" }));
    this.over = element("div", { class: "row" });
    this.under = element("div");
    this.holder = element("div", {}, this.over, this.chart.holder, this.under);
  }

  // Whether the group has the network of places.
  has(places) {
    return Number.isFinite(this.group.fields.displacement_x.of(places));
  }

  say(...words) {
    this.data = null;
    this.over.replaceChildren();
    this.under.replaceChildren();
    this.chart.say(...words);
  }

  show(places) {
    if (!this.has(places)) return this.say("There are no displacement fields of this network.");
    const f = this.group.fields, particle = f.x.dims.at(-1), [spring, end] = f.spring_nodes.dims.slice(-2), line = f.outline_x?.dims.at(-1);
    const known = (name, along, more = {}) => (name in f ? f[name].along(along, { ...places, ...more }) : []);
    const counted_ = (values) => values.findLastIndex(Number.isFinite) + 1;
    const [x, y, ux, uy] = ["x", "y", "displacement_x", "displacement_y"].map((name) => known(name, particle));
    const [first, second] = [0, 1].map((one) => known("spring_nodes", spring, { [end]: one }));
    const springs = upTo(first.length).filter((i) => Math.min(first[i], second[i]) >= 0 && Math.max(first[i], second[i]) < counted_(x));
    const data = { x, y, ux, uy, first: springs.map((i) => first[i]), second: springs.map((i) => second[i]) };
    if (line) Object.assign(data, { ox: known("outline_x", line), oy: known("outline_y", line), rounds: f.outline_round && known("outline_round", line),
      oux: known("reference_displacement_x", line), ouy: known("reference_displacement_y", line) });
    this.data = data;
    this.carried = this.carriedBy(springs, spring, places);
    const good = x.filter(Number.isFinite), most = Math.max(...ux.map((one, i) => Math.hypot(one, uy[i])).filter(Number.isFinite));
    const wanted = (0.1 * (Math.max(...good) - Math.min(...good))) / (most || 1);
    // A linear answer may be larger than the body.
    this.scale = wanted > 0.2 && wanted < 2 ? 1 : SCALES.findLast((one) => one && (one <= wanted || one === 0.001));
    const out = element("output", { text: `× ${number(this.scale)}` });
    const ends = { type: "range", min: 0, max: SCALES.length - 1, step: 1, id: "shape-scale", value: SCALES.indexOf(this.scale) };
    const slider = element("input", { ...ends, oninput: () => {
      this.scale = SCALES[slider.value];
      out.textContent = `× ${number(this.scale)}`;
      this.draw();
    } });
    this.over.replaceChildren(element("label", { class: "choice" }, element("span", { text: "displacements" }), slider, out));
    return this.draw(true);
  }

  // What colours the springs: a force where the dataset has one, or a stiffness; else their strain.
  carriedBy(springs, along, places) {
    const { x, y, ux, uy, first, second } = this.data;
    const read = (units, word) => {
      const field = Object.values(this.group.fields).find((one) => one.dims.includes(along) && one.units === units && one.name.includes(word));
      const values = field ? field.along(along, places) : [];
      return springs.map((i) => values[i]);
    };
    const length = (share) => first.map((a, i) => {
      const part = (p, u) => p[second[i]] - p[a] + share * (u[second[i]] - u[a]);
      return Math.hypot(part(x, ux), part(y, uy));
    });
    const rest = length(0), now = length(1);
    const forces = [read("N", "force"), read("N/m", "stiffness").map((k, i) => k * (now[i] - rest[i]))];
    // Springs of a definition by energies alone carry nothing: their strain says more.
    const values = forces.find((one) => one.some((force) => Number.isFinite(force) && force !== 0));
    if (values) return { name: "force of the spring", unit: "N", values };
    return { name: "strain of the spring", unit: "%", values: now.map((one, i) => 100 * (one / rest[i] - 1)) };
  }

  draw(anew = false) {
    const { data, scale, chart } = this, { name, unit, values } = this.carried, stops = CARRIED[dark.matches ? "dark" : "light"];
    const moved = (p, u, share) => p.map((one, i) => 1e3 * (one + (share ? share * u[i] : 0)));
    const x = moved(data.x, data.ux, scale), y = moved(data.y, data.uy, scale);
    const sizes = values.filter(Number.isFinite).map(Math.abs).sort((a, b) => a - b);
    const limit = sizes[Math.floor(0.97 * (sizes.length - 1))] || sizes.at(-1) || 1; // a few at a corner carry far more
    const springs = values.map((one, i) => ({
      x0: x[data.first[i]], y0: y[data.first[i]], x1: x[data.second[i]], y1: y[data.second[i]], name,
      color: css(between(stops, Number.isFinite(one) ? 0.5 + one / limit / 2 : 0.5)), tip: `${number(one)} ${unit}`,
    }));
    const line = (p, u, share) => closed(moved(p, u, share), data.rounds);
    const outline = (share, width, dash) => ({ xs: line(data.ox, data.oux, share), ys: line(data.oy, data.ouy, share), width, dash });
    const reference = data.oux?.some(Number.isFinite);
    const outlines = data.ox ? [outline(0, 1, "3 3"), ...(reference ? [outline(scale, 5, "solid")] : [])] : [];
    const span = (all) => Math.max(...all.filter(Number.isFinite)) - Math.min(...all.filter(Number.isFinite));
    const tall = ((chart.holder.clientWidth - 90) * span(y)) / span(x) + 100;
    if (anew) this.height = Math.round(Math.max(170, Math.min(tall || 320, 460)));
    this.under.replaceChildren(ramp(stops, `≤ −${number(limit, 3)} ${unit}`, `≥ +${number(limit, 3)} ${unit}`, `${name}, tension positive`,
      "thin line: at rest",
      reference ? "wide line: the reference" : "the page has no reference of this load"));
    return chart.draw({ x: { label: "x [mm]" }, y: { label: "y [mm]" }, height: this.height, match_aspect: true }, {
      outlines: columnsOf(outlines, ["xs", "ys", "width", "dash"]), springs: columnsOf(springs, ["x0", "y0", "x1", "y1", "color", "tip", "name"]),
    }, (figure, B) => {
      // Under the springs: those on the outline carry most.
      figure.multi_line({ ...fields("xs", "ys"), source: chart.sources.outlines, line_width: { field: "width" }, line_dash: { field: "dash" },
        line_alpha: 0.5, line_color: ink("ink") });
      hover(figure, B, figure.segment({ ...fields("x0", "y0", "x1", "y1"), source: chart.sources.springs, line_color: { field: "color" }, line_width: 1.6 }));
    });
  }
}
