// Tables: a click on a header sorts the rows, those of each block by themselves, and buttons copy the whole table.
// Without this script a table stands as it was made.
(() => {
const POWERS = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹";
const whole = JSON.parse(document.getElementById("tables-data").textContent);

// The number that a cell writes, else its text; null where there is nothing
function valueOf(row, column) {
  const text = row.cells[column].textContent.trim();
  if (text === "–" || text === "") return null;
  const plain = text.replace(/[\u202f\s]/g, "").replace("−", "-").replace("∞", "Infinity")
    .replace(/^(-?)10(?=[⁻⁰¹²³⁴⁵⁶⁷⁸⁹])/, "$11·10")
    .replace(/·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)$/, (_, power) => `e${[...power].map((c) => "-0123456789"[POWERS.indexOf(c)]).join("")}`);
  return Number.isNaN(Number(plain)) ? text : Number(plain);
}

function compare(a, b) {
  if (typeof a === "number" && typeof b === "number") return a - b;
  if (typeof a === typeof b) return a.localeCompare(b, "en", { numeric: true });
  return typeof a === "number" ? -1 : 1;
}

function sort(table, header, isUp) {
  const column = header.cellIndex;
  const body = table.tBodies[0];
  const blocks = [[]];
  for (const row of [...body.rows]) {
    if (row.classList.contains("block")) blocks.push([row]);
    else blocks.at(-1).push(row);
  }
  for (const rows of blocks) {
    const head = rows[0]?.classList.contains("block") ? [rows.shift()] : [];
    const known = rows.map((row) => [row, valueOf(row, column)]);
    // what is not there comes last either way
    const some = known.filter(([, value]) => value !== null).sort(([, a], [, b]) => compare(a, b) * (isUp ? 1 : -1));
    const none = known.filter(([, value]) => value === null);
    body.append(...head, ...[...some, ...none].map(([row]) => row));
  }
}

for (const table of document.querySelectorAll("table[data-table]")) {
  for (const header of table.tHead.rows[0].cells) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...header.childNodes);
    header.append(button);
    button.addEventListener("click", () => {
      const isUp = header.getAttribute("aria-sort") !== "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      header.setAttribute("aria-sort", isUp ? "ascending" : "descending");
      table.classList.add("sorted");
      sort(table, header, isUp);
    });
  }
  const copies = document.createElement("p");
  for (const [format, text] of Object.entries(whole[table.dataset.table])) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", className: "copy", textContent: `Copy as ${format}` });
    button.addEventListener("click", () => copyText(button, text));
    copies.append(button, " ");
  }
  if (copies.children.length) table.closest(".scroll").after(copies);
}
})();
