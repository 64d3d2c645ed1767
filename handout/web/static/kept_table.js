// A table that is kept with its letter: its proof is looked at and approved, then it is made, paused, and gone on with.

/** @import { Batch, Machines, Snapshot } from './types' */
import { blob, follow, request, task } from './api.js';
import * as drafts from './drafts.js';
import { button, field, grouped, guarded, h, more as folded, named, portChoice, refusal as refusals, save, say, steps, tick } from './dom.js';
import { picture } from './work.js';

const TO = { pdf: 'a PDF file', printer: 'a printer', plotter: 'the plotter' };
const LOOK = 3000; // ms between two looks at the rows of a batch that is made
const SHOWN = 60; // pictures of a proof that are shown at once

export async function kept(/** @type {HTMLElement} */ main, /** @type {string} */ name, /** @type {string[]} */ titles) {
  const gone = new AbortController(), url = `/api/batches/${name}`;
  let batch = /** @type {Batch} */ (await request('GET', url)), running = /** @type {string | null} */ (null);
  /** @type {Pick<Machines, 'ports'>} */
  const machines = batch.to === 'plotter' ? await request('GET', '/api/machines', undefined, gone.signal) : { ports: [] };
  const out = new Set(batch.left_out), draft = await drafts.kept('batch'), own = draft.batch === name; // whether its letter is still on the page before
  const refusal = refusals(), told = h('p', { class: 'quiet', 'aria-live': 'polite' }), question = h('p', { class: 'asked', role: 'alert' });
  const head = h('div', {}), title = h('h1', {}), summary = h('p', { 'aria-live': 'polite' });
  const bar = h('progress', { max: 1, value: 0, 'aria-label': 'Progress', hidden: true });
  const proofs = h('div', { class: 'proofs' }), rows = h('div', { class: 'rows', tabindex: 0, role: 'region', 'aria-label': 'Rows' });
  const more = h('button', { type: 'button', hidden: true, onclick: () => pictures(proofs.childElementCount) });
  const act = (/** @type {string} */ label, /** @type {() => any} */ work, main_ = false) => button(label, guarded(refusal, work), main_);
  const ports = portChoice(machines.ports);
  const others = machines.ports.map(/** @returns {[string, HTMLLabelElement, HTMLInputElement]} */ (port) => [port.name, ...tick(port.name.startsWith('sim') ? port.title : port.name, {})]);
  const sharing = folded('Share it with more plotters', others.map(([, label]) => label));
  const where = h('div', { class: 'grid' }, field('Connected at', ports), sharing);
  const shared = () => others.filter(([port, , box]) => port !== ports.value && box.checked).map(([port]) => port);
  drafts.remember(`batch-${name}`, { at: ports, ...Object.fromEntries(others.map(([port, , box]) => [`with ${port}`, box])) });
  where.addEventListener('change', () => controls());

  const forget = async () => { await request('DELETE', url); for (const form of ['batch', 'row']) drafts.forget(`${form}-${name}`); };
  const prove = act('Make a proof', () => followed(`${url}/proof`, {}), true), again = act('Make the proof anew', () => followed(`${url}/proof`, {}));
  const approve = act('Approve', async () => {
    try {
      shown(await request('POST', `${url}/approval`, { made: batch.proof.made, left_out: [...out] }));
    } catch (/** @type {any} */ error) {
      shown(await request('GET', url));
      throw error;
    }
  }, true);
  const make = act('Make it', () => followed(`${url}/make`, { port: batch.to === 'plotter' ? [ports.value, ...shared()] : '' }), true);
  const pause = act('Pause', () => word('pause')), on = act('Continue', () => word('on'), true), stop = act('Stop', () => word('stop'));
  const take = act('Save the PDF', async () => save(await blob(`${url}/files/batch.pdf`), `${name}.pdf`), true);
  const sheet = act('Save the proof', async () => save(await blob(`${url}/files/proof.pdf`), `${name}-proof.pdf`));
  const change = act('Change the letter', async () => { await forget(); drafts.keep('batch', { ...draft, batch: '', step: 1 }, refusal); location.hash = 'table'; });
  const drop = act('Delete', async () => { await forget(); say(`Deleted “${batch.title}”.`); location.hash = 'table'; });
  const another = h('a', { class: 'button', href: '#table' }, 'Another table'), rest = folded('More', h('div', { class: 'row' }, again, sheet, drop));

  const lost = () => batch.proof.failed?.length || 0;
  const word = (/** @type {string} */ what) => request('POST', `/api/tasks/${running}/word`, { word: what });
  function controls(/** @type {Snapshot['live']} */ live = {}) {
    const busy = Boolean(running), before = ['new', 'proofed'].includes(batch.state), several = shared().length || batch.queues.length;
    prove.hidden = busy || batch.state !== 'new'; again.hidden = batch.state !== 'proofed';
    approve.hidden = busy || batch.state !== 'proofed' || !batch.proof.rows;
    const left = (batch.proof.rows || 0) - out.size, unseen = proofs.querySelector('.unseen');
    approve.textContent = lost() || out.size ? `Approve the other ${left}` : `Approve ${left === 1 ? 'it' : `all ${left}`}`;
    approve.disabled = left < 1 || Boolean(unseen);
    make.hidden = busy || !['approved', 'broken off'].includes(batch.state);
    make.textContent = batch.state === 'broken off' ? 'Continue' : batch.to === 'plotter' ? (ports.value.startsWith('sim') ? 'Try it in simulation' : 'Plot') : batch.to === 'printer' ? 'Print' : 'Make the PDF';
    make.disabled = batch.to === 'plotter' && !ports.value;
    where.hidden = make.hidden || batch.to !== 'plotter';
    for (const [port, label] of others) label.hidden = port === ports.value;
    take.hidden = !batch.file; sheet.hidden = batch.state === 'new'; change.hidden = busy || !before || !own; another.hidden = batch.state !== 'done';
    rest.hidden = busy; stop.hidden = !busy; on.hidden = !live.question; bar.hidden = !busy;
    pause.hidden = !busy || Boolean(live.question) || making() === 'proof' || Boolean(several);
    question.textContent = live.question || '';
    head.replaceChildren(steps(titles, before ? 3 : batch.state === 'done' ? titles.length : 4, 0, () => {}));
  }
  const making = () => (['new', 'proofed'].includes(batch.state) ? 'proof' : 'rows');
  async function watch(/** @type {string} */ id) {
    running = id;
    let last = /** @type {Snapshot | null} */ (null);
    controls();
    // what became of each row is told by its journal, not by the task
    const looking = setInterval(() => request('GET', url).then((facts) => { if (running) listed(facts); }).catch(() => {}), LOOK);
    try {
      for await (const snapshot of follow(id, gone.signal)) {
        last = snapshot;
        bar.value = snapshot.share;
        told.textContent = [snapshot.stage || 'It begins …', ...(snapshot.said || []).slice(-1)].filter(Boolean).join(' · ');
        controls(snapshot.live);
      }
    } finally {
      running = null;
      told.textContent = '';
      clearInterval(looking);
    }
    const wrong = /** @type {Snapshot | null} */ (last)?.error;
    if (wrong) refusal.textContent = wrong;
    shown(await request('GET', url));
  }
  async function followed(/** @type {string} */ path, /** @type {object} */ body) {
    running = path; // until the task has a name: nothing else may be asked for meanwhile
    controls();
    try {
      await watch((await task(path, body, null)).id);
    } catch (/** @type {any} */ error) {
      running = null;
      controls();
      throw error;
    }
  }
  async function pictures(before = 0) {
    const most = before + SHOWN, pages = batch.proof.pages_shown || [];
    const looked = new Map((batch.proof.look_at || []).map((one) => [one.row, one.why]));
    const who = new Map(batch.rows.map((row) => [row.row, row.called.split(', ').slice(0, 2).join(' ')]));
    if (!before) proofs.replaceChildren();
    proofs.append(...pages.slice(before, most).map((page) => {
      const image = h('img', { alt: `Row ${page.row}, ${page.part}`, loading: 'lazy' });
      const fetched = () => blob(`${url}/files/${page.picture}`, '', 'GET', undefined, gone.signal).then((data) => {
        unseen.remove();
        image.src = URL.createObjectURL(data);
        image.onload = () => URL.revokeObjectURL(image.src);
      }).catch((/** @type {Error} */ error) => { if (error.name !== 'AbortError') image.after(unseen); }).finally(() => controls());
      const unseen = h('p', { class: 'bad unseen' }, 'This page cannot be shown, so it cannot be approved. ', button('Try again', fetched));
      fetched();
      const toggle = button('Leave out', () => leave(page.row), false, { class: 'leave', 'aria-label': `Leave out: row ${page.row}` });
      return h('figure', { class: looked.has(page.row) ? 'look' : undefined, 'data-row': page.row }, image,
        h('figcaption', {}, `${who.get(page.row) ?? ''} `, h('span', { class: 'quiet' }, `row ${page.row}${page.part === 'letter 1' ? '' : `, ${page.part}`}`), looked.has(page.row) ? h('span', { class: 'warned' }, looked.get(page.row)?.join('; ')) : ''), h('div', { class: 'joined' }, toggle, editor(page.row, 'Change it')));
    }));
    more.hidden = pages.length <= most;
    more.textContent = `${most} of ${pages.length} pages are shown: show ${Math.min(SHOWN, pages.length - most)} more`;
    marked();
  }
  function leave(/** @type {number} */ row) {
    if (out.has(row)) out.delete(row); else out.add(row);
    drafts.keepForm(`batch-${name}`, { made: batch.proof.made, out: [...out] });
    marked();
    controls();
  }
  /** The cells of a row, to be put right; the proof is made anew then.  @param {number} row */
  async function edit(row) {
    const { cells } = await request('POST', `${url}/rows/${row}`, {}), wrong = refusals(), form = `row-${name}`;
    if (drafts.formValues(form).row !== row) drafts.forget(form);
    drafts.keepForm(form, { row });
    const inputs = Object.entries(/** @type {Record<string, string>} */ (cells)).map(/** @returns {[string, HTMLTextAreaElement]} */ ([header, cell]) => [header, h('textarea', { rows: 1 + (cell.match(/\n/g) || []).length }, cell)]);
    drafts.remember(form, Object.fromEntries(inputs.map(([header, input]) => [`cell ${header}`, input])));
    const dialog = h('dialog', { 'aria-label': `Row ${row}` }, h('h2', {}, `Row ${row}`), h('form', {
      class: 'panel-form',
      async onsubmit(/** @type {Event} */ event) {
        event.preventDefault();
        const changed = Object.fromEntries(inputs.filter(([header, input]) => input.value !== cells[header]).map(([header, input]) => [header, input.value]));
        try {
          if (Object.keys(changed).length) await request('POST', `${url}/rows/${row}`, { cells: changed, was: cells });
          dialog.close();
          if (Object.keys(changed).length) await followed(`${url}/proof`, {});
        } catch (/** @type {any} */ error) { wrong.textContent = refusal.textContent = error.message; }
      },
    }, inputs.map(([header, input]) => field(header, input)), h('p', { class: 'quiet' }, 'Only here: the file that you gave stays as it is. The proof is made anew.'), wrong,
    h('div', { class: 'row' }, h('button', { class: 'main' }, 'Keep'), button('Leave it', () => dialog.close()))));
    dialog.addEventListener('close', () => { dialog.remove(); drafts.forget(form); });
    document.body.append(dialog);
    dialog.showModal();
  }
  const editor = (/** @type {number} */ row, /** @type {string} */ label) => button(label, guarded(refusal, () => edit(row)), false, { class: 'edit', 'aria-label': `${label}: row ${row}` });
  function marked() {
    for (const figure of /** @type {NodeListOf<HTMLElement>} */ (proofs.querySelectorAll('figure'))) {
      const left = out.has(Number(figure.dataset.row)), [toggle, change_] = /** @type {NodeListOf<HTMLElement>} */ (figure.querySelectorAll('.leave, .edit'));
      figure.classList.toggle('out', left);
      toggle.hidden = change_.hidden = batch.state !== 'proofed';
      toggle.setAttribute('aria-pressed', String(left));
    }
  }
  function listed(/** @type {Batch} */ facts) {
    const short = facts.rows.length < facts.count ? `The first ${facts.rows.length} of ${facts.count} rows are listed; all are made. The proof names every row that is to be looked at.` : '';
    const wrong = facts.rows.filter((row) => /^(failed|doubtful|cannot)/.test(row.state));
    rows.replaceChildren(short && h('p', { class: 'quiet' }, short),
      wrong.length ? h('div', { class: 'warned' }, h('p', {}, 'Not made:'), h('ul', {}, grouped(wrong, (row) => [row.state, ...row.why].join('; ')).map(([why, some]) => h('li', {}, `${some.length > 1 ? named(some) : `row ${some[0].row} (${some[0].called})`}: ${why}`)))) : '',
      h('table', {}, h('thead', {}, h('tr', {}, ['Row', 'Who', 'State', 'Look at'].map((label) => h('th', { scope: 'col' }, label)))),
        h('tbody', {}, facts.rows.map((row) => h('tr', {}, h('td', {}, row.row), h('td', {}, row.called), h('td', {}, row.state), h('td', {}, row.why.join('; '), row.state === 'cannot be made' && facts.state === 'proofed' ? editor(row.row, 'Put it right') : ''))))));
  }
  function shown(/** @type {Batch} */ facts) {
    const before = JSON.stringify(batch?.proof) !== JSON.stringify(facts.proof) || !proofs.childElementCount;
    batch = facts;
    if (before) { // rows that were left out and not approved yet are so still, where the page is loaded anew
      const pressed = drafts.formValues(`batch-${name}`);
      out.clear();
      for (const row of pressed.out && pressed.made === batch.proof.made && batch.state === 'proofed' ? pressed.out : batch.left_out) out.add(row);
    }
    title.textContent = { new: 'Here comes a proof', proofed: 'Does every letter look right?', approved: 'Approved: now it can be made', 'broken off': 'It stopped on the way', done: 'Done' }[batch.state];
    const what = [batch.letters && 'letters', batch.envelopes && 'envelopes'].filter(Boolean).join(' and ');
    summary.textContent = `${batch.title}: ${batch.left_out.length ? `${batch.count - batch.left_out.length} of ` : ''}${batch.count} ${batch.count === 1 ? what.replaceAll('s ', ' ').replace(/s$/, '') : what}, for ${batch.printer?.replace(/^printer-/, '') || TO[batch.to]}${batch.state === 'broken off' && batch.ended ? `; ${batch.ended}` : ''}.`;
    if (lost()) summary.textContent += ` ${lost()} ${lost() === 1 ? 'row' : 'rows'} cannot be made, as is said below: ${['new', 'proofed'].includes(batch.state) ? 'put right what is wrong, or make it without them' : 'it is made without them'}.`;
    if (batch.rehearsed) summary.textContent += ' The simulated plotter drew it: nothing is on paper yet.';
    if (batch.test && batch.state === 'done') summary.textContent += ' It was a test: nothing was sent.';
    if (batch.webhook?.why) summary.textContent += ` The program that waits for it was not told: ${batch.webhook.why}`;
    listed(batch);
    if (before) pictures(); else marked();
    controls();
  }
  main.append(h('div', { class: 'flow' }, head, h('section', { class: 'flow-body kept' }, title, summary, where,
    h('div', { class: 'row' }, approve, make, pause, on, stop, take, prove, change, another, rest), refusal, question, bar, told, proofs, more, rows)));
  shown(batch);
  const quiet = (/** @type {Error} */ error) => { if (error.name !== 'AbortError') refusal.textContent = error.message; };
  if (batch.task) watch(batch.task).catch(quiet);
  else if (batch.state === 'new') followed(`${url}/proof`, {}).catch(quiet);
  else if (batch.state === 'proofed' && drafts.formValues(`row-${name}`).row) guarded(refusal, edit)(drafts.formValues(`row-${name}`).row);
  return () => { gone.abort(); document.querySelector('dialog')?.remove(); };
}
