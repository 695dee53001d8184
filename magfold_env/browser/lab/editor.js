// A chain's poles as buttons, four per component, arranged as when it heads to the right.

const FACE_NAMES = ["front left", "back left", "back right", "front right"];
const GRID = [1, 0, 2, 3]; // faces in the order shown, row by row
const POLE_NAMES = { N: "north", S: "south", "-": "no magnet" };

class Editor {
  /** `changed` is called with the sequence when the user gives a face another of the `poles`. */
  constructor(parent, changed, poles = "NS-") {
    Object.assign(this, { parent, changed, poles, sequence: [], first: 0 });
    parent.addEventListener("click", ({ target }) => {
      const face = target.closest("[data-face]");
      if (face) this.turn(Number(face.dataset.component), Number(face.dataset.face));
    });
    parent.addEventListener("keydown", (event) => this.#key(event));
  }

  /** Show some components; `first` is the index of the first one, counted from 0. */
  show(sequence, first = 0) {
    const same = sequence.length === this.sequence.length && first === this.first;
    Object.assign(this, { sequence: [...sequence], first });
    if (!same) this.#build();
    for (const button of this.#buttons()) {
      const { component, face } = button.dataset, pole = sequence[component][face];
      button.dataset.pole = button.textContent = pole;
      const name = `component ${this.first + Number(component) + 1}, ${FACE_NAMES[face]}: ${POLE_NAMES[pole]}`;
      button.setAttribute("aria-label", name);
      button.title = name;
    }
  }

  /** Give a face another pole, by default the next in order. */
  turn(component, face, pole = this.#after(this.sequence[component][face])) {
    if (!this.poles.includes(pole)) return;
    const faces = [...this.sequence[component]];
    faces[face] = pole;
    this.changed(this.sequence.with(component, faces.join("")));
  }

  #after(pole) {
    return this.poles[(this.poles.indexOf(pole) + 1) % this.poles.length];
  }

  #buttons() {
    return [...this.parent.querySelectorAll("[data-face]")];
  }

  #build() {
    this.parent.replaceChildren();
    for (const k of this.sequence.keys()) {
      const component = write("div", "", this.parent);
      component.className = "component";
      for (const face of GRID) {
        const button = write("button", "", component);
        button.type = "button";
        Object.assign(button.dataset, { component: k, face });
      }
      write("b", String(this.first + k + 1), write("span", "", component)).ariaHidden = "true";
    }
  }

  #key(event) {
    const { target, key } = event, buttons = this.#buttons(), here = buttons.indexOf(target);
    if (here < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const pole = { n: "N", s: "S", "-": "-" }[key.toLowerCase()];
    const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -4, ArrowDown: 4 }[key];
    if (pole) this.turn(Number(target.dataset.component), Number(target.dataset.face), pole);
    else if (step) buttons[clamp(here + step, 0, buttons.length - 1)].focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
