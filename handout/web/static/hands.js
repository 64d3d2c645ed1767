// The page All handwritings: a gallery, and what a text would lack in a hand.

/** @import { Hand, Show } from './types' */
import { blob, request } from './api.js';
import { button, field, guarded, h, handChoice, more, refusal, save } from './dom.js';
import { remember } from './drafts.js';
import { picture } from './work.js';

function shown(/** @type {string} */ title, /** @type {Node} */ shownIn) {
  const dialog = h('dialog', { 'aria-label': title },
    h('div', { class: 'row between' }, h('h2', {}, title), button('Close', () => dialog.close())), shownIn);
  dialog.addEventListener('close', () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

const pictureOf = async (/** @type {string} */ url, /** @type {string} */ alt, /** @type {string} */ accept) => picture(await blob(url, accept), alt);

function card(/** @type {Hand} */ hand, /** @type {() => Promise<void>} */ redraw, /** @type {(element: Element, work: () => void) => void} */ seen) {
  const figure = h('figure', {}, h('span', { class: 'skeleton' })), called = hand.own ? hand.name : hand.title;
  const wrong = refusal(), url = `/api/hands/${hand.name}`, element = h('li', { class: 'card' });
  seen(element, async () => {
    try {
      figure.replaceChildren(await pictureOf(`${url}/sample`, `A line written in ${called}`, hand.drawn ? 'image/svg+xml' : 'image/png'));
    } catch (/** @type {any} */ error) {
      figure.replaceChildren(h('span', {}, error.message));
    }
  });
  const act = (/** @type {string} */ label, /** @type {() => any} */ work) => button(label, async ({ target }) => {
    target.disabled = true;
    await guarded(wrong, work)();
    target.disabled = false;
  });
  const link = (/** @type {string} */ label, /** @type {string} */ to) => h('a', { class: 'button', href: `#${to}/${encodeURIComponent(hand.name)}`, 'aria-label': `${label} in ${called}` }, label);
  const file = (/** @type {string} */ label, /** @type {string} */ query) => act(label, async () => save(await blob(`${url}/file${query}`), `${hand.name}.hand`));
  const rest = [hand.drawn ? '' : file(hand.scans ? 'Save with scans' : 'Save', ''), hand.scans ? file('Save ink only', '?ink_only=true') : '', hand.removable ? act('Delete', async () => {
    if (!confirm(`Delete the handwriting ${called}? Its scans are not touched.`)) return;
    await request('DELETE', url);
    await redraw();
  }) : ''];
  element.append(h('h2', {}, called), figure, h('div', { class: 'row' }, link('Write', 'write'), hand.own ? link('Correct letters', 'letters') : '', act('All letters', async () => shown(`Letters of ${called}`, await pictureOf(`${url}/sheet`, `All letters of ${called}`, 'image/png')))),
    more('More', h('p', { class: 'quiet' }, `${hand.name}: ${hand.title}; ${hand.about}.`), h('div', { class: 'row' }, rest)), wrong);
  return element;
}

/** The gallery; a sample is asked for when its card comes into view.  @param {Hand[]} hands @param {() => Promise<void>} redraw */
function gallery(hands, redraw) {
  const works = new Map();
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((one) => one.isIntersecting)) { watch.unobserve(entry.target); works.get(entry.target)(); }
  });
  const seen = (/** @type {Element} */ element, /** @type {() => void} */ work) => { works.set(element, work); watch.observe(element); };
  return h('ul', { class: 'cards' }, hands.map((hand) => card(hand, redraw, seen)));
}

/** Whether a text can be written in a hand with its own letters alone.  @param {Hand[]} hands */
function lacking(hands) {
  const hand = handChoice(hands), text = h('textarea', { rows: 3, required: true });
  remember('lacking', { hand, text });
  const wrong = refusal(), result = h('div', { 'aria-live': 'polite' });
  const how = /** @type {Record<string, string>} */ ({ composed: 'put together from its own letters', lent: 'lent by another', doubted: 'lent by another, as all its own are doubtful', missing: 'missing' });
  const submit = guarded(wrong, async () => {
    const facts = await request('POST', `/api/hands/${hand.value}/lacks`, { text: text.value });
    result.replaceChildren(facts.supply.length
      ? h('ul', {}, facts.supply.map((/** @type {{letter: string, how: string, from?: string}} */ one) => h('li', {}, h('strong', {}, one.letter), ` ${how[one.how] || one.how}`, one.from ? ` (${one.from})` : '')))
      : h('p', {}, 'Every letter of that text is there.'));
  });
  return h('section', { class: 'panel' }, h('h2', {}, 'Does it have the letters of a text?'), h('form', { onsubmit: (/** @type {Event} */ event) => { event.preventDefault(); submit(); }, 'aria-label': 'Has it all letters for a text?' },
    field('Handwriting', hand), field('Text', text), wrong, h('div', { class: 'row' }, h('button', {}, 'Look')), result));
}

/** @type {Show} */
export async function show(main, shared) {
  const place = h('section', { 'aria-label': 'All handwritings' });
  const redraw = async (again = true) => {
    if (again) await shared.refresh();
    const { hands } = shared.choices;
    place.replaceChildren(h('div', { class: 'row between headed' }, h('h1', {}, 'All handwritings'), h('a', { class: 'button', href: '#own' }, 'Add my own')), gallery([...hands].sort((a, b) => Number(b.own) - Number(a.own)), redraw));
  };
  await redraw(false);
  const scanned = shared.choices.hands.filter((hand) => !hand.drawn);
  main.append(h('div', { class: 'hands' }, h('div', { class: 'columns' }, place, lacking(scanned))));
  return () => document.querySelector('dialog')?.close();
}
