"use strict";
// Data, and what all parts of the page share.
const DATA = JSON.parse(document.getElementById("data").textContent);
const R = DATA.results, PICTURES = DATA.pictures;
const METHODS = R.methods || [], POINTS = R.points || [];
const byId = (id) => document.getElementById(id);

/** A number for people: three digits, powers of ten where it is far from one. */
function short(v) {
  if (v === null || v === undefined || !Number.isFinite(v)) return "–";
  if (v === 0) return "0";
  const size = Math.abs(v);
  if (size >= 1e12 || size < 1e-3) return v.toExponential(2);
  for (const [unit, name] of [[1e9, " G"], [1e6, " M"]]) if (size >= unit) return String(Number((v / unit).toPrecision(3))) + name;
  if (size >= 1000) return Math.round(v).toLocaleString("en");
  return String(Number(v.toPrecision(3)));
}
const percent = (v) => (v === null || v === undefined ? "–" : short(100 * v) + " %");

/** An element with attributes and children; texts are never read as HTML. */
function make(name, attributes = {}, ...children) {
  const e = document.createElement(name);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
  e.append(...children);
  return e;
}
function draw(name, attributes = {}, ...children) {
  const e = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
  e.append(...children);
  return e;
}

// What can be drawn against samples and time.
const MEASURES = {
  error: { name: "error (bias and noise)", share: true, line: "error_slope" },
  noise: { name: "noise", share: true, line: "noise_slope" },
  bias: { name: "bias", share: true },
  rmse: { name: "RMSE (radiance)" },
  flip: { name: "FLIP" },
  efficiency: { name: "efficiency, 1 / (relMSE × seconds)", rising: true },
};
const hidden = new Set();
const colour = (m) => `var(--c${m % 8})`;
// Marks differ in form too, for those who do not tell the colours apart.
const FORMS = [
  "M-5 0A5 5 0 1 0 5 0A5 5 0 1 0-5 0Z", "M-4.5-4.5H4.5V4.5H-4.5Z", "M0-6L5.6 4H-5.6Z", "M0-6L6 0L0 6L-6 0Z",
  "M0 6L5.6-4H-5.6Z", "M-2-6H2V-2H6V2H2V6H-2V2H-6V-2H-2Z", "M-6-3L-3-6L0-3L3-6L6-3L3 0L6 3L3 6L0 3L-3 6L-6 3L-3 0Z",
  "M0-6L5.7-1.9L3.5 4.9H-3.5L-5.7-1.9Z",
];
const form = (m) => FORMS[Math.floor(m / 8 + m) % FORMS.length];
const indexOf = (p) => METHODS.findIndex((m) => m.label === p.method);

/** Limits of a logarithmic axis that holds the values, with room at its ends. */
function limits(values) {
  if (!values.length) return [0.1, 10];
  let [low, high] = [Math.min(...values), Math.max(...values)];
  if (high / low < 3) { low /= 2; high *= 2; }
  const room = Math.pow(high / low, 0.06);
  return [low / room, high * room];
}
/** Powers of ten within the limits, or of two where those are few. */
function ticks([low, high]) {
  const all = [];
  for (let k = Math.ceil(Math.log10(low)); k <= Math.log10(high); k++) all.push(Math.pow(10, k));
  if (all.length >= 3) return all;
  const fine = [];
  for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++)
    for (const d of [1, 2, 5]) {
      const v = Number(`${d}e${k}`);
      if (v >= low && v <= high) fine.push(v);
    }
  return fine;
}

const W = 560, H = 400, BOX = { left: 62, right: 14, top: 14, bottom: 44 };

function plot(target, xOf, xName, measure) {
  const spec = MEASURES[measure];
  const shown = POINTS.map((p, i) => ({ p, i, m: indexOf(p), x: xOf(p), e: p[measure] }))
    .filter((q) => !hidden.has(q.m) && q.x > 0 && q.e && q.e.value > 0);
  // Bars that reach to zero end at the frame and do not stretch the axis.
  const ys = shown.flatMap((q) => [q.e.value, ...q.e.ci95.filter((v) => v > q.e.value / 3 && v < q.e.value * 3)]);
  const xl = limits(shown.map((q) => q.x)), yl = limits(ys);
  const px = (x) => BOX.left + (W - BOX.left - BOX.right) * Math.log(x / xl[0]) / Math.log(xl[1] / xl[0]);
  const py = (y) => H - BOX.bottom - (H - BOX.top - BOX.bottom) * Math.log(y / yl[0]) / Math.log(yl[1] / yl[0]);
  const svg = draw("svg", { viewBox: `0 0 ${W} ${H}`, role: "group", "aria-label": `${spec.name} against ${xName}` });
  const clip = target.id + "-clip";
  svg.append(draw("defs", {}, draw("clipPath", { id: clip }, draw("rect", {
    x: BOX.left, y: BOX.top, width: W - BOX.left - BOX.right, height: H - BOX.top - BOX.bottom }))));
  const tickText = (v) => (spec.share ? percent(v) : short(v));
  for (const v of ticks(xl)) {
    svg.append(draw("line", { class: "grid", x1: px(v), x2: px(v), y1: BOX.top, y2: H - BOX.bottom }),
      draw("text", { x: px(v), y: H - BOX.bottom + 16, "text-anchor": "middle" }, short(v)));
  }
  for (const v of ticks(yl)) {
    svg.append(draw("line", { class: "grid", x1: BOX.left, x2: W - BOX.right, y1: py(v), y2: py(v) }),
      draw("text", { x: BOX.left - 6, y: py(v) + 4, "text-anchor": "end" }, tickText(v)));
  }
  svg.append(draw("rect", { class: "frame", x: BOX.left, y: BOX.top, width: W - BOX.left - BOX.right, height: H - BOX.top - BOX.bottom }),
    draw("text", { x: (W + BOX.left) / 2, y: H - 8, "text-anchor": "middle" }, xName));
  const inside = draw("g", { "clip-path": `url(#${clip})` });
  svg.append(inside);
  const samples = target.id === "plot-samples";
  if (shown.length && !spec.rising) guides(inside, shown, xl, px, py);
  if (!samples && measure === "error") front(inside, shown, px, py);
  const marks = [];
  METHODS.forEach((method, m) => {
    const of = shown.filter((q) => q.m === m).sort((a, b) => a.x - b.x);
    if (!of.length) return;
    inside.append(draw("path", { class: "curve", stroke: colour(m), "data-method": method.label,
      d: "M" + of.map((q) => `${px(q.x)} ${py(q.e.value)}`).join("L") }));
    const line = samples && spec.line && method[spec.line];
    if (line && line.ends) {
      const [[x0, y0], [x1, y1]] = line.ends;
      inside.append(draw("line", { class: "fit", stroke: colour(m), x1: px(x0), y1: py(y0), x2: px(x1), y2: py(y1) }));
    }
    for (const q of of) {
      const low = q.e.ci95[0] > 0 ? q.e.ci95[0] : yl[0], high = q.e.ci95[1] ?? yl[1];
      inside.append(draw("line", { class: "bars", stroke: colour(m), x1: px(q.x), x2: px(q.x), y1: py(low), y2: py(high) }));
    }
    of.forEach((q, k) => marks.push(mark(q, k === 0, px(q.x), py(q.e.value))));
  });
  svg.append(...marks);
  if (!shown.length) svg.append(draw("text", { x: W / 2, y: H / 2, "text-anchor": "middle" },
    POINTS.every((p) => p.error.value === 0) ? "no error at any setting" : "nothing above zero to draw"));
  target.replaceChildren(svg);
}

/** N^-1/2 and N^-1 from the first of all marks. */
function guides(g, shown, xl, px, py) {
  const x0 = Math.min(...shown.map((q) => q.x));
  const y0 = Math.max(...shown.filter((q) => q.x <= x0 * 1.5).map((q) => q.e.value)) * 1.15;
  for (const [power, name] of [[-0.5, "−1/2"], [-1, "−1"]]) {
    const end = xl[1], y = y0 * Math.pow(end / x0, power);
    const line = draw("line", { class: "guide", x1: px(x0), y1: py(y0), x2: px(end), y2: py(y) });
    // The name stands at the line, where it is still in the box.
    const at = Math.min(0.93, 0.93 * (H - BOX.bottom - BOX.top) / Math.max(1, py(y) - py(y0)));
    const tx = px(x0) + at * (px(end) - px(x0)), ty = py(y0) + at * (py(y) - py(y0));
    g.append(line, draw("text", { x: tx, y: ty - 5 }, "N", draw("tspan", { dy: "-4", "font-size": "9" }, name)));
  }
}

/** The settings that no other beats in time and error, as steps. */
function front(g, shown, px, py) {
  const best = shown.filter((q) => q.p.front).sort((a, b) => a.x - b.x);
  if (best.length < 2) return;
  let d = `M${px(best[0].x)} ${py(best[0].e.value)}`;
  for (const q of best.slice(1)) d += `H${px(q.x)}V${py(q.e.value)}`;
  g.append(draw("path", { class: "front", d }));
}

const range = (e, f) => (e ? `${f(e.value)} (${f(e.ci95[0])} to ${f(e.ci95[1])})` : "–");

function describe(p) {
  return [
    `${p.method}, ${p.amount}`,
    `error ${range(p.error, percent)}`,
    `bias ${range(p.bias, percent)}`,
    `noise ${range(p.noise, percent)}`,
    `RMSE ${short(p.rmse.value)}, relMSE ${short(p.relmse.value)}, FLIP ${p.flip_resolved === false ? "≲ " : ""}${short(p.flip.value)}`,
    `${short(p.spp)} spp, ${short(p.seconds.value)} s, ${short(p.rays)} rays`,
  ].join("\n");
}

function mark(q, first, x, y) {
  const text = describe(q.p);
  const e = draw("path", { class: "mark", d: form(q.m), transform: `translate(${x} ${y})`, fill: colour(q.m), role: "img",
    tabindex: first ? "0" : "-1", "aria-label": text.replaceAll("\n", "; "), "data-point": q.i });
  const show = () => tip(e, text);
  e.addEventListener("pointerenter", show);
  e.addEventListener("pointerleave", () => tip(null));
  e.addEventListener("focus", show);
  e.addEventListener("blur", () => tip(null));
  e.addEventListener("click", () => { e.focus(); choosePoint(q.i); });
  e.addEventListener("keydown", (event) => walk(event, e, q));
  return e;
}

/** Arrow keys go along a curve, up and down to the next method; Enter shows the setting's pictures below. */
function walk(event, from, q) {
  const all = [...from.ownerSVGElement.querySelectorAll(".mark")];
  const of = (m) => all.filter((e) => indexOf(POINTS[e.dataset.point]) === m);
  const own = of(q.m), k = own.indexOf(from);
  let to = null;
  if (event.key === "ArrowRight") to = own[k + 1];
  else if (event.key === "ArrowLeft") to = own[k - 1];
  else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
    const step = event.key === "ArrowUp" ? METHODS.length - 1 : 1;
    for (let m = (q.m + step) % METHODS.length; m !== q.m && !to; m = (m + step) % METHODS.length) {
      const there = of(m);
      to = there[Math.min(k, there.length - 1)];
    }
  } else if (event.key === "Enter" || event.key === " ") choosePoint(q.i);
  else if (event.key === "Escape") tip(null);
  else return;
  event.preventDefault();
  if (to) to.focus();
}

function tip(at, text) {
  const box = byId("tip");
  box.hidden = !at;
  if (!at) return;
  box.textContent = text;
  const r = at.getBoundingClientRect(), wide = document.documentElement.clientWidth;
  box.style.left = Math.max(8, Math.min(r.right + 8, wide - box.offsetWidth - 8)) + scrollX + "px";
  box.style.top = r.bottom + 8 + scrollY + "px";
}

function redraw() {
  const measure = byId("measure").value;
  plot(byId("plot-samples"), (p) => p.spp, "samples per pixel", measure);
  plot(byId("plot-time"), (p) => p.seconds.value, "seconds", measure);
}

function startPlots() {
  for (const [key, { name }] of Object.entries(MEASURES)) byId("measure").append(make("option", { value: key }, name));
  byId("measure").addEventListener("change", redraw);
  METHODS.forEach((method, m) => {
    const icon = draw("svg", { width: 14, height: 14, viewBox: "-7 -7 14 14", "aria-hidden": "true" }, draw("path", { d: form(m), fill: colour(m) }));
    const button = make("button", { type: "button", "aria-pressed": "true" }, icon, method.label);
    button.addEventListener("click", () => {
      if (!hidden.delete(m)) hidden.add(m);
      button.setAttribute("aria-pressed", String(!hidden.has(m)));
      redraw();
    });
    byId("legend").append(button);
  });
  redraw();
}
