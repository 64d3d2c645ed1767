// The page Style: targets and ellipses dragged, the path and its speed anew with every move; a style's numbers; a word in it.

/** @import { Point, Show } from './types' */
/** @import { Line, Paint } from './canvas.js' */
/** @typedef {{key: string, label: string, unit?: string, usual: any, options?: [any, string][], count: number, low: number, high: number, least?: number, most?: number}} Knob */
/** @typedef {{targets: Point[], up: number[], own: number[][] | null, page: Point}} Plan */
import { blob, request, takeAway, upload } from './api.js';
import { draw, INK, paintStrokes, surface } from './canvas.js';
import * as drafts from './drafts.js';
import { ARROWS, button as plain, choice, field, h, handChoice, more, picker, refusal as refusals, s, save, say, tick } from './dom.js';

const FIRST = { targets: [[24, 62], [40, 34], [50, 74], [64, 38], [76, 72], [94, 40], [104, 66], [126, 46]], up: [], own: null, page: [148, 105] };
const FORMATS = { toml: 'The style (TOML)', targets: 'Its points (JSON)', svg: 'SVG', pdf: 'PDF', png: 'PNG', inkml: 'InkML', json: 'Drawing (JSON)' };
const INNER = ['Broken strokes', 'Path', 'Ellipses', 'Guide']; // groups for those who know how movement is modelled
const FAINT = '#31457a';
/** @type {Record<string, number>} */
const NEAR = { mouse: 10, pen: 14, touch: 24 }; // pixels within which a handle is taken

const deg = (/** @type {number} */ angle) => (angle * 180) / Math.PI;
const rad = (/** @type {number} */ angle) => (angle * Math.PI) / 180;
const clamp = (/** @type {number} */ value, /** @type {number} */ least, /** @type {number} */ most) => Math.min(most, Math.max(least, value));
const tidy = (/** @type {number} */ value, digits = 3) => Number(value.toFixed(digits));
const copy = (/** @type {any} */ value) => JSON.parse(JSON.stringify(value));

/** Half axes and direction (radians, as the page has them, y down) of a covariance a, b, c.  @param {number[]} covariance */
function axesOf([a, b, c]) {
  const middle = (a + c) / 2, off = Math.hypot((a - c) / 2, b);
  return [Math.sqrt(Math.max(middle + off, 0)), Math.sqrt(Math.max(middle - off, 0)), Math.atan2(2 * b, a - c) / 2];
}

function covarianceOf(/** @type {number[]} */ [one, two, angle]) {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [p, q] = [one * one, two * two];
  return [[p * cos * cos + q * sin * sin, (p - q) * cos * sin], [(p - q) * cos * sin, p * sin * sin + q * cos * cos]];
}

/** The controls of one number, word or list of a style.  @param {Knob} facts @param {any} value @param {(value: any) => void} changed @param {() => void} done */
function knob(facts, value, changed, done) {
  const { label } = facts, unit = facts.unit ? h('span', { class: 'inner' }, `, ${facts.unit}`) : '';
  if (facts.options) {
    const select = choice(facts.options.map(([one]) => String(one)), Object.fromEntries(facts.options.map(([one, said]) => [String(one), said])));
    select.value = String(value);
    select.addEventListener('change', () => { changed(facts.options?.[select.selectedIndex][0]); done(); });
    return field(label, select);
  }
  if (facts.count === 0) {
    const list = h('input', { value: value.join(', '), placeholder: 'none: curves stay', autocomplete: 'off' });
    list.addEventListener('change', () => { changed(list.value.split(/[,;\s]+/).filter(Boolean).map(Number)); done(); });
    return field(label, list);
  }
  const values = facts.count > 1 ? [...value] : [value];
  return h('div', { class: 'knob' }, values.map((/** @type {number} */ one, /** @type {number} */ at) => {
    const named = values.length > 1 ? `${label}, ${at ? 'second' : 'first'}` : label;
    const steps = (facts.high - facts.low) / 200;
    const range = h('input', { type: 'range', min: facts.low, max: facts.high, step: steps, value: one });
    const number = h('input', { type: 'number', min: facts.least, max: facts.most, step: 'any', value: tidy(one), class: 'inner', 'aria-label': `${named}, typed` });
    const take = (/** @type {number} */ now, /** @type {HTMLInputElement} */ other) => {
      if (!Number.isFinite(now)) return;
      values[at] = now; other.value = String(now);
      changed(facts.count > 1 ? [...values] : now);
    };
    range.addEventListener('input', () => take(tidy(Number(range.value)), number));
    number.addEventListener('input', () => { if (number.value !== '' && number.checkValidity()) take(Number(number.value), range); });
    for (const control of [range, number]) control.addEventListener('change', done);
    const row = field(unit ? [named, unit.cloneNode(true)] : named, range);
    row.append(number);
    return row;
  }));
}

/** @type {Show} */
export async function show(main, shared, [wanted]) {
  const before = await drafts.kept('style');
  let plan = /** @type {Plan} */ (before.plan || copy(FIRST)), style = /** @type {any} */ (null), facts = /** @type {any} */ (null), seed = before.seed || 1, unsaved = false;
  let picked = 0, view = /** @type {any} */ (null), fitted = true, adding = false, moving = false, photo = /** @type {any} */ (null), dragged = /** @type {any} */ (null);
  let answer = /** @type {{strokes: (Line & {t: number[]})[], samples: Line[][], ellipses: number[][], length_mm?: number}} */ ({ strokes: [], samples: [], ellipses: [] }), past = /** @type {string[]} */ ([]), future = /** @type {string[]} */ ([]), clean = '', opened = '', playing = 0;

  const refusal = refusals(), unkept = refusals();
  const told = h('p', { class: 'quiet', 'aria-live': 'polite' });
  const figures = h('p', { class: 'quiet inner' });
  const overlay = s('svg', { tabindex: 0, role: 'application', 'aria-label': 'Points; keys move the one that is chosen', 'aria-describedby': 'style-keys' });
  const ink = surface('', paintInk), graph = surface('Speed of the pen over time', paintSpeed), line = surface('The word in this style', paintWord);
  const stage = h('div', { class: 'stage-ink' }, ink.canvas, overlay);

  // what is drawn

  let laid = /** @type {DOMRect | null} */ (null); // where the overlay lies, for one frame: likewise
  function room() {
    if (!laid) { laid = overlay.getBoundingClientRect(); requestAnimationFrame(() => { laid = null; }); }
    return laid;
  }
  function scale() { return room().width / view.w; }

  function fit() {
    const { width, height } = room();
    if (!width) return;
    const [wide, high] = plan.page, by = Math.min(width / wide, height / high) * 0.96;
    view = { x: (wide - width / by) / 2, y: (high - height / by) / 2, w: width / by, h: height / by };
    fitted = true;
  }

  /** @type {Paint} */
  function paintInk(context, width) {
    if (!view) return;
    const by = width / view.w;
    context.scale(by, by); context.translate(-view.x, -view.y);
    context.fillStyle = getComputedStyle(stage).getPropertyValue('--sheet');
    context.fillRect(0, 0, ...plan.page);
    if (photo) {
      context.globalAlpha = photo.opacity;
      context.drawImage(photo.bitmap, photo.x, photo.y, photo.width, (photo.width * photo.bitmap.height) / photo.bitmap.width);
    }
    context.globalAlpha = 0.3; context.lineWidth = 1.3 / by;
    if (!playing && !dragged) for (const sample of answer.samples) draw(context, sample, FAINT);
    context.globalAlpha = photo ? 0.75 : 1; context.lineWidth = 2 / by;
    draw(context, answer.strokes, INK, playing ? (performance.now() - playing) / 1000 : Infinity);
    context.globalAlpha = 1;
  }

  /** @type {Paint} */
  function paintSpeed(context, width, height) {
    const strokes = answer.strokes, most = Math.max(1, ...strokes.flatMap((one) => one.speed)), last = Math.max(0.1, ...strokes.map((one) => one.t.at(-1) ?? 0));
    context.strokeStyle = getComputedStyle(stage).getPropertyValue('--accent');
    context.lineWidth = 1.6;
    for (const { t, speed } of strokes) {
      context.beginPath();
      t.forEach((at, i) => context[i ? 'lineTo' : 'moveTo'](4 + (at / last) * (width - 8), height - 3 - (speed[i] / most) * (height - 8)));
      context.stroke();
    }
    if (playing) {
      const at = 4 + Math.min((performance.now() - playing) / 1000 / last, 1) * (width - 8);
      context.beginPath(); context.moveTo(at, 0); context.lineTo(at, height); context.stroke();
    }
    figures.textContent = strokes.length ? `fastest ${Math.round(most)} mm/s · ${last.toFixed(2)} s · ${Math.round(answer.length_mm ?? 0)} mm` : '';
  }

  let shown = /** @type {any} */ (null);
  /** @type {Paint} */
  function paintWord(context, width, height) {
    if (shown) paintStrokes(context, width, height, shown.strokes);
  }

  const learned = () => Boolean(facts?.learned);

  /** The ellipse of a target as half axes and direction; none in a learned style.  @param {number} at */
  function ellipse(at) {
    if (learned()) return null;
    if (plan.own) return plan.own[at];
    return answer.ellipses[at] ? axesOf(answer.ellipses[at]) : null;
  }

  /** Ends of the axes that are dragged, far enough from the target to be told from it. */
  function handles() {
    if (!fine.checked) return [];
    const [x, y] = plan.targets[picked] || [], least = 26 / scale();
    return ends().map(([hx, hy]) => {
      const grip = Math.max(1, least / Math.max(Math.hypot(hx - x, hy - y), 1e-9));
      return [x + grip * (hx - x), y + grip * (hy - y)];
    });
  }
  /** Ends of the axes of an ellipse of its own, or of the basis that all share. */
  function ends() {
    const [x, y] = plan.targets[picked] || [], own = ellipse(picked);
    if (!own) return [];
    if (plan.own) return [0, 1].map((k) => [x + own[k] * Math.cos(own[2] + (k * Math.PI) / 2), y + own[k] * Math.sin(own[2] + (k * Math.PI) / 2)]);
    const [lengths, angles] = [style.values['covariance.axes'], style.values['covariance.angles'].map(rad)];
    const unit = Math.sqrt((own[0] * own[1]) / Math.abs(lengths[0] * lengths[1] * Math.sin(angles[1] - angles[0])));
    return [0, 1].map((k) => [x + unit * lengths[k] * Math.cos(angles[k]), y - unit * lengths[k] * Math.sin(angles[k])]);
  }

  function paintTargets() {
    if (!view || !(scale() > 0)) return;
    overlay.setAttribute('viewBox', `${view.x} ${view.y} ${view.w} ${view.h}`);
    const px = 1 / scale(), parts = [];
    const cuts = [...plan.up, plan.targets.length - 1];
    let from = 0;
    for (const to of cuts) { parts.push(s('polyline', { class: 'polygon', points: plan.targets.slice(from, to + 1).join(' ') })); from = to + 1; }
    plan.targets.forEach(([x, y], at) => {
      const own = ellipse(at), here = at === picked ? ' here' : '';
      if (own) parts.push(s('ellipse', { class: `spread${here}`, rx: Math.max(own[0], px), ry: Math.max(own[1], px), transform: `translate(${x} ${y}) rotate(${deg(own[2])})` }));
      parts.push(s('circle', { class: `target${here}${plan.up.includes(at) ? ' lifted' : ''}`, cx: x, cy: y, r: (at === picked ? 6.5 : 5) * px }));
      if (at === picked || plan.targets.length < 20) parts.push(s('text', { class: 'number', x: x + 8 * px, y: y - 8 * px, 'font-size': 11 * px }, String(at + 1)));
    });
    for (const [x, y] of handles()) {
      parts.push(s('line', { class: 'axis', x1: plan.targets[picked][0], y1: plan.targets[picked][1], x2: x, y2: y }));
      parts.push(s('rect', { class: 'handle', x: x - 5 * px, y: y - 5 * px, width: 10 * px, height: 10 * px }));
    }
    overlay.replaceChildren(...parts);
  }

  function paint() { ink.again(); paintTargets(); }

  // what is asked

  const sent = () => {
    const body = /** @type {any} */ ({ targets: plan.targets, pen_up: plan.up, page: { width: plan.page[0], height: plan.page[1] } });
    if (plan.own && !learned()) body.covariances = plan.own.map(covarianceOf);
    return body;
  };
  const draft = () => ({ name: style.name, values: style.values, ...(style.base ? { base: style.base } : {}) });

  let asking = false, again = false, waiting = 0, words = /** @type {AbortController | null} */ (null), written = '';
  /** The path anew: one question at a time, the newest state in it. */
  async function solve() {
    paintTargets();
    overlay.dataset.state = 'asked';
    if (asking) { again = true; return; }
    asking = true;
    do {
      again = false;
      const begin = performance.now();
      try {
        answer = await request('POST', '/api/movements', { plan: sent(), style: draft(), seed, samples: dragged ? 0 : Number(samples.value) || 0 });
        refusal.textContent = '';
        overlay.dataset.ms = String(performance.now() - begin);
      } catch (/** @type {any} */ error) {
        refusal.textContent = error.message;
      }
      paint(); graph.again();
      const [own, other] = [answer.strokes[0], answer.samples[0]?.[0]];
      still.hidden = !other || other.x.some((x, i) => Math.abs(x - own.x[i]) > 0.011);
    } while (again);
    asking = false;
    overlay.dataset.state = 'shown';
  }

  function soonWord() {
    const now = JSON.stringify([word.value, hand.value, style, seed]);
    if (now === written) return; // targets do not change it
    written = now;
    clearTimeout(waiting);
    waiting = setTimeout(async () => {
      words?.abort();
      const own = words = new AbortController();
      try {
        shown = await request('POST', '/api/movements/word', { text: word.value.trim() || 'minimum', hand: hand.value, style: draft(), seed }, own.signal);
        wordNote.textContent = shown.notes.join(' ');
      } catch (/** @type {any} */ error) {
        if (error.name === 'AbortError') return;
        shown = null; written = ''; wordNote.textContent = error.message;
      }
      line.again();
    }, 120);
  }

  // history

  const state = () => JSON.stringify({ plan, style, seed });
  function done() {
    const now = state();
    if (now === clean) return;
    past.push(clean); future = []; past = past.slice(-300); clean = now;
    changed();
  }
  const keep = (more_ = {}) => { const { bitmap, ...traced } = photo || {}; drafts.keep('style', { plan, style, seed, unsaved, ...(photo ? { photo: traced } : {}), ...more_ }, unkept); };
  function changed() {
    unsaved = true;
    keep();
    undo.disabled = !past.length; redo.disabled = !future.length;
    tell(); aboutTarget(); solve(); soonWord();
  }
  function step(/** @type {string[]} */ from, /** @type {string[]} */ to) {
    if (!from.length) return;
    to.push(clean);
    clean = from.pop() ?? clean;
    ({ plan, style, seed } = JSON.parse(clean));
    picked = clamp(picked, 0, Math.max(plan.targets.length - 1, 0));
    name.value = style.name;
    knobs(); changed();
  }

  // what is done to targets

  function tell() { told.textContent = `Point ${picked + 1} of ${plan.targets.length}${plan.up.includes(picked) ? ', the pen is lifted after it' : ''}`; }
  function pick(/** @type {number} */ at) {
    picked = clamp(at, 0, Math.max(plan.targets.length - 1, 0));
    tell(); aboutTarget(); paintTargets();
  }
  function add(/** @type {number[] | undefined} */ place = undefined) {
    const at = plan.targets.length ? picked + 1 : 0, [x, y] = plan.targets[picked] || [20, 50];
    const next = plan.targets[picked + 1];
    const where = place || (next ? [(x + next[0]) / 2, (y + next[1]) / 2] : [x + 10, y]);
    plan.targets.splice(at, 0, /** @type {Point} */ (where.map((one) => tidy(one, 2))));
    plan.up = plan.up.map((one) => (one >= at || (one === picked && !next) ? one + 1 : one));
    plan.own?.splice(at, 0, [...(plan.own[picked] || [3, 3, 0])]);
    picked = at;
  }
  function remove() {
    if (plan.targets.length < 2) return;
    plan.targets.splice(picked, 1); plan.own?.splice(picked, 1);
    plan.up = plan.up.filter((one) => one !== picked).map((one) => (one > picked ? one - 1 : one));
    pick(picked - (picked === plan.targets.length ? 1 : 0)); done();
  }
  function lift() {
    plan.up = plan.up.includes(picked) ? plan.up.filter((one) => one !== picked) : [...plan.up, picked].sort((a, b) => a - b);
    done();
  }
  function move(/** @type {number} */ x, /** @type {number} */ y) { plan.targets[picked] = [tidy(x, 2), tidy(y, 2)]; }

  /** The ellipses become larger, flatter and turned; those that are shared with the smoothing that goes with their size. */
  function reshape(/** @type {number} */ larger, /** @type {number} */ flatter, /** @type {number} */ turn) {
    if (learned() || !plan.targets.length) return;
    if (plan.own) {
      const [one, two, angle] = plan.own[picked];
      plan.own[picked] = [tidy(one * larger * flatter, 4), tidy((two * larger) / flatter, 4), tidy(angle - rad(turn), 5)];
    } else {
      const { values } = style, [one, two] = values['covariance.axes'];
      values['covariance.axes'] = [tidy(one * flatter), tidy(two / flatter)];
      values['covariance.angles'] = values['covariance.angles'].map((/** @type {number} */ angle) => tidy(((angle + turn + 180) % 360) - 180, 2));
      values['movement.smooth'] = tidy(clamp(values['movement.smooth'] * larger ** (1 / values['movement.order']), 0.05, 1), 4);
      knobs();
    }
    done();
  }

  function dragHandle(/** @type {number} */ k, /** @type {number[]} */ [x, y], /** @type {any} */ start) {
    const [dx, dy] = [x - plan.targets[picked][0], y - plan.targets[picked][1]], long = Math.max(Math.hypot(dx, dy), 0.05);
    if (plan.own) {
      const own = [...plan.own[picked]];
      own[k] = tidy((long / start.long) * start.own, 4); own[2] = tidy(Math.atan2(dy, dx) - (k * Math.PI) / 2, 5);
      plan.own[picked] = own;
      return;
    }
    const { values } = style, lengths = [...start.lengths], angles = [...start.angles];
    const turned = tidy(deg(Math.atan2(-dy, dx)), 2);
    if (Math.abs(Math.sin(rad(turned - angles[1 - k]))) > 0.1) angles[k] = turned;
    lengths[k] = tidy(clamp((long / start.long) * start.lengths[k], start.lengths[1 - k] / 50, start.lengths[1 - k] * 50), 4);
    const area = (/** @type {number[]} */ a, /** @type {number[]} */ b) => a[0] * a[1] * Math.abs(Math.sin(rad(b[1] - b[0])));
    const grown = Math.sqrt(area(lengths, angles) / area(start.lengths, start.angles));
    values['covariance.axes'] = lengths; values['covariance.angles'] = angles;
    values['movement.smooth'] = tidy(clamp(start.smooth * grown ** (1 / values['movement.order']), 0.05, 1), 4);
  }

  // pointers

  const pointers = new Map();
  const place = (/** @type {{clientX: number, clientY: number}} */ event) => {
    const box = room();
    return [view.x + (event.clientX - box.left) / scale(), view.y + (event.clientY - box.top) / scale()];
  };
  function zoom(/** @type {number} */ by, /** @type {number[]} */ [x, y] = [view.x + view.w / 2, view.y + view.h / 2]) {
    const wide = clamp(view.w * by, 10, 2000), real = wide / view.w;
    view = { x: x - (x - view.x) * real, y: y - (y - view.y) * real, w: wide, h: view.h * real };
    fitted = false;
    paint();
  }
  overlay.addEventListener('wheel', (event) => { event.preventDefault(); zoom(1.0015 ** event.deltaY, place(event)); }, { passive: false });
  overlay.addEventListener('pointerdown', (event) => {
    laid = null;
    overlay.focus({ preventScroll: true });
    overlay.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size > 1) { dragged = null; return; }
    const at = place(event), near = (NEAR[event.pointerType] || 10) / scale();
    const away = (/** @type {number[][]} */ points) => points.map(([x, y]) => Math.hypot(x - at[0], y - at[1]));
    const nearest = (/** @type {number[]} */ ways) => ways.reduce((best, way, i) => (way < near && (best < 0 || way < ways[best]) ? i : best), -1);
    const handle = moving ? -1 : nearest(away(handles())), target = moving ? -1 : nearest(away(plan.targets));
    if (handle >= 0 && (target < 0 || away(handles())[handle] < away(plan.targets)[target])) {
      const [x, y] = plan.targets[picked], [hx, hy] = handles()[handle], { values } = style;
      dragged = { handle, start: { long: Math.hypot(hx - x, hy - y), own: plan.own?.[picked][handle], lengths: values['covariance.axes'], angles: values['covariance.angles'], smooth: values['movement.smooth'] } };
    } else if (target >= 0) {
      pick(target);
      dragged = { off: [plan.targets[target][0] - at[0], plan.targets[target][1] - at[1]] };
    } else if (adding && !moving) {
      add(at); pick(picked);
      dragged = { off: [0, 0] };
      solve();
    }
  });
  overlay.addEventListener('pointermove', (event) => {
    const was = pointers.get(event.pointerId);
    if (!was) return;
    const now = [event.clientX, event.clientY], by = scale();
    pointers.set(event.pointerId, now);
    if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const apart = (/** @type {number[]} */ a, /** @type {number[]} */ b) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
      zoom(apart(was, other) / apart(now, other), place({ clientX: (now[0] + other[0]) / 2, clientY: (now[1] + other[1]) / 2 }));
    } else if (dragged) {
      const at = place(event);
      if (dragged.handle === undefined) move(at[0] + dragged.off[0], at[1] + dragged.off[1]);
      else dragHandle(dragged.handle, at, dragged.start);
      solve();
    } else if (moving && photo) {
      photo.x += (now[0] - was[0]) / by; photo.y += (now[1] - was[1]) / by;
      photoFields(); paint(); keep();
    } else {
      view.x -= (now[0] - was[0]) / by; view.y -= (now[1] - was[1]) / by;
      fitted = false;
      paint();
    }
  });
  const up = (/** @type {PointerEvent} */ event) => {
    if (!pointers.delete(event.pointerId) || !dragged) return;
    const shape = dragged.handle !== undefined;
    dragged = null;
    if (shape) knobs();
    done();
    if (state() === clean) solve();
  };
  overlay.addEventListener('pointerup', up);
  overlay.addEventListener('pointercancel', up);

  // keys

  /** @type {Record<string, () => void>} */
  const KEYS = {
    ',': () => pick(picked - 1), '.': () => pick(picked + 1), PageUp: () => pick(picked - 1), PageDown: () => pick(picked + 1),
    Home: () => pick(0), End: () => pick(plan.targets.length - 1),
    a: () => { add(); pick(picked); done(); }, Insert: () => { add(); pick(picked); done(); }, Delete: remove, Backspace: remove, u: lift,
    '+': () => reshape(1.1, 1, 0), '-': () => reshape(1 / 1.1, 1, 0), '}': () => reshape(1, 1.08, 0), '{': () => reshape(1, 1 / 1.08, 0),
    '[': () => reshape(1, 1, 5), ']': () => reshape(1, 1, -5),
  };
  overlay.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = ARROWS[event.key], act = KEYS[event.key];
    if (!arrow && !act) return;
    event.preventDefault();
    if (act) { act(); return; }
    const [x, y] = plan.targets[picked], far = event.shiftKey ? 5 : 0.5;
    move(x + arrow[0] * far, y + arrow[1] * far); done();
  });
  const keyed = (/** @type {any} */ event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches('input:not([type=range]), textarea, select')) return;
    if (event.key === 'z' && !event.shiftKey) { event.preventDefault(); step(past, future); }
    if (event.key === 'y' || (event.key === 'Z' && event.shiftKey)) { event.preventDefault(); step(future, past); }
  };
  document.addEventListener('keydown', keyed);

  // controls

  const button = (/** @type {string} */ label, /** @type {() => any} */ onclick, others = {}) => plain(label, onclick, false, others);
  const undo = button('Undo', () => step(past, future), { disabled: true }), redo = button('Redo', () => step(future, past), { disabled: true });
  const adder = button('Add a point', () => {
    adding = !adding;
    adder.setAttribute('aria-pressed', String(adding)); overlay.classList.toggle('adding', adding);
    say(adding ? 'A tap or click adds a point after the chosen one.' : 'Points are dragged again.');
  }, { 'aria-pressed': 'false', title: 'Add points by clicks' });
  const still = h('p', { class: 'quiet', hidden: true }, 'This style leaves nothing to chance: give it tremor, or uneven ellipses.');
  const samples = h('input', { type: 'number', min: 0, max: 12, value: 5 });
  samples.addEventListener('change', solve);
  const die = button('Another chance', () => { seed = Math.floor(Math.random() * 1e6); done(); });
  const watch = button('Watch it move', () => {
    playing = performance.now();
    const last = Math.max(0, ...answer.strokes.map((one) => one.t.at(-1) ?? 0)) * 1000;
    const frame = () => {
      if (playing && performance.now() - playing > last + 250) playing = 0;
      overlay.classList.toggle('playing', Boolean(playing));
      ink.again(); graph.again();
      if (playing) requestAnimationFrame(frame);
    };
    frame();
  });

  const aside = h('div', { class: 'target-fields' });
  function aboutTarget() {
    const target = plan.targets[picked];
    if (!target) { aside.replaceChildren(); return; }
    const own = plan.own?.[picked];
    const number = (/** @type {string} */ label, /** @type {number} */ value, /** @type {(value: number) => void} */ take) => {
      const control = h('input', { type: 'number', step: 'any', value: tidy(value, 2) });
      control.addEventListener('change', () => { if (control.value !== '') { take(Number(control.value)); done(); } });
      return field(label, control);
    };
    const rows = [number('Across, mm', target[0], (x) => move(x, target[1])), number('Down, mm', target[1], (y) => move(target[0], y))];
    if (own && !learned()) {
      rows.push(...['Long axis, mm', 'Short axis, mm'].map((label, k) => number(label, own[k], (/** @type {number} */ size) => { own[k] = Math.max(size, 0.05); })));
      rows.push(number('Direction, °', -deg(own[2]), (angle) => { own[2] = rad(-angle); }));
    }
    if (!aside.contains(document.activeElement)) aside.replaceChildren(...rows);
    lifting.setAttribute('aria-pressed', String(plan.up.includes(picked)));
    each.checked = Boolean(plan.own); eachLabel.hidden = hint.hidden = learned();
    hint.textContent = plan.own ? 'A larger ellipse may be cut by more; drag its black handles.' : 'The larger the ellipses, the rounder the path; drag the black handles of one.';
  }
  const lifting = button('Lift the pen after it', lift, { 'aria-pressed': 'false' });
  const [eachLabel, each] = tick('Each ellipse by itself', {});
  const hint = h('p', { class: 'quiet' });
  each.addEventListener('change', () => {
    plan.own = each.checked ? answer.ellipses.map((one) => axesOf(one).map((value) => tidy(value, 5))) : null;
    done();
  });

  const [fineLabel, fine] = tick('Show numbers, ellipses and the speed of the pen', { onchange: () => { shownFine(); paint(); graph.again(); } });
  const shownFine = () => main.classList.toggle('fine', fine.checked);
  const groups = h('div', { class: 'knobs' });
  function knobs() {
    const open = new Set([.../** @type {NodeListOf<HTMLElement>} */ (groups.querySelectorAll('details[open]'))].map((one) => one.dataset.name));
    if (groups.contains(document.activeElement)) return;
    const drawn = facts.groups.map((/** @type {{name: string, seen_in: string, knobs: Knob[]}} */ group, /** @type {number} */ at) => h(
      'details', { class: INNER.includes(group.name) ? 'inner' : undefined, open: groups.children.length ? open.has(group.name) : at === 0, 'data-name': group.name },
      h('summary', {}, group.name, group.seen_in === 'word' ? h('span', { class: 'quiet' }, ' – seen in the word') : ''),
      group.knobs.map((one) => knob(one, style.values[one.key] ?? one.usual, (value) => { style.values[one.key] = value; solve(); soonWord(); }, done)),
    ));
    groups.replaceChildren(...drawn);
  }

  const name = h('input', { autocomplete: 'off', pattern: '[\\w\\-]{1,80}', title: 'Letters, digits, - and _' });
  name.addEventListener('change', () => { if (name.value && name.checkValidity()) { style.name = name.value; done(); } else name.value = style.name; });
  const known = [...new Set([...shared.choices.styles, ...(wanted ? [wanted] : [])])];
  const chooser = choice(known);
  chooser.addEventListener('change', () => {
    if (unsaved && JSON.stringify(style.values) !== opened && !confirm(`Leave the changes of ${style.name}? They are not kept.`)) { chooser.value = facts.name; return; }
    unsaved = false; keep({ style: undefined }); location.hash = `style/${encodeURIComponent(chooser.value)}`;
  });
  async function keepIt() {
    const own = facts.own && style.name === facts.name, put = (/** @type {boolean} */ replace) => request('POST', '/api/styles', { style: draft(), replace });
    const inFile = async () => JSON.stringify((await request('GET', `/api/styles/${encodeURIComponent(facts.name)}`)).values);
    saveRefusal.textContent = refusal.textContent = '';
    try {
      const ask = own && (await inFile() === opened ? 'Write this style into its file?' : 'The file was changed elsewhere since it was opened here. Write over it?');
      if (own && !confirm(`${ask} Comments in the file are not kept.`)) return;
      await put(own).catch((error) => {
        if (!error.message.includes('already') || !confirm(`${error.message} Replace it?`)) throw error;
        return put(true);
      });
      if (own) opened = await inFile();
    } catch (/** @type {any} */ error) {
      saveRefusal.textContent = error.message;
      return;
    }
    unsaved = false; keep();
    say(own ? 'It is kept in its file.' : `It is kept: choose ${style.name} under Style on the page Write.`);
    shared.refresh();
  }
  const saveRefusal = refusals();
  const format = choice(Object.keys(FORMATS), FORMATS);
  format.setAttribute('aria-label', 'Format');
  const download = button('Download', async () => {
    try {
      const kind = format.value === 'toml' && learned() ? 'style' : format.value;
      if (kind === 'targets') save(new Blob([JSON.stringify(sent())], { type: 'application/json' }), `${style.name}-targets.json`);
      else save(await blob('/api/movements/file', '', 'POST', { plan: sent(), style: draft(), seed, format: kind }), `${style.name}.${kind}`);
      saveRefusal.textContent = '';
    } catch (/** @type {any} */ error) {
      saveRefusal.textContent = error.message;
    }
  });

  const word = h('input', { value: 'minimum', maxlength: 40, autocomplete: 'off' });
  const hand = handChoice(shared.choices.hands.filter((one) => one.drawn));
  hand.value = 'house-print';
  drafts.remember('word', { word, hand, samples, fine });
  shownFine();
  const wordNote = h('p', { class: 'quiet', 'aria-live': 'polite' });
  for (const control of [word, hand]) control.addEventListener('input', soonWord);
  function begin(/** @type {Plan} */ next) {
    plan = next; picked = 0;
    fit(); done(); pick(0);
  }
  const ofWord = button('Draw it below', async () => {
    try {
      const made = await request('POST', '/api/movements/targets', { text: word.value.trim() || 'minimum', hand: hand.value, style: draft() });
      begin({ targets: made.targets, up: made.pen_up, own: null, page: [made.page.width, made.page.height] });
    } catch (/** @type {any} */ error) {
      wordNote.textContent = error.message;
    }
  });
  const opener = picker('Points in a file', 'Drop it here: JSON, as it is saved here.', { accept: '.json' }, async ([file]) => {
    try {
      const read = JSON.parse(await file.text());
      if (!Array.isArray(read.targets) || !read.targets.length || read.targets.flat().some((/** @type {any} */ one) => !Number.isFinite(one))) throw new Error();
      const most = (/** @type {number} */ k) => Math.max(...read.targets.map((/** @type {Point} */ one) => one[k]));
      const page = /** @type {Point} */ (read.page ? [read.page.width, read.page.height] : [most(0) * 1.15 + 5, most(1) * 1.15 + 5]);
      begin({ targets: read.targets, up: read.pen_up || [], own: read.covariances?.map((/** @type {Point[]} */ [[a, b], [, c]]) => axesOf([a, b, c])) ?? null, page });
      refusal.textContent = read.references ? 'Its further references are left out.' : '';
    } catch {
      refusal.textContent = `${file.name} holds no points in JSON.`;
    }
  });

  const photoBox = h('div', { class: 'grid' });
  const photoInput = picker('Photograph', 'Drop it here: PNG, JPEG or WebP. It stays on this computer.', { accept: 'image/png,image/jpeg,image/webp' }, async ([file]) => {
    try {
      const bitmap = await createImageBitmap(file), id = await upload(file);
      if (photo) takeAway(photo.id);
      const [wide, high] = plan.page, width = Math.min(wide, (high * bitmap.width) / bitmap.height);
      photo = { bitmap, id, x: (wide - width) / 2, y: 0, width, opacity: 0.5 };
      refusal.textContent = '';
    } catch {
      photo = null;
      refusal.textContent = 'That picture cannot be shown: take a PNG, JPEG or WebP.';
    }
    photoFields(true); paint(); keep();
  });
  const [shiftLabel, shift] = tick('Drag the photograph', {});
  shift.addEventListener('change', () => { moving = shift.checked; });
  function photoFields(anew = false) {
    if (anew) {
      const one = (/** @type {string} */ label, /** @type {string} */ key, /** @type {object} */ attributes) => {
        const control = h('input', { 'data-key': key, ...attributes });
        control.addEventListener('input', () => { if (control.value !== '') { photo[key] = Number(control.value); paint(); keep(); } });
        return field(label, control);
      };
      photoBox.replaceChildren(...(photo ? [
        one('Opacity', 'opacity', { type: 'range', min: 0, max: 1, step: 0.05 }), one('Width, mm', 'width', { type: 'number', min: 1, step: 'any' }),
        one('From the left, mm', 'x', { type: 'number', step: 'any' }), one('From the top, mm', 'y', { type: 'number', step: 'any' }),
        h('div', { class: 'all row between' }, shiftLabel, button('Take it away', () => { takeAway(photo.id); photo = null; moving = shift.checked = false; photoFields(true); paint(); keep(); })),
      ] : []));
    }
    if (photo) for (const control of /** @type {NodeListOf<HTMLInputElement>} */ (photoBox.querySelectorAll('input[data-key]'))) if (control !== document.activeElement) control.value = String(tidy(photo[control.dataset.key ?? ''], 2));
  }

  const caps = (/** @type {string[]} */ [key, text]) => [h('kbd', {}, key), text];
  const keys = h('p', { class: 'quiet', id: 'style-keys' }, ...[[',', ' '], ['.', ' choose · '], ['arrows', ' move · '], ['A', ' add · '], ['Del', ' delete · '], ['U', ' lift the pen  ']].flatMap(caps), h('span', { class: 'inner' }, [['+', ' '], ['−', ' size, '], ['[', ' '], [']', ' turn, '], ['{', ' '], ['}', ' shape of the ellipse']].flatMap(caps)));
  main.append(h('div', { class: 'style' }, h(
    'section', { class: 'desk', 'aria-label': 'Points' },
    h('section', { class: 'word', 'aria-label': 'A word in this style' }, line.canvas, h('div', { class: 'row' }, field('Word', word), field('Handwriting', hand), ofWord), wordNote),
    h('div', { class: 'tools' }, undo, redo, adder, button('−', () => zoom(1.25), { class: 'icon', 'aria-label': 'Smaller' }), button('Fit', () => { fit(); paint(); }), button('+', () => zoom(0.8), { class: 'icon', 'aria-label': 'Larger' }), watch),
    stage, h('div', { class: 'beneath' }, h('div', { class: 'row between' }, told, figures), refusal, unkept, graph.canvas, more('Keys', keys)),
  ), h(
    'aside', { class: 'side', 'aria-label': 'Style' },
    h('h1', {}, 'How the pen moves'), h('p', { class: 'quiet' }, 'Move a slider and see the word change; drag the points to try it on a line of your own. Then keep it: every handwriting can be written in it.'),
    h('div', { class: 'row' }, h('div', { class: 'wide' }, field('Name', name)), plain('Keep the style', keepIt, true)), saveRefusal,
    h('section', {}, groups),
    h('section', {}, more('The chosen point', aside, h('div', { class: 'row' }, button('Add after it', KEYS.a), button('Delete', remove), lifting), h('div', { class: 'inner' }, eachLabel, hint)),
      h('div', { class: 'inner' }, more('Chance', h('div', { class: 'row' }, field('Faint samples', samples), die), still)), more('Trace a photograph', photoInput, photoBox),
      more('Files', h('div', { class: 'row' }, format, download), opener, h('div', { class: 'row after' }, button('Begin anew', () => begin(copy(FIRST)))))),
    h('section', {}, more('More', fineLabel), field('Another style', chooser), h('p', {}, h('a', { href: '#styles' }, 'All styles, side by side'))),
  )));

  const watcher = new ResizeObserver(() => {
    laid = null;
    const { width, height } = room();
    if (fitted) fit(); else if (width) view.h = (view.w * height) / width;
    paint(); graph.again(); line.again();
  });
  for (const element of [stage, line.canvas]) watcher.observe(element);
  const dark = matchMedia('(prefers-color-scheme: dark)'), repaint = () => { paint(); graph.again(); line.again(); };
  dark.addEventListener('change', repaint);

  const first = wanted || before.style?.name || 'calm';
  try {
    facts = await request('GET', `/api/styles/${encodeURIComponent(before.unsaved && !wanted ? before.style.base || before.opened || 'calm' : first)}`);
  } catch (/** @type {any} */ error) {
    if (wanted) throw error;
    facts = await request('GET', '/api/styles/calm');
  }
  opened = JSON.stringify(facts.values);
  style = { name: facts.name, base: facts.learned ? facts.name : '', values: facts.values };
  if (before.unsaved && before.style && before.style.name === (wanted || before.style.name) && Boolean(before.style.base) === facts.learned) {
    ({ style } = before);
    unsaved = true;
    if (wanted) say('Your changes of last time are here, not kept yet.');
  }
  if (before.photo) await blob(`/api/uploads/${before.photo.id}`).then(createImageBitmap).then((bitmap) => { photo = { ...before.photo, bitmap }; photoFields(true); }).catch(() => { refusal.textContent = 'The photograph is not here any more: give it again.'; });
  name.value = style.name; chooser.value = facts.name;
  clean = state();
  knobs(); fit(); pick(1); solve(); soonWord();
  return () => { playing = 0; clearTimeout(waiting); words?.abort(); watcher.disconnect(); dark.removeEventListener('change', repaint); document.removeEventListener('keydown', keyed); };
}
