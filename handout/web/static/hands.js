// The page All hands: a gallery, and what a text would lack in a hand.

import { blob, request } from './api.js';
import { choice, field, h, save, say } from './dom.js';

function shown(title, picture) {
  const dialog = h('dialog', { 'aria-label': title },
    h('div', { class: 'row between' }, h('h2', {}, title), h('button', { type: 'button', onclick: () => dialog.close() }, 'Close')), picture);
  dialog.addEventListener('close', () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

async function pictureOf(url, alt, accept) {
  const source = URL.createObjectURL(await blob(url, accept));
  return h('img', { src: source, alt, onload: () => URL.revokeObjectURL(source) });
}

function card(hand, redraw, seen) {
  const figure = h('figure', {}, h('span', {}, '…'));
  const element = h('li', { class: 'card' }, h('h2', {}, hand.name), h('p', { class: 'quiet' }, `${hand.title}; ${hand.about}`), figure);
  const url = `/api/hands/${hand.name}`;
  seen(element, async () => {
    try {
      figure.replaceChildren(await pictureOf(`${url}/sample`, `A line written in ${hand.name}`, hand.drawn ? 'image/svg+xml' : 'image/png'));
    } catch (error) {
      figure.replaceChildren(h('span', {}, error.message));
    }
  });
  const act = (label, work) => h('button', {
    type: 'button',
    async onclick(event) {
      event.target.disabled = true;
      try {
        await work();
      } catch (error) {
        say(error.message);
      } finally {
        event.target.disabled = false;
      }
    },
  }, label);
  const actions = [h('a', { class: 'button', href: `#write/${encodeURIComponent(hand.name)}`, 'aria-label': `Write in ${hand.name}` }, 'Write'), act('All letters', async () => shown(`Letters of ${hand.name}`, await pictureOf(`${url}/sheet`, `All letters of ${hand.name}`, 'image/png')))];
  if (!hand.drawn) actions.push(act(hand.scans ? 'Save with scans' : 'Save', async () => save(await blob(`${url}/file`), `${hand.name}.hand`)));
  if (hand.scans) actions.push(act('Save ink only', async () => save(await blob(`${url}/file?ink_only=true`), `${hand.name}.hand`)));
  if (!hand.drawn) actions.push(h('a', { class: 'button', href: `#letters/${encodeURIComponent(hand.name)}` }, 'Letter by letter'));
  if (hand.removable) {
    actions.push(act('Delete', async () => {
      if (!confirm(`Delete the hand ${hand.name}? Its scans are not touched.`)) return;
      await request('DELETE', url);
      await redraw();
    }));
  }
  element.append(h('div', { class: 'row' }, actions));
  return element;
}

/** The gallery; a sample is asked for when its card comes into view. */
function gallery(hands, redraw) {
  const works = new Map();
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((one) => one.isIntersecting)) { watch.unobserve(entry.target); works.get(entry.target)(); }
  });
  const seen = (element, work) => { works.set(element, work); watch.observe(element); };
  return h('ul', { class: 'cards' }, hands.map((hand) => card(hand, redraw, seen)));
}

function lacking(hands) {
  const hand = choice(hands.map((one) => one.name));
  const text = h('textarea', { rows: 3, required: true });
  const refusal = h('p', { class: 'bad', role: 'alert' });
  const result = h('div', { 'aria-live': 'polite' });
  const how = { composed: 'put together from own letters', lent: 'lent', doubted: 'lent, as all own ones are doubtful', missing: 'missing' };
  async function submit(event) {
    event.preventDefault();
    refusal.textContent = '';
    try {
      const facts = await request('POST', `/api/hands/${hand.value}/lacks`, { text: text.value });
      result.replaceChildren(facts.supply.length
        ? h('ul', {}, facts.supply.map((one) => h('li', {}, h('strong', {}, one.letter), ` ${how[one.how] || one.how}`, one.from ? ` (${one.from})` : '')))
        : h('p', {}, 'Every letter of that text is there.'));
    } catch (error) {
      refusal.textContent = error.message;
    }
  }
  return h('section', { class: 'panel' }, h('h2', {}, 'What a text would lack'), h('form', { onsubmit: submit, 'aria-label': 'What a text would lack' },
    field('Hand', hand), field('Text', text), refusal, h('div', { class: 'row' }, h('button', {}, 'Look')), result));
}

export async function show(main, shared) {
  const place = h('section', { 'aria-label': 'All hands' });
  const redraw = async (again = true) => {
    if (again) await shared.refresh();
    const { hands } = shared.choices;
    place.replaceChildren(h('div', { class: 'row between headed' }, h('h1', {}, 'All hands'), h('a', { class: 'button', href: '#own' }, 'A new hand')), gallery([...hands].sort((a, b) => b.own - a.own), redraw));
  };
  await redraw(false);
  const scanned = shared.choices.hands.filter((hand) => !hand.drawn);
  main.append(h('div', { class: 'hands' }, h('div', { class: 'columns' }, place, lacking(scanned))));
  return () => document.querySelector('dialog')?.close();
}
