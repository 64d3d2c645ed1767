// The frame: the session, and which page is shown.

import { open, key, request } from './api.js';
import { h, say } from './dom.js';
import * as write from './write.js';
import * as hands from './hands.js';
import * as letters from './letters.js';
import * as style from './style.js';
import * as jobs from './jobs.js';
import * as calibration from './calibration.js';

const PAGES = {
  write: ['Write', write], hands: ['Hands', hands], letters: ['Letters', letters], style: ['Style', style],
  calibration: ['Calibration', calibration], jobs: ['Jobs', jobs],
};
const main = document.querySelector('#main');
const shared = { choices: null, async refresh() { this.choices = await request('GET', '/api/choices'); } };
let leave = null, shown = 0;

async function show() {
  const [name, ...rest] = (location.hash.slice(1) || 'write').split('/');
  const [title, page] = PAGES[name] || PAGES.write;
  document.querySelector('#pages').replaceChildren(...Object.entries(PAGES).map(([id, [label]]) => h(
    'a', { href: `#${id}`, 'aria-current': label === title ? 'page' : undefined }, label,
  )));
  document.querySelector('#pages [aria-current]').scrollIntoView({ block: 'nearest', inline: 'nearest' });
  document.title = `${title} – handout studio`;
  leave?.();
  leave = null;
  // each in a place of its own: one that is left while it is still coming writes into nothing
  const own = shown += 1, place = h('div', { class: 'page' });
  main.replaceChildren(place);
  const left = await page.show(place, shared, rest.map(decodeURIComponent));
  if (own === shown) leave = left; else left?.();
}

try {
  await open();
  if (!key()) throw new Error('Open the link that `handout studio` printed in its terminal: it lets this browser in.');
  await shared.refresh();
  addEventListener('hashchange', () => show().catch((error) => say(error.message)));
  await show();
} catch (error) {
  main.replaceChildren(h('div', { class: 'middle' }, h('h1', {}, 'Not let in'), h('p', { class: 'bad', role: 'alert' }, error.message)));
}
