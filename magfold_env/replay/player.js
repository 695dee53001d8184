// The player, which connects the drawing and the diagrams with time, buttons and keys.

const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2]; // relative to simulated time
const PLAYED = 5; // shortest duration of the first play [s]
const MOST_VALUES = 40; // largest number of joints in a diagram
const PAN = 40; // distance per press of an arrow key [px]

class Player {
  constructor() {
    this.camera = new Camera(byId("drawing"), byId("ruler"));
    this.#listen();
  }

  /** Load another motion and show its first frame. */
  load(motion) {
    this.began = undefined;
    this.motion = motion;
    const drawing = byId("drawing"), { earlier, sequence } = motion.data;
    drawing.replaceChildren();
    drawSurroundings(drawing, motion);
    this.chains = [...earlier, [Infinity, sequence]].map(([until, faces]) =>
      ({ until, chain: new Chain(shape("g", {}, drawing), motion, faces) }));
    this.camera.look(wholeView(motion));
    this.plots = makePlots(motion, (time) => this.seek(time));
    byId("time").max = motion.last;
    this.#fillSpeeds();
    this.#mark();
    this.seek(motion.start);
  }

  get playing() {
    return this.began !== undefined;
  }

  play() {
    if (this.time >= this.motion.end) this.time = this.motion.start;
    this.began = { clock: performance.now(), time: this.time };
    this.#mark();
    requestAnimationFrame(() => this.#step());
  }

  pause() {
    this.began = undefined;
    this.#mark();
    this.#tell();
  }

  /** Show the state at a time [s]; if the motion is playing, it continues from there. */
  seek(time) {
    this.#show(time);
    if (this.playing) this.began = { clock: performance.now(), time: this.time };
    else this.#tell();
  }

  /** Move by frames. */
  jump(frames) {
    const { motion } = this, frame = motion.nearest(this.time) + frames;
    this.seek(motion.data.time[clamp(frame, 0, motion.last)]);
  }

  changeSpeed(by) {
    const choice = byId("speed");
    choice.selectedIndex = clamp(choice.selectedIndex + by, 0, SPEEDS.length - 1);
    if (this.playing) this.seek(this.time);
  }

  get speed() {
    return Number(byId("speed").value);
  }

  #step() {
    if (!this.playing) return;
    const gone = (performance.now() - this.began.clock) / 1000;
    this.#show(this.began.time + gone * this.speed);
    if (this.time >= this.motion.end) this.pause();
    else requestAnimationFrame(() => this.#step());
  }

  #show(time) {
    const { motion } = this;
    this.time = clamp(time, motion.start, motion.end);
    const frame = motion.nearest(this.time);
    const state = motion.at(this.time), now = this.chains.find(({ until }) => state.frame < until);
    for (const each of this.chains) each.chain.parent.style.display = each === now ? "" : "none";
    now.chain.draw(state);
    byId("time").value = frame;
    byId("clock").textContent = `${this.time.toFixed(3)} / ${motion.end.toFixed(3)} s`;
    byId("now").textContent = motion.description(frame);
    for (const plot of this.plots) plot.show(this.time, frame);
  }

  /** Describe the visible state to screen readers. */
  #tell() {
    const text = this.motion.description(this.motion.nearest(this.time));
    byId("drawing").setAttribute("aria-label", `Drawing of the chain: ${text}`);
    byId("time").setAttribute("aria-valuetext", text);
    byId("live").textContent = text;
  }

  #mark() {
    const button = byId("play");
    button.toggleAttribute("data-playing", this.playing);
    button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  #fillSpeeds() {
    byId("speed").replaceChildren();
    const slow = (this.motion.end - this.motion.start) / PLAYED;
    const usual = SPEEDS.findLast((each) => each <= Math.min(slow, 1)) ?? SPEEDS[0];
    for (const each of SPEEDS) {
      const option = write("option", each < 1 ? `1/${Math.round(1 / each)}` : `${each}×`, byId("speed"));
      option.value = each;
      option.selected = each === usual;
    }
  }

  #listen() {
    const slider = byId("time");
    slider.addEventListener("input", () => this.seek(this.motion.data.time[slider.value]));
    byId("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    byId("speed").addEventListener("change", () => this.changeSpeed(0));
    const zooms = {
      in: () => this.camera.zoom(ZOOM), out: () => this.camera.zoom(1 / ZOOM), fit: () => this.camera.fit(),
    };
    for (const button of document.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", zooms[button.dataset.zoom]);
    }
    document.addEventListener("keydown", (event) => this.#key(event, zooms));
  }

  #key(event, zooms) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const on = event.target, many = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => byId("play").click(),
      ArrowLeft: () => this.jump(-many), ArrowRight: () => this.jump(many),
      Home: () => this.seek(this.motion.start), End: () => this.seek(this.motion.end),
      "[": () => this.changeSpeed(-1), "]": () => this.changeSpeed(1),
      "+": zooms.in, "=": zooms.in, "-": zooms.out, 0: zooms.fit,
    };
    if (on.id === "drawing") {
      Object.assign(keys, {
        ArrowLeft: () => this.camera.pan(PAN, 0), ArrowRight: () => this.camera.pan(-PAN, 0),
        ArrowUp: () => this.camera.pan(0, PAN), ArrowDown: () => this.camera.pan(0, -PAN),
      });
    }
    // Buttons, lists and summaries handle the space bar and the arrow keys themselves.
    const own = on.matches("button, select, summary") && (event.key === " " || on.matches("select"));
    if (own || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  }
}

function makePlots(motion, seek) {
  const { data } = motion, joints = motion.count - 1, drawn = {
    energies: true, push: data.push !== null, joints: joints >= 1 && joints <= MOST_VALUES,
  };
  for (const [name, any] of Object.entries(drawn)) {
    const figure = byId(name);
    figure.hidden = !any;
    figure.replaceChildren(figure.querySelector("figcaption"));
  }
  const energies = [["magnetic", data.magnetic], ["kinetic", data.kinetic]]
    .filter(([, values]) => values)
    .map(([name, values]) => ({ name, values, unit: " mJ" }));
  const plots = [new Plot(byId("energies"), data.time, energies, { digits: 3, seek })];
  if (drawn.push) {
    const push = { name: "mean since the frame before", values: data.push, unit: " N" };
    plots.push(new Plot(byId("push"), data.time, [push], { digits: 3, seek }));
  }
  if (!drawn.joints) return plots;
  const rows = data.time.map((_, frame) => motion.joints(frame));
  const lines = rows[0].map((_, k) => ({ name: `${k + 1}`, values: rows.map((row) => row[k]), unit: "°" }));
  const ticks = [-90, -45, 0, 45, 90];
  return [...plots, new Plot(byId("joints"), data.time, lines, { ticks, digits: 1, seek })];
}

byId("theme").addEventListener("click", () => {
  const root = document.documentElement.style, dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const shown = root.colorScheme || (dark ? "dark" : "light");
  root.colorScheme = shown === "dark" ? "light" : "dark";
});
