// The target word, drawn as outlines of casings.

const TURNS = { L: Math.PI / 2, S: 0, R: -Math.PI / 2 };

/** Draw the word as an outline where the folded chain would lie; only if the lengths agree. */
function drawGhost(parent, motion, word) {
  if (word.length !== motion.count - 1) return;
  const end = motion.at(motion.end), middle = Math.floor(motion.count / 2);
  const angles = headingsOf(word);
  const turned = angles.map((angle) => angle + end.angles[middle] - angles[middle]);
  const centres = motion.centres(turned, [0, 0]);
  const [dx, dy] = [0, 1].map((k) => end.centres[middle][k] - centres[middle][k]);
  for (const [k, [x, y]] of centres.entries()) outline(parent, motion, x + dx, y + dy, turned[k]);
}

/** Draw a word as large as its picture allows, with numbered components. */
function drawTarget(picture, motion, word) {
  picture.replaceChildren();
  const angles = headingsOf(word), centres = motion.centres(angles, [0, 0]), { diagonal } = motion;
  for (const [k, [x, y]] of centres.entries()) {
    outline(picture, motion, x, y, angles[k]);
    shape("text", { x, y: -y, "font-size": 0.4 * diagonal }, picture).textContent = k + 1;
  }
  const [xs, ys] = [0, 1].map((axis) => centres.map((centre) => centre[axis]));
  const left = Math.min(...xs) - 0.6 * diagonal, top = -Math.max(...ys) - 0.6 * diagonal;
  const wide = Math.max(...xs) + 0.6 * diagonal - left, high = 0.6 * diagonal - Math.min(...ys) - top;
  set(picture, { viewBox: `${left} ${top} ${wide} ${high}`, "aria-label": `The word ${word}` });
}

function headingsOf(word) {
  const angles = [0];
  for (const letter of word) angles.push(angles.at(-1) + TURNS[letter]);
  return angles;
}

function outline(parent, { data: { side } }, x, y, angle) {
  const place = `translate(${x} ${-y}) rotate(${45 - angle * 180 / Math.PI})`;
  shape("rect", {
    class: "ghost", x: -side / 2, y: -side / 2, width: side, height: side, rx: 0.08 * side, transform: place,
  }, parent);
}
