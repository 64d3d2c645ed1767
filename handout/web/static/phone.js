// The page that a phone sees: photographs are taken or chosen, and go to the computer one after the other.

import { button, h } from './dom.js';

// what iPhones make of their HEIC where no other is taken
const TAKEN = 'image/jpeg,image/png,image/webp';
const LARGEST = 64 * 2 ** 20; // bytes; the computer takes no more, as phone.py has it
const GONE = 'The computer does not answer: it was switched off there, its half hour is over, or this phone has left the network. Switch it on there again and scan the new code.';

const list = h('ol', { class: 'sent', 'aria-label': 'Photographs' });
let turn = Promise.resolve(); // one after the other: a slow network is not made slower

/** Sends a file, says how far it has come, and gives the computer's answer. Fetch would not say how far. */
/** @param {File} file @param {(share: number) => void} heard @returns {Promise<any>} */
function sending(file, heard) {
  return new Promise((ends, fails) => {
    const asked = new XMLHttpRequest();
    asked.open('POST', `photographs?name=${encodeURIComponent(file.name)}`);
    asked.upload.onprogress = (event) => heard(event.loaded / event.total);
    asked.onerror = () => fails(new Error(GONE));
    asked.onload = () => {
      let told = /** @type {{error?: string}} */ ({});
      try { told = JSON.parse(asked.responseText); } catch { /* no sentence came */ }
      if (asked.status === 200) ends(told);
      else fails(new Error(asked.status === 404 ? GONE : told.error || `The computer answered ${asked.status}.`));
    };
    asked.send(file);
  });
}

function add(/** @type {File} */ file) {
  const said = h('span', { class: 'quiet small' }, 'waiting'), bar = h('progress', { max: 1, value: 0, 'aria-label': `Progress of ${file.name}` });
  const picture = h('img', { alt: '', src: URL.createObjectURL(file), onerror: () => picture.removeAttribute('src') });
  const again = button('Send again', () => send(), false, { hidden: true, 'aria-label': `Send ${file.name} again` });
  async function once() {
    said.className = 'quiet small';
    said.textContent = 'on its way';
    again.hidden = true;
    bar.hidden = false;
    try {
      if (file.size > LARGEST) throw new Error('It is larger than 64 MB: photograph it with fewer pixels.');
      const told = await sending(file, (share) => { bar.value = share; if (share === 1) said.textContent = 'it is looked at'; });
      said.textContent = told.again ? 'It was there already.' : 'It is on the computer.';
      URL.revokeObjectURL(picture.src);
    } catch (/** @type {any} */ error) {
      said.className = 'bad small';
      said.textContent = error.message;
      again.hidden = false;
    }
    bar.hidden = true;
  }
  const send = () => { turn = turn.then(once); };
  list.prepend(h('li', {}, picture, h('div', {}, h('strong', {}, file.name), said, bar, again)));
  send();
}

function chooser(/** @type {string} */ label, /** @type {boolean} */ main, /** @type {object} */ properties) {
  const input = h('input', { type: 'file', accept: TAKEN, ...properties, onchange() { for (const file of input.files ?? []) add(file); input.value = ''; } });
  return h('label', { class: main ? 'button main' : 'button' }, label, input);
}

document.querySelector('#main')?.replaceChildren(
  h('h1', {}, 'Photograph what you wrote'),
  h('p', {}, 'Each page by itself, from above, in daylight, all four corners in the picture. It goes to the computer whose code you scanned, over your own network, unencrypted, and nowhere else.'),
  h('div', { class: 'choosers' }, chooser('Take a photograph', true, { capture: 'environment' }), chooser('Choose photographs', false, { multiple: true })), list);
