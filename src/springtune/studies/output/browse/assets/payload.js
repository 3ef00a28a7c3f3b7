"use strict";
// The dataset as it is packed into this page, see payload.py.

function bytesOf(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(id) {
  const stream = new Blob([bytesOf(id)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function inflatedText(id) {
  return new TextDecoder().decode(await inflated(id));
}

// A variable: numbers are unpacked when they are first asked for.
class Field {
  constructor(row, group) {
    Object.assign(this, row);
    this.group = group;
    this.shape = this.dims.map((name) => group.dims[name].size);
    this.size = this.shape.reduce((a, b) => a * b, 1);
    this.strides = {};
    let stride = 1;
    for (let i = this.dims.length - 1; i >= 0; i--) {
      this.strides[this.dims[i]] = stride;
      stride *= this.shape[i];
    }
    this.isText = this.type === "text";
  }

  unpacked() {
    if (this.values) return this.values;
    const rows = this.points ? this.size / this.points : 0;
    let at = this.at, kept = rows;
    const bytes = this.group.bytes;
    if ("kept" in this) {
      kept = this.kept;
      this.place = new Int32Array(rows).fill(-1);
      for (let row = 0, found = 0; row < rows; row++)
        if ((bytes[at + (row >> 3)] >> (row & 7)) & 1) this.place[row] = found++;
      at += Math.ceil(rows / 8);
    }
    const count = kept * this.points, values = new Int32Array(count);
    for (let i = 0; i < count; i++) {
      const folded = bytes[at + i] | (bytes[at + count + i] << 8)
        | (bytes[at + 2 * count + i] << 16) | (bytes[at + 3 * count + i] << 24);
      values[i] = (folded >>> 1) ^ -(folded & 1);
    }
    if (this.points > 1)
      for (let begin = 0; begin < count; begin += this.points)
        for (let i = begin + 1; i < begin + this.points; i++) values[i] = (values[i] + values[i - 1]) | 0;
    if (this.type !== "float") return (this.values = values);
    for (let i = 0; i < count; i++) values[i] <<= this.cleared;
    return (this.values = new Float32Array(values.buffer));
  }

  // Place among the unpacked values; below zero where a row has none.
  placeAt(flat) {
    if (!this.place) return flat;
    const row = this.place[Math.floor(flat / this.points)];
    return row < 0 ? -1 : row * this.points + (flat % this.points);
  }

  // Number or text at a place of the flat array; NaN or "" where there is none.
  valueAt(flat) {
    const values = this.unpacked(), place = this.placeAt(flat);
    if (place < 0) return this.isText ? "" : this.type === "float" ? NaN : 0;
    const value = values[place];
    return this.isText ? (value < 0 ? "" : this.words[value]) : value;
  }

  // From a place in the flat array of another field to the place in that of this one, which has no dimension beyond.
  from(other) {
    const steps = this.dims.map((name) => [other.strides[name], this.group.dims[name].size, this.strides[name]]);
    if (this.dims.join() === other.dims.join()) return (flat) => flat;
    return (flat) => steps.reduce((sum, [stride, size, own]) => sum + (Math.floor(flat / stride) % size) * own, 0);
  }

  within(dims) {
    return this.dims.every((name) => dims.includes(name));
  }

  // Place in the flat array of places along the dimensions; those not given are the first.
  flat(places) {
    let sum = 0;
    for (const name of this.dims) sum += this.strides[name] * (places[name] || 0);
    return sum;
  }

  of(places) {
    return this.valueAt(this.flat(places));
  }

  // Values along one dimension.
  along(name, places) {
    const begin = this.flat({ ...places, [name]: 0 }), stride = this.strides[name] || 0;
    return Array.from({ length: this.group.dims[name].size }, (_, i) => this.valueAt(begin + i * stride));
  }

  meaning(value) {
    return this.flags ? this.flags[value] || "" : value;
  }
}

class Group {
  constructor(row, number) {
    Object.assign(this, row);
    this.number = number;
    this.dims = Object.fromEntries(row.dims.map((dim) => [dim.name, dim]));
    this.fields = Object.fromEntries(row.variables.map((one) => [one.name, new Field(one, this)]));
  }

  async load() {
    if (!this.bytes) {
      this.bytes = await inflated(`group-${this.number}`);
      this.judge();
    }
    return this;
  }

  // Solved cells that the linear reference cannot judge have a status of their own.
  judge() {
    const { status, reference_applies: applies } = this.fields;
    if (!status?.flags || !applies?.within(status.dims)) return;
    const solved = Number(Object.keys(status.flags).find((key) => status.flags[key] === "solved"));
    const values = status.unpacked(), beyond = Math.max(...Object.keys(status.flags)) + 1, at = applies.from(status);
    for (let flat = 0; flat < status.size; flat++) {
      const place = status.placeAt(flat);
      if (place < 0 || values[place] !== solved || applies.valueAt(at(flat)) !== 0) continue;
      values[place] = beyond;
      status.flags[beyond] = "beyond_linear";
    }
  }

  // Cells by status, with those of any count; null where the group has no cells.
  tally() {
    const status = this.fields.status;
    if (!status?.flags || !status.dims.length || !this.bytes) return null;
    const values = status.unpacked(), found = {};
    for (const value of values) found[value] = (found[value] || 0) + 1;
    const tally = Object.fromEntries(Object.entries(status.flags).map(([key, word]) => [word, found[key] || 0]));
    if (status.place) tally.not_requested = (tally.not_requested || 0) + status.size - values.length;
    return tally;
  }

  // How many labels of a dimension have a cell that was asked for; a group may share labels with others.
  labelsInUse(name) {
    const status = this.fields.status, found = new Set();
    for (let flat = 0; flat < status.size; flat++)
      if (status.meaning(status.valueAt(flat)) !== "not_requested") found.add(Math.floor(flat / status.strides[name]) % this.dims[name].size);
    return found.size;
  }

  // Which sign of the errors of a field means too soft, at these places and along these dimensions.
  sign(field, places = {}, along = [], above = null) {
    if (!isSigned(field)) return "";
    const name = { face_error: "reference_face_displacement", error: "reference_value", expected_error: "expected_value" }[field.name];
    const of = this.fields[name] ? this : this.fields.reference_displacement ? this : above;
    const reference = of?.fields[this.fields[name] ? name : "reference_displacement"];
    if (!reference || !/^(deformation_|second_|face_|expected_)?error$/.test(field.name)) return "positive: too large";
    const by = ["load", "quantity"].find((one) => along.includes(one) && reference.dims.includes(one));
    const kind = of.fields.quantity_kind, sums = {};
    let others = false;
    for (let flat = 0; flat < reference.size; flat++) {
      const value = reference.valueAt(flat);
      const at = Object.fromEntries(reference.dims.map((one) => [one, Math.floor(flat / reference.strides[one]) % of.dims[one].size]));
      const elsewhere = (one) => one in places && !along.includes(one) && of.label(one, at[one]) !== this.label(one, places[one]);
      if (!Number.isFinite(value) || reference.dims.some(elsewhere)) continue;
      if (kind && kind.of(at) !== "displacement") others = true;
      else sums[by ? at[by] : ""] = (sums[by ? at[by] : ""] || 0) + Math.sign(value);
    }
    const pairs = Object.entries(sums).map(([place, sum]) => [by ? of.label(by, Number(place)) : "", sum]);
    const sentence = signSentence(pairs, by === "quantity" ? "of" : "under");
    if (!others) return sentence;
    return sentence ? `displacements: ${sentence}; other quantities: positive: too large` : "positive: too large";
  }

  label(name, place) {
    const labels = this.dims[name].labels;
    return labels ? labels[place] : place;
  }

  place(name, label) {
    const labels = this.dims[name].labels;
    return labels ? labels.indexOf(label) : label;
  }
}
