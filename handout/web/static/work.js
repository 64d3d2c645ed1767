// Work that takes a while, and what comes of it: progress that can be cancelled, pictures, pages, a line that is tried.

/** @import { Heard, Run } from './types' */
import { blob, fileOf, task } from './api.js';
import { button, field, h } from './dom.js';
import { remember } from './drafts.js';

/** A line that shows how far work has come, and can cancel it: what `run` runs, or by `cancelled` something else.  @param {(() => void) | null} [cancelled] */
export function progress(cancelled = null) {
  const bar = h('progress', { max: 1, 'aria-label': 'Progress' }), stage = h('span', { class: 'quiet' });
  let own = /** @type {AbortController | null} */ (null);
  const stop = () => own?.abort();
  const line = h('div', { class: 'work', hidden: true }, stage, bar, button('Cancel', () => { line.hidden = true; (cancelled ?? stop)(); }));
  /** @type {Heard} */
  const heard = ({ state, share, stage: now }) => {
    line.hidden = false;
    if (share === undefined) bar.removeAttribute('value'); else bar.value = share;
    if (now || state) stage.textContent = state === 'waiting' ? 'waiting' : now ?? '';
  };
  /** @type {Run} */
  const run = async (work) => {
    own = new AbortController();
    line.hidden = false;
    try { return await work(heard, own.signal); } finally { line.hidden = true; }
  };
  return { line, heard, stop, run };
}

/** A picture of data that was fetched.  @param {Blob} data @param {string} alt @param {Record<string, any>} [properties] */
export function picture(data, alt, properties = {}) {
  const src = URL.createObjectURL(data);
  return h('img', { src, alt, onload: () => URL.revokeObjectURL(src), ...properties });
}

/** A page that was fetched as SVG; its own style and script are for browsers that open the file: the policy of this page refuses them.  @param {string} source @param {string} label @returns {SVGSVGElement} */
export function drawing(source, label) {
  const svg = /** @type {any} */ (document.importNode(new DOMParser().parseFromString(source.replace(/<(style|script|metadata)\b[\s\S]*?<\/\1>/g, ''), 'image/svg+xml').documentElement, true));
  for (const part of svg.querySelectorAll('desc, title')) part.remove();
  svg.setAttribute('role', 'img'); svg.setAttribute('aria-label', label);
  return svg;
}

/** A form that writes a line in a hand; `run` shows its progress, `ready` is waited for, `over` hears why it was refused, or nothing.  @param {string} name @param {string} label @param {Run} run @param {() => Promise<any>} ready @param {(error?: any) => void} over */
export function lineIn(name, label, run, ready, over, main = false) {
  const line = h('input', { value: 'a quick look at it', maxlength: 80 }), written = h('figure', { class: 'sheet' });
  remember('line', { line });
  return h('form', {
    'aria-label': label,
    async onsubmit(/** @type {Event} */ event) {
      event.preventDefault();
      await ready();
      try {
        const asked = { text: line.value, hand: name, page: '100x20mm', margin: '4mm', format: 'png', dpi: 150, fit: true, fallback: true, seed: 1 };
        const done = await run((heard, signal) => task('/api/write', asked, heard, signal));
        written.replaceChildren(picture(await blob(fileOf(done)), line.value));
        over();
      } catch (error) { over(error); }
    },
  }, field(label, line), h('div', { class: 'row after' }, h('button', { class: main ? 'main' : undefined }, 'Write it')), written);
}
