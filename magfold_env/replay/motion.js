// The recorded motion: states at and between frames, and quantities computed from them.

class Motion {
  /** `data` is the result of magfold_env.replay.data.page_data. */
  constructor(data) {
    this.data = data;
    this.count = data.sequence.length;
    this.diagonal = data.side * Math.SQRT2;
    this.start = data.time[0];
    this.end = data.time.at(-1);
    this.last = data.time.length - 1;
  }

  /** Return the last frame that is not after a time [s]. */
  frame(time) {
    let low = 0, high = this.last;
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.data.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Return the frame nearest to a time [s]. */
  nearest(time) {
    const frame = this.frame(time), next = Math.min(frame + 1, this.last);
    return this.data.time[next] - time < time - this.data.time[frame] ? next : frame;
  }

  /** Return the state at a time [s], interpolated linearly between frames. */
  at(time) {
    const { data } = this, frame = this.frame(time), next = Math.min(frame + 1, this.last);
    const span = data.time[next] - data.time[frame];
    const share = span > 0 ? clamp((time - data.time[frame]) / span, 0, 1) : 0;
    const between = (from, to) => from.map((value, k) => value + share * (to[k] - value));
    const angles = between(data.angles[frame], data.angles[next]);
    const base = between(data.base[frame], data.base[next]);
    return {
      frame, angles, base,
      centres: this.centres(angles, base),
      loaded: data.loaded[frame],
      released: data.released[frame],
    };
  }

  /** Return the casings' centres [mm] for headings [rad] and component 1's outer hinge [mm]. */
  centres(angles, base) {
    let [x, y] = base;
    return angles.map((angle) => {
      const dx = this.diagonal * Math.cos(angle), dy = this.diagonal * Math.sin(angle);
      x += dx;
      y += dy;
      return [x - dx / 2, y - dy / 2];
    });
  }

  /** Return the joint angles of a frame [°]. */
  joints(frame) {
    const angles = this.data.angles[frame];
    return angles.slice(1).map((angle, k) => (angle - angles[k]) * 180 / Math.PI);
  }

  /** Return the nearest fold word of a frame, with thresholds at ±45°. */
  word(frame) {
    return this.joints(frame).map((joint) => {
      const turned = joint - 360 * Math.round(joint / 360);
      return turned > 45 ? "L" : turned < -45 ? "R" : "S";
    }).join("");
  }

  /** Return a description of a frame. */
  description(frame) {
    const { data } = this, parts = [`${data.time[frame].toFixed(3)} s`];
    if (this.count > 1) parts.push(this.word(frame));
    if (data.tube) parts.push(`${data.released[frame]} of ${this.count} out`);
    return parts.join(" · ");
  }
}
