// A line that is tried in a hand.

import { blob, fileOf, task } from './api.js';
import { field, h } from './dom.js';

/** A form that writes a line in a hand; `heard` follows it, `ready` is waited for, `over` hears why it was refused, or nothing. */
export function lineIn(name, label, heard, ready, over) {
  const line = h('input', { value: 'a quick look at it', maxlength: 80 }), written = h('figure', { class: 'sheet' });
  return h('form', {
    'aria-label': label,
    async onsubmit(event) {
      event.preventDefault();
      await ready();
      try {
        const done = await task('/api/write', { text: line.value, hand: name, page: '100x20mm', margin: '4mm', format: 'png', dpi: 150, fit: true, fallback: true, seed: 1 }, heard);
        written.replaceChildren(h('img', { src: URL.createObjectURL(await blob(fileOf(done))), alt: line.value }));
        over();
      } catch (error) { over(error); }
    },
  }, field(label, line), h('div', { class: 'row after' }, h('button', {}, 'Write it')), written);
}
