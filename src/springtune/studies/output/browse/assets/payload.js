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

  // Number or text at a place of the flat array; NaN or "" where there is none.
  valueAt(flat) {
    const values = this.unpacked();
    let place = flat;
    if (this.place) {
      const row = this.place[Math.floor(flat / this.points)];
      if (row < 0) return this.isText ? "" : this.type === "float" ? NaN : 0;
      place = row * this.points + (flat % this.points);
    }
    const value = values[place];
    return this.isText ? (value < 0 ? "" : this.words[value]) : value;
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
    this.bytes ||= await inflated(`group-${this.number}`);
    return this;
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
