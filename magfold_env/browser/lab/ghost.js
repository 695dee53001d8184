// The word that is wanted, as outlines of casings where the chain would lie at the end if it folded so.

const TURNS = { L: Math.PI / 2, S: 0, R: -Math.PI / 2 };

/** Draw a word about where the middle component of a motion ends; other lengths have no outline. */
function drawGhost(parent, motion, word) {
  if (word.length !== motion.count - 1) return;
  const { side } = motion.data, end = motion.at(motion.end), middle = Math.floor(motion.count / 2);
  const angles = [0];
  for (const letter of word) angles.push(angles.at(-1) + TURNS[letter]);
  const turned = angles.map((angle) => angle + end.angles[middle] - angles[middle]);
  const centres = motion.centres(turned, [0, 0]);
  const [dx, dy] = [0, 1].map((k) => end.centres[middle][k] - centres[middle][k]);
  for (const [k, [x, y]] of centres.entries()) {
    const place = `translate(${x + dx} ${-y - dy}) rotate(${45 - turned[k] * 180 / Math.PI})`;
    shape("rect", {
      class: "ghost", x: -side / 2, y: -side / 2, width: side, height: side, rx: 0.08 * side, transform: place,
    }, parent);
  }
}
