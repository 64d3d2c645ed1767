// Elements, made without any HTML in text: what a hand or a file is called cannot become markup.

const SVG = 'http://www.w3.org/2000/svg';

function filled(element, properties, children) {
  for (const [name, value] of Object.entries(properties || {})) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== undefined && value !== null) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export const h = (tag, properties, ...children) => filled(document.createElement(tag), properties, children);
export const s = (tag, properties, ...children) => filled(document.createElementNS(SVG, tag), properties, children);

let names = 0;

/** A control with its label above it. */
export function field(label, control, wide = false) {
  control.id ||= `field-${names += 1}`;
  return h('div', wide ? { class: 'all' } : {}, h('label', { for: control.id }, label), control);
}

export function tick(label, properties) {
  const box = h('input', { type: 'checkbox', ...properties });
  return [h('label', { class: 'tick' }, box, label), box];
}

export function choice(names_, labels = {}) {
  return h('select', {}, names_.map((name) => h('option', { value: name }, labels[name] ?? name)));
}

/** Says a sentence at the edge of the window for a while. */
let gone;
export function say(sentence) {
  const place = document.querySelector('#said');
  place.textContent = sentence;
  clearTimeout(gone);
  gone = setTimeout(() => { place.textContent = ''; }, 6000);
}

/** Saves a file that was fetched. */
export function save(blob, name) {
  const link = h('a', { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
