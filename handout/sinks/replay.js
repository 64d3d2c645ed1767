(function () {
  'use strict';
  var svg = (document.currentScript && document.currentScript.ownerSVGElement) || document.documentElement;
  var nib = null, began = null, next = 0;

  function time(path, name) { return parseFloat(path.getAttribute(name)); }
  var strokes = Array.prototype.slice.call(svg.querySelectorAll('.stroke'));
  strokes.sort(function (a, b) { return time(a, 'data-t0') - time(b, 'data-t0'); });  /* of all layers */

  function mix(a, b, u) { return a + (b - a) * u; }

  /* the path as far as it is written `ms` milliseconds after its beginning */
  function cut(path, ms) {
    var n = path.getAttribute('d').match(/-?\d*\.?\d+/g).map(Number);
    var spans = (path.getAttribute('data-k') || '').split(' ').map(Number);
    var d = 'M' + n[0] + ' ' + n[1];
    for (var i = 2, k = 0; i + 5 < n.length; i += 6, k += 1) {
      var c = n.slice(i, i + 6);
      if (ms < spans[k]) {
        var u = ms / spans[k], half = [], j;
        for (j = 0; j < 2; j += 1) {
          var a = c[j] * u, m = mix(c[j], c[j + 2], u), z = mix(c[j + 2], c[j + 4], u);
          var b = mix(a, m, u), e = mix(m, z, u);
          half[j] = a; half[j + 2] = b; half[j + 4] = mix(b, e, u);
        }
        return d + 'c' + half.join(' ');
      }
      d += 'c' + c.join(' ');
      ms -= spans[k];
    }
    return d + 'h.001';
  }

  function frame(now) {
    if (began === null) { return; }
    if (began < 0) { began = now; }
    var t = (now - began) / 1000;
    while (next < strokes.length && time(strokes[next], 'data-t1') <= t) {
      strokes[next].classList.remove('later');
      next += 1;
    }
    if (next === strokes.length) { stop(); return; }
    var path = strokes[next], t0 = time(path, 'data-t0');
    nib.setAttribute('d', t < t0 ? '' : cut(path, (t - t0) * 1000));
    nib.setAttribute('clip-path', path.getAttribute('clip-path') || 'none');
    ['stroke', 'stroke-width'].forEach(function (name) {
      nib.setAttribute(name, path.closest('[' + name + ']').getAttribute(name));
    });
    window.requestAnimationFrame(frame);
  }

  function play() {
    stop();
    for (var i = 0; i < strokes.length; i += 1) { strokes[i].classList.add('later'); }
    svg.classList.add('playing');
    nib = document.createElementNS(svg.namespaceURI, 'path');
    nib.setAttribute('class', 'nib');
    svg.querySelector('.ink').appendChild(nib);
    began = -1; next = 0;
    window.requestAnimationFrame(frame);
  }

  function stop() {
    for (var i = 0; i < strokes.length; i += 1) { strokes[i].classList.remove('later'); }
    svg.classList.remove('playing');
    if (nib) { nib.parentNode.removeChild(nib); }
    nib = began = null;
  }

  function asked() { if (/\bplay\b/.test(window.location.hash)) { play(); } }

  svg.addEventListener('click', function () { if (began === null) { play(); } else { stop(); } });
  window.addEventListener('keydown', function (event) {
    if (event.ctrlKey || event.metaKey || event.altKey) { return; }
    if (event.key === 'p') { if (began === null) { play(); } else { stop(); } }
    if (event.key === 't') { svg.classList.toggle('show-travel'); }
  });
  window.addEventListener('hashchange', asked);
  asked();
}());
