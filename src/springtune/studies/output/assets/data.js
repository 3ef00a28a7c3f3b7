"use strict";
// The dataset as page.py packs it into this page.

function inflated(packed) {
  const text = atob(packed), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

function absent(value) {
  return value === "" || Number.isNaN(value);
}

// Whole numbers from zero.
function upTo(count) {
  return Array.from({ length: count }, (_, i) => i);
}

// A variable over dimensions of its group. "Places" are numbers of labels by the names of their dimensions.
class Field {
  constructor(row, group) {
    Object.assign(this, row);
    this.group = group;
    this.isText = this.type === "text";
    this.size = 1;
    this.strides = {};
    for (const name of this.dims.slice().reverse()) {
      this.strides[name] = this.size;
      this.size *= group.dims[name].size;
    }
  }

  // All values in one array, NaN or "" where there is none; unpacked when first asked for.
  get values() {
    return (this.unpacked ||= this.unpack());
  }

  unpack() {
    const { points, bytes } = this, rows = points ? this.size / points : 0;
    const bitmap = "kept" in this ? Math.ceil(rows / 8) : 0;
    const count = (bitmap ? this.kept : rows) * points, packed = new Int32Array(count);
    for (let i = 0; i < count; i++) {
      const byte = (place) => bytes[bitmap + place * count + i] << (8 * place);
      const folded = byte(0) | byte(1) | byte(2) | byte(3);
      packed[i] = (folded >>> 1) ^ -(folded & 1);
      if (i % points) packed[i] += packed[i - 1];
    }
    const isFloat = this.type === "float";
    const numbers = isFloat ? new Float32Array(packed.map((one) => one << this.cleared).buffer) : packed;
    const whole = new numbers.constructor(this.size).fill(isFloat ? NaN : 0);
    for (let row = 0, from = 0; row < rows; row++) {
      if (bitmap && !((bytes[row >> 3] >> (row & 7)) & 1)) continue;
      whole.set(numbers.subarray(from, from + points), row * points);
      from += points;
    }
    return this.isText ? Array.from(whole, (one) => this.words[one]) : whole;
  }

  get isEmpty() {
    return (this.nothing ??= this.values.every(absent));
  }

  // Value at places; dimensions that are not given are at their first label.
  of(places) {
    return this.values[this.flat(places)];
  }

  flat(places) {
    return this.dims.reduce((sum, name) => sum + this.strides[name] * (places[name] || 0), 0);
  }

  placesOf(flat) {
    return Object.fromEntries(this.dims.map((name) => [name, Math.floor(flat / this.strides[name]) % this.group.dims[name].size]));
  }

  along(name, places) {
    return upTo(this.group.dims[name].size).map((i) => this.of({ ...places, [name]: i }));
  }

  within(dims) {
    return this.dims.every((name) => dims.includes(name));
  }

  meaning(value) {
    return this.flags ? this.flags[value] || "" : value;
  }
}

class Group {
  constructor(row) {
    Object.assign(this, row);
    this.dims = Object.fromEntries(row.dims.map((dim) => [dim.name, dim]));
    this.fields = Object.fromEntries(row.variables.map((one) => [one.name, new Field(one, this)]));
    this.status = this.fields.status?.flags && this.fields.status.dims.length ? this.fields.status : null;
  }

  async load() {
    for (const field of Object.values(this.fields)) field.bytes ||= new Uint8Array(await inflated(field.data).arrayBuffer());
    return this;
  }

  // Numbers of cells by status, but for those that were not requested.
  tally() {
    const found = {};
    if (this.status) for (const word of Object.values(this.status.flags)) found[word] = 0;
    for (const value of this.status?.values || []) found[this.status.meaning(value)] += 1;
    this.notRequested = found.not_requested || 0;
    return Object.entries(found).filter(([word, count]) => count && word !== "not_requested");
  }

  label(name, place) {
    return this.dims[name].labels ? this.dims[name].labels[place] : place;
  }

  // Place of a label; below zero where there is none.
  place(name, label) {
    return this.dims[name].labels ? this.dims[name].labels.indexOf(label) : label;
  }

  // Places of another group by their labels; nothing where a label is missing.
  placesFrom(other, places) {
    const shared = Object.keys(places).filter((name) => name in this.dims);
    const found = shared.map((name) => [name, this.place(name, other.label(name, places[name]))]);
    return found.some((one) => one[1] < 0) ? null : Object.fromEntries(found);
  }
}
