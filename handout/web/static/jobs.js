// The page Plotter: what waits for a plotter, how it lies on the bed, where the pen is.

/** @import { Machines, Place, Plot, Show, Snapshot } from './types' */
/** @typedef {Plot & {lies: NonNullable<Plot['lies']>}} Laid */
/** @typedef {{layer: string, pen: string, speed: number, out: boolean}} Turn */
/** @typedef {(quarters: number, x: number, y: number) => Promise<void>} Lay */
import { follow, request, task, text as fetched } from './api.js';
import { remember } from './drafts.js';
import { address, ARROWS, button, choice, field, guarded, h, inkName, machine as chosenMachine, more, plotState, portChoice, refusal as refusals, s, say, tick, titled } from './dom.js';
import { alike, inOrder, writtenTo } from './replay.js';
import { drawing } from './work.js';

const STEPS = { 1: '1 mm', 10: '10 mm', 50: '50 mm' };
const keep = (/** @type {object} */ values) => localStorage.setItem('handout-machine', JSON.stringify({ ...chosenMachine(), ...values }));
const PEN = ['Ink', 'Pen', 'Speed', 'Draw it', 'Line', 'Takes', 'State'];
const UNCHOSEN = 'Choose first where the plotter is connected; or the simulated one, which puts nothing on paper.';
const minutes = (/** @type {number} */ seconds) => (!seconds ? '–' : seconds < 90 ? `${seconds} s` : seconds < 5400 ? `${Math.round(seconds / 60)} min` : `${(seconds / 3600).toFixed(1)} h`);
const HEX = /#[0-9a-f]{6}\b/gi;
const metres = (/** @type {number} */ mm) => `${(mm / 1000).toFixed(2)} m`;
/** What it is called: its first words, whole ones. */
const named = (/** @type {Plot} */ { title = '', job }) => (title.length > 36 ? `${title.replace(/\s+\S*$/, '')} …` : title) || job;

/** The machine: its port, and its pen moved by hand.  @param {Machines} machines */
function machine(machines) {
  const port = portChoice(machines.ports), device = titled(machines.plotters);
  const before = chosenMachine();
  if (before.port && machines.ports.some((one) => one.name === before.port)) port.value = before.port;
  if (machines.plotters.some((one) => one.name === before.device)) device.value = before.device;
  const step = choice(Object.keys(STEPS), STEPS);
  step.value = '10';
  const refusal = refusals();
  const found = h('p', { class: 'quiet', 'aria-live': 'polite' });
  async function move(/** @type {any} */ event, /** @type {object} */ body) {
    const buttons = event.target.closest('details').querySelectorAll('button');
    refusal.textContent = port.value ? '' : UNCHOSEN;
    if (!port.value) return;
    for (const button of buttons) button.disabled = true;
    try {
      const { facts } = await request('POST', '/api/pen', { port: port.value, device: device.value, ...body });
      found.textContent = `${facts.done[0].toUpperCase()}${facts.done.slice(1)}${facts.position ? `; it stands at ${facts.position.join(', ')} mm` : ''}.`;
    } catch (/** @type {any} */ error) {
      refusal.textContent = error.message;
    } finally {
      for (const button of buttons) button.disabled = false;
      event.target.focus();
    }
  }
  /** Ask who is there, and choose its machine.  @param {any} event */
  async function ask(event) {
    const asked = port.value;
    if (!asked) { refusal.textContent = UNCHOSEN; return; }
    refusal.textContent = ''; found.textContent = 'Asking …'; event.target.disabled = true;
    try {
      const { facts } = await request('POST', '/api/machines/asked', { port: asked });
      const [profile] = /** @type {string[]} */ (facts.profiles || []).filter((name) => machines.plotters.some((one) => one.name === name));
      if (profile) { port.value = asked; device.value = profile; keep({ port: asked, device: profile }); }
      found.textContent = `${facts.title || facts.firmware || facts.dialect} answers${profile ? ': its machine is chosen' : '; choose its machine'}. Nothing has moved.`;
    } catch (/** @type {any} */ error) {
      refusal.textContent = error.message; found.textContent = '';
    }
    event.target.disabled = false;
    event.target.focus();
  }
  const act = (/** @type {string} */ label, /** @type {object} */ body, name = label) => button(label, (event) => move(event, body), false, { 'aria-label': name });
  const jog = (/** @type {string} */ label, /** @type {number} */ x, /** @type {number} */ y, /** @type {string} */ name) => button(label, (event) => {
    const away = machines.plotters.find((one) => one.name === device.value)?.away ?? 1;
    move(event, { move: 'jog', x: x * Number(step.value), y: y * away * Number(step.value) });
  }, false, { class: 'icon', 'aria-label': name });
  step.setAttribute('aria-label', 'How far');
  for (const control of [port, device]) control.addEventListener('change', () => { refusal.textContent = ''; keep({ port: port.value, device: device.value }); });
  const element = h('section', { class: 'panel' }, h('h2', {}, 'Your plotter'), field('Connected at', port), h('div', { class: 'row after' }, button('Find my plotter', ask)), refusal, found,
    more('Which machine it is', field('Machine', device)),
    h('details', { class: 'pen' }, h('summary', {}, 'Move the pen'),
      h('div', { class: 'row' }, act('Up', { move: 'up' }, 'Pen up'), act('Down', { move: 'down' }, 'Pen down'),
        act('To the start corner', { move: 'home' }), act('Let it be pushed by hand', { move: 'release' })),
      h('div', { class: 'row' }, jog('←', -1, 0, 'To the left'), jog('↑', 0, 1, 'Away'), jog('↓', 0, -1, 'Nearer'), jog('→', 1, 0, 'To the right'), step)));
  return { element, port, device };
}

/** Whether its sheet can be moved: nothing of it is drawn. */
const canBeLaid = (/** @type {Plot | null} */ plot) => Boolean(plot?.lies && !plot.runs.length);

/** The edges of the sheet as it lies, mm from the bed's upper left: left, top, right, low.  @param {Laid} plot */
function edges({ page: [width, height], lies: { matrix: [a, b, c, d, e, f] } }) {
  const xs = [e, e + a * width, e + c * height, e + a * width + c * height], ys = [f, f + b * width, f + d * height, f + b * width + d * height];
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

/** How large bed and sheet are, and where the sheet lies, written beside them.  @param {Laid} plot */
function measures(plot) {
  const { bed: [wide, high], lies: { zero: [x, y] } } = plot, [left, top, right, low] = edges(plot), size = Math.max(wide, high) / (matchMedia('(max-width: 44rem)').matches ? 28 : 48);
  const write = (/** @type {number} */ at, /** @type {number} */ up, /** @type {string} */ text) => s('text', { x: at, y: up, 'font-size': size }, text);
  const away = [Math.abs(left - x), Math.min(Math.abs(low - y), Math.abs(top - y))].map((one) => Math.round(one));
  const room = low + size * 1.3 < high ? low + size * 1.2 : top - size * 0.5;
  return [write(size * 0.4, size * 1.2, `the bed, ${wide} × ${high} mm`), write(left + size * 0.3, room, `the sheet, ${Math.round(right - left)} × ${Math.round(low - top)} mm${away.some(Boolean) ? `, ${away.join(' and ')} mm from the start corner` : ', in the start corner'}`)];
}

/** The sheet is dragged, or moved by arrow keys, 1 mm each, with Shift 10; `lay` hears where it lies then.  @param {SVGGElement} group @param {Laid} plot @param {Lay} lay */
function movable(group, plot, lay) {
  const [left, top] = edges(plot), usual = group.getAttribute('transform');
  let from = /** @type {number[] | null} */ (null), by = [0, 0], waiting = 0;
  const shift = (/** @type {number} */ x, /** @type {number} */ y) => { by = [Math.round(x), Math.round(y)]; group.setAttribute('transform', `translate(${by.join(' ')}) ${usual}`); };
  const at = (/** @type {PointerEvent} */ event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(group.ownerSVGElement?.getScreenCTM()?.inverse());
  const moved = () => { if (group.isConnected && by.some(Boolean)) lay(plot.lies.quarters, left + by[0], top + by[1]); };
  group.addEventListener('pointerdown', (event) => { clearTimeout(waiting); from = [at(event).x - by[0], at(event).y - by[1]]; group.setPointerCapture(event.pointerId); });
  group.addEventListener('pointermove', (event) => { if (from) shift(at(event).x - from[0], at(event).y - from[1]); });
  for (const kind of ['pointerup', 'pointercancel']) group.addEventListener(kind, () => { if (from) { from = null; moved(); } });
  group.addEventListener('keydown', (event) => {
    const way = ARROWS[event.key];
    if (!way) return;
    event.preventDefault();
    shift(by[0] + way[0] * (event.shiftKey ? 10 : 1), by[1] + way[1] * (event.shiftKey ? 10 : 1));
    clearTimeout(waiting);
    waiting = setTimeout(moved, 400); // ms, so that a key that is held asks once
  });
}

/** The pens of a plot in their order, each with what can be said of it; `turn` hears all of them.  @param {Plot} plot @param {boolean} now whether it is drawn at this moment @param {(pens: Turn[], focus: string) => any} turn */
function pens(plot, now, turn) {
  const all = plot.pens || [], begun = Boolean(plot.runs.length), fixed = now || plot.finished;
  const swatch = (/** @type {string} */ layer) => (/^#[0-9a-f]{6}$/i.test(layer) ? s('svg', { class: 'pen', viewBox: '0 0 2 1', 'aria-hidden': 'true' }, s('rect', { width: 2, height: 1, fill: layer })) : '');
  const names = all.map(({ layer }) => layer.replace(HEX, inkName) || 'the usual');
  const rows = all.map((pen, at) => {
    const alike = names.slice(0, at + 1).filter((one) => one === names[at]).length, called = alike > 1 ? `${names[at]}, ${alike}` : names[at], name = (/** @type {string} */ what) => ({ 'aria-label': `${what}: ${called}`, disabled: fixed, 'data-what': `${what} ${pen.layer}` });
    const say_ = (/** @type {Partial<Turn>} */ more, /** @type {string} */ what, to = at) => {
      const others = all.map(({ layer, pen: own, speed, out }) => ({ layer, pen: own, speed, out })), [one] = others.splice(at, 1);
      others.splice(to, 0, { ...one, ...more });
      turn(others, `${what} ${pen.layer}`);
    };
    const speed = h('input', { type: 'number', min: 5, max: 2000, step: 5, value: Math.round(100 * pen.speed), ...name('Speed in percent'), onchange: () => { if (speed.reportValidity()) say_({ speed: Number(speed.value) / 100 }, 'Speed in percent'); } });
    const own = h('input', { value: pen.pen, maxlength: 60, placeholder: pen.layer ? called : 'any', ...name('Pen'), onchange: () => say_({ pen: own.value.trim() }, 'Pen') });
    const move = h('button', { type: 'button', class: 'icon', ...name('Order'), disabled: fixed || begun, title: 'Drag it, or press the arrow keys',
      onkeydown: (/** @type {KeyboardEvent} */ event) => {
        const [, by] = ARROWS[event.key] ?? [0, 0];
        if (by) { event.preventDefault(); say_({}, 'Order', Math.max(0, Math.min(all.length - 1, at + by))); }
      },
      onpointerdown: (/** @type {PointerEvent} */ event) => move.setPointerCapture(event.pointerId),
      onpointerup: (/** @type {PointerEvent} */ event) => {
        const to = rows.findIndex((row) => event.clientY < row.getBoundingClientRect().bottom);
        if (to !== at) say_({}, 'Order', to < 0 ? all.length - 1 : to);
      } }, '↕');
    const draws = h('input', { type: 'checkbox', checked: !pen.out, ...name('Draw it'), disabled: fixed || begun, onchange: () => say_({ out: !draws.checked }, 'Draw it') });
    const state_ = pen.out ? 'left out' : pen.drawn ? 'drawn' : begun && pen.next ? 'its turn' : 'waits';
    return h('tr', { class: pen.out ? 'quiet' : undefined }, h('td', {}, all.length > 1 ? move : '', swatch(pen.layer), ` ${called}`), ...[own, [speed, ' %'], draws, metres(pen.ink_mm), minutes(pen.seconds), state_].map((one, k) => h('td', { 'data-of': PEN[k + 1] }, one)));
  });
  return [h('p', { class: 'quiet small' }, all.length > 1 ? 'In this order: a machine waits for each pen, the simulated one does not. Inks that name the same pen share it.' : ''),
    h('table', { class: 'pens' }, h('thead', {}, h('tr', {}, PEN.map((label) => h('th', { scope: 'col' }, label)))), h('tbody', {}, rows))];
}

/** The bed with a sheet on it; `reach` shows how far the pen has come.  @param {HTMLElement} place @param {() => string} over @param {Lay} lay */
function bed(place, over, lay) {
  let strokes = /** @type {SVGGeometryElement[]} */ ([]), nib = /** @type {SVGElement | null} */ (null), ghost = /** @type {SVGPathElement | null} */ (null), shown = -1, asked = 0;
  async function load(/** @type {Laid} */ plot, /** @type {number} */ page) {
    shown = page;
    const mine = asked += 1;
    const ink = s('g', {}, ...drawing(await fetched(`/api/plots/${plot.job}/pages/${page}`), '').querySelectorAll('.ink'));
    if (mine !== asked) return; // something else was asked for meanwhile
    const [wide, high] = plot.bed, [width, height] = plot.page;
    const free = canBeLaid(plot);
    const group = s('g', { transform: `matrix(${plot.lies.matrix.join(' ')})`, ...(free ? { class: 'movable', tabindex: 0, role: 'application', 'aria-label': 'The sheet: drag it, or move it by arrow keys' } : {}) },
      s('rect', { class: 'leaf', width, height }), ink);
    const [x, y] = plot.lies.zero, edge = Math.max(wide, high) * 0.02;
    strokes = inOrder(ink);
    ghost = s('path', { fill: 'none' });
    nib = s('circle', { class: 'nib', r: Math.max(wide, high) / 160, hidden: true });
    ink.firstElementChild?.append(ghost); group.append(nib);
    if (free) movable(group, plot, lay);
    place.replaceChildren(s('svg', { viewBox: `${-edge} ${-edge} ${wide + 2 * edge} ${high + 2 * edge}`, role: free ? 'group' : 'img', 'aria-label': `${named(plot)} on the bed, ${wide} by ${high} mm` },
      s('rect', { class: 'table', width: wide, height: high }), group, ...measures(plot), s('path', { class: 'zero', d: `M${x - edge} ${y}h${2 * edge}M${x} ${y - edge}v${2 * edge}` })));
  }
  function reach(/** @type {Place | null} */ at) {
    strokes.forEach((stroke, number) => stroke.classList.toggle('pale', !at || number >= at.stroke));
    const stroke = at && strokes[at.stroke];
    nib?.toggleAttribute('hidden', !stroke);
    if (!stroke || !ghost || !nib) { ghost?.setAttribute('d', ''); return; }
    const ms = (at.time ?? 0) * 1000;
    ghost.setAttribute('d', ms > 0 ? writtenTo(stroke, ms) : '');
    alike(ghost, stroke);
    const end = ms > 0 ? ghost.getPointAtLength(ghost.getTotalLength()) : stroke.getPointAtLength(0);
    nib.setAttribute('cx', String(end.x)); nib.setAttribute('cy', String(end.y));
  }
  return {
    async show(/** @type {Plot} */ plot, /** @type {Place | null} */ at) {
      if (plot.finished || !plot.lies) { strokes = []; shown = -1; asked += 1; place.replaceChildren(h('p', { class: 'quiet' }, over())); return; }
      const page = at ? at.page : 0;
      if (page !== shown) await load(/** @type {Laid} */ (plot), page);
      reach(at);
    },
    forget() { shown = -1; },
  };
}

/** @type {Show} */
export async function show(main, shared, [chosen]) {
  const gone = new AbortController();
  const refusal = refusals();
  const place = h('div', { class: 'bed' });
  const list = h('ul', { class: 'list' }), penned = h('details', { class: 'penned', hidden: true });
  const told = h('div', { class: 'told', 'aria-live': 'polite', tabindex: 0, role: 'region', 'aria-label': 'What is told' });
  const bar = h('progress', { max: 1, value: 0, 'aria-label': 'Drawn' });
  const question = h('p', { class: 'asked', role: 'alert' });
  const act = (/** @type {string} */ label, /** @type {() => any} */ work, main_ = false) => button(label, guarded(refusal, work), main_);
  const start = act('Draw', draw, true), pause = act('Pause', () => word('pause')), on = act('Continue', () => word('on'), true);
  const stop = act('Stop', () => word('stop')), drop = act('Delete it', forget), turn = act('Turn the sheet', turned);
  const [zeroLabel, zero] = tick('The pen stands above the start corner');
  const [homeLabel, home] = tick('Back to the start corner when stopped');
  remember('plotter', { home }); // where the pen stands is asked each time
  const rest = more('More', homeLabel, h('div', { class: 'row' }, drop));
  const view = bed(place, () => (simulated ? 'The simulated plotter drew all of it: nothing is on paper.' : 'All of it is drawn.'), lay);
  let plot = /** @type {Laid} */ (/** @type {any} */ (null)), running = /** @type {string | null} */ (null), live = /** @type {NonNullable<Snapshot['live']>} */ ({}), left = false, simulated = false;

  async function word(/** @type {string} */ what) {
    refusal.textContent = '';
    pause.disabled = stop.disabled = true;
    await request('POST', `/api/tasks/${running}/word`, { word: what });
    setTimeout(() => { pause.disabled = stop.disabled = false; }, 600);
  }
  async function draw() {
    refusal.textContent = devices.port.value ? '' : UNCHOSEN;
    if (!devices.port.value) { devices.port.focus(); return; }
    simulated = devices.port.value.startsWith('sim');
    const begun = await task(`/api/plots/${plot.job}/draw`, { port: devices.port.value, at_zero: zero.checked, home_after: home.checked }, null, undefined);
    watch(begun.id);
    await listed();
  }
  /** The sheets are laid so: quarters to the left, their upper left corner there, mm from the bed's.  @type {Lay} */
  async function lay(quarters, x, y) {
    const focused = document.activeElement?.matches('.movable');
    let wrong = '';
    await request('PUT', `/api/plots/${plot.job}/sheet`, { quarters, x, y }).catch((/** @type {Error} */ error) => { wrong = error.message; });
    await choose(plot.job); // as it lies now, moved or not
    refusal.textContent = wrong;
    if (focused) /** @type {SVGElement | null} */ (place.querySelector('.movable'))?.focus();
  }
  /** The pens are these, in this order; the control that said so keeps the focus.  @param {Turn[]} all @param {string} focus */
  async function turnPens(all, focus) {
    let wrong = '';
    await request('PUT', `/api/plots/${plot.job}/pens`, { pens: all }).catch((/** @type {Error} */ error) => { wrong = error.message; });
    await choose(plot.job);
    refusal.textContent = wrong;
    /** @type {HTMLElement | null} */ (penned.querySelector(`[data-what="${CSS.escape(focus)}"]`))?.focus();
  }
  function tabled() {
    const many = (plot.pens || []).length;
    if (penned.dataset.job !== plot.job) { penned.dataset.job = plot.job; penned.open = many > 1; }
    penned.hidden = !many || plot.finished && many < 2;
    penned.replaceChildren(h('summary', {}, many > 1 ? `${many} pens` : 'Pen and speed'), ...pens(plot, Boolean(running), turnPens));
  }
  /** A quarter to the left about its middle, as far as the bed goes. */
  async function turned() {
    const [left, top, right, low] = edges(plot), [wide, high] = plot.bed, [width, height] = [low - top, right - left];
    const inside = (/** @type {number} */ middle, /** @type {number} */ size, /** @type {number} */ most) => Math.max(0, Math.min(middle - size / 2, most - size));
    await lay((plot.lies.quarters + 1) % 4, inside((left + right) / 2, width, wide), inside((top + low) / 2, height, high));
  }
  async function forget() {
    await request('DELETE', `/api/plots/${plot.job}`);
    say(`Deleted “${named(plot)}”.`);
    plot = /** @type {any} */ (null); view.forget(); for (const one of [place, told, penned]) one.replaceChildren(); controls();
    await listed();
  }
  function controls() {
    const now = Boolean(running), asks = Boolean(live.question);
    start.hidden = now || !plot || plot.finished;
    start.textContent = plot?.runs.length ? 'Continue' : 'Draw';
    pause.hidden = !now || asks; on.hidden = !asks; stop.hidden = !now; rest.hidden = now || !plot;
    turn.hidden = now || !canBeLaid(plot);
    zeroLabel.hidden = now || !plot?.runs.length || plot.finished; homeLabel.hidden = Boolean(plot?.finished);
    question.textContent = (live.question || '').replace(HEX, inkName);
    bar.hidden = !plot || plot.finished || !(now || plot.runs.length);
  }
  /** @param {(string | undefined)[]} lines */
  function sentences(...lines) {
    told.replaceChildren(...lines.flatMap((line) => (line ? [h('p', {}, `${line[0].toUpperCase()}${line.slice(1)}`.replace(HEX, inkName))] : [])));
  }
  /** Follow a plot that is drawn until it has ended, or this page is left.  @param {string} id */
  async function watch(id) {
    running = id;
    tabled();
    let last = /** @type {Snapshot | null} */ (null);
    controls();
    try {
      for await (const snapshot of follow(id, gone.signal)) {
        if (snapshot.live?.question !== live.question) { plot = await request('GET', `/api/plots/${plot.job}`); tabled(); } // another pen's turn, perhaps
        last = snapshot; live = snapshot.live || {};
        bar.value = snapshot.share || bar.value;
        controls();
        sentences(snapshot.stage || 'Speaking with the plotter …', ...(snapshot.said || []).filter((line) => !line.startsWith(plot.job)).slice(-2)); // how it goes on is seen
        if (live.place) await view.show(plot, live.place);
      }
    } catch (/** @type {any} */ error) {
      if (error.name === 'AbortError') return;
      refusal.textContent = error.message;
    }
    running = null; live = {};
    if (left) return;
    controls();
    const wrong = /** @type {Snapshot | null} */ (last)?.error;
    if (wrong) refusal.textContent = wrong;
    try {
      await choose(plot.job);
      await listed();
    } catch (/** @type {any} */ error) {
      refusal.textContent = error.message;
    }
  }
  async function choose(/** @type {string} */ name) {
    plot = await request('GET', `/api/plots/${name}`);
    address(main, `#jobs/${name}`);
    bar.value = plot.drawn_mm / Math.max(plot.pen_down_mm, 1e-9);
    view.forget();
    if (!plot.finished) devices.device.value = plot.device;
    const left_ = (plot.pens || []).reduce((sum, pen) => sum + pen.seconds, 0);
    sentences(`“${named(plot)}”: ${plot.sheets} ${plot.sheets === 1 ? 'sheet' : 'sheets'}, ${metres(plot.pen_down_mm)} of line${left_ ? `, about ${minutes(left_)}${plot.runs.length ? ' in all' : ''}` : ''}.`,
      plot.outlook && plot.runs.length ? plot.outlook : '', plot.lies?.turned ? `The sheet lies with its top edge ${plot.lies.turned.replace('the reader', 'you')}.` : '', canBeLaid(plot) ? 'Drag the sheet to where it lies on the bed.' : '',
      plot.stopped && !plot.finished ? `It ended: ${plot.stopped}.` : '');
    tabled();
    controls();
    await view.show(plot, plot.place);
    if (plot.task && running !== plot.task) watch(plot.task);
  }
  async function listed() {
    const { plots, drawn } = /** @type {{plots: Plot[], drawn: Record<string, string>}} */ (await request('GET', '/api/plots'));
    list.replaceChildren(...plots.map((one) => h('li', {}, h('button', {
      type: 'button', 'aria-current': plot?.job === one.job ? 'true' : undefined, disabled: Boolean(running) && plot?.job !== one.job,
      title: one.job, onclick: guarded(refusal, async () => { await choose(one.job); await listed(); }),
    }, h('span', {}, named(one)), h('span', { class: 'quiet' }, plotState(one, drawn))))));
    if (!plots.length) list.replaceChildren(h('li', { class: 'quiet' }, 'Nothing waits for the plotter.'));
    return { plots, drawn };
  }

  main.append(h('p', { class: 'middle quiet' }, 'Looking for plotters …'));
  const machines = await request('GET', '/api/machines', undefined, gone.signal);
  main.replaceChildren();
  const devices = machine(machines);
  main.append(h('div', { class: 'jobs' },
    h('div', { class: 'column' }, h('h1', { class: 'hidden' }, 'Plotter'), h('section', { class: 'panel' }, h('h2', {}, 'To be drawn'), list), devices.element),
    h('section', { class: 'desk', 'aria-label': 'The bed' }, h('div', { class: 'tools' }, start, on, pause, stop, turn, zeroLabel, rest),
      h('div', { class: 'asks' }, refusal, question), bar, place, told, penned)));
  controls();
  const { plots, drawn } = await listed();
  const first = plots.find((one) => one.job === chosen) || plots.find((one) => one.job in drawn) || plots.find((one) => !one.finished);
  if (first) { await choose(first.job); await listed(); } else place.replaceChildren(h('div', { class: 'empty' }, h('p', {}, 'Nothing lies on the plotter yet. Write something, and make it with a pen: it is shown here first, as it lies on the bed.'), h('a', { class: 'button main', href: '#write' }, 'Write something')));
  return () => { left = true; gone.abort(); };
}
