// A table of many rows of which only those in view are elements; sorted, filtered, and walked by keyboard.

const ROW = 28, MOST_CHOICES = 60;
const BOUNDS = { "<": (a, b) => a < b, ">": (a, b) => a > b, "<=": (a, b) => a <= b, ">=": (a, b) => a >= b };

class Table {
  // Columns are {name, title, hint, width, numeric, value(row), text(row), size(row), labels, pinned, node(row)}, and rows
  // are numbers. `kind` gives a row its class.
  constructor({ columns, rows, label, choose, changed, kind }) {
    Object.assign(this, { columns, all: rows, choose, changed, kind, filters: {}, chosen: -1 });
    this.body = element("tbody");
    const width = columns.reduce((sum, one) => sum + one.width, 0);
    this.table = element("table", { style: `width:${width}ch` },
      element("colgroup", {}, columns.map((one) => element("col", { class: classes(one), style: `--width:${one.width}ch` }))), this.head(), this.body);
    this.holder = element("div", {
      class: columns.some((one) => one.more) ? "grid few" : "grid", tabindex: "0", role: "grid", "aria-label": label, "aria-colcount": columns.length,
      style: `max-height: calc(${rows.length * ROW}px + 8rem)`, onscroll: () => this.draw(), onkeydown: (event) => this.key(event),
      onclick: (event) => {
        const row = event.target.closest("tr[data-place]");
        if (row) this.select(Number(row.dataset.place));
      },
    }, this.table);
    new ResizeObserver(() => this.draw()).observe(this.holder);
    this.update();
  }

  head() {
    this.headings = this.columns.map((column) => element("th", { scope: "col", class: classes(column) },
      element("button", { type: "button", title: column.hint || "", onclick: () => this.sort(column) }, column.title,
        element("span", { class: "arrow", "aria-hidden": "true" }))));
    this.inputs = this.columns.map((column) => {
      const properties = { "aria-label": `Filter: ${column.title}`, "data-column": column.name, oninput: (event) => {
        this.filters[column.name] = event.target.value.trim();
        this.update();
      } };
      if (column.labels?.length <= MOST_CHOICES) return element("select", properties, element("option", { value: "", text: "all" }),
        column.labels.map((text) => element("option", { value: text, text })));
      return element("input", { type: "text", placeholder: column.numeric ? "e.g. −2..2, >5" : "contains", spellcheck: "false", ...properties });
    });
    const cells = this.inputs.map((input, i) => element("td", { class: classes({ ...this.columns[i], numeric: false }) }, input));
    return element("thead", {}, element("tr", {}, this.headings), element("tr", { class: "filters" }, cells));
  }

  // Ascending, descending, as the dataset has them.
  sort(column) {
    const same = this.sorting?.column === column;
    this.sorting = same && this.sorting.down ? null : { column, down: same };
    this.headings.forEach((heading, i) => {
      const way = this.sorting?.column !== this.columns[i] ? "none" : this.sorting.down ? "descending" : "ascending";
      heading.setAttribute("aria-sort", way);
      heading.querySelector(".arrow").textContent = { none: "", ascending: " ▲", descending: " ▼" }[way];
    });
    this.update();
  }

  reset() {
    this.filters = {};
    for (const input of this.inputs) input.value = "";
    this.update();
  }

  update() {
    const tests = this.columns.map((column) => this.test(column, this.filters[column.name] || ""));
    const wrong = this.columns.filter((_, i) => tests[i] === null);
    this.inputs.forEach((input, i) => input.toggleAttribute("aria-invalid", tests[i] === null));
    const asked = tests.filter(Boolean);
    this.order = this.all.filter((row) => asked.every((test) => test(row)));
    if (this.sorting) {
      const { column, down } = this.sorting, value = column.size || column.value, keys = new Map(this.order.map((row) => [row, value(row)]));
      this.order.sort((one, other) => {
        const [a, b] = [keys.get(one), keys.get(other)];
        if (absent(a) || absent(b)) return absent(a) - absent(b);
        return (a > b) - (a < b) ? ((a > b) - (a < b)) * (down ? -1 : 1) : one - other;
      });
    }
    this.placeOf = new Map(this.order.map((row, place) => [row, place]));
    this.holder?.setAttribute("aria-rowcount", this.order.length + 2);
    this.draw(true);
    this.changed?.(this.order.length, wrong.map((column) => `${column.title}: "${this.filters[column.name]}" is not a number. `
      + "Write a number, a range such as −2..2, or a bound such as >5 or <=0.1."));
  }

  // The test of a column's filter; undefined without a filter, null where it cannot be understood.
  test(column, asked) {
    if (!asked) return undefined;
    if (column.labels?.length <= MOST_CHOICES) return (row) => column.text(row) === asked;
    if (!column.numeric) return (row) => String(column.text(row)).toLowerCase().includes(asked.toLowerCase());
    const plain = asked.replaceAll("−", "-").replaceAll("≤", "<=").replaceAll("≥", ">=").replaceAll(",", ".").replace(/[%\s]/g, "");
    const [, low, high] = plain.match(/^(.+?)\.\.(.+)$/) || [], [, bound, limit] = plain.match(/^(<=|>=|<|>)(.+)$/) || [];
    if ([low, high, limit].some((one) => one && !Number.isFinite(Number(one)))) return null;
    if (low) return (row) => column.value(row) >= Number(low) && column.value(row) <= Number(high);
    if (bound) return (row) => BOUNDS[bound](column.value(row), Number(limit));
    return /^[-+]?[\d.]*(e[-+]?\d*)?$/.test(plain) ? (row) => column.text(row).replaceAll("−", "-").startsWith(plain) : null;
  }

  draw(anew = false) {
    if (!this.holder) return;
    const first = Math.max(0, Math.floor(this.holder.scrollTop / ROW) - 8);
    const last = Math.min(this.order.length, first + Math.ceil((this.holder.clientHeight || 400) / ROW) + 18);
    const seen = `${first} ${last} ${this.chosen}`;
    if (seen === this.seen && !anew) return;
    this.seen = seen;
    const shown = this.columns.filter((one) => !one.more || !this.holder.classList.contains("few")).length;
    const gap = (rows, text = "") => element("tr", { class: "gap" }, element("td", { colspan: shown, style: `height:${rows * ROW}px`, text }));
    const rows = this.order.slice(first, last).map((row, i) => this.row(row, first + i));
    this.body.replaceChildren(gap(first), ...rows, gap(this.order.length - last, this.order.length ? "" : "No row passes the filters."));
    if (this.placeOf.has(this.chosen)) this.holder.setAttribute("aria-activedescendant", `row-${this.chosen}`);
    else this.holder.removeAttribute("aria-activedescendant");
  }

  row(row, place) {
    const cells = this.columns.map((column, i) => element(i ? "td" : "th", {
      role: "gridcell", class: classes(column), title: column.numeric || column.node ? undefined : column.text(row),
    }, column.node ? column.node(row) : column.text(row)));
    const chosen = row === this.chosen;
    return element("tr", {
      "data-place": place, "aria-rowindex": place + 3, "aria-selected": String(chosen), id: `row-${row}`,
      class: `${chosen ? "chosen" : ""} ${this.kind?.(row) || ""}`,
    }, cells);
  }

  select(place) {
    this.mark(this.order[place]);
    this.choose?.(this.chosen);
  }

  // Show a row as chosen, and scroll to it.
  mark(row) {
    this.chosen = row;
    const place = this.placeOf.get(row), { holder } = this;
    if (place !== undefined) {
      const room = holder.clientHeight - this.table.tHead.offsetHeight - ROW;
      holder.scrollTop = Math.max(place * ROW - room, Math.min(holder.scrollTop, place * ROW));
    }
    this.draw();
  }

  key(event) {
    if (event.target !== this.holder || event.ctrlKey || event.metaKey || event.altKey) return;
    const here = this.placeOf.get(this.chosen) ?? -1, page = Math.max(1, Math.floor(this.holder.clientHeight / ROW) - 3), last = this.order.length - 1;
    const moves = { ArrowDown: here + 1, ArrowUp: here - 1, PageDown: here + page, PageUp: here - page, Home: 0, End: last };
    if (!(event.key in moves) || !this.order.length) return;
    event.preventDefault();
    this.select(Math.max(0, Math.min(last, moves[event.key])));
  }
}

function classes(column) {
  return [column.numeric && "number", column.pinned && "pinned", column.more && "more", column.narrow && "narrow"].filter(Boolean).join(" ");
}
