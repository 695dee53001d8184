// Environments to play by hand; a policy can play the same draw for comparison.

const PLAYED_AT = 0.1; // simulated seconds per second while the user feeds the chain by hand
const TASKS = {
  tube_feed: (game) => `Choose the poles and the speed of each component as it leaves the tube, so that the chain folds into ${game.target}.`,
  unknown_floor: (game) => `Push and pull the chain, so that it folds into ${game.target}. Friction, magnets and drive are not what they seem; what has folded wrong can be drawn in again.`,
};

class Play {
  /** `told` is what the build wrote about games and networks; `player` shows the replays. */
  constructor(engine, player, { games, networks }) {
    Object.assign(this, { engine, player, games, networks, name: "" });
    this.faces = new Editor(byId("next"), ([faces]) => this.#choose(faces), "NS");
    this.#listen();
  }

  /** Select the environment to play by its name; an empty name selects none. */
  open(name) {
    this.game?.chain.free();
    Object.assign(this, { name, game: null, rows: {}, running: false });
    document.body.dataset.mode = name;
    if (name) this.begin();
  }

  /** Begin an episode, with a new draw unless one is given. */
  begin(draw) {
    this.game ??= new GAMES[this.name](this.engine, this.games[this.name]);
    const { game } = this;
    if (!draw) this.rows = {};
    this.draw = draw ?? {
      goal: Math.floor(Math.random() * game.goals.length),
      numbers: Array.from({ length: game.draws }, Math.random),
    };
    this.way = 0;
    this.running = false;
    game.begin({ ...this.draw, normal, frameRate: FRAME_RATE });
    byId("task").textContent = TASKS[this.name](game);
    this.#choose("NNNN");
    this.#film(0);
    this.player.pause();
    this.player.camera.look(roomOf(this.player.motion));
  }

  // --- actions ---

  #choose(faces) {
    this.chosen = faces;
    const { game } = this;
    if (game.next !== undefined) this.faces.show([faces], game.next);
    this.#tell();
  }

  /** Feed the next component out with the chosen magnets and speed. */
  feedNext() {
    const { game } = this, from = game.chain.time;
    if (game.done) return;
    game.step([game.told.patterns.indexOf(this.chosen), Number(byId("level").value)]);
    this.#film(from);
    if (game.done) this.#ended("you", game);
    else this.#choose(this.chosen);
  }

  /** Feed forwards (1), back (−1) or not (0), from now on. */
  drive(way) {
    if (this.name !== "unknown_floor" || this.game.done) return;
    this.way = way;
    if (this.running || way === 0) return;
    this.running = true;
    this.player.pause();
    const motion = new Motion(this.game.chain.frames());
    this.player.load(motion);
    this.player.camera.look(roomOf(motion));
    this.stretch = { motion, clock: performance.now(), from: this.#state(), to: this.#state() };
    requestAnimationFrame(() => this.#step());
  }

  /** Let the policy play an episode with the same draw. */
  async watch() {
    const { name, engine, draw } = this;
    const game = new GAMES[name](engine, this.games[name]), network = new Network(this.networks[name]);
    game.begin({ ...draw, normal, frameRate: FRAME_RATE });
    this.running = false;
    for (let from = performance.now(); !game.done;) {
      game.step(network.act(game.observe()));
      if (performance.now() - from > AT_ONCE) {
        await otherWork();
        from = performance.now();
        if (this.name !== name || this.draw !== draw) {
          game.chain.free();
          return;
        }
      }
    }
    if (!this.game.done) this.begin(this.draw);
    this.#film(0, game);
    this.#ended("the policy", game);
    game.chain.free();
  }

  // --- while time runs ---

  #step() {
    const { game, stretch } = this;
    if (!this.running) return;
    const wall = game.told.interval / PLAYED_AT * 1000, gone = performance.now() - stretch.clock;
    if (gone >= wall && !game.done) {
      game.feed(this.way * Number(byId("pace").value));
      Object.assign(stretch, { clock: stretch.clock + Math.max(wall, gone - wall), from: stretch.to, to: this.#state() });
      this.#tell();
    }
    const share = clamp((performance.now() - stretch.clock) / wall, 0, 1);
    this.#draw(stretch, share);
    if (!game.done || share < 1) {
      requestAnimationFrame(() => this.#step());
      return;
    }
    this.running = false;
    this.#film(0);
    this.player.pause();
    this.player.seek(this.player.motion.end);
    this.#ended("you", game);
  }

  #state() {
    const { angles, base, released, loaded } = this.game.chain.now();
    return { angles, base: base.map((x) => 1e3 * x), released, loaded };
  }

  #draw({ motion, from, to }, share) {
    const between = (a, b) => a.map((value, k) => value + share * (b[k] - value));
    const angles = between(from.angles, to.angles), base = between(from.base, to.base);
    const state = { ...from, angles, base, frame: 0, centres: motion.centres(angles, base) };
    for (const { chain } of this.player.chains) chain.draw(state);
  }

  // --- display ---

  #film(from, game = this.game) {
    const motion = new Motion(game.chain.frames());
    this.player.load(motion);
    byId("word").textContent = game.chain.word;
    byId("status").textContent = game.status ?? "in your hands";
    byId("status").dataset.status = game.status ?? "";
    byId("message").textContent = game.chain.message;
    if (game.done) drawGhost(shape("g", {}, byId("drawing")), motion, game.target);
    drawTarget(byId("target"), motion, game.target);
    this.player.seek(from);
    this.player.play();
  }

  #ended(who, game) {
    if (who === "you") byId("message").textContent = this.#hidden(game);
    this.rows[who] = { word: game.chain.word, status: game.status, score: game.score, total: game.total };
    this.#tell();
  }

  /** Return a text that reveals the draw after the episode. */
  #hidden({ chain: { told }, factors }) {
    const strengths = told.remanence.flat(), range = (values, digits) =>
      [Math.min(...values), Math.max(...values)].map((each) => each.toFixed(digits)).join(" to ");
    return `hidden were friction ${told.friction[0].toFixed(2)}, magnets of ${range(strengths, 2)} T, and a drive that makes ${range(factors, 2)} of the speed asked`;
  }

  /** Show the state of the episode. */
  #tell() {
    const { game } = this, floor = this.name === "unknown_floor";
    byId("choice").hidden = floor || game.done;
    byId("drive").hidden = !floor || game.done;
    byId("hand").hidden = byId("drive").hidden;
    if (floor) {
      byId("now").textContent = `${(game.steps * game.told.interval).toFixed(2)} of ${game.told.interval * game.told.horizon} s`;
      byId("felt").textContent = `${(1e3 * game.force).toFixed(0)} mN`;
      byId("paced").textContent = `${Number(byId("pace").value).toFixed(2)} m/s`;
    } else if (!game.done) {
      byId("which").textContent = `Component ${game.next + 1}`;
      byId("levelled").textContent = `${game.told.speeds[byId("level").value].toPrecision(2)} m/s`;
    }
    byId("scores").replaceChildren();
    for (const [who, { word, status, score, total }] of Object.entries(this.rows)) {
      const row = write("tr", "", byId("scores"));
      for (const text of [who, word, status, score.toFixed(2), total.toFixed(2).replace("-", "−")]) write("td", text, row);
    }
    byId("scored").hidden = Object.keys(this.rows).length === 0;
  }

  #listen() {
    const on = (id, act, kind = "click") => byId(id).addEventListener(kind, act);
    on("feed-next", () => this.feedNext());
    on("retry", () => this.begin(this.draw));
    on("fresh", () => this.begin());
    on("watch", () => this.watch());
    for (const id of ["level", "pace"]) on(id, () => this.#tell(), "input");
  }
}

/** Return a standard normal number. */
const normal = () => Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
