"use strict";
// Values go to the server as they change; what comes back is drawn: the newest only.
(() => {
  const start = JSON.parse(document.getElementById("start").textContent);
  const $ = (id) => document.getElementById(id);
  const SVG = "http://www.w3.org/2000/svg", MOST_POINTS = 60, MOST_FOUND = 40, FIRST = 12, CLOSE = 0.001; // mm between points
  const PINS = [["#a8006d", [7, 3]], ["#4a4f57", [3, 3]], ["#8a5a00", [9, 3, 2, 3]], ["#00664a", [2, 2]]];
  const changes = new Map(), asked = new Map(), made = new Map(); // by title: of which answer a section is
  let sent = 0, drawn = 0, pictures = 0, wrong = {}, shown = start.shown, of = {}, pins = [], socket = null, everything = false, pinning = false, later = 0;
  const make = (name, attributes = {}, text) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  };
  const tidy = (value, notch) => Number((Math.round(value / notch) * notch).toPrecision(10));
  const numeric = (text) => (text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : text);
  const said = (all) => Object.entries(all).map(([name, value]) => `${name} = ${value}`).join(", ") || "as given";

  // What is asked and answered

  const open = () => {
    socket = new WebSocket(`ws://${location.host}${location.pathname}live`);
    socket.addEventListener("open", () => { document.body.dataset.live = "yes"; if (sent > drawn) ask(); else tell(); });
    socket.addEventListener("message", (event) => answered(JSON.parse(event.data)));
    socket.addEventListener("close", () => { tell(); setTimeout(open, 1000); });
  };
  const send = (what, n, values, more = {}) => {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ ask: what, n, changes: values, ...more }));
  };
  const ask = (last = "") => { // first what is looked at, then the rest
    const values = Object.fromEntries(changes);
    asked.set(++sent, values);
    document.body.dataset.sent = sent; // for those who measure, as the two below
    send("show", sent, values, { last, wanted: inView() });
    tell();
  };
  const rest = () => {
    const wanted = shown.titles.filter((title) => made.get(title) !== drawn);
    if (made.get("numbers") !== drawn) wanted.push("numbers");
    if (wanted.length && !Object.keys(wrong).length) send("rest", drawn, of, { wanted });
  };
  const answered = (message) => {
    if (message.yaml !== undefined) return keep(message.yaml);
    if (message.n < drawn) return;
    const values = message.n === drawn ? of : asked.get(message.n), anew = message.n > drawn;
    drawn = message.n;
    for (const n of asked.keys()) if (n <= drawn) asked.delete(n);
    wrong = message.wrong ?? {};
    if (message.shown) {
      const { sections, numbers } = message.shown, fresh = new Map(sections.map((section) => [section.title, section]));
      for (const title of fresh.keys()) made.set(title, drawn);
      if (numbers) made.set("numbers", drawn);
      for (const old of shown.sections) if (!fresh.has(old.title)) fresh.set(old.title, old);
      shown = { ...message.shown, numbers: numbers ?? shown.numbers, sections: message.shown.titles.map((title) => fresh.get(title)).filter(Boolean) };
      of = values;
      draw(sections);
      clearTimeout(later);
      if (drawn === sent) later = setTimeout(rest, pinning ? 0 : 120);
    }
    tell();
    if (pinning && whole()) pin();
    document.body.dataset.drawn = drawn;
    if (!anew) return;
    document.body.dataset.pictures = ++pictures;
    document.dispatchEvent(new CustomEvent("drawn", { detail: drawn }));
  };
  const whole = () => drawn === sent && ["numbers", ...shown.titles].every((title) => made.get(title) === drawn);
  const inView = () => [...document.querySelectorAll("main > section[data-title]")].filter((section) => {
    const box = section.getBoundingClientRect();
    return box.height && box.bottom > 0 && box.top < innerHeight;
  }).map((section) => section.dataset.title).concat(pins.length ? ["numbers"] : []);
  const set = (name, value, given) => {
    if (value === given) changes.delete(name);
    else changes.set(name, value);
    ask(name);
  };

  // What is said of the values as they stand

  const isOld = () => Object.keys(wrong).length > 0 || socket.readyState > WebSocket.OPEN;
  const tell = () => {
    const old = isOld(), state = $("state");
    state.textContent = socket.readyState > WebSocket.OPEN ? `trainmj explore has stopped. What is shown is of: ${said(of)}.`
      : old ? `A value cannot be computed. What is shown is old, of: ${said(of)}.`
      : sent > drawn ? "Computing …" : "";
    state.classList.toggle("old", old);
    document.body.classList.toggle("old", old);
    for (const section of document.querySelectorAll("main > section[data-title]")) {
      section.classList.toggle("of-old", old);
      section.classList.toggle("behind", !old && made.get(section.dataset.title) !== drawn);
    }
    for (const button of ["pin", "save", "copy"]) $(button).disabled = old;
    for (const control of controls.values()) control.tell();
    const left = Object.entries(wrong).filter(([name]) => !controls.has(name) && !inCurve(name)).map(([, text]) => text);
    $("general").textContent = left.join("\n");
    $("general").hidden = !left.length;
    const here = Object.entries(wrong).filter(([name]) => inCurve(name)).map(([, text]) => text);
    $("curve-wrong").textContent = here.join("\n");
    $("curve-wrong").hidden = !here.length;
    bar(old);
  };
  const verdict = (v) => {
    const element = make("span", { class: `verdict ${v.kind}` });
    element.append(make("span", { "aria-hidden": "true" }, v.sign), ` ${v.text}`);
    return element;
  };
  const bar = (old) => {
    const s = shown.status;
    $("bar-status").replaceChildren(...(old ? [make("span", { id: "old" }, "OLD: ")] : []), verdict({ ...s, text: s.not_valid ? `${s.text}, ${s.not_valid}` : s.text }));
    $("bar-numbers").replaceChildren(...[...shown.key, s.limits].map((text) => make("span", {}, text + (s.not_valid && /\d/.test(text) ? " (not valid)" : ""))));
  };

  // Sliders

  const controls = new Map();
  const control = (one, added) => {
    const row = make("div", { class: "control", "data-name": one.name }), id = `value-${one.name}`;
    const head = make("div", { class: "head" }), label = make("label", { for: id });
    for (const part of added ? one.name.split(/(?<=[._])/) : [one.words]) label.append(part, make("wbr"));
    if (one.unit) label.append(" ", make("span", { class: "unit" }, one.unit));
    const field = make("input", { class: "value", id, inputmode: "decimal", autocomplete: "off" });
    const back = make("button", { type: "button", class: "back", title: "As given", "aria-label": `${one.name} as given` }, "↺");
    const slider = make("input", { type: "range", step: "any", "aria-label": one.words });
    const note = make("p", { class: "note" }), bad = make("p", { class: "wrong", role: "alert", hidden: "" });
    const about = [one.meaning, one.allowed, one.differ ? `sets ${one.differ} values that differ now` : ""].filter(Boolean);
    note.textContent = about.join("; ");
    head.append(label, field, back);
    row.append(head, slider, bad, note);
    const fill = (value) => {
      field.value = value;
      if (typeof value !== "number") return;
      slider.min = Math.min(one.low, value);
      slider.max = Math.max(one.high, value);
      slider.value = value;
    };
    slider.addEventListener("input", () => {
      const value = Math.min(Number(slider.max), Math.max(Number(slider.min), tidy(Number(slider.value), one.notch)));
      field.value = value;
      set(one.name, value, one.value);
    });
    field.addEventListener("change", () => { fill(numeric(field.value)); set(one.name, numeric(field.value), one.value); });
    back.addEventListener("click", () => { fill(one.value); set(one.name, one.value, one.value); });
    if (added) {
      const away = make("button", { type: "button", title: "Take it away", "aria-label": `Take ${one.name} away` }, "×");
      away.addEventListener("click", () => { row.remove(); controls.delete(one.name); set(one.name, one.value, one.value); });
      head.append(away);
    }
    fill(changes.get(one.name) ?? one.value);
    controls.set(one.name, { fill: () => fill(changes.get(one.name) ?? one.value), tell: () => {
      row.classList.toggle("changed", changes.has(one.name));
      row.classList.toggle("bad", one.name in wrong);
      field.setAttribute("aria-invalid", one.name in wrong);
      back.hidden = !changes.has(one.name);
      bad.hidden = !(one.name in wrong);
      bad.textContent = wrong[one.name] ?? "";
    } });
    $("controls").append(row);
    return field;
  };

  const search = () => {
    const words = $("find").value.toLowerCase().split(/\s+/).filter(Boolean);
    const all = start.values.others.filter((one) => !controls.has(one.name));
    const fits = all.filter((one) => { const text = `${one.name} ${one.words} ${one.unit} ${one.meaning}`.toLowerCase(); return words.every((w) => text.includes(w)); });
    const named = (one) => words.every((w) => one.name.toLowerCase().includes(w));
    fits.sort((a, b) => named(b) - named(a)); // those of the name first, each as they stand in the file
    const list = $("found");
    list.hidden = false;
    list.replaceChildren(...fits.slice(0, MOST_FOUND).map((one) => {
      const item = make("li"), button = make("button", { type: "button" }, one.name);
      button.append(make("small", {}, [`${one.value} ${one.unit}`.trim(), one.allowed, one.meaning].filter(Boolean).join("; ")));
      button.addEventListener("click", () => {
        list.hidden = true;
        $("find").value = "";
        control(one, true).focus();
        tell();
      });
      item.append(button);
      return item;
    }));
    const rest = fits.length - MOST_FOUND;
    if (rest > 0 || !fits.length) list.append(make("li", { class: "note" }, fits.length ? `and ${rest} more: type more of the name` : "No number of this name."));
  };

  // Curves

  let curve = 0, chosen = -1;
  const inCurve = (name) => start.values.curves.some((c) => c.pieces.some((piece) => name.startsWith(`${piece.path}.`)));
  const pointsOf = (c) => c.pieces.flatMap((piece) => piece.x.map((x, k) => ({
    names: [`${piece.path}.${c.x}.${k}`, `${piece.path}.${c.y}.${k}`], given: [x, piece.y[k]] })))
    .map((p) => ({ ...p, at: p.names.map((name, axis) => (typeof changes.get(name) === "number" ? changes.get(name) : p.given[axis])) }));
  const scalesOf = (points) => {
    const top = (axis) => Math.max(...points.map((p) => Math.max(p.at[axis], p.given[axis])), 1e-9) * 1.15;
    const wide = $("editor").clientWidth || 300;
    return { wide, x: top(0), y: top(1), left: 38, right: 8, top: 8, bottom: 30, high: 200 };
  };
  const edit = (held) => {
    const c = start.values.curves[curve], svg = $("editor").firstElementChild, points = pointsOf(c), s = held ?? scalesOf(points);
    const across = (x) => s.left + (x / s.x) * (s.wide - s.left - s.right), up = (y) => s.high - s.bottom - (y / s.y) * (s.high - s.bottom - s.top);
    const add = (name, attributes, text) => {
      const element = document.createElementNS(SVG, name);
      for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
      if (text !== undefined) element.textContent = text;
      svg.append(element);
      return element;
    };
    const focused = document.activeElement && document.activeElement.parentNode === svg;
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${s.wide} ${s.high}`);
    const tx = lines.ticks(0, s.x, 5), ty = lines.ticks(0, s.y, 5);
    for (const t of tx.found) { add("line", { class: "grid", x1: across(t), x2: across(t), y1: s.top, y2: s.high - s.bottom }); add("text", { x: across(t), y: s.high - s.bottom + 12, "text-anchor": "middle" }, t.toFixed(tx.digits)); }
    for (const t of ty.found) { add("line", { class: "grid", x1: s.left, x2: s.wide - s.right, y1: up(t), y2: up(t) }); add("text", { x: s.left - 4, y: up(t) + 3, "text-anchor": "end" }, t.toFixed(ty.digits)); }
    add("text", { x: s.wide / 2, y: s.high - 4, "text-anchor": "middle" }, `${c.axes[0]}; up: ${c.axes[1]}`);
    const way = (values) => values.map(([x, y]) => `${across(x)},${up(y)}`).join(" ");
    add("polyline", { class: "old-line", points: way(points.map((p) => p.given)) });
    add("polyline", { class: "line", points: way(points.map((p) => p.at)) });
    const few = points.length <= MOST_POINTS;
    if (few) points.forEach((p, k) => {
      const circle = add("circle", { cx: across(p.at[0]), cy: up(p.at[1]), r: 5.5, tabindex: 0, role: "button", "data-point": k, class: k === chosen ? "chosen" : "", "aria-label": `point ${k + 1}: ${p.at[0]}, ${p.at[1]}` });
      circle.addEventListener("focus", () => choose(k));
      if (k === chosen && focused) circle.focus();
    });
    else add("text", { x: s.wide / 2, y: s.top + 14, "text-anchor": "middle" }, `${points.length} points: too many to drag`);
    svg.scales = { ...s, across, up };
    const p = points[chosen];
    $("point").hidden = !p || !few;
    if (p) {
      $("point").querySelector(".where").textContent = p.names[1].replace(/\.[^.]+\.(\d+)$/, (_, k) => `, point ${Number(k) + 1}`);
      for (const [axis, key] of ["x", "y"].entries()) {
        $("point").querySelector(`span.${key}`).textContent = c.axes[axis];
        const field = $("point").querySelector(`input.${key}`);
        field.classList.toggle("bad", p.names[axis] in wrong);
        if (document.activeElement !== field) field.value = changes.get(p.names[axis]) ?? p.given[axis];
      }
    }
    $("curve-back").hidden = !points.some((p) => p.names.some((name) => changes.has(name)));
  };
  const choose = (k) => {
    if (k === chosen) return;
    chosen = k;
    edit();
  };
  const move = (k, [x, y], held) => {
    const points = pointsOf(start.values.curves[curve]), p = points[k], s = held ?? scalesOf(points);
    const notch = [s.x / 400, s.y / 400].map((size) => 10 ** Math.floor(Math.log10(size)));
    const low = k ? points[k - 1].at[0] + CLOSE : 0, high = k + 1 < points.length ? points[k + 1].at[0] - CLOSE : Infinity;
    [[x, low, high], [y, 0, Infinity]].forEach(([wanted, least, most], axis) => {
      const from = held ? held.from[axis] : p.at[axis]; // which stays where it is moved the other way
      if (Math.abs(wanted - from) < 0.6 * notch[axis]) put(p, axis, from);
      else if (least <= most) put(p, axis, Number(Math.min(most, Math.max(least, tidy(wanted, notch[axis]))).toPrecision(10)));
    });
    edit(held);
    ask(p.names[1]);
  };
  const put = (p, axis, value) => {
    if (value === p.given[axis]) changes.delete(p.names[axis]);
    else changes.set(p.names[axis], value);
  };
  const curves = () => {
    $("curves").hidden = !start.values.curves.length;
    if (!start.values.curves.length) return;
    $("curve").replaceChildren(...start.values.curves.map((c, k) => make("option", { value: k }, c.title)));
    $("curve").addEventListener("change", () => { curve = Number($("curve").value); chosen = -1; edit(); });
    const svg = $("editor").firstElementChild;
    let held = null;
    const place = (event) => {
      const s = held, box = s.box; // of when it was taken: a message may move the page below the hand
      return [((event.clientX - box.left - s.left) / (s.wide - s.left - s.right)) * s.x, ((s.high - s.bottom - (event.clientY - box.top)) / (s.high - s.bottom - s.top)) * s.y]
        .map((at, axis) => at - s.off[axis]);
    };
    svg.addEventListener("pointerdown", (event) => {
      const k = event.target.dataset && event.target.dataset.point;
      if (k === undefined) return;
      event.preventDefault();
      choose(Number(k));
      svg.querySelector(`[data-point="${k}"]`).focus({ preventScroll: true });
      const from = pointsOf(start.values.curves[curve])[chosen].at;
      held = { ...svg.scales, from, box: svg.getBoundingClientRect(), off: [0, 0] };
      held.off = place(event).map((at, axis) => at - from[axis]);
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", (event) => { if (held) move(chosen, place(event), held); });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { if (held) { held = null; edit(); } });
    svg.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!way || chosen < 0) return;
      event.preventDefault();
      const points = pointsOf(start.values.curves[curve]), s = scalesOf(points), at = points[chosen].at;
      move(chosen, [at[0] + (way[0] * s.x) / 100, at[1] + (way[1] * s.y) / 100]);
    });
    for (const [axis, key] of ["x", "y"].entries()) $("point").querySelector(`input.${key}`).addEventListener("change", (event) => {
      const p = pointsOf(start.values.curves[curve])[chosen];
      put(p, axis, numeric(event.target.value));
      ask(p.names[axis]);
      edit();
    });
    $("curve-back").addEventListener("click", () => {
      for (const p of pointsOf(start.values.curves[curve])) for (const name of p.names) changes.delete(name);
      edit();
      ask();
    });
    new ResizeObserver(() => edit()).observe($("editor"));
  };

  // What came back

  const seen = new Set();
  const watching = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (isIntersecting) seen.add(target);
      else seen.delete(target);
      if (isIntersecting && target.due) target.due();
    }
  }, { rootMargin: "150px" });
  const plots = (place, section) => {
    const there = new Map([...place.children].map((figure) => [figure.dataset.title, figure]));
    section.plots.forEach((plot, k) => {
      let figure = there.get(plot.title);
      there.delete(plot.title);
      if (!figure) {
        figure = lines.make(plot.title);
        figure.dataset.title = plot.title;
        watching.observe(figure);
      }
      if (place.children[k] !== figure) place.insertBefore(figure, place.children[k] ?? null);
      const note = figure.querySelector(".note"), mark = shown.status.not_valid;
      if (note.textContent !== plot.note) note.textContent = plot.note;
      figure.querySelector("figcaption").textContent = plot.title + (mark ? `: ${mark}` : "");
      figure.due = () => {
        figure.due = null;
        lines.draw(figure, plot.figure, pins.map((pin) => ({ ...pin, spec: pin.plots.get(`${section.title} ${plot.title}`) })).filter((pin) => pin.spec));
      };
      if (seen.has(figure)) figure.due();
    });
    for (const figure of there.values()) { watching.unobserve(figure); seen.delete(figure); figure.remove(); }
  };
  const filled = (place, html) => {
    if (place.held === html) return;
    place.held = html;
    const unfolded = [...place.querySelectorAll("details")].map((d) => d.open), scrolled = [...place.querySelectorAll(".scroll")].map((d) => d.scrollLeft);
    place.innerHTML = html;
    place.querySelectorAll("details").forEach((d, k) => { d.open = unfolded[k] ?? false; });
    place.querySelectorAll(".scroll").forEach((d, k) => { if (scrolled[k]) d.scrollLeft = scrolled[k]; });
  };
  const sectionOf = (title) => {
    const found = [...document.querySelectorAll("main > section")].find((section) => section.dataset.title === title);
    if (found) return found;
    const section = make("section", { "data-title": title });
    section.innerHTML = '<h2></h2><div class="blocks"><div class="block"><div class="fragment"></div><div class="plots"></div></div></div>';
    section.firstChild.textContent = title;
    $("about").before(section);
    return section;
  };
  const draw = (sections = shown.sections) => {
    for (const section of document.querySelectorAll("main > section[data-title]")) section.hidden = !shown.titles.includes(section.dataset.title);
    for (const s of sections) {
      const section = sectionOf(s.title), animation = section.querySelector(".animation");
      const { kind, sign, text, not_valid } = shown.status, head = section.querySelector("h2");
      head.dataset.status = kind === "pass" ? "" : `${sign} ${text}${not_valid ? `, ${not_valid}` : ""}`;
      head.dataset.kind = kind;
      filled(section.querySelector(".fragment"), s.html);
      plots(section.querySelector(".plots"), s);
      if (animation && s.animation) animation.redraw(s.animation);
    }
    document.querySelector(".subtitle").textContent = [shown.subject, shown.changed].filter(Boolean).join("; ");
    $("command").textContent = shown.command;
    variants();
  };

  // Variants side by side

  const variants = () => {
    $("variants").hidden = !pins.length;
    document.querySelector('nav a[href="#variants"]').parentNode.hidden = !pins.length;
    if (!pins.length) return;
    const all = [{ name: "Now", changes: said(of), status: shown.status, numbers: shown.numbers }, ...pins];
    const by = all.map((one) => new Map(one.numbers.map((number) => [number.name, number])));
    const names = [...new Set(all.flatMap((one) => one.numbers.map((number) => number.name)))];
    const limits = names.filter((name) => name.startsWith("limit ")), rest = names.filter((name) => !name.startsWith("limit "));
    const table = make("table"), head = make("tr");
    head.append(make("th", { scope: "col" }, ""));
    all.forEach((one, k) => {
      const cell = make("th", { scope: "col" }), name = make("b", {}, one.name);
      if (k) { const key = make("span", { class: "key" }); key.style.borderColor = one.colour; name.prepend(key); }
      cell.append(name, one.changes, make("br"), verdict({ ...one.status, text: one.status.not_valid ? `${one.status.text}, ${one.status.not_valid}` : one.status.text }));
      if (k) {
        const take = make("button", { type: "button" }, "Set its values"), away = make("button", { type: "button", "aria-label": `Take pin ${one.name} away` }, "×");
        take.addEventListener("click", () => {
          changes.clear();
          for (const [name, value] of Object.entries(one.values)) changes.set(name, value);
          for (const [name, value] of Object.entries(one.values)) if (!controls.has(name)) { const other = start.values.others.find((o) => o.name === name); if (other) control(other, true); }
          for (const c of controls.values()) c.fill();
          if (start.values.curves.length) edit();
          ask();
        });
        away.addEventListener("click", () => { pins = pins.filter((pin) => pin !== one); draw(); });
        cell.append(make("br"), take, " ", away);
      }
      head.append(cell);
    });
    const rows = (everything ? names : [...limits, ...rest.slice(0, FIRST)]).map((name) => {
      const row = make("tr"), any = by.map((map) => map.get(name)).find(Boolean);
      row.append(make("th", { scope: "row" }, `${name.startsWith("limit ") ? "Limit: " : ""}${any.title}${any.unit ? ` (${any.unit})` : ""}`));
      by.forEach((map, k) => {
        const found = map.get(name), cell = make("td"), invalid = all[k].status.not_valid;
        cell.append(found ? found.text : "–");
        if (found && found.verdict && !invalid) cell.append(" ", verdict(found.verdict));
        if (found && invalid) cell.append(" ", verdict({ kind: "fail", sign: "✗", text: "not valid" }));
        row.append(cell);
      });
      row.classList.toggle("differs", new Set(by.map((map) => (map.get(name) ?? {}).text)).size > 1);
      return row;
    });
    const caption = make("thead"), body = make("tbody");
    caption.append(head);
    body.append(...rows);
    table.append(caption, body);
    $("compared").replaceChildren(table);
    $("all-rows").textContent = everything ? "Fewer rows" : `All ${names.length} rows`;
  };
  const pin = () => { // once all of it is there
    pinning = !whole();
    if (pinning) return void rest();
    const used = new Set(pins.map((one) => one.name)), k = PINS.findIndex((_, n) => !used.has("ABCD"[n]));
    if (k < 0) return void ($("state").textContent = "Four variants are pinned: take one away first.");
    const [colour, dash] = PINS[k];
    const plots = new Map(shown.sections.flatMap((s) => s.plots.map((plot) => [`${s.title} ${plot.title}`, plot.figure])));
    pins.push({ name: "ABCD"[k], changes: said(of), values: of, status: shown.status, numbers: shown.numbers, plots, colour, dash });
    pins.sort((a, b) => (a.name < b.name ? -1 : 1));
    draw();
  };
  const keep = (yaml) => {
    $("saved").hidden = false;
    $("saved").firstElementChild.textContent = start.file;
    $("yaml").textContent = yaml;
    const link = make("a", { download: start.file, href: URL.createObjectURL(new Blob([yaml], { type: "application/yaml" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  };

  for (const fragment of document.querySelectorAll("main > section .fragment")) {
    const section = fragment.closest("section");
    section.dataset.title = section.querySelector("h2").textContent;
  }
  for (const one of start.values.parameters) control(one, false);
  for (const name of ["input", "focus"]) $("find").addEventListener(name, search);
  document.addEventListener("pointerdown", (event) => { if (!$("more").contains(event.target)) $("found").hidden = true; });
  $("more").addEventListener("keydown", (event) => { if (event.key === "Escape") $("found").hidden = true; });
  $("pin").addEventListener("click", pin);
  $("save").addEventListener("click", () => send("save", sent, Object.fromEntries(changes)));
  $("all-rows").addEventListener("click", () => { everything = !everything; variants(); });
  $("copy").addEventListener("click", async () => {
    await navigator.clipboard.writeText($("command").textContent);
    $("copy").textContent = "Copied";
    setTimeout(() => { $("copy").textContent = "Copy the command"; }, 1500);
  });
  $("back").addEventListener("click", () => {
    changes.clear();
    for (const one of controls.values()) one.fill();
    if (start.values.curves.length) edit();
    ask();
  });
  let wide = 0;
  new ResizeObserver(() => {
    if (document.body.clientWidth === wide) return;
    wide = document.body.clientWidth;
    for (const figure of document.querySelectorAll(".line-plot")) if (figure.spec && !figure.due) lines.draw(figure, figure.spec, figure.pins);
  }).observe(document.body);
  for (const title of ["numbers", ...shown.titles]) made.set(title, 0);
  document.body.dataset.pictures = 0;
  open();
  curves();
  draw();
  tell();
  const figure = document.querySelector(".animation"), slider = figure.querySelector(".time");
  slider.value = slider.max; // the end, where it is seen what a value changes
  slider.dispatchEvent(new Event("input"));
})();
