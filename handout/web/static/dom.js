// Elements, made without any HTML in text: what a hand or a file is called cannot become markup.

const SVG = 'http://www.w3.org/2000/svg';

function filled(element, properties, children) {
  for (const [name, value] of Object.entries(properties || {})) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== undefined && value !== null) element.setAttribute(name, value);
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export const h = (tag, properties, ...children) => filled(document.createElement(tag), properties, children);
export const s = (tag, properties, ...children) => filled(document.createElementNS(SVG, tag), properties, children);

let names = 0;

/** Sizes of paper, as people call them. */
export const SIZES = { A6: 'A6, a card', A5: 'A5, a small letter', A4: 'A4, a letter', letter: 'US letter' };

/** Where what was refused is said. */
export const refusal = () => h('p', { class: 'bad', role: 'alert' });

export const button = (label, onclick, main = false, more = {}) => h('button', { type: 'button', class: main ? 'main' : undefined, onclick, ...more }, label);

/** Work whose refusal is said at a place; what was cancelled is none. */
export const guarded = (place, work) => async (...given) => {
  place.textContent = '';
  try { await work(...given); } catch (error) { if (error.name !== 'AbortError') place.textContent = error.message; }
};

/** What is seldom needed, folded away. */
export const more = (title, ...children) => h('details', {}, h('summary', {}, title), children);

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

/** Hands by what they are called; those of one's own first. */
export function handChoice(hands, first = {}) {
  const part = (label, some) => (some.length ? h('optgroup', { label }, some.map((one) => h('option', { value: one.name }, one.own ? one.name : one.title || one.name))) : '');
  return h('select', {}, Object.entries(first).map(([value, label]) => h('option', { value }, label)),
    part('My own', hands.filter((one) => one.own)), part('Drawn by a pen', hands.filter((one) => one.drawn)), part('From paper, with its ink', hands.filter((one) => !one.drawn && !one.own)));
}

/** [what they share, rows] of rows that have the same said of them, in their order. */
export function grouped(rows, said) {
  const groups = new Map();
  for (const row of rows) groups.set(said(row), [...(groups.get(said(row)) || []), row]);
  return [...groups];
}

/** The first rows of some by their numbers, and how many others there are. */
export const named = (rows, most = 5) => `rows ${rows.slice(0, most).map((one) => one.row).join(', ')}${rows.length > most ? ` and ${rows.length - most} others` : ''}`;

/** A row of steps: those before `at` are done, those before `open` can be gone to. */
export function steps(titles, at, open, go) {
  return h('ol', { class: 'steps', 'aria-label': 'Steps' }, titles.map((title, number) => h('li', { class: number < at ? 'over' : undefined, 'aria-current': number === at ? 'step' : undefined },
    number < open && number !== at ? h('button', { type: 'button', onclick: () => go(number) }, title) : title)));
}

/** A place to drop files on, or to choose them; `given` hears the files, which are none twice. */
export function picker(label, hint, properties, given) {
  const input = h('input', { type: 'file', id: `field-${names += 1}`, ...properties });
  const take = (files) => { if (files.length) given([...files]); input.value = ''; };
  const element = h('div', { class: 'drop' }, h('label', { for: input.id }, label),
    h('span', { class: 'button', 'aria-hidden': 'true' }, properties.multiple ? 'Choose files' : 'Choose a file'), h('span', { class: 'quiet small' }, hint), input);
  input.addEventListener('change', () => take(input.files));
  for (const kind of ['dragover', 'dragleave', 'drop']) {
    element.addEventListener(kind, (event) => { event.preventDefault(); element.classList.toggle('over', kind === 'dragover'); });
  }
  element.addEventListener('drop', (event) => take(event.dataTransfer.files));
  return element;
}

/** The plotter that was chosen last. */
export function machine() {
  const usual = { device: 'plotter-grbl-servo' };
  try { return { ...usual, ...JSON.parse(localStorage.getItem('handout-machine')) }; } catch { return usual; }
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
