// The part of the plane that the drawing shows; wheel, buttons, dragging and pinching change it.

const ZOOM = 1.25; // factor per click or key press
const RULERS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500]; // [mm]
const RULER = 90; // largest length of the ruler [px]

class Camera {
  constructor(drawing, ruler) {
    this.drawing = drawing;
    this.ruler = ruler;
    this.pointers = new Map();
    drawing.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * 0.0015), event.clientX, event.clientY);
    }, { passive: false });
    drawing.addEventListener("pointerdown", (event) => {
      drawing.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, event);
    });
    drawing.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      drawing.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    new ResizeObserver(() => this.#measure()).observe(drawing);
  }

  /** Show a rectangle [mm], with y downwards, to which `fit` returns. */
  look(whole) {
    this.whole = whole;
    this.fit();
  }

  fit() {
    this.view = { ...this.whole };
    this.#show();
  }

  /** Enlarge by `factor` about a point of the window [px], by default its centre. */
  zoom(factor, clientX, clientY) {
    const { view, whole } = this;
    const share = 1 / clamp(factor, view.w / (20 * whole.w), 40 * view.w / whole.w);
    const box = this.drawing.getBoundingClientRect();
    const [x, y] = this.#place(clientX ?? box.x + box.width / 2, clientY ?? box.y + box.height / 2);
    view.x = x - share * (x - view.x);
    view.y = y - share * (y - view.y);
    view.w *= share;
    view.h *= share;
    this.#show();
  }

  /** Move the view by pixels. */
  pan(dx, dy) {
    const { a: scale } = this.drawing.getScreenCTM();
    this.view.x -= dx / scale;
    this.view.y -= dy / scale;
    this.#show();
  }

  #drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    this.pointers.set(event.pointerId, event);
    const other = [...this.pointers.values()].find((each) => each.pointerId !== event.pointerId);
    if (!other) {
      this.pan(event.clientX - before.clientX, event.clientY - before.clientY);
      return;
    }
    const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
    const x = (event.clientX + other.clientX) / 2, y = (event.clientY + other.clientY) / 2;
    this.pan((event.clientX - before.clientX) / 2, (event.clientY - before.clientY) / 2);
    if (apart(before) > 0) this.zoom(apart(event) / apart(before), x, y);
  }

  /** Return the point of the drawing [mm] at a point of the window [px]. */
  #place(clientX, clientY) {
    const point = new DOMPoint(clientX, clientY);
    const { x, y } = point.matrixTransform(this.drawing.getScreenCTM().inverse());
    return [x, y];
  }

  #show() {
    const { x, y, w, h } = this.view;
    this.drawing.setAttribute("viewBox", `${x} ${y} ${w} ${h}`);
    this.#measure();
  }

  #measure() {
    const scale = this.drawing.getScreenCTM()?.a ?? 1;
    const length = RULERS.findLast((each) => each * scale <= RULER) ?? RULERS[0];
    this.ruler.style.width = `${length * scale}px`;
    this.ruler.textContent = `${length} mm`;
  }
}
