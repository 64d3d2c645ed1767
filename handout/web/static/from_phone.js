// Photographs that a phone sends: a switch, the code that it scans, and what came.

/** @typedef {{link: string, phones: number, until: number, code: {size: number, path: string}, photographs: {id: string, name: string}[]}} Live */
/** @typedef {{id: string, state: string, live: Live}} Open */
import { blob, follow, request } from './api.js';
import { button, guarded, h, refusal, s, say } from './dom.js';

/** `given` hears each photograph once: {id, name, small}, its small picture. It ends with `signal`.  @param {(one: {id: string, name: string, small: HTMLImageElement}) => void} given @param {AbortSignal} signal */
export function fromPhone(given, signal) {
  const place = h('div', { class: 'phone' }), wrong = refusal(), known = new Set();
  const on = button('Photograph with your phone', () => begin('POST'));

  function hear(/** @type {Open} */ { id, state, live }) {
    if (state === 'running') showCode(id, live); else place.replaceChildren(on, wrong);
    for (const one of live.photographs.filter((each) => !known.has(each.id))) {
      known.add(one.id);
      const small = h('img', { class: 'small-scan', alt: `The photograph ${one.name}` });
      given({ ...one, small });
      blob(`/api/uploads/${one.id}/picture`, 'image/jpeg').then((data) => { small.src = URL.createObjectURL(data); }).catch(() => {});
    }
  }

  const phones = h('p', { role: 'status' });
  function showCode(/** @type {string} */ id, /** @type {Live} */ live) {
    phones.textContent = live.phones ? `${live.phones === 1 ? 'One phone has' : `${live.phones} phones have`} opened the page. ${live.photographs.length || 'No'} photograph${live.photographs.length === 1 ? '' : 's'} came.${live.phones > 1 ? ' If only one of them is yours, switch it off.' : ''}` : 'No phone has opened the page yet.';
    if (place.dataset.link === live.link && place.querySelector('svg')) return;
    place.dataset.link = live.link;
    const { size, path } = live.code;
    place.replaceChildren(
      s('svg', { viewBox: `-4 -4 ${size + 8} ${size + 8}`, role: 'img', 'aria-label': `A code for the camera of a phone: ${live.link}` }, s('path', { d: path })),
      h('div', {}, h('h2', {}, 'Scan this with your phone’s camera'),
        h('p', {}, `The phone has to be in the same network as this computer. It can only send photographs here, until ${new Date(live.until * 1000).toLocaleTimeString([], { hour: '2-digit', minute: '2-digit' })} or until you switch it off.`),
        h('p', { class: 'quiet' }, 'The phone will say “Not secure”: the photographs cross your network unencrypted, and who is in it could look at them. In a network that others use, too, give the pictures as files.'),
        h('details', {}, h('summary', {}, 'Nothing happens on the phone?'), h('p', { class: 'quiet' }, 'A network for guests often keeps devices apart: use the usual one. If this computer’s firewall asks whether handout or Python may be reached, allow it in private networks. Or type this address: ', h('code', {}, live.link))),
        phones, button('Switch it off', () => request('DELETE', `/api/tasks/${id}`).catch((error) => say(error.message)))));
  }

  const begin = guarded(wrong, async (/** @type {string} */ method) => {
    try {
      const { task } = await request(method, '/api/phone', undefined, signal);
      if (!task) return;
      hear(task);
      if (task.state === 'running') for await (const snapshot of follow(task.id, signal)) hear(/** @type {any} */ (snapshot));
    } catch (/** @type {any} */ error) {
      place.replaceChildren(on, wrong);
      throw error;
    }
  });

  place.append(on, wrong);
  begin('GET');
  return place;
}
