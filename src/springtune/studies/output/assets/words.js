// How values are written: units of engineers, percent, signs. And the elements that hold them.

const UNITS = {
  m: [1e3, "mm"], m2: [1e6, "mm²"], Pa: [1e-6, "MPa"], byte: [1e-6, "MB"], "byte s-1": [1e-9, "GB/s"], degree: [1, "°"],
  "kg/m3": [1, "kg/m³"], "s-1": [1, "1/s"], "1": [1, ""],
};
const LEFT_OUT = "This is too large for the page; it is in dataset.nc alone.";
const SIGNS = {
  solved: "●", beyond_linear: "◇", linear_only: "◐", not_converged: "▲", unstable: "○", failed: "✕", not_requested: "–",
};
const PHRASES = { beyond_linear: "solved; the linear reference does not apply" };
const OF_FILE = "as in file"; // the mesh size of a mesh that was read from a file

// Factor and unit in which a variable or a dimension is written.
function unitOf(one) {
  if (one.flags || one.isText) return [1, ""];
  const units = one.units || "1";
  if (units === "1" && /(^|_)(errors?(?!_rate)|strain|elongation|swing)(_|$)/.test(one.name) && !/^standard error/.test(one.long_name))
    return [100, "%"];
  return UNITS[units] || [1, units];
}

function isFile(one, value) {
  return value === 0 && /(^|_)mesh_size$/.test(one.name);
}

function spoken(name) {
  return PHRASES[name] || String(name).replaceAll("_", " ");
}

function titled(one) {
  const unit = unitOf(one)[1];
  return spoken(one.name) + (unit ? ` [${unit}]` : "");
}

function number(value, digits = 4) {
  if (value === null || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  let text = Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(digits)));
  if (size >= 1e6 || size && size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    text = `${mantissa.replace(/\.?0+$/, "")}e${Number(exponent)}`;
  }
  return text.replaceAll("-", "−");
}

// What the sign of an error of a displacement means, as springtune.problem.compare says it.
function signWord(error, reference) {
  return error * reference > 0 ? "too soft" : error * reference < 0 ? "too stiff" : "";
}

// A value of a field as the page writes it, its unit apart.
function written(field, value, digits) {
  if (field.isText) return value;
  if (field.flags) return spoken(field.meaning(value));
  if (isFile(field, value)) return OF_FILE;
  return (field.signed && value > 0 ? "+" : "") + number(value * unitOf(field)[0], digits);
}

function withUnit(one, value, text) {
  const unit = typeof value === "number" && !isFile(one, value) ? unitOf(one)[1] : "";
  return unit ? `${text} ${unit}` : text;
}

function labelText(dim, place) {
  const label = dim.labels ? dim.labels[place] : place;
  if (typeof label === "number") return written(dim, label, 6);
  return String(label).replace(/-plane-(?=stress$|strain$)/, ", plane ").replace("neo-hooke,", "neo-Hooke,");
}

function labelWithUnit(dim, place) {
  return withUnit(dim, dim.labels ? dim.labels[place] : place, labelText(dim, place));
}

// Elements: texts are always set as text, so that what a dataset says is never markup.
function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "text") made.textContent = value;
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return made;
}

function choice(label, options, chosen, change, properties = {}) {
  const select = element("select", { "aria-label": label, onchange: () => change(select.value), ...properties },
    options.map(([value, text]) => element("option", { value, text, selected: String(value) === String(chosen) })));
  return element("label", { class: "choice" }, element("span", { text: label }), select);
}

// A choice of a label for each dimension that has several; `change` gets all places.
function selectors(group, names, places, change) {
  return names.filter((name) => group.dims[name].size > 1).map((name) => {
    const dim = group.dims[name], labels = upTo(dim.size).map((i) => [i, labelWithUnit(dim, i)]);
    return choice(spoken(name), labels, places[name] || 0, (value) => change({ ...places, [name]: Number(value) }), { "data-dim": name });
  });
}

function panel(name, title, ...children) {
  return element("section", { class: "panel", id: `panel-${name}` }, element("h3", { text: title }), ...children);
}

// Rows of texts or elements, the first of each a heading.
function plainTable(rows) {
  const cell = (one, i) => element(i ? "td" : "th", i ? {} : { scope: "row" }, one);
  return element("div", { class: "wide" }, element("table", { class: "plain" },
    element("tbody", {}, rows.map((row) => element("tr", {}, row.map(cell))))));
}

function badge(status, count = "") {
  return element("span", { class: `status ${status}`, title: spoken(status) },
    element("span", { class: "sign", "aria-hidden": "true", text: SIGNS[status] || "?" }), ` ${spoken(status)} ${count}`.trimEnd());
}
