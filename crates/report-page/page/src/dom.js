// Elements. Text comes in as text alone, so that names of a job are shown and never run.

/** Makes an element: `h('td.number', { title }, child, 'text')`. */
export function h(kind, ...rest) {
  const [tag, ...classes] = kind.split('.');
  const element = document.createElement(tag || 'div');
  if (classes.length) element.className = classes.join(' ');
  fill(element, rest);
  return element;
}

const SVG = 'http://www.w3.org/2000/svg';

/** The same for SVG. */
export function svg(tag, ...rest) {
  const element = document.createElementNS(SVG, tag);
  fill(element, rest);
  return element;
}

function fill(element, rest) {
  for (const item of rest.flat(4)) {
    if (item === null || item === undefined || item === false) continue;
    if (item instanceof Node) element.append(item);
    else if (typeof item === 'object') attributes(element, item);
    else element.append(document.createTextNode(String(item)));
  }
}

function attributes(element, values) {
  for (const [name, value] of Object.entries(values)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name === 'style') Object.assign(element.style, value);
    else element.setAttribute(name, value === true ? '' : value);
  }
}

/** Replaces the children of an element. */
export function put(element, ...children) {
  element.replaceChildren(...children.flat(4).filter((c) => c !== null && c !== undefined && c !== false).map((c) => (c instanceof Node ? c : document.createTextNode(String(c)))));
}
