// The page Calibration: chart and strip printed, scans dropped, what was found drawn on them, before and after, history.

/** @import { Show, Snapshot } from './types' */
/** @typedef {{severity: string, sentence: string, where?: string, at: [number, number][]}} Finding */
/** @typedef {{width: number, height: number, faults?: Finding[], unread?: [number, number][][], label: string, dpi: number, used: number, patches: number, marks: number}} Scan */
/** @typedef {{printer: string, paper: string, made: string, age_days: number, report: boolean, verified?: Check, pen: any, scanner?: string, shades: Shades[]}} Stored */
/** @typedef {{before: {mean: number}, after: {mean: number}}} Check */
/** @typedef {[string, ...string[][]]} Shades */
import { blob, fileOf, request, takeAway, task, upload } from './api.js';
import { address, button as plain, choice, field, guarded, h, handChoice, inkName, more as folded, picker, refusal as refusals, s, save, say, steps as row, tick, titled } from './dom.js';
import { picture as shown, progress } from './work.js';

const TAKEN = '.png,.jpg,.jpeg,.tif,.tiff,.webp,.bmp';
const PRINTS = ['print the chart', 'print the verification strip'];
const SCANS = ['scan the chart', 'scan the verification strip'];
const ROWS = ['printed as it is', 'as wanted', 'through the calibration'];
/** What a step is called on its button. */
/** @type {Record<string, string>} */
const TITLES = { 'print the chart': 'Print', 'scan the chart': 'Scan', 'build the table': 'Work it out', 'print the verification strip': 'Print a check', 'scan the verification strip': 'Scan it', 'store the calibration': 'Keep' };
/** @type {Record<string, string>} */
const SEVERE = { refuse: 'bad', warn: 'warned' };

/** Colours in three rows that touch, so that differences are seen.  @param {Shades} shades */
function swatches([name, ...rows]) {
  const wide = Math.max(1, rows[0].length);
  const bars = rows.flatMap((row, y) => row.map((fill, x) => s('rect', { x, y, width: 1, height: 1, fill })));
  return h('figure', { class: 'swatches' }, h('figcaption', {}, name),
    h('div', { class: 'joined' }, s('svg', { viewBox: `0 0 ${wide} 3`, preserveAspectRatio: 'none', 'shape-rendering': 'crispEdges', role: 'img', 'aria-label': `${name} from dark to light: ${ROWS.join(', ')}` }, bars),
      h('div', { class: 'quiet named', 'aria-hidden': 'true' }, ROWS.map((row) => h('span', {}, row)))));
}

/** How much a difference of colours is seen, ΔE00; the bounds are set by hand.  @param {number} off */
const seen_ = (off) => (off < 1.5 ? 'hardly to be seen' : off < 3 ? 'to be seen side by side' : off < 6 ? 'to be seen' : 'plain to see');
const difference = (/** @type {Check} */ { before, after }) => `Without it a difference from the wanted colours is ${seen_(before.mean)}, with it ${seen_(after.mean)}`;
const figures = (/** @type {Check} */ { before, after }) => `Off by ${before.mean.toFixed(1)} without, by ${after.mean.toFixed(1)} with it, on the mean (ΔE00; 1 is hardly seen).`;

function findings(/** @type {Finding[]} */ list) {
  return h('ul', { class: 'findings' }, list.map((one) => h('li', { class: SEVERE[one.severity] }, one.sentence, one.where ? h('span', { class: 'quiet' }, ` ${one.where}`) : '')));
}

/** The picture of a scan, with what was found and what is wrong over it.  @param {Snapshot} done @param {Scan} picture @param {number} number */
async function pictured(done, picture, number) {
  const href = URL.createObjectURL(await blob(fileOf(done, number)));
  const { width, height, faults = [], unread = [] } = picture;
  const shape = (/** @type {[number, number][]} */ points, /** @type {string} */ kind) => s('polygon', { class: kind, points: points.map(([x, y]) => [x * width, y * height]).join(' ') });
  // what lies beyond the scan is shown too: there the page was cut off
  const [xs, ys] = [0, 1].map((k) => [0, 1, ...[...faults.flatMap((one) => one.at), ...unread.flat()].map((at) => Math.min(1.6, Math.max(-0.6, at[k])))]);
  const [left, top] = [Math.min(...xs) * width, Math.min(...ys) * height];
  const [wide, high] = [Math.max(...xs) * width - left, Math.max(...ys) * height - top];
  const over = s('svg', { class: 'laid', viewBox: `${left} ${top} ${wide} ${high}`, role: 'img', 'aria-label': picture.label ? `The scan with the grid that was found: ${picture.label}` : 'The scan; no chart was found on it' },
    s('image', { href, width, height, onload: () => URL.revokeObjectURL(href) }), faults.map((one) => shape(one.at, one.severity)), unread.map((one) => shape(one, 'unread')));
  const told = picture.label
    ? `${picture.label}: ${picture.used} of ${picture.patches} fields and ${picture.marks} of 16 marks were found. Green is used, red is spoilt, blue are marks, dashed were not found.`
    : 'Nothing of the chart was found on this scan.';
  return h('figure', { class: 'found' }, over, h('figcaption', { class: 'quiet' }, told));
}

async function penned(/** @type {Snapshot} */ done, /** @type {any} */ pen, /** @type {number} */ number) {
  if (!pen) return h('p', { class: 'quiet' }, 'Nothing is written in the frame.');
  const swatch = pen.colour ? s('svg', { class: 'pen', viewBox: '0 0 2 1', preserveAspectRatio: 'none', role: 'img', 'aria-label': `The pen is ${inkName(pen.colour)}` }, s('rect', { width: 1, height: 1, fill: pen.colour }), s('rect', { x: 1, width: 1, height: 1, fill: pen.paper })) : '';
  return h('figure', { class: 'frame-of-pen' }, h('figcaption', {}, h('strong', {}, 'The pen in the frame '), pen.colour ? `${inkName(pen.colour)} ` : '', swatch),
    shown(await blob(fileOf(done, number)), 'What is written in the frame'),
    pen.said ? h('p', { class: pen.doubtful ? 'warned' : 'quiet' }, pen.said) : '');
}

/** @type {Show} */
export async function show(main, shared, [printerWanted, paperWanted]) {
  main.append(h('h1', { class: 'hidden' }, 'Colours that match'), h('p', { class: 'middle quiet' }, 'Looking for what is set up …'));
  const known = /** @type {{printers: {name: string, title: string}[], stored: Stored[], simulated: {papers: string[], faults: object}}} */ (await request('GET', '/api/calibrations'));
  /** @type {any} */
  let state = null;

  const printer = titled(known.printers);
  const papers = h('datalist', { id: 'papers' });
  const paper = h('input', { list: 'papers', required: true, pattern: '[\\w \\-]{1,60}', title: 'Letters, digits, spaces, - and _', value: paperWanted || 'plain', autocomplete: 'off' });
  const sheet = choice(['A4', 'letter'], { letter: 'US letter' });
  const hand = handChoice(shared.choices.hands.filter((one) => !one.drawn), { '': 'none' });
  const faults = Object.keys(known.simulated.faults);
  const fault = choice(['', ...faults], { '': 'nothing goes wrong' });
  if (printerWanted) {
    const full = known.printers.find((one) => [printerWanted, 'simulated'].includes(one.name) && (one.name === printerWanted || printerWanted === 'sim'))?.name;
    if (!full) printer.append(h('option', { value: printerWanted }, printerWanted));
    printer.value = full || printerWanted;
  }
  const [acceptLabel, accept] = tick('Take the print as it is, though inks are weak in it', {});
  const refusal = refusals(), { line: work, heard, run, stop } = progress(), steps = h('div', {});
  const panel = h('div', { 'aria-live': 'polite' });
  const seen = h('div', { class: 'seen' });
  const history = h('section', { class: 'panel', 'aria-label': 'Printers that are set up' });

  const asked = (more = {}) => ({ printer: printer.value, paper: paper.value.trim(), sheet: sheet.value, ...(hand.value ? { hand: hand.value } : {}), accept: accept.checked, ...(state ? { step: state.step } : {}), ...more });
  const button = (/** @type {string} */ label, /** @type {() => any} */ work_, main_ = false) => plain(label, () => act(work_), main_);

  /** A step, with its progress; what it refuses stands in the panel.  @param {string} path @param {object} more @param {string} label */
  async function step(path, more, label) {
    heard({ stage: label });
    return run((hears, signal) => task(`/api/calibration/${path}`, asked(more), ({ stage }) => hears({ stage }), signal));
  }
  async function act(/** @type {() => any} */ work_) {
    refusal.textContent = '';
    for (const one of panel.querySelectorAll('button')) one.disabled = true;
    try {
      await work_();
    } catch (/** @type {any} */ error) {
      refusal.textContent = error.name === 'AbortError' ? 'It was cancelled; what was done before is kept.' : error.message;
      if (error.message.includes('elsewhere')) await opened().catch(() => {});
    }
    for (const one of panel.querySelectorAll('button')) one.disabled = false;
  }

  async function opened(afresh = false) {
    state = null;
    take(await step('state', { afresh }, 'looking'));
    if (state.resumed && !afresh && state.number > 1) panel.prepend(h('p', { class: 'quiet' }, `Going on with what was begun on ${state.begun.slice(0, 16).replace('T', ' at ')}. `, button('Start afresh', () => opened(true))));
  }
  function take(/** @type {Snapshot} */ done) { address(main, `#calibration/${encodeURIComponent(printer.value)}/${encodeURIComponent(paper.value)}`); state = done.facts; draw(); }

  async function printed(/** @type {boolean} */ toPrinter) {
    const done = await step('pages', { to_printer: toPrinter }, toPrinter ? 'printing' : 'making the page');
    if (!toPrinter) save(await blob(fileOf(done)), done.facts.files[0]);
    take(done);
  }

  async function scanned(/** @type {File[]} */ files) {
    const ids = /** @type {string[]} */ ([]);
    try {
      for (const file of files) {
        heard({ stage: `sending ${file.name}` });
        ids.push(await upload(file));
      }
      const done = await step('scans', { uploads: ids, ...(state.simulated && !files.length && fault.value ? { faults: [fault.value] } : {}) }, 'reading the scan');
      await found(done);
    } finally {
      work.hidden = true;
      ids.forEach(takeAway);
    }
  }

  async function found(/** @type {Snapshot} */ done) {
    const { facts } = done;
    const parts = await Promise.all(/** @type {Scan[]} */ (facts.pictures).map(async (one, at) => pictured(done, one, at)));
    if ('pen' in facts) parts.push(await penned(done, facts.pen, facts.files.length - 1));
    if (facts.verified) {
      parts.push(h('h2', {}, 'Before and after'), h('p', {}, `${difference(facts.verified)}.`), ...facts.shades.map(swatches), folded('More', h('p', {}, figures(facts.verified), ' ', facts.verified.verdict), h('p', { class: 'quiet' }, facts.verified.lines.join(' '))));
    }
    seen.replaceChildren(...parts);
    take(done);
    const head = facts.accepted ? (facts.findings.length ? 'The scan is taken, with a word of warning:' : facts.said || (facts.verified ? '' : 'The scan is good.')) : 'The scan is not taken; nothing is lost. Put this right and scan again:';
    panel.prepend(h('div', { class: facts.accepted ? 'quiet' : '' }, h('p', {}, head), findings(facts.findings)));
    if (facts.verified && !facts.helps) {
      panel.append(h('div', { class: 'row' }, button('Keep it all the same', stored), button('Scan the chart again', async () => take(await step('back', {}, 'going back')), true)));
    } else if (facts.accepted && state.step === 'build the table') await built();
  }

  async function built() {
    const done = await step('table', {}, 'working it out');
    take(done);
    panel.prepend(h('p', { class: 'quiet' }, `It misses the fields of the chart by a difference that is ${seen_(done.facts.misses)}.`), folded('More', h('p', { class: 'quiet' }, `${done.facts.misses} on the mean (ΔE00; 1 is hardly seen).`)));
  }

  async function stored() {
    const done = await step('stored', {}, 'keeping it');
    take(done);
    known.stored = (await request('GET', '/api/calibrations')).stored;
    past();
    say(done.facts.said);
  }

  function draw() {
    const title = TITLES[state.step], done = state.number > state.steps.length;
    steps.replaceChildren(row(state.steps.map((/** @type {string} */ one) => TITLES[one] ?? one), state.number - 1, 0, () => {}));
    what.open = false;
    about.textContent = `${printer.selectedOptions[0]?.textContent.split(':')[0]}, ${paper.value} paper`;
    const said = state.step === 'store the calibration' ? 'The colours are right now: keep this, and pages for this printer go through it.' : state.request;
    const parts = /** @type {HTMLElement[]} */ ([h('h2', {}, done ? 'Done' : `${state.number} of ${state.steps.length}: ${title ?? state.step}`), h('ul', { class: 'told-steps' }, /** @type {string} */ (said).split(/(?<=\.) (?=[A-Z])/).map((one) => h('li', {}, one)))]);
    const once = () => button('Keep it without a check', stored), back = () => button('Scan the chart again', async () => take(await step('back', {}, 'going back')));
    if (PRINTS.includes(state.step)) {
      const self = state.writes_files;
      parts.push(h('p', { class: 'quiet' }, 'Print it at 100 %, without colour management.'), h('div', { class: 'row' }, self ? '' : button(state.simulated ? 'Let the simulated printer print it' : 'Print it', () => printed(true), true), button('PDF, to print it myself', () => printed(false), self)));
      if (state.step === PRINTS[1]) parts.push(folded('More', h('div', { class: 'row' }, once())));
    } else if (SCANS.includes(state.step)) {
      const first = state.step === SCANS[0];
      parts.push(picker(state.pages > 1 && first ? `Scans of the ${state.pages} pages` : 'The scan', 'Drop it here: TIFF or PNG, 300 dots per inch, in colour.',
        { multiple: first && state.pages > 1, accept: TAKEN }, (files) => act(() => scanned(files))));
      if (state.kept) parts.push(h('p', { class: 'quiet' }, `${state.kept} good ${state.kept > 1 ? 'scans are' : 'scan is'} kept.`));
      parts.push(h('div', { class: 'row after' }, state.simulated ? button('Let the simulated scanner scan it', () => scanned([]), true) : button('Scan it with a scanner of this computer', () => scanned([]))));
      parts.push(folded('More', first ? acceptLabel : '', state.simulated ? field('What goes wrong on the way', fault) : '',
        h('div', { class: 'row after' }, button('The PDF once more', async () => { const again = await step('pages/again', {}, 'making the page'); save(await blob(fileOf(again)), again.facts.files[0]); take(again); }), first ? '' : [back(), once()])));
    } else if (state.step === 'build the table') parts.push(h('div', { class: 'row' }, button('Work it out', built, true)));
    else if (state.step === 'store the calibration') parts.push(h('div', { class: 'row' }, button('Keep it', stored, true), back()));
    panel.replaceChildren(...parts);
  }

  const report = (/** @type {Stored} */ of, /** @type {string} */ made) => guarded(refusal, async () => {
    const done = await task('/api/calibration/report', { printer: of.printer, paper: of.paper, made }, () => {});
    save(await blob(fileOf(done)), `calibration-${of.printer}-${of.paper}.html`);
  })();
  function past() {
    const groups = /** @type {Map<string, Stored[]>} */ (new Map());
    for (const one of known.stored) groups.set(`${one.printer} on ${one.paper}`, [...(groups.get(`${one.printer} on ${one.paper}`) || []), one]);
    history.replaceChildren(h('h2', {}, 'Printers that are set up'), ...(groups.size ? [] : [h('p', { class: 'quiet' }, 'None yet. Each stands here with its colours before and after.')]), ...[...groups].map(([name, list]) => h(
      'details', { open: groups.size < 3 }, h('summary', {}, h('strong', {}, name), ` ${list.length > 1 ? `${list.length} times, ` : ''}${list[0].age_days ? `${list[0].age_days} days ago` : 'today'}`),
      list.map((one, at) => h('article', {}, h('div', { class: 'row between' }, h('span', {}, `${one.made.slice(0, 16).replace('T', ' ')}${at ? '' : ', used now'}`), one.report ? plain('Report', () => report(one, one.made)) : ''),
        h('p', { class: 'quiet' }, one.verified ? `${difference(one.verified)}.` : 'Not checked.', one.pen.hand ? ` The pen in its frame: ${one.pen.hand}.` : '', one.scanner ? ` Scanner: ${one.scanner}.` : ''),
        at ? '' : one.shades.map(swatches))),
    )));
  }

  const begin = h('button', { class: 'main' }, 'Start or continue');
  const form = h('form', { 'aria-label': 'Printer and paper' }, field('Printer', printer), h('div', { class: 'grid' }, field('What you call the paper', paper), field('Size', sheet)), papers, folded('More', field('Check it with the ink of', hand)), h('div', { class: 'row' }, begin));
  const about = h('summary', {}, 'Which printer, which paper?'), what = h('details', { open: true }, about, form);
  form.addEventListener('submit', (event) => { event.preventDefault(); seen.replaceChildren(); begin.disabled = true; act(() => opened()).then(() => { begin.disabled = false; }); });
  const offered = () => papers.replaceChildren(...[...new Set([...(printer.value === 'simulated' ? known.simulated.papers : ['plain']), ...known.stored.filter((one) => one.printer === printer.value).map((one) => one.paper)])].map((one) => h('option', { value: one })));
  printer.addEventListener('change', offered);
  offered(); past();
  main.replaceChildren(h('div', { class: 'calibration' }, h('h1', {}, 'Colours that match'),
    h('p', { class: 'quiet' }, 'A printer makes its own colours of every ink. Print a chart, scan it, and from then on its pages have the colour of your pen. It is done once for each paper.'), h('div', { class: 'columns' },
    h('div', {}, h('section', { class: 'panel' }, what), h('section', { class: 'panel', 'aria-label': 'The step' }, steps, refusal, work, panel), history), seen)));
  panel.replaceChildren(h('p', { class: 'quiet' }, 'To see how it goes, without paper:'), h('div', { class: 'row' }, h('a', { class: 'button', href: '#calibration/sim/white' }, 'Try it with the simulated printer')));
  if (printerWanted) act(() => opened());
  return stop;
}
