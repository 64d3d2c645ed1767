// Requests to the server, with the session's key; refusals are thrown as the server's own sentences.

/** @import { Heard, Snapshot } from './types' */
const KEPT = 'handout-key';
const CLOSED = 'The studio does not answer: it was closed, or its terminal was. Start it again; what was kept is kept.';
const RESTARTED = 'The studio was started again since: open the link that it printed in its terminal. A page that is open goes on after that.';
const LASTS = 20000; // characters of what is kept even where its page is left: browsers promise 64 kB
const AGAIN = [200, 500, 1000, 2000, 4000]; // ms until a stream that broke is asked for anew, each time it breaks

export class Refusal extends Error {
  constructor(/** @type {number} */ status, /** @type {string} */ sentence) { super(sentence); this.status = status; }
}

export const key = () => localStorage.getItem(KEPT);

/** Take the token out of the address and make it a session, or go on with the one there is. */
export async function open() {
  const token = location.hash.slice(1);
  if (/^[\w-]{43}$/.test(token)) {
    history.replaceState(null, '', location.pathname);
    try {
      const { key: own, start } = await request('POST', '/api/session', { token });
      localStorage.setItem(KEPT, own);
      if (start) location.hash = start;
    } catch (/** @type {any} */ error) {
      if (!key()) throw error;
    }
  }
}

/** @param {string} method @param {string} path @param {any} [body] @param {Record<string, string>} [headers] @param {AbortSignal} [signal] */
async function answer(method, path, body, headers = {}, signal = undefined) {
  const sent = /** @type {any} */ ({ method, headers: { ...headers, Authorization: `Bearer ${key() || ''}` }, signal });
  if (body instanceof Blob) sent.body = body;
  else if (body !== undefined) { sent.body = JSON.stringify(body); sent.headers['Content-Type'] = 'application/json'; sent.keepalive = method === 'PUT' && sent.body.length < LASTS; }
  let got;
  try {
    got = await fetch(path, sent);
  } catch (/** @type {any} */ error) {
    if (error.name === 'AbortError') throw error;
    throw new Refusal(0, CLOSED);
  }
  if (!got.ok) {
    const told = await got.json().catch(() => ({}));
    throw new Refusal(got.status, (got.status === 401 && key() && path !== '/api/session' && RESTARTED) || told.error || `The server answered ${got.status}.`);
  }
  return got;
}

/** @param {string} method @param {string} path @param {any} [body] @param {AbortSignal} [signal] @returns {Promise<any>} */
export async function request(method, path, body, signal) {
  return (await answer(method, path, body, {}, signal)).json();
}

/** @param {string} path @param {string} [accept] @param {string} [method] @param {any} [body] @param {AbortSignal} [signal] */
export async function blob(path, accept, method = 'GET', body = undefined, signal = undefined) {
  return (await answer(method, path, body, accept ? { Accept: accept } : {}, signal)).blob();
}

/** The id of a file that was sent; the studio keeps it, until it is deleted, when it is started anew, too.  @param {File} file @param {AbortSignal} [signal] @returns {Promise<string>} */
export const upload = async (file, signal) => (await request('POST', `/api/uploads?kept=true&name=${encodeURIComponent(file.name)}`, file, signal)).id;

/** @param {string} id */
export const takeAway = (id) => request('DELETE', `/api/uploads/${id}`).catch(() => {});

/** Ids of the files that are still there.  @returns {Promise<Set<string>>} */
export const stillThere = async () => new Set((await request('GET', '/api/uploads')).uploads.map((/** @type {{id: string}} */ one) => one.id));

/** @param {string} path @param {AbortSignal} [signal] */
export async function text(path, signal) {
  return (await answer('GET', path, undefined, {}, signal)).text();
}

/** Begin a task, hear its snapshots, and give the last one; aborting cancels it. Without `heard` it is only begun.  @param {string} path @param {any} body @param {Heard | null} [heard] @param {AbortSignal} [signal] @returns {Promise<Snapshot>} */
export async function task(path, body, heard, signal, method = 'POST') {
  const begun = await (await answer(method, path, body, { Prefer: 'respond-async' }, signal)).json();
  return heard ? heardOut(begun, heard, signal) : begun;
}

/** The same of a task that was begun.  @param {Snapshot} begun @param {Heard} heard @param {AbortSignal} [signal] @returns {Promise<Snapshot>} */
export async function heardOut(begun, heard, signal) {
  const cancel = () => request('DELETE', `/api/tasks/${begun.id}`).catch(() => {});
  signal?.addEventListener('abort', cancel);
  try {
    let last = begun;
    for await (const snapshot of events(`/api/tasks/${begun.id}/events`, signal)) heard(last = snapshot);
    if (last.state === 'cancelled') throw new DOMException('cancelled', 'AbortError');
    if (last.state !== 'done') throw new Refusal(422, last.error ?? '');
    return last;
  } finally {
    signal?.removeEventListener('abort', cancel);
  }
}

/** @param {string} id @param {AbortSignal} [signal] */
export const follow = (id, signal) => events(`/api/tasks/${id}/events`, signal);

/** The snapshots of a task to its last. What breaks, as where a computer sleeps, is taken up again: each says all there is.  @param {string} path @param {AbortSignal} [signal] @returns {AsyncGenerator<Snapshot>} */
async function* events(path, signal) {
  for (let broke = 0; ; broke += 1) {
    try {
      for await (const snapshot of stream(path, signal)) {
        broke = 0;
        yield snapshot;
        if (!['waiting', 'running'].includes(snapshot.state)) return;
      }
    } catch (/** @type {any} */ error) {
      if (error.name === 'AbortError' || error.status) throw error;
    }
    if (broke >= AGAIN.length) throw new Refusal(0, CLOSED);
    await new Promise((done) => { setTimeout(done, AGAIN[broke]); });
    signal?.throwIfAborted();
  }
}

/** @param {string} path @param {AbortSignal} [signal] @returns {AsyncGenerator<Snapshot>} */
async function* stream(path, signal) {
  const reader = /** @type {ReadableStream<any>} */ ((await answer('GET', path, undefined, {}, signal)).body).pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const parts = (rest + value).split('\n\n');
    rest = /** @type {string} */ (parts.pop());
    for (const part of parts) if (part.startsWith('data: ')) yield JSON.parse(part.slice(6));
  }
}

export const fileOf = (/** @type {{id: string}} */ done, /** @type {number} */ number = 0) => `/api/tasks/${done.id}/files/${number}`;
