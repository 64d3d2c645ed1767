// The frame: the session, the doors, and which page is shown.  A page is fetched when it is first opened.

/** @import { Show, Shared } from './types' */
import { open, key, request } from './api.js';
import { h, say } from './dom.js';

/** Pages by their place in the address: title, module.  @type {Record<string, [string, () => Promise<{show: Show}>]>} */
const PAGES = {
  home: ['Start', () => import('./home.js')],
  write: ['Write', () => import('./write.js')],
  table: ['Letters from a table', () => import('./table.js')],
  own: ['My own handwriting', () => import('./own.js')],
  hands: ['All handwritings', () => import('./hands.js')],
  letters: ['Correct letters', () => import('./letters.js')],
  jobs: ['Plotter', () => import('./jobs.js')],
  calibration: ['Colours', () => import('./calibration.js')],
  styles: ['Styles', () => import('./styles.js')],
  style: ['A style', () => import('./style.js')],
};
/** Doors: what the link says, and the pages behind it.  @type {Record<string, [string, string[]]>} */
const DOORS = { write: ['Write', []], table: ['From a table', []], own: ['My hand', ['own', 'hands', 'letters']], jobs: ['On the desk', ['jobs', 'calibration', 'styles']] };
const main = /** @type {HTMLElement} */ (document.querySelector('#main'));
/** @type {Shared} */
const shared = { choices: /** @type {any} */ (null), async refresh() { this.choices = await request('GET', '/api/choices'); } };
let leave = /** @type {(() => void) | null | undefined | void} */ (null), shown = 0;

function links(/** @type {string} */ shownPage) {
  const name = shownPage === 'style' ? 'styles' : shownPage; // one of them
  const door = Object.keys(DOORS).find((id) => id === name || DOORS[id][1].includes(name));
  const to = (/** @type {string} */ id, /** @type {string} */ label, /** @type {boolean} */ here) => h('a', { href: `#${id}`, 'aria-current': here ? 'page' : undefined }, label);
  const within = (door && DOORS[door][1]) || [];
  /** @type {HTMLElement} */ (document.querySelector('#pages')).replaceChildren(...Object.entries(DOORS).map(([id, [label]]) => to(id, label, id === door)));
  const inner = /** @type {HTMLElement} */ (document.querySelector('#within'));
  inner.hidden = !within.length;
  inner.replaceChildren(...within.map((id) => to(id, PAGES[id][0], id === name)));
  for (const here of document.querySelectorAll('nav [aria-current]')) here.scrollIntoView({ block: 'nearest', inline: 'nearest' });
}

async function show() {
  const [asked, ...rest] = (location.hash.slice(1) || 'home').split('/');
  const name = asked in PAGES ? asked : 'home', [title, module] = PAGES[name];
  links(name);
  document.title = `${title} – handout studio`;
  leave?.();
  leave = null;
  // each in a place of its own: one that is left while it is still coming writes into nothing
  const own = shown += 1, place = h('div', { class: 'page' });
  main.replaceChildren(place);
  const page = await module();
  const left = own === shown ? await page.show(place, shared, rest.map(decodeURIComponent)) : null;
  if (own === shown) leave = left; else left?.();
}

try {
  await open();
  if (!key()) throw new Error('Open the link that `handout studio` printed in its terminal: it lets this browser in.');
  await shared.refresh();
  addEventListener('pagehide', () => /** @type {HTMLElement | null} */ (document.activeElement)?.blur()); // what is typed there counts, as where one goes on
  addEventListener('hashchange', () => show().catch((error) => say(error.message)));
  await show();
} catch (/** @type {any} */ error) {
  main.replaceChildren(h('div', { class: 'middle' }, h('h1', {}, 'Not let in'), h('p', { class: 'bad', role: 'alert' }, error.message)));
}
