// Elements, made without any HTML in text: what a hand or a file is called cannot become markup.

/** @import { Batch, Child, Hand, Machines, Named, Plot, Properties } from './types' */
const SVG = 'http://www.w3.org/2000/svg';

/** @template {Element} E @param {E} element @param {Properties | undefined} properties @param {Child[]} children @returns {E} */
function filled(element, properties, children) {
  for (const [name, value] of Object.entries(properties || {})) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== undefined && value !== null) element.setAttribute(name, value);
  }
  element.append(.../** @type {any[]} */ (children).flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** @template {keyof HTMLElementTagNameMap} K @param {K} tag @param {Properties} [properties] @param {Child[]} children */
export const h = (tag, properties, ...children) => filled(document.createElement(tag), properties, children);
/** @template {keyof SVGElementTagNameMap} K @param {K} tag @param {Properties} [properties] @param {Child[]} children */
export const s = (tag, properties, ...children) => filled(document.createElementNS(SVG, tag), properties, children);

let names = 0;

/** Where arrow keys go.  @type {Record<string, [number, number]>} */
export const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** Sizes of paper, as people call them. */
export const SIZES = { A6: 'A6, a card', A5: 'A5, a small letter', A4: 'A4, a letter', letter: 'US letter' };

/** Where what was refused is said. */
export const refusal = () => h('p', { class: 'bad', role: 'alert' });

export const button = (/** @type {Child} */ label, /** @type {(event: any) => any} */ onclick, /** @type {boolean} */ main = false, /** @type {Record<string, any>} */ more = {}) => h('button', { type: 'button', class: main ? 'main' : undefined, onclick, ...more }, label);

/** Work whose refusal is said at a place; what was cancelled is none.  @template {any[]} A @param {HTMLElement} place @param {(...given: A) => any} work @returns {(...given: A) => Promise<void>} */
export const guarded = (place, work) => async (...given) => {
  place.textContent = '';
  try { await work(...given); } catch (/** @type {any} */ error) { if (error.name !== 'AbortError') place.textContent = error.message; }
};

/** What is seldom needed, folded away.  @param {string} title @param {Child[]} children */
export const more = (title, ...children) => h('details', {}, h('summary', {}, title), children);

/** A control with its label above it.  @param {string | [string, Node]} label @param {HTMLElement} control */
export function field(label, control, wide = false) {
  control.id ||= `field-${names += 1}`;
  return h('div', wide ? { class: 'all' } : {}, h('label', { for: control.id }, label), control);
}

/** @param {string} label @param {Properties} [properties] @returns {[HTMLLabelElement, HTMLInputElement]} */
export function tick(label, properties) {
  const box = h('input', { type: 'checkbox', ...properties });
  return [h('label', { class: 'tick' }, box, label), box];
}

export function choice(/** @type {string[]} */ names_, /** @type {Record<string, string>} */ labels = {}) {
  return h('select', {}, names_.map((name) => h('option', { value: name }, labels[name] ?? name)));
}

/** @type {Record<string, string>} */
const STATES = { new: 'no proof yet', proofed: 'waits for your approval', approved: 'approved, not made', 'broken off': 'stopped on the way', done: 'done' };

/** What has become of a table with its letter; `made` are those that are made now.  @param {Batch} one @param {Record<string, string>} made */
export const batchState = (one, made) => (one.batch in made ? 'being made' : STATES[one.state]);

/** The same of a plot.  @param {Plot} plot @param {Record<string, string>} drawn */
export function plotState(plot, drawn) {
  if (plot.job in drawn) return 'being drawn';
  if (plot.finished) return 'drawn';
  return plot.runs.length ? `${Math.min(99, Math.round(100 * plot.drawn_mm / Math.max(plot.pen_down_mm, 1e-9)))} % drawn` : 'waits for the plotter';
}

/** A choice of what has a name and a title.  @param {Named[]} some @param {Record<string, string>} [first] */
export const titled = (some, first = {}) => choice([...Object.keys(first), ...some.map(({ name }) => name)], { ...first, ...Object.fromEntries(some.map(({ name, title }) => [name, title])) });

/** Print queues and printers, without the one that makes a file.  @param {Machines} machines */
export const printersOf = ({ queues, printers }) => [...queues.map((name) => ({ name, title: name })), ...printers.filter(({ name }) => name !== 'printer-pdf')];

/** What to do where this computer has no printer.  @param {Machines} machines */
export const noPrinter = ({ queues }) => (queues.length ? '' : h('span', { class: 'quiet small' }, 'This computer has no printer yet: set one up in its settings, or take a PDF and print that.'));

/** Where a plotter is connected.  @param {Named[]} ports */
export const portChoice = (ports) => titled(ports.map(({ name, title }) => ({ name, title: name.startsWith('sim') ? title : `${name} ${title}` })), { '': 'Choose where …' });

/** Hands by what they are called; those of one's own first.  @param {Hand[]} hands @param {Record<string, string>} [first] */
export function handChoice(hands, first = {}) {
  const part = (/** @type {string} */ label, /** @type {Hand[]} */ some) => (some.length ? h('optgroup', { label }, some.map((one) => h('option', { value: one.name }, one.own ? one.name : one.title || one.name))) : '');
  return h('select', {}, Object.entries(first).map(([value, label]) => h('option', { value }, label)),
    part('My own', hands.filter((one) => one.own)), part('Drawn by a pen', hands.filter((one) => one.drawn)), part('From paper, with its ink', hands.filter((one) => !one.drawn && !one.own)));
}

const HUES = { red: 16, orange: 42, yellow: 66, green: 164, turquoise: 196, blue: 254, violet: 290, pink: 338, 'red ': 360 }; // to where in the circle of hues; set by eye

/** An ink as people call it: #7c1f2b is red.  @param {string} hex */
export function inkName(hex) {
  const rgb = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255), [most, least] = [Math.max(...rgb), Math.min(...rgb)], light = (most + least) / 2, first = rgb.indexOf(most);
  if (most - least < 0.12) return light < 0.3 ? 'black' : light < 0.9 ? 'grey' : 'white';
  const turn = (60 * (2 * first + (rgb[(first + 1) % 3] - rgb[(first + 2) % 3]) / (most - least)) + 360) % 360, [name] = /** @type {[string]} */ (/** @type {unknown} */ (Object.entries(HUES).find(([, to]) => turn <= to)));
  return name === 'orange' && light < 0.4 ? 'brown' : name.trim();
}

/** [what they share, rows] of rows that have the same said of them, in their order.  @template R @param {R[]} rows @param {(row: R) => string} said @returns {[string, R[]][]} */
export function grouped(rows, said) {
  const groups = new Map();
  for (const row of rows) groups.set(said(row), [...(groups.get(said(row)) || []), row]);
  return [...groups];
}

/** The first rows of some by their numbers, and how many others there are.  @param {{row: number}[]} rows */
export const named = (rows, most = 5) => `rows ${rows.slice(0, most).map((one) => one.row).join(', ')}${rows.length > most ? ` and ${rows.length - most} others` : ''}`;

/** A row of steps: those before `at` are done, those before `open` can be gone to.  @param {string[]} titles @param {number} at @param {number} open @param {(step: number) => any} go */
export function steps(titles, at, open, go) {
  return h('ol', { class: 'steps', 'aria-label': 'Steps' }, titles.map((title, number) => h('li', { class: number < at ? 'over' : undefined, 'aria-current': number === at ? 'step' : undefined },
    number < open && number !== at ? h('button', { type: 'button', onclick: () => go(number) }, title) : title)));
}

/** A place to drop files on, or to choose them; `given` hears the files, which are none twice.  @param {string} label @param {string} hint @param {Record<string, any>} properties @param {(files: File[]) => any} given */
export function picker(label, hint, properties, given) {
  const input = h('input', { type: 'file', id: `field-${names += 1}`, ...properties });
  const take = (/** @type {FileList | null | undefined} */ files) => { if (files?.length) given([...files]); input.value = ''; };
  const element = h('div', { class: 'drop' }, h('label', { for: input.id }, label),
    h('span', { class: 'button', 'aria-hidden': 'true' }, properties.multiple ? 'Choose files' : 'Choose a file'), h('span', { class: 'quiet small' }, hint), input);
  input.addEventListener('change', () => take(input.files));
  for (const kind of ['dragover', 'dragleave', 'drop']) {
    element.addEventListener(kind, (event) => { event.preventDefault(); element.classList.toggle('over', kind === 'dragover'); });
  }
  element.addEventListener('drop', (event) => take(event.dataTransfer?.files));
  return element;
}

/** The plotter that was chosen last.  @returns {{device: string, port?: string}} */
export function machine() {
  const usual = { device: 'plotter-grbl-servo' };
  try { return { ...usual, ...JSON.parse(localStorage.getItem('handout-machine') || '{}') }; } catch { return usual; }
}

/** The address says what is shown; a page that was left while it was coming says nothing.  @param {Element} page @param {string} hash */
export const address = (page, hash) => { if (page.isConnected) history.replaceState(null, '', hash); };

let gone = 0;
/** Says a sentence at the edge of the window for a while.  @param {string} sentence */
export function say(sentence) {
  const place = /** @type {HTMLElement} */ (document.querySelector('#said'));
  place.textContent = sentence;
  clearTimeout(gone);
  gone = setTimeout(() => { place.textContent = ''; }, 6000);
}

/** Saves a file that was fetched.  @param {Blob} blob @param {string} name */
export function save(blob, name) {
  const link = h('a', { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
