// The entries of a scene that a page may set; magfold_env.scene.Scene has the same names. This file
// only checks the entries and expands them to one value per component.

export const POLES = { N: 1, S: -1, "-": 0 };
const LENGTHS = ["width", "height", "thickness", "inset"]; // of magnets
const RIGHT_ANGLE = Math.PI / 2;

/** The error for an invalid scene; it tells the first of its `problems`, {key, value, allowed}. */
export class SceneError extends Error {
  constructor(problems) {
    const [{ key, value, allowed }] = problems;
    super(`${cut(key)}: ${shown(value)} is not allowed; ${allowed}`);
    this.name = "SceneError";
    this.problems = problems;
  }
}

function shown(value) {
  if (value === undefined) return "nothing";
  return cut(typeof value === "number" ? String(value) : JSON.stringify(value) ?? String(value));
}

const cut = (text) => (text.length > 80 ? `${text.slice(0, 79)}…` : text).replace(/\s/g, " ");

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);
const positive = [(value) => isNumber(value) && value > 0, "must be a number above 0"];
const notNegative = [(value) => isNumber(value) && value >= 0, "must be a number of at least 0"];
const number = [isNumber, "must be a number"];
const within = ({ most, unit }) => [(value) => isNumber(value) && Math.abs(value) <= most,
  `must be a number from -${most} to ${most} ${unit}`];
const angle = [(value) => isNumber(value) && Math.abs(value) <= RIGHT_ANGLE,
  "must be numbers from -π/2 to π/2"];
const spread = [(value) => isNumber(value) && value >= 0 && value <= 0.5,
  "must be a number from 0 to 0.5"];
const tolerance = [(value) => isNumber(value) && value >= 1e-12 && value <= 0.1,
  "must be a number from 1e-12 to 0.1"];
const count = (most) => [(value) => Number.isInteger(value) && value > 0 && value <= most,
  `must be a whole number from 1 to ${most}`];
// Like magfold_env.scene.base.Most, and with the same entries.
const upTo = ({ most, unit, usual, others }, least = positive) => [(value) => least[0](value) && value <= most,
  (value) => {
    if (!(value > most)) return least[1];
    const meant = Object.entries(others)
      .find(([, size]) => usual[0] <= value * size && value * size <= usual[1]);
    return `must be at most ${brief(most)} ${unit}`
      + (meant ? `; ${brief(value)} ${meant[0]} are ${brief(value * meant[1])}` : "");
  }];
const oneOf = (names) => [(value) => names.includes(value), `must be one of ${names.join(", ")}`];

/** Reads values one by one and collects what is wrong with them. */
class Reader {
  constructor() {
    this.problems = [];
  }

  refuse(key, value, allowed) {
    // Report a value that stands for all components only once.
    if (this.problems.at(-1)?.key === key) return;
    this.problems.push({ key, value, allowed: typeof allowed === "string" ? allowed : allowed(value) });
  }

  /** Return a group as an object; unknown entries are refused. */
  group(key, value, names) {
    if (value === undefined || value === null) return {};
    if (typeof value !== "object" || Array.isArray(value)) {
      this.refuse(key || "scene", value, `must have entries, of ${names.join(", ")}`);
      return {};
    }
    for (const [name, entry] of Object.entries(value)) {
      if (!names.includes(name)) {
        this.refuse(key ? `${key}.${name}` : name, entry, `must be one of ${names.join(", ")}`);
      }
    }
    return value;
  }

  one(key, value, other, [allows, allowed]) {
    if (value === undefined) return other;
    if (!allows(value)) this.refuse(key, value, allowed);
    return value;
  }

  /** Return a list of `count` numbers; if `spreads` is true, one number stands for all. */
  each(key, value, count, [allows, allowed], spreads = true) {
    if (spreads && !Array.isArray(value)) {
      this.one(key, value, undefined, [allows, allowed]);
      return Array(count).fill(value);
    }
    if (!Array.isArray(value) || value.length !== count) {
      this.refuse(key, value, `must have ${count} numbers`);
      return Array(count).fill(0);
    }
    const wrong = value.findIndex((entry) => !allows(entry));
    if (wrong >= 0) this.refuse(`${key}[${wrong}]`, value[wrong], allowed);
    return value;
  }
}

/**
 * Return everything about a scene that kernels need, component 1 first.
 *
 * `layout` comes from the build; `start` is null if it is left to chance. Throws a SceneError.
 */
export function readScene(scene, layout) {
  const read = new Reader(), standard = layout.scene;
  const entries = read.group("", scene, ["sequence", "mount", "feed", "friction", "gravity",
    "magnets", "casing", "duration", "start_angles", "start_offsets", "start_angle_spread",
    "obstacles", "solver"]);
  const sequence = readSequence(read, entries.sequence, layout), n = sequence.length;
  const feed = read.group("feed", entries.feed,
    ["direction", "speed", "loading", "force_limit", "bore", "wall"]);
  const magnets = read.group("magnets", entries.magnets, ["remanence", ...LENGTHS]);
  const casing = read.group("casing", entries.casing, ["side", "corner_radius", "mass"]);
  const gravity = read.group("gravity", entries.gravity, ["normal"]);
  const solver = read.group("solver", entries.solver, ["tolerance", "max_steps"]);
  const mount = read.one("mount", entries.mount, standard.mount, oneOf(layout.mounts));
  const strength = magnets.remanence ?? standard.magnets.remanence;
  const rows = Array.isArray(strength) && Array.isArray(strength[0])
    ? read.each("magnets.remanence", strength, n, [Array.isArray, "must be a row of four"], false)
    : Array(n).fill(strength);
  const length = upTo(layout.most.length), { side } = standard.casing;
  const sizes = [read.one("casing.side", casing.side, side, length), ...LENGTHS.map((name) => read.one(
    `magnets.${name}`, magnets[name], standard.magnets[name],
    name === "inset" ? upTo(layout.most.length, notNegative) : length))];
  const diagonal = Math.SQRT2 * sizes[0], { most } = layout.most.place;
  if (read.problems.length === 0) checkMagnets(read, sizes, layout);
  const limit = feed.force_limit === null ? Infinity : read.one(
    "feed.force_limit", feed.force_limit, standard.feed.force_limit, positive);
  const found = {
    sequence, mount, sizes,
    rounding: read.one("casing.corner_radius", casing.corner_radius, standard.casing.corner_radius, positive),
    poles: sequence.map((faces) => [...faces].map((pole) => POLES[pole])),
    remanence: rows.map((row, k) => read.each(
      rows.length > 1 && row !== strength ? `magnets.remanence[${k}]` : "magnets.remanence",
      row, 4, upTo(layout.most.remanence))),
    mass: read.each("casing.mass", casing.mass ?? standard.casing.mass, n, positive),
    speed: read.each("feed.speed", feed.speed ?? standard.feed.speed, n,
      upTo(layout.most.speed)),
    direction: read.one("feed.direction", feed.direction, standard.feed.direction,
      oneOf(["forward", "backward"])),
    loading: read.one("feed.loading", feed.loading, standard.feed.loading,
      oneOf(["preloaded", "at_mouth"])),
    forceLimit: limit,
    bore: read.one("feed.bore", feed.bore ?? undefined, layout.bore * diagonal,
      [(value) => isNumber(value) && value >= diagonal * (1 - layout.rounding) && value <= most,
        `must be from the casing's diagonal, ${brief(diagonal)}, to ${most} m`]),
    wall: read.one("feed.wall", feed.wall, standard.feed.wall, upTo(layout.most.place)),
    friction: read.each("friction", entries.friction ?? standard.friction, n, notNegative),
    normal: read.one("gravity.normal", gravity.normal, standard.gravity.normal, notNegative),
    duration: read.one("duration", entries.duration, standard.duration, positive),
    tolerance: read.one("solver.tolerance", solver.tolerance, standard.solver.tolerance, tolerance),
    maxSteps: read.one("solver.max_steps", solver.max_steps, standard.solver.max_steps,
      count(layout.most.steps)),
    spread: read.one("start_angle_spread", entries.start_angle_spread,
      standard.start_angle_spread, spread),
    obstacles: readObstacles(read, entries.obstacles, layout),
    start: readStart(read, entries, n, mount),
  };
  if (read.problems.length === 0 && mount === "tube") checkTube(read, entries, found, layout);
  if (read.problems.length > 0) throw new SceneError(read.problems);
  return found;
}

/** Refuse magnets that overlap in their casing; magfold_env.scene.Magnets has the same rule. */
function checkMagnets(read, [side, width, , thickness, inset], { rounding }) {
  const depth = inset + thickness, room = side - 2 * depth;
  if (width <= room + rounding * side) return;
  const needed = `casing.side at least ${brief(width + 2 * depth)} m`;
  read.refuse("magnets.width", width, "the magnets of a casing overlap, " + (room > 0
    ? `must be at most side - 2 (inset + thickness) = ${brief(room)} m, or ${needed}`
    : `no magnet so thick fits, must have ${needed}`));
}

/** Refuse what has no space in a tube; magfold_env.scene.Scene has the same rules. */
function checkTube(read, entries, { bore, start, obstacles, sizes: [side] }, { rounding }) {
  const diagonal = Math.SQRT2 * side, play = Math.max((bore - diagonal) / 2, 0);
  if (start?.some((offset) => Math.abs(offset) > play + rounding * diagonal)) {
    const allowed = `must lie within ${brief(play)} m of the tube's axis, as its bore asks`;
    read.refuse("start_offsets", start, allowed);
  } else if (start?.slice(1).some((offset, k) => Math.abs(offset - start[k]) > side)) {
    read.refuse("start_offsets", start,
      `neighbouring hinges must lie at most the side, ${brief(side)} m, off each other across the tube`);
  }
  for (const [k, obstacle] of obstacles.entries()) {
    const corners = cornersOf(obstacle), half = bore / 2, room = 1 - rounding;
    const end = Math.min(...corners.map(([x]) => x), 0) - diagonal;
    const [low, high, front] = [-room * half, room * half, room * diagonal];
    if (overlap(corners, [[end, low], [front, low], [front, high], [end, high]])) {
      read.refuse(`obstacles[${k}].position`, entries.obstacles[k].position,
        "must leave free the tube's bore and as much before its mouth as a casing is long: "
        + `nowhere both x < ${brief(diagonal)} and |y| < ${brief(half)}`);
    }
  }
}

/** Return the corners of an obstacle [m], counter-clockwise. */
export function cornersOf([x, y, length, width, heading]) {
  const c = Math.cos(heading), s = Math.sin(heading);
  return [[1, -1], [1, 1], [-1, 1], [-1, -1]].map(([a, b]) => {
    const along = 0.5 * a * length, across = 0.5 * b * width;
    return [x + along * c - across * s, y + along * s + across * c];
  });
}

/** Whether two convex outlines overlap: no edge of either separates them. */
function overlap(one, other) {
  return [one, other].every((outline) => outline.every(([x, y], k) => {
    const [nextX, nextY] = outline[(k + 1) % outline.length];
    const [a, b] = [one, other].map((each) => each.map(([u, v]) => (nextY - y) * u - (nextX - x) * v));
    return Math.max(...a) > Math.min(...b) && Math.max(...b) > Math.min(...a);
  }));
}

const brief = (value) => String(Number(value.toPrecision(6)));

function readSequence(read, value, layout) {
  const words = typeof value === "string" ? value.trim().split(/\s+/) : value;
  const { shortest, longest } = layout;
  if (!Array.isArray(words) || words.length < shortest || words.length > longest) {
    read.refuse("sequence", value, `must have ${shortest} to ${longest} components`);
    return Array(shortest).fill("----");
  }
  for (const [k, faces] of words.entries()) {
    if (typeof faces !== "string" || !/^[NS-]{4}$/.test(faces)) {
      read.refuse(`sequence[${k}]`, faces, "must be four letters N, S or - for no magnet");
    }
  }
  return words.map(String);
}

function readStart(read, { start_angles: angles, start_offsets: offsets }, n, mount) {
  const tube = mount === "tube";
  if (tube && (angles ?? null) !== null) {
    read.refuse("start_angles", angles, "a tube takes start_offsets");
  }
  const given = tube ? offsets : angles;
  if ((given ?? null) === null) return null;
  return tube
    ? read.each("start_offsets", given, n + 1, number, false)
    : read.each("start_angles", given, n - 1, angle, false);
}

function readObstacles(read, value, layout) {
  if (value === undefined) return [];
  if (!Array.isArray(value) || value.length > layout.mostObstacles) {
    read.refuse("obstacles", value, `must be at most ${layout.mostObstacles} rectangles`);
    return [];
  }
  return value.map((entry, k) => {
    const key = `obstacles[${k}]`;
    const { position, size, heading } = read.group(key, entry, ["position", "size", "heading"]);
    return [
      ...read.each(`${key}.position`, position, 2, within(layout.most.place), false),
      ...read.each(`${key}.size`, size, 2, upTo(layout.most.place), false),
      read.one(`${key}.heading`, heading, 0, within({ most: 1e6, unit: "rad" })),
    ];
  });
}
