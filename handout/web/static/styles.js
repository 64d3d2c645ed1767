// The page Styles: one word in every style, side by side; each is written with, or changed.

/** @import { Show } from './types' */
import { request } from './api.js';
import * as drafts from './drafts.js';
import { button, field, h, refusal } from './dom.js';
import { paintStrokes, surface } from './canvas.js';

const PAUSE = 300; // ms after the last key

/** @type {Show} */
export async function show(main, shared) {
  const before = await drafts.kept('style'), gone = new AbortController(), unkept = refusal();
  const word = h('input', { value: 'minimum', maxlength: 40, autocomplete: 'off' });
  drafts.remember('word', { word });

  /** A style: what it is called, what it looks like, and the word in it.  @param {string} name */
  function card(name) {
    let strokes = /** @type {any[]} */ ([]), values = /** @type {any} */ (null), asked = /** @type {AbortController | null} */ (null);
    const title = h('p', {}), wrong = refusal();
    const line = surface(`The word in ${name}`, (/** @type {CanvasRenderingContext2D} */ context, /** @type {number} */ width, /** @type {number} */ height) => paintStrokes(context, width, height, strokes));
    async function write() {
      asked?.abort();
      const own = asked = new AbortController();
      try {
        if (!values) {
          const facts = await request('GET', `/api/styles/${encodeURIComponent(name)}`, undefined, gone.signal);
          const [called, ...seen] = facts.title.split(': ');
          title.replaceChildren(h('b', {}, called), facts.learned ? ' – moves as the drawings did that it was learned of' : seen.length ? ` – ${seen.join(': ')}` : '');
          values = { name, values: facts.values, ...(facts.learned ? { base: name } : {}) };
        }
        ({ strokes } = await request('POST', '/api/movements/word', { text: word.value.trim() || 'minimum', style: values }, own.signal));
        line.canvas.dataset.shown = word.value;
        wrong.textContent = '';
        line.again();
      } catch (/** @type {any} */ error) {
        if (error.name !== 'AbortError') wrong.textContent = error.message;
      }
    }
    const take = async () => {
      await drafts.keep('draft', { ...await drafts.kept('draft'), style: name, more: true }, unkept);
      location.hash = 'write';
    };
    const element = h('li', { class: 'card' }, title, h('figure', {}, line.canvas), wrong,
      h('div', { class: 'row' }, button('Write with it', take, false, { 'aria-label': `Write with ${name}` }), h('a', { class: 'button', href: `#style/${encodeURIComponent(name)}`, 'aria-label': `Change ${name}` }, 'Change it …')));
    return { element, write, stop: () => asked?.abort() };
  }

  const cards = shared.choices.styles.map(card);
  const all = async () => { for (const one of cards) if (!gone.signal.aborted) await one.write(); };
  let waiting = 0;
  word.addEventListener('input', () => { clearTimeout(waiting); waiting = setTimeout(all, PAUSE); });
  main.append(h('div', { class: 'hands' }, h('h1', {}, 'Styles'),
    h('p', { class: 'quiet' }, 'The same letters, written calmly, in haste, with a broad nib. A style goes with every handwriting: choose one here, or under More on the page Write.'),
    before.unsaved && before.style ? h('p', {}, `Your changes of ${before.style.name} are not kept yet: `, h('a', { href: `#style/${encodeURIComponent(before.style.name)}` }, 'go on with them'), '.') : '',
    unkept, h('div', { class: 'grid' }, field('The word', word)), h('ul', { class: 'cards' }, cards.map((one) => one.element))));
  all();
  return () => { gone.abort(); clearTimeout(waiting); for (const one of cards) one.stop(); };
}
