// The page My own handwriting: sheets are printed, photographed and read; what was found is shown, ten letters are asked about.

/** @import { Hand, Heard, Show } from './types' */
/** @typedef {{id: string, name: string, text: HTMLTextAreaElement}} Scan */
/** @typedef {((label: string, step: number, main?: boolean) => HTMLButtonElement) & {go: (step: number) => void}} Onward */
import { blob, fileOf, heardOut, request, stillThere, takeAway, task, upload } from './api.js';
import { address, button, choice, field, guarded, h, more, picker, refusal, s, save, say, steps, tick } from './dom.js';
import * as drafts from './drafts.js';
import { fromPhone } from './from_phone.js';
import { lineIn, picture, progress } from './work.js';

const TAKEN = '.png,.jpg,.jpeg,.tif,.tiff,.pdf,.webp,.bmp,.hand';
const STEPS = ['Print', 'Photograph', 'Look', 'Ten letters', 'Write'];
const QUESTIONS = 10;

/** A new hand; with `own`, the names of hands that more pages may be added to.  @param {(name: string, said: string[]) => any} made @param {string[]} own @param {{texts?: Record<string, string>, scans?: {id: string, name: string}[], reading?: string}} typed @param {AbortSignal} signal */
function reader(made, own, typed, signal) {
  const into = choice(['', ...own], { '': 'a new handwriting', ...Object.fromEntries(own.map((name) => [name, `more of ${name}`])) });
  const free = ['my-hand', ...own.map((_, at) => `my-hand-${at + 2}`)].find((one) => !own.includes(one));
  const name = h('input', { required: true, pattern: '[\\w\\-]{1,80}', title: 'Letters, digits, - and _', autocomplete: 'off', value: free });
  const dpi = h('input', { type: 'number', min: 50, max: 2400, placeholder: 'as the file says' });
  const [keeping, withScan] = tick('Keep the scan around the writing in the file, so that ink can be painted with it', { checked: true });
  const list = h('div', { class: 'panel-scans' });
  const wrong = refusal(), unkept = refusal();
  const go = h('button', { class: 'main' }, 'Read my handwriting');
  const { line, run } = progress();
  const scans = /** @type {Scan[]} */ ([]), texts = typed.texts || {}; // name of a file → what was typed of it, until it is read
  const drop = picker('Photographs or scans', 'Drop them here: JPEG, PNG, TIFF or PDF, scans at 300 dots per inch; or a handwriting that you saved from here.', { multiple: true, accept: TAKEN }, async (files) => {
    wrong.textContent = '';
    for (const file of files) await run(async (heard, own_) => { heard({ share: 0, stage: `sending ${file.name}` }); add({ id: await upload(file, own_), name: file.name }); }).catch((error) => { wrong.textContent = error.message; });
  });
  const phone = fromPhone(({ small, ...one }) => { if (!scans.some(({ id }) => id === one.id)) add(one, small); }, signal);

  /** A file that is with the studio, and of a photograph a small picture.  @param {{id: string, name: string}} one @param {Node} [small] */
  function add(one, small) {
    const text = h('textarea', { rows: 4, oninput() { texts[one.name] = text.value; keep(); } });
    text.value = texts[one.name] || '';
    const scan = { ...one, text };
    const drop_ = () => { scans.splice(scans.indexOf(scan), 1); box.remove(); takeAway(one.id); keep(); };
    const box = h('div', { class: 'scan' },
      h('div', { class: 'row between' }, h('strong', {}, one.name), button('Take away', drop_, false, { 'aria-label': `Take ${one.name} away` })), small,
      one.name.endsWith('.hand') ? '' : h('details', { open: Boolean(text.value) }, h('summary', {}, 'Not one of our sheets?'), field('What is written on it, line by line', text)));
    if (one.name.endsWith('.hand')) name.value = one.name.replace(/\.hand$/, '');
    scans.push(scan);
    list.append(box);
    keep();
  }
  if (typed.scans?.length) {
    const before = typed.scans;
    stillThere().then((there) => {
      for (const one of before) if (there.has(one.id) && !scans.some(({ id }) => id === one.id)) add(one);
      const lost = before.filter(({ id }) => !there.has(id)).map((one) => one.name);
      if (lost.length) wrong.textContent = `Not here any more, give it again: ${lost.join(', ')}.`;
    }).catch(() => {});
  }

  const keep = (more_ = {}) => { Object.assign(typed, { scans: scans.map(({ id, name: called }) => ({ id, name: called })), ...more_ }); drafts.keep('texts', { ...typed, texts }, unkept); };

  /** @param {Heard} heard @param {AbortSignal} signal @returns {Promise<{facts: any, said?: string[]}>} */
  async function read(heard, signal) {
    const ids = scans.map(({ id }) => id);
    if (scans.length === 1 && scans[0].name.endsWith('.hand')) {
      return { facts: await request('POST', '/api/hands/given', { name: name.value, upload: ids[0] }, signal) };
    }
    const body = { scans: ids, texts: scans.map((scan) => scan.text.value).filter((text) => text.trim()), ink_only: !withScan.checked, ...(dpi.value ? { dpi: Number(dpi.value) } : {}) };
    const begun = into.value ? await task(`/api/hands/${into.value}/pages`, body, null) : await task('/api/hands', { name: name.value, ...body }, null);
    keep({ reading: begun.id }); // it goes on without this page
    return heardOut(begun, heard, signal);
  }

  async function submit(/** @type {Event} */ event) {
    event.preventDefault();
    wrong.textContent = '';
    if (scans.length) await finished(read); else wrong.textContent = 'Give a photograph or a scan first.';
  }
  /** @param {(heard: Heard, signal: AbortSignal) => Promise<{facts: any, said?: string[]}>} work */
  async function finished(work) {
    go.disabled = true;
    try {
      const { said = [] } = await run(work), name_ = into.value || name.value;
      const lasting = said.filter((one) => !one.endsWith('…')); // not how far it had come
      drafts.forget('reader');
      for (const { id, name: called } of scans.splice(0)) { takeAway(id); delete texts[called]; }
      keep({ reading: undefined });
      await made(name_, lasting);
    } catch (/** @type {any} */ error) {
      keep({ reading: undefined });
      const [, unknown] = /^(.+): what is written on it\?/.exec(error.message) || [];
      if (unknown) for (const one of list.querySelectorAll('details')) one.open = true;
      wrong.textContent = unknown ? `${unknown} was not recognised as one of our sheets. If it is one, photograph it again: from above, in even light, all four corners in the picture. If not, type what is written on it.`
        : error.name === 'AbortError' ? 'It was cancelled.' : error.message;
    } finally {
      go.disabled = false;
    }
  }

  drafts.remember('reader', { name, dpi, withScan, into });
  const nameField = field('What shall it be called?', name);
  const chosen = () => { go.textContent = into.value ? 'Read the pages' : 'Read my handwriting'; nameField.hidden = Boolean(into.value); name.required = !into.value; };
  into.addEventListener('change', chosen); chosen();
  if (typed.reading) request('GET', `/api/tasks/${typed.reading}`).then((begun) => finished((heard, own_) => heardOut(begun, heard, own_)), () => keep({ reading: undefined }));
  return h('form', { onsubmit: submit, class: 'step', 'aria-label': 'A new handwriting' }, h('h1', {}, 'Photograph what you wrote'),
    h('p', { class: 'quiet' }, 'From above, in daylight, all four corners in the picture; or scan it. Then give the pictures here.'),
    drop, phone, list, h('div', { class: 'grid' }, nameField, own.length ? field('They become', into) : ''),
    more('More', h('div', { class: 'grid' }, field('Dots per inch of the scans, if the file does not say', dpi)), keeping), wrong, unkept, h('div', { class: 'row' }, go), line);
}

function sheets(/** @type {Hand[]} */ hands, /** @type {{printed: boolean, written: () => void}} */ { printed, written }, /** @type {Onward} */ onward) {
  const hand = choice(['', ...hands.map((one) => one.name)], { '': 'all letters', ...Object.fromEntries(hands.map((one) => [one.name, `letters that ${one.name} lacks`])) });
  const pages = choice(['', '1', '2', '8'], { '': 'four: half an hour', 1: 'one, to try', 2: 'two', 8: 'eight, for one that repeats little' });
  const page = choice(['A4', 'letter'], { letter: 'US letter' });
  const wrong = refusal(), next = onward('Next: photograph it', 1, printed), go = h('button', { class: printed ? undefined : 'main' }, printed ? 'Make them once more' : 'Make the sheets');
  const { line, run } = progress();
  if (/^en-(US|CA)/.test(navigator.language)) page.value = 'letter';
  drafts.remember('sheets', { hand, pages, page });
  async function submit(/** @type {Event} */ event) {
    event.preventDefault();
    wrong.textContent = ''; go.disabled = true;
    const body = { page: page.value, ...(hand.value ? { hand: hand.value } : {}), ...(pages.value ? { pages: Number(pages.value) } : {}) };
    try {
      const done = await run((heard, signal) => task('/api/sheets', body, heard, signal));
      save(await blob(fileOf(done)), 'sheets.pdf');
      say(`Saved sheets.pdf: ${done.facts.pages} pages, about ${Math.round(done.facts.minutes)} minutes of writing.`);
      go.className = ''; next.className = 'main'; // one thing at a time: they are printed and written on now
      written();
    } catch (/** @type {any} */ error) {
      wrong.textContent = error.name === 'AbortError' ? '' : error.message;
    } finally {
      go.disabled = false;
    }
  }
  return h('form', { onsubmit: submit, class: 'step', 'aria-label': 'Sheets to write on' }, h('h1', {}, 'Print sheets to write on'),
    h('p', {}, 'Each line of a sheet says what to write below it. Copy it as you always write, with a pen that you like. More sheets can be added later.'),
    h('div', { class: 'grid' }, field('Sheets', pages), field('Paper', page)), hands.length ? more('More', h('div', { class: 'grid' }, field('Ask for', hand))) : '',
    wrong, line, h('div', { class: 'row' }, go, next), h('p', { class: 'quiet' }, 'Print them at 100 %. You have something written already? Go on: give a picture of it, and its text.'));
}

/** The pages of a hand with what was found drawn on them, and what is doubtful.  @param {string} name @param {string[]} said @param {Onward} onward */
function lookStep(name, said, onward) {
  const place = h('div', { class: 'found-pages', 'aria-live': 'polite' }, h('p', { class: 'quiet' }, 'Drawing what was found …'), h('span', { class: 'skeleton' })), { line, run } = progress();
  run((heard, signal) => task(`/api/hands/${name}/check`, {}, heard, signal)).then(async (done) => {
    const { facts } = done, doubtful = facts.doubtful?.length ?? 0;
    const pictures = await Promise.all(/** @type {string[]} */ (facts.files).map(async (_, at) => picture(await blob(fileOf(done, at)), `Page ${at + 1} with the letters that were found`)));
    place.replaceChildren(h('p', {}, `${facts.glyphs} letters were found, ${doubtful} of them doubtful: orange, and red where they are probably wrong.`), ...said.map((one) => h('p', { class: 'quiet' }, one)),
      ...(facts.unclear?.length ? [h('p', { class: 'warned' }, `Strangers may take these for others: ${facts.unclear.map((/** @type {any} */ one) => one.letter ?? one).join(' ')}. The next step asks about them.`)] : []),
      ...pictures);
  }).catch((error) => { const wrong = refusal(); place.replaceChildren(wrong); wrong.textContent = error.message; });
  return [h('h1', {}, 'This was found'), h('p', { class: 'quiet' }, 'Is every line there? If half of it is missing, photograph the sheet again in better light: from above, all of it, without a shadow.'), line, place,
    h('div', { class: 'row between onward' }, h('a', { class: 'button', href: `#letters/${encodeURIComponent(name)}` }, 'Correct letters'), onward('Next: ten letters', 3, true))];
}

/** Rows of letters that may read badly, each to be kept or not to be written any more; what was pressed is kept, with the task that asked.  @param {string} name @param {Onward} onward @param {{asked?: {hand: string, task: string, pressed: number[]}}} draft @param {(values: object) => void} kept */
function askStep(name, onward, draft, kept) {
  const place = h('div', { class: 'questions', 'aria-live': 'polite' }, h('p', { class: 'quiet' }, 'Writing words in your hand, and reading them as a stranger would: about ten seconds …'), h('span', { class: 'skeleton' })), { line, run } = progress();
  const wrong = refusal();
  const before = draft.asked?.hand === name ? draft.asked : null, pressed = new Set(before?.pressed);
  const begin = () => run((heard, signal) => task(`/api/hands/${name}/check`, { questions: QUESTIONS }, heard, signal));
  (before ? request('GET', `/api/tasks/${before.task}`).catch(() => { pressed.clear(); return begin(); }) : begin()).then(async (done) => {
    const keep_ = () => kept({ asked: { hand: name, task: done.id, pressed: [...pressed] } });
    keep_();
    const questions = /** @type {{letter: string}[]} */ (done.facts.questions);
    if (!questions.length) { place.replaceChildren(h('p', {}, 'No letter of yours reads badly: there is nothing to ask.'), onward('Next: write', 4, true)); skip.hidden = true; return; }
    const sheet = await blob(fileOf(done)), bitmap = await createImageBitmap(sheet), high = bitmap.height / questions.length, { width } = bitmap;
    const href = URL.createObjectURL(sheet);
    const told = (/** @type {Element} */ press, /** @type {number} */ at) => { press.setAttribute('aria-pressed', String(pressed.has(at))); press.textContent = pressed.has(at) ? 'Not written any more' : 'Do not write it so'; };
    const presses = questions.map((asked, at) => button('Do not write it so', ({ currentTarget }) => { if (!pressed.delete(at)) pressed.add(at); told(currentTarget, at); keep_(); }, false, { 'aria-label': `Row ${at + 1}, the letter ${asked.letter}: do not write it so` }));
    presses.forEach(told);
    const keep = button('Keep the answers', guarded(wrong, async () => {
      const answers = [...pressed].sort((a, b) => a - b).map((at) => String(at + 1));
      if (!answers.length) { onward.go(4); return; }
      keep.disabled = true;
      try { await run((heard, signal) => task(`/api/hands/${name}/answers`, { task: done.id, answers }, heard, signal)); } finally { keep.disabled = false; }
      kept({ asked: undefined });
      say(`${answers.length === 1 ? 'One of these letters is' : `${answers.length} of these letters are`} not written so any more; Undo is on the page Correct letters.`);
      onward.go(4);
    }), true);
    place.replaceChildren(...questions.map((asked, at) => h('div', { class: 'question' },
      s('svg', { viewBox: `0 ${at * high} ${width} ${high}`, role: 'img', 'aria-label': `Row ${at + 1}: the letter ${asked.letter} in words of this hand` }, s('image', { href, width, height: bitmap.height })), presses[at])), keep);
  }).catch((error) => { place.replaceChildren(); wrong.textContent = error.message; });
  const skip = onward('Skip this', 4);
  return [h('h1', {}, 'Do these letters read well?'), h('p', { class: 'quiet' }, 'Each row is a letter of yours: as it stands on your page, then in words that were written with it, an orange mark below it. Press where you would not read it as that letter; leave the others.'), line, place, wrong, h('div', { class: 'row onward' }, skip)];
}

/** @type {Show} */
export async function show(main, shared, [asked] = []) {
  const draft = { step: 0, hand: '', ...await drafts.kept('own') }, texts = await drafts.kept('texts');
  const wrong = refusal(), head = h('div', {}), body = h('section', { class: 'flow-body step' });
  const own = () => shared.choices.hands.filter((hand) => hand.own).map((hand) => hand.name);
  const keep = (/** @type {object} */ values) => { Object.assign(draft, values); drafts.keep('own', { ...draft }, wrong); };
  const go = (/** @type {number} */ step) => { keep({ step }); draw(); };
  const onward = Object.assign((/** @type {string} */ label, /** @type {number} */ step, main_ = false) => button(label, () => go(step), main_), { go });
  const read = async (/** @type {string} */ name, /** @type {string[]} */ said) => { await shared.refresh(); Object.assign(draft, { hand: name, said }); go(2); };
  function writeStep() {
    const { line, run } = progress();
    return [h('h1', {}, 'Write in your hand'), lineIn(draft.hand, 'A line', run, async () => {}, (error) => { wrong.textContent = error?.message || ''; }, true), line,
      h('div', { class: 'row' }, h('a', { class: 'button', href: `#write/${encodeURIComponent(draft.hand)}` }, 'Write a letter in it'), h('a', { class: 'button', href: '#table' }, 'Letters from a table'), onward('Add more sheets', 0))];
  }
  let shown = new AbortController(); // the step that is shown
  function draw() {
    shown.abort();
    shown = new AbortController();
    const named = own().includes(draft.hand), at = named ? draft.step : Math.min(draft.step, 1);
    head.replaceChildren(steps(STEPS, at, named ? STEPS.length : 2, go));
    const picked = choice(['', ...own()], { '': 'a new one' });
    picked.value = named ? draft.hand : '';
    picked.addEventListener('change', () => { Object.assign(draft, { hand: picked.value, said: [] }); go(picked.value ? Math.max(at, 2) : 0); });
    body.replaceChildren(...[
      () => [sheets(shared.choices.hands.filter((hand) => hand.own), { printed: Boolean(draft.printed), written: () => keep({ printed: true }) }, onward)],
      () => [reader(read, own(), texts, shown.signal)],
      () => lookStep(draft.hand, draft.said || [], onward), () => askStep(draft.hand, onward, draft, keep), writeStep,
    ][at](), wrong, own().length ? h('div', { class: 'which' }, field('Which handwriting', picked)) : '');
  }
  main.append(h('div', { class: 'flow' }, head, body));
  address(main, '#own');
  if (asked) go(Number(asked) || 0); else draw();
  return () => shown.abort();
}
