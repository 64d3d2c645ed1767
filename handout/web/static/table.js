// The page Letters from a table: the table, the letter beside a page of any row, paper, a proof to approve, the making.

/** @import { Batch, Machines, Row, Show, Table } from './types' */
import { blob, fileOf, request, task, text as fetched, takeAway, upload } from './api.js';
import { kept as made } from './kept_table.js';
import { batchState, button, choice, field, grouped, guarded, h, handChoice, machine, more, named, noPrinter, picker, printersOf, refusal, SIZES, steps, tick, titled } from './dom.js';
import * as drafts from './drafts.js';
import { drawing, picture } from './work.js';

const TAKEN = '.csv,.tsv,.txt,.xlsx,.vcf';
const TO = { pdf: 'a PDF file', printer: 'a printer', plotter: 'a plotter, with a pen' };
const STEPS = ['Table', 'Letter', 'Paper', 'Proof', 'Make'];
const GAP = /«([^«»,]+)(?:, else ([^«»"]+))?»/g;
const PAUSE = 100, REST = 500; // ms after the last key until the first page of a row is new, then all of them
const SCREEN_DPI = 110;
/** @type {Record<string, string>} */
const LETTERS = {
  'Thank you': 'Dear {{ first_name }},\n\nthank you so much for {{ gift|default("coming") }}. It was good to see you again.\n\nYours, Marie',
  Invitation: 'Dear {{ first_name }},\n\nwe would love to have you with us on Saturday, at four. There will be cake.\n\nYours, Marie',
  'With an order': 'Hello {{ first_name }},\n\nthank you for your order: each piece is made by hand, and so is this note.\n\nMarie',
};

/** @type {Show} */
export async function show(main, shared, [name]) {
  if (name) return made(main, name, STEPS);
  const draft = { page: 'A6', hand: 'house-joined', to: 'pdf', device: machine().device, letter: '', step: 0, ...await drafts.kept('batch') };
  if (draft.batch) Object.assign(draft, { batch: '', step: 0 }); // its letter was kept: the next begins with its table
  const unkept = refusal(), refused = refusal();
  const head = h('div', {}), body = h('div', { class: 'flow-body' }), gone = new AbortController();
  let known = /** @type {Table} */ (/** @type {any} */ (null)), row = /** @type {number | undefined} */ (undefined), picked = false, machines = /** @type {Machines} */ (/** @type {any} */ (null)), showing = /** @type {AbortController | null} */ (null), waiting = 0;

  const keep = (/** @type {object} */ values) => { Object.assign(draft, values); drafts.keep('batch', { ...draft }, unkept); };
  const act = (/** @type {string} */ label, /** @type {() => any} */ work, main_ = false) => button(label, guarded(refused, work), main_);
  const asked = (others = {}) => ({
    table: draft.upload, text: draft.letter, letter: Boolean(draft.markdown), hand: draft.hand, page: draft.page, fallback: true, to: draft.to,
    once: Boolean(draft.once), with_envelopes: Boolean(draft.envelopes && !known?.no_envelopes),
    ...(draft.to === 'printer' ? { printer: draft.printer || '', queues: (draft.queues || []).filter((/** @type {string} */ queue) => queue !== draft.printer) } : {}),
    ...(draft.to === 'plotter' && draft.device ? { device: draft.device } : {}), ...others,
  });

  /** The table with the letter as it is now. */
  async function look() {
    try {
      known = await request('POST', '/api/batches/tried', asked(), gone.signal);
    } catch (/** @type {any} */ error) {
      if (error.status !== 422 || !error.message.includes('send it again')) throw error;
      known = /** @type {any} */ (null);
      keep({ upload: '', step: 0 });
      throw new Error(`${draft.name || 'The table'} is not here any more: give it once more. Your letter is kept.`);
    }
  }
  const given = guarded(refused, async (/** @type {File[]} */ [file], letter = '') => {
    const sent = await upload(file, gone.signal);
    const before = { ...draft };
    keep({ upload: sent, name: file.name, ...(letter ? { letter, markdown: false } : {}) });
    try {
      await look();
      if (before.upload) takeAway(before.upload);
    } catch (/** @type {any} */ error) {
      keep({ upload: before.upload, name: before.name });
      throw error;
    }
    row = undefined; picked = false;
    draw();
  });
  const sample = guarded(refused, async () => {
    const answer = await fetch('sample.csv');
    await given([new File([await answer.blob()], 'sample.csv', { type: 'text/csv' })], draft.letter.trim() ? '' : LETTERS['Thank you']);
  });
  const go = async (/** @type {number} */ step) => {
    if (step === 3) { await proofed(); return; }
    if (step > 0 && known) await look();
    keep({ step });
    draw();
  };
  /** The batch is kept, and its page makes the proof. */
  async function proofed() {
    const batch = await request('POST', '/api/batches', asked({ title: draft.name }));
    keep({ batch: batch.batch });
    location.hash = `table/${batch.batch}`;
  }

  function rowsTable() {
    const odd = known.rows.filter((one) => one.why.length), alike = grouped(odd, (one) => one.why.join('; '));
    const all = known.count > known.rows.length ? ` of the first ${known.rows.length}; the proof looks at all` : '';
    return h('div', {},
      h('p', {}, h('strong', {}, `${known.count} ${known.count === 1 ? 'row' : 'rows'}`), odd.length ? `, ${odd.length} to look at${all}:` : all ? `, nothing odd in the first ${known.rows.length}; the proof looks at all.` : ', nothing odd found so far.'),
      odd.length ? h('div', { class: 'rows', tabindex: 0, role: 'region', 'aria-label': 'Rows to look at' }, h('table', {}, h('thead', {}, h('tr', {}, ['Row', 'Who', 'Why'].map((label) => h('th', { scope: 'col' }, label)))),
        h('tbody', {}, alike.map(([why, some]) => h('tr', {}, h('td', {}, some.length > 1 ? `${some.length} rows` : some[0].row), h('td', {}, some.length > 1 ? named(some) : some[0].called), h('td', {}, why)))))) : '',
      known.notes.map((note) => h('p', { class: 'quiet' }, `${note[0].toUpperCase()}${note.slice(1)}.`)));
  }
  /** @param {(name: string) => void} [press] */
  const chips = (press) => h('div', { class: 'chips', role: 'group', 'aria-label': press ? 'Gaps that the table fills' : 'Columns' },
    known.columns.map((one) => (press ? h('button', { type: 'button', class: 'chip', title: `From the column ${one.header}`, onclick: () => press(one.name) }, plain(one.name)) : h('span', { class: 'chip' }, one.header))));
  const onward = (/** @type {string} */ label, /** @type {number} */ step, back = step - 2) => h('div', { class: 'row between onward' }, back >= 0 ? act('Back', () => go(back)) : h('span', {}), act(label, () => go(step), true));

  function tableStep() {
    const list = h('ul', { class: 'list' }), before = h('section', { hidden: true }, h('h2', {}, 'Kept before'), list);
    request('GET', '/api/batches', undefined, gone.signal).then((/** @type {{batches: Batch[], made: Record<string, string>}} */ { batches, made: now }) => {
      before.hidden = !batches.length;
      list.replaceChildren(...batches.map((one) => h('li', {}, h('a', { class: 'button', href: `#table/${one.batch}` }, h('span', {}, one.title), h('span', { class: 'quiet' }, batchState(one, now))))));
    }).catch(() => {});
    const [onceLabel, once] = tick('Write only one letter to rows that are the same', { checked: Boolean(draft.once), onchange: guarded(refused, async () => { keep({ once: once.checked }); await look(); draw(); }) });
    return [h('h1', {}, 'Who gets a letter?'),
      picker(known ? 'Another table' : 'The table', 'Drop it here: Excel or CSV, one row for each letter, a heading on top of each column; or contacts of a phone (vCard).', { accept: TAKEN }, given),
      known ? '' : h('div', { class: 'row' }, act('Try it with a sample', sample), h('a', { class: 'button', href: 'sample.csv', download: 'sample.csv' }, 'Save the sample table')),
      refused, unkept,
      known ? [h('h2', {}, draft.name), chips(), rowsTable(), more('More', onceLabel), onward('Next: the letter', 1)] : '', before];
  }

  // gaps as they are shown, «first name» or «gift, else coming», and as they are kept: {{ first_name }}, {{ gift|default("coming") }}
  const plain = (/** @type {string} */ name) => name.replaceAll('_', ' ');
  const seen = (/** @type {string} */ letter) => letter.replace(/{{ *(\w+)(?: *\| *default\("([^"»]*)"\))? *}}/g, (gap, name, other) => (known.columns.some((one) => one.name === name) ? `«${plain(name)}${other ? `, else ${other}` : ''}»` : gap));
  const gapped = (/** @type {string} */ text) => text.replace(GAP, (shown, label, other) => {
    const column = known.columns.find((one) => plain(one.name) === label);
    return column ? `{{ ${column.name}${other ? `|default("${other}")` : ''} }}` : shown;
  });
  function letterStep() {
    const letter = h('textarea', { rows: 11, id: 'letter', spellcheck: 'true', placeholder: 'Dear «first name»,\n\n…', maxlength: 100000, oninput: () => { keep({ letter: gapped(letter.value) }); soon(); },
      onkeydown: (/** @type {KeyboardEvent} */ event) => { // a gap goes as one
        const { selectionStart: at, selectionEnd: end, value } = letter, [gap] = [...value.matchAll(GAP)].filter(({ index, 0: all }) => index + all.length === at);
        if (event.key === 'Backspace' && at === end && gap && gapped(gap[0]) !== gap[0]) letter.setSelectionRange(gap.index, at);
      } });
    letter.value = seen(draft.letter);
    const put = (/** @type {string} */ text, all = false) => {
      if (all) letter.value = text; else letter.setRangeText(text, letter.selectionStart, letter.selectionEnd, 'end');
      letter.focus();
      keep({ letter: gapped(letter.value) }); soon();
    };
    const [markdownLabel, markdown] = tick('With headings, lists and a P.S. (Markdown)', { checked: Boolean(draft.markdown), onchange: () => { keep({ markdown: markdown.checked }); soon(); } });
    const names = known.columns.map((one) => one.name), fitting = (/** @type {string} */ text) => [...text.matchAll(/{{ (\w+)/g)].every(([, one]) => names.includes(one));
    return [h('h1', {}, 'What does it say?'), h('p', { class: 'quiet' }, 'Press a column to put it where the cursor stands: each letter has there what stands in its row.'), chips((one) => put(seen(`{{ ${one} }}`))),
      h('label', { for: 'letter' }, 'Letter'), letter,
      h('div', { class: 'row' }, h('span', { class: 'quiet small' }, 'Begin with:'), Object.keys(LETTERS).filter((one) => fitting(LETTERS[one])).map((one) => act(one, () => put(seen(LETTERS[one]), true)))),
      more('More', markdownLabel, h('p', { class: 'quiet' }, 'No letter, but envelopes? Leave the text empty.')), refused, unkept, onward('Next: the paper', 2)];
  }

  function paperStep() {
    const set = (/** @type {string} */ key) => (/** @type {any} */ event) => { keep({ [key]: event.target.type === 'checkbox' ? event.target.checked : event.target.value }); chosen(); soon(); };
    const pick = (/** @type {string} */ key, /** @type {HTMLSelectElement} */ control) => { if (draft[key]) control.value = draft[key]; if (control.selectedIndex < 0) control.selectedIndex = 0; control.addEventListener('change', set(key)); return control; };
    const hand = pick('hand', handChoice(shared.choices.hands)), page = pick('page', choice(shared.choices.pages, SIZES)), to = pick('to', choice(Object.keys(TO), TO));
    const printer = pick('printer', titled(printersOf(machines))), device = pick('device', titled(machines.plotters));
    const [envelopeLabel] = tick('An envelope for each letter', { checked: Boolean(draft.envelopes && !known.no_envelopes), disabled: Boolean(known.no_envelopes), onchange: set('envelopes') });
    const sharing = h('fieldset', {}, h('legend', {}, 'Shared with these printers'), machines.queues.map((queue) => tick(queue, { checked: (draft.queues || []).includes(queue), onchange: (/** @type {any} */ { target }) => keep({ queues: [...(draft.queues || []).filter((/** @type {string} */ one) => one !== queue), ...(target.checked ? [queue] : [])] }) })[0]));
    const printerField = field('Printer', printer), deviceField = field('Plotter', device);
    const chosen = () => {
      printerField.hidden = to.value !== 'printer'; deviceField.hidden = to.value !== 'plotter';
      sharing.hidden = to.value !== 'printer' || machines.queues.length < 2;
      draft.printer = printer.value; draft.device = device.value;
    };
    printer.after(noPrinter(machines));
    chosen();
    return [h('h1', {}, 'On what, and how?'), h('div', { class: 'grid' }, field('Handwriting', hand, true), field('Paper', page), field('Made by', to), printerField, deviceField), sharing, envelopeLabel,
      known.no_envelopes ? h('p', { class: 'quiet small' }, `No envelopes: ${known.no_envelopes}`) : '', refused, unkept, onward('Next: a proof of every letter', 3)];
  }

  /** The page of a row, as the letter is now. */
  const side = h('figure', { class: 'sheet' }), unfilled = refusal(), who = h('span', { class: 'quiet', 'aria-live': 'polite' }), wrong = refusal();
  const asks = h('input', { type: 'number', min: 1, 'aria-label': 'Row', onchange: () => { picked = true; row = known.numbers.find((one) => one >= Number(asks.value)) ?? known.numbers.at(-1); previewed(); } });
  const turn = (/** @type {number} */ by) => {
    picked = true;
    row = known.numbers.at((known.numbers.indexOf(row ?? 0) + by) % known.numbers.length);
    previewed();
  };
  const view = h('section', { class: 'desk', 'aria-label': 'The letter of a row' },
    h('div', { class: 'tools' }, h('span', { class: 'quiet', 'aria-hidden': 'true' }, 'Row'), button('‹', () => turn(-1), false, { class: 'icon', 'aria-label': 'Row before' }), asks, button('›', () => turn(1), false, { class: 'icon', 'aria-label': 'Next row' }), who),
    h('div', { class: 'asks' }, wrong, unfilled), h('div', { class: 'paper', tabindex: 0, 'aria-label': 'The page, to scroll' }, side));
  /** The letter of a row: the first of its pages at once, and when typing rests all, which are counted. */
  async function previewed(all = false) {
    clearTimeout(waiting);
    showing?.abort();
    const [typo] = draft.letter.match(/«\S[^«»]*»/g) || []; // a quotation of French letters has spaces within
    unfilled.textContent = typo ? `${typo} is no column of the table, and would be written as it stands. Its columns are ${known.columns.map((one) => `«${plain(one.name)}»`).join(', ')}.` : '';
    const own = showing = new AbortController();
    row = known.numbers.includes(row ?? 0) ? row : (known.rows.find((one) => !one.why.length) ?? known.rows[0])?.row; // first one that is as it should be
    asks.value = String(row ?? ''); who.textContent = `${known.rows.find((one) => one.row === row)?.called ?? ''}`;
    if (!row || !draft.letter.trim()) { side.replaceChildren(); wrong.textContent = ''; return; }
    try {
      const { tried, trouble } = await request('POST', '/api/batches/tried', asked({ row }), own.signal), { filled, why, called } = tried;
      if (!filled && !trouble && !picked) { // nobody asked for this one: one that has all the letter needs is shown
        await look();
        const good = known.rows.find((one) => one.filled && !one.why.length)?.row ?? row;
        if (good !== row) { row = good; await previewed(); return; }
      }
      who.textContent = called;
      wrong.textContent = [trouble, ...why].filter(Boolean).join('; '); // of what is wrong with a row a page may be shown all the same
      if (!filled || trouble) { side.replaceChildren(); return; }
      const drawn = shared.choices.hands.find((each) => each.name === draft.hand)?.drawn;
      const wanted = { text: filled, letter: Boolean(draft.markdown), hand: draft.hand, page: draft.page, fallback: true, seed: row, ...(all ? {} : { at: 0 }), ...(drawn ? { format: 'svg' } : { format: 'png', dpi: SCREEN_DPI }) };
      side.classList.add('coming');
      if (!side.firstChild) side.append(h('span', { class: 'skeleton' }));
      const done = drawn ? await request('POST', '/api/write', wanted, own.signal) : await task('/api/write', wanted, () => {}, own.signal);
      if (drawn) {
        side.replaceChildren(drawing(await fetched(fileOf(done), own.signal), filled));
      } else side.replaceChildren(picture(await blob(fileOf(done), '', 'GET', undefined, own.signal), filled));
      if (done.facts.page) waiting = setTimeout(previewed, REST, true);
      else if (done.facts.pages > 1) wrong.textContent += `It needs ${done.facts.pages} pages of ${draft.page}; the first is shown.`;
    } catch (/** @type {any} */ error) {
      if (error.name !== 'AbortError') wrong.textContent = error.message;
    } finally {
      if (showing === own) side.classList.remove('coming');
    }
  }
  function soon() {
    clearTimeout(waiting);
    waiting = setTimeout(previewed, PAUSE, false);
  }

  function draw() {
    const at = known ? Math.min(draft.step, 2) : 0;
    head.replaceChildren(steps(STEPS, at, known ? 3 : 0, guarded(refused, go)));
    body.classList.toggle('beside', at > 0);
    body.replaceChildren(h('section', { class: 'step' }, [tableStep, letterStep, paperStep][at]()), ...(at > 0 ? [view] : []));
    if (at > 0) previewed();
  }
  main.append(h('div', { class: 'flow' }, head, body));
  if (draft.upload) await guarded(refused, look)();
  machines = await request('GET', '/api/machines', undefined, gone.signal).catch(() => ({ queues: [], printers: [], plotters: [], ports: [] }));
  draw();
  return () => { gone.abort(); showing?.abort(); clearTimeout(waiting); };
}
