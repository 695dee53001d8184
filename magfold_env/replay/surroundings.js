// What does not move: the tube, a fixed magnet, and the view that holds everything.

const SEEN_TUBE = 2.4; // diagonals of tube to the left of its mouth
const WIDEST = 3; // views: a magnet farther away is left out rather than the chain made tiny

function drawSurroundings(parent, motion) {
  const { tube, field } = motion.data;
  if (tube) drawTube(parent, tube, (motion.count + SEEN_TUBE) * motion.diagonal);
  if (field?.corners) drawFixedMagnet(parent, field.corners);
}

function drawTube(parent, { bore, wall }, length) {
  const slab = (kind, y, height) =>
    shape("rect", { class: kind, x: -length, y, width: length, height }, parent);
  slab("bore", -bore / 2, bore);
  slab("tube", -bore / 2 - wall, wall);
  slab("tube", bore / 2, wall);
}

function drawFixedMagnet(parent, corners) {
  const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  const [northRight, northLeft, southLeft, southRight] = corners;
  const left = middle(northLeft, southLeft), right = middle(northRight, southRight);
  const long = Math.hypot(left[0] - northLeft[0], left[1] - northLeft[1]);
  const wide = Math.hypot(left[0] - right[0], left[1] - right[1]);
  const points = (places) => places.map(([x, y]) => `${x},${-y}`).join(" ");
  const halves = { N: [northRight, northLeft, left, right], S: [left, southLeft, southRight, right] };
  for (const [pole, outline] of Object.entries(halves)) {
    shape("polygon", { class: POLES[pole], points: points(outline) }, parent);
    const [x, y] = middle(outline[0], outline[2]);
    const text = shape("text", { x, y: -y, "font-size": 0.7 * Math.min(long, wide) }, parent);
    text.textContent = pole;
  }
  shape("polygon", { class: "block", points: points(corners), "stroke-width": 0.3 }, parent);
}

/** Return the rectangle [mm], y down, in which the released components stay, and what is near. */
function wholeView(motion) {
  const { data, diagonal } = motion;
  const points = [];
  for (const [frame, angles] of data.angles.entries()) {
    for (const [k, [x, y]] of motion.centres(angles, data.base[frame]).entries()) {
      if (data.order[k] < data.released[frame]) points.push([x, -y]);
    }
  }
  if (data.tube) points.push([0.6 * diagonal, 0], [(0.9 - SEEN_TUBE) * diagonal, 0]);
  const view = around(points, 0.9 * diagonal);
  if (!data.field?.corners) return view;
  const corners = data.field.corners.map(([x, y]) => [x, -y]);
  const all = around([...corners, [view.x, view.y], [view.x + view.w, view.y + view.h]], 2);
  const grown = Math.max(all.w, all.h) > WIDEST * Math.max(view.w, view.h);
  return grown ? view : all;
}

function around(points, room) {
  let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) {
    left = Math.min(left, x);
    right = Math.max(right, x);
    top = Math.min(top, y);
    bottom = Math.max(bottom, y);
  }
  return { x: left - room, y: top - room, w: right - left + 2 * room, h: bottom - top + 2 * room };
}
