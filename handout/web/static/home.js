// The first page: three doors, a fourth for machines, and what was begun and is not done.

/** @import { Batch, Plot, Show } from './types' */
import { blob, request } from './api.js';
import { batchState, h, plotState, s } from './dom.js';

const SHOWN = 4; // of what is not done, the newest

/** Small drawings of what stands behind a door, as lines: paths in a box of 120 by 60. */
const PICTURES = {
  table: ['M6 12h44v36H6zM6 24h44M6 36h44M22 12v36', 'M58 30h10m-4-4 4 4-4 4', 'M76 8h26v36H76zM82 14h26v36H82zM88 20h26v36H88z', 'M93 30c3-4 4 3 7 0s4 3 7 0M93 38c3-4 4 3 7 0s4 2 9 0M93 46c3-4 4 3 7 0'],
  own: ['M6 6h34v48H6zM12 16h22M12 26h22M12 36h22M12 46h22', 'M13 14c2-5 3 3 6 0s3 3 6 0M13 24c2-5 3 3 6 0s3 3 6 0s3 2 7 0M13 34c2-5 3 3 6 0s3 3 6 0', 'M48 30h10m-4-4 4 4-4 4', 'M66 10h20v40H66zM72 45h8M70 16h12v22H70z', 'M92 30c3-9 5-9 4 0s3 4 5 0s3-6 4 0s3 3 5 0s3 2 5 0'],
  jobs: ['M10 50h100M18 50V16h84v34M18 24h84', 'M56 18h12v16h-12zM62 34v8', 'M30 44c4-6 5 4 9 0s5 4 9 0s5 3 11-1'],
};
const drawing = (/** @type {keyof typeof PICTURES} */ name) => s('svg', { viewBox: '0 0 120 60', 'aria-hidden': 'true' }, PICTURES[name].map((d) => s('path', { d })));

function door(/** @type {string} */ id, /** @type {string} */ title, /** @type {string} */ about, /** @type {Node} */ picture, small = false) {
  return h('li', {}, h('a', { class: small ? 'door small' : 'door', href: `#${id}` }, h('span', { class: 'scene' }, picture), h('strong', {}, title), h('span', { class: 'quiet' }, about)));
}

/** What was begun: batches and plots that are not done. */
async function begun() {
  const [{ batches, made }, { plots, drawn }] = await Promise.all([request('GET', '/api/batches'), request('GET', '/api/plots')]);
  const open = (/** @type {string} */ id, /** @type {string} */ title, /** @type {string} */ what) => h('li', {}, h('a', { class: 'button', href: `#${id}` }, h('span', {}, title), h('span', { class: 'quiet' }, what)));
  return [
    .../** @type {Batch[]} */ (batches).filter((one) => one.state !== 'done').slice(0, SHOWN).map((one) => open(`table/${one.batch}`, one.title, batchState(one, made))),
    .../** @type {Plot[]} */ (plots).filter((one) => !one.finished).slice(0, SHOWN).map((one) => open(`jobs/${one.job}`, one.title || one.job, plotState(one, drawn))),
  ];
}

/** @type {Show} */
export async function show(main) {
  const sample = h('span', { class: 'skeleton' });
  const open = h('section', { 'aria-label': 'Not done yet', hidden: true });
  main.append(h('div', { class: 'home' }, h('h1', {}, 'What would you like to do?'),
    h('ul', { class: 'doors' },
      door('write', 'Write something', 'A letter, a card, a note: type it, and see it written.', sample),
      door('table', 'Letters from a table', 'One letter, many people: a list of names fills the gaps.', drawing('table')),
      door('own', 'My own handwriting', 'Print a sheet, write on it, photograph it: then it writes as you do.', drawing('own')),
      door('jobs', 'On the desk', 'Plotters, printers, their colours, and styles of writing.', drawing('jobs'), true)),
    open));
  const gone = new AbortController();
  blob('/api/hands/house-joined/sample', 'image/svg+xml', 'GET', undefined, gone.signal).then((picture) => {
    const href = URL.createObjectURL(picture);
    sample.replaceWith(h('img', { src: href, alt: '', class: 'unrolled', onload: () => URL.revokeObjectURL(href) }));
  }).catch(() => sample.replaceWith(drawing('own')));
  const left = await begun().catch(() => []);
  open.hidden = !left.length;
  open.append(h('h2', {}, 'Not done yet'), h('ul', { class: 'list' }, left));
  return () => gone.abort();
}
