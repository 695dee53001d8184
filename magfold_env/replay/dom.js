// Helper functions that find and make elements.

const byId = (id) => document.getElementById(id);

const SVG = "http://www.w3.org/2000/svg";

/** Make an SVG element with attributes, inside `parent` if there is one. */
function shape(tag, attributes = {}, parent = null) {
  const element = document.createElementNS(SVG, tag);
  set(element, attributes);
  parent?.append(element);
  return element;
}

/** Make an HTML element with a text, inside `parent`. */
function write(tag, text, parent) {
  const element = document.createElement(tag);
  element.textContent = text;
  parent.append(element);
  return element;
}

function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    // A content security policy may forbid style attributes.
    if (name === "style") element.style.cssText = value;
    else element.setAttribute(name, value);
  }
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
