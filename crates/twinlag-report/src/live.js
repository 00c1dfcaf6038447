/* Traces that can be enlarged. Every level of a pyramid keeps the lowest and the highest value of each few points, so no
   extreme is lost at any magnification; what is drawn is said below the plot. Colours and fonts are those of the page. */
(() => {
  "use strict";
  const source = document.getElementById("live-data");
  if (!source) return;
  const page = JSON.parse(source.textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const decoded = page.arrays.map((array) => {
    if (array.values) return new Float32Array(bytes(array.values));
    if (array.exact) return new Float64Array(bytes(array.exact));
    return Float64Array.from({ length: array.count }, (_, k) => array.first + k * array.step);
  });
  const TOGETHER = 4;

  /* One level up: the lowest and the highest of each few points, in their order; a gap stays a gap. */
  function coarser({ x, y }) {
    const xs = [], ys = [];
    let low = -1, high = -1, count = 0;
    const flush = () => {
      if (count === 0) return;
      for (const k of low === high ? [low] : low < high ? [low, high] : [high, low]) { xs.push(x[k]); ys.push(y[k]); }
      count = 0;
    };
    for (let k = 0; k < x.length; k++) {
      if (Number.isNaN(y[k])) { flush(); xs.push(x[k]); ys.push(NaN); continue; }
      if (count === 0) { low = k; high = k; }
      if (y[k] < y[low]) low = k;
      if (y[k] > y[high]) high = k;
      if (++count === 2 * TOGETHER) flush();
    }
    flush();
    return { x: xs, y: ys };
  }

  function pyramid(x, y) {
    const levels = [{ x, y }];
    while (levels.at(-1).x.length > 2000) {
      const next = coarser(levels.at(-1));
      if (next.x.length > 0.7 * levels.at(-1).x.length) break;
      levels.push(next);
    }
    return levels;
  }

  const place = (x, value) => {
    let low = 0, high = x.length;
    while (low < high) { const middle = (low + high) >> 1; if (x[middle] < value) low = middle + 1; else high = middle; }
    return low;
  };

  /* The finest level with no more points between `from` and `to` than a plot of that width can show. */
  function part(levels, from, to, width) {
    for (const [index, { x, y }] of levels.entries()) {
      const a = Math.max(0, place(x, from) - 1), b = Math.min(x.length, place(x, to) + 2);
      if (b - a <= 4 * width || index === levels.length - 1)
        return { index, x: Array.from(x.slice(a, b)), y: Array.from(y.slice(a, b), (v) => (Number.isNaN(v) ? null : v)) };
    }
    return { index: 0, x: [], y: [] };
  }

  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const element = (name, attributes, text) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const rounded = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(6))) : "–");

  function build(panel, host) {
    const series = panel.series.map((s) => ({ ...s, levels: pyramid(decoded[s.x], decoded[s.y]) }));
    const [first, last] = series.reduce(([low, high], { levels: [{ x }] }) =>
      x.length ? [Math.min(low, x[0]), Math.max(high, x[x.length - 1])] : [low, high], [Infinity, -Infinity]);
    /* One point alone has room beside it. */
    const ends = first < last ? [first, last] : first === last ? [first - 0.5, last + 0.5] : [0, 1];
    let view = ends;
    const live = element("div", { class: "live", role: "group", "aria-label": panel.title + ": can be enlarged" });
    live.append(element("p", { class: "title" }, panel.title));
    const bar = element("div", { class: "bar" });
    const plot = element("div", { class: "plot", tabindex: "0", role: "group",
      "aria-label": panel.title + ". Plus and minus enlarge and shrink, arrow keys move, 0 shows all." });
    const shown = element("output", { "aria-live": "polite" });
    const values = element("output", { "aria-live": "off" });
    const toggles = element("div", { class: "bar" });
    const said = element("div", { class: "said" });
    said.append(shown, values);
    live.append(bar, plot, said, toggles);
    host.append(live);
    let drawn = null;

    const data = () => {
      const width = Math.max(200, plot.clientWidth);
      const parts = series.map((s) => part(s.levels, view[0], view[1], width));
      const isExact = panel.bin == null && parts.every((p) => p.index === 0);
      const widths = parts.filter((p) => p.x.length > 1).map((p) => (2 * (p.x.at(-1) - p.x[0])) / (p.x.length - 1));
      const unit = /\(([^)]*)\)$/.exec(panel.x)?.[1] ?? "";
      const each = Number(Math.max(panel.bin ?? 0, ...widths).toPrecision(2));
      shown.textContent = rounded(view[0]) + " to " + rounded(view[1]) + " " + unit + " · "
        + (isExact ? "every value" : "lowest and highest in each " + each + " " + unit);
      return uPlot.join(parts.map((p) => [p.x, p.y]));
    };
    const isWhole = () => view[0] <= ends[0] && view[1] >= ends[1];
    const zoom = (from, to) => {
      const span = Math.min(to - from, ends[1] - ends[0]);
      if (!(span > 1e-9 * (ends[1] - ends[0]))) return;
      const first = Math.min(Math.max(from, ends[0]), ends[1] - span);
      view = [first, first + span];
      drawn.setData(data(), false);
      drawn.setScale("x", { min: view[0], max: view[1] });
    };
    const scaled = (factor) => {
      const middle = (view[0] + view[1]) / 2, half = (factor * (view[1] - view[0])) / 2;
      zoom(middle - half, middle + half);
    };
    const moved = (share) => { const by = share * (view[1] - view[0]); zoom(view[0] + by, view[1] + by); };
    const acts = [["Enlarge", "+", () => scaled(0.5)], ["Shrink", "−", () => scaled(2)], ["Move left", "◀", () => moved(-0.25)],
      ["Move right", "▶", () => moved(0.25)], ["Show all", "All", () => zoom(ends[0], ends[1])]];
    for (const [name, sign, act] of acts) {
      const button = element("button", { type: "button", "aria-label": name + ": " + panel.title, title: name }, sign);
      button.addEventListener("click", act);
      bar.append(button);
    }
    plot.addEventListener("keydown", (event) => {
      const keys = { "+": 0, "=": 0, "-": 1, ArrowLeft: 2, ArrowRight: 3, "0": 4 };
      if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in keys)) return;
      event.preventDefault();
      acts[keys[event.key]][2]();
    });

    const draw = () => {
      const off = drawn ? drawn.series.map((s) => !s.show) : [];
      if (drawn) drawn.destroy();
      /* As many digits as the step has: of 2.5 one. */
      const ticks = (_, splits) => {
        const step = splits.length > 1 ? Math.abs(splits[1] - splits[0]) : 1;
        let digits = 0;
        while (digits < 12 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6 * step * 10 ** digits) digits++;
        return splits.map((v) => (v == null ? "" : v.toFixed(digits).replace("-", "−")));
      };
      const axis = (label) => ({ label, stroke: style("ink"), grid: { stroke: style("grid"), width: 1 }, values: ticks, gap: 4,
        labelSize: 20, ticks: { stroke: style("quiet"), width: 1, size: 5 }, font: "12px system-ui, sans-serif",
        labelFont: "13px system-ui, sans-serif" });
      const of = (s, k) => {
        const colour = style(s.colour);
        const base = { label: s.name, stroke: colour, show: !off[k + 1], spanGaps: false };
        if (s.edge) return { ...base, width: 0, points: { show: false } };
        return s.points
          ? { ...base, width: 0, paths: () => null, points: { show: true, size: 8, stroke: colour, width: 2, fill: style("plate") } }
          : { ...base, width: 1.3, dash: s.dashed ? [6, 4] : undefined, points: { show: false } };
      };
      drawn = new uPlot({
        width: Math.max(200, plot.clientWidth), height: panel.height, legend: { show: false },
        scales: { x: { time: false }, y: { range: (_, low, high) => {
          if (panel.range && isWhole()) return panel.range;
          if (low == null || high == null) return [0, 1];
          const pad = high > low ? 0.06 * (high - low) : Math.max(1e-9, 0.1 * Math.abs(high));
          return [low - pad, high + pad];
        } } },
        axes: [{ ...axis(panel.x), size: 30 }, { ...axis(panel.y), size: 62 }],
        series: [{ label: panel.x }, ...series.map(of)],
        bands: panel.bands.map(({ edges, colour }) => ({ series: edges, fill: style(colour) + "33" })),
        cursor: { drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => () => { zoom(ends[0], ends[1]); return null; } } },
        hooks: {
          setSelect: [(u) => {
            if (u.select.width < 4) return;
            const [from, to] = [u.select.left, u.select.left + u.select.width].map((px) => u.posToVal(px, "x"));
            u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            zoom(from, to);
          }],
          setCursor: [(u) => {
            const at = u.cursor.idx;
            values.textContent = at == null || u.cursor.left < 0 ? "" : rounded(u.data[0][at]) + ": "
              + series.flatMap((s, k) => (u.data[k + 1][at] == null || !s.name ? [] : [s.name + " " + rounded(u.data[k + 1][at])])).join(", ");
          }],
          draw: [(u) => {
            const { left, top, width, height } = u.bbox;
            u.ctx.save();
            u.ctx.beginPath();
            u.ctx.rect(left, top, width, height);
            u.ctx.clip();
            u.ctx.lineWidth = 1.3 * devicePixelRatio;
            for (const { edges: [high, low], colour } of panel.bars) {
              u.ctx.strokeStyle = style(colour);
              u.ctx.beginPath();
              for (const [k, x] of u.data[0].entries()) {
                if (u.data[low][k] == null || u.data[high][k] == null) continue;
                const at = u.valToPos(x, "x", true);
                u.ctx.moveTo(at, u.valToPos(u.data[low][k], "y", true));
                u.ctx.lineTo(at, u.valToPos(u.data[high][k], "y", true));
              }
              u.ctx.stroke();
            }
            u.ctx.restore();
          }],
          drawClear: [(u) => {
            if (!panel.band) return;
            const [top, bottom] = [panel.band[1], panel.band[0]].map((v) => u.valToPos(v, "y", true));
            const { left, top: above, width, height } = u.bbox;
            u.ctx.save();
            u.ctx.globalAlpha = 0.18;
            u.ctx.fillStyle = style("grey");
            u.ctx.fillRect(left, Math.max(above, top), width, Math.max(0, Math.min(above + height, bottom) - Math.max(above, top)));
            u.ctx.restore();
          }],
        },
      }, data(), plot);
      drawn.setScale("x", { min: view[0], max: view[1] });
      drawn.root.querySelectorAll("canvas").forEach((canvas) => canvas.setAttribute("aria-hidden", "true"));
    };

    const named = series.filter((s) => s.name);
    for (const s of named.length > 1 ? named : []) {
      const label = element("label", {});
      const box = element("input", { type: "checkbox" });
      const swatch = element("span", { class: s.points ? "swatch points" : "swatch", "aria-hidden": "true" });
      const colour = "var(--" + s.colour + ")";
      if (s.points) swatch.style.background = colour;
      else { swatch.style.borderTopColor = colour; if (s.dashed) swatch.style.borderTopStyle = "dashed"; }
      box.checked = true;
      box.addEventListener("change", () => drawn.setSeries(series.indexOf(s) + 1, { show: box.checked }));
      label.append(box, swatch, document.createTextNode(s.name));
      toggles.append(label);
    }
    draw();
    let width = plot.clientWidth;
    new ResizeObserver(() => {
      if (plot.clientWidth === width || plot.clientWidth === 0) return;
      width = plot.clientWidth;
      drawn.setSize({ width: Math.max(200, width), height: panel.height });
      zoom(view[0], view[1]);
    }).observe(plot);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  }

  for (const { figure, panels } of page.plots) {
    const plate = document.getElementById("plate-" + figure);
    if (!plate) continue;
    plate.classList.add("is-live");
    plate.removeAttribute("tabindex");
    plate.removeAttribute("role");
    plate.removeAttribute("aria-label");
    for (const panel of panels) build(panel, plate);
  }
  /* What is folded is printed as well. */
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = [...document.querySelectorAll("details:not([open])")];
    opened.forEach((details) => { details.open = true; });
  });
  addEventListener("afterprint", () => { opened.forEach((details) => { details.open = false; }); });
})();
