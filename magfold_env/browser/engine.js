// The engine in a browser: kernels compiled from Python, and the memory that they work on. This
// file only passes numbers in and out; the kernels interpret them.

import { cornersOf, POLES, readScene, SceneError } from "./scene.js";

export { SceneError };

const PAGE = 65536; // bytes in a page of WebAssembly memory
const ALIGNED = 64;
const MILLI = 1e3;
const LETTERS = { "1": "L", "0": "S", "-1": "R" };
// Sizes of a search's parts, a millisecond or less; the page can do other work in between.
const COUPLED_AT_ONCE = 8; // poses
const VISITED_AT_ONCE = 2000; // steps
const VIEWS = { f64: Float64Array, f32: Float32Array, i64: BigInt64Array, u8: Uint8Array };

/** All chains of a page, side by side in one memory. */
export class Engine {
  /** Return an engine from what the build wrote: bytes `wasm` and `memory`, and object `layout`. */
  static async load({ wasm, memory, layout }) {
    const { instance } = await WebAssembly.instantiate(wasm, {});
    return new Engine(instance, memory, layout);
  }

  constructor(instance, memory, layout) {
    this.kernels = instance.exports;
    this.layout = layout;
    this.images = new Uint8Array(memory);
    this.end = this.kernels.__heap_base.value;
    this.spare = new Map(); // places of deleted chains, by the chains' length
    this.shares = []; // of casings and magnets of the same sizes
    this.standard = readScene({ sequence: ["----", "----"] }, layout).sizes;
    this.share(this.standard).users += 1;
  }

  /**
   * Return a chain at the start of its run.
   *
   * `scene` has the entries of `magfold_env.scene.Scene`, see scene.js. `frameRate` is the rate of
   * recorded frames [1/s]; 0 records none. If the scene leaves the start to chance, `random` draws
   * it in numbers from [0, 1). An `endless` chain ignores the `duration`. Throws a SceneError.
   */
  chain(scene, { frameRate = 0, random = Math.random, endless = false } = {}) {
    return new Chain(this, scene, frameRate, random, endless);
  }

  /** Return the data that chains of these sizes share, which are computed if no chain has them. */
  share(sizes) {
    const key = String(sizes), { layout } = this;
    const known = this.shares.find((each) => each.key === key);
    if (known) return known;
    let share = this.shares.find(({ users }) => users === 0);
    if (!share) this.shares.push(share = { place: this.take(layout.shared.size), users: 0 });
    share.key = key;
    this.put(layout.shared, share);
    this.#compute(share.place, sizes, key === String(this.standard));
    return share;
  }

  /** Compute the tables, and for other than standard sizes what the stored block lacks. */
  #compute(place, [side, ...lengths], standard) {
    const { kernels, layout: { shared, words, tableErrors: [most, mostFar] } } = this;
    const at = Object.fromEntries(Object.entries(shared.roots).map(([name, root]) => [name, place + root]));
    const of = (name) => this.view(shared, place, name), diagonal = Math.SQRT2 * side;
    of("sizing.size").set([side, ...lengths].flatMap((length) => Array(4).fill(length)));
    const { far, near, near_magnets, far_magnets, magnets } = at;
    if (!standard) {
      of("couplings.half")[0] = 0.5 * diagonal;
      kernels.size_magnets(at.sizing, magnets);
      kernels.size_magnets(at.near_sizing, near_magnets);
      kernels.size_magnets(at.far_sizing, far_magnets);
      // Where tables would be too inexact, there are none.
      if (kernels.fill_near_table(near, near_magnets, diagonal) > most) {
        of("near.number").fill(0);
        of("far.number").fill(0);
        return;
      }
    }
    kernels.fill_far_table(far, far_magnets, side);
    if (!standard && kernels.far_error(far, far_magnets, magnets + 8 * words.far, side) > mostFar) {
      of("far.number").fill(0);
    }
  }

  /** Return a view of a field's numbers in a block. */
  view({ fields }, place, name) {
    const [offset, type, shape] = fields[name];
    return new VIEWS[type](this.buffer, place + offset, shape.reduce((a, b) => a * b, 1));
  }

  get buffer() {
    return this.kernels.memory.buffer;
  }

  /** Reserve a number of bytes [1] and return where they begin. */
  take(size) {
    const place = Math.ceil(this.end / ALIGNED) * ALIGNED;
    this.end = place + size;
    const missing = Math.ceil((this.end - this.buffer.byteLength) / PAGE);
    if (missing > 0) this.kernels.memory.grow(missing);
    return place;
  }

  /** Write a block's initial contents and addresses to its place; `shared` is its shared block's. */
  put(block, { place }, shared = place) {
    const bytes = new Uint8Array(this.buffer), words = new Uint32Array(this.buffer);
    bytes.fill(0, place, place + block.size);
    let first = block.first;
    for (const [offset, length] of block.pieces) {
      bytes.set(this.images.subarray(first, first + length), place + offset);
      first += length;
    }
    for (const [steps, begin] of [[block.own, place], [block.shared, shared]]) {
      let word = place;
      for (const step of steps) {
        word += step;
        words[word / 4] += begin;
      }
    }
  }
}

/** A chain at any moment of its run. */
export class Chain {
  constructor(engine, scene, frameRate, random, endless) {
    this.engine = engine;
    this.told = readScene(scene, engine.layout);
    if (endless) this.told.duration = Infinity;
    this.n = this.told.sequence.length;
    const fastest = engine.layout.fastestFrames;
    if (!(frameRate >= 0 && frameRate <= fastest)) {
      const allowed = `must be a number from 0 to ${fastest}`;
      throw new SceneError([{ key: "frameRate", value: frameRate, allowed }]);
    }
    this.block = engine.layout.chains[this.n];
    this.share = engine.share(this.told.sizes);
    this.share.users += 1;
    this.place = engine.spare.get(this.n)?.pop() ?? engine.take(this.block.size);
    this.roots = Object.fromEntries(
      Object.entries(this.block.roots).map(([name, offset]) => [name, this.place + offset]));
    this.begin(frameRate, random);
  }

  // --- actions for a page ---

  /** Return to the start of the run; draw a new start if the scene leaves it to chance. */
  begin(frameRate = this.frameRate, random = Math.random) {
    const { engine, told, n } = this, { layout, kernels } = engine;
    this.frameRate = frameRate;
    this.recorded = [];
    this.status = null;
    this.message = "";
    const { settings, model, state, probe, view } = this.roots;
    const { roots } = layout.shared, { place } = this.share, { words } = layout;
    engine.put(this.block, this, place);
    const [from, to] = [place + roots.magnets, model + 8 * words.magnets];
    new Uint8Array(engine.buffer).copyWithin(to, from, from + 8 * words.count);
    kernels.resize(place + roots.sizing, place + roots.magnets, told.rounding, settings, model);
    this.#fill("settings.pole", told.poles.flat().map(BigInt));
    this.#fill("settings.remanence", told.remanence.flat());
    this.#fill("model.bodies.mass", this.#ordered(told.mass));
    this.#fill("settings.friction", this.#ordered(told.friction));
    this.#fill("state.speed", this.#ordered(told.speed));
    this.#fill("settings.obstacles", told.obstacles.flat());
    const { choice, number } = layout, choices = this.field("settings.choice");
    choices[choice.MOUNT] = BigInt(layout.mounts.indexOf(told.mount));
    choices[choice.FORWARD] = BigInt(told.direction === "forward");
    choices[choice.AT_MOUTH] = BigInt(told.loading === "at_mouth");
    choices[choice.OBSTACLES] = BigInt(told.obstacles.length);
    const numbers = this.field("settings.number");
    numbers[number.NORMAL] = told.normal;
    numbers[number.DURATION] = told.duration;
    numbers[number.FORCE_LIMIT] = told.forceLimit;
    numbers[number.BORE] = told.bore;
    numbers[number.WALL] = told.wall;
    numbers[number.TOLERANCE] = told.tolerance;
    numbers[number.MAX_STEPS] = told.maxSteps;
    numbers[number.INTERVAL] = frameRate > 0 ? 1 / frameRate : 0;
    if (told.start) {
      this.#fill("settings.start", told.start);
    } else {
      this.#fill("settings.start", Array.from({ length: n + 1 }, () => 2 * random() - 1));
      kernels.draw(settings, model, told.spread);
    }
    const length = told.mount === "tube" ? n + 1 : n - 1;
    /** Initial joint angles [rad], or for a chain in a tube the hinges' offsets [m]. */
    this.start = [...this.field("settings.start").subarray(0, length)];
    this.#fill("settings.start", this.#ordered(this.start));
    kernels.set_up(settings, model, state, view);
    this.#refuseOverlap(kernels.overlap(settings, model, state, probe));
  }

  /**
   * Run until a time [s] or the end of the run; return the status, null if the run has not ended.
   *
   * `speed` sets the feed's speed, see `push`. If `until` is infinite, a feed at rest parks.
   */
  run(until = Infinity, { speed } = {}) {
    if (speed !== undefined) this.push(speed);
    for (const _ of this.running(until)) continue;
    return this.status;
  }

  /** Do what `run` does, as a generator that yields at least every 50 ms of work. */
  *running(until = Infinity) {
    const { kernels, layout } = this.engine, { outcome: outcomes } = layout;
    const { model, state, work, record } = this.roots;
    while (this.status === null) {
      const outcome = kernels.run(model, state, work, record, until);
      this.#keepFrames();
      if (outcome === outcomes.REACHED) return;
      if (outcome === outcomes.PAUSED) yield;
      else this.#end(outcome);
    }
  }

  /** Set the feed's speed [m/s], or one per component in the mouth; negative speeds pull back. */
  push(speed) {
    const speeds = Array.isArray(speed) ? speed : Array(this.n).fill(speed);
    const { most } = this.engine.layout.most.speed;
    if (speeds.length !== this.n || !speeds.every((each) => Number.isFinite(each) && Math.abs(each) <= most)) {
      const allowed = `must be a number from -${most} to ${most}, or ${this.n}`;
      throw new SceneError([{ key: "speed", value: speed, allowed }]);
    }
    this.#fill("state.speed", this.#ordered(speeds));
  }

  /**
   * Rank the chain's words by their magnetic energy, as `mf.minimise` does.
   *
   * A generator that yields after each small part of the work. It returns the states of least
   * energy [J], lowest first: [{ word, energy, stable }].
   */
  *ranking() {
    const { kernels, layout } = this.engine, { settings, search } = this.roots, { place } = this.share;
    const couplings = place + layout.shared.roots.couplings, magnets = place + layout.shared.roots.magnets;
    while (!kernels.couple(couplings, magnets, this.n, COUPLED_AT_ONCE)) yield;
    kernels.begin_search(settings, couplings, search);
    while (!kernels.visit(search, VISITED_AT_ONCE)) yield;
    const count = Number(this.field("search.progress")[layout.progress.FOUND]);
    const letters = this.field("search.letter"), stable = this.field("search.stable");
    return [...this.field("search.best").subarray(0, count)].map((energy, k) => ({
      word: wordOf(letters.subarray(k * this.n, (k + 1) * this.n)),
      energy,
      stable: stable[k] === 1n,
    }));
  }

  /** Free the chain's memory for other chains. */
  free() {
    const { spare } = this.engine;
    if (!spare.has(this.n)) spare.set(this.n, []);
    spare.get(this.n).push(this.place);
    this.place = NaN;
    this.share.users -= 1;
  }

  // --- values for a page ---

  /** Simulated time [s]. */
  get time() {
    return this.field("state.clock")[this.engine.layout.clock.TIME];
  }

  /** Number of time steps so far. */
  get steps() {
    return this.#count("STEPS");
  }

  /** Number of evaluations of the accelerations so far. */
  get evaluations() {
    return this.#count("EVALUATIONS");
  }

  /** Number of components out of the tube; all if there is no tube. */
  get released() {
    return this.n - this.#count("N_HELD");
  }

  /** Largest force of the feed so far [N]. */
  get pushPeak() {
    return this.field("state.account")[this.engine.layout.account.PEAK];
  }

  /** Return headings [rad], component 1 first. */
  headings() {
    return this.#look("heading");
  }

  /** Return rates of the headings [rad/s]. */
  rates() {
    return this.#look("rate");
  }

  /** Return where component 1's outer hinge is [m]. */
  base() {
    return this.#look("base");
  }

  /** The nearest fold word; empty if the simulation broke down. */
  get word() {
    return this.headings().every(Number.isFinite)
      ? wordOf(this.#look("letter"))
      : "";
  }

  /** Return the magnetic energy [J], of active magnets only. */
  energy() {
    const { model, state, probe } = this.roots;
    return this.engine.kernels.energy(model, state, probe, 0);
  }

  /** Return magnetic and kinetic energy [J], the feed's travel [m] and the time [s]. */
  now() {
    return this.#frame(-1);
  }

  /** Return the engine's own coordinates: headings from the inner end, then the base [rad, m]. */
  coordinates() {
    return [...this.field("state.q")];
  }

  /** Return the recording in the form of the replay's `Motion`: lengths in mm, energies in mJ. */
  frames() {
    const { told } = this, [side, width, , thickness, inset] = told.sizes.map((length) => MILLI * length);
    const rows = this.#allFrames(), tube = told.mount === "tube";
    const backward = tube && told.direction === "backward";
    return {
      word: this.word,
      status: this.status ?? "",
      message: this.message,
      sequence: told.sequence,
      earlier: [],
      side,
      order: told.sequence.map((_, k) => (backward ? this.n - 1 - k : k)),
      magnets: Object.fromEntries(Object.entries({ width, thickness, inset })
        .map(([name, length]) => [name, Array(4).fill(length)])),
      pinned: told.mount === "pinned",
      tube: tube ? { bore: MILLI * told.bore, wall: MILLI * told.wall } : null,
      obstacles: told.obstacles.map((each) => cornersOf(each).map((corner) => corner.map((x) => MILLI * x))),
      field: null,
      facts: this.#facts(),
      time: rows.map((row) => row.time),
      angles: rows.map((row) => row.angles),
      base: rows.map((row) => row.base.map((x) => MILLI * x)),
      released: rows.map((row) => row.released),
      loaded: rows.map((row) => row.loaded),
      magnetic: rows.map((row) => MILLI * row.magnetic),
      kinetic: rows.map((row) => MILLI * row.kinetic),
      push: tube ? rows.map((row) => row.push) : null,
    };
  }

  // --- other values in memory ---

  /** Return a view of a field's numbers, such as "state.q", for reading and writing. */
  field(name) {
    return this.engine.view(this.block, this.place, name);
  }

  /** Call a kernel with the chain's data of the given names, such as "model". */
  call(kernel, ...names) {
    const { roots } = this;
    return this.engine.kernels[kernel](...names.map((name) => roots[name]));
  }

  /** Set faces and speed [m/s] of component k, from 0, the next to leave its tube; then pause. */
  choose(k, faces, speed) {
    this.field("settings.pole").set([...faces].map((face) => BigInt(POLES[face])), 4 * k);
    this.field("state.speed")[this.#flip() ? this.n - 1 - k : k] = speed;
    this.told.sequence = this.told.sequence.with(k, faces);
    this.engine.kernels.choose(this.roots.settings, this.roots.state, k);
  }

  /** Note the chain's pose for the agent's observation; `forward` is the direction of feed. */
  see(forward) {
    this.#seen(-1);
    const { view, episode } = this.roots;
    this.engine.kernels.take_in(Number(forward), view, episode);
  }

  /** Impulse of the feed so far [N·s]. */
  get impulse() {
    return this.field("state.account")[this.engine.layout.account.IMPULSE];
  }

  // --- private ---

  #fill(name, values) {
    this.field(name).set(values);
  }

  #count(name) {
    return Number(this.field("state.counter")[this.engine.layout.counter[name]]);
  }

  #flip() {
    return Number(this.told.mount === "tube" && this.told.direction === "forward");
  }

  /** Return values of the components, given component 1 first, in the engine's order. */
  #ordered(values) {
    return this.#flip() ? values.toReversed() : values;
  }

  #seen(frame) {
    const { model, state, probe, record, view } = this.roots;
    this.engine.kernels.look(this.#flip(), model, state, probe, record, view, frame);
  }

  #look(name) {
    this.#seen(-1);
    return [...this.field(`view.${name}`)].map(Number);
  }

  #frame(frame) {
    this.#seen(frame);
    const { view } = this.engine.layout, feed = this.field("view.feed");
    const energy = this.field("view.energy"), count = this.field("view.number");
    return {
      time: feed[view.TIME],
      advance: feed[view.ADVANCE],
      push: feed[view.PUSH],
      magnetic: energy[view.MAGNETIC],
      kinetic: energy[view.KINETIC],
      released: Number(count[view.RELEASED]),
      loaded: Number(count[view.LOADED]),
      angles: [...this.field("view.heading")],
      base: [...this.field("view.base")],
    };
  }

  #keepFrames() {
    const counters = this.field("state.counter"), { FRAMES } = this.engine.layout.counter;
    const count = Number(counters[FRAMES]);
    for (let frame = 0; frame < count; frame++) this.recorded.push(this.#frame(frame));
    counters[FRAMES] = 0n;
  }

  /** Return the recorded frames, and the present state as the last frame. */
  #allFrames() {
    const last = this.#frame(-1), rows = [...this.recorded];
    // An impact may have followed a frame recorded at the same time.
    if (rows.length > 0 && last.time - rows.at(-1).time < this.engine.layout.apart) {
      last.push = rows.pop().push;
    }
    // The last poses of a simulation that failed may not be finite.
    return [...rows, last].filter(({ time, angles, base }) => [time, ...angles, ...base].every(Number.isFinite));
  }

  #end(outcome) {
    const { kernels, layout } = this.engine, { state, view } = this.roots;
    this.#seen(-1);
    const status = kernels.ending(outcome, state, view);
    const time = this.time, at = `at t = ${short(time, 6)} s`;
    if (status < 0) {
      const [name, reason] = layout.breakdowns[outcome], { maxSteps } = this.told;
      const limit = this.steps >= maxSteps
        ? `${maxSteps} steps` : `${layout.scene.solver.max_steps_per_second} steps a second`;
      this.status = name;
      this.message = reason.replace("{at}", at).replace("{limit}", limit);
      return;
    }
    this.status = layout.statuses[status];
    this.message = outcome === layout.outcome.TIMED_OUT
      ? `still moving after ${short(time, 4)} s`
      : `${this.status} at t = ${short(time, 4)} s`;
  }

  #refuseOverlap(found) {
    if (found === 0) return;
    this.status = this.engine.layout.failed;
    this.message = found < 0
      ? `component ${-found} and an obstacle overlap at the start`
      : `components ${Math.floor(found / 100)} and ${found % 100} overlap at the start`;
  }

  #facts() {
    const { told } = this, facts = [["Sequence", told.sequence.join(" ")], ["Mount", told.mount]];
    if (told.mount === "tube") {
      facts.push(["Feed", `${told.direction}, ${range(told.speed)} m/s, ${told.loading}`]);
    }
    const energy = `${(MILLI * this.energy()).toFixed(4)} mJ`.replace("-", "−");
    return [
      ...facts,
      ["Casing", `${short(MILLI * told.sizes[0], 4)} mm`],
      ["Friction", range(told.friction)],
      ["Magnetic energy at the end", energy],
      ["Simulated time", `${this.time.toFixed(4)} s`],
    ];
  }
}

/** Return one number if all values are equal, else the smallest and the largest. */
function range(values) {
  const low = Math.min(...values), high = Math.max(...values);
  return low === high ? short(low, 4) : `${short(low, 4)} to ${short(high, 4)}`;
}

/** Return the word for the kernels' letters; the last of them is not part of the word. */
const wordOf = (letters) => Array.from(letters.slice(0, -1), (letter) => LETTERS[letter]).join("");

const short = (value, digits) => String(Number(value.toPrecision(digits)));
