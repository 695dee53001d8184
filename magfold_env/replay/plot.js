// A diagram over time with a cursor, which a click or a drag moves.

const ROOM = { left: 46, right: 10, top: 10, bottom: 20 }; // [px]
const DASHES = ["none", "6 3", "2 3", "8 3 2 3"];
const HUES = 7;

class Plot {
  /**
   * Lines are { name, values, unit }; `ticks` are values on the axis; `seek` gets a time [s].
   */
  constructor(figure, times, lines, { ticks = [], digits, seek }) {
    Object.assign(this, { times, lines, digits });
    this.drawing = shape("svg", { class: "plot", role: "img" }, figure);
    this.drawing.setAttribute("aria-label", this.#summary(figure));
    this.canvas = shape("g", {}, this.drawing);
    this.cursor = shape("line", { class: "cursor" }, this.drawing);
    this.values = this.#legend(figure);
    this.range = this.#range(ticks);
    this.ticks = ticks.length ? ticks : steps(...this.range, 5);
    const pick = (event) => seek(this.#time(event));
    this.drawing.addEventListener("pointerdown", (event) => {
      this.drawing.setPointerCapture(event.pointerId);
      pick(event);
    });
    this.drawing.addEventListener("pointermove", (event) => {
      if (event.buttons) pick(event);
    });
    new ResizeObserver(() => this.#draw()).observe(this.drawing);
  }

  /** Move the cursor to a time [s] and write the values of a frame. */
  show(time, frame) {
    this.time = time;
    this.#point();
    for (const [k, value] of this.values.entries()) {
      value.textContent = this.#quantity(this.lines[k], frame);
    }
  }

  #point() {
    if (this.time === undefined || !this.width) return; // not laid out yet
    const x = this.#x(this.time);
    set(this.cursor, { x1: x, x2: x, y1: ROOM.top, y2: this.height - ROOM.bottom });
  }

  #x(time) {
    const span = this.times.at(-1) - this.times[0] || 1;
    return ROOM.left + (time - this.times[0]) / span * (this.width - ROOM.left - ROOM.right);
  }

  #y(value) {
    const [low, high] = this.range, inner = this.height - ROOM.top - ROOM.bottom;
    return ROOM.top + (high - value) / (high - low) * inner;
  }

  #time(event) {
    const x = event.clientX - this.drawing.getBoundingClientRect().left;
    const share = clamp((x - ROOM.left) / (this.width - ROOM.left - ROOM.right), 0, 1);
    return this.times[0] + share * (this.times.at(-1) - this.times[0]);
  }

  #range(ticks) {
    let [low, high] = [Math.min(...ticks, 0), Math.max(...ticks, 0)];
    for (const { values } of this.lines) {
      for (const value of values.filter(Number.isFinite)) {
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    const room = 0.06 * (high - low) || 1;
    return [low - room, high + room];
  }

  #summary(figure) {
    const last = this.times.length - 1;
    const ends = this.lines.map((line) =>
      `${line.name} ${this.#quantity(line, 0)} to ${this.#quantity(line, last)}`);
    return `${figure.querySelector("figcaption").textContent} over time: ${ends.join(", ")}`;
  }

  #quantity({ values, unit }, frame) {
    return minus(values[frame].toFixed(this.digits)) + unit;
  }

  #legend(figure) {
    const list = write("ul", "", figure);
    list.className = "legend";
    return this.lines.map(({ name }, k) => {
      const entry = write("li", "", list);
      const sample = shape("svg", { viewBox: "0 0 24 8", "aria-hidden": "true" }, entry);
      shape("path", { d: "M0 4H24", style: stroke(k), "stroke-width": 2.5 }, sample);
      write("span", name, entry);
      return write("b", "", entry);
    });
  }

  #draw() {
    const { width, height } = this.drawing.getBoundingClientRect();
    if (!width || !height) return;
    Object.assign(this, { width, height });
    set(this.drawing, { viewBox: `0 0 ${width} ${height}` });
    this.canvas.replaceChildren();
    for (const tick of this.ticks) {
      const y = this.#y(tick);
      shape("path", { class: "grid", d: `M${ROOM.left} ${y}H${width - ROOM.right}` }, this.canvas);
      this.#label(ROOM.left - 6, y + 4, "end", minus(String(tick)));
    }
    for (const tick of steps(this.times[0], this.times.at(-1), width / 75)) {
      this.#label(this.#x(tick), height - 5, "middle", `${tick} s`);
    }
    for (const [k, { values }] of this.lines.entries()) {
      const known = [...values.keys()].filter((i) => Number.isFinite(values[i]));
      const places = known.map((i, later) =>
        `${later ? "L" : "M"}${this.#x(this.times[i]).toFixed(1)} ${this.#y(values[i]).toFixed(1)}`);
      shape("path", { class: "line", d: places.join(""), style: stroke(k) }, this.canvas);
    }
    this.#point();
  }

  #label(x, y, anchor, text) {
    shape("text", { x, y, "text-anchor": anchor }, this.canvas).textContent = text;
  }
}

function stroke(k) {
  const dash = DASHES[Math.floor(k / HUES) % DASHES.length];
  return `stroke: var(--line-${k % HUES}); stroke-dasharray: ${dash}`;
}

const minus = (text) => text.replace("-", "−");

/** Return about `count` round numbers between two numbers. */
function steps(low, high, count) {
  const rough = (high - low) / Math.max(count, 1) || 1, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((each) => each * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k += 1) {
    found.push(Number((k * step).toPrecision(12)));
  }
  return found;
}
