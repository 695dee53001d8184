// Runs what a job on standard input asks for, and tells on standard output how it went.
// Floats are told as their bits, in hexadecimal.

import fs from "node:fs";
import { pathToFileURL } from "node:url";

const folder = process.argv[2];
const { Engine } = await import(pathToFileURL(`${folder}/engine.js`));
const { GAMES } = await import(pathToFileURL(`${folder}/games.js`));
const { Network } = await import(pathToFileURL(`${folder}/networks.js`));
const played = JSON.parse(fs.readFileSync(`${folder}/games.json`, "utf8"));
const job = JSON.parse(fs.readFileSync(0, "utf8"));

const words = new BigUint64Array(1), floats = new Float64Array(words.buffer);
function bits(value) {
  if (Array.isArray(value)) return value.map(bits);
  floats[0] = value;
  return words[0].toString(16).padStart(16, "0");
}

const begun = performance.now();
const wasm = fs.readFileSync(`${folder}/engine.wasm`);
const module = new WebAssembly.Module(wasm);
const engine = await Engine.load({
  wasm,
  memory: fs.readFileSync(`${folder}/memory.bin`),
  layout: JSON.parse(fs.readFileSync(`${folder}/layout.json`, "utf8")),
});
const ready = performance.now() - begun;

function end(chain) {
  return {
    status: chain.status, message: chain.message, word: chain.word, steps: chain.steps,
    evaluations: chain.evaluations, released: chain.released,
    time: bits(chain.time), energy: bits(chain.energy()), headings: bits(chain.headings()),
    rates: bits(chain.rates()), peak: bits(chain.pushPeak), base: chain.base(),
  };
}

const tasks = {
  module: () => ({
    imports: WebAssembly.Module.imports(module),
    exports: WebAssembly.Module.exports(module).map(({ name }) => name),
    ready,
  }),
  // Whole folds.
  folds: () => job.scenes.map((scene) => {
    const chain = engine.chain(scene), from = performance.now();
    chain.run();
    const found = { ...end(chain), ms: performance.now() - from };
    chain.free();
    return found;
  }),
  // Folds whose feed is changed by hand, looked at in between.
  pushes: () => job.scenes.map((scene, k) => {
    const chain = engine.chain(scene, { frameRate: 200 });
    for (const [speed, seconds] of job.legs[k]) {
      chain.run(chain.time + seconds, { speed });
      chain.now();
    }
    chain.push(0);
    chain.run();
    return end(chain);
  }),
  states: () => job.scenes.map((scene) => {
    const ranking = engine.chain(scene).ranking();
    let part;
    do part = ranking.next(); while (!part.done);
    return part.value.map((state) => ({ ...state, energy: bits(state.energy) }));
  }),
  // Episodes of environments, whose draws and actions are given.
  episodes: () => job.episodes.map(({ goal, numbers, normals, actions }) => {
    const game = new GAMES[job.game](engine, played.games[job.game]);
    game.begin({ goal, numbers, normal: () => normals.shift() });
    const found = { draws: game.draws, observations: [[...game.observe()]], rewards: [] };
    for (const action of actions) {
      found.rewards.push(game.step(action));
      found.observations.push([...game.observe()]);
    }
    const { done, status, score, success, total, chain } = game;
    return { ...found, done, status, score, success, total, headings: bits(chain.headings()) };
  }),
  // What networks choose, episode by episode.
  actions: () => job.episodes.map((observations) => {
    const network = new Network(played.networks[job.game]);
    return observations.map((each) => network.act(Float32Array.from(each)));
  }),
  frames: () => job.scenes.map((scene) => {
    const chain = engine.chain(scene, { frameRate: job.frameRate });
    chain.run();
    return chain.frames();
  }),
  // The message of a scene that is not allowed.
  refused: () => job.scenes.map((scene) => {
    try {
      engine.chain(scene);
    } catch (error) {
      return { name: error.name, message: error.message };
    }
    return null;
  }),
  // Milliseconds that folds take, the best of some.
  speed: () => job.scenes.map((scene) => {
    const chain = engine.chain(scene), taken = [];
    for (let k = 0; k < job.times; k++) {
      chain.begin();
      const from = performance.now();
      chain.run();
      taken.push(performance.now() - from);
    }
    return Math.min(...taken);
  }),
  // a·b + c, rounded once.
  fused: () => job.numbers.map((row) => bits(engine.kernels.fused(...row))),
};

process.stdout.write(JSON.stringify(tasks[job.task]()));
