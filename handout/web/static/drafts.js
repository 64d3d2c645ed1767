// What is being written or bent on a page: kept in the browser at once, and by the studio within a second, so that
// whichever of the two is killed, the other has it.  The newer one counts.

import { request } from './api.js';

const WAIT = 400; // ms from a change to its keeping by the studio; further changes meanwhile go with it
const waiting = new Map();
const ELSEWHERE = 'Another window changed this since. What you do here is not kept: load the page anew to go on from there.';
const since = /** @type {Map<string, number>} */ (new Map()); // name → when what it goes on from was kept
const elsewhere = new Set(); // names of what another window changed since it was shown here

const without = (/** @type {string | null} */ draft) => JSON.stringify({ ...JSON.parse(draft || '{}'), kept_at: 0 });
addEventListener('storage', ({ key, oldValue, newValue }) => {
  if (key?.startsWith('handout-') && newValue?.includes('kept_at') && without(oldValue) !== without(newValue)) elsewhere.add(key.slice('handout-'.length));
});

function here(/** @type {string} */ name) {
  try {
    return JSON.parse(localStorage.getItem(`handout-${name}`) || '{}');
  } catch {
    return {};
  }
}

/** @param {string} name @returns {Promise<any>} */
export async function kept(name) {
  elsewhere.delete(name);
  const own = here(name);
  const { draft } = await request('GET', `/api/drafts/${name}`).catch(() => ({}));
  since.set(name, Math.max(draft?.kept_at || 0, own.kept_at || 0));
  return (draft?.kept_at || 0) > (own.kept_at || 0) ? draft : own;
}

/** What was left in a form of this browser.  @param {string} name @returns {any} */
export const formValues = (name) => here(`form-${name}`);

/** Keep some of what is in a form.  @param {string} name @param {object} values */
export const keepForm = (name, values) => localStorage.setItem(`handout-form-${name}`, JSON.stringify({ ...formValues(name), ...values }));

/** Controls of a form as they were left in this browser, and from now on kept as they are changed.  @param {string} name @param {Record<string, HTMLInputElement | HTMLSelectElement | HTMLTextAreaElement>} controls */
export function remember(name, controls) {
  const before = formValues(name);
  for (const [id, control] of Object.entries(controls)) {
    const value = control.type === 'checkbox' ? 'checked' : 'value', usual = /** @type {any} */ (control)[value];
    if (id in before) /** @type {any} */ (control)[value] = before[id];
    if (control.tagName === 'SELECT' && control.value !== before[id]) control.value = usual; // a choice that is gone
    control.addEventListener('input', () => keepForm(name, { [id]: /** @type {any} */ (control)[value] }));
  }
}

/** A form is done: it begins anew.  @param {string} name */
export const forget = (name) => localStorage.removeItem(`handout-form-${name}`);

/** Keep values under a name; `place` shows why the studio could not.  @param {string} name @param {object} values @param {HTMLElement} place */
export function keep(name, values, place) {
  if (elsewhere.has(name)) { place.textContent = ELSEWHERE; return; }
  const draft = { ...values, kept_at: Date.now() };
  try {
    localStorage.setItem(`handout-${name}`, JSON.stringify(draft));
  } catch { /* the browser keeps nothing here: the studio does */ }
  const under_way = waiting.has(name);
  waiting.set(name, draft);
  if (under_way) return;
  setTimeout(async () => {
    const latest = waiting.get(name);
    waiting.delete(name);
    try {
      await request('PUT', `/api/drafts/${name}`, { draft: latest, since: since.get(name) ?? 0 });
      since.set(name, latest.kept_at);
      place.textContent = '';
    } catch (/** @type {any} */ error) {
      if (error.status === 409) elsewhere.add(name); // by another browser, which this one does not hear of
      place.textContent = error.status === 409 ? ELSEWHERE : [0, 401].includes(error.status) ? '' : error.message; // that it is gone the page says itself
    }
  }, WAIT);
}
