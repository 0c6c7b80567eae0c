"use strict";
const animate = (figure, data) => { // draws anew at the time that is shown, or at the end if that is
  const SVG = "http://www.w3.org/2000/svg";
  const WIDTH = 1000, BODY = 46, RAIL = 112, MARGIN = 14, SHORTEST = 16, FAR = 90, SLEEPER = 0.6,
    TALL = 44 / 2810; // of a car body: pixels that are a millimetre of height
  const find = (name) => figure.querySelector(name);
  const [button, slider, clock, rate, heights] = [".play", ".time", ".clock", ".rate", ".heights"].map(find);
  const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
  const n = data.vehicles.length, joints = data.interfaces.length, front = data.front;
  const end = data.time[data.time.length - 1], start = data.time[0];
  const life = new AbortController(), listening = { signal: life.signal }, was = figure.shown;
  const first = !was ? start : was.now >= was.end ? end : Math.min(was.now, end), plays = Boolean(was && was.playing);
  if (was) was.life.abort();
  find(".stage").replaceChildren();

  // Lengths: every device as long as its largest stroke and a bit, at one scale that fills the width.
  const most = (values) => values.reduce((a, b) => Math.max(a, b), 0);
  const largest = data.devices.map((sides) => sides.map((d) => most(d.stroke)));
  const body = Math.min(BODY, (0.62 * WIDTH) / n);
  const behind = !data.wall ? 0 : data.obstacle ? body : 20; // the wall, and what stands fixed at it
  const count = largest.flat().length;
  const shorter = data.bodies.map((b) => data.time.map((_, j) => b.reduce((sum, member) => sum + member.stroke[j], 0)));
  const give = data.bodies.map((b) => b.map((member) => most(member.stroke))); // members are drawn longer by so much
  const room = WIDTH - 2 * MARGIN - n * body - (count + 1) * SHORTEST - behind;
  const scale = Math.min(0.2, room / Math.max(1, [...largest.flat(), ...give.flat()].reduce((a, b) => a + b, 0)));
  const lengths = largest.map((sides) => sides.map((u) => u * scale + SHORTEST));
  const length = lengths.map((sides) => sides.reduce((a, b) => a + b, 0));
  const bodies = give.map((b) => body + scale * b.reduce((a, u) => a + u, 0));

  const add = (parent, name, attributes, text) => {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    parent.append(element);
    return element;
  };
  const svg = add(find(".stage"), "svg", { viewBox: `0 26 ${WIDTH} 130`, role: "img",
    "aria-label": `Side view of ${data.vehicles.join(", ")}` });
  const sleepers = add(svg, "g", { class: "sleepers" });
  const pitch = Math.max(12, SLEEPER * 1000 * scale);
  for (let x = -2 * pitch; x < WIDTH + 2 * pitch; x += pitch) add(sleepers, "rect", { x, y: RAIL + 2, width: 5, height: 5 });
  add(svg, "line", { class: "rail", x1: 0, x2: WIDTH, y1: RAIL, y2: RAIL });
  // Vehicles, each drawing in a box from 0 to w; head is 1 for a cab at the right end, -1 at the left one, 2 at both.
  const window_ = (g, x, y, width, height) => add(g, "rect", { class: "pane", x, y, width, height });
  const shell = (g, w, head) => {
    const nose = 7;
    const left = head < 0 || head === 2 ? `M${nose},54 Q0,58 0,98` : "M3,54 Q0,54 0,57 L0,98";
    const right = head > 0 ? `L${w},98 Q${w},58 ${w - nose},54` : `L${w},98 L${w},57 Q${w},54 ${w - 3},54`;
    add(g, "path", { class: "body", d: `${left} ${right} Z` });
  };
  const wheels = (g, w, parts) => {
    const r = Math.min(6, w / 8);
    for (const x of parts) add(g, "ellipse", { class: "wheel", cx: x * w, cy: 105, rx: r, ry: r });
  };
  const drawings = {
    passenger: (g, w, head) => {
      shell(g, w, head);
      const panes = Math.max(2, Math.round((w - 16) / 10)), pane = (w - 16) / panes;
      for (let p = 0; p < panes; p++) window_(g, 8 + p * pane + 1, 59, pane - 2, 9);
      wheels(g, w, [0.2, 0.36, 0.64, 0.8]);
    },
    locomotive: (g, w) => {
      shell(g, w, 2);
      for (const x of [6, w - 12]) window_(g, x, 59, 6, 9);
      add(g, "path", { class: "gear", d: `M${w / 2},54 L${w / 2 - 7},46 L${w / 2},38 M${w / 2 - 8},38 h16` });
      wheels(g, w, [0.2, 0.36, 0.64, 0.8]);
    },
    wagon: (g, w) => {
      add(g, "rect", { class: "body", x: 0, y: 66, width: w, height: 32 });
      const ribs = Array.from({ length: 5 }, (_, j) => `M${((j + 1) * w) / 6},66 v10`).join(" ");
      add(g, "path", { class: "gear", d: ribs });
      wheels(g, w, [0.2, 0.36, 0.64, 0.8]);
    },
    lorry: (g, w) => {
      add(g, "rect", { class: "body", x: 0, y: 54, width: 0.68 * w, height: 44 });
      add(g, "path", { class: "body", d: `M${0.72 * w},98 V64 h${0.16 * w} L${w},82 V98 Z` });
      window_(g, 0.76 * w, 68, 0.12 * w, 9);
      wheels(g, w, [0.16, 0.36, 0.84]);
    },
    block: (g, w) => {
      add(g, "rect", { class: "body", x: 0, y: 78, width: w, height: 30 });
      add(g, "path", { class: "gear", d: Array.from({ length: 4 }, (_, j) => `M${((j + 0.2) * w) / 4},107 l${w / 12},-12`).join(" ") });
    },
    buffer_stop: (g, w) => {
      add(g, "path", { class: "gear", d: `M3,84 L${w - 4},110 M2,98 V110 M0,110 H${w}` });
      for (let j = 0; j < 3; j++) add(g, "rect", { class: j % 2 ? "pane" : "body", x: 0, y: 72 + 9 * j, width: 6, height: 9 });
    },
  };
  drawings.regional = drawings.passenger;
  drawings.coach = (g, w) => drawings.passenger(g, w, 0);
  const wall = data.wall ? add(svg, "g", {}) : null;
  if (wall && data.obstacle) drawings[data.obstacle](add(wall, "g", { class: "car standing" }), body - 8, 0);
  if (wall) add(wall, "rect", { class: "wall", x: data.obstacle ? body - 8 : 0, y: 34, width: data.obstacle ? 8 : 20, height: RAIL - 34 });

  const cars = data.vehicles.map((name, i) => {
    const g = add(svg, "g", { class: i < data.moving ? "car moving" : "car standing" });
    const w = bodies[i], head = i === data.moving - 1 ? 1 : i === data.moving ? -1 : 0;
    const shape = add(g, "g", {});
    drawings[data.drawings[i]](shape, w, head);
    const members = data.bodies[i].map(() => add(shape, "rect", { class: "member", y: 71, height: 26.5 }));
    const part = data.drawings[i] === "lorry" ? 0.34 : 0.5;
    return { g, w, give: give[i], shape, members, part, name: add(g, "text", { class: "name", y: 88 }, name), speed: add(g, "text", { class: "speed", y: 134 }),
      wheels: [...shape.querySelectorAll(".wheel")].map((wheel) => ({ wheel, r: Number(wheel.getAttribute("ry")) })) };
  });

  // A body as long as it is then; its members take the colour of the energy that they have lost by yielding.
  const squeeze = (car, own, mix, [left, right], wheels) => {
    const now = own.map((member) => mix(member.stroke)), width = car.w - scale * now.reduce((a, b) => a + b, 0);
    const part = width / car.w, share = body / Math.max(1, own.length);
    let x = 0, crushed = false;
    car.shape.setAttribute("transform", `matrix(${part},${(left - right) / car.w},0,1,0,${-left})`);
    car.wheels.forEach(({ wheel, r }, k) => {
      wheel.setAttribute("rx", r / part);
      const carried = left + ((right - left) * wheel.getAttribute("cx")) / car.w; // which a wheel does not follow
      if (wheels.length) wheel.setAttribute("cy", 105 - wheels[k] + carried);
    });
    car.members.forEach((box, k) => {
      const energy = mix(own[k].energy), w = (share + scale * (car.give[k] - now[k])) / part, yields = energy > 0.001;
      box.setAttribute("x", x);
      box.setAttribute("width", w);
      box.setAttribute("fill", yields ? colour(energy / data.largest_energy) : "none");
      crushed = crushed || yields;
      x += w;
    });
    car.g.classList.toggle("crushed", crushed);
    car.name.setAttribute("x", car.part * width);
    car.speed.setAttribute("x", width / 2);
    return width;
  };

  const device = (halves) => {
    const g = add(svg, "g", { class: "device" });
    const parts = Array.from({ length: halves }, () => ({
      box: add(g, "rect", { class: "crush", y: 84, height: 14 }), folds: add(g, "path", { class: "folds" }) }));
    const labels = (name, y) => parts.map((_, j) => add(svg, "text", { class: halves > 1 ? `${name} ${j ? "right" : "left"}` : name, y }));
    return { parts, stroke: labels("stroke", 44), energy: labels("energy", 150) };
  };
  const devices = data.devices.map((sides) => device(sides.length));

  const channels = data.colours.map((c) => [1, 3, 5].map((j) => parseInt(c.slice(j, j + 2), 16)));
  const colour = (part) => {
    const at = Math.min(Math.max(part, 0), 1) * (channels.length - 1), k = Math.min(Math.floor(at), channels.length - 2);
    return `rgb(${channels[k].map((c, j) => Math.round(c + (at - k) * (channels[k + 1][j] - c))).join(",")})`;
  };
  find(".bar").style.background = `linear-gradient(to right, ${data.colours.join(",")})`;
  find(".most").textContent = data.largest_energy.toFixed(data.digits);

  const fold = (part, x, width, energy) => {
    const w = Math.max(width, 2);
    part.box.setAttribute("x", x);
    part.box.setAttribute("width", w);
    part.box.setAttribute("fill", energy > 0.001 ? colour(energy / data.largest_energy) : "#ffffff");
    part.folds.setAttribute("d", Array.from({ length: 5 }, (_, j) => `M${x + ((j + 1) * w) / 6},84 v14`).join(" "));
  };

  // One frame, between the two samples around a time; the place of the impact stays where it is on the screen.
  const show = (time) => {
    const span = data.time.length - 1;
    const at = end > start ? ((time - start) / (end - start)) * span : 0;
    const j = Math.min(Math.floor(at), Math.max(span - 1, 0)), part = at - j, next = Math.min(j + 1, span);
    const mix = (values) => values[j] + part * (values[next] - values[j]);
    const stroke = data.stroke.map(mix);
    const used = data.devices.map((sides) => sides.map((d) => ({ stroke: mix(d.stroke), energy: mix(d.energy) })));
    const width = stroke.map((u, k) => Math.min(length[k] - scale * u, length[k] + FAR));
    const whole = bodies.reduce((a, b) => a + b, 0) + length.reduce((a, b) => a + b, 0) + behind;
    let x = (WIDTH - whole) / 2;
    for (let k = 0; k < front; k++) x += length[k] - width[k];
    x += (length[front] - width[front]) / (data.wall ? 1 : 2);
    for (let i = 0; i < data.moving; i++) x += scale * mix(shorter[i]);
    const up = (series) => Number(heights.value) * TALL * mix(series);
    const rises = cars.map((_, i) => (data.rises[i] && data.rises[i].length ? data.rises[i].map(up) : [0, 0]));
    // from a rise at x to another one behind a width, each straight up
    const raised = (x, width, from, to) => {
      const slope = (from - to) / Math.max(width, 1);
      return `matrix(1,${slope},0,1,0,${-from - slope * x})`;
    };
    let car = 0;
    const place = (k) => {
      const d = devices[k], own = used[k].map((one, j) => lengths[k][j] - scale * one.stroke);
      fold(d.parts[0], x, own[0], used[k][0].energy);
      if (own.length > 1) fold(d.parts[1], x + width[k] - own[1], own[1], used[k][1].energy);
      if (data.rises.length) {
        const left = rises[k][1], right = k + 1 < n ? rises[k + 1][0] : own.length > 1 ? 0 : left;
        const sides = own.length > 1 ? [[left, left], [right, right]] : [[left, right]];
        d.parts.forEach((part, j) => {
          for (const shape of [part.box, part.folds]) shape.setAttribute("transform", raised(x, width[k], ...sides[j]));
        });
      }
      // the numbers of a device stand over and below it; of two, each on its side of where they meet
      const meets = x + (own.length > 1 ? (own[0] + width[k] - own[1]) / 2 : width[k] / 2);
      used[k].forEach((one, j) => {
        for (const text of [d.stroke[j], d.energy[j]]) text.setAttribute("x", meets + (own.length > 1 ? (j ? 5 : -5) : 0));
        d.stroke[j].textContent = Math.max(0, one.stroke).toFixed(0);
        d.energy[j].textContent = one.energy.toFixed(data.digits);
      });
      x += width[k];
    };
    for (const one of cars) {
      one.g.setAttribute("transform", `translate(${x},0)`);
      one.speed.textContent = mix(data.speed[car]).toFixed(1).replace("-0.0", "0.0");
      x += squeeze(one, data.bodies[car], mix, rises[car], data.wheels[car] ? data.wheels[car].map(up) : []);
      if (car < joints) place(car);
      car += 1;
    }
    if (wall) wall.setAttribute("transform", `translate(${x},0)`);
    sleepers.setAttribute("transform", `translate(${-((mix(data.impact) * scale) % pitch)},0)`);
    const valid = data.valid_until === null || time <= data.valid_until;
    const said = `${time.toFixed(3)} s${valid ? "" : ", not valid"}`;
    slider.value = Math.round((1000 * (time - start)) / (end - start || 1));
    slider.setAttribute("aria-valuetext", said);
    clock.textContent = said;
    figure.dataset.time = time;
    now = time;
  };

  let now = first, playing = false, last = 0, shown = 0;
  const tick = (moment) => {
    if (!playing || life.signal.aborted) return;
    now = Math.min(end, now + ((moment - last) / 1000) * Number(rate.value));
    last = moment;
    if (!calm.matches || moment - shown > 500 || now >= end) { // where motion is not wanted: a picture each half second
      show(now);
      shown = moment;
    }
    if (now >= end) play(false);
    else requestAnimationFrame(tick);
  };
  const play = (on) => {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (now >= end) now = start;
    last = performance.now();
    requestAnimationFrame(tick);
  };
  button.addEventListener("click", () => play(!playing), listening);
  if (heights) heights.addEventListener("change", () => show(now), listening);
  slider.addEventListener("input", () => {
    play(false);
    show(start + (slider.value / 1000) * (end - start));
  }, listening);
  figure.addEventListener("keydown", (event) => {
    if (event.key !== " " || [button, rate, heights].includes(event.target)) return;
    event.preventDefault();
    play(!playing);
  }, listening);
  let before = start;
  window.addEventListener("beforeprint", () => { before = now; play(false); show(end); }, listening);
  window.addEventListener("afterprint", () => show(before), listening);
  figure.shown = { life, end, get now() { return now; }, get playing() { return playing; } };
  show(first);
  if (plays) play(true);
  const stage = find(".stage");
  if (!was) stage.scrollLeft = (stage.scrollWidth - stage.clientWidth) / 2;
};
document.querySelectorAll(".animation").forEach((figure) => {
  figure.redraw = (data) => animate(figure, data);
  figure.redraw(JSON.parse(figure.querySelector("script").textContent));
});
