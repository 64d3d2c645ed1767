// Strokes on a canvas, as a style draws them.

/** @typedef {{x: number[], y: number[], t?: number[], speed: number[], width?: number[], nib?: number, turn: number}} Line */
/** @typedef {(context: CanvasRenderingContext2D, width: number, height: number) => void} Paint */
import { h } from './dom.js';

export const INK = '#20223a';
const EDGE = 0.8; // mm around a word, of which broad pens take a part

/** Strokes as far as they are drawn at a time (s); all of them without one.  @param {CanvasRenderingContext2D} context @param {Line[]} strokes @param {string} colour */
export function draw(context, strokes, colour, until = Infinity) {
  context.strokeStyle = context.fillStyle = colour;
  context.lineCap = context.lineJoin = 'round';
  for (const { x, y, t, width, nib, turn } of strokes) {
    const [ex, ey] = nib ? [(nib / 2) * Math.cos(turn), (nib / 2) * Math.sin(turn)] : [0, 0];
    for (let i = 1; i < x.length && !(t && t[i] > until); i += 1) {
      if (nib) {
        context.lineWidth = nib * 0.06;
        context.beginPath();
        context.moveTo(x[i - 1] - ex, y[i - 1] - ey); context.lineTo(x[i - 1] + ex, y[i - 1] + ey);
        context.lineTo(x[i] + ex, y[i] + ey); context.lineTo(x[i] - ex, y[i] - ey); context.closePath();
        context.fill(); context.stroke();
      } else if (width) {
        context.lineWidth = (width[i - 1] + width[i]) / 2;
        context.beginPath(); context.moveTo(x[i - 1], y[i - 1]); context.lineTo(x[i], y[i]); context.stroke();
      }
    }
    if (!width && !nib) {
      context.beginPath();
      x.forEach((at, i) => (i ? context.lineTo(at, y[i]) : context.moveTo(at, y[i])));
      context.stroke();
    }
  }
}

/** Strokes as large as there is room, in the middle.  @param {CanvasRenderingContext2D} context @param {number} width @param {number} height @param {Line[]} strokes */
export function paintStrokes(context, width, height, strokes) {
  const [x, y] = [strokes.flatMap((one) => one.x), strokes.flatMap((one) => one.y)];
  const [left, right, top, low] = [Math.min(...x) - EDGE, Math.max(...x) + EDGE, Math.min(...y) - EDGE, Math.max(...y) + EDGE];
  const by = Math.min(width / (right - left), height / (low - top));
  context.translate((width - by * (left + right)) / 2, (height - by * (top + low)) / 2); context.scale(by, by);
  draw(context, strokes, INK);
}

/** A canvas that is as sharp as the screen; `paint` is given its context in CSS pixels, and its size.  @param {string} label @param {Paint} paint */
export function surface(label, paint) {
  const canvas = h('canvas', label ? { role: 'img', 'aria-label': label } : { 'aria-hidden': 'true' });
  let size = /** @type {DOMRectReadOnly | null} */ (null); // as it was laid out last: to ask for it after a change would have the page laid out once more
  new ResizeObserver(([entry]) => { size = entry.contentRect; }).observe(canvas);
  const again = () => {
    const { width, height } = size || canvas.getBoundingClientRect();
    if (!width || !height) return;
    const fine = devicePixelRatio, [wide, high] = [Math.round(width * fine), Math.round(height * fine)];
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; } // makes it anew
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    context.setTransform(fine, 0, 0, fine, 0, 0);
    context.globalAlpha = 1;
    context.clearRect(0, 0, width, height);
    paint(context, width, height);
  };
  return { canvas, again };
}
