// The page Hands: a gallery, a new hand from scans, what a text would lack, sheets to write on.

import { blob, fileOf, request, task } from './api.js';
import { choice, field, h, picker, save, say, tick } from './dom.js';
import * as drafts from './drafts.js';

const TAKEN = '.png,.jpg,.jpeg,.tif,.tiff,.pdf,.webp,.bmp,.hand';
const NEEDS_NO_TEXT = 'Leave the text empty for sheets that were made here: they say what is written on them.';

/** A line that shows how far work has come, and can cancel it. */
function progress() {
  const bar = h('progress', { max: 1, value: 0, 'aria-label': 'Progress' });
  const stage = h('span', { class: 'quiet' });
  const cancel = h('button', { type: 'button' }, 'Cancel');
  const line = h('div', { class: 'work', hidden: true }, stage, bar, cancel);
  let own = null;
  cancel.addEventListener('click', () => own?.abort());
  return {
    line,
    async run(work) {
      own = new AbortController();
      line.hidden = false;
      try {
        return await work((snapshot) => {
          bar.value = snapshot.share;
          stage.textContent = snapshot.state === 'waiting' ? 'waiting' : snapshot.stage;
        }, own.signal);
      } finally {
        line.hidden = true;
      }
    },
  };
}

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
  if (!hand.drawn) actions.push(h('a', { class: 'button', href: `#letters/${encodeURIComponent(hand.name)}` }, 'Letters'));
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

/** A new hand; with `own`, the names of hands that more pages may be added to. */
function reader(redraw, own, typed) {
  const into = choice(['', ...own], { '': 'a new hand', ...Object.fromEntries(own.map((name) => [name, `more of ${name}`])) });
  const name = h('input', { required: true, pattern: '[\\w\\-]{1,80}', title: 'Letters, digits, - and _', autocomplete: 'off' });
  const dpi = h('input', { type: 'number', min: 50, max: 2400, placeholder: 'as the file says' });
  const [keeping, withScan] = tick('Keep the scan around the writing in the file, so that ink can be painted with it', { checked: true });
  const list = h('div', { class: 'panel-scans' });
  const refusal = h('p', { class: 'bad', role: 'alert' }), unkept = h('p', { class: 'bad', role: 'alert' });
  const result = h('div', { 'aria-live': 'polite' });
  const button = h('button', { class: 'main' }, 'Read the hand');
  const { line, run } = progress();
  const scans = [], texts = typed.texts || {}; // name of a file → what was typed of it, until it is read
  const drop = picker('Scans or photographs, or a .hand file', 'Drop them here. 300 dpi or more; PNG, JPEG, TIFF, PDF.', { multiple: true, accept: TAKEN }, add);

  function add(files) {
    for (const file of files) {
      const text = h('textarea', { rows: 4, oninput() { texts[file.name] = text.value; keep(); } });
      text.value = texts[file.name] || '';
      const scan = { file, text };
      const box = h('div', { class: 'scan' },
        h('div', { class: 'row between' }, h('strong', {}, file.name), h('button', { type: 'button', 'aria-label': `Take ${file.name} away`, onclick() { scans.splice(scans.indexOf(scan), 1); box.remove(); } }, 'Take away')),
        file.name.endsWith('.hand') ? '' : field('What is written on it, line by line', text));
      if (!name.value && file.name.endsWith('.hand')) name.value = file.name.replace(/\.hand$/, '');
      scans.push(scan);
      list.append(box);
    }
  }

  const keep = () => drafts.keep('texts', { texts }, unkept);

  async function read(heard, signal) {
    const ids = [];
    try {
      return await readFrom(ids, heard, signal);
    } finally {
      for (const id of ids) request('DELETE', `/api/uploads/${id}`).catch(() => {});
    }
  }

  async function readFrom(ids, heard, signal) {
    for (const { file } of scans) {
      heard({ share: 0, stage: `sending ${file.name}` });
      ids.push((await request('POST', `/api/uploads?name=${encodeURIComponent(file.name)}`, file, signal)).id);
    }
    if (scans.length === 1 && scans[0].file.name.endsWith('.hand')) {
      return { facts: await request('POST', '/api/hands/given', { name: name.value, upload: ids[0] }, signal) };
    }
    const texts = scans.map((scan) => scan.text.value).filter((text) => text.trim());
    if (into.value) return task(`/api/hands/${into.value}/pages`, { scans: ids, texts, ink_only: !withScan.checked, ...(dpi.value ? { dpi: Number(dpi.value) } : {}) }, heard, signal);
    return task('/api/hands', { name: name.value, scans: ids, texts, ink_only: !withScan.checked, ...(dpi.value ? { dpi: Number(dpi.value) } : {}) }, heard, signal);
  }

  async function submit(event) {
    event.preventDefault();
    refusal.textContent = ''; result.replaceChildren();
    if (!scans.length) { refusal.textContent = 'Give a scan, a photograph or a .hand file first.'; return; }
    button.disabled = true;
    try {
      const { facts, said = [] } = await run(read);
      const figures = facts.glyphs ? `${facts.glyphs} letters, ${facts.doubtful.length} of them doubtful.` : 'It is among your hands now.';
      const made = into.value || name.value, to = (page, label) => h('a', { class: 'button', href: `#${page}/${encodeURIComponent(made)}` }, label);
      const lasting = said.filter((one) => !one.endsWith('…')); // not how far it had come
      result.replaceChildren(h('p', {}, h('strong', {}, made), `: ${figures}`), h('div', { class: 'row' }, to('write', 'Write in it'), to('letters', 'Look at its letters')), ...lasting.map((one) => h('p', { class: 'quiet' }, one)));
      for (const { file } of scans) delete texts[file.name];
      keep();
      scans.length = 0; list.replaceChildren(); name.value = '';
      await redraw();
    } catch (error) {
      refusal.textContent = error.name === 'AbortError' ? 'It was cancelled.' : error.message;
    } finally {
      button.disabled = false;
    }
  }

  const nameField = field('Name', name);
  into.addEventListener('change', () => { button.textContent = into.value ? 'Read the pages' : 'Read the hand'; nameField.hidden = Boolean(into.value); name.required = !into.value; });
  return h('section', { class: 'panel' }, h('h2', {}, 'A new hand'), h('form', { onsubmit: submit, 'aria-label': 'A new hand' },
    drop, list, h('p', { class: 'quiet' }, NEEDS_NO_TEXT), h('div', { class: 'grid' }, own.length ? field('They become', into) : '', nameField, field('Resolution, dpi', dpi)), keeping, refusal, unkept, button, line, result));
}

function sheets(hands) {
  const hand = choice(['', ...hands.map((one) => one.name)], { '': 'a new hand' });
  const pages = h('input', { type: 'number', min: 1, max: 20, placeholder: 'as many as are needed' });
  const page = choice(['A4', 'letter']);
  const refusal = h('p', { class: 'bad', role: 'alert' });
  const button = h('button', {}, 'Make sheets');
  const { line, run } = progress();
  async function submit(event) {
    event.preventDefault();
    refusal.textContent = ''; button.disabled = true;
    const body = { page: page.value, ...(hand.value ? { hand: hand.value } : {}), ...(pages.value ? { pages: Number(pages.value) } : {}) };
    try {
      const done = await run((heard, signal) => task('/api/sheets', body, heard, signal));
      save(await blob(fileOf(done)), 'sheets.pdf');
      say(`Saved sheets.pdf: ${done.facts.pages} pages, about ${Math.round(done.facts.minutes)} minutes of writing.`);
    } catch (error) {
      refusal.textContent = error.name === 'AbortError' ? '' : error.message;
    } finally {
      button.disabled = false;
    }
  }
  return h('section', { class: 'panel' }, h('h2', {}, 'Sheets to write on'), h('form', { onsubmit: submit, 'aria-label': 'Sheets to write on' },
    field('For', hand), h('div', { class: 'grid' }, field('Pages', pages), field('Paper', page)), refusal, h('div', { class: 'row' }, button), line));
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
    const forms = h('button', { type: 'button', class: 'to-forms', onclick: () => document.querySelector('[aria-label="A new hand"] input').focus() }, 'A new hand');
    place.replaceChildren(h('div', { class: 'row between' }, h('h1', {}, 'Hands'), forms), gallery([...hands].sort((a, b) => b.own - a.own), redraw));
  };
  await redraw(false);
  const scanned = shared.choices.hands.filter((hand) => !hand.drawn);
  main.append(h('div', { class: 'hands' }, h('div', { class: 'columns' }, place, h('div', {}, reader(redraw, shared.choices.hands.filter((hand) => hand.own).map((hand) => hand.name), await drafts.kept('texts')), sheets(scanned), lacking(scanned)))));
  return () => document.querySelector('dialog')?.close();
}
