// The assembly sheet: the page's A4 print version, with what a workshop needs.

/** Show what to build: the straight chain, its parts and its scene. */
function showSheet(motion, scene, { magnets, casing }) {
  const picture = byId("straight"), { diagonal, count } = motion;
  picture.replaceChildren();
  const room = 0.55 * diagonal;
  set(picture, { viewBox: `${-0.1 * diagonal} ${-room} ${(count + 0.2) * diagonal} ${2 * room}` });
  const angles = Array(count).fill(0), base = [0, 0];
  new Chain(picture, motion, scene.sequence)
    .draw({ angles, base, centres: motion.centres(angles, base), loaded: count });

  const poles = scene.sequence.join(""), pieces = (pole) => poles.split(pole).length - 1;
  const mm = (length) => Number((1e3 * length).toPrecision(4));
  const size = ["width", "height", "thickness"].map((name) => mm(magnets[name])).join(" × ");
  byId("pieces").textContent =
    `${count} casings, side ${mm(casing.side)} mm, ${Number((1e3 * casing.mass).toPrecision(4))} g each with magnets, ` +
    "hinged where their corners touch; joints stop at ±90°, face on face. " +
    `${pieces("N") + pieces("S")} magnets, width × height × thickness ${size} mm, inset ${mm(magnets.inset)} mm, ` +
    `remanence ${scene.magnets.remanence} T: ${pieces("N")} with N out, ${pieces("S")} with S out.`;
}
