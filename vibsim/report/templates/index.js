"use strict";
(() => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const cards = all(".card"), buttons = all("button[data-tag]"), search = document.querySelector("input[type=search]");
  const none = document.querySelector("#none"), compare = document.querySelector("#compare");
  const known = typeof vibsimHistory === "object" && vibsimHistory ? vibsimHistory : {};
  const day = (time, style) => new Date(time).toLocaleString([], style);
  const time = (s) => (s < 60 ? `${Math.max(1, Math.round(s))} s` : s < 3600 ? `${Math.round(s / 60)} min` : `${(s / 3600).toFixed(1)} h`);

  // when results were made, and what changed in the last run
  const entries = cards.map((card) => [card, known[card.dataset.key]]).filter(([, entry]) => entry && entry.made > 0);
  const changes = document.querySelector("#changes"), isFirst = entries.every(([, entry]) => entry.new);
  for (const [card, entry] of entries) {
    const parts = [day(entry.made, { dateStyle: "medium" })].concat(entry.seconds > 0 ? [time(entry.seconds)] : []);
    card.querySelector(".when").textContent = parts.join(", ");
    const was = entry.was ? Object.values(entry.was).join(", ") : "";
    if (!changes || isFirst || !(was || entry.new)) continue;
    const now = entry.was ? Object.keys(entry.was).map((key) => entry[key]).join(", ") : "";
    const line = changes.appendChild(document.createElement("li")), link = document.createElement("a");
    card.id = `card-${card.dataset.key}`;
    link.href = `#${card.id}`;
    link.textContent = card.dataset.key;
    line.append(link, was ? `: ${was} became ${now}` : ": new");
    changes.hidden = false;
  }
  if (entries.length) {
    const last = Math.max(...entries.map(([, entry]) => entry.made));
    const count = changes ? changes.children.length : 0;
    const text = isFirst ? "" : count ? `. Changed by the last run: ${count}${count > 7 ? " (the list scrolls)" : ""}` : ". The last run changed no verdict";
    document.querySelector("#last").textContent = `Last results ${day(last, { dateStyle: "medium", timeStyle: "short" })}${text}`;
  }
  if (!search) return;

  // filter and search: a number is looked for as a whole, so that section 3 is not 2.3
  const fits = (text, word) => /^\(?[\d.]+\)?$/.test(word)
    ? text.split(/[^\w.()]+/).includes(word) : text.includes(word);
  const sections = document.querySelector("#sections"), lines = all("li[data-search]", sections);
  const show = () => {
    const tags = buttons.filter((b) => b.getAttribute("aria-pressed") === "true").map((b) => b.dataset.tag);
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const card of cards) {
      const own = card.dataset.tags.split("|");
      const isShown = (!tags.length || tags.some((tag) => own.includes(tag))) && words.every((word) => fits(card.dataset.search, word));
      card.hidden = !isShown;
      count += isShown;
    }
    const found = lines.filter((line) => { line.hidden = !words.every((word) => fits(line.dataset.search, word)); return !line.hidden; });
    if (words.length) sections.open = found.length > 0 && (count === 0 || /\d/.test(search.value));
    count += words.length ? found.length : 0;
    for (const section of all("section")) {
      const inside = all(".card", section);
      section.hidden = inside.length ? inside.every((card) => card.hidden) : Boolean(tags.length || words.length);
    }
    none.hidden = count > 0;
  };
  search.hidden = false;
  search.addEventListener("input", show);
  for (const button of buttons) {
    button.disabled = false;
    button.addEventListener("click", () => {
      button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
      show();
    });
  }
  none.querySelector("button").addEventListener("click", () => {
    search.value = "";
    for (const button of buttons) button.setAttribute("aria-pressed", "false");
    show();
    search.focus();
  });

  // two experiments side by side
  let chosen = [];
  const choose = (next) => {
    chosen = next;
    for (const card of cards) {
      card.classList.toggle("chosen", chosen.includes(card));
      card.querySelector("input").checked = chosen.includes(card);
    }
    const copies = chosen.map((card) => {
      const copy = card.cloneNode(true);
      copy.removeAttribute("id");
      copy.hidden = false;
      copy.classList.remove("chosen");
      copy.querySelector("label").remove();
      for (const image of all("img", copy)) image.loading = "eager";
      return copy;
    });
    compare.querySelector(".cards").replaceChildren(...copies);
    compare.querySelector("span").textContent = chosen.length === 1 ? "Choose a second experiment." : "";
    compare.hidden = !chosen.length;
  };
  for (const card of cards) {
    card.querySelector("label").hidden = false;
    const box = card.querySelector("input");
    box.checked = false;
    box.addEventListener("change", () => choose(box.checked ? [...chosen.slice(-1), card] : chosen.filter((one) => one !== card)));
  }
  const close = () => {
    const last = chosen.at(-1);
    choose([]);
    if (last) last.querySelector("input").focus();
  };
  compare.querySelector("button").addEventListener("click", close);
  compare.addEventListener("keydown", (event) => { if (event.key === "Escape") close(); });
})();
