// Shows a page being written at its true speed: strokes appear as their Béziers, which keep time, come to be written.

const time = (/** @type {Element} */ path, /** @type {string} */ name) => parseFloat(path.getAttribute(name) ?? '');

/** The data of a path as far as it is written some milliseconds after its beginning.  @param {Element} path @param {number} ms */
export function writtenTo(path, ms) {
  const n = (path.getAttribute('d')?.match(/-?\d*\.?\d+/g) ?? []).map(Number);
  const spans = (path.getAttribute('data-k') || '').split(' ').map(Number);
  let d = `M${n[0]} ${n[1]}`;
  for (let i = 2, k = 0; i + 5 < n.length && ms > 0; i += 6, k += 1) {
    const [ax, ay, bx, by, cx, cy] = n.slice(i, i + 6);
    const u = Math.min(1, ms / spans[k]);
    const two = (/** @type {number} */ a, /** @type {number} */ b) => a + (b - a) * u;
    const [px, py, qx, qy] = [ax * u, ay * u, two(ax, bx), two(ay, by)];
    const [rx, ry] = [two(bx, cx), two(by, cy)];
    const [sx, sy, tx, ty] = [two(px, qx), two(py, qy), two(qx, rx), two(qy, ry)];
    d += `c${px} ${py} ${sx} ${sy} ${two(sx, tx)} ${two(sy, ty)}`;
    ms -= spans[k];
  }
  return `${d}h.001`;
}

/** The strokes of a page as they were written, whatever layers part them.  @param {Element} svg @returns {SVGGeometryElement[]} */
export function inOrder(svg) {
  return [.../** @type {NodeListOf<SVGGeometryElement>} */ (svg.querySelectorAll('.stroke'))].sort((a, b) => time(a, 'data-t0') - time(b, 'data-t0'));
}

/** Draw a path as a stroke is drawn.  @param {Element} path @param {Element} stroke */
export function alike(path, stroke) {
  for (const name of ['stroke', 'stroke-width']) path.setAttribute(name, stroke.closest(`[${name}]`)?.getAttribute(name) ?? '');
}

const AT_ONCE = 600, LONGEST = 900, EACH = 60; // strokes, and ms in all, in which they appear one after the other; ms each

/** Strokes of a page that are not on the one before appear as they are written, quickly.  @param {Element} svg @param {Element | null} before */
export function appear(svg, before) {
  const old = new Set([...(before?.querySelectorAll('.stroke') ?? [])].map((stroke) => stroke.getAttribute('d')));
  const fresh = inOrder(svg).filter((stroke) => !old.has(stroke.getAttribute('d')));
  if (fresh.length > AT_ONCE || matchMedia('(prefers-reduced-motion: reduce)').matches) return;
  const each = Math.min(EACH, LONGEST / fresh.length);
  fresh.forEach((stroke, at) => {
    stroke.setAttribute('pathLength', '1');
    stroke.style.animation = `draw ${2 * each}ms ${at * each}ms linear both`;
    stroke.addEventListener('animationend', () => { stroke.removeAttribute('pathLength'); stroke.style.animation = ''; });
  });
}

/** Play an SVG page, as fast as `speed` says at the time; `ended` is called at its end. Gives a function that stops it.  @param {SVGSVGElement} svg @param {() => number} speed @param {() => void} ended */
export function play(svg, speed, ended) {
  const strokes = inOrder(svg);
  const moves = [...svg.querySelectorAll('.travel path')];
  const nib = document.createElementNS(svg.namespaceURI, 'path');
  let before = /** @type {number | null} */ (null), t = 0, next = 0, asked = 0;
  for (const part of [...strokes, ...moves]) part.classList.add('later');
  svg.querySelector('.ink')?.append(nib);

  function stop() {
    cancelAnimationFrame(asked);
    nib.remove();
    for (const part of [...strokes, ...moves]) part.classList.remove('later');
    ended();
  }
  function frame(/** @type {number} */ now) {
    t += (now - (before ?? now)) / 1000 * speed();
    before = now;
    for (; next < strokes.length && time(strokes[next], 'data-t1') <= t; next += 1) strokes[next].classList.remove('later');
    for (const move of moves) if (time(move, 'data-t0') <= t) move.classList.remove('later');
    if (next === strokes.length) { stop(); return; }
    const t0 = time(strokes[next], 'data-t0');
    nib.setAttribute('d', t < t0 ? '' : writtenTo(strokes[next], (t - t0) * 1000));
    alike(nib, strokes[next]);
    nib.setAttribute('clip-path', strokes[next].getAttribute('clip-path') || 'none');
    asked = requestAnimationFrame(frame);
  }
  asked = requestAnimationFrame(frame);
  return stop;
}
