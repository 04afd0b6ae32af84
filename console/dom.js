// Nodes, and how a screen becomes what it is wanted to be: what is alike stays, with its focus and its finger on it.

// h("button.wide#go", {disabled: true, onclick: f}, "Go", other nodes, lists of them, or null)
export function h(spec, attributes = {}, ...children) {
  return make(document.createElement(spec.match(/^[a-z0-9]+/)[0]), spec, attributes, children);
}

const kSvg = "http://www.w3.org/2000/svg";
export function svg(spec, attributes = {}, ...children) {
  return make(document.createElementNS(kSvg, spec.match(/^[a-zA-Z0-9]+/)[0]), spec, attributes, children);
}

function make(node, spec, attributes, children) {
  for (const [, sign, word] of spec.matchAll(/([.#])([\w-]+)/g)) {
    if (sign === "#") node.id = word; else node.classList.add(word);
  }
  node.wanted = {};
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on") || ["value", "checked", "share", "part", "lies"].includes(name)) {
      node.wanted[name] = value;
      apply(node, name, value);
    } else if (name === "class") {
      if (value) node.classList.add(...value.split(" ").filter(Boolean));
    } else if (value !== false && value !== null && value !== undefined) {
      node.setAttribute(name, value === true ? "" : value);
    }
  }
  node.append(...flat(children));
  choose(node);
  return node;
}

// A choice is there only once its options are.
function choose(node) {
  if (node.nodeName === "SELECT" && "value" in node.wanted) apply(node, "value", node.wanted.value);
}

// `share`: of its parent's width. `part`: what is seen of a picture that its parent cuts off, {left, top, side} in
// fractions of it. `lies`: where on its parent, {left, top, width, height} in fractions of that. The page's policy
// forbids styles as text.
function apply(node, name, value) {
  // Without the attribute an option's value is its text, and so it never equals "".
  if (name === "value" && node.nodeName === "OPTION") node.setAttribute(name, value);
  else if (name === "share") node.style.width = `${100 * Math.min(1, Math.max(0, value))}%`;
  else if (name === "part") node.style.transform = value && value.side < 1 ? `scale(${1 / value.side}) translate(${-100 * value.left}%, ${-100 * value.top}%)` : "";
  else if (name === "lies") for (const [side, at] of Object.entries(value)) node.style[side] = `${100 * at}%`;
  else if (node[name] !== value) node[name] = value;
}

const flat = (children) => children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false && child !== "");

// The children of `place` become these. A node with data-key or an id keeps its self wherever it goes, and what is
// unfolded in it; what is inside a node with data-keep is its own business.
export function put(place, ...wanted) {
  const nodes = flat(wanted).map((node) => (node instanceof Node ? node : document.createTextNode(node)));
  const keyed = new Map(), stay = new Set(nodes.map(keyOf));
  for (const child of [...place.children]) {
    if (!keyOf(child)) continue;
    // First, so that its neighbours need not be moved: what is moved loses its focus.
    if (stay.has(keyOf(child))) keyed.set(keyOf(child), child); else child.remove();
  }
  let at = place.firstChild;
  for (const node of nodes) {
    const key = keyOf(node);
    const same = key ? keyed.get(key) : at && alike(at, node) ? at : null;
    if (!same) { place.insertBefore(node, at); continue; }
    // What has no self goes, so that this one stays where it is: what is moved loses its focus.
    while (at && at !== same && !keyOf(at)) at = gone(at);
    if (at === same) at = at.nextSibling; else place.insertBefore(same, at);
    become(same, node);
  }
  while (at) at = gone(at);
}

function gone(node) {
  const next = node.nextSibling;
  node.remove();
  return next;
}

const keyOf = (node) => node.nodeType === Node.ELEMENT_NODE && (node.dataset.key || node.id) ? `${node.nodeName} ${node.dataset.key || node.id}` : "";
const alike = (live, node) => live.nodeType === node.nodeType && live.nodeName === node.nodeName && !keyOf(live);

function become(live, node) {
  if (live.nodeType === Node.TEXT_NODE) {
    if (live.data !== node.data) live.data = node.data;
    return;
  }
  if (node.dataset.keep !== undefined) return;
  const own = live.hasAttribute("data-picture") ? ["style", "src", "hidden"] : ["style"];  // the picture is of pictures.js
  // What somebody has unfolded stays so.
  const unfolded = (name) => name === "open" && live.nodeName === "DETAILS";
  for (const {name} of [...live.attributes]) if (!node.hasAttribute(name) && !own.includes(name) && !unfolded(name)) live.removeAttribute(name);
  for (const {name, value} of node.attributes) if (live.getAttribute(name) !== value && !own.includes(name)) live.setAttribute(name, value);
  const before = live.wanted || {}, after = node.wanted || {};
  for (const name of Object.keys(before)) if (name.startsWith("on") && !(name in after)) live[name] = null;
  for (const [name, value] of Object.entries(after)) apply(live, name, value);
  live.wanted = after;
  put(live, ...node.childNodes);
  choose(live);
}
