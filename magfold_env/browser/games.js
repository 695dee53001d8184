// Episodes of the environments in magfold_env.envs, for one chain in a page. Kernels compute the
// physics, the observations and the folds' similarity; this file has the rules of the tasks.

const TURNS = { L: 1n, S: 0n, R: -1n };

/** An episode of an environment; `told` is what the build wrote about the environment. */
class Game {
  constructor(engine, told) {
    Object.assign(this, { engine, told, n: told.n });
  }

  /** How many random numbers from [0, 1) an episode needs. */
  get draws() {
    const { feed_jitter: jitter, magnet } = this.told.spreads;
    return 2 * this.n + 4 + (jitter > 0 || magnet > 0 ? 5 * this.n : 0);
  }

  /** The possible goals: words or tasks. */
  get goals() {
    return this.told.words ?? this.told.tasks;
  }

  /**
   * Begin an episode.
   *
   * `goal` is an index into `goals`; `numbers` holds `draws` random numbers; `normal` returns
   * a standard normal number at each call; `frameRate` [1/s] is how often frames are recorded.
   */
  begin({ goal, numbers, normal = () => 0, frameRate = 0 }) {
    this.chain?.free();
    Object.assign(this, { goal, normal, score: null, success: false, total: 0 });
    const { strengths, ...drawn } = this.#draw(numbers.map((each) => 2 * each - 1));
    this.factors = drawn.factors;
    const { scene } = this.told;
    const sequence = this.sequence(), direction = this.direction();
    this.chain = this.engine.chain({
      ...scene, sequence, friction: drawn.friction, magnets: { ...scene.magnets, remanence: strengths },
      feed: { ...scene.feed, direction, speed: drawn.factors }, start_offsets: drawn.offsets,
    }, { frameRate, endless: this.endless });
    this.forward = direction === "forward";
    this.arrays = (name) => this.chain.field(`episode.arrays.${name}`);
    this.start();
  }

  /** Whether the episode has ended. */
  get done() {
    return this.status !== null;
  }

  get status() {
    return this.chain.status;
  }

  get target() {
    const goal = this.goals[this.goal];
    return goal.target ?? goal;
  }

  /** Return the target word as entries of an observation: each letter one-hot over L, S, R. */
  wanted() {
    return [...this.target].flatMap((letter) => [..."LSR"].map((each) => Number(each === letter)));
  }

  /** Note whether the run has ended, and how near the chain is to the target word. */
  end() {
    const { ends } = this.engine.layout;
    this.arrays("status")[0] = BigInt(ends.indexOf(this.status ?? "None"));
    this.chain.field("episode.letter").set([...this.target].map((letter) => TURNS[letter]));
    this.chain.call("judge", "episode");
    const [, score, success] = this.chain.field("episode.judged");
    Object.assign(this, { score, success: success === 1 });
  }

  /** Return a draw, computed from numbers in [−1, 1) as in magfold_env.envs.chains.dynamic. */
  #draw(unit) {
    const { n } = this, { spreads, scene, offset, referenceSpeed } = this.told;
    const first = 2 * n + 4, [remanence] = [scene.magnets.remanence].flat();
    const decades = rounded(10 ** (spreads.friction_decades * unit[0]), 12);
    const speed = 1 + spreads.feed_speed * unit[n + 2], strength = 1 + spreads.remanence * unit[n + 1];
    const components = Array.from({ length: n }, (_, k) => k);
    return {
      friction: scene.friction * ((1 + spreads.friction * unit[0]) * decades),
      strengths: components.map((k) => [0, 1, 2, 3].map((face) => remanence
        * (spreads.magnet > 0 ? strength * (1 + spreads.magnet * unit[first + n + 4 * k + face]) : strength))),
      factors: components.map((k) => referenceSpeed
        * (spreads.feed_jitter > 0 ? speed * (1 + spreads.feed_jitter * unit[first + k]) : speed) / referenceSpeed),
      offsets: Array.from({ length: n + 1 }, (_, k) => offset * unit[n + 3 + k] + 0),
    };
  }
}

/** MagFold/TubeFeed-v0: an agent chooses each component's magnets and speed at the mouth. */
export class TubeFeed extends Game {
  endless = false;

  sequence() {
    return Array(this.n).fill("----");
  }

  direction() {
    return this.told.scene.feed.direction;
  }

  start() {
    this.fed = 0;
    this.chain.see(this.forward);
  }

  /** The index of the component that is fed next. */
  get next() {
    return this.forward ? this.fed : this.n - 1 - this.fed;
  }

  /** Feed the next component, given the indices of its pattern and speed; return the reward. */
  step([pattern, level]) {
    const { told } = this;
    return this.feed(told.patterns[pattern], told.speeds[level], told.scaled[level]);
  }

  /** Feed the next component with faces at a speed [m/s]; `scaled` is the speed from −1 to 1. */
  feed(faces, speed, scaled) {
    const { chain, next } = this, signs = [...faces].map((face) => (face === "N" ? 1 : -1));
    this.arrays("signs").set(signs, 4 * next);
    this.arrays("speeds")[next] = scaled;
    chain.choose(next, faces, speed * this.factors[next]);
    this.fed += 1;
    chain.run();
    chain.see(this.forward);
    if (!this.done) return 0;
    this.end();
    this.total = this.score - this.told.baselines[this.goal];
    return this.total;
  }

  observe() {
    this.chain.call("observe", "model", "episode");
    return Float32Array.from([...this.wanted(), ...this.chain.field("episode.entries")]);
  }
}

/** MagFold/UnknownFloor-v0: a given chain is fed back and forth over an unknown floor. */
export class UnknownFloor extends Game {
  endless = true;

  sequence() {
    return this.told.tasks[this.goal].sequence;
  }

  direction() {
    return this.told.tasks[this.goal].direction;
  }

  start() {
    Object.assign(this, { steps: 0, driven: 0, late: false, frame: Array(5 * this.n).fill(0) });
    const signs = this.sequence().join("").split("").map((face) => ({ N: 1, S: -1, "-": 0 })[face]);
    this.arrays("signs").set(signs);
    this.chain.field("episode.frames").fill(0);
    this.#measure(0);
  }

  get status() {
    return this.late ? "unsettled" : this.chain.status;
  }

  /** Feed for one step at one of the table's speeds; return the reward. */
  step([level]) {
    return this.feed(this.told.speeds[level]);
  }

  /** Feed for one step at roughly this speed [m/s], inward if negative; return the reward. */
  feed(asked) {
    const { told, chain } = this, change = asked - this.driven;
    this.driven += Math.min(Math.max(change, -told.steepest), told.steepest);
    const before = chain.impulse;
    chain.run(chain.time + told.interval, { speed: this.factors.map((each) => this.driven * each) });
    this.steps += 1;
    const failed = chain.status === this.engine.layout.failed;
    this.#measure(failed ? 0 : (chain.impulse - before) / told.interval);
    this.late = chain.status === null && this.steps >= told.horizon;
    let reward = -told.timeCost * told.interval;
    if (this.done) {
      this.end();
      if (this.status === "unsettled") this.score = 0;
      reward += this.score;
    }
    this.total += reward;
    return reward;
  }

  observe() {
    const { told, chain, n } = this, { view } = this.engine.layout;
    const length = n * Math.SQRT2 * told.scene.casing.side;
    return Float32Array.from([
      ...this.wanted(), ...this.arrays("signs"), this.forward ? 1 : -1, ...this.frame,
      rounded(chain.field("view.feed")[view.ADVANCE] / length, 9), this.driven / told.fastest,
      squash(this.force / told.forceScale), Math.min(this.steps / told.horizon, 1),
    ]);
  }

  /** Take a frame and the drive's force [N] with noise; the agent sees the previous frame. */
  #measure(force) {
    const { chain } = this;
    chain.see(this.forward);
    this.force = force + this.told.forceNoise * this.normal();
    const noise = Array.from({ length: 3 * this.n }, () => this.normal());
    chain.field("episode.noise").set(noise);
    this.frame = [...chain.field("episode.frames")];
    chain.call("film", "model", "episode");
  }
}

export const GAMES = { tube_feed: TubeFeed, unknown_floor: UnknownFloor };

const squash = (value) => value / (1 + Math.abs(value));
const rounded = (value, digits) => Math.round(value * 10 ** digits) / 10 ** digits;
