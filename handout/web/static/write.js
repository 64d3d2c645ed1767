// The page Write: a text on the left, on the right the page that is typed on; all pages when typing rests.

/** @import { Box, Choices, Done, Machines, Show, Snapshot, Word, Written } from './types' */
/** @typedef {HTMLInputElement | HTMLSelectElement | HTMLTextAreaElement} Control */
/** @typedef {{text: HTMLTextAreaElement, kind: HTMLSelectElement, hand: HTMLSelectElement, [name: string]: any}} Controls */
import { request, task, blob, text as fetched, fileOf, stillThere, takeAway, upload } from './api.js';
import * as drafts from './drafts.js';
import { address, button, choice, field, guarded, h, handChoice, machine, noPrinter, picker, printersOf, refusal as refusals, s, save, say, SIZES, tick, titled } from './dom.js';
import { appear, play } from './replay.js';
import { marks, moved } from './marks.js';
import { drawing, picture, progress } from './work.js';

const FIRST = 'Dear Ada,\n\nthank you for the jam: it is nearly finished, and we all hope for more.\n\nYours, Zoë';
const PATIENCE = 700; // ms: what takes longer is not waited for when something is changed, nor begun at every key
const REST = 500; // ms without a key, then all pages are written
const SCREEN_DPI = 150;
const INKS = { '': 'the pen’s own', '#20223a': 'black', '#24408e': 'blue', '#7c1f2b': 'red', '#1f5a3c': 'green' };
const FORMATS = { pdf: 'PDF, to print or send', png: 'PNG, a picture', svg: 'SVG, lines to work on', inkml: 'InkML, movements of a pen', json: 'JSON, for programs', gcode: 'G-code, for a plotter', hpgl: 'HP-GL, for a plotter', ebb: 'EBB, for a plotter' };
const KINDS = { text: 'Plain text', letter: 'With headings, pictures' };
const SHORT = 0.5; // of the height that a page has for writing: what takes less may be centred
const LARGEST = 2; // times as large, where a short text is made to fit its page
const FULL = 0.6; // of the page's room that it takes then
const ALIGNED = { ragged: 'as people write', left: 'at the left', centre: 'in the middle', right: 'at the right' };
const DIE = 'M5 3h14a2 2 0 0 1 2 2v14a2 2 0 0 1-2 2H5a2 2 0 0 1-2-2V5a2 2 0 0 1 2-2Zm0 2v14h14V5Zm3 1.7A1.6 1.6 0 1 1 8 9.9a1.6 1.6 0 0 1 0-3.2Zm8 0a1.6 1.6 0 1 1 0 3.2 1.6 1.6 0 0 1 0-3.2Zm-4 3.7a1.6 1.6 0 1 1 0 3.2 1.6 1.6 0 0 1 0-3.2Zm-4 3.7a1.6 1.6 0 1 1 0 3.2 1.6 1.6 0 0 1 0-3.2Zm8 0a1.6 1.6 0 1 1 0 3.2 1.6 1.6 0 0 1 0-3.2Z';

const sent = /** @type {Map<string, string>} */ (new Map()); // pictures of letters that were sent: name → its number at the server
const PROGRAMS = ['gcode', 'hpgl', 'ebb']; // formats that are for one machine
const NARROW = matchMedia('(max-width: 44rem)');
const random = () => Math.floor(Math.random() * 1e6);
const plural = (/** @type {number} */ count, /** @type {string} */ word) => `${count} ${word}${count === 1 ? '' : 's'}`;
const clock = (/** @type {number} */ seconds) => (seconds < 90 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`);

/** The controls by name, filled with what was chosen last.  @param {Choices} choices @param {any} kept */
function controls(choices, kept) {
  /** @type {Controls} */
  const made = {
    text: h('textarea', { spellcheck: 'true', maxlength: 100000 }),
    kind: choice(Object.keys(KINDS), KINDS),
    hand: handChoice(choices.hands),
    page: choice(choices.pages, SIZES),
    x_height: h('input', { type: 'number', min: 0.8, max: 20, step: 0.1, placeholder: 'as the hand writes' }),
    pen: choice(['', ...choices.pens], { '': 'the hand’s own' }),
    ink: choice([...Object.keys(INKS), 'other'], { ...INKS, other: 'another …' }),
    colour: h('input', { type: 'color', value: '#31457a', 'aria-label': 'Colour of the ink' }),
    paper: choice(choices.papers, { none: 'white' }),
    align: choice(Object.keys(ALIGNED), ALIGNED),
    style: choice(['', ...choices.styles], { '': 'the hand’s own' }),
    variation: h('input', { type: 'range', min: 0, max: 2, step: 0.1, value: 1 }),
    legible: h('input', { type: 'range', min: 0, max: 1, step: 0.25, value: 0 }),
    language: choice(['en', 'bg', 'sr'], { en: 'as everywhere', bg: 'as in Bulgarian', sr: 'as in Serbian' }),
    slips: h('input', { type: 'number', min: 0, max: 100, step: 1, value: 0 }),
    seed: h('input', { type: 'number', min: 0, step: 1, value: random() }),
    device: titled(choices.plotters, { '': 'a common one' }),
    format: h('select', {}, ...choice(['pdf', 'png'], FORMATS).children, h('optgroup', { label: 'For other programs, and plotters' }, ...choice(Object.keys(FORMATS).slice(2), FORMATS).children)),
  };
  const first = /** @type {Record<string, string>} */ ({ text: FIRST, page: 'A6', hand: 'house-joined', format: 'pdf' });
  for (const [name, control] of Object.entries(made)) {
    const value = kept[name] ?? first[name];
    if (value === undefined) continue;
    const before = control.value;
    control.value = value;
    if (control.tagName === 'SELECT' && control.selectedIndex < 0) control.value = before;
  }
  return made;
}

/** What is asked of the server.  @param {Controls} made @param {Record<string, HTMLInputElement>} ticks @returns {any} */
function asked(made, ticks) {
  const body = /** @type {any} */ ({
    text: made.text.value, letter: made.kind.value === 'letter', hand: made.hand.value, page: made.page.value, paper: made.paper.value, align: made.align.value,
    language: made.language.value,
    variation: Number(made.variation.value), slips: Number(made.slips.value) || 0, seed: Number(made.seed.value) || 0,
    fallback: ticks.fallback.checked, fit: ticks.fit.checked,
  });
  if (!made.legible.parentElement?.hidden) body.legible = Number(made.legible.value);
  if (made.x_height.value) body.x_height = `${made.x_height.value}mm`;
  for (const name of ['pen', 'style']) if (made[name].value) body[name] = made[name].value;
  const ink = made.ink.value === 'other' ? made.colour.value : made.ink.value;
  if (ink) body.ink = ink;
  const shown = body.letter ? [...sent].filter(([name]) => body.text.includes(`](${name})`)).map(([, id]) => id) : [];
  if (shown.length) body.pictures = shown;
  return body;
}

/** What was decided for the user, as sentences.  @param {Written} facts @param {string[]} [said] */
function told(facts, said) {
  const ways = new Map();
  for (const { letter, own, from } of facts.borrowed || []) {
    const way = `${own ? 'Put together' : 'Lent'}, ${from}`;
    ways.set(way, [...(ways.get(way) || []), letter]);
  }
  const lent = [...ways].map(([way, letters]) => `${way}: ${[...new Set(letters)].join(' ')}`);
  const doubts = (facts.doubtful || []).map((one) => `“${one.word}” on line ${one.line}${facts.pages > 1 ? `, page ${one.page},` : ''} may read as “${one.reads_as || 'nothing'}”`);
  return [...doubts, ...lent, ...(said || []), ...(facts.notes || [])].filter((one, at, all) => all.indexOf(one) === at);
}

/** [name, place] of words: by a name, which counts those that are alike, a word of a letter is found when it was changed.  @param {Word[]} words @returns {[string, number][]} */
function named(words) {
  const alike = /** @type {Map<string, number>} */ (new Map());
  return words.map(({ word, at }) => {
    alike.set(word, (alike.get(word) || 0) + 1);
    return [`${alike.get(word)} ${word}`, at];
  });
}

/** The upper and lower end of some words on their page, mm.  @param {Word[]} words */
const around = (words) => { const boxes = words.flatMap((word) => (word.box ? [word.box] : [])); return [Math.min(...boxes.map((box) => box[1])), Math.max(...boxes.map((box) => box[3]))]; };

/** A name for a file, after the first words of its text.  @param {string} text */
function called(text) {
  const words = text.trim().split(/\s+/).slice(0, 3).join('-');
  return words.replace(/[^\p{L}\p{N}-]/gu, '').toLowerCase() || 'page';
}

/** @type {Show} */
export async function show(main, shared, [hand]) {
  const kept = { ...await drafts.kept('draft'), ...(hand ? { hand, rewritten: [] } : {}) };
  for (const [name, id] of kept.pictures || []) if (kept.text.includes(`](${name})`)) sent.set(name, id); else takeAway(id);
  if (hand) address(main, '#write'); // once: another hand that is chosen here stays when the page is loaded anew
  const made = controls(shared.choices, kept);
  const [fallback, lend] = tick('Lend letters that the hand lacks', { checked: kept.fallback ?? true });
  const [fitting, fit] = tick('Write smaller what does not fit', { checked: kept.fit ?? false });
  const ticks = { fallback: lend, fit };
  const spread = h('output', {}, made.variation.value);
  const die = button([s('svg', { viewBox: '0 0 24 24', 'aria-hidden': 'true' }, s('path', { d: DIE })), 'Write it another way'], () => { made.seed.value = String(random()); rewritten.clear(); soon(); });
  const refusal = refusals(), unkept = refusals();
  const pictures = picker('A picture for the letter', 'Drop it here: PNG, JPEG or WebP.', { accept: '.png,.jpg,.jpeg,.webp' }, pictureSent);
  const form = h(
    'form', { 'aria-label': 'What is written' },
    h('div', { class: 'row between' }, h('label', { for: 'text' }, 'Text'), made.kind), made.text, pictures, refusal, unkept,
    h('details', { class: 'looks', open: kept.looks ?? !NARROW.matches }, h('summary', {}, 'How it looks'),
      h('div', { class: 'grid' },
        field('Handwriting', made.hand, true),
        field('Size', made.page), field('Paper', made.paper),
        field('Pen', made.pen), h('div', {}, h('label', { for: 'ink' }, 'Ink'), h('div', { class: 'joined' }, made.ink, made.colour)),
        field('Letter height, mm', made.x_height), field('Alignment', made.align), h('div', { class: 'all' }, die)),
      h('details', { class: 'more', open: Boolean(kept.more) }, h('summary', {}, 'More'),
        h('div', { class: 'grid' }, h('div', { class: 'all' }, h('label', { for: 'variation' }, 'How much letters vary: ', spread), made.variation), field('Style', made.style),
          field('Easier to read than the author writes', made.legible), field('Cyrillic letters', made.language), field('Words struck out, in 100', made.slips), field('Number of the version', made.seed), h('div', { class: 'all' }, fallback), h('div', { class: 'all' }, fitting)))),
  );
  made.text.id = 'text'; made.kind.setAttribute('aria-label', 'Kind of text'); made.ink.id = 'ink'; made.variation.id = 'variation'; made.x_height.title = 'Of small letters, such as x';

  const back = button('‹', () => turned(-1), false, { class: 'icon', 'aria-label': 'Page before' }), on = button('›', () => turned(1), false, { class: 'icon', 'aria-label': 'Next page' });
  const place = h('span', { class: 'quiet pages' }), pager = h('span', { class: 'joined' }, back, place, on);
  const replay = button('Watch it written', watched);
  const pace = choice(['1', '2', '5', '20'], { 1: 'true speed', 2: '2 ×', 5: '5 ×', 20: '20 ×' });
  pace.setAttribute('aria-label', 'Speed');
  const [wayLabel, way] = tick('Pen’s path'), watching = h('span', { class: 'joined', hidden: true }, pace, wayLabel); // while it is watched
  const make = button('Make …', making, true, { class: 'main make' });
  const { line: work, heard } = progress(() => coming?.abort());
  const sheet = h('figure', { class: 'sheet', 'aria-label': 'The page' });
  const toggle = (/** @type {string} */ label, /** @type {string} */ name) => button(label, () => { mode = mode === name ? '' : name; overlaid(true); }, false, { 'aria-pressed': 'false' });
  const modes = { words: toggle('Rewrite a word', 'words'), block: toggle('Move the text', 'block') };
  const paper = h('div', { class: 'paper', tabindex: 0, 'aria-label': 'The page, to scroll' }, sheet);
  const spoken = h('p', { class: 'hidden', 'aria-live': 'polite' });
  const notes = h('div', { class: 'told', 'aria-live': 'polite' });
  main.append(h('div', { class: 'write' }, h('h1', { class: 'hidden' }, 'Write'), form, h(
    'section', { class: 'desk', 'aria-label': 'The page' },
    h('div', { class: 'bar' },
      h('div', { class: 'tools' }, pager, replay, watching, modes.words, modes.block), make),
    paper, work, notes, spoken,
  )));

  let mode = '', chosen = -1, rewritten = /** @type {Map<number, number>} */ (new Map(kept.rewritten || [])), margin = /** @type {number[] | null} */ (kept.margin || null), text = made.text.value;
  let laid = /** @type {[string, string, number[] | null] | null} */ (null); // how a short text lay before it was centred
  let held = /** @type {Map<string, number> | null} */ (null); // of a letter that was changed, the words that are written again, until it is known where they went
  let stale = false; // whether something was changed since what is shown was asked for
  let page = 0, pages = 1, at = /** @type {number | null} */ (0); // the page that is looked at, how many are known, and a place in the text that is on it
  let took = 0, last = /** @type {Done} */ (/** @type {any} */ (null)), lines = /** @type {Done | null} */ (null), coming = /** @type {AbortController | null} */ (null), waiting = 0, stopped = /** @type {(() => void) | null} */ (null);
  let resting = false, next = false; // whether what comes is all pages; whether another is to be written behind it

  const quick = () => shared.choices.hands.find((hand) => hand.name === made.hand.value)?.drawn;
  const inked = () => !quick() || made.pen.value || made.paper.value !== 'none' || asked(made, ticks).pictures;

  const folded = (/** @type {string} */ which) => /** @type {HTMLDetailsElement} */ (form.querySelector(which)).open;
  function keep() {
    const values = Object.fromEntries(Object.entries(made).map(([name, control]) => [name, control.value]));
    drafts.keep('draft', { ...values, fallback: lend.checked, fit: fit.checked, more: folded('.more'), looks: folded('.looks'), rewritten: [...rewritten], margin, pictures: [...sent] }, unkept);
    pictures.hidden = made.kind.value !== 'letter';
    made.colour.hidden = made.ink.value !== 'other';
    made.legible.parentElement.hidden = Boolean(quick()); // drawn hands are as legible as they were drawn
    made.language.parentElement.hidden = !/\p{Script=Cyrillic}/u.test(made.text.value);
    spread.textContent = made.variation.value === '1' ? 'as people vary' : made.variation.value === '0' ? 'none' : made.variation.value;
  }

  function size(/** @type {number} */ width, /** @type {number} */ height) {
    sheet.dataset.wide = String(width); sheet.dataset.high = String(height);
    fitted();
  }

  function fitted() {
    const [wide, high] = [Number(sheet.dataset.wide), Number(sheet.dataset.high)];
    if (!wide) return;
    const room = paper.getBoundingClientRect();
    const most = Math.max(Math.min((room.width - 40) / wide, (room.height - 40) / high, 8), 260 / wide);
    sheet.style.width = `${wide * most}px`; sheet.style.height = `${high * most}px`;
  }

  /** A place in the text, of one that a word has; of a letter file nobody knows, since its words stand between signs: null. */
  const placeOf = (/** @type {number | null} */ of) => (made.kind.value === 'letter' ? null : of);

  /** What is asked, with what was done to the page itself. */
  const asking = () => ({
    ...asked(made, ticks),
    ...(margin ? { margin: margin.map((side) => `${side}mm`).join(',') } : {}),
    ...(rewritten.size && !held ? { rewritten: [...rewritten] } : {}),
  });

  /** Words that are written again in a letter, found by name in what came of it; whether it is to be written with them.  @param {Word[]} words */
  function found(words) {
    if (!held) return false;
    rewritten = new Map(named(words).flatMap(([name, at]) => { const times = held?.get(name); return times ? [/** @type {[number, number]} */ ([at, times])] : []; }));
    held = null;
    keep();
    return rewritten.size > 0;
  }

  /** The file of the page that is looked at; where one page was written alone, there is but one. */
  const shownFile = (/** @type {Done} */ done) => fileOf(done, done.facts.page ? 0 : Math.min(page, done.facts.files.length - 1));

  async function lined(/** @type {Done} */ done, signal = /** @type {AbortSignal | undefined} */ (undefined)) {
    const svg = drawing(await fetched(shownFile(done), signal), made.text.value);
    svg.querySelector('#travel')?.removeAttribute('display');
    svg.querySelector('#travel')?.toggleAttribute('hidden', !way.checked);
    return svg;
  }

  async function pictured(/** @type {Done} */ done, signal = /** @type {AbortSignal | undefined} */ (undefined)) {
    const image = picture(await blob(shownFile(done), '', 'GET', undefined, signal), made.text.value);
    await image.decode();
    return image;
  }

  function placed(/** @type {SVGSVGElement | HTMLImageElement} */ element, /** @type {Done} */ done) {
    const { facts } = done;
    page = facts.page ? facts.page - 1 : Math.min(page, facts.pages - 1);
    pages = facts.page ? Math.max(pages, facts.page) : facts.pages;
    if (element instanceof SVGSVGElement) size(element.viewBox.baseVal.width, element.viewBox.baseVal.height);
    else size((element.naturalWidth / SCREEN_DPI) * 25.4, (element.naturalHeight / SCREEN_DPI) * 25.4);
    const focused = Boolean(sheet.querySelector('.marks')?.contains(document.activeElement));
    if (element instanceof SVGSVGElement) appear(element, sheet.querySelector('svg:not(.marks)'));
    sheet.replaceChildren(element);
    sheet.dataset.version = String(facts.seed);
    last = done;
    overlaid(focused);
    place.textContent = pages > 1 ? `page ${page + 1} of ${pages}` : 'one page';
    pager.hidden = pages === 1; back.disabled = page === 0; on.disabled = page >= pages - 1;
    const sentences = told(facts, done.said);
    if (rewritten.size) sentences.push(`Written again: ${(facts.words || []).filter((word) => rewritten.has(word.at)).map((word) => `“${word.word}”`).join(', ')}. All other words are kept.`);
    const figures = facts.page ? [] : [plural(facts.lines, 'line'), facts.strokes ? `${clock(facts.duration_s)} by hand` : ''];
    const known = facts.page ? notes.querySelector('p') : h('p', { class: 'quiet' }, figures.filter(Boolean).join(' · '));
    notes.replaceChildren(known || '', offer(), sentences.length ? h('ul', {}, sentences.map((one) => h('li', {}, one))) : '');
  }

  /** A button that centres a short text and writes it larger, or has it as it was; nothing where it is not short. */
  function offer() {
    const { page: alone, pages: many, words = [], x_height: now } = last.facts, [wide, high] = [Number(sheet.dataset.wide), Number(sheet.dataset.high)], edge = Math.min(wide, high) / 10;
    const [top, low] = around(words);
    const lay = (/** @type {string} */ height, /** @type {string} */ align, /** @type {number[] | null} */ sides) => { made.x_height.value = height; made.align.value = align; margin = sides; keep(); return drawn(); };
    const before = laid;
    if (before) return button('As it was before', () => { laid = null; lay(...before); });
    if (alone || many > 1 || !now || margin || made.x_height.value || made.kind.value !== 'text' || !(low - top < SHORT * (high - 2 * edge))) return '';
    return button('A short text: centre it, and write it larger', async () => {
      const own = /** @type {[string, string, null]} */ (['', made.align.value, null]);
      // lines are broken anew: they take as much more room as letters are larger, in both ways
      const longest = Math.max(...words.map(({ box }) => (box ? box[2] - box[0] : 0))), by = Math.min(LARGEST, Math.sqrt((FULL * (high - 2 * edge)) / (low - top)), (0.9 * (wide - 2 * edge)) / longest);
      laid = own;
      await lay((now * Math.max(by, 1)).toFixed(1), 'centre', null);
      if (stale) return;
      const [above, below] = around(last.facts.words || []);
      await lay(made.x_height.value, 'centre', [Math.round(2 * (edge + Math.max(0, (high - above - below) / 2))) / 2, edge, edge, edge]);
    });
  }

  /** The marks over the page; `taken`: the keyboard goes there. */
  function overlaid(taken = false) {
    for (const [name, button] of Object.entries(modes)) button.setAttribute('aria-pressed', String(mode === name));
    sheet.querySelector('.marks')?.remove();
    if (!last) return;
    const [wide, high] = [Number(sheet.dataset.wide), Number(sheet.dataset.high)], edge = Math.min(wide, high) / 10;
    /** @template {{page: number, box: Box | null}} One @param {One[]} [all] */
    const here = (all) => /** @type {(One & {box: Box})[]} */ ((all || []).filter((one) => one.page === page + 1 && one.box));
    const write = (/** @type {number} */ word, /** @type {number} */ times) => { if (times > 0) rewritten.set(word, times); else rewritten.delete(word); at = placeOf(word); soon(); };
    sheet.append(marks({
      wide, high, mode, chosen, words: here(last.facts.words), doubts: here(last.facts.doubtful), margin: margin || [edge, edge, edge, edge],
      choose: (word) => { chosen = word.at; spoken.textContent = word.word; },
      again: (word) => { chosen = word.at; write(word.at, Math.min((rewritten.get(word.at) || 0) + 1, 100)); },
      back: (word) => { chosen = word.at; write(word.at, (rewritten.get(word.at) || 0) - 1); },
      began: () => { coming?.abort(); clearTimeout(waiting); },
      margins: (sides) => { margin = sides; soon(); },
    }));
    if (mode && taken) /** @type {SVGElement | null} */ (sheet.querySelector('.marks'))?.focus();
  }

  /** Write the page that is looked at; without `alone` all pages, of which it is shown. What changes meanwhile is written next. */
  async function drawn(alone = false) {
    coming?.abort();
    stopped?.();
    clearTimeout(waiting);
    stale = next = false;
    resting = !alone;
    const own = coming = new AbortController(), begun = performance.now();
    if (!made.text.value.trim()) {
      refusal.textContent = 'Nothing to write yet.';
      coming = null; stale = true;
      return;
    }
    const body = { ...asking(), ...(alone && at !== null && !held ? { at } : {}) };
    let refused = false;
    try {
      if (quick()) {
        const got = last = lines = /** @type {Done} */ (await (alone ? request('POST', '/api/write', { ...body, format: 'svg' }, own.signal) : task('/api/write', { ...body, format: 'svg' }, () => {}, own.signal)));
        if (found(got.facts.words || [])) { await drawn(); return; }
        placed(await lined(got, own.signal), got);
      } else lines = null;
      refusal.textContent = '';
      if (inked()) {
        const done = await task('/api/write', { ...body, format: 'png', dpi: SCREEN_DPI }, alone ? heard : () => {}, own.signal);
        if (found(done.facts.words || [])) { await drawn(); return; }
        last = lines ? { ...done, facts: { ...done.facts, strokes: lines.facts.strokes, duration_s: lines.facts.duration_s } } : done;
        placed(await pictured(done, own.signal), last);
      }
      if (alone) took = performance.now() - begun;
    } catch (/** @type {any} */ error) {
      if (coming === own) stale = refused = true; // what is shown is still what was asked for before
      if (error.name === 'AbortError') return;
      refusal.textContent = error.message;
    } finally {
      if (coming === own) {
        work.hidden = true; coming = null; sheet.dataset.shown = String(performance.now());
        if (next) drawn(true);
        else if (!refused && last?.facts.page) waiting = setTimeout(drawn, REST);
      }
    }
  }

  /** Something was changed: its page is written at once, or when the one before is shown; if pages take long, after a pause. */
  function soon() {
    keep();
    stale = true;
    next = coming !== null && !resting && took < PATIENCE;
    if (next) return;
    coming?.abort();
    clearTimeout(waiting);
    waiting = setTimeout(drawn, took < PATIENCE ? 0 : PATIENCE / 2, true);
  }

  /** Look at another page, of all that were written. */
  async function turned(/** @type {number} */ by) {
    if (stale || coming || last?.facts.page) await drawn();
    if (stale || !last) return;
    page += by;
    at = placeOf((last.facts.words || []).find((word) => word.page === page + 1)?.at ?? at);
    try {
      placed(await (lines && !inked() ? lined(last) : pictured(last)), last);
    } catch { drawn(); } // its files are not kept for ever
  }

  async function watched() {
    if (stopped) { stopped(); return; }
    replay.disabled = true;
    try {
      clearTimeout(waiting);
      if (stale || coming || last?.facts.page) await drawn(); // else what comes would take the place of what is played
      if (stale) return;
      if (!lines) {
        coming?.abort();
        const own = coming = new AbortController();
        lines = await task('/api/write', { ...asking(), format: 'svg' }, heard, own.signal).finally(() => { coming = null; });
      }
      const svg = await lined(lines);
      const before = [...sheet.children];
      sheet.replaceChildren(svg);
      replay.textContent = 'Stop'; watching.hidden = false;
      stopped = play(svg, () => Number(pace.value), () => {
        stopped = null;
        replay.textContent = 'Watch it written'; watching.hidden = true;
        if (!(before[0] instanceof SVGElement)) setTimeout(() => { if (sheet.contains(svg) && !stopped) sheet.replaceChildren(...before); }, 800);
      });
    } catch (/** @type {any} */ error) {
      if (error.name !== 'AbortError') say(error.message);
    } finally {
      replay.disabled = false; work.hidden = true;
    }
  }

  async function downloaded() {
    const format = made.format.value, body = /** @type {any} */ ({ ...asking(), format });
    if (PROGRAMS.includes(format) && made.device.value) body.device = made.device.value;
    const own = coming = new AbortController();
    const done = await task('/api/write', body, heard, own.signal).finally(() => { work.hidden = true; coming = null; });
    for (const [number, name] of done.facts.files.entries()) save(await blob(fileOf(done, number)), name.replace(/^page/, called(body.text)));
    say(`Saved ${plural(done.facts.files.length, 'file')}. ${(done.facts.notes || []).join(' ')}`);
  }

  /** A picture goes to the server, and its name into the letter, where the cursor stands. */
  async function pictureSent(/** @type {File[]} */ [chosen]) {
    refusal.textContent = '';
    try {
      const [, stem, suffix] = /** @type {RegExpMatchArray} */ (chosen.name.match(/^(.*?)(\.[^.]*)?$/s));
      const name = `${stem.replace(/[^A-Za-z0-9]+/g, '-').replace(/^-|-$/g, '').slice(-50) || `picture-${sent.size + 1}`}${suffix || ''}`;
      sent.set(name, await upload(new File([chosen], name)));
      if (!made.text.value.includes(`](${name})`)) made.text.setRangeText(`\n\n![](${name})\n\n`, made.text.selectionEnd, made.text.selectionEnd, 'end');
      made.text.dispatchEvent(new Event('input', { bubbles: true }));
    } catch (/** @type {any} */ error) {
      refusal.textContent = error.message;
    }
  }

  /** The window that asks what is to be made of the page: a file, print or plot. */
  function making() {
    const wrong = refusals();
    const part = (/** @type {string} */ title, /** @type {string} */ about, /** @type {Node[]} */ fields, /** @type {string} */ label, /** @type {() => Promise<string | void>} */ work_, main_ = false) => {
      const go = h('button', { class: main_ ? 'main' : undefined }, label);
      const submit = guarded(wrong, async () => {
        const to = await work_();
        dialog.close();
        if (to) location.hash = to;
      });
      return h('form', {
        class: 'panel-form', 'aria-label': title,
        async onsubmit(/** @type {Event} */ event) { event.preventDefault(); go.disabled = true; await submit(); go.disabled = false; },
      }, h('h3', {}, title), h('p', { class: 'quiet' }, about), fields, h('div', { class: 'row' }, go));
    };
    const before = machine();
    const device = titled(shared.choices.plotters), copies = h('input', { type: 'number', min: 1, max: 100, value: 1 });
    if (shared.choices.plotters.some(({ name }) => name === before.device)) device.value = before.device;
    const printer = h('select', { required: true }, h('option', { value: '' }, 'Looking for printers …'));
    const [inksLabel, inks] = tick('A pen for each ink'); // a letter file may have several
    drafts.remember('make', { copies, inks });
    inksLabel.hidden = made.kind.value !== 'letter';
    const program = field('For the plotter', made.device), shown = () => { program.hidden = !PROGRAMS.includes(made.format.value); };
    made.format.addEventListener('input', shown);
    shown();
    const dialog = h('dialog', { 'aria-label': 'Make' },
      h('div', { class: 'row between' }, h('h2', {}, 'What is to be made of it?'), button('Close', () => dialog.close())), wrong,
      h('div', { class: 'ways' },
        part('A file', 'To send, to print elsewhere, or to work on.', [field('Format', made.format), program], 'Download', downloaded, true),
        part('On paper, by a printer', 'You see a proof before anything is printed.', [field('Printer', printer)], 'Prepare the print', async () => {
          const title = made.text.value.trim().split(/\s+/).slice(0, 6).join(' ');
          return `table/${(await request('POST', '/api/batches', { ...asking(), title, to: 'printer', printer: printer.value })).batch}`;
        }),
        part('With a pen, by a plotter', 'You see how it lies on the machine before it moves.', [field('Machine', device), field('Copies', copies), inksLabel], 'Prepare the plot', async () => (
          `jobs/${(await request('POST', '/api/plots', { ...asking(), device: device.value, copies: Number(copies.value) || 1, ...(inks.checked ? { layers: 'colour' } : {}) })).facts.job}`
        ))));
    dialog.addEventListener('close', () => { dialog.remove(); keep(); });
    document.body.append(dialog);
    dialog.showModal();
    request('GET', '/api/machines').then((/** @type {Machines} */ machines) => { printer.replaceChildren(...titled(printersOf(machines)).children); printer.selectedIndex = 0; printer.after(noPrinter(machines)); }).catch((error) => { wrong.textContent = error.message; });
  }

  form.addEventListener('submit', (event) => event.preventDefault());
  form.addEventListener('input', (event) => {
    if (event.target === made.text) {
      if (made.kind.value === 'letter') {
        if (rewritten.size && last) held ||= new Map(named(last.facts.words || []).flatMap(([name, at]) => { const times = rewritten.get(at); return times ? [[name, times]] : []; }));
      } else rewritten = moved(rewritten, text, made.text.value);
      text = made.text.value;
      at = [...text.slice(0, made.text.selectionEnd)].length;
    } else if (event.target !== made.variation) at = page = 0;
    if (event.target === made.page) margin = null;
    if (event.target !== made.text) laid = null;
    if ([made.hand, made.seed, made.kind].includes(event.target)) { rewritten.clear(); held = null; }
    soon();
  });
  for (const part of form.querySelectorAll('details')) part.addEventListener('toggle', keep);
  way.addEventListener('change', () => sheet.querySelector('#travel')?.toggleAttribute('hidden', !way.checked));
  const watch = new ResizeObserver(fitted);
  watch.observe(paper);
  keep();
  if (sent.size) {
    const there = await stillThere().catch(() => null), lost = [...sent].filter(([, id]) => there && !there.has(id)).map(([name]) => name);
    for (const name of lost) sent.delete(name);
    if (lost.length) refusal.textContent = `Not here any more, give it again: ${lost.join(', ')}.`;
  }
  drawn(true);
  return () => { coming?.abort(); stopped?.(); clearTimeout(waiting); watch.disconnect(); };
}
