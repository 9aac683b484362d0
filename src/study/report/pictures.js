// The comparison with a divider, and the maps of the error.

/** Fills a list with the reference, if wanted, and all settings. */
function listPoints(select, withReference) {
  if (withReference) select.append(make("option", { value: "reference" }, "reference"));
  METHODS.forEach((method) => {
    const group = make("optgroup", { label: method.label });
    POINTS.forEach((p, i) => {
      if (p.method === method.label) group.append(make("option", { value: i }, `${p.method}, ${p.amount}`));
    });
    select.append(group);
  });
}

function pictureOf(value) {
  return value === "reference" ? PICTURES.reference : PICTURES.points[value].run;
}

function showPair() {
  for (const side of ["left", "right"]) {
    const select = byId(side), img = byId("img-" + side);
    img.src = pictureOf(select.value);
    img.alt = select.selectedOptions[0] ? select.selectedOptions[0].textContent : "";
  }
}

function split(value) {
  byId("slider").value = value;
  byId("pair").style.setProperty("--split", value + "%");
  byId("slider").setAttribute("aria-valuetext", `${Math.round(value)} % of the width shows the left picture`);
}

function zoom() {
  const factor = Math.pow(2, Number(byId("zoom").value)), image = byId("img-left"), view = byId("viewport"), pair = byId("pair");
  byId("zoom-value").textContent = Number(factor.toPrecision(2)) + "×";
  // What is in the middle stays there.
  const [cx, cy] = [(view.scrollLeft + view.clientWidth / 2) / (pair.offsetWidth || 1), (view.scrollTop + view.clientHeight / 2) / (pair.offsetHeight || 1)];
  pair.style.width = factor * (image.naturalWidth || R.resolution[0]) + "px";
  pair.style.height = factor * (image.naturalHeight || R.resolution[1]) + "px";
  view.scrollLeft = cx * pair.offsetWidth - view.clientWidth / 2;
  view.scrollTop = cy * pair.offsetHeight - view.clientHeight / 2;
}

function showMaps() {
  const i = byId("map-point").value;
  if (!PICTURES.points[i]) return;
  const p = POINTS[i], scale = p.images.scale;
  for (const what of ["error", "bias"]) {
    byId("map-" + what).src = PICTURES.points[i][what];
    byId("map-" + what).alt = `Signed error of ${p.method}, ${p.amount}: ${what === "bias" ? "mean of all runs" : "one run"}`;
  }
  byId("bar-labels").replaceChildren(...["+" + short(scale), "0", "−" + short(scale)].map((t) => make("span", {}, t)));
}

/** Shows a setting's pictures and maps. */
function choosePoint(i) {
  byId("left").value = i;
  byId("map-point").value = i;
  showPair();
  showMaps();
}

function startPictures() {
  const [left, right, map, pair, slider] = ["left", "right", "map-point", "pair", "slider"].map(byId);
  listPoints(left, true);
  listPoints(right, true);
  listPoints(map, false);
  left.value = "0";
  right.value = "reference";
  map.value = "0";
  for (const select of [left, right]) select.addEventListener("change", showPair);
  map.addEventListener("change", showMaps);
  slider.addEventListener("input", () => split(Number(slider.value)));
  const follow = (event) => {
    const r = pair.getBoundingClientRect();
    split(Math.max(0, Math.min(100, (100 * (event.clientX - r.left)) / r.width)));
  };
  pair.addEventListener("pointerdown", (event) => {
    pair.setPointerCapture(event.pointerId);
    follow(event);
  });
  pair.addEventListener("pointermove", (event) => {
    if (pair.hasPointerCapture(event.pointerId)) follow(event);
  });
  byId("zoom").addEventListener("input", zoom);
  byId("img-left").addEventListener("load", zoom);
  byId("bar").style.background = `linear-gradient(to top, ${PICTURES.bar.join(", ")})`;
  byId("pictures-note").textContent = "Left: the first run of the chosen setting." + (PICTURES.block > 1
    ? ` Pictures on this page are means of ${PICTURES.block} × ${PICTURES.block} pixels, which hides noise; those in the folder images are not.` : "");
  // As large as fits, in steps of the control.
  const fit = Math.log2(Math.min(byId("viewport").clientWidth / R.resolution[0], (0.7 * innerHeight) / R.resolution[1], 8 / PICTURES.block) * PICTURES.block);
  byId("zoom").value = String(Math.max(0, Math.min(5, Math.floor(2 * fit) / 2)));
  split(50);
  showPair();
  showMaps();
  zoom();
}
