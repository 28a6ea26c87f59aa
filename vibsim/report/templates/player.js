"use strict";
// The player of a report: draws the parts of a scene at a time between two frames. Numbers in tenths of a pixel.
(() => {
  const text = (x) => x.toFixed(1);
  const path = {
    line: (a, b, c, d) => `M${text(a)} ${text(b)}L${text(c)} ${text(d)}`,
    spring(a, b, c, d) {
      const length = Math.hypot(c - a, d - b) || 1, dx = (c - a) / length, dy = (d - b) / length;
      let found = `M${text(a)} ${text(b)}`;
      for (let i = 0; i < 18; i++) {
        const s = length * (0.1 + (0.8 * (i + 0.5)) / 18), side = 5 - 10 * (i % 2);
        found += `L${text(a + s * dx - side * dy)} ${text(b + s * dy + side * dx)}`;
      }
      return `${found}L${text(c)} ${text(d)}`;
    },
    circle: (x, y, r) => `M${text(x - r)} ${text(y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0z`,
    box: (x, y, w, h) => `M${text(x - w / 2)} ${text(y - h / 2)}h${w}v${h}h${-w}z`,
    arrow(x, y, dx, dy) {
      const length = Math.hypot(dx, dy);
      if (length < 2) return "";
      const head = Math.min(8, 0.6 * length) / length, bx = x + dx * (1 - head), y0 = y + dy * (1 - head);
      const nx = -dy * 0.45 * head, ny = dx * 0.45 * head, end = `${text(x + dx)} ${text(y + dy)}`;
      return `M${text(x)} ${text(y)}L${end}M${text(bx + nx)} ${text(y0 + ny)}L${end}L${text(bx - nx)} ${text(y0 - ny)}`;
    },
    arc(x, y, r, degrees) {
      const angle = ((degrees % 360) * Math.PI) / 180, points = [];
      for (let i = 0; i <= 24; i++) points.push(`${text(x + r * Math.sin((angle * i) / 24))} ${text(y + r * Math.cos((angle * i) / 24))}`);
      return `M${points.join("L")}`;
    },
  };
  // the middle of a label; null where the arrow or the arc is too small for one
  const place = {
    arrow(x, y, dx, dy) {
      const length = Math.hypot(dx, dy);
      return length < 10 ? null : [x + dx - (14 * dy) / length, y + dy + (14 * dx) / length];
    },
    arc(x, y, r, degrees) {
      const middle = ((degrees % 360) * Math.PI) / 360;
      return Math.abs(degrees % 360) < 10 ? null : [x + (r + 14) * Math.sin(middle), y + (r + 14) * Math.cos(middle)];
    },
  };
  const moveLabel = (label, at, { width, height }) => {
    label.setAttribute("display", at ? "inline" : "none");
    if (!at) return;
    label.setAttribute("x", text(Math.min(Math.max(at[0], 14), width - 14)));
    label.setAttribute("y", text(Math.min(Math.max(at[1], 14), height - 14)));
  };

  for (const figure of document.querySelectorAll(".player")) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    const one = (selector) => figure.querySelector(selector);
    const slider = one("input"), play = one(".play"), told = one("output"), speed = one("select");
    const frames = data.lanes[0].u.length - 1, [begin, end] = data.t, span = end - begin, [width, height] = data.size;
    const stages = [...figure.querySelectorAll(".stages svg")].map((svg) => ({
      frame: svg.viewBox.baseVal, paths: [...svg.querySelectorAll(".now path")], labels: [...svg.querySelectorAll(".now text")],
    }));
    const curves = data.lanes.map((_, i) => one(`.curve.k${i}`));
    const still = matchMedia("(prefers-reduced-motion: reduce)");
    const digits = Math.min(8, Math.max(0, 2 - Math.floor(Math.log10(span / 20))));
    const at = (column, i, part) => {
      if (typeof column === "number") return column;
      const from = column[i], to = column[Math.min(i + 1, frames)];
      return (from + (to - from) * part) / 10;
    };
    let now = 0, running = 0, before = 0;

    const curve = (u, first, window) => {
      const i0 = Math.max(0, Math.floor(((first - begin) / span) * frames));
      const i1 = Math.min(frames, Math.ceil(((first + window - begin) / span) * frames));
      const points = [];
      for (let i = i0; i <= i1; i++) points.push(`${text((((i / frames) * span + begin - first) / window) * width)} ${u[i] / 10}`);
      return `M${points.join("L")}`;
    };

    let shown = NaN;
    const draw = () => {
      const i = Math.min(frames, Math.floor(now)), part = now - i, time = begin + (now / frames) * span;
      data.lanes.forEach((lane, k) => {
        const { frame, paths, labels } = stages[k];
        let label = 0;
        lane.parts.forEach(({ shape, at: columns, labelled }, j) => {
          const values = columns.map((column) => at(column, i, part));
          if (shape === "track") paths[j].setAttribute("transform", `translate(${text(-values[0])})`);
          else paths[j].setAttribute("d", path[shape](...values));
          if (labelled) moveLabel(labels[label++], place[shape](...values), frame);
        });
      });
      const first = Math.min(Math.max(begin, time - 0.6 * data.window), end - data.window);
      if (first !== shown) {
        data.lanes.forEach((lane, k) => curves[k].setAttribute("d", curve(lane.u, first, data.window)));
        one(".from").textContent = `t = ${first.toFixed(digits)}`;
        one(".to").textContent = `${(first + data.window).toFixed(digits)} ${data.unit}`;
        shown = first;
      }
      const x = text(((time - first) / data.window) * width);
      one(".cursor").setAttribute("d", `M${x} 0V${height}`);
      slider.value = Math.round(now);
      told.textContent = `t = ${time.toFixed(digits)} ${data.unit}`;
      slider.setAttribute("aria-valuetext", told.textContent);
    };
    const go = (frame) => {
      figure.classList.add("live");
      now = Math.min(frames, Math.max(0, frame));
      draw();
    };
    const tick = (clock) => {
      if (!running) return;
      const passed = Math.min(0.1, (clock - before) / 1000) * data.pace * Number(speed.value);
      before = clock;
      go(now + (passed / span) * frames);
      if (now >= frames) pause();
      else running = requestAnimationFrame(tick);
    };
    const icon = (d, name) => {
      play.querySelector("path").setAttribute("d", d);
      play.setAttribute("aria-label", name);
    };
    const pause = () => {
      cancelAnimationFrame(running);
      running = 0;
      icon("M4 2v12l10-6z", "Play");
    };
    const start = () => {
      if (now >= frames) now = 0;
      before = performance.now();
      running = requestAnimationFrame(tick);
      icon("M3 2h4v12H3zM9 2h4v12H9z", "Pause");
    };
    const toggle = () => (running ? pause() : start());
    const step = (by) => {
      pause();
      go(Math.round(now) + by);
    };
    play.addEventListener("click", toggle);
    [...figure.querySelectorAll(".step")].forEach((button, i) => button.addEventListener("click", () => step(2 * i - 1)));
    slider.addEventListener("input", () => {
      pause();
      go(Number(slider.value));
    });
    figure.addEventListener("keydown", (event) => {
      const is = (name) => event.target.localName === name;
      if (is("select") || event.altKey || event.ctrlKey || event.metaKey) return;
      if (event.key === " " && !is("button")) toggle();
      else if (event.key === "ArrowRight" && !is("input")) step(1);
      else if (event.key === "ArrowLeft" && !is("input")) step(-1);
      else if (event.key === "Home" && !is("input")) step(-frames);
      else if (event.key === "End" && !is("input")) step(frames);
      else return;
      event.preventDefault();
    });
    // what nobody sees needs no work; who wants less motion starts more slowly
    if ("IntersectionObserver" in window) new IntersectionObserver(([seen]) => seen.isIntersecting || pause()).observe(figure);
    if (still.matches) speed.value = "0.5";
    one(".controls").hidden = false;
    told.textContent = `t = ${begin.toFixed(digits)} ${data.unit}`;
  }
})();
