// The members of a sweep: one view is shown, chosen by its quantity. In it the member nearest to the pointer, or chosen
// by keys, is told, and a click gives the command that runs it alone. vibsim/report/page/explorer.py says what the data
// hold. Without this script all views are there, folded.
(() => {
const REACH = 60; // how far from the pointer a member may be [point]
const ALONG = 4; // how much worse it is to leave the direction of an arrow key
const AHEAD = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const data = JSON.parse(document.getElementById("members-data").textContent);
const explorer = document.querySelector(".explorer");
const all = [...explorer.querySelectorAll("details")];

// Which view is shown

function choose() {
  const [name, scheme] = selects.map((select) => select?.value);
  const fits = (view) => view.dataset.name === name;
  const chosen = all.find((view) => fits(view) && view.dataset.of === scheme) ?? all.find(fits);
  for (const view of all) view.open = !(view.hidden = view !== chosen);
}

function select(label, values) {
  const found = [...new Set(values)];
  if (found.length < 2) return null;
  const box = document.createElement("label");
  const made = document.createElement("select");
  made.append(...found.map((value) => new Option(value)));
  made.addEventListener("change", choose);
  box.append(`${label} `, made);
  bar.append(box);
  return made;
}

const bar = document.createElement("p");
bar.className = "chooser";
explorer.prepend(bar);
const hint = document.createElement("span");
hint.className = "soft";
hint.textContent = data.cases.length < data.count
  ? `Point at a member (${data.cases.length} of ${data.count} can be pointed at); click for its command.`
  : "Point at a member; click for its command. Keys: arrows.";
const selects = [select("Quantity", all.map((view) => view.dataset.name)),
  select("Scheme", all.flatMap((view) => view.dataset.of ?? []))];
bar.append(hint);
explorer.classList.add("live");
if (selects[0]) choose();
else selects[0] = { value: all[0].dataset.name };

// What is said of a member

const valueOf = ({ values, words, unit }, i) =>
  values[i] === null ? "–" : words?.length ? words[values[i]] : `${written(values[i])} ${unit}`.trim();

function tell({ view, scheme, i }) {
  const rows = data.keys.map((key) => `${key.name} = ${valueOf(key, i)}`);
  const value = view.values?.[view.schemes.indexOf(scheme)][i];
  if (view.values) {
    const text = value === null ? "none" : `${written(value)} ${view.unit}`.trim();
    rows.push(`${view.name}: ${text}`);
  }
  const verdicts = data.verdicts[view.quantity];
  if (verdicts) rows.push(`${verdicts.on}: ${verdicts.texts[verdicts.of[scheme][i]]}`);
  return data.schemes.length > 1 ? [data.schemes[scheme], ...rows] : rows;
}

const commandOf = ({ i }) => data.command.join(data.cases[i]);

// Where members are

function pointsOf(view, node, [across, up]) {
  const [left, top, width, height] = numbers(node.dataset.box);
  const scale = (axis) => {
    const to = node.dataset.log.includes(axis) ? Math.log10 : (v) => v;
    const [low, high] = numbers(node.dataset[axis]).map(to);
    return (v) => between((to(v) - low) / (high - low), 0, 1);
  };
  const [x, y] = [scale("x"), scale("y")];
  const points = view.schemes.flatMap((scheme, s) => data.cases.map((_, i) => {
    const high = up === null ? (view.places ?? view.values)[s][i] : data.keys[up].values[i];
    if (high === null) return null;
    const place = { x: left + width * x(data.keys[across].values[i]), y: top + height * (1 - y(high)) };
    return Number.isNaN(place.y) ? null : { view, scheme, i, ...place };
  }));
  return { left, top, width, height, points: points.filter(Boolean), over: make("g", { class: "hair", "pointer-events": "none" }, node) };
}

function listen(details) {
  const view = data.views[details.id];
  const svg = details.querySelector("svg");
  const panels = view ? [...svg.querySelectorAll("g[data-axis=member]")].map((node, k) => pointsOf(view, node, view.panels[k])) : [];
  if (!panels.length) return;
  const figure = details.querySelector("figure");
  const caption = figure.querySelector(".member") ?? figure.appendChild(document.createElement("figcaption"));
  const copy = document.createElement("button");
  const words = caption.querySelector("span") ?? caption.appendChild(document.createElement("span"));
  const code = caption.querySelector("code") ?? caption.appendChild(document.createElement("code"));
  Object.assign(caption, { className: "member" });
  words.setAttribute("role", "status");
  Object.assign(copy, { type: "button", className: "copy", textContent: "Copy the command", hidden: !code.textContent });
  copy.addEventListener("click", () => copyText(copy, code.textContent));
  code.before(" ");
  caption.append(" ", copy);
  const box = make("g", { class: "hair", "pointer-events": "none" }, svg);
  let at = null; // the member that is told, in the panel where it was found

  const show = (found) => {
    at = found;
    box.replaceChildren();
    for (const panel of panels) {
      panel.over.replaceChildren();
      const here = found && panel.points.find((p) => p.i === found.i && p.scheme === found.scheme);
      if (!here) continue;
      make("circle", { cx: here.x, cy: here.y, r: 4.5, fill: "none", stroke: "#ffffff", "stroke-width": 3 }, panel.over);
      make("circle", { cx: here.x, cy: here.y, r: 4.5, fill: "none", stroke: "#000000", "stroke-width": 1.4 }, panel.over);
      if (panel !== found.panel) continue;
      const place = { over: box, left: 0, width: svg.viewBox.baseVal.width, top: Math.min(here.y, panel.top + panel.height / 2) };
      writeValues(place, here.x, tell(found).map((text) => ({ text })));
    }
  };
  const take = () => {
    if (!at) return;
    words.textContent = tell(at).join(", ");
    code.textContent = commandOf(at);
    copy.hidden = false;
  };
  const best = (panel, cost) => {
    const [found] = panel.points.reduce(([old, least], point) => {
      const size = cost(point);
      return size < least ? [point, size] : [old, least];
    }, [null, Infinity]);
    return found && { ...found, panel };
  };
  const under = (event) => {
    const { x, y } = pointIn(svg, event);
    const panel = panels.find((p) => x >= p.left - 5 && x <= p.left + p.width + 5 && y >= p.top - 5 && y <= p.top + p.height + 5);
    return panel ? best(panel, (p) => { const far = Math.hypot(p.x - x, p.y - y); return far < REACH ? far : Infinity; }) : null;
  };
  const step = ([right, down]) => {
    const from = at ?? first();
    return best(from.panel, (p) => {
      const [dx, dy] = [p.x - from.x, p.y - from.y];
      const ahead = dx * right + dy * down;
      return ahead > 0.01 ? ahead + ALONG * Math.abs(dx * down + dy * right) : Infinity;
    }) ?? from;
  };
  const first = () => best(panels[0], (p) => (p.i === view.worst ? 0 : 1));

  setAll(svg, { tabindex: "0", role: "group", "aria-description": hint.textContent });
  svg.classList.add("live");
  svg.addEventListener("pointermove", (event) => show(under(event)));
  svg.addEventListener("pointerleave", (event) => event.pointerType === "touch" || show(null));
  svg.addEventListener("click", (event) => { show(under(event) ?? at); take(); });
  svg.addEventListener("focus", () => svg.matches(":focus-visible") && !at && show(first()));
  svg.addEventListener("blur", () => show(null));
  svg.addEventListener("keydown", (event) => {
    if (event.target !== svg || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in AHEAD) {
      show(step(AHEAD[event.key]));
      take();
    } else if (event.key === "Escape") show(null);
    else return;
    event.preventDefault();
  });
}

all.forEach(listen);
})();
