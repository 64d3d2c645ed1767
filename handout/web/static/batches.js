// Batches on the page Jobs: a table and a letter, their proof to approve, what became of each row.

import { blob, follow, request, task } from './api.js';
import { choice, field, h, save, say, tick } from './dom.js';
import * as drafts from './drafts.js';

const STATES = { new: 'not proofed', proofed: 'proof to be approved', approved: 'approved', 'broken off': 'broken off', done: 'done' };
const TO = { pdf: 'a PDF file', printer: 'a printer', plotter: 'the plotter' };
const LOOK = 3000; // ms between two looks at the rows of a batch that is made
const SHOWN = 60; // pictures of a proof that are shown at once
const GAPS = 'Dear {{ first_name }},\n\n…';

/** Ticks for some names, and which are ticked, or with `all` could be, besides one that is chosen elsewhere. */
function ticks(legend, names, labels = {}) {
  const boxes = names.map((name) => [name, ...tick(labels[name] ?? name, {})]);
  const element = h('fieldset', {}, h('legend', {}, legend), boxes.map(([, label]) => label));
  return [element, (besides, all = false) => {
    for (const [name, label, box] of boxes) { label.hidden = name === besides; if (label.hidden) box.checked = false; }
    return boxes.filter(([name, , box]) => name !== besides && (all || box.checked)).map(([name]) => name);
  }];
}

/** The form of a new batch; `made` is called with its name. */
function form(shared, machines, made) {
  const table = h('input', { type: 'file', accept: '.csv,.tsv,.txt,.xlsx' });
  const letter = h('textarea', { rows: 5, placeholder: GAPS, oninput: () => drafts.keep('batch', { letter: letter.value }, unkept) });
  drafts.kept('batch').then((typed) => { letter.value ||= typed.letter || ''; });
  const [markdown, isMarkdown] = tick('The letter is Markdown');
  const hand = choice(shared.choices.hands.map((one) => one.name));
  const page = choice(shared.choices.pages);
  page.value = 'A6';
  const to = choice(Object.keys(TO), TO);
  const printers = [...machines.queues, ...machines.printers.map((one) => one.name).filter((name) => name !== 'printer-pdf')];
  const printer = choice(printers, Object.fromEntries(machines.printers.map((one) => [one.name, one.title])));
  const device = choice(machines.plotters.map((one) => one.name), Object.fromEntries(machines.plotters.map((one) => [one.name, one.title])));
  const [envelopes, withEnvelopes] = tick('With envelopes');
  const refusal = h('p', { class: 'bad', role: 'alert' }), unkept = h('p', { class: 'bad', role: 'alert' }); // a draft that is kept clears its own alone
  const printerField = field('Printer', printer), deviceField = field('Machine', device);
  const [shared_, queues] = ticks('Shared with these printers', machines.queues);
  const chosen = () => {
    printerField.hidden = to.value !== 'printer'; deviceField.hidden = to.value !== 'plotter';
    shared_.hidden = to.value !== 'printer' || queues(printer.value, true).length < 1;
  };
  for (const control of [to, printer]) control.addEventListener('change', chosen);
  chosen();
  async function submit(event) {
    event.preventDefault();
    refusal.textContent = '';
    try {
      const [file] = table.files;
      if (!file) throw new Error('Choose a table first: CSV or Excel, a row for each letter.');
      const sent = await request('POST', `/api/uploads?name=${encodeURIComponent(file.name)}`, file);
      const body = { table: sent.id, text: letter.value, letter: isMarkdown.checked, hand: hand.value, page: page.value, to: to.value, with_envelopes: withEnvelopes.checked, fallback: true };
      if (to.value === 'printer') Object.assign(body, { printer: printer.value, queues: queues(printer.value) });
      if (to.value === 'plotter') body.device = device.value;
      try {
        await made(await request('POST', '/api/batches', body));
      } finally {
        request('DELETE', `/api/uploads/${sent.id}`).catch(() => {});
      }
      table.value = '';
    } catch (error) {
      refusal.textContent = error.message;
    }
  }
  return h('details', {}, h('summary', {}, 'A new batch'), h('form', { onsubmit: submit, 'aria-label': 'A new batch' },
    field('Table', table), field('Letter; empty for envelopes alone', letter), markdown,
    h('div', { class: 'grid' }, field('Hand', hand), field('Page', page), field('Made by', to), printerField, deviceField),
    shared_, envelopes, refusal, unkept, h('div', { class: 'row' }, h('button', {}, 'Keep the batch'))));
}

/** A batch in a window of its own. */
async function opened(name, machines, devices, changed) {
  const gone = new AbortController();
  const refusal = h('p', { class: 'bad', role: 'alert' });
  const head = h('h2', {}), summary = h('p', {}), told = h('p', { class: 'quiet', 'aria-live': 'polite' });
  const question = h('p', { class: 'asked', role: 'alert' });
  const bar = h('progress', { max: 1, value: 0, 'aria-label': 'Progress', hidden: true });
  const proofs = h('div', { class: 'proofs' }), rows = h('div', { class: 'rows', tabindex: 0, role: 'region', 'aria-label': 'Rows' });
  const more = h('button', { type: 'button', hidden: true, onclick: () => pictures(proofs.childElementCount) });
  let batch = null, running = null;
  const act = (label, work, main = false) => h('button', {
    type: 'button', class: main ? 'main' : undefined,
    async onclick() {
      refusal.textContent = '';
      try { await work(); } catch (error) { if (error.name !== 'AbortError') refusal.textContent = error.message; }
    },
  }, label);
  const prove = act('Make a proof', () => followed(`/api/batches/${name}/proof`, {}));
  const approve = act('Approve', async () => {
    try {
      shown(await request('POST', `/api/batches/${name}/approval`, { made: batch.proof.made }));
    } catch (error) {
      shown(await request('GET', `/api/batches/${name}`));
      throw error;
    }
  }, true);
  const [sharing, others] = ticks('Shared with the plotters at', machines.ports.map((one) => one.name), Object.fromEntries(machines.ports.map((one) => [one.name, one.name.startsWith('sim') ? one.title : `${one.name} ${one.title}`])));
  const make = act('Make it', () => followed(`/api/batches/${name}/make`, { port: batch.to === 'plotter' ? [devices.port.value, ...others(devices.port.value)] : '' }), true);
  const on = act('Go on', () => word('on'), true), stop = act('Stop', () => word('stop'));
  const take = act('Save the PDF', async () => save(await blob(`/api/batches/${name}/files/batch.pdf`), `${name}.pdf`));
  const sheet = act('Save the proof', async () => save(await blob(`/api/batches/${name}/files/proof.pdf`), `${name}-proof.pdf`));
  const drop = act('Delete', async () => { await request('DELETE', `/api/batches/${name}`); say('Deleted the batch.'); dialog.close(); });
  const dialog = h('dialog', { 'aria-label': 'Batch', class: 'batch' },
    h('div', { class: 'row between' }, head, h('button', { type: 'button', onclick: () => dialog.close() }, 'Close')),
    summary, h('div', { class: 'row' }, prove, approve, make, on, stop, take, sheet, drop), sharing, refusal, question, bar, told, proofs, more, rows);

  const lost = () => batch.proof.failed?.length || 0;
  const word = (what) => request('POST', `/api/tasks/${running}/word`, { word: what });
  function controls(live = {}) {
    const busy = Boolean(running);
    prove.hidden = busy || ['done', 'broken off'].includes(batch.state);
    prove.textContent = batch.state === 'new' ? 'Make a proof' : 'Make the proof anew';
    approve.hidden = busy || batch.state !== 'proofed' || !batch.proof.rows;
    approve.textContent = lost() ? `Approve the other ${batch.proof.rows}` : 'Approve';
    make.hidden = busy || !['approved', 'broken off'].includes(batch.state);
    make.textContent = batch.state === 'broken off' ? 'Go on' : batch.to === 'plotter' ? 'Plot' : batch.to === 'printer' ? 'Print' : 'Make the PDF';
    sharing.hidden = make.hidden || batch.to !== 'plotter' || !others(devices.port.value, true).length;
    take.hidden = !batch.file; sheet.hidden = busy || batch.state === 'new'; drop.hidden = busy;
    stop.hidden = !busy; on.hidden = !live.question; bar.hidden = !busy;
    question.textContent = live.question || '';
  }
  async function watch(id) {
    running = id;
    let last = null;
    controls();
    changed();
    // what became of each row is told by its journal, not by the task
    const looking = setInterval(() => request('GET', `/api/batches/${name}`).then((facts) => { if (running) listed(facts); }).catch(() => {}), LOOK);
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
    if (last?.error) refusal.textContent = last.error;
    shown(await request('GET', `/api/batches/${name}`));
    changed();
  }
  async function followed(path, body) {
    running = path; // until the task has a name: nothing else may be asked for meanwhile
    controls();
    try {
      await watch((await task(path, body, null)).id);
    } catch (error) {
      running = null;
      controls();
      throw error;
    }
  }
  async function pictures(before = 0) {
    const most = before + SHOWN;
    const pages = batch.proof.pages_shown || [];
    const looked = new Set((batch.proof.look_at || []).map((one) => one.row));
    if (!before) proofs.replaceChildren();
    proofs.append(...pages.slice(before, most).map((page) => {
      const image = h('img', { alt: `Row ${page.row}, ${page.part}`, loading: 'lazy' });
      blob(`/api/batches/${name}/files/${page.picture}`, '', 'GET', undefined, gone.signal).then((data) => {
        image.src = URL.createObjectURL(data);
        image.onload = () => URL.revokeObjectURL(image.src);
      }).catch(() => {});
      return h('figure', { class: looked.has(page.row) ? 'look' : undefined }, image, h('figcaption', {}, `row ${page.row}, ${page.part}`));
    }));
    more.hidden = pages.length <= most;
    more.textContent = `${most} of ${pages.length} pages are shown: show ${Math.min(SHOWN, pages.length - most)} more`;
  }
  function listed(facts) {
    const short = facts.rows.length < facts.count ? `The first ${facts.rows.length} of ${facts.count} rows are listed; all are made. The proof names every row that is to be looked at.` : '';
    rows.replaceChildren(short && h('p', { class: 'quiet' }, short), h('table', {}, h('thead', {}, h('tr', {}, ['Row', 'Who', 'State', 'Look at'].map((label) => h('th', { scope: 'col' }, label)))),
      h('tbody', {}, facts.rows.map((row) => h('tr', {}, h('td', {}, row.row), h('td', {}, row.called), h('td', {}, row.state), h('td', {}, row.why.join('; ')))))));
  }
  function shown(facts) {
    const before = JSON.stringify(batch?.proof);
    batch = facts;
    head.textContent = batch.title;
    const what = [batch.letters && 'letters', batch.envelopes && 'envelopes'].filter(Boolean).join(' and ');
    summary.textContent = `${batch.count} ${batch.count === 1 ? 'row' : 'rows'}, ${what}, for ${batch.printer || TO[batch.to]}; ${STATES[batch.state]}${batch.state === 'broken off' && batch.ended ? `: ${batch.ended}` : ''}.`;
    if (lost()) summary.textContent += ` ${lost()} ${lost() === 1 ? 'row' : 'rows'} cannot be made, as is said below: keep the batch anew with a better table, or make it without them.`;
    listed(batch);
    if (JSON.stringify(batch.proof) !== before) pictures();
    controls();
  }
  shown(await request('GET', `/api/batches/${name}`));
  dialog.addEventListener('close', () => { gone.abort(); dialog.remove(); changed(); });
  document.body.append(dialog);
  dialog.showModal();
  if (batch.task) watch(batch.task).catch((error) => { if (error.name !== 'AbortError') refusal.textContent = error.message; });
}

export function batches(shared, machines, devices, signal, chosen) {
  const list = h('ul', { class: 'list' });
  const refusal = h('p', { class: 'bad', role: 'alert' });
  const redraw = async () => {
    if (signal.aborted) return;
    const { batches: found, made } = await request('GET', '/api/batches');
    list.replaceChildren(...found.map((one) => h('li', {}, h('button', { type: 'button', onclick: () => opened(one.batch, machines, devices, redraw).catch((error) => { refusal.textContent = error.message; }) },
      h('span', {}, one.title), h('span', { class: 'quiet' }, `${one.batch} · ${one.batch in made ? 'being made' : STATES[one.state]}`)))));
    if (!found.length) list.replaceChildren(h('li', { class: 'quiet' }, 'No batch is kept.'));
  };
  redraw().then(() => chosen && opened(chosen, machines, devices, redraw)).catch((error) => { refusal.textContent = error.message; });
  signal.addEventListener('abort', () => document.querySelector('dialog.batch')?.close());
  return h('section', { class: 'panel' }, h('h2', {}, 'Batches'), list, refusal, form(shared, machines, async (batch) => { await redraw(); await opened(batch.batch, machines, devices, redraw); }));
}
