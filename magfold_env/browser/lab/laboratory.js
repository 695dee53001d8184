// The laboratory: a scene that the user edits, the engine that folds it, and the fold's replay.

const FRAME_RATE = 240; // [1/s] of simulated time
const ADDRESS_RATE = 4; // [1/s] at most; browsers throttle frequent changes of address, or throw
const SLOWED = 0.1; // simulated seconds per second while the user feeds the chain by hand
const USUAL = {
  sequence: ["SNNS", "NNSN", "SSSN", "NNNS", "SSSS", "NNSN"],
  mount: "tube",
  feed: { direction: "backward", speed: 0.1 },
  friction: 0.35,
  magnets: { remanence: 0.6 },
  obstacles: [],
};
// Fields of sizes: keys of the scene, and how much of a field's unit is one of the scene's [1/m, 1/kg].
const SIZES = {
  "casing.side": 1e3, "casing.corner_radius": 1e6, "casing.mass": 1e3,
  "magnets.width": 1e3, "magnets.height": 1e3, "magnets.thickness": 1e3, "magnets.inset": 1e3,
};
const SAME_START = { keepStart: true };
const WALL = { position: [0.06, 0.02], size: [0.03, 0.003], heading: 0 };

class Laboratory {
  /** `told` is what the build wrote about games and networks. */
  constructor(engine, told) {
    this.engine = engine;
    this.player = new Player();
    this.play = new Play(engine, this.player, told);
    this.editor = new Editor(byId("poles"), (sequence) => this.change({ sequence }));
    this.states = new States(byId("states"), (word) => this.want(word));
    this.scene = USUAL;
    this.wanted = "LRLLL";
    this.#listen();
    this.read(location.hash.slice(1));
  }

  // --- the scene ---

  /** Load the scene from a link, or the default scene if there is none or it is invalid. */
  read(link) {
    clearTimeout(this.writing);
    this.writing = undefined;
    byId("mode").value = "";
    this.play.open("");
    try {
      if (link) {
        const { scene, wanted } = fromLink(link);
        Object.assign(this, { scene: editable(scene, this.engine.layout), wanted });
      }
      this.#say("");
    } catch (error) {
      if (!(error instanceof SceneError)) throw error;
      this.#say(error.message);
    }
    this.fold();
  }

  /** Change entries of the scene, and fold it again from a new start; see `fold`. */
  change(entries, { keepStart = false } = {}) {
    const { start_angles: _a, start_offsets: _o, ...kept } = this.scene;
    const before = this.scene;
    this.scene = { ...(keepStart ? before : kept), ...entries };
    try {
      this.#say("");
      this.fold();
    } catch (error) {
      if (!(error instanceof SceneError)) throw error;
      this.scene = before;
      this.#say(error.message);
      this.#showSettings();
    }
  }

  /** Change a size, given in its field's unit; tables for other sizes take half a second. */
  async resize(key, value) {
    const [group, name] = key.split("."), size = Number((value / SIZES[key]).toPrecision(12));
    byId("status").textContent = "computing tables";
    byId("status").dataset.status = "";
    await nextFrame();
    this.change({ [group]: { ...this.scene[group], [name]: size } }, key === "casing.side" ? {} : SAME_START);
    if (!byId("problem").hidden) this.#showMotion();
  }

  setLength(n) {
    const { sequence } = this.scene, { shortest, longest } = this.engine.layout;
    const count = clamp(n, shortest, longest);
    if (count === sequence.length) return;
    const more = Array.from({ length: Math.max(0, count - sequence.length) }, randomFaces);
    this.wanted = this.wanted.slice(0, count - 1);
    this.change({ sequence: [...sequence.slice(0, count), ...more] });
  }

  // --- folding ---

  /** Fold the scene. */
  fold() {
    this.#begin(FRAME_RATE);
    this.#run(() => this.player.play());
  }

  /** Run to the end, then do something; during a long fold the page can do other work. */
  async #run(then) {
    const { chain } = this;
    let shown = false;
    byId("status").textContent = "folding";
    byId("status").dataset.status = "";
    await nextFrame(); // so that the page shows the click immediately
    if (this.chain !== chain || this.play.name) return;
    for (const _ of chain.running()) {
      if (!shown) this.#showMotion();
      shown = true;
      const { time, released, n } = chain;
      byId("status").textContent = `folding: ${time.toFixed(2)} s, ${released} of ${n} out`;
      byId("status").dataset.status = "";
      await otherWork();
      if (this.chain !== chain || this.play.name) return;
    }
    this.#showMotion();
    then();
  }

  /** Begin a run from a stored start, so that the same scene always folds the same way. */
  #begin(frameRate) {
    this.feeding = undefined;
    const next = this.engine.chain(this.scene, { frameRate });
    this.chain?.free();
    this.chain = next;
    const key = this.scene.mount === "tube" ? "start_offsets" : "start_angles";
    this.scene = { ...this.scene, [key]: this.chain.start };
    this.#showSettings();
    this.#writeAddress();
  }

  #showMotion() {
    const data = this.chain.frames();
    byId("word").textContent = data.word;
    byId("status").textContent = data.status || (this.feeding ? "in your hands" : "folding");
    byId("status").dataset.status = data.status;
    byId("message").textContent = data.message;
    byId("facts").replaceChildren();
    for (const [name, value] of data.facts) {
      write("dt", name, byId("facts"));
      write("dd", value, byId("facts"));
    }
    const motion = new Motion(data);
    this.player.load(motion);
    drawGhost(shape("g", {}, byId("drawing")), motion, this.wanted);
    byId("reached").textContent = this.wanted === "" ? ""
      : data.status === "folded" && data.word === this.wanted ? "✓ folded" : "not this";
    const { chain } = this;
    this.states.mark(data.word, this.wanted);
    this.states.rank(chain, this.scene, () => this.chain === chain);
  }

  // --- feeding by hand ---

  /** Feed forwards (1), back (−1) or not (0), from now on. */
  feed(way) {
    if (this.play.name) this.play.drive(way);
    if (this.play.name || this.scene.mount !== "tube") return;
    if (this.feeding === undefined) {
      if (way === 0) return;
      this.player.pause();
      this.#begin(FRAME_RATE);
      const motion = new Motion(this.chain.frames());
      this.player.load(motion);
      this.player.camera.look(roomOf(motion));
      this.feeding = { clock: performance.now(), motion };
      byId("status").textContent = "in your hands";
      for (const id of ["message", "reached"]) byId(id).textContent = "";
      byId("status").dataset.status = "";
      requestAnimationFrame(() => this.#step());
    }
    this.chain.push(way * this.scene.feed.speed);
  }

  letGo() {
    if (this.feeding === undefined) return;
    this.chain.push(0);
    this.#endHand();
  }

  #step() {
    const { feeding, chain } = this;
    if (feeding === undefined) return;
    const now = performance.now(), gone = Math.min((now - feeding.clock) / 1000, 0.1);
    feeding.clock = now;
    for (const _ of chain.running(chain.time + SLOWED * gone)) break; // the chain may lag behind
    const { angles, base, released, loaded, time } = chain.now();
    const place = base.map((x) => 1000 * x);
    const state = { angles, base: place, released, loaded, frame: 0 };
    state.centres = feeding.motion.centres(angles, place);
    for (const each of this.player.chains) each.chain.draw(state);
    byId("word").textContent = chain.word;
    byId("now").textContent = `${time.toFixed(3)} s · ${chain.word} · ${released} of ${chain.n} out`;
    if (chain.status === null) requestAnimationFrame(() => this.#step());
    else this.#endHand();
  }

  #endHand() {
    this.feeding = undefined;
    this.#run(() => this.player.seek(this.player.motion.end));
  }

  // --- display of the scene ---

  #showSettings() {
    const { sequence, mount, feed, friction, magnets, obstacles } = this.scene;
    this.editor.show(sequence);
    byId("count").textContent = sequence.length;
    byId("mount").value = mount;
    byId("direction").value = feed.direction;
    for (const label of document.querySelectorAll("[data-tube]")) label.hidden = mount !== "tube";
    byId("hand").hidden = mount !== "tube";
    this.#slide("feed", Math.log10(feed.speed), `${Number(feed.speed.toPrecision(3))} m/s`);
    this.#slide("friction", friction, friction.toFixed(2));
    this.#slide("remanence", magnets.remanence, `${magnets.remanence.toFixed(2)} T`);
    if (document.activeElement !== byId("wanted")) byId("wanted").value = this.wanted;
    byId("wanted").maxLength = sequence.length - 1;
    this.#showObstacles(obstacles);
    for (const field of document.querySelectorAll("[data-size]")) {
      const [group, name] = field.dataset.size.split(".");
      const size = this.scene[group]?.[name] ?? this.engine.layout.scene[group][name];
      field.value = Array.isArray(size) ? "" : Number((SIZES[field.dataset.size] * size).toPrecision(6));
    }
    byId("code").querySelector("pre").textContent = toYaml(this.scene);
  }

  #slide(id, value, text) {
    byId(id).value = value;
    byId(id).setAttribute("aria-valuetext", text);
    document.querySelector(`output[for="${id}"]`).textContent = text;
  }

  #showObstacles(obstacles) {
    const parent = byId("obstacles");
    if (parent.contains(document.activeElement) && parent.childElementCount === obstacles.length) return;
    parent.replaceChildren();
    for (const [k, each] of obstacles.entries()) {
      const row = write("div", "", parent);
      row.className = "obstacle";
      const { position: [x, y], size: [length, width], heading } = each;
      const values = { x: 1e3 * x, y: 1e3 * y, length: 1e3 * length, width: 1e3 * width, turn: heading * 180 / Math.PI };
      for (const [name, value] of Object.entries(values)) {
        const label = write("label", `${name} [${name === "turn" ? "°" : "mm"}]`, row);
        const field = write("input", "", label);
        Object.assign(field, { type: "number", step: "any", value: Number(value.toPrecision(6)) });
        field.dataset.name = name;
      }
      const remove = write("button", "×", row);
      remove.type = "button";
      remove.setAttribute("aria-label", `Remove wall ${k + 1}`);
      remove.addEventListener("click", () =>
        this.change({ obstacles: this.scene.obstacles.filter((_, i) => i !== k) }, SAME_START));
      row.addEventListener("change", () => this.change({ obstacles: obstacles.with(k, wallOf(row)) }, SAME_START));
    }
  }

  #say(text) {
    byId("problem").textContent = text;
    byId("problem").hidden = text === "";
  }

  // --- controls ---

  #listen() {
    const on = (id, kind, act) => byId(id).addEventListener(kind, act);
    const number = (id) => Number(byId(id).value);
    byId("settings").addEventListener("submit", (event) => event.preventDefault());
    for (const button of document.querySelectorAll("[data-length]")) {
      button.addEventListener("click", () =>
        this.setLength(this.scene.sequence.length + Number(button.dataset.length)));
    }
    on("mode", "change", () => {
      this.feeding = undefined;
      this.play.open(byId("mode").value);
      if (!this.play.name) this.fold();
    });
    on("mount", "change", () => this.change({ mount: byId("mount").value }));
    on("direction", "change", () => this.#changeFeed({ direction: byId("direction").value }));
    on("feed", "input", () => this.#changeFeed({ speed: Number((10 ** number("feed")).toPrecision(3)) }));
    on("friction", "input", () => this.change({ friction: number("friction") }, SAME_START));
    on("remanence", "input", () => this.change({ magnets: { ...this.scene.magnets, remanence: number("remanence") } }, SAME_START));
    for (const field of document.querySelectorAll("[data-size]")) {
      field.addEventListener("change", () => this.resize(field.dataset.size, field.valueAsNumber));
    }
    on("wanted", "input", () => this.want(byId("wanted").value));
    on("again", "click", () => this.change({}));
    on("random", "click", () => this.change({ sequence: this.scene.sequence.map(randomFaces) }));
    on("wall", "click", () => this.#addWall());
    on("link", "click", () => {
      this.#writeAddress(0);
      this.#copy(location.href, "link copied");
    });
    on("python", "click", () => {
      byId("code").hidden = !byId("code").hidden;
      if (!byId("code").hidden) this.#copy(toYaml(this.scene), "scene copied");
    });
    on("sheet", "click", () => print());
    addEventListener("beforeprint", () => this.#prepareSheet());
    on("let-go", "click", () => this.letGo());
    addEventListener("hashchange", () => this.read(location.hash.slice(1)));
    this.#listenToHands();
    this.#listenToDrawing();
  }

  /** Show how the fold ended, and its whole motion. */
  #prepareSheet() {
    const { player } = this;
    if (!this.play.name && this.chain.status === null) this.#showMotion(); // the motion so far
    player.pause();
    player.seek(player.motion.end);
    player.camera.fit();
    if (!this.play.name) showSheet(player.motion, this.chain.told);
  }

  #changeFeed(entries) {
    this.change({ feed: { ...this.scene.feed, ...entries } }, "speed" in entries ? SAME_START : {});
  }

  /** Set the target word: show its outline, and whether the chain folded into it. */
  want(word) {
    byId("wanted").value = this.wanted = word.toUpperCase().replace(/[^LRS]/g, "");
    this.#writeAddress();
    this.#showMotion();
    this.player.seek(this.player.motion.end);
  }

  #addWall() {
    const { obstacles } = this.scene, { mostObstacles } = this.engine.layout;
    if (obstacles.length < mostObstacles) this.change({ obstacles: [...obstacles, WALL] }, SAME_START);
    else this.#say(`obstacles: ${obstacles.length} are the most`);
  }

  #listenToHands() {
    for (const button of document.querySelectorAll("[data-feed]")) {
      button.addEventListener("pointerdown", () => this.feed(Number(button.dataset.feed)));
      for (const end of ["pointerup", "pointerleave", "pointercancel"]) {
        button.addEventListener(end, () => this.feed(0));
      }
    }
    const ways = { a: -1, d: 1 };
    const way = ({ key, target }) => (target.matches("input[type=text]") ? undefined : ways[key]);
    document.addEventListener("keydown", (event) => {
      if (way(event) && !event.repeat && !event.ctrlKey && !event.metaKey) this.feed(way(event));
    });
    document.addEventListener("keyup", (event) => {
      if (way(event)) this.feed(0);
    });
  }

  /** Change the pole of a clicked magnet, unless the user dragged the view. */
  #listenToDrawing() {
    const drawing = byId("drawing");
    let pressed;
    drawing.addEventListener("pointerdown", ({ clientX, clientY }) => { pressed = [clientX, clientY]; });
    drawing.addEventListener("click", ({ clientX, clientY }) => {
      if (!pressed || Math.hypot(clientX - pressed[0], clientY - pressed[1]) > 4) return;
      const magnet = document.elementFromPoint(clientX, clientY)?.closest("[data-face]");
      if (magnet && !this.play.name) this.editor.turn(Number(magnet.dataset.component), Number(magnet.dataset.face));
    });
  }

  /** Write the scene to the address, after a delay that gathers further changes. */
  #writeAddress(after = 1000 / ADDRESS_RATE) {
    const write = () => {
      this.writing = undefined;
      history.replaceState(null, "", `#${toLink(this.scene, this.wanted)}`);
    };
    if (after > 0) this.writing ??= setTimeout(write, after);
    else write();
  }

  async #copy(text, told) {
    try {
      await navigator.clipboard.writeText(text);
      byId("copied").textContent = told;
    } catch {
      byId("copied").textContent = text === location.href ? "the address above is the link" : "";
    }
  }
}

/** Return a scene with every entry that the page can set; throws a SceneError. */
function editable(scene, layout) {
  const told = readScene(scene, layout);
  const one = (key, values) => {
    if (values.every((each) => each === values[0])) return values[0];
    throw new SceneError([{ key, value: values, allowed: "must be one number here" }]);
  };
  const { sequence, mount, direction } = told;
  return {
    ...scene, sequence, mount, friction: one("friction", told.friction),
    feed: { ...scene.feed, direction, speed: one("feed.speed", told.speed) },
    magnets: { ...scene.magnets, remanence: one("magnets.remanence", told.remanence.flat()) },
    obstacles: (scene.obstacles ?? []).map((each) => ({ heading: 0, ...each })),
  };
}

/** Wait while the page does other work. */
const otherWork = () => new Promise((goOn) => { setTimeout(goOn); });

/** Wait until the page has drawn a frame; a hidden page draws none. */
const nextFrame = () => new Promise((goOn) => {
  requestAnimationFrame(() => setTimeout(goOn));
  setTimeout(goOn, 50);
});

const randomFaces = () => Array.from({ length: 4 }, () => "NS"[Math.floor(2 * Math.random())]).join("");

/** Return the wall that a row of input fields describes. */
function wallOf(row) {
  const of = (name) => row.querySelector(`[data-name="${name}"]`).valueAsNumber;
  return {
    position: [of("x") / 1e3, of("y") / 1e3],
    size: [of("length") / 1e3, of("width") / 1e3],
    heading: of("turn") * Math.PI / 180,
  };
}

/** Return the rectangle [mm], y down, in which a chain that leaves its tube mostly stays. */
function roomOf({ diagonal, count }) {
  const length = diagonal * (0.6 * count + 1);
  return { x: -1.5 * diagonal, y: -length / 2, w: length + 1.5 * diagonal, h: length };
}

/** Decode a long base64 text; a loop over the letters takes a tenth of the time. */
function bytesOf(text) {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = letters.charCodeAt(k);
  return bytes;
}

async function begin() {
  const told = JSON.parse(byId("engine").textContent);
  const [wasm, memory] = [bytesOf(told.wasm), bytesOf(told.memory)];
  window.laboratory = new Laboratory(await Engine.load({ wasm, memory, layout: told.layout }), told);
}

begin();
