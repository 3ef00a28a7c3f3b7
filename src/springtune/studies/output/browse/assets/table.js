// A table of many rows of which only those in view are elements; sorted, filtered, and walked by keyboard.

const ROW = 28;

class Table {
  // columns: {name, title, hint, width, numeric, value(row), text(row), labels?, pinned?}; rows: numbers of rows.
  // `extra` makes one more test of rows; `kind` gives a row its class.
  constructor(holder, { columns, rows, label, choose, changed, extra, kind }) {
    Object.assign(this, { columns, all: rows, choose, changed, extra, kind });
    this.sorting = null;
    this.filters = {};
    this.order = rows;
    this.chosen = -1;
    this.body = element("tbody");
    this.holder = element("div", {
      class: "grid", tabindex: "0", role: "grid", "aria-label": label, "aria-colcount": columns.length,
      style: `max-height: calc(${rows.length * ROW}px + 8rem)`, onscroll: () => this.draw(), onkeydown: (event) => this.key(event),
      onclick: (event) => {
        const row = event.target.closest("tr[data-place]");
        if (row) this.select(Number(row.dataset.place), true);
      },
    });
    const widths = element("colgroup", {}, columns.map((one) => element("col", { style: `width:${one.width}ch` })));
    const width = columns.reduce((sum, one) => sum + one.width, 0);
    this.table = element("table", { style: `width:${width}ch` }, widths, this.head(), this.body);
    this.holder.append(this.table);
    holder.replaceChildren(this.holder);
    this.seen = "";
    new ResizeObserver(() => this.draw()).observe(this.holder);
    this.update();
  }

  head() {
    this.headings = this.columns.map((column) => {
      const button = element("button", { type: "button", title: column.hint || "", onclick: () => this.sort(column) },
        column.title, element("span", { class: "arrow", "aria-hidden": "true" }));
      return element("th", { scope: "col", class: classes(column) }, button);
    });
    const filters = this.columns.map((column) => {
      const set = (text) => {
        this.filters[column.name] = text;
        this.update();
      };
      const name = `Filter: ${column.title}`;
      let input;
      if (column.labels && column.labels.length <= 60) {
        input = element("select", { "aria-label": name, onchange: () => set(input.value) },
          element("option", { value: "", text: "all" }),
          column.labels.map((text) => element("option", { value: text, text })));
      } else {
        const hint = column.numeric ? "e.g. −2..2, >5" : "contains";
        input = element("input", {
          type: "text", "aria-label": name, placeholder: hint, spellcheck: "false", oninput: () => set(input.value),
          title: column.numeric ? "A number, a range such as -2..2, or a bound such as >5 or <=0.1" : "Texts that contain this",
        });
      }
      input.dataset.column = column.name;
      return element("td", { class: column.pinned ? "pinned" : "" }, input);
    });
    return element("thead", {}, element("tr", {}, this.headings), element("tr", { class: "filters" }, filters));
  }

  sort(column) {
    const same = this.sorting?.column === column;
    this.sorting = same && this.sorting.down ? null : { column, down: same };
    this.headings.forEach((heading, i) => {
      const here = this.sorting?.column === this.columns[i];
      const way = here ? (this.sorting.down ? "descending" : "ascending") : "none";
      heading.setAttribute("aria-sort", way);
      heading.querySelector(".arrow").textContent = here ? (this.sorting.down ? " ▼" : " ▲") : "";
    });
    this.update();
  }

  reset() {
    this.filters = {};
    for (const input of this.table.tHead.querySelectorAll("[data-column]")) input.value = "";
    this.update();
  }

  update() {
    const wrong = [];
    const tests = this.columns.map((column) => {
      const test = this.test(column), field = this.table.tHead.querySelector(`[data-column="${CSS.escape(column.name)}"]`);
      if (typeof test === "string") wrong.push(`${column.title}: ${test}`);
      field.toggleAttribute("aria-invalid", typeof test === "string");
      return test;
    }).filter((test) => typeof test === "function");
    const extra = this.extra();
    let rows = this.all.filter((row) => extra(row) && tests.every((test) => test(row)));
    if (this.sorting) {
      const { column, down } = this.sorting, way = down ? -1 : 1;
      const value = column.sortValue || column.value;
      const keyed = rows.map((row, i) => [value(row), i, row]);
      const absent = (one) => one === "" || Number.isNaN(one);
      keyed.sort(([a, i], [b, j]) => {
        if (absent(a) || absent(b)) return absent(a) - absent(b) || i - j;
        return (a < b ? -way : a > b ? way : 0) || i - j;
      });
      rows = keyed.map((one) => one[2]);
    }
    this.order = rows;
    this.places = new Map(rows.map((row, place) => [row, place]));
    this.holder.setAttribute("aria-rowcount", rows.length + 2);
    this.seen = "";
    this.draw();
    this.changed?.(rows.length, this.all.length, wrong, Object.values(this.filters).some((text) => text.trim()));
  }

  // What a row must pass in a column; nothing where its filter is empty, words where it cannot be understood.
  test(column) {
    const asked = (this.filters[column.name] || "").trim();
    if (!asked) return null;
    if (column.labels && column.labels.length <= 60) return (row) => column.text(row) === asked;
    if (!column.numeric) {
      const lower = asked.toLowerCase();
      return (row) => String(column.text(row)).toLowerCase().includes(lower);
    }
    const plain = asked.replaceAll("−", "-").replaceAll(",", ".").replace(/[%\s]/g, "");
    const range = plain.match(/^(.+?)\.\.(.+)$/), bound = plain.match(/^(<=|>=|<|>|≤|≥)(.+)$/);
    const numbers = range ? range.slice(1) : [bound ? bound[2] : plain];
    if (plain !== "–" && !numbers.every((text) => Number.isFinite(Number(text)) || !range && !bound && /^[-+]?[\d.]*(e-?)?$/.test(text)))
      return `"${asked}" is not a number. Write a number, a range such as −2..2, or a bound such as >5 or <=0.1.`;
    if (range) return (row) => column.value(row) >= Number(range[1]) && column.value(row) <= Number(range[2]);
    if (bound) {
      const limit = Number(bound[2]);
      const tests = {
        "<": (one) => one < limit, ">": (one) => one > limit, "<=": (one) => one <= limit,
        ">=": (one) => one >= limit, "≤": (one) => one <= limit, "≥": (one) => one >= limit,
      };
      return (row) => tests[bound[1]](column.value(row));
    }
    const sought = plain.toLowerCase();
    return (row) => String(column.text(row)).replaceAll("−", "-").toLowerCase().startsWith(sought);
  }

  draw() {
    const height = this.holder.clientHeight || 400;
    const first = Math.max(0, Math.floor(this.holder.scrollTop / ROW) - 8);
    const last = Math.min(this.order.length, first + Math.ceil(height / ROW) + 18);
    const key = `${first} ${last} ${this.chosen}`;
    if (key === this.seen) return;
    this.seen = key;
    const gap = (rows) => element("tr", { class: "gap", "aria-hidden": "true" },
      element("td", { colspan: this.columns.length, style: `height:${rows * ROW}px` }));
    const rows = [];
    if (first > 0) rows.push(gap(first));
    for (let place = first; place < last; place++) {
      const row = this.order[place], chosen = row === this.chosen;
      const cells = this.columns.map((column, i) => {
        const cell = element(i ? "td" : "th", { role: "gridcell", class: classes(column) });
        if (column.node) cell.append(column.node(row));
        else cell.textContent = column.text(row);
        if (!column.numeric && !column.node) cell.title = cell.textContent;
        return cell;
      });
      rows.push(element("tr", {
        "data-place": place, "aria-rowindex": place + 3, "aria-selected": String(chosen), id: `row-${row}`,
        class: [chosen && "chosen", this.kind?.(row)].filter(Boolean).join(" "),
      }, cells));
    }
    if (last < this.order.length) rows.push(gap(this.order.length - last));
    if (!this.order.length)
      rows.push(element("tr", {}, element("td", { colspan: this.columns.length, class: "empty",
        text: this.asked() })));
    this.body.replaceChildren(...rows);
    if (this.places.has(this.chosen)) this.holder.setAttribute("aria-activedescendant", `row-${this.chosen}`);
    else this.holder.removeAttribute("aria-activedescendant");
  }

  // Why there is no row.
  asked() {
    const set = this.columns.map((column) => [column.title, (this.filters[column.name] || "").trim()]).filter(([, text]) => text);
    return set.length ? `No cell has ${set.map(([title, text]) => `${title}: "${text}"`).join(" and ")}.` : "No cell has a chosen status.";
  }

  // Show a row as chosen; `tell` says so to the rest of the page.
  select(place, tell = false) {
    if (place < 0 || place >= this.order.length) return;
    this.mark(this.order[place], false);
    if (tell) this.choose(this.chosen);
  }

  mark(row, scroll = true) {
    this.chosen = row;
    const place = this.places.get(row);
    if (place !== undefined) {
      const head = this.table.tHead.offsetHeight, top = place * ROW, view = this.holder.clientHeight - head;
      if (top < this.holder.scrollTop) this.holder.scrollTop = top;
      else if (top + ROW > this.holder.scrollTop + view) this.holder.scrollTop = top + ROW - view;
      else if (scroll && this.holder.scrollTop > top) this.holder.scrollTop = top;
    }
    this.draw();
  }

  key(event) {
    if (event.target !== this.holder || event.ctrlKey || event.metaKey || event.altKey) return;
    const here = this.places.has(this.chosen) ? this.places.get(this.chosen) : -1;
    const page = Math.max(1, Math.floor(this.holder.clientHeight / ROW) - 3), last = this.order.length - 1;
    const moves = {
      ArrowDown: here + 1, ArrowUp: here - 1, PageDown: here + page, PageUp: here - page, Home: 0, End: last,
    };
    if (!(event.key in moves)) return;
    event.preventDefault();
    this.select(Math.max(0, Math.min(last, moves[event.key])), true);
  }
}

function classes(column) {
  return [column.numeric && "number", column.pinned && "pinned"].filter(Boolean).join(" ");
}
