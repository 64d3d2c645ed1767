// The page Letters: what was found on a scanned page, corrected letter by letter, doubtful ones first, by keys or pointer.

import { blob, fileOf, request, task } from './api.js';
import { choice, field, h, s, say } from './dom.js';

const VERDICTS = { sure: 'sure', doubtful: 'doubtful', refused: 'probably wrong', unnamed: 'without a name', confirmed: 'confirmed' };
const NEAR = 6; // x-heights of a letter that fit into the height of the view when it is looked at
const MOST_TILES = 60;

const middle = ({ box: [x, y, right, low] }) => [(x + right) / 2, (y + low) / 2];
const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** The picture of a page and its letters, to be moved and enlarged. */
function stage(url, facts, picked, cut, outlined) {
  const tiles = s('g', {}), inks = s('g', {}), frame = s('rect', { class: 'frame', rx: 4 }), name = s('text', { 'aria-hidden': 'true' });
  const line = s('line', { class: 'cutline' }), loop = s('polygon', { class: 'cutline' });
  const svg = s('svg', { class: 'scan-view', tabindex: 0, role: 'application', 'aria-label': 'The page; keys correct the letter in the frame' }, tiles, inks, frame, name, line, loop);
  const view = { x: 0, y: 0, w: facts.width, h: facts.height };
  const there = new Map();
  let drawing = null, cutting = null, looping = false, pointers = new Map(), moved = 0;
  line.setAttribute('visibility', 'hidden');

  function fetchTiles() {
    const { width: wide } = svg.getBoundingClientRect();
    const level = Math.max(0, Math.min(4, Math.floor(Math.log2(view.w / Math.max(wide * devicePixelRatio, 1)) + 0.2)));
    const side = facts.tile * 2 ** level;
    const last = [Math.ceil(facts.width / side) - 1, Math.ceil(facts.height / side) - 1];
    const from = [Math.max(0, Math.floor(view.x / side)), Math.max(0, Math.floor(view.y / side))];
    const to = [Math.min(last[0], Math.floor((view.x + view.w) / side)), Math.min(last[1], Math.floor((view.y + view.h) / side))];
    for (let row = from[1]; row <= to[1]; row += 1) {
      for (let column = from[0]; column <= to[0]; column += 1) {
        const key = `${level}/${column}/${row}`;
        if (there.has(key)) continue;
        const image = s('image', { x: column * side, y: row * side });
        there.set(key, image);
        blob(`${url}/tiles/${facts.page}/${key}`).then(async (part) => {
          const bitmap = await createImageBitmap(part);
          image.setAttribute('width', bitmap.width * 2 ** level + 0.5); image.setAttribute('height', bitmap.height * 2 ** level + 0.5);
          image.setAttribute('href', URL.createObjectURL(part));
          tiles.append(image);
        }).catch(() => there.delete(key));
      }
    }
    for (const [key, image] of [...there].slice(0, Math.max(0, there.size - MOST_TILES))) {
      URL.revokeObjectURL(image.getAttribute('href')); image.remove(); there.delete(key);
    }
  }

  let waiting = 0;
  function show() {
    svg.setAttribute('viewBox', `${view.x} ${view.y} ${view.w} ${view.h}`);
    clearTimeout(waiting);
    waiting = setTimeout(fetchTiles, 60);
  }
  function shape() { const { width, height } = svg.getBoundingClientRect(); return height ? width / height : 1.4; }
  function look([x, y], high = view.h) {
    view.h = Math.max(40, Math.min(high, facts.height * 1.5)); view.w = view.h * shape();
    view.x = x - view.w / 2; view.y = y - view.h / 2;
    show();
  }
  function place(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [point.x, point.y];
  }
  function zoom(factor, at = [view.x + view.w / 2, view.y + view.h / 2]) {
    const high = Math.max(40, Math.min(view.h * factor, facts.height * 1.5)), by = high / view.h;
    view.x = at[0] - (at[0] - view.x) * by; view.y = at[1] - (at[1] - view.y) * by; view.w *= by; view.h = high;
    show();
  }

  svg.addEventListener('wheel', (event) => { event.preventDefault(); zoom(1.0015 ** event.deltaY, place(event)); }, { passive: false });
  svg.addEventListener('pointerdown', (event) => {
    svg.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]); moved = 0;
    if (cutting) drawing = [place(event), place(event)];
    else if (looping) drawing = [place(event)];
  });
  svg.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], scale = view.w / svg.getBoundingClientRect().width;
    if (drawing && looping) {
      drawing.push(place(event));
      loop.setAttribute('points', drawing.join(' '));
    } else if (drawing) {
      drawing[1] = place(event);
      drawLine(...drawing);
    } else if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      zoom(apart(before, other) / Math.max(apart(now, other), 1), place({ clientX: (now[0] + other[0]) / 2, clientY: (now[1] + other[1]) / 2 }));
    } else {
      view.x -= (now[0] - before[0]) * scale; view.y -= (now[1] - before[1]) * scale;
      show();
    }
    moved += apart(before, now);
    pointers.set(event.pointerId, now);
  });
  const up = (event) => {
    if (!pointers.delete(event.pointerId)) return;
    const way = drawing;
    drawing = null;
    if (looping && way) { if (way.length > 2) outlined(way); } else if (way && apart(...way) > 3) cut(...way);
    else if (moved < 5 && event.type === 'pointerup') picked(place(event));
  };
  svg.addEventListener('pointerup', up);
  svg.addEventListener('pointercancel', up);

  function drawLine(a, b) {
    line.setAttribute('visibility', 'visible');
    for (const [key, value] of Object.entries({ x1: a[0], y1: a[1], x2: b[0], y2: b[1] })) line.setAttribute(key, value);
  }
  return {
    svg, look, zoom,
    draw(letters) {
      inks.replaceChildren(...letters.map((letter, index) => s('path', { class: `ink ${letter.verdict}${index % 2 ? ' odd' : ''}`, d: letter.ink || `M${letter.spot}h.1`, 'stroke-width': facts.x_height * 0.09 })));
    },
    frame(letter, index) {
      for (const [at, path] of [...inks.children].entries()) path.classList.toggle('here', at === index);
      frame.toggleAttribute('visibility', false);
      if (!letter) { frame.setAttribute('visibility', 'hidden'); name.textContent = ''; return; }
      const [x, y, right, low] = letter.box, room = facts.x_height * 0.2;
      for (const [key, value] of Object.entries({ x: x - room, y: y - room, width: right - x + 2 * room, height: low - y + 2 * room })) frame.setAttribute(key, value);
      name.textContent = letter.letter || '?';
      for (const [key, value] of Object.entries({ x: (x + right) / 2, y: y - room * 1.5, 'font-size': facts.x_height * 0.8, 'stroke-width': facts.x_height * 0.12 })) name.setAttribute(key, value);
      const [cx, cy] = middle(letter);
      if (cx < view.x + view.w * 0.1 || cx > view.x + view.w * 0.9 || cy < view.y + view.h * 0.15 || cy > view.y + view.h * 0.85) look([cx, cy], Math.min(view.h, facts.x_height * NEAR * 2));
    },
    cutting(way) {
      cutting = way;
      svg.classList.toggle('cutting', Boolean(way));
      if (way) drawLine(...way); else line.setAttribute('visibility', 'hidden');
    },
    looping(on) {
      looping = on;
      svg.classList.toggle('cutting', on);
      loop.setAttribute('points', '');
    },
    forget() { clearTimeout(waiting); for (const image of there.values()) URL.revokeObjectURL(image.getAttribute('href')); },
  };
}

function chooser(hands, name) {
  const select = choice(['', ...hands.map((hand) => hand.name)], { '': 'Choose a hand' });
  select.value = name || '';
  select.addEventListener('change', () => { if (select.value) location.hash = `letters/${encodeURIComponent(select.value)}`; });
  return field('Hand', select);
}

function greeting(hands) {
  return h('div', { class: 'middle' }, h('h1', {}, 'Letters'), h('p', {}, 'Look through the letters of a hand from paper, and put right what was read wrongly. The program learns from it.'), chooser(hands, ''));
}

function copying(hands, name, shared) {
  const button = h('button', {
    type: 'button', class: 'main',
    async onclick() {
      try {
        const made = await request('POST', `/api/hands/${name}/copy`);
        await shared.refresh();
        location.hash = `letters/${made.name}`;
      } catch (error) { say(error.message); }
    },
  }, 'Make a copy of my own');
  return h('div', { class: 'middle' }, h('h1', {}, name), chooser(hands, name), h('p', {}, 'This hand comes with the program. To correct its letters, make a copy of your own.'), button);
}

export async function show(main, shared, [name, number = '0']) {
  const hands = shared.choices.hands.filter((hand) => !hand.drawn);
  const hand = hands.find((one) => one.name === name);
  if (!hand) { main.append(greeting(hands)); return null; }
  if (!hand.own) { main.append(copying(hands, name, shared)); return null; }

  const url = `/api/hands/${name}`, page = Number(number) || 0;
  let facts = await request('GET', `${url}/letters`);
  let { letters } = await request('GET', `${url}/letters/${page}`);
  let at = 0, way = null, encircling = false, chain = Promise.resolve(), pending = 0;
  const skipped = new Set();

  const title = h('p', { class: 'big', 'aria-live': 'polite' }), about = h('p', { class: 'quiet' });
  const left = h('p', {}), refusal = h('p', { class: 'bad', role: 'alert' }), kept = h('p', { class: 'quiet', 'aria-live': 'polite' });
  const input = h('input', { autocomplete: 'off', autocapitalize: 'off', spellcheck: 'false', maxlength: 8 });
  const view = stage(url, { ...facts.pages[page], page, tile: facts.tile }, pick, (a, b) => cutAt(a, b), (within) => outline(within));

  const spot = () => letters[at].spot;
  const doubts = () => letters.map((letter, index) => [letter, index]).filter(([letter]) => !['sure', 'confirmed'].includes(letter.verdict)).sort(([a], [b]) => a.probability - b.probability);

  function choose(index) {
    at = Math.max(0, Math.min(index, letters.length - 1));
    const letter = letters[at];
    view.frame(letter, at);
    if (!letter) return;
    title.textContent = letter.letter || '?';
    input.value = letter.letter;
    const sure = letter.verdict === 'confirmed' || letter.verdict === 'unnamed' ? '' : ` (${Math.round(letter.probability * 100)} %)`;
    about.textContent = `${VERDICTS[letter.verdict]}${sure}; ${letter.word ? `in “${letter.word}”, ` : ''}line ${letter.line + 1}${letter.joined ? ', joined to the next' : letter.linked ? ', next to another' : ''}`;
    tell();
  }

  function tell() {
    const count = doubts().length;
    left.textContent = count ? `${count} of ${letters.length} letters are doubtful.` : `None of ${letters.length} letters is doubtful.`;
    pages.options[page].textContent = `${page + 1}: ${count} doubtful of ${letters.length}`;
    undo.disabled = !facts.made; redo.disabled = facts.made >= facts.entries;
    link.firstChild.textContent = letters[at]?.joined ? 'Unlink' : 'Link';
    kept.textContent = pending ? 'Keeping …' : facts.made ? `${facts.made} ${facts.made === 1 ? 'correction is' : 'corrections are'} kept.` : '';
  }

  function nextDoubt() {
    skipped.add(String(spot()));
    const others = doubts().filter(([letter]) => !skipped.has(String(letter.spot)));
    if (others.length) choose(others[0][1]);
    else { skipped.clear(); const again = doubts(); if (again.length) choose(again[0][1]); else tell(); }
  }

  function pick([x, y]) {
    const inside = ({ box: [l, t, r, b] }) => x > l - 3 && x < r + 3 && y > t - 3 && y < b + 3;
    const order = letters.map((letter, index) => [inside(letter) ? 0 : 1e4, apart(middle(letter), [x, y]), index]).sort((a, b) => a[0] + a[1] - b[0] - b[1]);
    if (order.length && order[0][0] + order[0][1] < 1e4 + 3 * facts.pages[page].x_height) choose(order[0][2]);
    view.svg.focus();
  }

  function renewed(answer, found, near) {
    facts = answer; letters = found;
    const best = letters.map((letter, index) => [apart(letter.spot, near), index]).sort((a, b) => a[0] - b[0])[0];
    view.draw(letters);
    choose(best ? best[1] : 0);
  }

  /** Changes are sent one after the other; what is looked at meanwhile may be another letter already. */
  function change(path, body, unnamed = false) {
    pending += 1; tell();
    refusal.textContent = '';
    chain = chain.then(async () => {
      try {
        const answer = await request('POST', `${url}/${path}`, { revision: facts.revision, ...body() });
        const found = (await request('GET', `${url}/letters/${page}`)).letters;
        pending -= 1;
        const near = spot();
        renewed(answer, found, near);
        if (unnamed) {
          const blank = letters.map((letter, index) => [letter.verdict === 'unnamed' ? apart(letter.spot, near) : Infinity, index]).sort((a, b) => a[0] - b[0])[0];
          if (blank && blank[0] < Infinity) choose(blank[1]);
        }
        for (const note of answer.notes || []) say(note);
      } catch (error) {
        pending -= 1;
        refusal.textContent = error.message;
        const near = spot();
        renewed(await request('GET', `${url}/letters`), (await request('GET', `${url}/letters/${page}`)).letters, near);
      }
    }).catch((error) => { refusal.textContent = error.message; });
    return chain;
  }

  const correct = (...corrections) => {
    const fixed = corrections.map((one) => ({ page, ...one }));
    return change('corrections', () => ({ corrections: fixed }), corrections[0].do === 'split');
  };

  function confirmLetter() {
    if (!letters[at].letter) { refusal.textContent = 'This has no name yet: type its letter.'; return; }
    correct({ do: 'confirm', at: spot() });
    letters[at] = { ...letters[at], verdict: 'confirmed', probability: 1 };
    nextDoubt();
  }
  function label(text) {
    if (!text.trim()) return;
    correct({ do: 'label', at: spot(), text: text.trim() });
    letters[at] = { ...letters[at], letter: text.trim(), verdict: 'confirmed', probability: 1 };
    nextDoubt();
  }
  function removeLetter() { correct({ do: 'remove', at: spot() }); }
  function joinNext() {
    const next = letters[at + 1];
    if (!next || next.line !== letters[at].line) { refusal.textContent = 'There is no letter after it on its line.'; return; }
    correct({ do: 'merge', at: spot(), other: next.spot });
  }
  function linkNext() {
    const next = letters[at + 1];
    if (letters[at].joined) correct({ do: 'unlink', at: spot() });
    else if (next) correct({ do: 'link', at: spot(), other: next.spot });
  }
  function cutAt(a, b) { stopCut(); correct({ do: 'split', a, b }); }
  function stopCut() { way = null; encircling = false; view.cutting(null); view.looping(false); hint.textContent = HINT; }
  function beginOutline() {
    encircling = true;
    view.looping(true);
    hint.textContent = `Draw around all ink of “${letters[at].letter}” and of nothing else; Esc leaves it.`;
  }
  function outline(within) {
    const { letter } = letters[at], step = Math.ceil(within.length / 60);
    stopCut();
    if (letter) correct({ do: 'outline', within: within.filter((_, index) => index % step === 0).map(([x, y]) => [Math.round(x), Math.round(y)]), text: letter });
    else refusal.textContent = 'This has no name yet: type its letter.';
  }
  function beginCut() {
    const { box: [x, y, right, low] } = letters[at], lean = facts.pages[page].slant * (low - y) / 2, over = facts.pages[page].x_height * 0.2;
    const cx = (x + right) / 2;
    way = [[cx + lean, y - over], [cx - lean, low + over]];
    view.cutting(way);
    hint.textContent = 'Draw the cut, or move it with ← and →, tilt it with ↑ and ↓; Enter cuts, Esc leaves it.';
    view.svg.focus();
  }
  function moveCut(key, step) {
    const by = { ArrowLeft: [-step, -step], ArrowRight: [step, step], ArrowUp: [step, -step], ArrowDown: [-step, step] }[key];
    way = way.map(([x, y], end) => [x + by[end], y]);
    view.cutting(way);
  }
  const back = (count) => change('history', () => ({ back: count }));

  const key = (text) => h('kbd', {}, text);
  const act = (text, keys, work) => h('button', { type: 'button', onclick: () => { work(); view.svg.focus(); } }, h('span', {}, text), key(keys));
  const undo = act('Undo', 'Ctrl+Z', () => back(1)), redo = act('Redo', 'Ctrl+Y', () => back(-1));
  const link = act('Link', 'Alt+L', linkNext);
  const HINT = 'Enter confirms, a key names the letter anew, ↓ goes to the next doubtful one, ← and → to the letters beside.';
  const hint = h('p', { class: 'quiet' }, HINT);

  view.svg.addEventListener('keydown', (event) => {
    const { key: pressed } = event;
    const done = () => { event.preventDefault(); return true; };
    if (way) {
      if (pressed === 'Escape' && done()) stopCut();
      else if (pressed === 'Enter' && done()) cutAt(...way);
      else if (pressed.startsWith('Arrow') && done()) moveCut(pressed, event.shiftKey ? 8 : 2);
      return;
    }
    if (encircling && pressed === 'Escape' && done()) stopCut();
    else if (event.altKey) {
      const work = { KeyC: beginCut, KeyJ: joinNext, KeyL: linkNext, KeyO: beginOutline }[event.code];
      if (work && done()) work();
    } else if (event.ctrlKey || event.metaKey) {
      if (pressed.toLowerCase() === 'z' && done()) back(event.shiftKey ? -1 : 1);
      else if (pressed.toLowerCase() === 'y' && done()) back(-1);
    } else if (pressed === 'Enter' && done()) confirmLetter();
    else if ((pressed === 'Delete' || pressed === 'Backspace') && done()) removeLetter();
    else if (pressed === 'ArrowRight' && done()) choose(at + 1);
    else if (pressed === 'ArrowLeft' && done()) choose(at - 1);
    else if (pressed === 'ArrowDown' && done()) nextDoubt();
    else if ([...pressed].length === 1 && pressed !== ' ' && done()) label(pressed);
  });

  const pages = choice(facts.pages.map((_, index) => String(index)), Object.fromEntries(facts.pages.map((one, index) => [index, `${index + 1}: ${one.doubtful} doubtful of ${one.letters}`])));
  pages.value = String(page);
  pages.addEventListener('change', () => { location.hash = `letters/${encodeURIComponent(name)}/${pages.value}`; });

  const bar = h('progress', { max: 1, value: 0, 'aria-label': 'Progress' }), step = h('span', { class: 'quiet' });
  const work = h('div', { class: 'work', hidden: true }, step, bar);
  const heard = (snapshot) => { work.hidden = false; bar.value = snapshot.share; step.textContent = snapshot.state === 'waiting' ? 'waiting' : snapshot.stage; };
  const learning = h('button', {
    type: 'button',
    async onclick() {
      learning.disabled = true;
      await chain;
      try {
        const { facts: learnt } = await task(`${url}/learning`, { revision: facts.revision }, heard);
        renewed(learnt, (await request('GET', `${url}/letters/${page}`)).letters, spot());
        say(learnt.changed ? `${learnt.changed} other letters were found anew.` : 'All other letters stay as they were.');
      } catch (error) { refusal.textContent = error.message; } finally { learning.disabled = false; work.hidden = true; }
    },
  }, 'Learn from the corrections');

  const line = h('input', { value: 'a quick look at it', maxlength: 80 }), written = h('figure', { class: 'sheet' });
  const trying = h('form', {
    'aria-label': 'A line in the hand as it is now',
    async onsubmit(event) {
      event.preventDefault();
      await chain;
      try {
        const done = await task('/api/write', { text: line.value, hand: name, page: '100x20mm', margin: '4mm', format: 'png', dpi: 150, fit: true, fallback: true, seed: 1 }, heard);
        const source = URL.createObjectURL(await blob(fileOf(done)));
        written.replaceChildren(h('img', { src: source, alt: line.value }));
      } catch (error) { refusal.textContent = error.message; } finally { work.hidden = true; }
    },
  }, field('A line in the hand as it is now', line), h('div', { class: 'row after' }, h('button', {}, 'Write it')), written);

  const naming = h('form', { 'aria-label': 'Name the letter', onsubmit(event) { event.preventDefault(); label(input.value); view.svg.focus(); } },
    h('div', { class: 'row' }, h('div', { class: 'wide' }, field('Its letter', input)), h('button', {}, 'Name it')));
  main.append(h('div', { class: 'letters' },
    h('h1', { class: 'hidden' }, `Letters of ${name}`),
    h('section', { class: 'stage', 'aria-label': 'The page' },
      h('div', { class: 'tools' }, hint, h('span', { class: 'joined push' }, h('button', { type: 'button', class: 'icon', 'aria-label': 'Larger', onclick: () => view.zoom(0.7) }, '+'), h('button', { type: 'button', class: 'icon', 'aria-label': 'Smaller', onclick: () => view.zoom(1.4) }, '−'))),
      view.svg),
    h('aside', { class: 'side', 'aria-label': 'The letter' }, chooser(hands, name), field('Page', pages), left, h('div', {}, title, about), refusal, naming,
      h('div', { class: 'keys' }, act('Confirm', 'Enter', confirmLetter), act('Next', '↓', nextDoubt), act('Cut', 'Alt+C', beginCut), act('Outline', 'Alt+O', beginOutline), act('Join', 'Alt+J', joinNext), act('No letter', 'Del', removeLetter), link, undo, redo),
      kept, learning, work, trying)));
  view.draw(letters);
  const first = doubts()[0];
  view.look(first ? middle(first[0]) : [facts.pages[page].width / 2, facts.pages[page].height / 4], facts.pages[page].x_height * NEAR * 2);
  choose(first ? first[1] : 0);
  view.svg.focus();
  return () => view.forget();
}
