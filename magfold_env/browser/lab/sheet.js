// The assembly sheet: the page's A4 print version, with what a workshop needs.

/** Show what to build: the straight chain, its parts and its scene. */
function showSheet(motion, { sequence, sizes, mass, remanence }) {
  const picture = byId("straight"), { diagonal, count } = motion;
  picture.replaceChildren();
  const room = 0.55 * diagonal;
  set(picture, { viewBox: `${-0.1 * diagonal} ${-room} ${(count + 0.2) * diagonal} ${2 * room}` });
  const angles = Array(count).fill(0), base = [0, 0];
  new Chain(picture, motion, sequence)
    .draw({ angles, base, centres: motion.centres(angles, base), loaded: count });

  const poles = sequence.join(""), pieces = (pole) => poles.split(pole).length - 1;
  const milli = (size) => Number((1e3 * size).toPrecision(4));
  const [side, width, height, thickness, inset] = sizes.map(milli);
  byId("pieces").textContent =
    `${count} casings, side ${side} mm, ${[...new Set(mass)].map(milli).join(", ")} g each with magnets, ` +
    "hinged where their corners touch; joints stop at ±90°, face on face. " +
    `${pieces("N") + pieces("S")} magnets, width × height × thickness ${width} × ${height} × ${thickness} mm, ` +
    `inset ${inset} mm, remanence ${remanence[0][0]} T: ${pieces("N")} with N out, ${pieces("S")} with S out.`;
}
