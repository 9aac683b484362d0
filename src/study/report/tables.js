// Head, tables and commands.

const cell = (e, f) => (e ? [f(e.value), make("br"), make("span", { class: "range" }, `${f(e.ci95[0])} to ${f(e.ci95[1])}`)] : ["–"]);
const three = (v) => (v === null || v === undefined ? "–" : v.toFixed(3));

function biasText(m) {
  const b = m.bias;
  if (m.exact || !b) return m.exact ? "no error" : "–";
  if (b.kind === "not seen") return `not seen, below ${percent(b.below)}`;
  if (b.kind === "falls") return `${percent(b.last.value)}, falls like N^${three(b.slope.value)}`;
  return `${percent(b.last.value)}, stays`;
}

function floorText(m) {
  if (!m.bias || m.bias.kind !== "stays" || m.exact) return "none seen";
  return m.bias.floor_spp ? short(m.bias.floor_spp) + " spp" : "unknown";
}

function forecastText(f) {
  if (f.kind === "exact") return ["at once"];
  if (f.kind === "never") return ["never: bias " + percent(f.bias)];
  if (f.kind === "unknown") return f.why ? ["none", make("br"), make("span", { class: "range why" }, f.why)] : ["–"];
  const times = (e) => `${short(Math.max(1, e.ci95[0]))} to ${short(e.ci95[1])}`;
  return [`${short(Math.max(1, f.spp.value))} spp, ${short(f.seconds.value)} s`, make("br"), make("span", { class: "range" }, times(f.spp) + " spp")];
}

function row(cells, head) {
  return make("tr", {}, ...cells.map((c) => make(head ? "th" : "td", head ? { scope: "col" } : {}, ...(Array.isArray(c) ? c : [c]))));
}

function startTables() {
  byId("title").textContent = `${R.scene}: a study of convergence`;
  const ref = R.reference;
  const own = ref.error === null ? "whose own error is not known" : `whose own error is ${percent(ref.error)}`;
  const times = ref.times_below;
  const enough = ref.error > 0 && times !== null && times !== undefined ? `, ${short(times)} times below the smallest one studied` : "";
  const from = ref.method ? `made by ${ref.method} with ${short(ref.spp)} spp` : ref.file;
  byId("facts").textContent = `luxel ${R.version}; ${R.resolution.join(" × ")} pixels, ${R.runs} runs of each setting, ` +
    `${R.threads} threads. Reference: ${from}, ${own}${enough}.`;

  const warn = [];
  if (ref.ten_times_below === false) warn.push(times > 1
    ? `The reference's error should be 10 times below the smallest one studied. Of the smallest relMSE as measured, ${percent(1 / (1 + times * times))} was the reference's: it is taken off errors, bias and slopes, and its doubt is in their intervals.`
    : "The reference's error is not below the smallest one studied, which is hardly seen beside it: those figures say little.");
  if (POINTS.some((p) => p.flip_resolved === false)) warn.push(`The reference's noise alone makes a FLIP of ${short(ref.flip_floor)}, which cannot be taken off: FLIPs below three times that are marked ≲ and are not resolved.`);
  if (ref.error === null) warn.push("The reference counts as exact, since it does not tell its own error: what it has of that is in all figures.");
  warn.push(...(R.findings ?? []).map((t) => t[0].toUpperCase() + t.slice(1) + "."));
  byId("warnings").append(...warn.map((t) => make("p", { class: "warning" }, t)));

  const wanted = METHODS.length ? METHODS[0].forecasts.map((f) => f.wanted) : [];
  byId("findings").append(make("thead", {}, row(["method", "slope of error", "slope of noise", "bias", "bias floor from", "best efficiency",
    ...wanted.map((w) => `for ${percent(w)}`)], true)), make("tbody", {}, ...METHODS.map((m) => {
    const slope = (l) => (l ? cell({ value: l.slope, ci95: l.ci95 }, three) : m.exact ? "none" : "–");
    const best = Math.max(0, ...POINTS.filter((p) => p.method === m.label && p.efficiency).map((p) => p.efficiency.value));
    return row([m.label + (m.biased ? " (biased)" : ""), slope(m.error_slope), slope(m.noise_slope), biasText(m), floorText(m),
      best ? short(best) : "–", ...m.forecasts.map(forecastText)]);
  })));

  const columns = [
    ["method", (p) => p.method], ["setting", (p) => p.amount], ["spp", (p) => short(p.spp)],
    ["seconds", (p) => cell(p.seconds, short)], ["rays", (p) => short(p.rays)],
    ["memory, MiB", (p) => (p.peak_memory_bytes ? short(p.peak_memory_bytes / 1048576) : "–")],
    ["error", (p) => cell(p.error, percent)], ["bias", (p) => cell(p.bias, percent)], ["noise", (p) => cell(p.noise, percent)],
    ["brightness", (p) => cell(p.brightness, percent)], ["relMSE", (p) => cell(p.relmse, short)], ["RMSE", (p) => cell(p.rmse, short)],
    ["FLIP", (p) => { const c = cell(p.flip, short); return p.flip_resolved === false ? ["≲ " + c[0], ...c.slice(1)] : c; }], ["efficiency", (p) => cell(p.efficiency, short)], ["claims held", (p) => (p.claims_held[1] ? p.claims_held.join(" of ") : "–")],
    ["front", (p) => (p.front ? "yes" : "")],
  ];
  byId("table").append(make("thead", {}, row(columns.map(([name]) => name), true)),
    make("tbody", {}, ...POINTS.map((p) => row(columns.map(([, f]) => f(p))))));

  byId("command").textContent = R.command;
  byId("commands").textContent = POINTS.map((p) => p.command).join("\n");
  byId("copy").addEventListener("click", copyTable);
}

/** The table as text with tabs, with all digits: what spreadsheets take. */
function tableText() {
  const measures = ["seconds", "error", "bias", "noise", "brightness", "relmse", "rmse", "flip", "efficiency"];
  const head = ["method", "setting", "spp", "rays", "peak_memory_bytes", ...measures.flatMap((m) => [m, m + "_low", m + "_high"]), "front"];
  const lines = POINTS.map((p) => [p.method, p.amount, p.spp, p.rays, p.peak_memory_bytes ?? "",
    ...measures.flatMap((m) => (p[m] ? [p[m].value, ...p[m].ci95.map((v) => v ?? "")] : ["", "", ""])), p.front]);
  return [head, ...lines].map((l) => l.join("\t")).join("\n") + "\n";
}

async function copyTable() {
  const text = tableText();
  let done = false;
  try {
    await navigator.clipboard.writeText(text);
    done = true;
  } catch {
    // Pages opened from a file may not use the clipboard; the old way still works.
    const area = make("textarea", { readonly: "" });
    area.value = text;
    document.body.append(area);
    area.select();
    done = document.execCommand("copy");
    area.remove();
    byId("copy").focus();
  }
  byId("copied").textContent = done ? `${POINTS.length} lines copied` : "the browser does not allow copying: results.csv has the same";
}

startTables();
startPlots();
startPictures();
