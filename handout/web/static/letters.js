// The page Correct letters: what was found on a scanned page, corrected letter by letter, doubtful ones first, by keys or pointer.

/** @import { Hand, Point, Shared, Show } from './types' */
/** @import { Letter, Pen, Stroke } from './stage.js' */
import { request, task } from './api.js';
import * as drafts from './drafts.js';
import { button, choice, field, h, handChoice, more as folded, refusal as refusals, s, say } from './dom.js';
import { apart, middle, stage, strokesOf } from './stage.js';
import { lineIn, progress } from './work.js';

/** @type {Record<string, string>} */
const VERDICTS = { sure: 'surely this letter', doubtful: 'doubtful', refused: 'probably wrong', unnamed: 'which letter is it?', confirmed: 'right, as you said', kept_out: 'right, and not written' };
const NEAR = 12; // x-heights that fit into the shorter side of the view when a letter is looked at
const LEARN_FIRST = 3, LEARN_AFTER = 12, QUIET = 8000; // corrections, the first time and then, and ms without one, after which the page is learned from
const KEYS = matchMedia('(hover: hover)').matches;
const HINT = KEYS ? 'Enter confirms, a key names the letter anew, ↓ goes to the next doubtful one, ← and → to the letters beside.' : 'A tap chooses a letter, two fingers move and enlarge the page.';
const BY_KEYS = KEYS ? 'With keys: arrows move the cross, Space puts the pen down, Enter ends; Esc leaves it.' : 'Two fingers move the page; the button again leaves it.';

/** @param {Hand[]} hands @param {string} [name] */
function chooser(hands, name) {
  const select = handChoice(hands, { '': 'Choose …' });
  select.value = name || '';
  select.addEventListener('change', () => { if (select.value) location.hash = `letters/${encodeURIComponent(select.value)}`; });
  return field('Handwriting', select);
}

function greeting(/** @type {Hand[]} */ hands) {
  return h('div', { class: 'middle' }, h('h1', {}, 'Correct letters'), h('p', {}, 'Look through the letters of a handwriting from paper, and put right what was read wrongly. The others learn from it.'), chooser(hands, ''),
    hands.some((hand) => hand.own) ? '' : h('p', { class: 'after' }, 'Your own is not here yet. ', h('a', { class: 'button main', href: '#own' }, 'Add my handwriting')));
}

function copying(/** @type {Hand[]} */ hands, /** @type {string} */ name, /** @type {Shared} */ shared) {
  const copy = button('Make a copy of my own', async () => {
    try {
      const made = await request('POST', `/api/hands/${name}/copy`);
      await shared.refresh();
      location.hash = `letters/${made.name}`;
    } catch (/** @type {any} */ error) { say(error.message); }
  }, true);
  return h('div', { class: 'middle' }, h('h1', {}, name), chooser(hands, name), h('p', {}, 'This handwriting comes with the program. To correct its letters, make a copy of your own.'), copy);
}

/** @type {Show} */
export async function show(main, shared, [name, number = '0']) {
  const hands = shared.choices.hands.filter((hand) => !hand.drawn);
  const hand = hands.find((one) => one.name === name);
  if (!hand) { main.append(greeting(hands)); return null; }
  if (!hand.own) { main.append(copying(hands, name, shared)); return null; }

  const url = `/api/hands/${name}`, page = Number(number) || 0;
  let facts = await request('GET', `${url}/letters`);
  let { letters } = /** @type {{letters: Letter[]}} */ (await request('GET', `${url}/letters/${page}`));
  const sheet = { ...facts.pages[page], page, tile: facts.tile }, unit = sheet.x_height;
  let at = 0, mode = /** @type {any} */ (null), chain = /** @type {Promise<any>} */ (Promise.resolve()), pending = 0, since = 0, learning = /** @type {AbortController | null} */ (null), learned = false, quiet = 0, left_ = false;
  const skipped = new Set();

  const title = h('p', { class: 'big', 'aria-live': 'polite' }), about = h('p', { class: 'quiet' });
  const left = h('p', {}), refusal = refusals(), kept = h('p', { class: 'quiet', 'aria-live': 'polite' });
  const form = `letter-${name}`, input = h('input', { autocomplete: 'off', autocapitalize: 'off', spellcheck: 'false', maxlength: 8, oninput: () => drafts.keepForm(form, { page, spot: here().spot, name: input.value }) });
  const hint = h('p', { class: 'quiet' }, HINT), more = h('span', { class: 'row push' });
  const view = stage(url, sheet, pressed);

  const here = () => letters[at];
  const doubtful = (/** @type {Letter} */ letter) => letter.gain > 0;
  const doubts = () => letters.filter(doubtful).sort((a, b) => b.gain - a.gain);
  const indexOf = (/** @type {number} */ id) => letters.findIndex((letter) => letter.id === id);

  function choose(/** @type {number} */ index) {
    at = Math.max(0, Math.min(index, letters.length - 1));
    const letter = here();
    view.frame(letter);
    if (!letter) return;
    title.textContent = letter.letter || '?';
    const half = drafts.formValues(form); // typed for this one, and not said yet
    if (half.page !== page || apart(half.spot, letter.spot) > 1) { input.value = letter.letter; drafts.forget(form); } else input.value = half.name;
    about.textContent = `${letter.word ? `in “${letter.word}”, ` : ''}line ${letter.line + 1}: ${VERDICTS[letter.verdict]}${letter.joined ? ', joined to the next' : ''}${letter.ordered ? ', strokes told' : ''}`;
    tell();
  }

  function tell() {
    const count = doubts().length;
    left.textContent = count ? `${count} of ${letters.length} letters are doubtful.` : `None of ${letters.length} letters is doubtful.`;
    pages.options[page].textContent = `${page + 1}: ${count} doubtful of ${letters.length}`;
    undo.disabled = !facts.made; redo.disabled = facts.made >= facts.entries;
    /** @type {Node} */ (link.firstChild).textContent = here()?.joined ? 'Not joined to the next' : 'Joined to the next';
    /** @type {Node} */ (unwritten.firstChild).textContent = here()?.verdict === 'kept_out' ? 'Write it again' : 'Do not write';
    kept.textContent = facts.trouble || (pending ? 'Keeping …' : facts.made ? `${facts.made} ${facts.made === 1 ? 'correction is' : 'corrections are'} kept.` : '');
  }

  function nextDoubt() {
    if (here()) skipped.add(here().id);
    const next = doubts().find((letter) => !skipped.has(letter.id));
    if (next) choose(indexOf(next.id));
    else { skipped.clear(); const [again] = doubts(); if (again) choose(indexOf(again.id)); else tell(); }
  }

  function pressed(/** @type {Point} */ [x, y], /** @type {Element} */ on) {
    const stroke = /** @type {HTMLElement | null} */ (on.closest?.('[data-stroke]'));
    if (mode?.strokes && stroke) { turn(Number(stroke.dataset.stroke)); return; }
    const inside = (/** @type {Letter} */ { box: [l, t, r, b] }) => x > l - 3 && x < r + 3 && y > t - 3 && y < b + 3;
    const order = letters.map((letter, index) => [inside(letter) ? 0 : 1e4, apart(middle(letter), [x, y]), index]).sort((a, b) => a[0] + a[1] - b[0] - b[1]);
    if (order.length && order[0][0] + order[0][1] < 1e4 + 3 * unit) {
      const strokes = mode?.strokes;
      choose(order[0][2]);
      if (strokes) beginStrokes();
    }
    view.svg.focus();
  }

  /** What an answer says of this page's letters.  @param {any} answer */
  function renew(answer) {
    facts = answer;
    const told = answer.told?.[page];
    if (!told) return;
    const known = new Map(letters.map((letter) => [letter.id, letter])), id = here()?.id, spot = here()?.spot;
    for (const letter of told.letters) known.set(letter.id, letter);
    letters = told.order.map((/** @type {number} */ one) => known.get(one)).filter(Boolean);
    view.letters(letters, told.letters);
    const still = indexOf(id);
    if (still >= 0) choose(still);
    else choose(spot && letters.length ? letters.map((letter, index) => [apart(letter.spot, spot), index]).sort((a, b) => a[0] - b[0])[0][1] : 0);
  }
  async function reload() {
    facts = await request('GET', `${url}/letters`);
    const answer = await request('GET', `${url}/letters/${page}`);
    renew({ ...facts, told: { [page]: { order: answer.letters.map((/** @type {Letter} */ letter) => letter.id), letters: answer.letters } } });
  }

  /** Changes are sent one after the other; what is looked at meanwhile may be another letter already.  @param {string} path @param {object} body @param {{unnamed?: boolean, painted?: boolean}} [how] */
  function change(path, body, { unnamed = false, painted = false } = {}) {
    pending += 1; tell();
    refusal.textContent = '';
    chain = chain.then(async () => {
      try {
        const send = () => request('POST', `${url}/${path}`, { revision: facts.revision, ...body });
        // what was learned may just have taken the hand's place: the correction is for what is there now
        const answer = await send().catch(async (/** @type {any} */ error) => { if (error.status !== 409 || !learning) throw error; await reload(); return send(); });
        pending -= 1;
        renew(answer);
        if (painted) view.repaint();
        if (unnamed) {
          const blank = letters.map((letter, index) => [letter.verdict === 'unnamed' ? apart(letter.spot, here().spot) : Infinity, index]).sort((a, b) => a[0] - b[0])[0];
          if (blank && blank[0] < Infinity) choose(blank[1]);
        }
        for (const note of answer.notes || []) say(note);
        since += 1; soonLearn();
        return answer;
      } catch (/** @type {any} */ error) {
        pending -= 1;
        await reload();
        refusal.textContent = error.message;
        tell();
        return null;
      }
    }).catch((/** @type {Error} */ error) => { refusal.textContent = error.message; });
    const answered = chain;
    // the words around it follow
    chain = chain.then(async (/** @type {any} */ answer) => { if (answer?.behind) { const all = await request('GET', `${url}/alignment?revision=${answer.revision}`); renew(all); await showRewritten(all.rewritten?.[page]); } }).catch((/** @type {Error} */ error) => { refusal.textContent = error.message; });
    return answered;
  }
  /** Strokes of other letters that follow what was said of one: shown once, undone with it. */
  async function showRewritten(/** @type {Stroke[]} */ strokes = []) {
    const ids = new Set(strokes.map((stroke) => stroke.id)), mine = mode;
    if (!ids.size) return;
    say(`${ids.size === 1 ? 'Another letter is' : `${ids.size} other letters are`} now written so, too, as shown; Undo takes all back.`);
    if (mine?.strokes?.some((/** @type {Stroke} */ own) => ids.has(own.id))) {
      const [x, y] = mine.strokes[0].xy[0];
      const { strokes: word } = await request('GET', `${url}/strokes/${page}/${Math.max(0, Math.round(x))}/${Math.max(0, Math.round(y))}`);
      if (mode !== mine) return;
      mine.strokes = word; drawStrokes(true);
    }
    for (const group of strokesOf(strokes, -1, unit, true)) { group.removeAttribute('data-stroke'); view.written.append(group); }
  }
  const correct = (/** @type {object} */ correction, /** @type {{unnamed?: boolean, painted?: boolean}} */ how = {}) => change('corrections', { corrections: [{ page, ...correction }], later: true }, how);
  const back = (/** @type {number} */ count) => { if (!mode) view.written.replaceChildren(); return change('history', { back: count }, { painted: true }); };

  function confirmLetter() {
    if (!here()?.letter) { refusal.textContent = 'This has no name yet: type its letter.'; return; }
    correct({ do: 'confirm', at: here().spot });
    letters[at] = { ...here(), verdict: 'confirmed', probability: 1, gain: 0 };
    nextDoubt();
  }
  function keepOut() {
    if (!here()?.letter) { refusal.textContent = 'This has no name yet: type its letter.'; return; }
    const out = here().verdict !== 'kept_out';
    correct({ do: 'keep_out', at: here().spot, out });
    letters[at] = { ...here(), verdict: out ? 'kept_out' : 'confirmed', probability: 1, gain: 0 };
    if (out) nextDoubt(); else choose(at);
  }
  function label(/** @type {string} */ text) {
    if (!text.trim() || !here()) return;
    drafts.forget(form);
    correct({ do: 'label', at: here().spot, text: text.trim() });
    letters[at] = { ...here(), letter: text.trim(), verdict: 'confirmed', probability: 1, gain: 0 };
    nextDoubt();
  }
  const removeLetter = () => correct({ do: 'remove', at: here().spot });
  function beside(/** @type {number} */ step) {
    const other = letters[at + step];
    if (other && other.line === here().line) return other;
    refusal.textContent = `There is no letter ${step > 0 ? 'after' : 'before'} it on its line.`;
    return null;
  }
  function joinNext() { const other = beside(1); if (other) correct({ do: 'merge', at: here().spot, other: other.spot }); }
  function linkNext() {
    if (here().joined) correct({ do: 'unlink', at: here().spot });
    else { const other = beside(1); if (other) correct({ do: 'link', at: here().spot, other: other.spot }); }
  }

  const rounded = (/** @type {Point[]} */ points) => points.map(/** @returns {Point} */ ([x, y]) => [Math.round(x * 10) / 10, Math.round(y * 10) / 10]);
  const thinned = (/** @type {Point[]} */ points, /** @type {number} */ most) => { const step = Math.ceil(points.length / most); return points.filter((_, index) => index % step === 0 || index === points.length - 1); };
  function stop() {
    mode = null;
    view.draw(null); view.bases.replaceChildren(); view.written.replaceChildren(); more.replaceChildren();
    hint.textContent = HINT;
    for (const button of tools.values()) button.removeAttribute('aria-pressed');
    view.svg.focus();
  }
  function begin(/** @type {string} */ id, /** @type {Pen | null} */ what, /** @type {string} */ said, /** @type {Point} */ from = here() ? middle(here()) : [view.view.x + view.view.w / 2, view.view.y + view.view.h / 2]) {
    const again = mode?.id === id;
    stop();
    if (again) return false;
    mode = { id };
    tools.get(id)?.setAttribute('aria-pressed', 'true');
    hint.textContent = `${said} ${what ? BY_KEYS : ''}`;
    if (what) view.draw(what, from);
    return true;
  }

  /** @type {Pen} */
  const CUT = { kind: 'line', done: ([a, b]) => { stop(); correct({ do: 'split', a, b }, { unnamed: true }); } };
  function beginCut() {
    if (!here()) return;
    const { box: [x, y, right, low] } = here(), lean = sheet.slant * (low - y) / 2, over = unit * 0.2, cx = (x + right) / 2;
    if (begin('cut', CUT, '')) {
      mode.way = [[cx + lean, y - over], [cx - lean, low + over]];
      view.draw({ ...CUT, start: mode.way });
      hint.textContent = KEYS ? 'Draw the cut; or move it with ← and →, tilt it with ↑ and ↓; Enter cuts, Esc leaves it.' : 'Draw the cut; the button again leaves it.';
    }
  }
  function moveCut(/** @type {string} */ key, /** @type {number} */ step) {
    if (!mode) return;
    const by = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [-step, -step], ArrowRight: [step, step], ArrowUp: [step, -step], ArrowDown: [-step, step] })[key];
    mode.way = mode.way.map((/** @type {Point} */ [x, y], /** @type {number} */ end) => [x + by[end], y]);
    view.draw({ ...CUT, start: mode.way });
  }
  function beginOutline() {
    if (!here()?.letter) { refusal.textContent = 'This has no name yet: type its letter.'; return; }
    const { letter } = here();
    begin('outline', { kind: 'path', closed: true, done: (/** @type {Point[]} */ points) => { stop(); correct({ do: 'outline', within: rounded(thinned(points, 60)), text: letter }); } }, `Draw around all ink of “${letter}” and of nothing else.`);
  }
  function beginPaint(/** @type {string} */ to) {
    const wide = Math.max(2, Number(brush.value) * unit / 100);
    const seen = facts.pages[page].scan, alone = 'This hand keeps no scan of the page: only what is under the brush changes.';
    const said = to === 'paper' ? `Paint over what is no ink${seen ? '; one dab is enough for all of a stain' : ''}.` : `Paint ink where there is some that was not found${seen ? '; one dab is enough for a stroke' : ''}.`;
    begin(to, { kind: 'path', width: wide, to, done: (/** @type {Point[]} */ points) => { view.draw(null); correct({ do: 'paint', to, stroke: rounded(thinned(points, 200)), width: wide }, { painted: true }).then(() => { if (mode?.id === to) { mode = null; beginPaint(to); } }); } }, seen ? said : `${said} ${alone}`);
  }
  function beginPrinted() {
    begin('printed', { kind: 'line', done: (/** @type {Point[]} */ [a, b]) => { stop(); correct({ do: 'rule', a, b, width: Math.max(2, unit * 0.2) }, { painted: true }); } }, 'Draw along a printed rule that was taken for ink; those like it go, too.');
  }

  function beginBase() {
    const row = facts.pages[page].baselines?.[here()?.line ?? 0];
    if (!row || !begin('base', null, KEYS ? 'Drag the line below by its ends or at the letter; or ↑ and ↓ move it, with Shift the right end alone. Enter keeps it, Esc leaves it.' : 'Drag the line below by its ends or at the letter; the button again leaves it.')) return;
    mode.base = { line: here()?.line ?? 0, a: [...row[0]], b: [...row[1]] };
    drawBase();
  }
  function drawBase() {
    // the middle handle is where the letter is
    const { a, b } = mode.base, x = Math.max(a[0], Math.min(here() ? middle(here())[0] : (a[0] + b[0]) / 2, b[0]));
    const mid = [x, a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0])];
    view.bases.replaceChildren(
      s('path', { d: `M${a}L${b}`, class: 'base' }), s('path', { d: `M${a}L${b}`, class: 'grip', 'data-handle': 'both', 'stroke-width': unit * 0.4 }),
      ...[['a', a], ['both', mid], ['b', b]].map(([handle, [cx, cy]]) => s('circle', { cx, cy, r: unit * 0.22, 'data-handle': handle })),
    );
  }
  view.bases.addEventListener('drag', (/** @type {any} */ { detail: { handle, place } }) => {
    if (!mode?.base) return;
    const { a, b } = mode.base;
    if (handle === 'both') { const by = place[1] - (a[1] + (b[1] - a[1]) * (place[0] - a[0]) / (b[0] - a[0])); a[1] += by; b[1] += by; } else mode.base[handle][1] = place[1];
    drawBase();
  });
  view.bases.addEventListener('dropped', () => { if (mode?.base) keepBase(); });
  function keepBase() {
    const { line, a, b } = mode.base;
    stop();
    correct({ do: 'baseline', line, a: rounded([a])[0], b: rounded([b])[0] });
  }

  async function beginStrokes() {
    if (!here() || !begin('strokes', null, 'Reading how the word is written …')) { if (mode?.strokes) stop(); return; }
    const mine = mode;
    const [x, y] = here().spot;
    await chain;
    const { strokes } = await request('GET', `${url}/strokes/${page}/${Math.max(0, Math.round(x))}/${Math.max(0, Math.round(y))}`);
    if (mode !== mine) return;
    mode.strokes = strokes; mode.chosen = Math.max(0, strokes.findIndex((/** @type {Stroke} */ stroke) => stroke.id === here().id));
    hint.textContent = KEYS ? 'A click reverses a stroke. With keys: ← and → choose one, Enter reverses it, ↑ and ↓ write it earlier or later, Space shows it again; Esc leaves it.' : 'A tap reverses a stroke.';
    more.replaceChildren(small('Next stroke', () => chooseStroke(1)), small('Earlier', () => reorder(-1)), small('Later', () => reorder(1)), small('Again', () => drawStrokes(false)));
    drawStrokes();
  }
  function drawStrokes(calm = matchMedia('(prefers-reduced-motion: reduce)').matches) {
    view.written.replaceChildren(...strokesOf(mode.strokes, mode.chosen, unit, calm));
  }
  function chooseStroke(/** @type {number} */ by) {
    mode.chosen = (mode.chosen + by + mode.strokes.length) % mode.strokes.length;
    drawStrokes(true);
  }
  function keepStrokes(/** @type {number} */ id) {
    const own = /** @type {Stroke[]} */ (mode?.strokes).filter((stroke) => stroke.id === id);
    drawStrokes(true);
    const letter = letters[indexOf(id)];
    if (letter) correct({ do: 'strokes', at: own[0].xy[0], ways: own.map((stroke) => stroke.xy) });
  }
  function turn(/** @type {number} */ index) {
    const stroke = mode.strokes[index];
    if (!stroke) return;
    mode.chosen = index;
    stroke.xy = [...stroke.xy].reverse();
    keepStrokes(stroke.id);
  }
  function reorder(/** @type {number} */ step) {
    const { strokes, chosen } = mode, other = chosen + step;
    if (!strokes[other] || strokes[other].id !== strokes[chosen].id) return;
    [strokes[chosen], strokes[other]] = [strokes[other], strokes[chosen]];
    mode.chosen = other;
    keepStrokes(strokes[other].id);
  }
  function beginWriting() {
    if (!here()) return;
    const { id, spot, letter } = here();
    const ways = mode?.id === 'write' ? mode.ways : [];
    const pen = { kind: 'path', done: (/** @type {Point[]} */ points) => { ways.push(rounded(thinned(points, 120))); view.written.append(s('path', { d: `M${points.join('L')}`, class: 'stroke', 'stroke-width': unit * 0.07 })); hint.textContent = `${ways.length} drawn: draw the next stroke, or keep them${KEYS ? ' with Enter' : ''}.`; more.replaceChildren(small('Keep', keepWriting)); view.draw(pen, middle(here())); } };
    if (begin('write', pen, `Draw the strokes of “${letter || '?'}” over its ink, in their order.`)) Object.assign(mode, { ways, of: id, spot });
  }
  function keepWriting() {
    const { ways, spot } = mode;
    stop();
    if (ways.length) correct({ do: 'strokes', at: spot, ways });
  }

  const key = (/** @type {string} */ text) => h('kbd', {}, text);
  const small = (/** @type {any} */ text, /** @type {() => any} */ work, more_ = {}) => button(text, () => { work(); view.svg.focus(); }, false, more_);
  const act = (/** @type {string} */ text, /** @type {string} */ keys, /** @type {() => any} */ work, title = /** @type {string | undefined} */ (undefined)) => small([h('span', {}, text), key(keys)], work, { title });
  const undo = act('Undo', 'Ctrl+Z', () => back(1)), redo = act('Redo', 'Ctrl+Y', () => back(-1));
  const link = act('Joined to the next', 'Alt+L', linkNext), unwritten = act('Do not write', 'Alt+N', keepOut, 'It is this letter, but do not write this one: others of its name are written in its place.');
  const right = act('That is right', 'Enter', confirmLetter, 'It is this letter, in name and extent. It is written no more often for that.');
  right.className = 'main';
  const tools = new Map([
    ['cut', act('Cut it in two', 'Alt+C', beginCut)], ['outline', act('Draw around it', 'Alt+O', beginOutline)], ['strokes', act('Show its strokes', 'Alt+S', beginStrokes)], ['write', act('Write over it', 'Alt+W', beginWriting)],
    ['paper', act('Paint paper', 'Alt+P', () => beginPaint('paper'))], ['ink', act('Paint ink', 'Alt+I', () => beginPaint('ink'))], ['printed', act('Printed rule', 'Alt+R', beginPrinted)], ['base', act('Move the line below', 'Alt+B', beginBase)],
  ]);
  /** @type {Record<string, () => any>} */
  const BY_CODE = { KeyC: beginCut, KeyJ: joinNext, KeyL: linkNext, KeyN: keepOut, KeyO: beginOutline, KeyS: beginStrokes, KeyW: beginWriting, KeyP: () => beginPaint('paper'), KeyI: () => beginPaint('ink'), KeyR: beginPrinted, KeyB: beginBase };

  function modal(/** @type {string} */ pressedKey, /** @type {KeyboardEvent} */ event) {
    if (!mode) return false;
    const arrow = pressedKey.startsWith('Arrow');
    if (pressedKey === 'Escape') stop();
    else if (mode.way && arrow) moveCut(pressedKey, (event.shiftKey ? 8 : 2));
    else if (mode.way && pressedKey === 'Enter') CUT.done(mode.way);
    else if (mode.base && (pressedKey === 'ArrowUp' || pressedKey === 'ArrowDown')) {
      const by = (pressedKey === 'ArrowUp' ? -1 : 1) * unit * 0.05;
      if (!event.shiftKey) mode.base.a[1] += by;
      mode.base.b[1] += by;
      drawBase();
    } else if (mode.base && pressedKey === 'Enter') keepBase();
    else if (mode.strokes && (pressedKey === 'ArrowLeft' || pressedKey === 'ArrowRight')) chooseStroke(pressedKey === 'ArrowRight' ? 1 : -1);
    else if (mode.strokes && arrow) reorder(pressedKey === 'ArrowUp' ? -1 : 1);
    else if (mode.strokes && pressedKey === 'Enter') turn(mode.chosen);
    else if (mode.strokes && pressedKey === ' ') drawStrokes();
    else if (view.keyed(event)) return true;
    else if (mode.id === 'write' && pressedKey === 'Enter') keepWriting();
    else return false;
    return true;
  }

  view.svg.addEventListener('keydown', (event) => {
    const { key: pressedKey } = event;
    const done = () => { event.preventDefault(); return true; };
    if (event.altKey) {
      const work = BY_CODE[event.code];
      if (work && done()) work();
    } else if (event.ctrlKey || event.metaKey) {
      if (pressedKey.toLowerCase() === 'z' && done()) back(event.shiftKey ? -1 : 1);
      else if (pressedKey.toLowerCase() === 'y' && done()) back(-1);
    } else if (mode) { if (modal(pressedKey, event)) done(); } else if (pressedKey === 'Enter' && done()) confirmLetter();
    else if ((pressedKey === 'Delete' || pressedKey === 'Backspace') && done()) removeLetter();
    else if (pressedKey === 'ArrowRight' && done()) choose(at + 1);
    else if (pressedKey === 'ArrowLeft' && done()) choose(at - 1);
    else if (pressedKey === 'ArrowDown' && done()) nextDoubt();
    else if ((pressedKey === 'PageUp' || pressedKey === 'PageDown') && done()) view.zoom(pressedKey === 'PageUp' ? 0.7 : 1.4);
    else if ([...pressedKey].length === 1 && pressedKey !== ' ' && done()) label(pressedKey);
  });

  const pages = choice(facts.pages.map((/** @type {any} */ _, /** @type {number} */ index) => String(index)), Object.fromEntries(facts.pages.map((/** @type {any} */ one, /** @type {number} */ index) => [index, `${index + 1}: ${one.doubtful} doubtful of ${one.letters}`])));
  pages.value = String(page);
  pages.addEventListener('change', () => { location.hash = `letters/${encodeURIComponent(name)}/${pages.value}`; });

  const { line: work, heard, run } = progress();
  const learn = button('Learn from the corrections', () => beginLearning(true));
  async function beginLearning(/** @type {boolean} */ asked) {
    if (learning || left_) return;
    learn.disabled = true; since = 0; learned = true;
    learning = new AbortController();
    await chain;
    try {
      const { facts: learnt } = await task(`${url}/learning`, { revision: facts.revision }, heard, learning.signal);
      // what was sent while it went on waits for this, and comes after it
      chain = chain.then(() => { renew(learnt); });
      await chain;
      if (asked || learnt.changed) say(learnt.changed ? `${learnt.changed} other letters were found anew.` : 'All other letters stay as they were.');
    } catch (/** @type {any} */ error) {
      if (error.name !== 'AbortError' && asked) refusal.textContent = error.message;
      if (error.name !== 'AbortError') await reload().catch(() => {});
    } finally { learning = null; learn.disabled = false; work.hidden = true; }
  }
  function soonLearn() {
    clearTimeout(quiet);
    if (since >= (learned ? LEARN_AFTER : LEARN_FIRST)) quiet = setTimeout(() => beginLearning(false), QUIET);
  }

  const trying = lineIn(name, 'A line in it as it is now', run, () => chain, (error) => { refusal.textContent = error?.message || ''; });

  const brush = h('input', { type: 'range', min: 5, max: 80, value: 20 });
  const naming = h('form', { 'aria-label': 'Name the letter', onsubmit(/** @type {Event} */ event) { event.preventDefault(); label(input.value); view.svg.focus(); } },
    h('div', { class: 'row' }, h('div', { class: 'wide' }, field('Its letter', input)), h('button', {}, 'Name it')));
  main.append(h('div', { class: 'letters' },
    h('section', { class: 'stage', 'aria-label': 'The page' },
      h('div', { class: 'tools' }, hint, more, h('span', { class: 'joined push' }, button('+', () => view.zoom(0.7), false, { class: 'icon', 'aria-label': 'Larger' }), button('−', () => view.zoom(1.4), false, { class: 'icon', 'aria-label': 'Smaller' }))),
      view.svg),
    h('aside', { class: 'side', 'aria-label': 'The letter' }, h('h1', {}, 'Is this letter right?'), h('p', { class: 'quiet' }, `The one in the frame, of ${name}. Name it where it is not: what you put right is written better from now on, and other letters learn from it.`), left, h('div', {}, title, about), refusal, naming,
      h('div', { class: 'keys' }, right, act('Next', '↓', nextDoubt), unwritten, act('It is no letter', 'Del', removeLetter), h('div', { class: 'pair' }, undo, redo)),
      folded('Where it begins and ends', h('div', { class: 'keys' }, act('Add the next piece', 'Alt+J', joinNext), link, tools.get('cut'), tools.get('outline'), tools.get('base'))),
      folded('How it is written', h('div', { class: 'keys' }, tools.get('strokes'), tools.get('write'))),
      folded('Ink and paper', h('div', { class: 'keys' }, tools.get('paper'), tools.get('ink'), tools.get('printed')), field('Width of the brush', brush)),
      kept, learn, work, trying, folded('Another handwriting, another page', chooser(hands, name), field('Page', pages)))));
  view.letters(letters);
  const half = drafts.formValues(form), begun = half.page === page ? letters.find((letter) => apart(letter.spot, half.spot) <= 1) : null;
  const first = begun || doubts()[0];
  view.look(first ? middle(first) : [sheet.width / 2, sheet.height / 4], view.near(NEAR));
  choose(first ? indexOf(first.id) : 0);
  view.svg.focus();
  return () => { left_ = true; clearTimeout(quiet); learning?.abort(); view.forget(); };
}
