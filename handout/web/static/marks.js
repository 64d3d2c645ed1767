// What lies over the page on Write: doubtful words framed, words to be written again, the block to be dragged and resized.

/** @import { Box, Doubt, Point, Word } from './types' */
import { ARROWS, s } from './dom.js';

const LEAST = 12; // mm that a block is wide and high at least
const HANDLE = 2.2; // mm
const round = (/** @type {number} */ value) => Math.round(value * 2) / 2;
const frame = (/** @type {Box} */ [x, y, right, low], /** @type {number} */ by) => ({ x: x - by, y: y - by, width: right - x + 2 * by, height: low - y + 2 * by, rx: 0.8 });

/**
 * The marks of a page. `mode` is 'words', 'block' or ''; `choose(word)` hears which word is chosen, `again(word)` and
 * `back(word)` that it is to be written again or as before; `began()` that the block is
 * dragged, `margins([top, right, bottom, left])` where it is.
 * @typedef {Word & {box: Box}} Placed
 * @param {{wide: number, high: number, mode: string, words: Placed[], doubts: (Doubt & {box: Box})[], chosen: number, margin: number[], choose: (word: Placed) => void, again: (word: Placed) => void,
 *   back: (word: Placed) => void, began: () => void, margins: (sides: number[]) => void}} page
 */
export function marks({ wide, high, mode, words, doubts, chosen, margin, choose, again, back, began, margins }) {
  const place = s('svg', { class: `marks ${mode}`, viewBox: `0 0 ${wide} ${high}`, 'aria-hidden': mode ? undefined : 'true' },
    doubts.map((one) => s('rect', { class: 'doubt', ...frame(one.box, 0.7) })));
  if (mode === 'words') wordly(place, words, { chosen, choose, again, back });
  if (mode === 'block') blockly(place, wide, high, margin, began, margins);
  return place;
}

function focusable(/** @type {SVGElement} */ place, /** @type {string} */ label, /** @type {(event: KeyboardEvent) => boolean} */ key) {
  place.setAttribute('tabindex', '0');
  place.setAttribute('role', 'group');
  place.setAttribute('aria-label', label);
  place.addEventListener('keydown', (event) => { if (key(event)) { event.preventDefault(); event.stopPropagation(); } });
}

function wordly(/** @type {SVGElement} */ place, /** @type {Placed[]} */ words, /** @type {{chosen: number, choose: (word: Placed) => void, again: (word: Placed) => void, back: (word: Placed) => void}} */ { chosen, choose, again, back }) {
  let at = Math.max(0, words.findIndex((word) => word.at === chosen));
  const boxes = words.map((word, number) => s('rect', {
    class: 'word', ...frame(word.box, 0.6),
    onclick: () => { select(number); again(words[number]); },
  }));
  function select(/** @type {number} */ number) {
    boxes[at]?.classList.remove('here');
    at = (number + words.length) % words.length;
    boxes[at].classList.add('here');
    choose(words[at]);
  }
  place.append(...boxes);
  boxes[at]?.classList.add('here');
  focusable(place, 'Words: arrows choose one, Enter writes it again, Backspace as it was', (event) => {
    if (!words.length) return false;
    if (event.key === 'ArrowRight' || event.key === 'ArrowDown') select(at + 1);
    else if (event.key === 'ArrowLeft' || event.key === 'ArrowUp') select(at - 1);
    else if (event.key === 'Enter' || event.key === ' ') again(words[at]);
    else if (event.key === 'Backspace' || event.key === 'Delete') back(words[at]);
    else return false;
    return true;
  });
}

function blockly(/** @type {SVGElement} */ place, /** @type {number} */ wide, /** @type {number} */ high, /** @type {number[]} */ margin, /** @type {() => void} */ began, /** @type {(sides: number[]) => void} */ margins) {
  let [top, right, bottom, left] = margin;
  const block = s('rect', { class: 'block' });
  const handles = [[0, 0], [1, 0], [0, 1], [1, 1]].map(([x, y]) => s('rect', { class: 'grip', width: 2 * HANDLE, height: 2 * HANDLE, 'data-x': x, 'data-y': y }));
  place.append(block, ...handles);
  function shown() {
    const [x, y, width, height] = [left, top, wide - left - right, high - top - bottom];
    for (const [name, value] of Object.entries({ x, y, width, height })) block.setAttribute(name, String(value));
    for (const grip of handles) {
      grip.setAttribute('x', String(x + Number(grip.dataset.x) * width - HANDLE));
      grip.setAttribute('y', String(y + Number(grip.dataset.y) * height - HANDLE));
    }
  }
  const within = (/** @type {number} */ value, /** @type {number} */ most) => Math.min(Math.max(round(value), 0), most);
  function move(/** @type {number} */ dx, /** @type {number} */ dy, from = [top, right, bottom, left]) {
    const x = within(from[3] + dx, from[3] + from[1]) - from[3], y = within(from[0] + dy, from[0] + from[2]) - from[0];
    [top, right, bottom, left] = [from[0] + y, from[1] - x, from[2] - y, from[3] + x];
    shown();
  }
  function size(/** @type {number} */ dx, /** @type {number} */ dy, /** @type {number} */ x, /** @type {number} */ y, from = [top, right, bottom, left]) {
    [top, right, bottom, left] = from;
    if (x) right = within(from[1] - dx, wide - left - LEAST); else left = within(from[3] + dx, wide - right - LEAST);
    if (y) bottom = within(from[2] - dy, high - top - LEAST); else top = within(from[0] + dy, high - bottom - LEAST);
    shown();
  }
  place.addEventListener('pointerdown', (event) => {
    const grip = handles.find((one) => one === event.target);
    if (!grip && event.target !== block) return;
    event.preventDefault();
    began();
    place.setPointerCapture(event.pointerId);
    const scale = wide / place.getBoundingClientRect().width, from = [top, right, bottom, left];
    const drag = (/** @type {PointerEvent} */ now) => {
      const dx = (now.clientX - event.clientX) * scale, dy = (now.clientY - event.clientY) * scale;
      if (grip) size(dx, dy, Number(grip.dataset.x), Number(grip.dataset.y), from); else move(dx, dy, from);
    };
    place.addEventListener('pointermove', drag);
    place.addEventListener('pointerup', () => { place.removeEventListener('pointermove', drag); margins([top, right, bottom, left]); }, { once: true });
  });
  focusable(place, 'The block: arrows move it by a millimetre, with Shift they make it wider, narrower, higher, lower', (event) => {
    const way = ARROWS[event.key];
    if (!way) return false;
    if (event.shiftKey) size(way[0], way[1], 1, 1); else move(...way);
    margins([top, right, bottom, left]);
    return true;
  });
  shown();
}

/** Where words that were at some places of a text are in it when it was changed; those that were changed are left out.  @param {Map<number, number>} places @param {string} before @param {string} after @returns {Map<number, number>} */
export function moved(places, before, after) {
  const [old, now] = [[...before], [...after]];
  let head = 0, tail = 0;
  while (head < Math.min(old.length, now.length) && old[head] === now[head]) head += 1;
  while (tail < Math.min(old.length, now.length) - head && old.at(-1 - tail) === now.at(-1 - tail)) tail += 1;
  const word = (/** @type {number} */ at) => { let end = at; while (end < old.length && /\S/.test(old[end])) end += 1; return end; };
  return new Map([...places].flatMap(/** @returns {Point[]} */ ([at, times]) => {
    if (word(at) < head || (word(at) === head && head < old.length && /\s/.test(now[head] ?? ' '))) return [[at, times]];
    return at >= old.length - tail && at > 0 ? [[at + now.length - old.length, times]] : [];
  }));
}
