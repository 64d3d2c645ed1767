// The picture of a page with its letters: moved, enlarged and drawn on, by mouse, pen, fingers or keys.

/** @import { Box, Point } from './types' */
/** @typedef {{id: number, letter: string, box: Box, spot: Point, ink: string, verdict: string, [more: string]: any}} Letter */
/** @typedef {{id: number, xy: Point[]}} Stroke */
/** @typedef {{kind: string, done: (points: Point[]) => void, width?: number, to?: string, closed?: boolean, start?: Point[]}} Pen */
import { blob } from './api.js';
import { ARROWS, s } from './dom.js';

const MOST_TILES = 80;
const LEVELS = 6;

/** @param {{box: Box}} letter @returns {Point} */
export const middle = ({ box: [x, y, right, low] }) => [(x + right) / 2, (y + low) / 2];
export const apart = (/** @type {Point} */ a, /** @type {Point} */ b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
const set = (/** @type {Element} */ element, /** @type {object} */ values) => { for (const [key, value] of Object.entries(values)) element.setAttribute(key, value); };
const line = (/** @type {Point[]} */ points) => `M${points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join('L')}`;

/**
 * picked(place, element) is told of a press.  A drawing is asked for by
 * `draw({ kind, width, done })`: kind "line" (two ends) or "path"; keys draw, too.
 * @param {string} url @param {any} facts @param {(place: Point, element: Element) => void} picked
 */
export function stage(url, facts, picked) {
  const tiles = s('g', {}), inks = s('g', {}), bases = s('g', { class: 'bases' }), written = s('g', { class: 'written' });
  const frame = s('rect', { class: 'frame', rx: 4 }), name = s('text', { 'aria-hidden': 'true' });
  const trail = s('path', { class: 'trail', fill: 'none' }), cross = s('path', { class: 'cross', visibility: 'hidden' });
  const svg = s('svg', { class: 'scan-view', tabindex: 0, role: 'application', 'aria-label': 'The page; keys correct the letter in the frame' }, tiles, inks, bases, frame, name, written, trail, cross);
  const view = { x: 0, y: 0, w: facts.width, h: facts.height };
  const there = new Map(), stale = new Map(), paths = new Map(), pointers = new Map();
  let wanted = /** @type {Pen | null} */ (null), way = /** @type {Point[]} */ ([]), moved = 0, pens = false, waiting = 0, cursor = /** @type {Point | null} */ (null), down = false, dragged = /** @type {string | null} */ (null), epoch = 0, on = /** @type {any} */ (null);

  function fetchTiles() {
    const { width: wide } = svg.getBoundingClientRect();
    const level = Math.max(0, Math.min(LEVELS, Math.floor(Math.log2(view.w / Math.max(wide * devicePixelRatio, 1)) + 0.2)));
    const side = facts.tile * 2 ** level;
    const last = [Math.ceil(facts.width / side) - 1, Math.ceil(facts.height / side) - 1];
    const from = [Math.max(0, Math.floor(view.x / side)), Math.max(0, Math.floor(view.y / side))];
    const to = [Math.min(last[0], Math.floor((view.x + view.w) / side)), Math.min(last[1], Math.floor((view.y + view.h) / side))];
    for (let row = from[1]; row <= to[1]; row += 1) {
      for (let column = from[0]; column <= to[0]; column += 1) {
        const key = `${level}/${column}/${row}`, mine = epoch;
        if (there.has(key)) { const had = there.get(key); there.delete(key); there.set(key, had); continue; }
        const image = s('image', { x: column * side - 0.5, y: row * side - 0.5 }); // places are from the middle of a pixel
        there.set(key, image);
        blob(`${url}/tiles/${facts.page}/${key}`).then(async (part) => {
          if (mine !== epoch || there.get(key) !== image) return;
          const bitmap = await createImageBitmap(part);
          set(image, { width: bitmap.width * 2 ** level + 0.5, height: bitmap.height * 2 ** level + 0.5, href: URL.createObjectURL(part) });
          bitmap.close();
          tiles.append(image);
          if (stale.has(key)) { drop(stale.get(key)); stale.delete(key); }
        }).catch(() => there.delete(key));
      }
    }
    for (const [key, image] of [...there].slice(0, Math.max(0, there.size - MOST_TILES))) { drop(image); there.delete(key); }
  }
  function drop(/** @type {Element} */ image) { if (image.getAttribute('href')) URL.revokeObjectURL(image.getAttribute('href') ?? ''); image.remove(); }

  function show() {
    svg.setAttribute('viewBox', `${view.x} ${view.y} ${view.w} ${view.h}`);
    clearTimeout(waiting);
    waiting = setTimeout(fetchTiles, 40);
  }
  const shape = () => { const { width, height } = svg.getBoundingClientRect(); return height ? width / height : 1.4; };
  const near = (/** @type {number} */ many) => facts.x_height * many * Math.max(1, 1 / shape());
  const bounded = (/** @type {number} */ high) => Math.max(40, Math.min(high, facts.height * 1.5));
  function look(/** @type {number[]} */ [x, y], high = view.h) {
    view.h = bounded(high); view.w = view.h * shape();
    view.x = x - view.w / 2; view.y = y - view.h / 2;
    show();
  }
  function zoom(/** @type {number} */ factor, /** @type {number[]} */ at = [view.x + view.w / 2, view.y + view.h / 2]) {
    const high = bounded(view.h * factor), by = high / view.h;
    view.x = at[0] - (at[0] - view.x) * by; view.y = at[1] - (at[1] - view.y) * by; view.w *= by; view.h = high;
    show();
  }
  /** @param {{clientX: number, clientY: number}} event @returns {Point} */
  function place(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM()?.inverse());
    return [point.x, point.y];
  }
  const unit = () => view.w / Math.max(svg.getBoundingClientRect().width, 1);
  /** @returns {Point} */
  const within = (/** @type {Point} */ [x, y]) => [Math.max(0, Math.min(x, facts.width - 1)), Math.max(0, Math.min(y, facts.height - 1))];

  function trace(/** @type {Point[]} */ points) {
    const shown = wanted?.kind === 'line' && points.length ? [points[0], points[points.length - 1]] : points;
    trail.setAttribute('d', shown.length ? line(shown) + (wanted?.closed ? 'Z' : '') : '');
  }
  function finish() {
    if (!wanted) return;
    const points = wanted.kind === 'line' ? [way[0], way[way.length - 1]] : way, { done } = wanted;
    const long = way.length > 1 && apart(points[0], points[points.length - 1]) + way.length > 4;
    way = []; down = false;
    if (long) done(points.map(within)); else trace([]);
  }

  const resized = new ResizeObserver(() => { if (view.w !== view.h * shape()) look([view.x + view.w / 2, view.y + view.h / 2]); });
  resized.observe(svg);
  svg.addEventListener('wheel', (event) => { event.preventDefault(); zoom(1.0015 ** event.deltaY, place(event)); }, { passive: false });
  svg.addEventListener('pointerdown', (event) => {
    if (event.button > 1) return;
    svg.setPointerCapture(event.pointerId);
    pens ||= event.pointerType === 'pen';
    pointers.set(event.pointerId, [event.clientX, event.clientY]); moved = 0;
    on = event.target;
    const handle = on.closest?.('[data-handle]');
    if (pointers.size > 1) { way = []; trace([]); dragged = null; }
    else if (handle) dragged = handle.dataset.handle;
    // where a pen draws, the hand that holds it lies on the glass: fingers move the page then
    else if (wanted && event.button === 0 && !(pens && event.pointerType === 'touch')) way = [place(event)];
  });
  svg.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = /** @type {Point} */ ([event.clientX, event.clientY]);
    if (dragged !== null && pointers.size === 1) {
      bases.dispatchEvent(new CustomEvent('drag', { detail: { handle: dragged, place: place(event) } }));
    } else if (way.length && pointers.size === 1) {
      for (const one of event.getCoalescedEvents?.() ?? [event]) way.push(place(one));
      trace(way);
    } else if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const centre = [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2], was = [(before[0] + other[0]) / 2, (before[1] + other[1]) / 2];
      zoom(apart(before, other) / Math.max(apart(now, other), 1), place({ clientX: centre[0], clientY: centre[1] }));
      view.x -= (centre[0] - was[0]) * unit(); view.y -= (centre[1] - was[1]) * unit();
      show();
    } else {
      view.x -= (now[0] - before[0]) * unit(); view.y -= (now[1] - before[1]) * unit();
      show();
    }
    moved += apart(before, now);
    pointers.set(event.pointerId, now);
  });
  const up = (/** @type {PointerEvent} */ event) => {
    if (!pointers.delete(event.pointerId)) return;
    if (dragged !== null) { dragged = null; bases.dispatchEvent(new CustomEvent('dropped')); return; }
    if (wanted && way.length) { if (event.type === 'pointerup') finish(); else { way = []; trace([]); } } else if (moved < 6 && event.type === 'pointerup') picked(place(event), on);
  };
  svg.addEventListener('pointerup', up);
  svg.addEventListener('pointercancel', up);

  /** Keys that draw: arrows move the cross, Space puts the pen down or lifts it, Enter ends.  Whether a key was one.  @param {KeyboardEvent} event */
  function keyed(event) {
    if (!wanted || !cursor) return false;
    const step = (event.shiftKey ? 10 : 2) * Math.max(unit(), 0.5), by = ARROWS[event.key];
    if (by) {
      cursor = [cursor[0] + step * by[0], cursor[1] + step * by[1]];
      if (down) { way.push(cursor); trace(way); }
      if (cursor[0] < view.x || cursor[0] > view.x + view.w || cursor[1] < view.y || cursor[1] > view.y + view.h) look(cursor);
    } else if (event.key === ' ') {
      down = true; way.push(cursor); trace(way);
    } else if (event.key === 'Enter' && way.length > 1) finish();
    else return false;
    crossed();
    return true;
  }
  function crossed() {
    cross.setAttribute('visibility', wanted && cursor ? 'visible' : 'hidden');
    if (!cursor) return;
    const arm = 10 * unit();
    cross.setAttribute('d', `M${cursor[0] - arm} ${cursor[1]}h${2 * arm}M${cursor[0]} ${cursor[1] - arm}v${2 * arm}`);
  }

  function inked(/** @type {Letter} */ letter, /** @type {number} */ index) {
    const path = paths.get(letter.id) || s('path', {});
    set(path, { class: `ink ${letter.verdict}${index % 2 ? ' odd' : ''}`, d: letter.ink || `M${letter.spot}h.1`, 'stroke-width': facts.x_height * 0.09 });
    paths.set(letter.id, path);
    return path;
  }
  return {
    svg, look, near, zoom, keyed, bases, written, view,
    /** All letters, or those of them that changed.  @param {Letter[]} all */
    letters(all, changed = all) {
      const gone = new Set(paths.keys()), fresh = new Set(changed.map((letter) => letter.id));
      all.forEach((letter, index) => {
        gone.delete(letter.id);
        if (fresh.has(letter.id) || !paths.has(letter.id)) inks.append(inked(letter, index));
      });
      for (const id of gone) { paths.get(id).remove(); paths.delete(id); }
    },
    frame(/** @type {Letter | undefined} */ letter) {
      inks.querySelector('.here')?.classList.remove('here');
      frame.setAttribute('visibility', letter ? 'visible' : 'hidden');
      name.textContent = letter ? letter.letter || '?' : '';
      if (!letter) return;
      paths.get(letter.id)?.classList.add('here');
      const [x, y, right, low] = letter.box, room = facts.x_height * 0.2;
      set(frame, { x: x - room, y: y - room, width: right - x + 2 * room, height: low - y + 2 * room });
      set(name, { x: (x + right) / 2, y: y - room * 1.5, 'font-size': facts.x_height * 0.8, 'stroke-width': facts.x_height * 0.12 });
      const [cx, cy] = middle(letter);
      if (cx < view.x + view.w * 0.1 || cx > view.x + view.w * 0.9 || cy < view.y + view.h * 0.15 || cy > view.y + view.h * 0.85) look([cx, cy], Math.min(view.h, near(12)));
    },
    /** Let something be drawn, from `cursor` on with keys; null: nothing any more.  @param {Pen | null} what @param {Point | null} [from] */
    draw(what, from = null) {
      wanted = what; way = []; down = false;
      cursor = what ? from : null;
      trace(what?.start || []);
      if (what?.start) way = [...what.start];
      set(trail, { 'stroke-width': what?.width || 1 });
      trail.classList.toggle('brush', Boolean(what?.width));
      trail.classList.toggle('paper', what?.kind === 'path' && what?.to === 'paper');
      trail.classList.toggle('loop', Boolean(what?.closed));
      svg.classList.toggle('cutting', Boolean(what));
      crossed();
    },
    /** The picture is another: it was painted. */
    repaint() {
      epoch += 1;
      for (const [key, image] of there) { if (stale.has(key)) drop(stale.get(key)); stale.set(key, image); }
      there.clear();
      fetchTiles();
      // what is not looked at now is fetched when it is
      for (const [key, image] of stale) if (!there.has(key)) { drop(image); stale.delete(key); }
    },
    forget() { epoch += 1; clearTimeout(waiting); resized.disconnect(); for (const image of [...there.values(), ...stale.values()]) drop(image); },
  };
}

/** Strokes in order: numbered, with an arrow each, drawn one after the other.  @param {Stroke[]} strokes @param {number} chosen @param {number} unit @param {boolean} calm */
export function strokesOf(strokes, chosen, unit, calm) {
  let after = 0;
  return strokes.map((stroke, index) => {
    const points = /** @type {Point[]} */ (stroke.xy.length > 1 ? stroke.xy : [stroke.xy[0], [stroke.xy[0][0] + 0.5, stroke.xy[0][1]]]);
    const long = points.slice(1).reduce((sum, point, k) => sum + apart(point, points[k]), 0) || 1;
    const path = s('path', { d: line(points), class: index === chosen ? 'stroke chosen' : 'stroke', 'stroke-width': unit * 0.07, pathLength: 1 });
    const near = points[Math.min(points.length - 1, Math.max(1, Math.round(points.length * 0.12)))], [x, y] = points[0];
    const turn = (Math.atan2(near[1] - y, near[0] - x) * 180) / Math.PI;
    const seconds = Math.min(1.2, Math.max(0.15, long / unit / 5));
    if (!calm) { path.style.animation = `draw ${seconds}s ${after}s linear both`; after += seconds + 0.12; }
    const arrow = s('path', { d: `M0 0l${-unit * 0.16} ${-unit * 0.09}v${unit * 0.18}z`, transform: `translate(${near[0]} ${near[1]}) rotate(${turn})`, class: 'arrow' });
    const label = s('text', { x, y: y - unit * 0.08, 'font-size': unit * 0.3, 'stroke-width': unit * 0.05 }, String(index + 1));
    return s('g', { 'data-stroke': index, class: index === chosen ? 'chosen' : '' }, s('path', { d: line(points), class: 'grip', 'stroke-width': unit * 0.35 }), path, arrow, label);
  });
}
