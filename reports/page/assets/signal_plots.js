"use strict";
// Turns the small static curves of a report into plots with zoom, pan and one cursor for all joints of a log.
(function () {
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

  async function inflate(text) {
    const raw = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Response(new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate")));
  }

  // uPlot lies beside the page, or stands in it deflated; the content security policy lets it run by its hash.
  async function library() {
    if (!document.getElementById("plot-library")) return;
    const script = document.createElement("script");
    script.textContent = await (await inflate(document.getElementById("plot-library").textContent)).text();
    document.head.append(script);
  }

  // What gives a block's columns, 32-bit numbers whose bytes of equal weight stand together; null is what is not known.
  async function columns(block) {
    const n = block.kept, all = new Uint8Array(await (await inflate(block.data)).arrayBuffer()), one = new DataView(new ArrayBuffer(4));
    return (k) => Array.from({ length: n }, (_, i) => {
      for (let b = 0; b < 4; b++) one.setUint8(b, all[(4 * k + b) * n + i]);
      const value = one.getFloat32(0, true);
      return Number.isNaN(value) ? null : value;
    });
  }

  // One joint's block as arrays of numbers; null is what a curve is interrupted at.
  async function unpack(joint) {
    const column = await columns(joint);
    let at = 0;
    const x = column(0).map((step) => joint.start + (at += step) * joint.period);
    const residual = column(1), state = column(6), of = (kind) => residual.map((v, i) => state[i] === kind ? v : null);
    joint.level = column(5);
    return { residual: [x, of(0), of(1), of(2)], torque: [x, column(2), column(3), column(4)] };
  }

  // A time of the log, and the wall clock's where it is known.
  function clock(start) {
    const origin = start === null ? NaN : Date.parse(start.replace(/(\.\d{3})\d*/, "$1"));
    return (time) => time.toFixed(3) + " s" + (Number.isNaN(origin) ? "" : " (" + new Date(origin + 1000 * time).toISOString().slice(11, 23) + " UTC)");
  }

  const number = (value) => String(Number(value.toPrecision(6))).replace("-", "−");
  const line = (label, colour, width, dash) =>
    ({ label, stroke: () => css(colour), width, dash, points: { show: false }, value: (u, v) => v == null ? "–" : v.toPrecision(4) });

  function options(log, joint, mode, width, last) {
    const series = mode === "residual"
      ? [line("judged", "--curve", 1.3), line("beyond friction's range", "--curve-light", 1.2), line("not judged", "--muted", 1)]
      : [line("measured", "--ink", 1.2), line("model, least", "--model", 1.2, [5, 3]), line("model, most", "--model", 1.2, [5, 3])];
    const axis = { stroke: () => css("--ink"), grid: { stroke: () => css("--grid"), width: 1 }, ticks: { stroke: () => css("--edge"), width: 1 } };
    const bands = mode === "torque" ? [{ series: [3, 2], fill: () => css("--model-range") }] : [];
    const reach = mode === "residual" ? 1.15 * Math.max(0, ...joint.level.filter((v) => v !== null)) : 0;
    const range = (u, low, high) => low === null ? [-1, 1] : [Math.min(low, -reach), Math.max(high, reach)];
    return {
      width, height: last ? 76 : 54, bands, legend: { show: false },
      cursor: { sync: { key: log.id, setSeries: false }, drag: { x: true, y: false } },
      scales: { x: { time: false }, y: { range: reach ? range : undefined } },
      axes: [{ ...axis, size: last ? 24 : 4, values: last ? undefined : () => [] }, { ...axis, size: 50, space: 22, font: "11px sans-serif", values: (u, at) => at.map(number) }],
      series: [{ label: "s", value: (u, v) => v == null ? "–" : v.toFixed(4) }, ...series],
      hooks: {
        setCursor: [(u) => log.tell(u, joint)],
        draw: [(u) => { if (mode === "residual") threshold(u, joint.level); }],
        setScale: [(u, key) => { if (key === "x" && !log.busy) log.show(u.scales.x.min, u.scales.x.max); }],
      },
    };
  }

  // Both sides of the threshold in force.
  function threshold(u, level) {
    const ctx = u.ctx;
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    ctx.strokeStyle = css("--fail");
    ctx.setLineDash([7, 4]);
    const [x, at] = [u.data[0], (sign, i) => u.valToPos(sign * level[i], "y", true)];
    for (const sign of [1, -1]) {
      ctx.beginPath();
      x.forEach((time, i) => { if (level[i] !== null) ctx.lineTo(u.valToPos(time, "x", true), at(sign, i)); });
      ctx.stroke();
    }
    ctx.restore();
  }

  class Log {
    constructor(section, block) {
      this.id = section.dataset.log;
      this.section = section;
      this.block = block;
      this.mode = "residual";
      this.range = [0, block.end];
      this.plots = new Map();
      this.busy = false;
      this.back = null;
      this.contact = -1;
      block.when = clock(block.start);
      this.controls();
      if (block.arm) columns(block.arm).then((found) => { this.player = new ArmPlayer(section.querySelector(".player"), block, found, (time) => this.point(time)); });
      this.watcher = new IntersectionObserver((seen) => {
        for (const entry of seen) if (entry.isIntersecting) this.draw(entry.target);
      }, { rootMargin: "200px" });
      for (const joint of block.joints) this.watcher.observe(this.figure(joint));
    }

    figure(joint) { return document.getElementById(joint.id); }

    controls() {
      const bar = this.section.querySelector(".tools");
      const button = (text, label, act) => {
        const made = document.createElement("button");
        made.type = "button";
        made.textContent = text;
        made.setAttribute("aria-label", label);
        made.addEventListener("click", act);
        bar.append(made);
        return made;
      };
      this.modes = { residual: "Residual", torque: "Measured and modelled torque" };
      for (const mode in this.modes) {
        this.modes[mode] = button(this.modes[mode], this.modes[mode], () => this.setMode(mode));
        this.modes[mode].setAttribute("aria-pressed", String(mode === this.mode));
      }
      button("−", "Zoom out", () => this.zoom(2));
      button("+", "Zoom in", () => this.zoom(0.5));
      button("◀", "Earlier", () => this.move(-0.5));
      button("▶", "Later", () => this.move(0.5));
      if (this.block.contacts.length) {
        button("◀ contact", "Previous contact", () => this.jump(-1));
        button("contact ▶", "Next contact", () => this.jump(1));
      }
      button("Whole log", "Show the whole log", () => this.show(0, this.block.end));
      for (const joint of this.block.joints) {
        const label = document.createElement("label"), box = document.createElement("input");
        box.type = "checkbox";
        box.checked = true;
        box.addEventListener("change", () => { this.figure(joint).hidden = !box.checked; });
        label.append(box, joint.joint);
        bar.append(label);
      }
      this.backButton = button("Back", "Back to where you came from", () => this.goBack());
      this.backButton.hidden = true;
      const shown = document.createElement("span");
      shown.setAttribute("role", "status");
      this.shown = shown;
      bar.append(shown);
      bar.hidden = false;
      this.section.querySelector(".axis.wide")?.setAttribute("hidden", "");
    }

    tell(plot, joint) {
      const at = plot.cursor.idx;
      if (at == null || !plot.root.matches(":hover")) return;
      this.player?.at(plot.data[0][at]);
      const value = plot.data.slice(1).map((curve) => curve[at]).filter((v) => v != null).map((v) => v.toPrecision(4)).join(" / ");
      this.shown.textContent = joint.joint + " at " + this.block.when(plot.data[0][at]) + ": " + (value || "–") + " " + joint.unit;
    }

    // The contact before or after the one shown last.
    jump(way) {
      const all = this.block.contacts;
      this.contact = (Math.max(this.contact, way < 0 ? 0 : -1) + way + all.length) % all.length;
      const [count, from, to, onset] = all[this.contact];
      this.show(from, to);
      this.point(onset);
      this.shown.textContent = "contact " + count + ": " + this.block.when(onset);
    }

    // The cursor of all plots and the arm at a time.
    point(time) {
      for (const plot of this.plots.values()) plot?.setCursor({ left: plot.valToPos(time, "x"), top: 1 }, false);
      this.player?.at(time);
    }

    async draw(figure) {
      const joint = this.block.joints.find((j) => j.id === figure.id);
      const place = figure.querySelector(".curve-place");
      if (this.plots.has(joint.id) || !place || !place.clientWidth) return;
      this.plots.set(joint.id, null);
      const curves = await (joint.curves ??= unpack(joint));
      place.querySelector("svg").style.display = "none";
      this.busy = true;
      const last = joint === this.block.joints[this.block.joints.length - 1];
      const plot = new uPlot(options(this, joint, this.mode, place.clientWidth, last), curves[this.mode], place);
      plot.setScale("x", { min: this.range[0], max: this.range[1] });
      this.plots.set(joint.id, plot);
      queueMicrotask(() => { this.busy = false; });
    }

    redraw() {
      const drawn = [...this.plots.keys()];
      for (const plot of this.plots.values()) plot?.destroy();
      this.plots.clear();
      for (const id of drawn) this.draw(document.getElementById(id));
    }

    setMode(mode) {
      this.mode = mode;
      for (const name in this.modes) this.modes[name].setAttribute("aria-pressed", String(name === mode));
      this.redraw();
    }

    show(from, to) {
      const least = 5 * this.block.joints[0].period;
      if (!(to - from > least)) { const middle = (from + to) / 2; from = middle - least / 2; to = middle + least / 2; }
      this.range = [from, to];
      this.shown.textContent = this.block.when(from) + " to " + this.block.when(to);
      this.player?.at((from + to) / 2);
      this.busy = true;
      for (const plot of this.plots.values()) plot?.setScale("x", { min: from, max: to });
      queueMicrotask(() => { this.busy = false; });
    }

    zoom(factor) {
      const [a, b] = this.range, middle = (a + b) / 2, half = factor * (b - a) / 2;
      this.show(Math.max(0, middle - half), Math.min(this.block.end, middle + half));
    }

    move(share) {
      const [a, b] = this.range, width = b - a;
      const from = Math.min(Math.max(0, a + share * width), Math.max(0, this.block.end - width));
      this.show(from, from + width);
    }

    goBack() {
      const target = document.getElementById(this.back);
      if (!target) return;
      open(target);
      target.scrollIntoView({ block: "center", behavior: still ? "auto" : "smooth" });
      target.querySelector("a.jump")?.focus({ preventScroll: true });
    }
  }

  // Opens whatever folds an element.
  function open(element) {
    for (let at = element; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
  }

  const logs = new Map();
  async function start() {
    const found = [];
    for (const section of document.querySelectorAll("section.signals")) {
      const block = document.getElementById(section.dataset.log + "-data");
      if (block) found.push([section, block]);
    }
    if (!found.length || typeof DecompressionStream === "undefined") return;
    await library();
    if (typeof uPlot === "undefined") return;
    for (const [section, block] of found) logs.set(section.dataset.log, new Log(section, JSON.parse(block.textContent)));
  }
  start();

  document.addEventListener("click", (event) => {
    const link = event.target.closest?.("a.jump"), log = link && logs.get(link.hash.replace(/^#|-signals$/g, ""));
    if (!log) return;
    log.back = link.dataset.back;
    log.backButton.hidden = false;
    log.backButton.textContent = "Back to " + link.dataset.back.replace(/^log\d+-/, "").replace(/-/g, " ");
    log.show(Number(link.dataset.from), Number(link.dataset.to));
  });

  function follow() {
    let target = null;
    try { target = document.getElementById(decodeURIComponent(location.hash.slice(1))); } catch { return; }
    if (target) { open(target); target.scrollIntoView(); }
  }
  addEventListener("hashchange", follow);
  if (location.hash) follow();

  let timer = 0;
  const later = () => { clearTimeout(timer); timer = setTimeout(() => { for (const log of logs.values()) log.redraw(); }, 150); };
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; later(); } });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", later);
})();
