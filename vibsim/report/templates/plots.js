// Plots of a page: a line that follows the pointer through all plots of one kind, zoom of their common time axis, and
// curves that their legend entries switch off. vibsim/report/figures/svg.py says what a panel (data-axis) carries.
// Nothing is loaded; without this script every plot is as it was drawn. What it shares with others is in svg.js.
(() => {
const NAMES = { time: "t", long: "t", step: "dt" };
const LEAST = 1 / 200; // of the whole time, the least that is shown
const NEAR = 8; // how far from a point its value is shown [point]
const HINT = "Point at a plot to read its values. Drag to zoom in time, double-click to see all of it, click a legend "
  + "entry to hide it. Keys: arrows, + and −, Shift with arrows, 0.";
const LONG_HINT = "Drag to move along the time, in the strip below to any of it. Wheel, + and − zoom, Shift with arrows moves on, "
  + "0 shows all of it.";
const LINEAR = { to: (v) => v, from: (v) => v };
const LOGARITHMIC = { to: Math.log10, from: (v) => 10 ** v };
const groups = new Map(); // by kind of axis: panels, view (null: whole), at (null: no line)

const nearest = (values, to) => values.reduce((a, b) => (Math.abs(b - to) < Math.abs(a - to) ? b : a), Infinity);

// What a panel holds

function readPanel(node) {
  const isOverview = node.dataset.axis === "overview"; // of all the time of a long series
  const kind = isOverview ? "long" : node.dataset.axis;
  const [left, top, width, height] = numbers(node.dataset.box);
  const scale = (axis) => (node.dataset.log.includes(axis) ? LOGARITHMIC : LINEAR);
  const panel = { kind, isOverview, left, top, width, height, svg: node.ownerSVGElement, across: scale("x"), up: scale("y") };
  panel.x = numbers(node.dataset.x);
  panel.y = numbers(node.dataset.y).map(panel.up.to);
  panel.moved = [...node.querySelectorAll("[data-key] :is(path, use)")]
    .map((e) => ({ e, from: e.getAttribute(e.localName === "use" ? "x" : "d") }));
  panel.curves = [...node.querySelectorAll("[data-curve]")].map(readCurve);
  const stops = panel.curves.flatMap((curve) => curve.points.map((point) => point[0]));
  panel.stops = [...new Set(stops)].sort((a, b) => a - b);
  panel.ticks = node.querySelector("[data-ticks=x]");
  panel.drawnTicks = [...panel.ticks.children];
  panel.over = make("g", { class: "hair", "pointer-events": "none" }, node);
  panel.first = Number(node.dataset.window); // width of the window that is shown at first
  if (!groups.has(kind)) groups.set(kind, { kind, panels: [], view: null, at: null, selected: null });
  groups.get(kind).panels.push(panel);
  return panel;
}

function readCurve(node) {
  const line = node.querySelector("path[d]");
  const uses = [...node.querySelectorAll("use")];
  // a point says whether the line breaks before it
  const points = line
    ? line.getAttribute("d").match(/[ML][^MLz]+/g).map((part) => [...numbers(part.slice(1)), part[0] === "M"])
    : uses.map((e) => [Number(e.getAttribute("x")), Number(e.getAttribute("y")), true]);
  const colour = (line || uses[0].parentNode).getAttribute("stroke");
  return { node, label: node.dataset.curve.split("\n")[0], points, line, colour };
}

// Places and values

const whole = ({ panels }) => [Math.min(...panels.map((p) => p.x[0])), Math.max(...panels.map((p) => p.x[1]))];
const shown = (panel) => (!panel.isOverview && groups.get(panel.kind).view) || panel.x;
const ends = ({ across, x }, view) => view.map((v) => across.to(across === LINEAR ? v : Math.max(v, x[0])));

function toPoint(panel, value, view = shown(panel)) {
  const [low, high] = ends(panel, view);
  return panel.left + ((panel.across.to(value) - low) / (high - low)) * panel.width;
}

function toValue(panel, point, view = shown(panel)) {
  const [low, high] = ends(panel, view);
  return panel.across.from(low + ((point - panel.left) / panel.width) * (high - low));
}

function heightAt({ line, points }, x, isStep) {
  if (line && !isStep) {
    for (let i = 1; i < points.length; i++) {
      const [[x0, y0], [x1, y1, breaks]] = [points[i - 1], points[i]];
      if (!breaks && x0 <= x && x <= x1) return x1 > x0 ? y0 + ((x - x0) / (x1 - x0)) * (y1 - y0) : y1;
    }
    return null;
  }
  const closest = nearest(points.map((point) => point[0]), x);
  return Math.abs(closest - x) <= NEAR ? points.find((point) => point[0] === closest)[1] : null;
}

function valuesOf(panel, at) {
  const x = toPoint(panel, at, panel.x);
  return panel.curves.filter((curve) => !curve.node.classList.contains("off")).flatMap((curve) => {
    const y = heightAt(curve, x, panel.kind === "step");
    if (y === null) return [];
    const value = panel.up.from(panel.y[0] + (1 - (y - panel.top) / panel.height) * (panel.y[1] - panel.y[0]));
    return [{ y, colour: curve.colour, text: `${curve.label}: ${written(value)}` }];
  });
}

const nameOf = (group) => `${NAMES[group.kind]} = ${written(group.at)}`;

// The line, and the values beside it

function draw(group) {
  for (const panel of group.panels) {
    panel.over.replaceChildren();
    const { left, top, width, height } = panel;
    const marked = panel.isOverview ? group.view : group.selected;
    if (marked) {
      const [a, b] = marked.map((value) => between(toPoint(panel, value), left, left + width));
      make("rect", { x: a, y: top, width: b - a, height, fill: "#0072b2", "fill-opacity": 0.15 }, panel.over);
    }
    if (panel.isOverview) continue;
    const x = group.at === null ? NaN : toPoint(panel, group.at);
    panel.rows = x >= left && x <= left + width + 1e-6 ? valuesOf(panel, group.at) : null;
    if (!panel.rows) continue;
    make("path", { d: `M${x} ${top}v${height}`, stroke: "#707070", "stroke-width": 0.8 }, panel.over);
    const isFirst = group.panels.find((p) => p.svg === panel.svg) === panel;
    writeValues(panel, x, isFirst ? [{ text: nameOf(group) }, ...panel.rows] : panel.rows);
  }
}

// Zoom

function show(group, view) {
  const [low, high] = whole(group);
  if (view) {
    const wide = Math.max(view[1] - view[0], (high - low) * LEAST);
    const start = between((view[0] + view[1] - wide) / 2, low, high - wide);
    view = wide < high - low ? [start, start + wide] : null;
  }
  group.view = view;
  group.panels.forEach(movePanel);
  if (group.kind === "time") back.hidden = !view;
  draw(group);
}

function movePanel(panel) {
  const isWhole = shown(panel) === panel.x;
  const move = (x) => toPoint(panel, toValue(panel, Number(x), panel.x)).toFixed(2);
  for (const { e, from } of panel.moved) {
    if (e.localName === "use") {
      const x = isWhole ? from : move(from);
      e.setAttribute("x", x);
      e.classList.toggle("out", x < panel.left - 0.1 || x > panel.left + panel.width + 0.1);
    } else e.setAttribute("d", isWhole ? from : from.replace(/(-?[\d.]+) (-?[\d.]+)/g, (_, x, y) => `${move(x)} ${y}`));
  }
  panel.ticks.replaceChildren(...(isWhole ? panel.drawnTicks : newTicks(panel, ...shown(panel))));
}

function newTicks(panel, low, high) {
  const unit = 10 ** Math.floor(Math.log10((high - low) / 6));
  const step = [1, 2, 2.5, 5, 10].find((m) => m * unit >= (high - low) / 6) * unit;
  const digits = Math.max(0, 1 - Math.floor(Math.log10(step)));
  const places = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) places.push(i * step);
  const at = places.map((value) => toPoint(panel, value).toFixed(2));
  const lines = panel.drawnTicks.filter((e) => e.localName === "path").map((e) => {
    const [, across] = e.getAttribute("d").match(/ (.*?)(?=M|$)/);
    return setAll(e.cloneNode(), { d: at.map((x) => `M${x} ${across}`).join("") });
  });
  const drawn = panel.drawnTicks.find((e) => e.localName === "text");
  const texts = drawn ? at.map((x) => setAll(drawn.cloneNode(), { x })) : [];
  texts.forEach((text, i) => (text.textContent = signed(Number(places[i].toFixed(digits)))));
  return [...lines, ...texts];
}

function zoomBy(group, factor, around = group.at) {
  if (group.kind === "step") return;
  const view = group.view || whole(group);
  const centre = around ?? (view[0] + view[1]) / 2;
  show(group, view.map((end) => centre + (end - centre) * factor));
}

// Move a long series by a part of its window; the strip below moves the other way, by a part of the whole time
function pan(group, { panel, view, x }, to) {
  const [low, high] = panel.isOverview ? panel.x : view;
  const by = ((panel.isOverview ? to - x : x - to) / panel.width) * (high - low);
  show(group, view.map((end) => end + by));
}

// Pointer and keys

function listen(svg) {
  const own = panels.filter((panel) => panel.svg === svg);
  let start = null; // of a selection
  const pointOf = (event) => pointIn(svg, event);
  const under = (event) => {
    const { x, y } = pointOf(event);
    const panel = own.find((p) => x >= p.left && x <= p.left + p.width && y >= p.top && y <= p.top + p.height);
    if (!panel) return null;
    const place = panel.kind === "step" ? nearest(panel.stops, toPoint(panel, toValue(panel, x), panel.x)) : x;
    return { panel, group: groups.get(panel.kind), x, value: toValue(panel, place) };
  };
  const leave = () => own.forEach((panel) => {
    const group = groups.get(panel.kind);
    if (group.at === null) return;
    group.at = null;
    draw(group);
  });
  const finish = (isTaken) => () => {
    if (!start) return;
    const { group } = start;
    const { selected } = group;
    start = group.selected = null;
    if (isTaken && selected) show(group, selected);
    else draw(group);
  };
  const on = (name, act) => svg.addEventListener(name, act, { passive: false });
  setAll(svg, { tabindex: "0", role: "group", "aria-description": own[0].first ? LONG_HINT : HINT });
  svg.classList.add("live");
  on("pointermove", (event) => {
    const now = start ? { ...start, x: pointOf(event).x } : under(event);
    if (!now) return leave();
    const { panel, group, x } = now;
    if (start?.view) return pan(group, start, x);
    if (panel.isOverview) return leave();
    if (start) {
      group.at = toValue(panel, between(x, panel.left, panel.left + panel.width));
      group.selected = Math.abs(x - start.x) > 4 ? [start.value, group.at].sort((a, b) => a - b) : null;
    } else group.at = now.value;
    draw(group);
  });
  // a finger that is lifted leaves the line where it was
  on("pointerleave", (event) => start || event.pointerType === "touch" || leave());
  on("pointerdown", (event) => {
    const now = under(event);
    if (event.button !== 0 || !now || now.group.kind === "step") return;
    const { panel, group, value } = start = now;
    if (group.kind === "long") {
      const view = group.view ?? whole(group);
      const by = panel.isOverview && (value < view[0] || value > view[1]) ? value - (view[0] + view[1]) / 2 : 0;
      show(group, view.map((end) => end + by));
      start.view = group.view ?? view;
    } else {
      group.at = value;
      draw(group);
    }
    if (event.isTrusted) svg.setPointerCapture(event.pointerId);
  });
  on("pointerup", finish(true));
  on("pointercancel", finish(false));
  on("dblclick", (event) => under(event) && show(under(event).group, null));
  on("wheel", (event) => {
    // a page scrolls over its plots until one has the focus
    const now = under(event);
    if (!now || now.group.kind === "step" || now.panel.isOverview || !(event.ctrlKey || svg === document.activeElement)) return;
    event.preventDefault();
    zoomBy(now.group, 1.25 ** Math.sign(event.deltaY), now.value);
  });
  on("keydown", (event) => {
    if (event.target !== svg || event.ctrlKey || event.metaKey || event.altKey) return;
    if (press(groups.get(own[0].kind), own[0], event)) event.preventDefault();
  });
}

function press(group, panel, { key, shiftKey }) {
  const view = shown(panel);
  const part = (view[1] - view[0]) / 100;
  const ahead = { ArrowLeft: -1, ArrowRight: 1 }[key];
  if (ahead && shiftKey && group.view) show(group, view.map((end) => end + 10 * ahead * part));
  else if (ahead && group.kind === "step") {
    const now = group.at === null ? -1 : panel.stops.indexOf(nearest(panel.stops, toPoint(panel, group.at)));
    group.at = toValue(panel, panel.stops[between(now + (now < 0 ? 1 : ahead), 0, panel.stops.length - 1)]);
  } else if (ahead) group.at = between((group.at ?? view[0] + 50 * part) + ahead * part, ...view);
  else if (key === "+" || key === "=") zoomBy(group, 0.5);
  else if (key === "-") zoomBy(group, 2);
  else if (key === "0") show(group, null);
  else if (key === "Escape" && group.at !== null) group.at = null;
  else if (key === "Escape" && group.view) show(group, null);
  else return false;
  draw(group);
  said.textContent = group.at === null ? "" : [nameOf(group), ...panel.rows.map((row) => row.text)].join(", ");
  return true;
}

// Legends

function listenToEntry(node) {
  const { entry } = node.dataset;
  const text = node.querySelector("text");
  const toggle = () => {
    const isOff = !node.classList.contains("off");
    for (const other of document.querySelectorAll("[data-key], [data-entry]")) {
      if ((other.dataset.key ?? other.dataset.entry) !== entry) continue;
      other.classList.toggle("off", isOff);
      if (other.hasAttribute("role")) other.setAttribute("aria-pressed", !isOff);
    }
    groups.forEach(draw);
  };
  node.addEventListener("click", toggle);
  if (!text) return;
  setAll(node, { role: "button", tabindex: "0", "aria-pressed": "true", "aria-label": `Show ${text.textContent}` });
  node.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    toggle();
  });
}

// against the step only points are read, so a panel without any is none
const panels = [...document.querySelectorAll("g[data-axis]:not([data-axis=member])")]
  .filter((node) => node.dataset.axis !== "step" || node.querySelector("[data-curve]")).map(readPanel);
document.querySelectorAll("[data-entry]").forEach(listenToEntry);
if (!panels.length) return;
const back = document.body.appendChild(document.createElement("button"));
const said = document.body.appendChild(document.createElement("p"));
Object.assign(back, { type: "button", className: "zoomed", textContent: "Show the whole time", hidden: true });
back.addEventListener("click", () => show(groups.get("time"), null));
setAll(said, { class: "said", role: "status" });
const hint = (text) => Object.assign(document.createElement("p"), { className: "soft hint", textContent: text });
(panels[0].svg.closest("section") ?? document.body).append(hint(HINT));
new Set(panels.map((panel) => panel.svg)).forEach(listen);
const long = panels.find((panel) => panel.first);
if (long) {
  long.svg.after(hint(LONG_HINT));
  show(groups.get("long"), [long.x[0], long.x[0] + long.first]);
}
})();
