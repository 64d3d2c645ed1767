// The page My own handwriting: sheets are printed, photographed and read; what was found is shown, ten letters are asked about.

import { blob, fileOf, request, task } from './api.js';
import { choice, field, h, picker, s, save, say, steps, tick } from './dom.js';
import * as drafts from './drafts.js';
import { fromPhone } from './from_phone.js';
import { lineIn } from './line.js';

const TAKEN = '.png,.jpg,.jpeg,.tif,.tiff,.pdf,.webp,.bmp,.hand';
const STEPS = ['Print', 'Photograph', 'Look', 'Ten letters', 'Write'];
const QUESTIONS = 10;

const NEEDS_NO_TEXT = 'Sheets that were made here say what is written on them: leave the text empty.';

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

/** A new hand; with `own`, the names of hands that more pages may be added to. */
function reader(made, own, typed, signal) {
  const into = choice(['', ...own], { '': 'a new hand', ...Object.fromEntries(own.map((name) => [name, `more of ${name}`])) });
  const name = h('input', { required: true, pattern: '[\\w\\-]{1,80}', title: 'Letters, digits, - and _', autocomplete: 'off' });
  const dpi = h('input', { type: 'number', min: 50, max: 2400, placeholder: 'as the file says' });
  const [keeping, withScan] = tick('Keep the scan around the writing in the file, so that ink can be painted with it', { checked: true });
  const list = h('div', { class: 'panel-scans' });
  const refusal = h('p', { class: 'bad', role: 'alert' }), unkept = h('p', { class: 'bad', role: 'alert' });
  const button = h('button', { class: 'main' }, 'Read the hand');
  const { line, run } = progress();
  const scans = [], texts = typed.texts || {}; // name of a file → what was typed of it, until it is read
  const drop = picker('Scans or photographs, or a .hand file', 'Drop them here. 300 dpi or more; PNG, JPEG, TIFF, PDF.', { multiple: true, accept: TAKEN }, (files) => files.forEach((file) => add(file)));
  const phone = fromPhone(({ id, name: called, small }) => add({ name: called }, id, small), signal);

  /** A file of this computer's, or a photograph that is with the studio already, by its number there and a small picture. */
  function add(file, id = undefined, small = undefined) {
    const text = h('textarea', { rows: 4, oninput() { texts[file.name] = text.value; keep(); } });
    text.value = texts[file.name] || '';
    const scan = { file, text, id };
    const takeAway = () => { scans.splice(scans.indexOf(scan), 1); box.remove(); if (id) request('DELETE', `/api/uploads/${id}`).catch((error) => { refusal.textContent = error.message; }); };
    const box = h('div', { class: 'scan' },
      h('div', { class: 'row between' }, h('strong', {}, file.name), h('button', { type: 'button', 'aria-label': `Take ${file.name} away`, onclick: takeAway }, 'Take away')), small,
      file.name.endsWith('.hand') ? '' : field('What is written on it, line by line', text));
    if (!name.value && file.name.endsWith('.hand')) name.value = file.name.replace(/\.hand$/, '');
    scans.push(scan);
    list.append(box);
  }

  const keep = () => drafts.keep('texts', { texts }, unkept);

  async function read(heard, signal) {
    const ids = [], gone = (id) => request('DELETE', `/api/uploads/${id}`).catch(() => {});
    try {
      const done = await readFrom(ids, heard, signal);
      scans.forEach(({ id }) => id && gone(id)); // the phone's are there until they are read
      return done;
    } finally {
      ids.filter((sent) => !scans.some(({ id }) => id === sent)).forEach(gone);
    }
  }

  async function readFrom(ids, heard, signal) {
    for (const { file, id } of scans) {
      if (id) { ids.push(id); continue; }
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
    refusal.textContent = '';
    if (!scans.length) { refusal.textContent = 'Give a scan, a photograph or a .hand file first.'; return; }
    button.disabled = true;
    try {
      const { said = [] } = await run(read), name_ = into.value || name.value;
      const lasting = said.filter((one) => !one.endsWith('…')); // not how far it had come
      for (const { file } of scans) delete texts[file.name];
      keep();
      await made(name_, lasting);
    } catch (error) {
      refusal.textContent = error.name === 'AbortError' ? 'It was cancelled.' : error.message;
    } finally {
      button.disabled = false;
    }
  }

  const nameField = field('Name', name);
  into.addEventListener('change', () => { button.textContent = into.value ? 'Read the pages' : 'Read the hand'; nameField.hidden = Boolean(into.value); name.required = !into.value; });
  return h('form', { onsubmit: submit, class: 'step', 'aria-label': 'A new hand' }, h('h1', {}, 'Photograph what you wrote'),
    h('p', { class: 'quiet' }, 'From above, in daylight, all four corners in the picture; or scan it at 300 dpi. Then give the pictures here.'),
    drop, phone, list, h('p', { class: 'quiet' }, NEEDS_NO_TEXT), h('div', { class: 'grid' }, own.length ? field('They become', into) : '', nameField),
    h('details', {}, h('summary', {}, 'More'), h('div', { class: 'grid' }, field('Dots per inch of the scans', dpi)), keeping), refusal, unkept, h('div', { class: 'row' }, button), line);
}

function sheets(hands) {
  const hand = choice(['', ...hands.map((one) => one.name)], { '': 'a new hand', ...Object.fromEntries(hands.map((one) => [one.name, `letters that ${one.name} lacks`])) });
  const pages = h('input', { type: 'number', min: 1, max: 20, placeholder: 'four' });
  const page = choice(['A4', 'letter']);
  const refusal = h('p', { class: 'bad', role: 'alert' });
  const button = h('button', { class: 'main' }, 'Make sheets');
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
  return h('form', { onsubmit: submit, class: 'step', 'aria-label': 'Sheets to write on' }, h('h1', {}, 'Print sheets to write on'),
    h('p', {}, 'Each line of a sheet says what to write below it. Copy it as you always write, with a pen that you like. Four sheets, half an hour, have every letter several times, beside many others; one is enough to try, and more can be added later.'),
    h('div', { class: 'grid' }, field('Sheets', pages), field('Paper', page), hands.length ? field('For', hand) : ''), refusal, h('div', { class: 'row' }, button), line,
    h('p', { class: 'quiet' }, 'Print them at 100 %. You have something written already? Give a picture of it and its text in the next step.'));
}

/** The pages of a hand with what was found drawn on them, and what is doubtful. */
function lookStep(name, said, onward) {
  const place = h('div', { class: 'found-pages', 'aria-live': 'polite' }, h('p', { class: 'quiet' }, 'Drawing what was found …')), { line, run } = progress();
  run((heard, signal) => task(`/api/hands/${name}/check`, {}, heard, signal)).then(async (done) => {
    const { facts } = done, doubtful = facts.doubtful?.length ?? 0;
    const pictures = await Promise.all(facts.files.map(async (_, at) => URL.createObjectURL(await blob(fileOf(done, at)))));
    place.replaceChildren(h('p', {}, `${facts.glyphs} letters were found, ${doubtful} of them doubtful: orange, and red where they are probably wrong.`), ...said.map((one) => h('p', { class: 'quiet' }, one)),
      ...(facts.unclear?.length ? [h('p', { class: 'warned' }, `Strangers may take these for others: ${facts.unclear.map((one) => one.letter ?? one).join(' ')}. The next step asks about them.`)] : []),
      ...pictures.map((src, at) => h('img', { src, alt: `Page ${at + 1} with the letters that were found`, onload: () => URL.revokeObjectURL(src) })));
  }).catch((error) => place.replaceChildren(h('p', { class: 'bad', role: 'alert' }, error.message)));
  return [h('h1', {}, 'This was found'), h('p', { class: 'quiet' }, 'Is every line there? If half of it is missing, photograph the sheet again in better light: from above, all of it, without a shadow.'), line, place,
    h('div', { class: 'row between onward' }, h('a', { class: 'button', href: `#letters/${encodeURIComponent(name)}` }, 'Look letter by letter'), onward('Next: ten letters', 3))];
}

/** Rows of letters that may read badly, each to be kept or not to be written any more. */
function askStep(name, onward) {
  const place = h('div', { class: 'questions', 'aria-live': 'polite' }, h('p', { class: 'quiet' }, 'Writing words in your hand, and reading them as a stranger would: about ten seconds …')), { line, run } = progress();
  const refusal = h('p', { class: 'bad', role: 'alert' });
  run((heard, signal) => task(`/api/hands/${name}/check`, { questions: QUESTIONS }, heard, signal)).then(async (done) => {
    const { questions } = done.facts;
    if (!questions.length) { place.replaceChildren(h('p', {}, 'No letter of this hand reads badly: there is nothing to ask.')); return; }
    const bitmap = await createImageBitmap(await blob(fileOf(done))), high = bitmap.height / questions.length, { width } = bitmap;
    const href = URL.createObjectURL(await blob(fileOf(done)));
    const presses = questions.map((asked, at) => h('button', { type: 'button', 'aria-pressed': 'false', 'aria-label': `Row ${at + 1}, the letter ${asked.letter}: do not write it so`, onclick(event) { const on = event.currentTarget.getAttribute('aria-pressed') !== 'true'; event.currentTarget.setAttribute('aria-pressed', String(on)); event.currentTarget.textContent = on ? 'Not written any more' : 'Do not write it so'; } }, 'Do not write it so'));
    const keep = h('button', {
      type: 'button', class: 'main',
      async onclick() {
        const answers = presses.map((press, at) => (press.getAttribute('aria-pressed') === 'true' ? String(at + 1) : '')).filter(Boolean);
        refusal.textContent = '';
        if (!answers.length) { onward.go(4); return; }
        keep.disabled = true;
        try {
          await run((heard, signal) => task(`/api/hands/${name}/answers`, { task: done.id, answers }, heard, signal));
          say(`${answers.length === 1 ? 'One of these letters is' : `${answers.length} of these letters are`} not written so any more; Undo is on the page Letter by letter.`);
          onward.go(4);
        } catch (error) { refusal.textContent = error.message; keep.disabled = false; }
      },
    }, 'Keep the answers');
    place.replaceChildren(...questions.map((asked, at) => h('div', { class: 'question' },
      s('svg', { viewBox: `0 ${at * high} ${width} ${high}`, role: 'img', 'aria-label': `Row ${at + 1}: the letter ${asked.letter} in words of this hand` }, s('image', { href, width, height: bitmap.height })), presses[at])), keep);
  }).catch((error) => place.replaceChildren(h('p', { class: 'bad', role: 'alert' }, error.message)));
  return [h('h1', {}, 'Do these letters read well?'), h('p', { class: 'quiet' }, 'Each row is a letter of yours: as it stands on your page, then in words that were written with it, an orange mark below it. Press where you would not read it as that letter; leave the others.'), line, place, refusal,
    h('div', { class: 'row between onward' }, h('span', {}), onward('Skip this', 4))];
}

export async function show(main, shared, [asked] = []) {
  const draft = { step: 0, hand: '', ...await drafts.kept('own') }, texts = await drafts.kept('texts');
  const refusal = h('p', { class: 'bad', role: 'alert' }), head = h('div', {}), body = h('section', { class: 'flow-body step' });
  const own = () => shared.choices.hands.filter((hand) => hand.own).map((hand) => hand.name);
  const go = (step) => { Object.assign(draft, { step }); drafts.keep('own', { ...draft }, refusal); draw(); };
  const onward = Object.assign((label, step) => h('button', { type: 'button', class: 'main', onclick: () => go(step) }, label), { go });
  const read = async (name, said) => { await shared.refresh(); Object.assign(draft, { hand: name, said }); go(2); };
  function writeStep() {
    const { line, run } = progress();
    let heard = (/** @type {any} */ _snapshot) => {}, over = (/** @type {any} */ _done = undefined) => {};
    const started = () => new Promise((ready) => { run((hears) => { heard = hears; ready(); return new Promise((ends) => { over = ends; }); }); });
    return [h('h1', {}, 'Write in your hand'), lineIn(draft.hand, 'A line', (snapshot) => heard(snapshot), started, (error) => { over(); refusal.textContent = error?.message || ''; }), line,
      h('div', { class: 'row' }, h('a', { class: 'button', href: `#write/${encodeURIComponent(draft.hand)}` }, 'Write a letter in it'), h('a', { class: 'button', href: '#table' }, 'Letters from a table'), h('a', { class: 'button', href: '#hands' }, 'All hands'))];
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
      () => [sheets(shared.choices.hands.filter((hand) => !hand.drawn)), h('div', { class: 'row between onward' }, h('span', {}), onward('Next: photograph it', 1))],
      () => [reader(read, own(), texts, shown.signal)],
      () => lookStep(draft.hand, draft.said || [], onward), () => askStep(draft.hand, onward), writeStep,
    ][at](), refusal, own().length ? h('div', { class: 'which' }, field('Which hand', picked)) : '');
  }
  main.append(h('div', { class: 'flow' }, head, body));
  history.replaceState(null, '', '#own');
  if (asked) go(Number(asked) || 0); else draw();
  return () => shown.abort();
}
