// How values are written: units of engineers, percent, signs.

const UNITS = {
  m: [1e3, "mm"], m2: [1e6, "mm²"], Pa: [1e-6, "MPa"], byte: [1e-6, "MB"], "byte s-1": [1e-9, "GB/s"], degree: [1, "°"],
  "kg/m3": [1, "kg/m³"], "s-1": [1, "1/s"], "rad/s": [1, "rad/s"], "1": [1, ""],
};
const LEFT_OUT = "This is too large for the page; it is in dataset.nc alone.";
const SIGNS = {
  solved: "●", beyond_linear: "◇", linear_only: "◐", not_converged: "▲", unstable: "○", failed: "✕", not_requested: "–",
};
const PHRASES = { beyond_linear: "solved; the linear reference does not apply" };

function unitOf(one) {
  if (one.flags || one.isText) return [1, ""];
  const units = one.units || "1";
  if (units === "1" && /(^|_)(errors?(?!_rate)|strain|elongation|swing)(_|$)/.test(one.name) && !/^standard error/.test(one.long_name))
    return [100, "%"];
  return UNITS[units] || [1, units];
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
  let text;
  if (size === 0) text = "0";
  else if (size >= 1e6 || size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    text = `${mantissa.replace(/\.?0+$/, "")}e${Number(exponent)}`;
  } else if (Number.isInteger(value)) text = String(value);
  else text = String(Number(value.toPrecision(digits)));
  return text.replaceAll("-", "−");
}

function ten(power) {
  return `10${[...String(power)].map((one) => (one === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[one])).join("")}`;
}

function signed(value, digits = 3) {
  const text = number(value, digits);
  return value > 0 ? `+${text}` : text;
}

// Whether the sign of an error means something: not that of a norm, an estimate, or a number printed without one.
function isSigned(field) {
  field.negative ??= /signed|less 1|- 1$|network - reference/.test(field.long_name) || isError(field) && field.unpacked().some((one) => one < 0);
  return isError(field) && field.negative && !/without sign/.test(field.long_name);
}

function isError(field) {
  return /error/.test(field.name) && unitOf(field)[1] === "%" && !/estimate/.test(field.name);
}

// The same words as springtune.problem.compare: what the sign of an error means.
function signWord(error, reference, displacement = true) {
  const beyond = error * reference, words = displacement ? ["too soft", "too stiff"] : ["too large", "too small"];
  return beyond > 0 ? words[0] : beyond < 0 ? words[1] : "";
}

// References are pairs of a name, such as that of a load, and a displacement or its sign.
function signSentence(references, where = "under") {
  const known = references.filter((one) => one[1]), against = known.filter((one) => one[1] < 0).map((one) => one[0]);
  if (!known.length) return "";
  if (!against.length) return "positive: too soft";
  if (against.length === known.length) return "negative: too soft";
  const names = [against.slice(0, -1).join(", "), against.at(-1)].filter(Boolean).join(" and ");
  return `positive: too soft; ${where} ${names}, where displacements are negative, negative is too soft`;
}

// A value of a field as the page writes it, its unit apart.
function written(field, value, digits) {
  if (field.isText) return value;
  if (field.flags) return spoken(field.meaning(value));
  if (isFile(field, value)) return OF_FILE;
  const scale = unitOf(field)[0];
  return isSigned(field) ? signed(value * scale, digits) : number(value * scale, digits);
}

// A mesh that was read from a file was made with no size.
const OF_FILE = "as in file";
function isFile(one, value) {
  return value === 0 && /(^|_)mesh_size$/.test(one.name);
}

function labelText(dim, place) {
  const label = dim.labels ? dim.labels[place] : place;
  if (isFile(dim, label)) return OF_FILE;
  return typeof label === "number" ? number(label * unitOf(dim)[0], 6) : String(label);
}

function labelWithUnit(dim, place) {
  const unit = unitOf(dim)[1], label = dim.labels ? dim.labels[place] : place;
  return labelText(dim, place) + (typeof label === "number" && unit && !isFile(dim, label) ? ` ${unit}` : "");
}

// "18,432 samples", "1 shape", "5 approaches".
function counted(count, name) {
  const many = /(s|x|ch)$/.test(name) ? `${name}es` : name.replace(/y$/, "ie") + "s";
  return `${count.toLocaleString("en")} ${count === 1 || ["kinematics", "iterations", "substeps"].includes(name) ? name : many}`;
}

// Elements: texts are always set as text, so that what a dataset says is never markup.
function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "class") made.className = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "text") made.textContent = value;
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== undefined && value !== null) made.setAttribute(name, value);
  }
  for (const child of children.flat()) if (child !== null && child !== undefined) made.append(child);
  return made;
}

function choice(label, options, chosen, change, properties = {}) {
  const select = element("select", { "aria-label": label, onchange: () => change(select.value), ...properties });
  for (const [value, text] of options) {
    const option = element("option", { value, text });
    option.selected = String(value) === String(chosen);
    select.append(option);
  }
  return element("label", { class: "choice" }, element("span", { text: label }), select);
}

function copyButton(text, name) {
  const button = element("button", { type: "button", class: "copy", text: name });
  button.addEventListener("click", async () => {
    const content = text();
    try {
      await navigator.clipboard.writeText(content);
    } catch {
      const area = element("textarea", { "aria-hidden": "true", class: "aside" });
      area.value = content;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = name), 1200);
  });
  return button;
}

function badge(status) {
  return element("span", { class: `status ${status}` },
    element("span", { class: "sign", "aria-hidden": "true", text: SIGNS[status] || "?" }), ` ${spoken(status)}`);
}
