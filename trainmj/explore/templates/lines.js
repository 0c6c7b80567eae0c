"use strict";
// Draws the plots of a report in some milliseconds, so that they can follow a slider: the same lines, colours and words.
const lines = (() => {
  const DASHES = { dot: [2, 3], dash: [6, 4], dashdot: [6, 3, 2, 3], longdash: [10, 4], longdashdot: [10, 4, 2, 4] };
  const LEFT = 52, RIGHT = 10, TOP = 10, BOTTOM = 38, CLOSE = 24; // pixels
  const decode = (text) => new DOMParser().parseFromString(String(text ?? "").replaceAll("<br>", " "), "text/html").body.textContent;
  const said = new Map(); // words of traces and axes hold some markup
  const plain = (text) => said.get(text) ?? (said.set(text, decode(text)), said.get(text));
  const ticks = (low, high, most) => {
    const raw = (high - low) / Math.max(1, most), power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].find((n) => n * power >= raw * 0.999) * power;
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
  };
  const xs = (trace) => trace.x ?? trace.y.map((_, k) => trace.x0 + k * trace.dx);
  const dashes = (line) => !line || !line.dash || line.dash === "solid" ? [] : DASHES[line.dash] ?? line.dash.split(",").map(parseFloat);

  // Everything that is drawn, stacked where it is to be.
  const layers = (spec, palette) => {
    let below = null;
    return spec.data.map((trace, k) => {
      const x = xs(trace);
      let y = trace.y, base = null;
      if (trace.stackgroup) {
        base = below ?? y.map(() => 0);
        y = below = y.map((v, j) => (v ?? 0) + (base[j] ?? 0));
      }
      return { name: plain(trace.name), x, y, base, own: trace.y, points: trace.mode === "markers", line: trace.line,
        steps: Boolean(trace.line && trace.line.shape === "hv"), marks: trace.mode.includes("markers"), listed: trace.showlegend !== false,
        size: trace.marker && trace.marker.size, texts: trace.text, hidden: trace.visible === "legendonly", group: trace.legendgroup,
        colour: (trace.line && trace.line.color) || (trace.marker && trace.marker.color) || palette[k % palette.length] };
    });
  };
  const seen = (figure, layer) => {
    const chosen = figure.chosen.get(layer.group ? plain(layer.group) : layer.name);
    return chosen === undefined ? !layer.hidden : chosen;
  };

  const range = (figure, axis, values, shapes) => {
    if (figure.view) return figure.view[axis];
    let low = Infinity, high = -Infinity;
    for (const list of values) for (const v of list) if (v !== null && v !== undefined) { low = Math.min(low, v); high = Math.max(high, v); }
    if (!(low <= high)) [low, high] = [0, 1];
    if (shapes.rangemode === "tozero") low = Math.min(low, 0);
    for (const v of shapes.autorangeoptions?.include ?? []) { low = Math.min(low, v); high = Math.max(high, v); }
    const room = axis === "y" ? 0.05 * (high - low) || 1 : 0.01 * (high - low) || 1;
    return [low - (axis === "y" || low < 0 ? room : 0), high + room];
  };

  const draw = (figure, spec, pins = []) => {
    figure.spec = spec;
    figure.pins = pins;
    const canvas = figure.querySelector("canvas"), box = figure.querySelector(".canvas");
    const width = box.clientWidth, height = box.clientHeight, ratio = window.devicePixelRatio || 1;
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d"), layout = spec.layout, palette = layout.colorway;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "11px system-ui, sans-serif";
    const own = layers(spec, palette);
    const drawn = [...pins.flatMap((pin) => layers(pin.spec, palette).filter((one) => !one.base).map((one) => ({ ...one, pin }))), ...own]
      .filter((one) => seen(figure, one));
    const [x0, x1] = range(figure, "x", drawn.map((one) => one.x), layout.xaxis);
    const [y0, y1] = range(figure, "y", drawn.flatMap((one) => (one.base ? [one.y, one.base] : [one.y])), layout.yaxis);
    const across = (x) => LEFT + ((x - x0) / (x1 - x0)) * (width - LEFT - RIGHT);
    const up = (y) => height - BOTTOM - ((y - y0) / (y1 - y0)) * (height - BOTTOM - TOP);
    figure.scales = { x0, x1, y0, y1, across, up, width, height, drawn };
    pen.strokeStyle = "#e8eaee";
    pen.fillStyle = "#22262e";
    pen.lineWidth = 1;
    const tx = ticks(x0, x1, (width - LEFT) / 70), ty = ticks(y0, y1, (height - BOTTOM) / 40);
    pen.beginPath();
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const t of tx.found) {
      pen.moveTo(across(t), TOP);
      pen.lineTo(across(t), height - BOTTOM);
      pen.fillText(t.toFixed(tx.digits).replace("-", "−"), across(t), height - BOTTOM + 4);
    }
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const t of ty.found) {
      pen.moveTo(LEFT, up(t));
      pen.lineTo(width - RIGHT, up(t));
      pen.fillText(t.toFixed(ty.digits).replace("-", "−"), LEFT - 5, up(t));
    }
    pen.stroke();
    pen.textAlign = "center";
    pen.textBaseline = "bottom";
    pen.fillText(plain(layout.xaxis.title.text), (LEFT + width - RIGHT) / 2, height - 3);
    pen.save();
    pen.translate(11, (TOP + height - BOTTOM) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textBaseline = "middle";
    pen.fillText(plain(layout.yaxis.title.text), 0, 0);
    pen.restore();
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, TOP, width - LEFT - RIGHT, height - BOTTOM - TOP);
    pen.clip();
    for (const shape of layout.shapes ?? []) {
      const whole = shape.xref === "paper";
      const left = whole ? LEFT : across(shape.x0), right = whole ? width - RIGHT : across(shape.x1);
      const of = (y) => (shape.yref === "paper" ? TOP + (1 - y) * (height - BOTTOM - TOP) : up(y));
      if (shape.type === "rect") {
        pen.globalAlpha = shape.opacity ?? 1;
        pen.fillStyle = shape.fillcolor;
        pen.fillRect(left, of(shape.y1), right - left, of(shape.y0) - of(shape.y1));
        pen.globalAlpha = 1;
      } else {
        pen.strokeStyle = shape.line.color;
        pen.lineWidth = shape.line.width;
        pen.setLineDash(dashes(shape.line));
        pen.beginPath();
        pen.moveTo(left, of(shape.y0));
        pen.lineTo(right, of(shape.y1));
        pen.stroke();
      }
      if (shape.label) {
        pen.fillStyle = "#22262e";
        const line = shape.type === "line", place = line ? shape.label.textposition : "start";
        pen.textAlign = { start: "left", middle: "center", end: "right" }[place];
        pen.textBaseline = line ? "bottom" : "top";
        const x = { start: Math.max(left, LEFT) + 4, middle: (left + right) / 2, end: right - 4 }[place];
        const lines = shape.label.text.split("<br>");
        lines.forEach((text, k) => pen.fillText(plain(text), x, of(shape.y1) + (line ? -2 - 13 * (lines.length - 1 - k) : 4)));
      }
    }
    for (const one of drawn) {
      pen.globalAlpha = one.pin ? 0.75 : 1;
      pen.strokeStyle = pen.fillStyle = one.pin ? one.pin.colour : one.colour;
      pen.lineWidth = one.pin ? 1 : (one.line && one.line.width) || 1.6;
      pen.setLineDash(one.pin ? one.pin.dash : dashes(one.line));
      if (one.points || one.marks) for (let k = 0; k < one.x.length; k++) if (one.y[k] !== null) {
        pen.beginPath();
        pen.arc(across(one.x[k]), up(one.y[k]), (one.size ?? 5) / 2, 0, 2 * Math.PI);
        pen.fill();
      }
      if (one.points) continue;
      pen.beginPath();
      let on = false;
      for (let k = 0; k < one.x.length; k++) {
        if (one.y[k] === null || one.x[k] === null) { on = false; continue; }
        const x = across(one.x[k]), y = up(one.y[k]);
        if (!on) pen.moveTo(x, y);
        else {
          if (one.steps) pen.lineTo(x, up(one.y[k - 1]));
          pen.lineTo(x, y);
        }
        on = true;
      }
      if (one.base) {
        for (let k = one.x.length - 1; k >= 0; k--) pen.lineTo(across(one.x[k]), up(one.base[k]));
        pen.globalAlpha = 0.55;
        pen.fill();
        pen.globalAlpha = 1;
      } else pen.stroke();
    }
    pen.restore();
    legend(figure, own);
  };

  const legend = (figure, own) => {
    const listed = own.filter((one) => one.listed);
    const key = listed.map((one) => `${one.name} ${one.colour} ${seen(figure, one)}`).join("|");
    if (figure.legend === key) return;
    figure.legend = key;
    figure.querySelector(".legend").replaceChildren(...listed.map((one) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = one.name;
      button.style.setProperty("--line", one.colour);
      button.setAttribute("aria-pressed", seen(figure, one));
      button.addEventListener("click", () => {
        figure.chosen.set(one.group ? plain(one.group) : one.name, !seen(figure, one));
        draw(figure, figure.spec, figure.pins);
      });
      return button;
    }));
  };

  // What is below the pointer: every line at the same place along x, or the nearest point.
  const read = (figure, event) => {
    const tip = figure.querySelector(".tip"), s = figure.scales;
    if (!s) return;
    const box = figure.querySelector(".canvas").getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    const unified = figure.spec.layout.hovermode === "x unified", found = [];
    for (const one of s.drawn) {
      let best = -1, nearest = Infinity;
      for (let k = 0; k < one.x.length; k++) {
        if (one.y[k] === null || one.x[k] === null) continue;
        const dx = s.across(one.x[k]) - px, dy = unified ? 0 : s.up(one.y[k]) - py, distance = dx * dx + dy * dy;
        if (distance < nearest) [nearest, best] = [distance, k];
      }
      if (best >= 0 && (unified || nearest < CLOSE * CLOSE)) found.push({ one, k: best, nearest });
    }
    if (!unified) found.sort((a, b) => a.nearest - b.nearest).splice(1);
    tip.hidden = !found.length;
    if (!found.length) return;
    const number = (v) => Number(v.toPrecision(5)).toString().replace("-", "−");
    const first = found[0], head = document.createElement("b");
    head.textContent = unified ? number(first.one.x[first.k]) : `${number(first.one.x[first.k])}, ${number(first.one.own[first.k])}`;
    tip.replaceChildren(head, ...found.map(({ one, k }) => {
      const row = document.createElement("span");
      row.textContent = one.texts ? one.texts[k] : `${one.pin ? `${one.pin.name}: ` : ""}${one.name}${unified ? ` ${number(one.own[k])}` : ""}`;
      row.style.setProperty("--line", one.pin ? one.pin.colour : one.colour);
      return row;
    }));
    const right = px > s.width / 2;
    tip.style.left = right ? "" : `${px + 12}px`;
    tip.style.right = right ? `${s.width - px + 12}px` : "";
    tip.style.top = `${TOP}px`;
  };

  // Drag to zoom, double click to go back; a finger scrolls.
  const make = (title) => {
    const figure = document.createElement("figure");
    figure.className = "line-plot";
    figure.innerHTML = `<figcaption></figcaption><div class="canvas" role="img"><canvas></canvas><div class="tip" hidden></div><div class="zoom" hidden></div></div><div class="legend"></div><p class="note"></p>`;
    figure.querySelector("figcaption").textContent = title;
    figure.querySelector(".canvas").setAttribute("aria-label", title);
    figure.chosen = new Map();
    const box = figure.querySelector(".canvas"), zoom = figure.querySelector(".zoom");
    let from = null;
    const at = (event) => [event.clientX - box.getBoundingClientRect().left, event.clientY - box.getBoundingClientRect().top];
    box.addEventListener("pointermove", (event) => {
      read(figure, event);
      if (!from) return;
      const [x, y] = at(event);
      zoom.hidden = Math.abs(x - from[0]) + Math.abs(y - from[1]) < 8;
      Object.assign(zoom.style, { left: `${Math.min(x, from[0])}px`, top: `${Math.min(y, from[1])}px`,
        width: `${Math.abs(x - from[0])}px`, height: `${Math.abs(y - from[1])}px` });
    });
    box.addEventListener("pointerleave", () => { figure.querySelector(".tip").hidden = true; });
    box.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "mouse" || event.button) return;
      from = at(event);
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointerup", (event) => {
      if (from && !zoom.hidden) {
        const s = figure.scales, [x, y] = at(event);
        const along = (p) => s.x0 + ((p - LEFT) / (s.width - LEFT - RIGHT)) * (s.x1 - s.x0);
        const above = (p) => s.y0 + ((s.height - BOTTOM - p) / (s.height - BOTTOM - TOP)) * (s.y1 - s.y0);
        const sorted = (a, b) => (a < b ? [a, b] : [b, a]);
        const [wide, tall] = [Math.abs(x - from[0]) > 8, Math.abs(y - from[1]) > 8];
        figure.view = { x: wide ? sorted(along(from[0]), along(x)) : [s.x0, s.x1], y: tall ? sorted(above(from[1]), above(y)) : [s.y0, s.y1] };
        draw(figure, figure.spec, figure.pins);
      }
      from = null;
      zoom.hidden = true;
    });
    box.addEventListener("dblclick", () => {
      figure.view = null;
      draw(figure, figure.spec, figure.pins);
    });
    return figure;
  };
  return { draw, make, ticks };
})();
