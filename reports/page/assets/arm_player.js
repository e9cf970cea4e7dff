"use strict";
// The arm as a stick figure that moves with the cursor: from the side, as it is turned, and from above.
const ArmPlayer = (function () {
  const SIZE = 100, SVG = "http://www.w3.org/2000/svg", SCALES = [10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05];
  const times = (a, b) => a.map((_, i) => { const r = 3 * Math.floor(i / 3), c = i % 3; return a[r] * b[c] + a[r + 1] * b[c + 3] + a[r + 2] * b[c + 6]; });
  const moved = (a, v, p) => p.map((at, i) => at + a[3 * i] * v[0] + a[3 * i + 1] * v[1] + a[3 * i + 2] * v[2]);

  // Origins of the joints and the tool, and directions of the axes, in the base: what arm_at of core/data/signals.py does.
  function pose(arm, q) {
    const turns = [[1, 0, 0, 0, 1, 0, 0, 0, 1]], origins = [[0, 0, 0]];
    for (const [joint, parent, slides, factor, offset, rotation, translation] of arm.links) {
      const at = offset + (joint < 0 ? 0 : factor * q[joint]), turn = times(turns[parent + 1], rotation);
      const c = slides ? 1 : Math.cos(at), s = slides ? 0 : Math.sin(at);
      origins.push(moved(turn, [0, 0, slides ? at : 0], moved(turns[parent + 1], translation, origins[parent + 1])));
      turns.push(times(turn, [c, -s, 0, s, c, 0, 0, 0, 1]));
    }
    const [link, place] = arm.tool;
    return { points: [...origins.slice(1), moved(turns[link + 1], place, origins[link + 1])], axes: turns.slice(1).map((t) => [t[2], t[5], t[8]]) };
  }

  return class {
    // block: of the log; columns: what decodes its data; asked: called with a time that the reader chose.
    constructor(place, block, columns, asked) {
      Object.assign(this, { place, block, asked, arm: block.arm, time: 0, turned: 0, timer: 0 });
      const { kept, joints } = this.arm, { start, period } = block.joints[0];
      let at = 0;
      this.times = columns(0).map((step) => start + (at += step) * period);
      this.q = Array.from({ length: joints }, (_, k) => columns(k + 1));
      this.parents = [...this.arm.links.map((link) => link[1]), this.arm.tool[0]];
      const seen = Array.from({ length: 60 }, (_, i) => this.positions(this.times[Math.floor(i * (kept - 1) / 59)]));
      const points = seen.filter(Boolean).flatMap((q) => pose(this.arm, q).points);
      const heights = [0, ...points.map((p) => p[2])], low = Math.min(...heights), high = Math.max(...heights);
      this.middle = (low + high) / 2;
      this.reach = 1.05 * Math.max((high - low) / 2, ...points.map((p) => Math.hypot(p[0], p[1])), 0.01);
      this.build();
      this.at(this.times[0]);
    }

    build() {
      const scale = SCALES.find((each) => each <= 0.6 * this.reach) ?? 0.05, wide = scale / this.reach * SIZE / 2;
      this.place.innerHTML = `<svg class="plot" viewBox="0 0 212 118" role="img" aria-label="The arm from the side and from above"><path class="arm-scale" d="M4 ${SIZE - 3}h${wide}"/><text class="tiny" x="4" y="${SIZE - 6}">${scale} m</text><g></g><text x="2" y="114">from the side</text><text x="114" y="114">from above</text></svg><p class="small clock" role="status"></p><div class="tools"><button type="button">Play</button><label>time <input type="range" min="0" max="1000" value="0"></label><label>turn <input type="range" min="0" max="360" value="0"></label></div>`;
      [this.marks, this.clock, this.play] = ["g", ".clock", "button"].map((each) => this.place.querySelector(each));
      const [time, turn] = this.place.querySelectorAll("input");
      this.slider = time;
      time.addEventListener("input", () => this.asked(time.value / 1000 * this.block.end));
      turn.addEventListener("input", () => { this.turned = turn.value * Math.PI / 180; this.at(this.time); });
      this.play.addEventListener("click", () => this.timer ? this.stop() : this.start());
      this.place.hidden = false;
      this.place.parentElement.classList.add("beside");
    }

    // Joint positions at a time, straight between samples; null where one is not known.
    positions(time) {
      let low = 0, high = this.times.length - 1;
      while (high - low > 1) { const half = (low + high) >> 1; if (this.times[half] <= time) low = half; else high = half; }
      const share = Math.min(1, Math.max(0, (time - this.times[low]) / (this.times[high] - this.times[low] || 1)));
      const q = this.q.map((each) => each[low] === null || each[high] === null ? null : each[low] + share * (each[high] - each[low]));
      return q.includes(null) ? null : q;
    }

    at(time) {
      this.time = time;
      this.slider.value = String(1000 * time / this.block.end);
      const q = this.positions(time), contact = this.block.contacts.find((each) => each[3] <= time && time <= each[4]);
      this.clock.textContent = this.block.when(time) + (contact ? ", contact " + contact[0] : "") + (q ? "" : ": position not known");
      this.marks.replaceChildren();
      if (q === null) return;
      const { points, axes } = pose(this.arm, q), c = Math.cos(this.turned), s = Math.sin(this.turned);
      ArmPlayer.last = this;
      this.joints = points;
      this.view(points, axes, (p) => [c * p[0] + s * p[1], p[2]], this.middle, 0, contact);
      this.view(points, axes, (p) => [p[0], p[1]], 0, 112, contact);
    }

    view(points, axes, flat, middle, left, contact) {
      const per = SIZE / (2 * this.reach), seen = (p) => { const [x, y] = flat(p); return [left + SIZE / 2 + per * x, SIZE / 2 - per * (y - middle)]; };
      const at = points.map(seen), base = seen([0, 0, 0]), from = (k) => k < 0 ? base : at[k], hit = contact ? contact[5] : [];
      const line = (a, b) => "M" + a.map((v) => v.toFixed(1)).join(" ") + "L" + b.map((v) => v.toFixed(1)).join(" ");
      const dots = (which) => which.map((k) => line(at[k], at[k])).join("");
      const stroke = axes.map((axis, k) => { const [u, v] = flat(axis); return line([at[k][0] - 7 * u, at[k][1] + 7 * v], [at[k][0] + 7 * u, at[k][1] - 7 * v]); });
      const all = axes.map((_, k) => k);
      for (const [kind, d] of [["arm-base", line([base[0] - 8, base[1]], [base[0] + 8, base[1]])], ["arm", this.parents.map((p, k) => line(from(p), at[k])).join("")],
        ["arm-axis", stroke.join("")], ["arm-joint", dots(all.filter((k) => !hit.includes(k)))], ["arm-hit", dots(hit)], ["arm-tool", dots([axes.length])]]) {
        const path = document.createElementNS(SVG, "path");
        path.setAttribute("class", kind);
        path.setAttribute("d", d);
        this.marks.append(path);
      }
    }

    start() {
      let before = performance.now();
      const step = (now) => {
        const time = this.time + (now - before) / 1000;
        before = now;
        this.asked(Math.min(time, this.block.end));
        if (time < this.block.end) this.timer = requestAnimationFrame(step); else this.stop();
      };
      if (this.time >= this.block.end) this.time = 0;
      this.timer = requestAnimationFrame(step);
      this.play.textContent = "Pause";
    }

    stop() {
      cancelAnimationFrame(this.timer);
      this.timer = 0;
      this.play.textContent = "Play";
    }
  };
})();
