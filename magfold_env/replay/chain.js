// Drawing of the chain. Lengths are in mm. In an SVG, y points down, so angles change their sign.

const NORMALS = [45, 135, -135, -45]; // directions of the faces' normals from the heading [°]
const POLES = { N: "north", S: "south" };

class Chain {
  constructor(parent, motion, sequence) {
    Object.assign(this, { parent, motion });
    const { data } = motion, { side } = data;
    this.links = sequence.map((faces, k) => this.#link(parent, faces, k));
    this.hinges = sequence.slice(1).map(() =>
      shape("circle", { class: "hinge", r: 0.055 * side }, parent));
    this.pin = data.pinned
      ? shape("circle", { class: "pin", r: 0.11 * side, "stroke-width": 0.04 * side }, parent)
      : null;
  }

  #link(parent, faces, k) {
    const { data } = this.motion, { side, magnets } = data;
    const group = shape("g", {}, parent), texts = [];
    shape("rect", {
      class: "casing", x: -side / 2, y: -side / 2, width: side, height: side,
      transform: "rotate(45)", "stroke-width": 0.012 * side,
    }, group);
    for (const [f, pole] of [...faces].entries()) {
      if (pole === "-" || !magnets) continue;
      const width = magnets.width[f], thickness = magnets.thickness[f];
      const depth = side / 2 - magnets.inset[f] - thickness / 2;
      const magnet = shape("g", {
        class: "magnet", "data-component": k, "data-face": f, transform: `rotate(${-NORMALS[f]}) translate(${depth} 0)`,
      }, group);
      shape("rect", {
        class: POLES[pole], x: -thickness / 2, y: -width / 2, width: thickness, height: width,
      }, magnet);
      texts.push([this.#text(pole, 0.9 * Math.min(thickness, width), magnet), NORMALS[f]]);
    }
    const number = this.#text(String(k + 1), 0.24 * side, group);
    number.setAttribute("class", "number");
    texts.push([number, 0]);
    return { group, texts, order: data.order[k] };
  }

  #text(content, height, parent) {
    const text = shape("text", { "font-size": height }, parent);
    text.textContent = content;
    return text;
  }

  draw(state) {
    for (const [k, { group, texts, order }] of this.links.entries()) {
      const [x, y] = state.centres[k], degrees = state.angles[k] * 180 / Math.PI;
      group.setAttribute("transform", `translate(${x} ${-y}) rotate(${-degrees})`);
      group.classList.toggle("bare", order >= state.loaded);
      // Texts stay upright.
      for (const [text, turn] of texts) text.setAttribute("transform", `rotate(${degrees + turn})`);
    }
    for (const [k, hinge] of this.hinges.entries()) {
      const [x, y] = state.centres[k], angle = state.angles[k], half = this.motion.diagonal / 2;
      set(hinge, { cx: x + half * Math.cos(angle), cy: -y - half * Math.sin(angle) });
    }
    if (this.pin) set(this.pin, { cx: state.base[0], cy: -state.base[1] });
  }
}
