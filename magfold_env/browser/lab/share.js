// A scene as a link, and as the file that Python and the command line read.

/** Return the part after the # of a link that contains a scene and the target word. */
function toLink(scene, wanted) {
  const bytes = new TextEncoder().encode(JSON.stringify({ scene, wanted }));
  const text = btoa(String.fromCharCode(...bytes));
  return text.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

/** Return { scene, wanted } from the part of a link after its #; throws a SceneError. */
function fromLink(text) {
  const refuse = (allowed) => new SceneError([{ key: "link", value: text, allowed }]);
  let told;
  try {
    const binary = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    told = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(
      Uint8Array.from(binary, (letter) => letter.charCodeAt(0))));
  } catch {
    throw refuse("must be one that this page made, unbroken");
  }
  if (told === null || typeof told !== "object" || Array.isArray(told) || !("scene" in told)) {
    throw refuse("must hold a scene");
  }
  const { scene, wanted = "" } = told;
  if (typeof wanted !== "string" || !/^[LRS]*$/.test(wanted)) {
    throw new SceneError([{ key: "wanted", value: wanted, allowed: "must be letters L, R or S" }]);
  }
  return { scene, wanted };
}

/** Return a scene as YAML. */
function toYaml(scene) {
  const lines = Object.entries(scene).filter(([, value]) => value !== undefined);
  return lines.map(([key, value]) => `${key}: ${flow(value)}\n`).join("");
}

function flow(value) {
  if (Array.isArray(value)) return `[${value.map(flow).join(", ")}]`;
  if (typeof value === "object") {
    return `{${Object.entries(value).map(([key, each]) => `${key}: ${flow(each)}`).join(", ")}}`;
  }
  // YAML reads 1e-7 as a string.
  if (typeof value === "number") return String(value).replace(/^(-?\d+)e/, "$1.0e");
  return JSON.stringify(value);
}
