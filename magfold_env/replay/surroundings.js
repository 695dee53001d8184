// Drawings of the tube, obstacles and a fixed magnet, and the view that contains everything.

const SEEN_TUBE = 2.4; // length of tube shown to the left of its mouth [diagonals]
const WIDEST = 3; // largest widening of a view for fixed bodies; more would make the chain tiny

function drawSurroundings(parent, motion) {
  const { tube, obstacles, field } = motion.data;
  for (const corners of obstacles) {
    shape("polygon", { class: "tube", points: outlined(corners) }, parent);
  }
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
  const halves = { N: [northRight, northLeft, left, right], S: [left, southLeft, southRight, right] };
  for (const [pole, outline] of Object.entries(halves)) {
    shape("polygon", { class: POLES[pole], points: outlined(outline) }, parent);
    const [x, y] = middle(outline[0], outline[2]);
    const text = shape("text", { x, y: -y, "font-size": 0.7 * Math.min(long, wide) }, parent);
    text.textContent = pole;
  }
  shape("polygon", { class: "block", points: outlined(corners), "stroke-width": 0.3 }, parent);
}

/** Return corners [mm] as the points of a polygon, with y downwards. */
const outlined = (corners) => corners.map(([x, y]) => `${x},${-y}`).join(" ");

/** Return a rectangle [mm], y downwards, around released components and bodies near them. */
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
  const solids = [...data.obstacles, ...(data.field?.corners ? [data.field.corners] : [])];
  return solids.reduce((seen, corners) => {
    const ends = [[seen.x, seen.y], [seen.x + seen.w, seen.y + seen.h]];
    const all = around([...corners.map(([x, y]) => [x, -y]), ...ends], 2);
    const grown = Math.max(all.w, all.h) > WIDEST * Math.max(view.w, view.h);
    return grown ? seen : all;
  }, view);
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
