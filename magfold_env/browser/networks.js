// The policies' networks: their layers, their inputs, and the most likely action.

export class Network {
  /** `told` is what the build wrote about a policy. */
  constructor(told) {
    Object.assign(this, { ...told, last: [] });
    const numbers = lengthened(told.weights);
    // Every layer's weights, row by row, then its biases.
    let wide = told.inputs, begin = 0;
    this.layers = told.widths.map((height) => {
      const weights = numbers.subarray(begin, begin + height * wide);
      const biases = numbers.subarray(begin + height * wide, begin + height * (wide + 1));
      const layer = { weights, biases, wide };
      begin += height * (wide + 1);
      wide = height;
      return layer;
    });
  }

  /** Forget past observations, for a new episode. */
  begin() {
    this.last = [];
  }

  /** Return the most likely action, a list of numbers, after one more observation. */
  act(observation) {
    // The first observation fills the whole stack.
    while (this.last.length < this.frames) this.last.push(observation);
    this.last = [...this.last.slice(1), observation];
    const seen = this.order ? this.#fromTheMouth(observation) : this.last.flatMap((each) => [...each]);
    const logits = this.#layers(seen);
    let begin = 0;
    return this.choices.map((count) => {
      const part = logits.subarray(begin, begin + count);
      begin += count;
      return part.indexOf(Math.max(...part));
    });
  }

  #layers(seen) {
    let values = Float32Array.from(seen);
    for (const [place, { weights, biases, wide }] of this.layers.entries()) {
      const hidden = place < this.layers.length - 1;
      values = Float32Array.from(biases, (bias, row) => {
        let total = bias;
        for (let k = 0; k < wide; k++) total += weights[row * wide + k] * values[k];
        return hidden ? Math.tanh(total) : total;
      });
    }
    return values;
  }

  /** Reorder an observation of TubeFeed, see magfold_env.envs.wrappers.mouth_order. */
  #fromTheMouth(observation) {
    const { order } = this, n = order.length - 1, first = 3 * (n - 1);
    const step = observation.subarray(first, first + n).reduce((a, b) => a + b, 0);
    const ordered = order[step].map((entry) => observation[entry] ?? 0);
    return [...ordered, ...order.map((_, k) => Number(k === step))];
  }
}

/** Return numbers from their first 24 bits: the most significant byte of each comes first. */
function lengthened(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const count = bytes.length / 3, words = new Uint32Array(count);
  for (let k = 0; k < count; k++) {
    words[k] = (bytes[k] << 24) | (bytes[count + k] << 16) | (bytes[2 * count + k] << 8);
  }
  return new Float32Array(words.buffer);
}
