// What the scripts of plots share: elements of SVG, numbers in words, and a box with values beside a place.
"use strict";
const LETTER = 4.7; // about the width of a letter [point]
const numbers = (text) => text.split(" ").map(Number);
const between = (value, low, high) => Math.min(Math.max(value, low), high);
const signed = (number) => String(number).replace("-", "−");
const setAll = (node, attributes) => {
  for (const key in attributes) node.setAttribute(key, attributes[key]);
  return node;
};
const make = (name, attributes, parent) =>
  parent.appendChild(setAll(document.createElementNS("http://www.w3.org/2000/svg", name), attributes));

function written(value) {
  const size = Math.abs(value);
  if (value === 0 || (size >= 1e-3 && size < 1e5)) return signed(Number(value.toPrecision(4)));
  const [digits, power] = value.toExponential(3).split("e");
  return `${signed(Number(digits))}·10${power.replace("+", "").replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)])}`;
}

function writeValues({ over, left, top, width, height }, x, rows) {
  if (!rows.length) return;
  const box = make("g", { "font-size": 8 }, over);
  // to measure letters would lay out the page for every panel
  const wide = Math.max(...rows.map(({ colour, text }) => LETTER * text.length + (colour ? 18 : 8)));
  const paper = { fill: "#ffffff", "fill-opacity": 0.86, rx: 2, width: wide, height: 10.5 * rows.length + 4 };
  make("rect", paper, box);
  rows.forEach(({ y, colour, text }, i) => {
    const down = 10.5 * (i + 1);
    make("text", { x: colour ? 14 : 4, y: down }, box).textContent = text;
    if (!colour) return;
    make("path", { d: `M4 ${down - 3}h7`, stroke: colour, "stroke-width": 2 }, box);
    if (y < top || y > top + height) return;
    make("circle", { cx: x, cy: y, r: 2.4, fill: "#ffffff", stroke: colour, "stroke-width": 1.2 }, over);
  });
  const start = x + 6 + wide <= left + width ? x + 6 : Math.max(x - 6 - wide, 0);
  box.setAttribute("transform", `translate(${start} ${top + 2})`);
  over.append(box);
}

const pointIn = (svg, { clientX, clientY }) =>
  new DOMPoint(clientX, clientY).matrixTransform(svg.getScreenCTM().inverse());
